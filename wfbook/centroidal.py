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

        Not as printed: the paper has one box for all legs, which are at different corners; here each leg's is
        about its own hip.
        """
        dx, dy, dz = self.reach
        return np.column_stack([self.stance - [dx, dy], np.full(len(self.stance), -self.height - dz)])

    @property
    def reach_upper(self) -> np.ndarray:
        """Upper bound of ``p − x`` for each leg, ``(L, 3)``, with the apex of a swing (Paper A, eq. 30)."""
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
    return [a_i - free_i for a_i, free_i in zip(a, acceleration(lam, f, mass), strict=True)]


def acceleration(lam: Any, f: Any, mass: float) -> list[Any]:
    """Return how forces accelerate the centre of mass (Paper A, eq. 1).

    Args:
        lam: contact forces on the robot, components of shape ``(K, L)``.
        f: rolling friction on the robot, components of shape ``(K, L)``.
        mass: of the robot.

    Returns:
        Components of shape ``(K,)``.

    Example:
        A body of 12 kg that is carried by twice its weight is thrown up by once its weight:

        >>> from wfbook.centroidal import GRAVITY, acceleration
        >>> weight, none = np.array([[12.0 * GRAVITY]]), np.zeros((1, 1))
        >>> a = acceleration([none, none, 2.0 * weight], [none, none, none], 12.0)
        >>> bool(np.isclose(a[2], GRAVITY).all())
        True
    """
    gravity = (0.0, 0.0, -GRAVITY)
    return [(lam[i].sum(axis=1) + f[i].sum(axis=1)) / mass + gravity[i] for i in range(3)]


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

    Not as printed: ``(x − p) × λ`` is the torque on the ground; the robot feels ``(p − x) × λ``.

    Args:
        lever: ``p − x``, components of shape ``(K, L)``.
        lam: contact forces, components of shape ``(K, L)``.

    Returns:
        Components of shape ``(K, L)``.

    Example:
        A force of 100 N up, 0.2 m to the left of the centre of mass, rolls it to the right:

        >>> from wfbook.centroidal import contact_torque
        >>> lever, lam = np.array([0.0, 0.2, -0.3]), np.array([0.0, 0.0, 100.0])
        >>> np.allclose(contact_torque(lever, lam), [20.0, 0.0, 0.0])
        True
    """
    return [lever[j] * lam[k] - lever[k] * lam[j] for _, j, k in _CYCLIC]


def bound_terms(lever: Any, lam: Any, scale: float = 1.0) -> tuple[list[Any], list[Any]]:
    """Return the terms whose squares bound the two halves of the torque (Paper A, eq. 9).

    A product is a difference of squares, ``4 a b = (a + b)² − (a − b)²``. So with
    ``U⁺ = Σ plus²`` and ``U⁻ = Σ minus²``, ``(U⁺ − U⁻)/4`` is the torque of eq. 8. The convex program
    asks only for ``U⁺ ≥ Σ plus²`` and ``U⁻ ≥ Σ minus²``: what it adds above the squares is torque
    that no contact makes.

    Not as printed: the paper leaves out the inequality, without which U± have no least value, and its Table I
    calls them bounds of θ. They bound a leg's torque.

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


def least_bounds(lever: Any, lam: Any, scale: float = 1.0) -> tuple[list[Any], list[Any]]:
    """Return the least U⁺ and U⁻ that Paper A, eq. 9, allows: the squares themselves.

    Args:
        lever: ``p − x``, components of shape ``(K, L)``.
        lam: contact forces, components of shape ``(K, L)``.
        scale: as for :func:`bound_terms`.

    Returns:
        Components of U⁺ and of U⁻, of shape ``(K, L)``; ``(U⁺ − U⁻)/4`` is the torque of eq. 8.

    Example:
        >>> from wfbook.centroidal import contact_torque, least_bounds
        >>> lever, lam = np.array([0.1, 0.2, -0.3]), np.array([5.0, 0.0, 60.0])
        >>> plus, minus = least_bounds(lever, lam)
        >>> bool(np.allclose(np.subtract(plus, minus) / 4.0, contact_torque(lever, lam)))
        True
    """
    plus, minus = ([a**2 + b**2 for a, b in side] for side in bound_terms(lever, lam, scale))
    return plus, minus


@dataclass(frozen=True)
class RollOut:
    """How a body moves that is pushed.

    Attributes:
        t: ``(K+1,)`` time.
        x: ``(K+1, 3)`` centre of mass.
        v: ``(K+1, 3)`` its velocity.
        momentum: ``(K+1, 3)`` angular momentum about the centre of mass.
        a: ``(K, 3)`` acceleration of the centre of mass.
        torque: ``(K, 3)`` of all contacts about the centre of mass.
    """

    t: np.ndarray
    x: np.ndarray
    v: np.ndarray
    momentum: np.ndarray
    a: np.ndarray
    torque: np.ndarray

    def angles(self, inertia: np.ndarray) -> np.ndarray:
        """Return roll, pitch and yaw from level, as a rigid body of this inertia turns, ``(K+1, 3)``.

        For small angles, which are all that eq. 8 knows: ``I θ̈ = torque``.
        """
        rate = np.linalg.solve(inertia, self.momentum.T).T
        return _sum_up(np.zeros(3), 0.5 * (self.t[1] - self.t[0]) * (rate[:-1] + rate[1:]))


def roll_out(
    mass: float,
    dt: float,
    p: np.ndarray,
    lam: np.ndarray,
    x: np.ndarray,
    v: np.ndarray | None = None,
    momentum: np.ndarray | None = None,
) -> RollOut:
    """Follow Paper A, eqs 1 and 8, forward in time by the paper's midpoint rule.

    The rule is that of :func:`midpoint_integration`, solved for what comes next; levers are taken at the
    middle of each interval, as the planner takes them.

    Args:
        mass: of the body.
        dt: time between knots.
        p: ``(K+1, L, 3)`` contact points.
        lam: ``(K, L, 3)`` forces on the body, rolling friction included.
        x: ``(3,)`` centre of mass at the first knot, or ``(K+1, 3)``, at all of them: where it was measured.
        v: ``(3,)`` its velocity at the first knot; at rest without one.
        momentum: ``(3,)`` angular momentum at the first knot; none without one.

    Returns:
        The motion; ``x`` is the integrated one, also where it was given at all knots.
    """
    force = np.moveaxis(lam, -1, 0)
    a = np.stack(acceleration(force, np.zeros_like(force), mass), axis=-1)
    velocity = _sum_up(np.zeros(3) if v is None else v, dt * a)
    known = np.atleast_2d(x)
    path = _sum_up(known[0], 0.5 * dt * (velocity[:-1] + velocity[1:]))
    lever = p - (path if len(known) == 1 else known)[:, None]
    middle = np.moveaxis(0.5 * (lever[:-1] + lever[1:]), -1, 0)
    torque = np.stack([turning.sum(axis=1) for turning in contact_torque(middle, force)], axis=-1)
    spin = _sum_up(np.zeros(3) if momentum is None else momentum, dt * torque)
    return RollOut(dt * np.arange(len(path)), path, velocity, spin, a, torque)


def _sum_up(start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    return np.vstack([start, start + np.cumsum(steps, axis=0)])


def carried(p: np.ndarray, x: np.ndarray, weight: float) -> np.ndarray:
    """Return the vertical pushes that carry a weight and turn the robot least.

    Legs can't pull. While the centre of mass is over the polygon of the contacts there are pushes that do not
    turn the robot at all; beyond, the best ones act where the polygon is nearest.

    Args:
        p: ``(L, 3)`` contact points of the standing legs.
        x: ``(3,)`` centre of mass.
        weight: to be carried.

    Returns:
        ``(L,)``, none negative; where several do, the most even ones.
    """
    from scipy.optimize import nnls

    # Carrying the weight comes first, then not to turn; evenness decides between what is left.
    arms = p[:, :2] - np.asarray(x)[:2]
    rows = np.vstack([1e3 * np.ones(len(p)), arms.T, 1e-5 * np.eye(len(p))])
    shares, _ = nnls(rows, np.concatenate([[1e3, 0.0, 0.0], np.zeros(len(p))]))
    return weight * shares / shares.sum()


def cheapest_claim(real: float, wanted: float, charge: float, value: float = 1.0) -> float:
    """Return the torque that a program claims which must pay for U± (Paper A, eq. 9).

    It minimises ``charge (e⁺ + e⁻) + value (wanted − claimed)²/2`` over what it adds to the squares,
    ``e⁺, e⁻ ≥ 0``, with ``claimed = real + (e⁺ − e⁻)/4``. A newton metre made of nothing costs
    ``4 charge``; so nothing is added until a real one is worth more than that.

    Args:
        real: torque of the contacts.
        wanted: torque that would be best.
        charge: for a unit of U⁺ or U⁻.
        value: of coming closer to the wanted torque.
    """
    missing = wanted - real
    return real + float(np.sign(missing)) * max(abs(missing) - 4.0 * charge / value, 0.0)


_CYCLIC = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
