"""Chapter 7: a run's sensor readings, recorded once, to be filtered again and again.

What a robot measures does not depend on who listens. So a run in which the controller saw the truth is
recorded with the noise of some sensors, and any filter can be asked afterwards what it would have believed,
and how sure it would have been (:func:`estimate`), or nobody but the legs and the gyro (:func:`odometry`).
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np
import pinocchio as pin

from wfbook.estimator import TOUCH, Estimator, Tuning
from wfbook.go1 import IMU_POSITION, leg_kinematics
from wfbook.kalman import nees
from wfbook.leg_odometry import POSITION, VELOCITY, BaseState, Rolling, leg_velocities, spins
from wfbook.sensors import Reading, SensorNoise, Sensors, imu_motion

if TYPE_CHECKING:
    from wfbook.runs import Run

BASE = 15
"""States that are always there: position, velocity, orientation, two biases; the legs' ends come after."""


@dataclass(frozen=True)
class Recording:
    """What the sensors of a robot said, ``N`` ticks, and what was true.

    Attributes:
        t: ``(N,)`` time; 0 when the plan begins.
        readings: of the sensors.
        touching: ``(N, 4)`` bool, legs that feel the ground.
        wheels: ``(N, 4)`` bool, legs whose end effector is the wheel.
        normals: ``(N, 4, 3)`` of the ground under each leg.
        truth: positions, velocities, orientations and biases; their ``p`` are not used.
        position: ``(3,)`` of the trunk at the start, which the filter is told.
        R_wb: ``(3, 3)`` orientation of the trunk that it is told, a little wrong.
        noise: of the sensors.
    """

    t: np.ndarray
    readings: list[Reading]
    touching: np.ndarray
    wheels: np.ndarray
    normals: np.ndarray
    truth: list[BaseState]
    position: np.ndarray
    R_wb: np.ndarray
    noise: SensorNoise

    @property
    def path(self) -> np.ndarray:
        """``(N, 3)`` true positions of the inertial unit."""
        return np.array([state.r for state in self.truth])

    @property
    def distance(self) -> float:
        """How far the inertial unit got from the plan's start on, horizontally."""
        start, end = self.truth[int(np.searchsorted(self.t, 0.0))].r, self.truth[-1].r
        return float(np.linalg.norm((end - start)[:2]))

    def without_legs(self) -> Self:
        """Return the recording of a robot that does not feel its legs: the inertial unit is alone."""
        return replace(self, touching=np.zeros_like(self.touching))

    def kicked(self, leg: int, start: float, duration: float, turn: float) -> Self:
        """Return the recording with one leg's thigh encoder wrong for a while: an outlier to be found.

        Args:
            leg: index in :data:`wfbook.modes.LEGS`.
            start: when it begins, s.
            duration: how long it lasts, s.
            turn: by how much it is wrong, rad.
        """
        readings = list(self.readings)
        for k in np.flatnonzero((self.t >= start) & (self.t < start + duration)):
            angles = readings[k].joint_angles.copy()
            angles[leg, 1] += turn
            readings[k] = replace(readings[k], joint_angles=angles)
        return replace(self, readings=readings)


@dataclass(frozen=True)
class Estimate:
    """What a filter believed during a recording, and by how much it was wrong.

    Attributes:
        t: ``(N,)`` time.
        base: ``(N, 7)`` the trunk's configuration, in MuJoCo's convention.
        base_velocity: ``(N, 6)`` likewise.
        path: ``(N, 3)`` estimated positions of the inertial unit.
        error: ``(N, 15)`` what is true less what is estimated, in the order of
            :class:`wfbook.leg_odometry.BaseState`'s error, without the ends.
        covariance: ``(N, 15, 15)`` of this error, as the filter has it.
        outliers: ``(N,)`` measurements refused so far.
        distance: that was travelled, m.
    """

    t: np.ndarray
    base: np.ndarray
    base_velocity: np.ndarray
    path: np.ndarray
    error: np.ndarray
    covariance: np.ndarray
    outliers: np.ndarray
    distance: float

    @property
    def deviations(self) -> np.ndarray:
        """``(N, 15)`` standard deviations that the filter has of its error."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def drift_percent(self) -> float:
        """By how much the displacement since the plan's start is wrong, in per cent of the distance."""
        off = self.error[-1, POSITION] - self.error[int(np.searchsorted(self.t, 0.0)), POSITION]
        return 100.0 * float(np.linalg.norm(off)) / self.distance

    @property
    def velocity_rms(self) -> float:
        """Root mean square of the velocity's error since the plan's start, m/s."""
        slow = self.error[self.t >= 0.0, VELOCITY]
        return float(np.sqrt(np.mean(np.sum(slow**2, axis=1))))

    def nees(self, part: slice = slice(0, BASE)) -> np.ndarray:
        """Return the normalised error squared ``(N,)`` of some states (:func:`wfbook.kalman.nees`)."""
        return nees(self.error[:, part], self.covariance[:, part, part])


def record(run: "Run", seed: int = 0, noise: SensorNoise | None = None) -> Recording:
    """Sense along a run, as if the robot had done the same with these sensors.

    Args:
        run: with any controller.
        seed: of the sensors' noise.
        noise: of the sensors.
    """
    sensors = Sensors(seed, noise, float(run.t[1] - run.t[0]))
    told = sensors.tilted(pin.Quaternion(*run.qpos[0, 3:7]).toRotationMatrix())
    regions, below = run.terrain.regions, np.zeros(4, int)
    readings, normals, truth = [], [], []
    for k in range(len(run.t)):
        if len(regions) > 1:
            found = [run.terrain.region_at(x, y) for x, y in run.p[k, :, :2]]
            below = np.array([old if new is None else new for old, new in zip(below, found, strict=True)])
        normals.append([regions[i].normal for i in below])
        readings.append(sensors.read(run.qpos[k], run.qvel[k]))
        R_wb, v = imu_motion(run.qpos[k], run.qvel[k])
        r = run.qpos[k, :3] + R_wb @ IMU_POSITION
        biases = sensors.accelerometer_bias, sensors.gyro_bias
        truth.append(BaseState(r, v, R_wb, *biases, np.zeros((4, 3))))
    return Recording(
        run.t,
        readings,
        np.linalg.norm(run.contact_force, axis=2) > TOUCH,
        run.end_effector == 1,
        np.array(normals),
        truth,
        run.qpos[0, :3],
        told,
        sensors.noise,
    )


def estimate(
    recording: Recording,
    wheel_model: str = "encoder",
    noise: SensorNoise | None = None,
    tuning: Tuning | None = None,
) -> Estimate:
    """Filter a recording.

    Args:
        recording: of the sensors.
        wheel_model: one of :data:`wfbook.estimator.WHEEL_MODELS`.
        noise: that the filter assumes; by default that of the sensors.
        tuning: of the filter.

    Raises:
        ValueError: no such wheel model.
    """
    dt = float(recording.t[1] - recording.t[0])
    estimator = Estimator(wheel_model, noise or recording.noise, tuning, dt)
    estimator.start(recording.position, recording.R_wb)
    log: dict[str, list] = {
        name: [] for name in ("base", "base_velocity", "path", "error", "covariance", "outliers")
    }
    for k, reading in enumerate(recording.readings):
        state = estimator.update(reading, recording.touching[k], recording.wheels[k], recording.normals[k])
        base, velocity = estimator.base()
        log["base"].append(base)
        log["base_velocity"].append(velocity)
        log["path"].append(state.r)
        log["error"].append(recording.truth[k].minus(state)[:BASE])
        log["covariance"].append(estimator.covariance[:BASE, :BASE].copy())
        log["outliers"].append(estimator.outliers)
    arrays = {name: np.array(values) for name, values in log.items()}
    return Estimate(recording.t, **arrays, distance=recording.distance)


def odometry(recording: Recording, rolling: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Add up what the standing legs measure, without a filter and without an accelerometer.

    The gyro turns the trunk; the trunk's velocity is the mean of what the standing legs say
    (:func:`wfbook.leg_odometry.leg_velocities`).

    Args:
        recording: of the sensors.
        rolling: whether feet and wheels roll; if not, the ends of standing legs are taken to rest.

    Returns:
        ``(N, 3)`` and ``(N, 3)``: position and velocity of the inertial unit in the world.
    """
    dt = float(recording.t[1] - recording.t[0])
    R_wb, v = recording.R_wb, np.zeros(3)
    r = recording.position + R_wb @ IMU_POSITION
    path, velocities = [], []
    for k, reading in enumerate(recording.readings):
        R_wb = R_wb @ pin.exp3(dt * reading.gyro)
        standing, wheels = recording.touching[k], recording.wheels[k]
        _, _, turning = leg_kinematics(reading.joint_angles)
        spin = spins(reading, turning, wheels)
        model = Rolling(spin, turning[:, :, 2], recording.normals[k], wheels, standing & rolling)
        if standing.any():
            v = leg_velocities(reading, R_wb, model)[standing].mean(axis=0)
        r = r + dt * v
        path.append(r)
        velocities.append(v)
    return np.array(path), np.array(velocities)
