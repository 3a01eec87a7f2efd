"""Chapter 1: the robot as one rigid body pushed by its contacts (Paper A, eqs 1, 8, 9).

Vectors over knots and legs are given component by component, ``lam[i]`` of shape ``(K, L)``, and may
be NumPy arrays or CVXPY expressions: the lines that check a plan are the lines that state the program.
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np

GRAVITY = 9.81


@dataclass(frozen=True)
class Robot:
    """What the planner knows of a robot: one body and four reach boxes.

    Attributes:
        mass: of the whole robot.
        inertia: ``(3, 3)`` about the centre of mass in the nominal stance, body axes.
        height: of the centre of mass above the ground in the nominal stance.
        stance: ``(L, 2)`` nominal contact points relative to the centre of mass, horizontal.
        reach: half sizes of the box around each leg's own nominal contact (eq. 30).
        swing_height: apex of a swing above the mean of its ends.
    """

    mass: float
    inertia: np.ndarray
    height: float
    stance: np.ndarray
    reach: tuple[float, float, float] = (0.17, 0.08, 0.04)
    swing_height: float = 0.06

    @classmethod
    def go1(cls) -> Self:
        """Return the Unitree Go1 with four light wheels, as ``assets/go1/build.py`` measured it."""
        nominal = _go1_nominal()
        return cls(
            mass=nominal["mass"],
            inertia=np.array(nominal["inertia"]),
            height=nominal["com_height"],
            stance=np.array(nominal["hip_offsets"])[:, :2],
        )

    @property
    def weight(self) -> float:
        """The force of gravity on the robot."""
        return self.mass * GRAVITY

    @property
    def reach_lower(self) -> np.ndarray:
        """Lower bound of ``p − x`` for each leg, ``(L, 3)`` (Paper A, eq. 30).

        The paper gives one box for all legs; here each leg's is about its own hip.
        """
        dx, dy, dz = self.reach
        return np.column_stack([self.stance - [dx, dy], np.full(len(self.stance), -self.height - dz)])

    @property
    def reach_upper(self) -> np.ndarray:
        """Upper bound of ``p − x`` for each leg, ``(L, 3)``; a swinging foot may rise by its apex."""
        dx, dy, dz = self.reach
        top = -self.height + dz + self.swing_height
        return np.column_stack([self.stance + np.array([dx, dy]), np.full(len(self.stance), top)])


@cache
def _go1_nominal() -> dict[str, Any]:
    path = Path(__file__).parent.parent / "assets" / "go1" / "nominal.json"
    return json.loads(path.read_text())


def linear_dynamics(a: Any, lam: Any, f: Any, mass: float) -> list[Any]:
    """Return the residual of Newton's law, zero on every plan (Paper A, eq. 1).

    Args:
        a: acceleration of the centre of mass, components of shape ``(K,)``.
        lam: contact forces on the robot, components of shape ``(K, L)``.
        f: rolling friction on the robot, components of shape ``(K, L)``.
        mass: of the robot.

    Returns:
        Three residuals of shape ``(K,)``: accelerations.
    """
    gravity = (0.0, 0.0, -GRAVITY)
    return [a[i] - gravity[i] - (lam[i].sum(axis=1) + f[i].sum(axis=1)) / mass for i in range(3)]


def midpoint_integration(x: Any, v: Any, a: Any, dt: float) -> list[Any]:
    """Return the residuals of the paper's midpoint Euler rule, zero on every plan.

    ``v[k+1] = v[k] + dt a[k]`` and ``x[k+1] = x[k] + dt (v[k] + v[k+1]) / 2``.

    Args:
        x: positions or angles, components of shape ``(K+1,)``.
        v: their rates, components of shape ``(K+1,)``.
        a: accelerations, components of shape ``(K,)``.
        dt: time between knots.
    """
    velocity = [v[i][1:] - v[i][:-1] - dt * a[i] for i in range(3)]
    position = [x[i][1:] - x[i][:-1] - 0.5 * dt * (v[i][:-1] + v[i][1:]) for i in range(3)]
    return velocity + position


def contact_torque(lever: Any, lam: Any) -> list[Any]:
    """Return the torque of each contact about the centre of mass (Paper A, eq. 8).

    The paper prints ``(x − p) × λ``, which is the torque on the ground; the robot feels
    ``(p − x) × λ``.

    Args:
        lever: ``p − x``, components of shape ``(K, L)``.
        lam: contact forces, components of shape ``(K, L)``.

    Returns:
        Components of shape ``(K, L)``.
    """
    return [lever[j] * lam[k] - lever[k] * lam[j] for _, j, k in _CYCLIC]


def bound_terms(lever: Any, lam: Any, scale: float = 1.0) -> tuple[list[Any], list[Any]]:
    """Return the terms whose squares bound the two halves of the torque (Paper A, eq. 9).

    A product is a difference of squares, ``4 a b = (a + b)² − (a − b)²``. So with
    ``U⁺ = Σ plus²`` and ``U⁻ = Σ minus²``, ``(U⁺ − U⁻)/4`` is the torque of eq. 8. The convex program
    asks only for ``U⁺ ≥ Σ plus²`` and ``U⁻ ≥ Σ minus²``: what it adds above the squares is torque
    that no contact makes.

    Args:
        lever: ``p − x``, components of shape ``(K, L)``.
        lam: contact forces, components of shape ``(K, L)``.
        scale: ``s``; terms are ``s · lever ± λ / s``. ``s²`` of the order of force over lever makes
            both parts alike in size; the torque does not depend on it.

    Returns:
        ``plus`` and ``minus``: for each axis a pair of terms of shape ``(K, L)``.
    """
    r = [scale * component for component in lever]
    w = [component / scale for component in lam]
    plus = [(r[j] + w[k], r[k] - w[j]) for _, j, k in _CYCLIC]
    minus = [(r[j] - w[k], r[k] + w[j]) for _, j, k in _CYCLIC]
    return plus, minus


_CYCLIC = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
