"""The program's common part: variables, cost, dynamics, reach (Paper A, eqs 1–6, 8, 9, 30–33).

Forces are in body weights, ``F = λ / (m g)``, so that levers and forces are numbers of one size;
components come first, ``force[i]`` of shape ``(K, L)``. The two formulations (:mod:`.tight` and
:mod:`.bigm`) add what ties the binaries to this.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.centroidal import GRAVITY, bound_terms, linear_dynamics, midpoint_integration
from wfbook.planner.problem import Problem
from wfbook.swing import quintic_basis, septic_basis


@dataclass
class Program:
    """A formulation as CVXPY sees it.

    Attributes:
        problem: what is asked.
        x, v, a, theta, omega, alpha: components of shape ``(K+1,)`` or ``(K,)``.
        p: contact points, components of shape ``(K+1, L)``.
        force: contact forces in body weights, components of shape ``(K, L)``.
        friction: rolling friction in body weights, components of shape ``(K, L)``.
        U_plus, U_minus: bounds of eq. 9 summed over legs, in body weights, components ``(K,)``.
        centroid: ``c − x`` at knot ``k + 1``, components x and y of shape ``(K,)``.
        S: swing matrix, ``(L, J)`` expression.
        wheel: dynamics matrix of the wheel, ``D[:, :, 0, 1]``, ``(L, J)`` expression.
        constraints: by the name of their group.
        cost: eq. 31.
        ground: height of the ground under the legs, the mean over legs, ``(K+1,)`` or a number.
        lever: ``p − x`` at mid-interval, components of shape ``(K, L)``.
        discrete: the variables that must be integers, by name.
        contacts: what those say of regions; of the tight formulation only.
    """

    problem: Problem
    x: list[Any]
    v: list[Any]
    a: list[Any]
    theta: list[Any]
    omega: list[Any]
    alpha: list[Any]
    p: list[Any]
    force: list[Any]
    friction: list[Any]
    U_plus: list[Any]
    U_minus: list[Any]
    centroid: list[Any]
    S: Any
    wheel: Any
    constraints: dict[str, list[Any]]
    ground: Any
    cost: Any = None
    lever: list[Any] = field(default_factory=list)
    discrete: dict[Any, Any] = field(default_factory=dict)
    contacts: Any = None

    def add(self, group: str, *constraints: Any) -> None:
        """Add constraints to a group."""
        self.constraints.setdefault(group, []).extend(constraints)

    def rows(self, without: Sequence[str] = ()) -> list[Any]:
        """Return the constraints of all groups but some."""
        return [c for name, group in self.constraints.items() if name not in without for c in group]


@dataclass(frozen=True)
class Grid:
    """Constant matrices between slots and knots; the spline of Paper A, eqs 2–6, at the knots.

    Attributes:
        spread: ``(K, J)``: what holds for a slot, for each of its intervals.
        begin: ``(K, K+1)`` picks, for knot ``k + 1``, the first knot of its slot.
        step: ``(K, J)`` weight of a slot's step in the foot's place at knot ``k + 1`` (eq. 6).
        lift: ``(K, J)`` weight of the velocity at lift-off.
        land: ``(K, J)`` weight of the velocity at touch-down.
        climb: ``(K, J)`` weight of the difference of the ends' heights (eq. 5).
        apex: ``(K+1, J)`` height of a swing of unit apex.
        age: ``(K,)`` intervals since the slot began, at knot ``k + 1``.
    """

    spread: np.ndarray
    begin: np.ndarray
    step: np.ndarray
    lift: np.ndarray
    land: np.ndarray
    climb: np.ndarray
    apex: np.ndarray
    age: np.ndarray

    @classmethod
    def of(cls, problem: Problem) -> "Grid":
        """Return the matrices for a problem's slots and knots."""
        J, rho, K, T = problem.slots, problem.knots_per_slot, problem.knots, problem.slot_duration
        age = np.tile(np.arange(1, rho + 1), J)
        basis = quintic_basis(np.arange(1, rho + 1) / rho)
        spread = np.kron(np.eye(J), np.ones((rho, 1)))
        begin = np.zeros((K, K + 1))
        begin[np.arange(K), rho * (np.arange(K) // rho)] = 1.0
        vertical = septic_basis(np.arange(1, rho + 1) / rho)
        # The apex is a given height above the mean of the ends.
        climb = np.kron(np.eye(J), vertical[:, [1]] + 0.5 * vertical[:, [2]])
        apex = np.vstack([np.zeros(J), np.kron(np.eye(J), vertical[:, [2]])])
        columns = [np.kron(np.eye(J), basis[:, [i]]) for i in (2, 1, 3)]
        return cls(spread, begin, columns[0], T * columns[1], T * columns[2], climb, apex, age)


def common(
    problem: Problem, S: Any, wheel: Any, force: list[Any], friction: list[Any], per_leg: bool
) -> Program:
    """State what both formulations share: dynamics, reach, ends and cost (Paper A, eqs 1, 8, 9, 30, 31).

    Args:
        problem: what is asked.
        S: swing matrix, ``(L, J)`` variable or expression.
        wheel: the wheel's dynamics matrix, likewise.
        force: contact forces in body weights, components ``(K, L)``.
        friction: rolling friction in body weights, components ``(K, L)``.
        per_leg: give each leg its own bounds U± as the paper does. Only their sums over legs enter
            cost and dynamics, so one cone for all legs is the same program with a quarter of the cones.

    Returns:
        A program without what ties ``S`` and ``wheel`` to motion and force.
    """
    K, L = problem.knots, problem.legs
    vector = [[cp.Variable(n, name=f"{name}{i}") for i in range(3)] for name, n in _vectors(K)]
    x, v, a, theta, omega, alpha = vector
    p = [cp.Variable((K + 1, L), name=f"p{i}") for i in range(3)]
    bounds = [[cp.Variable((K, L) if per_leg else K, name=f"U{sign}{i}") for i in range(3)] for sign in "+-"]
    total = [[cp.sum(u, axis=1) if per_leg else u for u in side] for side in bounds]
    if not problem.turns:
        total = [[np.zeros(K)] * 3] * 2
    centroid = [cp.Variable(K, name=f"c{i}") for i in range(2)]
    level, swing_height = problem.ground.level, problem.robot.swing_height
    if level is None:
        bumps = swing_height * (Grid.of(problem).apex @ S.T)
        level = cp.sum(p[2] - bumps, axis=1) / L
    program = Program(
        problem, x, v, a, theta, omega, alpha, p, force, friction, *total, centroid, S, wheel, {}, level
    )
    dt = problem.dt

    newton = linear_dynamics(a, force, friction, mass=1.0 / GRAVITY)
    program.add("dynamics", *(r == 0 for r in newton + midpoint_integration(x, v, a, dt)))
    inertia = problem.robot.inertia / problem.robot.weight
    for i in range(3) if problem.turns else ():
        torque = sum(inertia[i, j] * alpha[j] for j in range(3) if inertia[i, j])
        program.add("torque", torque == 0.25 * (total[0][i] - total[1][i]))
    program.add("rotation", *(r == 0 for r in midpoint_integration(theta, omega, alpha, dt)))

    middle = program.lever = [0.5 * (r[1:] + r[:-1]) for r in levers(program)]
    for side, terms in zip(bounds, bound_terms(middle, force), strict=True) if problem.turns else ():
        for u, pair in zip(side, terms, strict=True):
            program.add("torque bounds", *above_squares(u, pair, per_leg))

    bound(program, problem)
    program.cost = motion_cost(program)
    if problem.turns:
        program.cost += problem.weights.bounds * sum(cp.sum(U) for U in (*total[0], *total[1]))
    return program


def bound(program: Program, problem: Problem) -> None:
    """State where a program starts and ends, how far its legs reach and how fast it may be (Paper A, eq. 30).

    The first word of a group's name says what it is, the second which of its kind.

    Args:
        program: with its motion.
        problem: whose limits hold; may be another than the program was built for.
    """
    x, v, p, theta, omega = program.x, program.v, program.p, program.theta, program.omega
    K, lever = problem.knots, levers(program)
    robot, limits = problem.body, problem.limits
    ones = np.ones((K, 1))
    for i, axis in enumerate("xyz"):  # the start is as it is
        low, high = ones * robot.reach_lower[:, i], ones * robot.reach_upper[:, i]
        program.add(f"reach {axis}", lever[i][1:] >= low, lever[i][1:] <= high)
    program.add("speed forward", v[0] <= limits.speed[0])
    program.add("speed backward", v[0] >= -limits.speed[1])
    for i, name in ((1, "sideways"), (2, "vertical")):
        program.add(f"speed {name}", *within(v[i], limits.lateral_speed))
    program.add("tilt", *(side for angle in theta for side in within(angle, limits.angle)))

    state = problem.start_state
    program.add("start", *(p[i][0] == state.contacts[:, i] for i in range(3)))
    for vector, value in (
        (x, state.position),
        (v, state.velocity),
        (theta, state.angles),
        (omega, state.rates),
    ):
        program.add("start", *(vector[i][0] == value[i] for i in range(3)))
    if problem.stance_between_swings and state.swung.any():
        program.add("pause", program.S[np.flatnonzero(state.swung), 0] == 0)
    if problem.final_stance:
        program.add("end rest", *(z[K] == 0 for z in (*v, *omega)))
        program.add("end stand", program.S[:, -1] == 0)
        nominal = robot.stance
        for i, axis in enumerate("xy"):
            program.add(f"end {axis}", *within(lever[i][K] - nominal[:, i], limits.rest_offset[i]))
    if problem.goal_tolerance is not None:
        for i, axis in enumerate("xy"):
            program.add(f"goal {axis}", *within(x[i][K] - problem.goal[i], problem.goal_tolerance[i]))


def levers(program: Program) -> list[Any]:
    """Return ``p − x`` at the knots, components ``(K+1, L)``."""
    shape = program.x[0].shape[0], 1
    ones = np.ones((1, program.problem.legs))
    return [p - cp.reshape(x, shape, order="C") @ ones for p, x in zip(program.p, program.x, strict=True)]


def within(expression: Any, limit: Any) -> list[Any]:
    """State ``|expression| ≤ limit`` as two rows; CVXPY's ``abs`` would add a variable for each entry."""
    return [expression <= limit, -expression <= limit]


def _vectors(K: int) -> list[tuple[str, int]]:
    """Name the vectors over knots and their lengths."""
    return [("x", K + 1), ("v", K + 1), ("a", K), ("theta", K + 1), ("omega", K + 1), ("alpha", K)]


def above_squares(u: Any, pair: tuple[Any, Any], per_leg: bool) -> list[Any]:
    """State ``u ≥ Σ pair²`` as second-order cones (Paper A, eq. 9): ``‖(2 z, u − 1)‖ ≤ u + 1``."""
    if per_leg:
        flat = [cp.vec(z, order="C") for z in (2 * pair[0], 2 * pair[1], u - 1)]
        return [cp.SOC(cp.vec(u, order="C") + 1, cp.vstack(flat), axis=0)]
    K = u.shape[0]
    return [
        cp.SOC(u + 1, cp.hstack([2 * pair[0], 2 * pair[1], cp.reshape(u - 1, (K, 1), order="C")]).T, axis=0)
    ]


def motion_cost(program: Program) -> Any:
    """State Paper A, eqs 31–33, but for the bounds U± (see :class:`~.problem.Weights`)."""
    return sum(cost_terms(program).values())


def cost_terms(program: Program) -> dict[str, Any]:
    """State the terms of Paper A, eqs 31–33, but for the bounds U±, by the name of their weight."""
    w, problem, K = program.problem.priced, program.problem, program.problem.knots
    rise = program.x[2] - problem.robot.height - program.ground
    goal = cp.hstack([program.x[i][K] - problem.goal[i] for i in range(2)])
    return {
        "goal": w.goal * cp.sum_squares(goal),
        "goal_angle": w.goal_angle * sum(cp.square(angle[K]) for angle in program.theta),
        "acceleration": w.acceleration * sum(cp.sum_squares(a) for a in program.a),
        "force": w.force * sum(cp.sum_squares(F) for F in program.force),
        "centroid": w.centroid * sum(cp.sum_squares(c) for c in program.centroid),
        "height": w.height * cp.sum_squares(rise[1:]),
        "angle": w.angle * sum(cp.sum_squares(angle[1:]) for angle in program.theta),
        "angular_rate": w.angular_rate * sum(cp.sum_squares(rate[1:]) for rate in program.omega),
        "swing": w.swing * cp.sum(program.S @ problem.slot_numbers),
    }
