"""The paper's own formulation: implications as big-M (Paper A, eqs 6–29), given to SCIP as it is.

Kept for teaching and for the benchmark. It has the same feasible plans as :mod:`.tight`, but between
the binaries its constraints say nearly nothing: at ``S = ½`` a leg may be anywhere and push at the
same time, so the bound of its relaxation is weak and the search long.
"""

import time
import warnings
from itertools import combinations
from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.friction import friction_pyramid, rolling_friction
from wfbook.planner.explain import InfeasibleError, NoPlanError, conflicting_groups
from wfbook.planner.extract import plan_of, read
from wfbook.planner.plan import Plan
from wfbook.planner.problem import Problem
from wfbook.planner.program import Grid, Program, common


def build(problem: Problem) -> Program:
    """State the paper's program with boolean variables.

    Args:
        problem: what is asked.

    Returns:
        The program; ``S`` and ``wheel`` are boolean variables (``wheel`` zeros where none is allowed).
    """
    L, J, K = problem.legs, problem.slots, problem.knots
    S = cp.Variable((L, J), boolean=True, name="S")
    wheel = cp.Variable((L, J), boolean=True, name="D_wheel") if problem.wheels else np.zeros((L, J))
    force = [cp.Variable((K, L), name=f"F{i}") for i in range(3)]
    resists = problem.wheels and problem.region.rolling_resistance > 0
    friction = [
        cp.Variable((K, L), name="f0") if resists else np.zeros((K, L)),
        np.zeros((K, L)),
        np.zeros((K, L)),
    ]
    program = common(problem, S, wheel, force, friction, per_leg=True)
    grid = Grid.of(problem)
    _gait(program)
    _motion(program, grid)
    _forces(program, grid)
    _centroid(program, grid)
    return program


def implies(condition: Any, expression: Any, big: Any) -> list[Any]:
    """State ``condition = 1 ⟹ expression = 0`` in big-M format.

    Args:
        condition: one at binaries where the implication holds, and zero or less elsewhere.
        expression: of the same shape.
        big: M, a bound of ``|expression|``.
    """
    return [expression <= cp.multiply(big, 1 - condition), -expression <= cp.multiply(big, 1 - condition)]


def _gait(program: Program) -> None:
    """State eqs 13, 14, 16, 17 and which legs may swing together and when."""
    problem, S, wheel = program.problem, program.S, program.wheel
    admissible = {frozenset(p) for p in problem.patterns}
    for size in range(1, problem.legs + 1):
        for legs in combinations(range(problem.legs), size):
            if frozenset(legs) not in admissible:
                others = [leg for leg in range(problem.legs) if leg not in legs]
                left = cp.sum(S[list(legs)], axis=0) - (cp.sum(S[others], axis=0) if others else 0)
                program.add("patterns", left <= size - 1)
    if problem.stance_between_swings and problem.slots > 1:
        program.add("modes", S[:, 1:] + S[:, :-1] <= 1)
    if problem.wheels:
        start = np.array([[float(e == "wheel")] for e in problem.start_end_effectors])
        change = wheel - cp.hstack([start, wheel[:, :-1]])
        program.add("modes", change <= S, -change <= S)
        if problem.final_stance:
            program.add("modes", cp.sum(wheel[:, -1]) <= problem.legs - 1)


def _motion(program: Program, grid: Grid) -> None:
    """State eqs 2–6 and 19–22: which knots follow the spline, stay, or roll."""
    problem, p, x, v = program.problem, program.p, program.x, program.v
    K, L, rho = problem.knots, problem.legs, problem.knots_per_slot
    swing = grid.spread @ program.S.T
    rolls = grid.spread @ program.wheel.T
    ends = grid.begin.argmax(axis=1) + rho
    big = 1.0 + problem.limits.speed[0] * problem.duration
    for i in range(2):
        begin, now, end = grid.begin @ p[i], p[i][1:], p[i][ends]
        spline = begin + cp.multiply(grid.step.sum(axis=1)[:, None], end - begin)
        stays = now - p[i][:-1]
        step = p[i][rho::rho] - p[i][:-1:rho]
        limit = problem.limits.step[i]
        off = big * (1 - program.S.T)
        program.add("step", step <= limit + off, -step <= limit + off)
        if i == 1 or not problem.wheels:
            program.add("motion", *implies(swing, now - spline, big), *implies(1 - swing, stays, big))
            continue
        start = np.array([[float(e == "wheel")] for e in problem.start_end_effectors])
        before = (grid.spread @ cp.hstack([start, program.wheel[:, :-1]]).T, rolls)
        columns = np.ones((1, L))
        speeds = [cp.reshape(v[0][at], (K, 1), order="C") @ columns for at in (ends - rho, ends)]
        weights = [grid.lift.sum(axis=1)[:, None], grid.land.sum(axis=1)[:, None]]
        for lifts in (0, 1):
            for lands in (0, 1):
                path = spline + sum(
                    cp.multiply(w, s) * on for w, s, on in zip(weights, speeds, (lifts, lands), strict=True)
                )
                which = [z if on else 1 - z for z, on in zip(before, (lifts, lands), strict=True)]
                program.add("motion", *implies(swing + which[0] + which[1] - 2, now - path, big))
        rolled = cp.reshape(x[0][1:] - x[0][:-1], (K, 1), order="C") @ columns
        program.add("motion", *implies(1 - swing - rolls, stays, big))
        program.add("motion", *implies(rolls - swing, stays - rolled, big))
    rise, ground = problem.robot.swing_height, problem.ground
    apex = rise * grid.apex[1:].sum(axis=1)[:, None] @ np.ones((1, L))
    program.add("motion", *implies(swing, p[2][1:] - ground - apex, 2 * rise))
    program.add("motion", *implies(1 - swing, p[2][1:] - ground, 2 * rise), p[2][0] == ground)
    A, b = problem.region.halfspaces
    slots = slice(0, K + 1, rho)
    for row, limit in zip(A, b, strict=True):
        program.add("regions", row[0] * p[0][slots] + row[1] * p[1][slots] <= limit)


def _forces(program: Program, grid: Grid) -> None:
    """State eqs 7 and 26–29."""
    problem, region = program.problem, program.problem.region
    t, b, n = program.force
    big = problem.limits.force
    rolls = grid.spread @ program.wheel.T
    program.add("friction", n <= big * (1 - grid.spread @ program.S.T))
    if not problem.wheels:
        program.add(
            "friction", *(side <= 0 for side in friction_pyramid(n, t, b, region.mu_foot, region.mu_foot))
        )
        return
    widest = 2 * big * max(region.mu_foot, region.mu_wheel, region.mu_wheel_lateral)
    for side in friction_pyramid(n, t, b, region.mu_foot, region.mu_foot):
        program.add("friction", side <= widest * rolls)
    for side in friction_pyramid(n, t, b, region.mu_wheel, region.mu_wheel_lateral):
        program.add("friction", side <= widest * (1 - rolls))
    if region.rolling_resistance > 0:
        most = region.rolling_resistance * big
        program.add("friction", *implies(1 - rolls, program.friction[0], most))
        drag = rolling_friction(n, region.rolling_resistance)
        program.add("friction", *implies(rolls, program.friction[0] - drag, most))


def _centroid(program: Program, grid: Grid) -> None:
    """State eqs 10–15, with ``s₀`` and without ``n = N_l``."""
    problem = program.problem
    L, J, K = problem.legs, problem.slots, problem.knots
    most = max(len(p) for p in problem.patterns)
    s = cp.Variable((most + 1, J), boolean=True, name="s")
    program.add("centroid", np.arange(most + 1) @ s == cp.sum(program.S, axis=0), cp.sum(s, axis=0) == 1)
    swing = grid.spread @ program.S.T
    big = 1.0 + problem.limits.speed[0] * problem.duration + max(map(abs, problem.start))
    for i in range(2):
        vertex = cp.Variable((K, L), name=f"v{i}")
        c = program.x[i][1:] + program.centroid[i]
        program.add(
            "centroid", *implies(1 - swing, vertex - program.p[i][1:], big), *implies(swing, vertex, big)
        )
        for n in range(most + 1):
            here = grid.spread @ s[n]
            program.add("centroid", *implies(here, (L - n) * c - cp.sum(vertex, axis=1), 2 * L * big))


def solve(problem: Problem, gap: float, time_limit: float) -> Plan:
    """Give the paper's program to SCIP through CVXPY (see :func:`wfbook.planner.solve`)."""
    begin = time.perf_counter()
    program = build(problem)
    stated = cp.Problem(cp.Minimize(program.cost), program.rows())
    data, chain, inverse = stated.get_problem_data(cp.SCIP)
    built = time.perf_counter() - begin
    options = {"scip_params": {"limits/gap": gap, "limits/time": time_limit}}
    answer = chain.solve_via_data(stated, data, solver_opts=options)
    spent = time.perf_counter() - begin - built
    model = answer["model"]
    if model.getNSols() == 0:
        if model.getStatus() == "infeasible":
            raise InfeasibleError(conflicting_groups(problem))
        if model.getStatus() == "userinterrupt":
            raise KeyboardInterrupt
        raise NoPlanError(f"no plan found within {spent:.1f} s")
    with warnings.catch_warnings():
        # "May be inaccurate" is how CVXPY calls a gap or time limit; the plan's meta says which it was.
        warnings.simplefilter("ignore", UserWarning)
        stated.unpack_results(answer, chain, inverse)
    S = np.rint(program.S.value)
    wheel = np.rint(program.wheel.value) if problem.wheels else np.zeros_like(S)
    objective, bound = float(stated.value), min(model.getDualbound() + _offset(inverse), float(stated.value))
    statuses = {"timelimit": "time limit", "userinterrupt": "interrupted"}
    meta = {
        "stage": "relaxed",
        "formulation": "paper",
        "objective": objective,
        "bound": bound,
        "gap": (objective - bound) / objective,
        "gap_target": gap,
        "status": statuses.get(model.getStatus(), "optimal"),
        "nodes": int(model.getNTotalNodes()),
        "root_bound": model.getDualboundRoot() + _offset(inverse),
        "rejected_gaits": 0,
        "solve_time": spent,
        "build_time": built,
    }
    return plan_of(problem, read(program), S, wheel, meta)


def _offset(inverse: list[Any]) -> float:
    """Return the constant of the objective, which the solver does not see."""
    return float(inverse[-1].get("offset", 0.0))
