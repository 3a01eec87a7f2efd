"""Chapter 10: how the robot accelerates while its wheels keep to the ground (Paper B, eqs 2 to 5).

The configuration of eq. 1, trunk, legs and arm, is that of :class:`wfbook.omni.robot.OmniDynamics`.

Eq. 4 asks for accelerations and contact forces at once. It has one answer if no contact row follows from the
others. The legs have no abduction, so four wheels that are each held in all three directions are too much:
:data:`ROWS` holds two diagonal wheels in x, y and z, and the other two in x and z alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wfbook.go1_dynamics import cross
from wfbook.modes import LEGS
from wfbook.omni.robot import (
    GRIPPER_V,
    NU,
    NV,
    STEERS_V,
    WHEEL_RADIUS,
    WHEELS_V,
    OmniDynamics,
    contact_offsets,
)

ROWS = {"FL": "xyz", "FR": "xz", "RL": "xz", "RR": "xyz"}
"""Directions in which each wheel's contact is held: x rolling, y across, z normal. Ten rows of rank ten."""

LOCKED = (*STEERS_V, *WHEELS_V, GRIPPER_V)
"""Indices in ``qvel`` of what is locked in the paper's legged mode, and in its 41 states."""

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Constrained:
    """An answer to Paper B, eq. 4.

    Attributes:
        acceleration: ``(29,)`` of trunk, in its own frame, and joints.
        force: ``(n_c,)`` of the contact rows, in their order.
    """

    acceleration: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class Touch:
    """How a wheel touches level ground, in the world's axes.

    The contact is the point of the tyre that touches. It turns with the wheel: rolling without slip means
    that it stands still.

    Attributes:
        J: ``(6, 29)`` Jacobian of the tyre's linear and angular velocity there.
        drift: ``(6,)`` rate of that velocity when the generalised acceleration is zero.
        R_wc: ``(3, 3)`` the contact's axes: x ahead, y to the left along the axle, z up.
        spin: rate by which they turn about z.
    """

    J: np.ndarray
    drift: np.ndarray
    R_wc: np.ndarray
    spin: float


def contact_axes(axle: np.ndarray) -> np.ndarray:
    """Return a wheel's contact axes ``(3, 3)`` on level ground; its axle ``(3,)`` points to the left."""
    y = np.array([axle[0], axle[1], 0.0]) / np.hypot(axle[0], axle[1])
    return np.column_stack([cross(y, _UP), y, _UP])


def touch(dynamics: OmniDynamics, leg: str) -> Touch:
    """Return how a wheel touches level ground.

    Args:
        dynamics: updated.
        leg: its name.
    """
    axle = dynamics.placement(f"{leg}_axle")[1][:, 1]
    wheel = WHEELS_V[LEGS.index(leg)]
    J, drift = dynamics.jacobian(f"{leg}_axle"), dynamics.drift(f"{leg}_axle")
    turning = cross(J[3:] @ dynamics.velocity, axle)  # how the fork turns the axle
    J[3:, wheel] += axle
    drift[3:] += dynamics.velocity[wheel] * turning
    rate = J[3:] @ dynamics.velocity
    arm = contact_offsets(axle[None], _UP[None])[0]
    # The arm points along −(n − (n · a) a), and turns with the axle a.
    below = _UP - axle[2] * axle
    below_rate = -turning[2] * axle - axle[2] * turning
    along = arm / WHEEL_RADIUS
    arm_rate = -WHEEL_RADIUS * (below_rate - along * (along @ below_rate)) / np.linalg.norm(below)
    J[:3] -= np.cross(arm, J[3:], axisb=0, axisc=0)
    drift[:3] += cross(drift[3:], arm) + cross(rate, arm_rate)
    R_wc = contact_axes(axle)
    return Touch(J, drift, R_wc, float(-R_wc[:, 0] @ turning / np.hypot(axle[0], axle[1])))


def contact_rows(dynamics: OmniDynamics, rows: dict[str, str] = ROWS) -> tuple[np.ndarray, np.ndarray]:
    """Return Jacobian ``J_c (n_c, 29)`` and drift ``J̇_c q̇ (n_c,)`` of the contacts (Paper B, eq. 3).

    Not as printed: the paper says that it holds along the normal. It has to hold along every direction in
    which the contact does not slip.

    Args:
        dynamics: updated.
        rows: of each leg in contact, by its name, which directions are held.

    Raises:
        ValueError: an unknown leg or direction.
    """
    jacobian, drift = [np.zeros((0, NV))], [np.zeros(0)]
    for leg, directions in rows.items():
        if leg not in LEGS or not directions or set(directions) - set("xyz"):
            raise ValueError(f"rows: {leg!r}: {directions!r} is no leg, or no directions of x, y and z")
        at = touch(dynamics, leg)
        kept = ["xyz".index(direction) for direction in directions]
        slip = at.R_wc.T @ at.J[:3] @ dynamics.velocity
        turned = at.spin * np.array([slip[1], -slip[0], 0.0])  # a direction that turns sees the slip change
        jacobian.append((at.R_wc.T @ at.J[:3])[kept])
        drift.append((at.R_wc.T @ at.drift[:3] + turned)[kept])
    return np.vstack(jacobian), np.concatenate(drift)


def constrained(
    M: np.ndarray,
    h: np.ndarray,
    torques: np.ndarray,
    J: np.ndarray,
    drift: np.ndarray,
    damping: float = 0.0,
) -> Constrained:
    """Solve Paper B, eqs 2, 4 and 5, for accelerations and contact forces.

    Of eq. 4 by elimination: ``(J M⁻¹ Jᵀ + damping) f = −J̇ q̇ − J M⁻¹ (Sᵀ u − h)``, then ``q̈`` from eq. 2.
    Without contacts it is eq. 5.

    Args:
        M: ``(29, 29)`` mass matrix.
        h: ``(29,)`` Coriolis, centrifugal and gravity forces.
        torques: ``(29,)`` generalised forces of the motors, ``Sᵀ u``.
        J: ``(n_c, 29)``.
        drift: ``(n_c,)``.
        damping: added to the diagonal; needed where rows depend on each other. Forces are then shared, and
            the contacts give way a little.

    Raises:
        numpy.linalg.LinAlgError: rows depend on each other, and there is no damping.
    """
    columns = np.linalg.solve(M, np.column_stack([J.T, torques - h]))
    free = columns[:, -1]
    if not len(J):
        return Constrained(free, np.zeros(0))
    delassus = J @ columns[:, :-1]
    scale = np.sqrt(np.diag(delassus))
    if damping == 0.0 and np.linalg.cond(delassus / np.outer(scale, scale)) > 1e10:
        raise np.linalg.LinAlgError("contact rows depend on each other: leave some out, or add damping")
    force = np.linalg.solve(delassus + damping * np.eye(len(J)), -drift - J @ free)
    return Constrained(free + columns[:, :-1] @ force, force)


def forward_dynamics(
    dynamics: OmniDynamics,
    qpos: np.ndarray,
    qvel: np.ndarray,
    torques: np.ndarray,
    rows: dict[str, str] = ROWS,
    damping: float = 0.0,
    locked: Sequence[int] = (),
) -> Constrained:
    """Return how the robot accelerates at a state of MuJoCo's (Paper B, eqs 4 and 5).

    Args:
        dynamics: of the robot; updated here.
        qpos: ``(30,)``.
        qvel: ``(29,)``.
        torques: ``(23,)`` of the motors.
        rows: of each leg in contact, which directions are held; none for a robot in the air.
        damping: see :func:`constrained`.
        locked: indices in ``qvel`` of joints that are held, :data:`LOCKED` in legged mode; their rows come
            after those of the contacts.
    """
    dynamics.update(qpos, qvel)
    J, drift = contact_rows(dynamics, rows)
    J, drift = np.vstack([J, np.eye(NV)[list(locked)]]), np.append(drift, np.zeros(len(locked)))
    generalised = np.concatenate([np.zeros(NV - NU), torques])
    return constrained(dynamics.M, dynamics.h, generalised, J, drift, damping)
