"""The tight formulation: no big-M, every product of a binary and a motion bounded exactly.

What makes it tight, against the paper's big-M of the same feasible set:

* A foot's motion is a sum of *steps*, each zero unless its slot is a swing. A swing of zero step *is*
  the stationary foot, so eqs 6 and 19 need no implication.
* A wheel's roll is a binary times a bounded displacement: McCormick's four inequalities, which are
  exact at binaries and the convex hull between them.
* Where a leg stands and what it stands on is a path through a small graph, slot by slot (eqs 16–17),
  whose flow constraints have integral corners.
* Force is split by end effector, each part zero unless its leg stands on that (eqs 7, 27–29).
* The centroid is written relative to the centre of mass, where the reach box bounds every term, and
  eq. 15 is split by the number of swinging legs.
"""

from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.friction import friction_pyramid, rolling_friction
from wfbook.planner.problem import Problem
from wfbook.planner.program import Grid, Program, common, within


def build(problem: Problem) -> Program:
    """State the tight formulation, with binaries relaxed to ``[0, 1]``.

    Args:
        problem: what is asked.

    Returns:
        The program. It is the mixed-integer one when ``S`` and ``wheel`` are required to be integers.
    """
    J, L = problem.slots, problem.legs
    kinds = problem.end_effectors
    stance = {e: cp.Variable((L, J), name=f"stance_{e}") for e in kinds}
    landing = {e: cp.Variable((L, J), name=f"landing_{e}") for e in kinds}
    S = sum(landing.values())
    wheel = stance["wheel"] + landing["wheel"] if problem.wheels else np.zeros((L, J))
    grid = Grid.of(problem)
    force, friction, forces = _forces(problem, stance, grid)
    program = common(problem, S, wheel, force, friction, per_leg=False)
    program.add("friction", *forces)
    program.add("modes", *flow(problem, S, stance, landing))
    chosen = cp.Variable((len(problem.patterns), J), name="pattern")
    sizes, hull = pattern_hull(problem, S, chosen)
    program.add("patterns", *hull)
    program.discrete = {"pattern": chosen, **{("stance", e): stance[e] for e in kinds}}
    program.discrete |= {("landing", e): landing[e] for e in kinds}
    _motion(program, grid, stance, landing)
    _centroid(program, grid, sizes)
    return program


def assignment(problem: Problem, S: np.ndarray, wheel: np.ndarray) -> dict[Any, np.ndarray]:
    """Return the values of all discrete variables that a swing and a dynamics matrix imply.

    Args:
        problem: what is asked.
        S: ``(L, J)`` swing matrix.
        wheel: ``(L, J)`` wheel's dynamics matrix.

    Returns:
        Values by the keys of ``Program.discrete``.

    Raises:
        KeyError: a slot's set of swinging legs is not an admissible pattern.
    """
    on = {"foot": 1 - wheel, "wheel": wheel}
    values: dict[Any, np.ndarray] = {("stance", e): on[e] * (1 - S) for e in problem.end_effectors}
    values |= {("landing", e): on[e] * S for e in problem.end_effectors}
    index = {frozenset(p): i for i, p in enumerate(problem.patterns)}
    rows = [index[frozenset(np.flatnonzero(S[:, j]).tolist())] for j in range(problem.slots)]
    values["pattern"] = np.eye(len(problem.patterns))[:, rows]
    return values


def flow(problem: Problem, S: Any, stance: dict, landing: dict) -> list[Any]:
    """State eqs 16 and 17 as a flow: a leg stands only on what it carried the slot before.

    Args:
        problem: what is asked.
        S: swing matrix, ``(L, J)``.
        stance: by end effector, ``(L, J)``: the leg stands on it.
        landing: by end effector, ``(L, J)``: the leg swings and will land on it.
    """
    constraints = [sum(stance.values()) + S == 1]
    constraints += [part >= 0 for part in (*stance.values(), *landing.values())]
    for e in problem.end_effectors:
        before = np.array([[float(name == e)] for name in problem.start_end_effectors])
        constraints.append(stance[e][:, :1] <= before)
        constraints.append(stance[e][:, 1:] <= stance[e][:, :-1] + landing[e][:, :-1])
    if problem.stance_between_swings and problem.slots > 1:
        constraints.append(S[:, 1:] + S[:, :-1] <= 1)
    if problem.final_stance and problem.wheels:
        constraints.append(cp.sum(stance["foot"][:, -1]) >= 1)
    return constraints


def pattern_hull(problem: Problem, S: Any, chosen: Any) -> tuple[Any, list[Any]]:
    """Keep ``S[:, j]`` in the convex hull of the admissible patterns.

    Args:
        problem: what is asked.
        S: swing matrix, ``(L, J)``.
        chosen: ``(patterns, J)`` nonnegative variable, 1 for the pattern of each slot.

    Returns:
        ``(N, J)`` expression whose row ``n`` is 1 where ``n`` legs swing (the paper's auxiliary s of
        eqs 13–14, with the missing ``s₀`` added), and the constraints.
    """
    members = np.array([[float(leg in p) for p in problem.patterns] for leg in range(problem.legs)])
    sizes = np.array([len(p) for p in problem.patterns])
    counted = np.array([sizes == n for n in range(sizes.max() + 1)], float) @ chosen
    return counted, [chosen >= 0, members @ chosen == S, cp.sum(chosen, axis=0) == 1]


def mccormick(binary: Any, factor: Any, low: Any, high: Any) -> tuple[Any, list[Any]]:
    """State ``product = binary · factor`` by its convex hull, which is exact at binaries.

    Args:
        binary: expression of any shape.
        factor: expression of the same shape.
        low: lower bound of the factor, broadcast to its shape.
        high: upper bound, likewise.

    Returns:
        The product as a new variable, and the constraints.
    """
    product = cp.Variable(binary.shape)
    low, high = np.broadcast_to(low, binary.shape), np.broadcast_to(high, binary.shape)
    rest, off = factor - product, 1 - binary
    return product, [
        product >= cp.multiply(low, binary),
        product <= cp.multiply(high, binary),
        rest >= cp.multiply(low, off),
        rest <= cp.multiply(high, off),
    ]


def centroid_bounds(problem: Problem, n: int, axis: int) -> tuple[float, float]:
    """Return the range of the mean lever of the standing legs while ``n`` legs swing."""
    lower, upper = problem.robot.reach_lower[:, axis], problem.robot.reach_upper[:, axis]
    standing = [[leg for leg in range(problem.legs) if leg not in p] for p in problem.patterns if len(p) == n]
    return min(lower[s].mean() for s in standing), max(upper[s].mean() for s in standing)


def _forces(problem: Problem, stance: dict, grid: Grid) -> tuple[list[Any], list[Any], list[Any]]:
    """State eqs 7 and 26–29 for forces split by end effector.

    Returns:
        Contact force and rolling friction in body weights, components ``(K, L)``, and constraints.
    """
    region, shape = problem.region, (problem.knots, problem.legs)
    friction = {"foot": (region.mu_foot, region.mu_foot), "wheel": (region.mu_wheel, region.mu_wheel_lateral)}
    constraints, total, rolling = [], [0, 0, 0], [np.zeros(shape) for _ in range(3)]
    for e in problem.end_effectors:
        n, b = (cp.Variable(shape, name=f"{axis}_{e}") for axis in "nb")
        t = cp.Variable(shape, name=f"t_{e}") if friction[e][0] > 0 else np.zeros(shape)
        sides = friction_pyramid(n, t, b, *friction[e])
        constraints += [
            side <= 0 for side in sides if isinstance(side, cp.Expression) and not side.is_constant()
        ]
        constraints.append(n <= problem.limits.force * (grid.spread @ stance[e].T))
        total = [total[0] + t, total[1] + b, total[2] + n]
        if e == "wheel" and region.rolling_resistance > 0:
            rolling[0] = rolling_friction(n, region.rolling_resistance)
    return total, rolling, constraints


def _motion(program: Program, grid: Grid, stance: dict, landing: dict) -> None:
    """State eqs 2–6 and 19–22: steps, rolls and regions."""
    problem, p, x, v = program.problem, program.p, program.x, program.v
    J, K, L, rho = problem.slots, problem.knots, problem.legs, problem.knots_per_slot
    step = [cp.Variable((L, J), name=f"step{i}") for i in range(2)]
    for i in range(2):
        program.add("step", *within(step[i], problem.limits.step[i] * program.S))
    moved = [grid.step @ step[i].T for i in range(2)]
    if problem.wheels:
        low, high = -problem.limits.speed[1], problem.limits.speed[0]
        before = np.array([[float(name == "wheel")] for name in problem.start_end_effectors])
        carried = cp.hstack([before, program.wheel[:, :-1]])
        rows, columns = np.ones((L, 1)), np.ones((1, L))
        lift, exact = mccormick(
            carried - stance["wheel"], rows @ cp.reshape(v[0][0:K:rho], (1, J), order="C"), low, high
        )
        land, exact_land = mccormick(
            landing["wheel"], rows @ cp.reshape(v[0][rho : K + 1 : rho], (1, J), order="C"), low, high
        )
        age = problem.dt * grid.age[:, None]
        travelled = cp.reshape(x[0][1:] - grid.begin @ x[0], (K, 1), order="C") @ columns
        roll, exact_roll = mccormick(grid.spread @ stance["wheel"].T, travelled, low * age, high * age)
        program.add("motion", *exact, *exact_land, *exact_roll)
        moved[0] = moved[0] + grid.lift @ lift.T + grid.land @ land.T + roll
    program.add("motion", *(p[i][1:] == grid.begin @ p[i] + moved[i] for i in range(2)))
    program.add("motion", p[2] == problem.ground + problem.robot.swing_height * (grid.apex @ program.S.T))
    ends = slice(0, K + 1, rho)
    A, b = problem.region.halfspaces
    for row, limit in zip(A, b, strict=True):
        program.add("regions", row[0] * p[0][ends] + row[1] * p[1][ends] <= limit)


def _centroid(program: Program, grid: Grid, sizes: Any) -> None:
    """State eqs 10–15 relative to the centre of mass, split by the number of swinging legs."""
    problem = program.problem
    K, L = problem.knots, problem.legs
    swing = grid.spread @ program.S.T
    ones = np.ones((1, L))
    for i in range(2):
        lower, upper = problem.robot.reach_lower[:, i], problem.robot.reach_upper[:, i]
        lever = program.p[i][1:] - cp.reshape(program.x[i][1:], (K, 1), order="C") @ ones
        vertex = cp.Variable((K, L), name=f"vertex{i}")
        program.add(
            "centroid", vertex >= (1 - swing) @ np.diag(lower), vertex <= (1 - swing) @ np.diag(upper)
        )
        away = lever - vertex
        program.add("centroid", away >= swing @ np.diag(lower), away <= swing @ np.diag(upper))
        parts = cp.Variable((K, sizes.shape[0]), name=f"centroid{i}")
        for n in range(sizes.shape[0]):
            low, high = centroid_bounds(problem, n, i)
            here = grid.spread @ sizes[n]
            program.add("centroid", parts[:, n] >= low * here, parts[:, n] <= high * here)
        counts = L - np.arange(sizes.shape[0])
        program.add("centroid", cp.sum(vertex, axis=1) == parts @ counts)
        program.add("centroid", program.centroid[i] == cp.sum(parts, axis=1))
