"""Chapter 7: where am I and how fast? An error-state Kalman filter.

The robot feels its accelerations and its rotation, and it knows where its legs' ends are relative to its
trunk. Integrating the first drifts within seconds. The second says nothing about the world, except that
the ends of standing legs move there in a known way. The filter (Bloesch et al., RSS 2012) combines the
two: the legs' ends are part of the state, the inertial unit predicts, and the legs' kinematics correct.

How the end of a standing leg moves is known if a foot rolls (:mod:`wfbook.leg_odometry`). Of a wheel,
three models can be chosen (:data:`WHEEL_MODELS`):

``"encoder"``
    the wheel's spin is measured; along the rolling direction ``ṗ = t r Ω`` with ``Ω`` the sum of the
    wheel's joint rate and of the calf's rotation.
``"slack"``
    it is not; the wheel may go anywhere along ``t`` (large process noise there) and nowhere across.
``"printed"``
    Paper A, eq. 44. It does not work, see :func:`wfbook.leg_odometry.expected_ends`.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv

from wfbook.go1 import IMU_POSITION, leg_kinematics
from wfbook.go1_dynamics import cross, dot
from wfbook.leg_odometry import (
    ACCELEROMETER_BIAS,
    BIASES,
    ENDS,
    GYRO_BIAS,
    LEG_END,
    POSITION,
    STATES,
    TURN,
    VELOCITY,
    BaseState,
    Rolling,
    expected_ends,
    propagate,
    spins,
)
from wfbook.reference import TICK
from wfbook.sensors import Reading, SensorNoise

WHEEL_MODELS = ("encoder", "slack", "printed")
"""Models of a rolling wheel, by name."""

TOUCH = 3.0
"""Force at which a leg feels the ground, N."""

_ONE = np.eye(3)
_EACH_JOINT = np.ones((4, 1, 3))
_BLOCKS = np.arange(12).reshape(4, 3)
_OWN_BLOCKS = [3 * n * _BLOCKS[:n, :, None] + _BLOCKS[:n, None, :] for n in (1, 2, 3, 4)]
"""Where the 3 by 3 blocks of n legs stand in a matrix of 3 n columns whose rows stand one after the other."""
_END_BLOCKS = STATES * (ENDS.start + _BLOCKS[:, :, None]) + ENDS.start + _BLOCKS[:, None, :]
"""Where the legs' ends' own blocks stand in the covariance, likewise."""


@dataclass(frozen=True)
class Tuning:
    """What the filter assumes besides the sensors' noise.

    Attributes:
        foot_slip, wheel_slip: random walk of standing feet and wheels, m/√s.
        slack: random walk of a wheel along its rolling direction if its spin is not known.
        kinematics: error of the legs' geometry, m.
        gate: squared Mahalanobis distance beyond which a leg's measurement is an outlier. A good one exceeds
            16.3 once in a thousand times.
        patience: outliers in a row after which a leg's end is taken to have slipped, and placed anew.
        landing: ticks for which a leg must touch before it is trusted.
    """

    foot_slip: float = 2e-3
    wheel_slip: float = 2e-3
    slack: float = 2.0
    kinematics: float = 3e-4
    gate: float = 16.3
    patience: int = 10
    landing: int = 5


class Estimator:
    """The filter.

    Args:
        wheel_model: one of :data:`WHEEL_MODELS`.
        noise: of the sensors.
        tuning: of the filter.
        dt: time between ticks.

    Attributes:
        state: the estimate; call :meth:`start` first.
        covariance: ``(27, 27)`` of its error. Of ends in the air it means nothing.
        trusted: ``(4,)`` bool, legs that stood at the last tick.
        outliers: how many measurements were refused so far.

    Raises:
        ValueError: no such wheel model.
    """

    def __init__(
        self,
        wheel_model: str = "encoder",
        noise: SensorNoise | None = None,
        tuning: Tuning | None = None,
        dt: float = TICK,
    ) -> None:
        if wheel_model not in WHEEL_MODELS:
            raise ValueError(f"wheel_model: {wheel_model!r} is none of {', '.join(WHEEL_MODELS)}")
        self.wheel_model, self.dt = wheel_model, dt
        self.noise = SensorNoise() if noise is None else noise
        self.tuning = Tuning() if tuning is None else tuning
        noise = self.noise
        self._white = np.repeat([noise.accelerometer, noise.gyro], 3) ** 2
        self._walk = dt * np.diag(np.repeat([noise.accelerometer_walk, noise.gyro_walk], 3) ** 2)

    def start(self, position: np.ndarray, R_wb: np.ndarray) -> None:
        """Begin at rest.

        Args:
            position: ``(3,)`` of the trunk: with the yaw it defines the world's frame.
            R_wb: ``(3, 3)`` orientation of the trunk, its tilt uncertain.
        """
        zero = np.zeros(3)
        self.state = BaseState(position + R_wb @ IMU_POSITION, zero, R_wb, zero, zero, np.zeros((4, 3)))
        noise = self.noise
        deviations = np.zeros(STATES)
        deviations[POSITION], deviations[VELOCITY] = 1e-4, 1e-2
        deviations[TURN] = noise.tilt, noise.tilt, 1e-4
        deviations[ACCELEROMETER_BIAS], deviations[GYRO_BIAS] = noise.accelerometer_bias, noise.gyro_bias
        self.covariance = np.diag(deviations**2)
        self.trusted = np.zeros(4, bool)
        self.omega_b = zero
        self.outliers = 0
        self._refused, self._touched = np.zeros(4, int), np.zeros(4, int)

    def update(
        self, reading: Reading, touching: np.ndarray, wheels: np.ndarray, normals: np.ndarray
    ) -> BaseState:
        """Take in the readings of one tick and return the new estimate.

        Args:
            reading: of the sensors.
            touching: ``(4,)`` bool, legs that feel the ground.
            wheels: ``(4,)`` bool, legs whose end effector is the wheel.
            normals: ``(4, 3)`` of the ground under each leg.
        """
        ends, jacobians, turning = leg_kinematics(reading.joint_angles)
        ends -= IMU_POSITION
        self._predict(reading, turning, wheels, normals)
        self._touched = touching * (self._touched + 1)
        standing = self._touched >= self.tuning.landing
        noise = (self.noise.joint_angle**2 * jacobians) @ jacobians.transpose(0, 2, 1)
        noise += self.tuning.kinematics**2 * _ONE
        printed = wheels & (self.wheel_model == "printed")
        doubtful = ~self.trusted | (self._refused > self.tuning.patience)
        for leg in np.flatnonzero(standing & doubtful):
            self._place(leg, ends[leg], noise[leg], printed)
        self._correct(np.flatnonzero(standing & ~doubtful), ends, noise, printed)
        self.trusted = standing
        self.omega_b = reading.gyro - self.state.gyro_bias
        return self.state

    def base(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the trunk's configuration ``(7,)`` and velocity ``(6,)``, in MuJoCo's convention."""
        state = self.state
        x, y, z, w = pin.Quaternion(state.R_wb).coeffs()
        position = state.r - state.R_wb @ IMU_POSITION
        velocity = state.v - state.R_wb @ cross(self.omega_b, IMU_POSITION)
        return np.array([*position, w, x, y, z]), np.concatenate([velocity, self.omega_b])

    def _predict(
        self, reading: Reading, turning: np.ndarray, wheels: np.ndarray, normals: np.ndarray
    ) -> None:
        """Propagate the estimate and its covariance over a tick."""
        noise, tuning, dt = self.noise, self.tuning, self.dt
        spin = spins(reading, turning, wheels & (self.wheel_model == "encoder"))
        axles = turning[:, :, 2]
        rolls = self.trusted & ~(wheels & (self.wheel_model == "printed"))
        rolling = Rolling(spin, axles, normals, wheels, rolls)
        self.state, F = propagate(self.state, reading, rolling, dt)
        P = F @ self.covariance @ F.T
        G = F[:, BIASES].copy()  # the inertial unit's noises act where its biases act
        G[BIASES] = 0.0
        P += (G * self._white) @ G.T
        P[BIASES, BIASES] += self._walk
        arms = F[ENDS, GYRO_BIAS].reshape(4, 3, 3) @ turning  # the joints turn a calf as the trunk does
        rates = noise.joint_rate**2 * _EACH_JOINT
        slip = dt * np.where(wheels, tuning.wheel_slip**2, tuning.foot_slip**2)
        if self.wheel_model == "encoder":
            rates[:, 0, 2] += noise.wheel_rate**2 * wheels
        Q = (arms * rates) @ arms.transpose(0, 2, 1) + slip[:, None, None] * _ONE
        if self.wheel_model == "slack":
            t = cross(axles @ self.state.R_wb.T, normals) * wheels[:, None]
            Q += tuning.slack**2 * dt * t[:, :, None] * t[:, None, :]
        P.ravel()[_END_BLOCKS] += self.trusted[:, None, None] * Q
        self.covariance = P

    def _place(self, leg: int, end: np.ndarray, noise: np.ndarray, printed: np.ndarray) -> None:
        """Put a leg's end where its kinematics say, as uncertain as they and the trunk are."""
        state = self.state
        p = state.p.copy()
        p[leg] = state.r + state.R_wb @ end
        if printed[leg]:
            p[leg] += state.R_wb[:, 0] * (state.R_wb[:, 0] @ state.v)
        self.state = state = replace(state, p=p)
        _, H = expected_ends(state, printed)
        T = np.eye(STATES)
        T[LEG_END[leg]] = -state.R_wb @ H[leg]
        T[LEG_END[leg], LEG_END[leg]] = 0.0
        self.covariance = T @ self.covariance @ T.T
        self.covariance[LEG_END[leg], LEG_END[leg]] += state.R_wb @ noise @ state.R_wb.T
        self._refused[leg] = 0

    def _correct(self, legs: np.ndarray, ends: np.ndarray, noise: np.ndarray, printed: np.ndarray) -> None:
        """Correct the estimate by the kinematics of standing legs, outliers excepted."""
        if not len(legs):
            return
        expected, H = expected_ends(self.state, printed)
        H, innovations = H[legs].reshape(-1, STATES), (ends - expected)[legs]
        HP = H @ self.covariance
        S = HP @ H.T
        blocks, own = _BLOCKS[: len(legs)], _OWN_BLOCKS[len(legs) - 1]
        single = S.take(own) + noise[legs]
        S.ravel()[own] = single
        distances = dot(innovations, np.linalg.solve(single, innovations[:, :, None])[:, :, 0])
        good = distances < self.tuning.gate
        self._refused[legs] = np.where(good, 0, self._refused[legs] + 1)
        innovations = innovations.ravel()
        if not good.all():
            self.outliers += int(np.sum(~good))
            if not good.any():
                return
            rows = blocks[good].ravel()
            S, HP, innovations = S[np.ix_(rows, rows)], HP[rows], innovations[rows]
        K = dposv(S, HP)[1].T  # S is symmetric and positive definite: LAPACK's Cholesky solver
        self.state = self.state.plus(K @ innovations)
        P = self.covariance - K @ HP
        self.covariance = 0.5 * (P + P.T)
