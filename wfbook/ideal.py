"""Chapter 7: two robots that exist on paper only, to ask one question of the filter at a time.

MuJoCo's robot slips when it likes and its encoders are misplaced; a filter can only approximate that. The
robot of :func:`sway` stands on four rolling feet, and nothing is left to chance but the noise of
:class:`~wfbook.sensors.SensorNoise` and the slip of :class:`~wfbook.estimator.Tuning`: errors must be as
large as the filter says (:func:`wfbook.kalman.nees`). That of :func:`coast` rolls and does nothing else.
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from wfbook.estimator import Estimator, Tuning
from wfbook.go1 import FOOT_RADIUS, IMU_POSITION, WHEEL_RADIUS, leg_angles, leg_kinematics, nominal
from wfbook.go1_dynamics import GRAVITY
from wfbook.leg_odometry import STATES, BaseState
from wfbook.recording import BASE
from wfbook.reference import TICK
from wfbook.sensors import Reading, SensorNoise

_UP = np.tile([0.0, 0.0, 1.0], (4, 1))
_SWAY = np.array([0.03, 0.03, 0.015, 0.06, 0.06, 0.08])
_RATE = 2 * np.pi * np.array([0.7, 0.9, 0.5, 0.6, 0.8, 0.4])


def sway(
    seed: int, ticks: int = 400, foot_slip: float | None = None, tuning: Tuning | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Filter a robot that sways above its rolling feet.

    Args:
        seed: of the noise, of the sway and of the filter's first error.
        ticks: how long.
        foot_slip: random walk of the feet, m/√s; by default what the filter assumes.
        tuning: of the filter; its gate is open, and legs are trusted from the first tick on.

    Returns:
        ``(ticks, 15)`` errors and ``(ticks, 15, 15)`` their covariances, as the filter has them.
    """
    tuning = replace(tuning or Tuning(), gate=np.inf, landing=1)
    slip = tuning.foot_slip if foot_slip is None else foot_slip
    random = np.random.default_rng(seed)
    white = random.standard_normal
    noise = SensorNoise(joint_offset=0.0)
    estimator = Estimator("encoder", noise, tuning)
    robot = nominal()
    feet = np.array(robot["hip_offsets"]) + np.array([0.0, 0.0, robot["com_height"] + FOOT_RADIUS])
    phase = random.uniform(0, 2 * np.pi, 6)

    def pose(t: float) -> tuple[np.ndarray, np.ndarray]:
        moved = _SWAY * np.sin(_RATE * t + phase)
        return moved[:3] + np.array([0.0, 0.0, robot["com_height"]]), pin.exp3(moved[3:])

    def imu(t: float) -> np.ndarray:
        position, R_wb = pose(t)
        return position + R_wb @ IMU_POSITION

    def angles(position: np.ndarray, R_wb: np.ndarray) -> np.ndarray:
        return _angles_of((feet - position) @ R_wb)

    position, R_wb = pose(0.0)
    estimator.start(position, R_wb)
    r, v = imu(0.0), (imu(TICK) - imu(-TICK)) / (2 * TICK)
    estimator.state = replace(estimator.state, v=v)
    first_error = np.sqrt(np.diag(estimator.covariance)) * white(STATES)
    estimator.state = estimator.state.plus(first_error)
    bias, drift = np.zeros(3), np.zeros(3)
    before = angles(position, R_wb)
    errors, covariances = [], []
    for k in range(ticks):
        _, R_next = pose(TICK * (k + 1))
        omega = pin.log3(R_wb.T @ R_next) / TICK
        R_middle = R_wb @ pin.exp3(0.5 * TICK * omega)
        a = (imu(TICK * (k + 2)) - 2 * imu(TICK * (k + 1)) + imu(TICK * k)) / TICK**2
        r, v = r + TICK * v + 0.5 * TICK**2 * a, v + TICK * a
        trunk = r - R_next @ IMU_POSITION
        rates = (angles(trunk, R_next) - before) / TICK if k else np.zeros((4, 3))
        _, _, turning = leg_kinematics(before)
        spin = np.einsum("lij,lj->li", turning, rates)
        feet = feet + TICK * np.cross((omega + spin) @ R_middle.T, FOOT_RADIUS * _UP)
        feet = feet + slip * TICK**0.5 * white((4, 3))
        R_wb = R_next
        before = angles(trunk, R_wb)
        bias = bias + noise.accelerometer_walk * TICK**0.5 * white(3)
        drift = drift + noise.gyro_walk * TICK**0.5 * white(3)
        measured = _angles_of(leg_kinematics(before)[0] + tuning.kinematics * white((4, 3)))
        reading = Reading(
            R_middle.T @ (a - GRAVITY) + bias + noise.accelerometer * white(3),
            omega + drift + noise.gyro * white(3),
            measured + noise.joint_angle * white((4, 3)),
            rates + noise.joint_rate * white((4, 3)),
            np.zeros(4),
        )
        state = estimator.update(reading, np.ones(4, bool), np.zeros(4, bool), _UP)
        errors.append(BaseState(r, v, R_wb, bias, drift, feet).minus(state)[:BASE])
        covariances.append(estimator.covariance[:BASE, :BASE].copy())
    return np.array(errors), np.array(covariances)


def coast(
    speed: float, wheel_model: str = "encoder", duration: float = 3.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Let a robot roll on four wheels, legs still, at a constant speed, and ask the filter how fast it is.

    The filter begins with the right speed.

    Args:
        speed: along x, m/s.
        wheel_model: one of :data:`wfbook.estimator.WHEEL_MODELS`.
        duration: how long, s.
        seed: of the sensors' noise; biases there are none.

    Returns:
        ``(N,)`` times and ``(N,)`` speeds along x that the filter believes.

    Raises:
        ValueError: no such wheel model.
    """
    white = np.random.default_rng(seed).standard_normal
    noise, robot = SensorNoise(), nominal()
    home = np.array(robot["joint_angles"]).reshape(4, 3)
    estimator = Estimator(wheel_model, noise)
    estimator.start(np.array([0.0, 0.0, 0.3]), np.eye(3))
    estimator.state = replace(estimator.state, v=np.array([speed, 0.0, 0.0]))
    believed = []
    for _ in range(round(duration / TICK)):
        reading = Reading(
            -GRAVITY + noise.accelerometer * white(3),
            noise.gyro * white(3),
            home + noise.joint_angle * white((4, 3)),
            noise.joint_rate * white((4, 3)),
            speed / WHEEL_RADIUS + noise.wheel_rate * white(4),
        )
        estimator.update(reading, np.ones(4, bool), np.ones(4, bool), _UP)
        believed.append(estimator.state.v[0])
    return TICK * np.arange(1, len(believed) + 1), np.array(believed)


def _angles_of(ends: np.ndarray) -> np.ndarray:
    """Return the joint angles ``(4, 3)`` that put the legs' ends ``(4, 3)`` in the trunk's frame there."""
    return np.array([leg_angles(leg, end) for leg, end in enumerate(ends)])
