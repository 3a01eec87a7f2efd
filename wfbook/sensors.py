"""Chapter 7: what the Go1 can measure, with the noise and the biases of affordable sensors.

The robot has an inertial measurement unit in its trunk, an encoder in each motor, and here one on each
wheel's axle. It has no sensor for its position or its velocity: those are the estimator's to find
(:mod:`wfbook.estimator`).

Readings are made from two successive true states, so that a recorded run can be sensed again, with other
noise. The IMU reports what happened *between* the two, as those that integrate internally do; sampled at an
instant, an impact would be missed or counted twice.
"""

from dataclasses import asdict, dataclass
from typing import Self

import numpy as np
import pinocchio as pin

from wfbook.go1 import IMU_POSITION
from wfbook.go1_dynamics import GRAVITY, MOTORS, WHEELS, cross
from wfbook.reference import TICK


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations. White noise is that of one sample, at 500 Hz; a bias is drawn once a run.

    Attributes:
        accelerometer, gyro: white noise, m/s² and rad/s.
        accelerometer_bias, gyro_bias: of the biases at the start.
        accelerometer_walk, gyro_walk: of the biases' random walks, per √s.
        joint_angle, joint_rate: of the motors' encoders.
        joint_offset: by which an encoder's zero is misplaced.
        wheel_rate: of the wheels' encoders.
        tilt: of the roll and pitch that the estimator is told at the start.
    """

    accelerometer: float = 0.05
    gyro: float = 0.003
    accelerometer_bias: float = 0.05
    gyro_bias: float = 0.005
    accelerometer_walk: float = 1e-3
    gyro_walk: float = 1e-4
    joint_angle: float = 3e-4
    joint_rate: float = 0.02
    joint_offset: float = 5e-4
    wheel_rate: float = 0.05
    tilt: float = 2e-3

    def scaled(self, factor: float) -> Self:
        """Return sensors that are so many times worse, in everything."""
        return type(self)(**{name: factor * value for name, value in asdict(self).items()})


@dataclass(frozen=True)
class Reading:
    """What the sensors say at one tick.

    Attributes:
        accelerometer: ``(3,)`` specific force ``R_wbᵀ(a − g)`` at the IMU, mean since the last tick.
        gyro: ``(3,)`` angular velocity of the trunk in its own frame, likewise.
        joint_angles: ``(4, 3)`` hip, thigh and calf of each leg.
        joint_rates: ``(4, 3)``.
        wheel_rates: ``(4,)`` of the wheels relative to the calves.
    """

    accelerometer: np.ndarray
    gyro: np.ndarray
    joint_angles: np.ndarray
    joint_rates: np.ndarray
    wheel_rates: np.ndarray


class Sensors:
    """The sensors of one robot.

    Args:
        seed: of all noise and biases.
        noise: how good the sensors are.
        dt: time between readings.

    Attributes:
        accelerometer_bias, gyro_bias: ``(3,)`` present values, for plots: a robot can't know them.
        tilt: ``(3,)`` rotation vector by which the estimator's first orientation is wrong; yaw is not, it
            is what the world's x axis means.
    """

    def __init__(self, seed: int = 0, noise: SensorNoise | None = None, dt: float = TICK) -> None:
        self.noise = noise = SensorNoise() if noise is None else noise
        self.dt = dt
        self._random = random = np.random.default_rng([seed, 44])
        self.accelerometer_bias = noise.accelerometer_bias * random.standard_normal(3)
        self.gyro_bias = noise.gyro_bias * random.standard_normal(3)
        self.tilt = noise.tilt * np.array([*random.standard_normal(2), 0.0])
        self._offsets = noise.joint_offset * random.standard_normal((4, 3))
        self._before: tuple[np.ndarray, np.ndarray] | None = None

    def tilted(self, R_wb: np.ndarray) -> np.ndarray:
        """Return an orientation ``(3, 3)`` as the estimator is told it at the start."""
        return pin.exp3(self.tilt) @ R_wb

    def read(self, qpos: np.ndarray, qvel: np.ndarray) -> Reading:
        """Return the readings at a true state, which is ``dt`` after that of the last call.

        Args:
            qpos: ``(23,)`` MuJoCo's configuration.
            qvel: ``(22,)`` MuJoCo's velocity.
        """
        noise, white = self.noise, self._random.standard_normal
        R_wb, velocity = imu_motion(qpos, qvel)
        R_before, velocity_before = self._before or (R_wb, velocity)
        turn = pin.log3(R_before.T @ R_wb)
        R_middle = R_before @ pin.exp3(0.5 * turn)
        force = R_middle.T @ ((velocity - velocity_before) / self.dt - GRAVITY)
        self._before = R_wb, velocity
        self.accelerometer_bias = self.accelerometer_bias + noise.accelerometer_walk * self.dt**0.5 * white(3)
        self.gyro_bias = self.gyro_bias + noise.gyro_walk * self.dt**0.5 * white(3)
        return Reading(
            force + self.accelerometer_bias + noise.accelerometer * white(3),
            turn / self.dt + self.gyro_bias + noise.gyro * white(3),
            qpos[MOTORS + 1].reshape(4, 3) + self._offsets + noise.joint_angle * white((4, 3)),
            qvel[MOTORS].reshape(4, 3) + noise.joint_rate * white((4, 3)),
            qvel[WHEELS] + noise.wheel_rate * white(4),
        )


def imu_motion(qpos: np.ndarray, qvel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the trunk's orientation ``R_wb`` ``(3, 3)`` and the IMU's velocity ``(3,)`` in the world."""
    R_wb = pin.Quaternion(*qpos[3:7]).toRotationMatrix()
    return R_wb, qvel[:3] + R_wb @ cross(qvel[3:6], IMU_POSITION)
