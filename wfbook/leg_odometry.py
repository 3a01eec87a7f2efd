"""Chapter 7: how trunk and legs' ends move, and what the encoders then say (Paper A, eq. 44).

The state and the two models that :mod:`wfbook.estimator` filters with, after Bloesch et al. (RSS 2012):
:func:`propagate` predicts one tick ahead from the inertial unit, :func:`expected_ends` says what the
encoders should then report. Both return their Jacobians.

How does the end of a standing leg move? A point foot would rest. The Go1's foot is a sphere of 20 mm
whose centre rolls as the calf turns above it: ``ṗ = ω × r n``. A walking robot that forgets this loses
several per cent of its way. A wheel does the same, but ``ω`` contains its spin.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import pinocchio as pin

from wfbook.go1 import FOOT_RADIUS, IMU_POSITION, WHEEL_RADIUS, leg_kinematics
from wfbook.go1_dynamics import GRAVITY, WHEEL_FLATNESS, contact_offsets, cross, dot, skew
from wfbook.sensors import Reading

STATES = 27
"""Size of the error: position, velocity, orientation, two biases, four legs' ends."""

POSITION, VELOCITY, TURN, ACCELEROMETER_BIAS, GYRO_BIAS = (slice(3 * i, 3 * i + 3) for i in range(5))
BIASES, ENDS = slice(9, 15), slice(15, STATES)
LEG_END = [slice(15 + 3 * leg, 18 + 3 * leg) for leg in range(4)]
"""Where each part stands in the error."""

_ONE, _UNMOVED = np.eye(3), np.eye(STATES)


@dataclass(frozen=True)
class BaseState:
    """What is estimated.

    The error between two states is a vector ``(27,)``: differences of ``r``, ``v``, then the rotation vector
    in the world from one orientation to the other, then differences of the biases and of the ends.

    Attributes:
        r, v: ``(3,)`` position and velocity of the inertial unit in the world.
        R_wb: ``(3, 3)`` orientation of the trunk.
        accelerometer_bias, gyro_bias: ``(3,)`` in the trunk's frame.
        p: ``(4, 3)`` ends of the legs (centres of foot and wheel) in the world.
    """

    r: np.ndarray
    v: np.ndarray
    R_wb: np.ndarray
    accelerometer_bias: np.ndarray
    gyro_bias: np.ndarray
    p: np.ndarray

    def plus(self, error: np.ndarray) -> Self:
        """Return the state that differs from this one by an error ``(27,)``."""
        return type(self)(
            self.r + error[POSITION],
            self.v + error[VELOCITY],
            pin.exp3(error[TURN]) @ self.R_wb,
            self.accelerometer_bias + error[ACCELEROMETER_BIAS],
            self.gyro_bias + error[GYRO_BIAS],
            self.p + error[ENDS].reshape(4, 3),
        )

    def moved(self, shift: np.ndarray, turn: np.ndarray) -> Self:
        """Return the state of the same robot elsewhere: turned about the origin, then shifted.

        Args:
            shift: ``(3,)`` in the world.
            turn: ``(3,)`` rotation vector in the world.
        """
        R = pin.exp3(np.asarray(turn, float))
        moved = self.r @ R.T + shift, self.v @ R.T, R @ self.R_wb
        return type(self)(*moved, self.accelerometer_bias, self.gyro_bias, self.p @ R.T + shift)

    def minus(self, other: Self) -> np.ndarray:
        """Return the error ``(27,)`` with ``other.plus(error)`` being this state."""
        return np.concatenate(
            [
                self.r - other.r,
                self.v - other.v,
                pin.log3(self.R_wb @ other.R_wb.T),
                self.accelerometer_bias - other.accelerometer_bias,
                self.gyro_bias - other.gyro_bias,
                (self.p - other.p).ravel(),
            ]
        )


@dataclass(frozen=True)
class Rolling:
    """How the legs' ends move during a tick.

    Attributes:
        spin: ``(4, 3)`` angular velocity of what rolls (calf or wheel) relative to the trunk, in its frame.
        axles: ``(4, 3)`` of the wheels, in the trunk's frame.
        normals: ``(4, 3)`` of the ground, in the world.
        wheels: ``(4,)`` bool, whether the wheel rolls; if not, the foot.
        rolls: ``(4,)`` bool; the other ends rest.
    """

    spin: np.ndarray
    axles: np.ndarray
    normals: np.ndarray
    wheels: np.ndarray
    rolls: np.ndarray

    def levers(self, R_wb: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the vectors from the contacts to the ends, and what they change with the trunk's turning.

        A sphere's is ``r n`` whatever turns. A wheel's is nearly that, but one that leans (by 7 to
        18 degrees in a typical run) touches beside its middle and goes 1 to 4 % farther a turn than one whose
        lever is ``r n``.

        Returns:
            ``(4, 3)`` and ``(4, 3, 3)``, in the world.
        """
        if not self.wheels.any():
            return FOOT_RADIUS * self.rolls[:, None] * self.normals, np.zeros((4, 3, 3))
        axles = self.axles @ R_wb.T
        lever = -contact_offsets(axles, self.normals, self.wheels) * self.rolls[:, None]
        flat = np.where(self.wheels & self.rolls, WHEEL_FLATNESS, 0.0)[:, None]
        camber = dot(axles, self.normals)[:, None]
        square = WHEEL_RADIUS**2 - flat * camber**2
        lean = flat / np.sqrt(square)
        along = flat * camber / square * lever - lean * axles
        turned = along[:, :, None] * cross(axles, self.normals)[:, None, :]
        turned += (lean * camber)[:, :, None] * skew(axles)
        return lever, turned


def propagate(
    state: BaseState, reading: Reading, rolling: Rolling, dt: float
) -> tuple[BaseState, np.ndarray]:
    """Return the state one tick later, and the Jacobian of its error.

    The inertial unit's readings, less their biases, are integrated; the orientation half-way serves for
    the whole tick. A standing leg's end rolls with ``ṗ = ω × r n``, where ``ω`` is the angular velocity of
    what rolls: the calf under a foot, the wheel on a wheel.

    Args:
        state: now.
        reading: of the inertial unit, over the tick.
        rolling: what the legs' ends do.
        dt: duration of the tick.

    Returns:
        State, and ``(27, 27)``.
    """
    force = reading.accelerometer - state.accelerometer_bias
    omega_b = reading.gyro - state.gyro_bias
    half = pin.exp3(0.5 * dt * omega_b)
    R = state.R_wb @ half
    force_w = R @ force
    acceleration = force_w + GRAVITY
    omega = (omega_b + rolling.spin) @ R.T
    lever, lever_turned = rolling.levers(R)
    later = BaseState(
        state.r + dt * state.v + 0.5 * dt * dt * acceleration,
        state.v + dt * acceleration,
        R @ half,
        state.accelerometer_bias,
        state.gyro_bias,
        state.p + dt * cross(omega, lever),
    )
    F = _UNMOVED.copy()
    faster = np.empty((3, 9))  # acceleration by orientation, accelerometer's and gyro's bias
    faster[:, :3] = -skew(force_w)
    faster[:, 3:6] = -R
    faster[:, 6:] = -0.5 * dt * faster[:, :3] @ R  # half-way, half of what the gyro adds is there
    F[VELOCITY, 6:15] = dt * faster
    F[POSITION, 6:15] = 0.5 * dt * dt * faster
    F[POSITION, VELOCITY] = dt * _ONE
    F[TURN, GYRO_BIAS] = -dt * R
    lever_x, omega_x = skew(lever), skew(omega)
    turned = lever_x @ omega_x + omega_x @ lever_turned
    F[ENDS, TURN] = dt * turned.reshape(12, 3)
    F[ENDS, GYRO_BIAS] = dt * ((lever_x - 0.5 * dt * turned) @ R).reshape(12, 3)
    return later, F


def expected_ends(state: BaseState, printed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where the legs' ends should be, seen from the inertial unit, and its Jacobian (Paper A, eq. 44).

    A leg's kinematics measure ``R_wbᵀ(p − r)``. Eq. 44 adds ``W v`` for a wheel, ``W = [1, 0, 0]ᵀ``: the
    forward velocity of the trunk.

    Not as printed: it adds metres a second to metres. It also says the wrong thing. With the wheel's end
    taken to rest, as feet do, the measured ``p − r`` of a wheel that rolls along with the trunk does not
    change, so ``r + v`` may not change either: ``v̇ = −v``, and whatever speed the inertial unit reports is
    corrected away, only within a second instead of at once.

    Args:
        state: of the robot.
        printed: ``(4,)`` bool, the wheels to which eq. 44 is applied as it is printed.

    Returns:
        ``(4, 3)`` and ``(4, 3, 27)``.
    """
    R_bw = state.R_wb.T
    distance = state.p - state.r
    ends = distance @ state.R_wb
    H = np.zeros((4, 3, STATES))
    H[:, :, POSITION] = -R_bw
    H[:, :, TURN] = R_bw @ skew(distance)
    for leg in range(4):
        H[leg, :, LEG_END[leg]] = R_bw
    if printed.any():
        ends[printed, 0] -= R_bw[0] @ state.v
        H[printed, 0, VELOCITY] -= R_bw[0]
        H[printed, 0, TURN] -= R_bw[0] @ skew(state.v)
    return ends, H


def spins(reading: Reading, turning: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return the angular velocities of what rolls below each leg, relative to the trunk and in its frame.

    Args:
        reading: of the encoders.
        turning: ``(4, 3, 3)`` Jacobians of the calves' angular velocities; their last columns are the axles.
        counted: ``(4,)`` bool, legs whose wheel turns on its axle, too, and has an encoder there.

    Returns:
        ``(4, 3)``
    """
    calves = (turning @ reading.joint_rates[:, :, None])[:, :, 0]
    if not counted.any():
        return calves
    return calves + (counted * reading.wheel_rates)[:, None] * turning[:, :, 2]


def leg_velocities(reading: Reading, R_wb: np.ndarray, rolling: Rolling) -> np.ndarray:
    """Return the velocity of the inertial unit that each leg measures if it stands.

    A leg's end moves with ``ω × r n`` in the world, and with ``J q̇ + ω_b × e`` relative to the inertial unit;
    the difference is how the inertial unit moves.

    Args:
        reading: of encoders and gyro.
        R_wb: ``(3, 3)`` orientation of the trunk.
        rolling: what the legs' ends do.

    Returns:
        ``(4, 3)`` in the world.
    """
    ends, jacobians, _ = leg_kinematics(reading.joint_angles)
    stick = (jacobians @ reading.joint_rates[:, :, None])[:, :, 0]
    stick += cross(reading.gyro, ends - IMU_POSITION)
    lever, _ = rolling.levers(R_wb)
    return cross((reading.gyro + rolling.spin) @ R_wb.T, lever) - stick @ R_wb.T
