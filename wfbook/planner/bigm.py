"""The paper's own formulation: implications as big-M (Paper A, eqs 2–7 and 10–29), on SCIP as it is.

Kept for teaching and for the benchmark. It has the same feasible plans as :mod:`.tight`, but between
the binaries its constraints say nearly nothing: at ``S = ½`` a leg may be anywhere and push at the
same time, so the bound of its relaxation is weak and the search long.

Its binaries are the swing matrix ``S[l, j]``, the dynamics matrix ``D[l, j, r, e]``, for each region η of
a group that wheels roll through the ``z_η`` of eqs 24 and 25, by knot, and the ``s_n`` of eq. 13. Where
what eq. 18 implies is the same for every region, it is implied by the sum of D over regions.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.friction import friction_pyramid, rolling_friction
from wfbook.planner.bounds import MotionBounds
from wfbook.planner.explain import NoPlanError, check_start, why_not
from wfbook.planner.extract import plan_of, read
from wfbook.planner.gait import Gait
from wfbook.planner.ground import Places, Surface
from wfbook.planner.plan import Plan
from wfbook.planner.problem import Problem
from wfbook.planner.program import Grid, Program, common, within
from wfbook.planner.tree import Progress
from wfbook.planner.watched import Watched


@dataclass
class Dynamics:
    """The dynamics matrix and the union of regions that a wheel may roll through.

    Attributes:
        problem: what is asked.
        S: swing matrix, ``(L, J)``.
        D: by region and end effector, ``(L, J)``; a wheel's stays where it touched down.
        z: by region of a group of several, ``(K, L)``: 0 where a wheel is on that region at knot k + 1.
    """

    problem: Problem
    S: Any
    D: dict[tuple[int, str], Any] = field(init=False)
    z: dict[int, Any] = field(init=False)

    def __post_init__(self):
        problem, ground = self.problem, self.problem.ground
        L, J, K = problem.legs, problem.slots, problem.knots
        kinds = [(r, e) for r in range(ground.count) for e in problem.end_effectors]
        self.D = {(r, e): cp.Variable((L, J), boolean=True, name=f"D{r}_{e}") for r, e in kinds}
        shared = [r for members in ground.groups if len(members) > 1 for r in members]
        self.z = {r: cp.Variable((K, L), boolean=True, name=f"z{r}") for r in shared if problem.wheels}

    def carrying(self, end_effector: str) -> Any:
        """Return which legs carry, or will land on, an end effector, ``(L, J)``."""
        parts = [D for (_, e), D in self.D.items() if e == end_effector]
        return sum(parts) if parts else np.zeros(self.S.shape)

    def group(self, region: int) -> Any:
        """Return whose wheels may be on a region: those that touched down in its group, ``(L, J)``."""
        members = self.problem.ground.groups[self.problem.ground.group_of[region]]
        return sum(self.D[r, "wheel"] for r in members)

    def off(self, region: int) -> Any:
        """Return ``z``, ``(K, L)``; a region alone in its group is where the wheel is all the time."""
        return self.z.get(region, np.zeros((self.problem.knots, self.problem.legs)))

    def before(self, region: int, end_effector: str) -> Any:
        """Return D of the slot before, ``(L, J)``, in the first slot that of the start."""
        start = np.array(self.problem.start_end_effectors) == end_effector
        start &= self.problem.start_regions == region
        return cp.hstack([start.astype(float)[:, None], self.D[region, end_effector][:, :-1]])


def build(problem: Problem) -> Program:
    """State the paper's program with boolean variables.

    Args:
        problem: what is asked.

    Returns:
        The program. Its ``discrete`` holds ``"S"``, ``("D", r, e)``, ``("z", r)`` and ``"s"``.
    """
    S = cp.Variable((problem.legs, problem.slots), boolean=True, name="S")
    dynamics, shape = Dynamics(problem, S), (problem.knots, problem.legs)
    force = [cp.Variable(shape, name=f"F{i}") for i in range(3)]
    regions = problem.ground.regions if problem.wheels else ()
    resisted = np.any([r.tangent * r.rolling_resistance for r in regions] or [np.zeros(3)], axis=0)
    friction = [cp.Variable(shape, name=f"f{i}") if resisted[i] else np.zeros(shape) for i in range(3)]
    program = common(problem, S, dynamics.carrying("wheel"), force, friction, per_leg=True)
    grid = Grid.of(problem)
    program.discrete = {"S": S} | {("D", *key): D for key, D in dynamics.D.items()}
    program.discrete |= {("z", r): z for r, z in dynamics.z.items()}
    _gait(program, dynamics)
    _union(program, dynamics)
    _motion(program, dynamics, grid)
    _regions(program, dynamics, grid)
    _forces(program, dynamics, grid)
    _centroid(program, grid)
    return program


def implies(condition: Any, expression: Any, big: Any) -> list[Any]:
    """State ``condition = 1 ⟹ expression = 0`` in big-M format, as Paper A, eq. 18 and all others need it.

    Args:
        condition: one at binaries where the implication holds, and zero or less elsewhere.
        expression: of the same shape.
        big: M, a bound of ``|expression|``.
    """
    return [side for sign in (1, -1) for side in implies_below(condition, sign * expression, big)]


def implies_below(condition: Any, expression: Any, big: Any) -> list[Any]:
    """State ``condition = 1 ⟹ expression ≤ 0`` in big-M format; M is a bound of the expression."""
    return [expression <= cp.multiply(big, 1 - condition)]


def _gait(program: Program, dynamics: Dynamics) -> None:
    """State Paper A, eqs 16 and 17, and which legs may swing together and when."""
    problem, S = program.problem, program.S
    admissible = {frozenset(p) for p in problem.patterns}
    for size in range(1, problem.legs + 1):
        for legs in combinations(range(problem.legs), size):
            if frozenset(legs) not in admissible:
                others = [leg for leg in range(problem.legs) if leg not in legs]
                left = cp.sum(S[list(legs)], axis=0) - (cp.sum(S[others], axis=0) if others else 0)
                program.add("patterns", left <= size - 1)
    if problem.stance_between_swings and problem.slots > 1:
        program.add("modes", S[:, 1:] + S[:, :-1] <= 1)
    for key, D in dynamics.D.items():
        program.add("modes", *within(D - dynamics.before(*key), S))
    program.add("modes", sum(dynamics.D.values()) == 1)
    if problem.final_stance and problem.wheels:
        program.add("modes", cp.sum(dynamics.carrying("foot")[:, -1]) >= 1)


def _union(program: Program, dynamics: Dynamics) -> None:
    """State Paper A, eq. 25, and that a wheel passes its regions in one direction within a slot.

    Not as printed: it is an equality here. Two regions share an edge, and the force at a knot needs one of
    them. A wheel that touches down does so where D says.
    """
    problem, rho = program.problem, program.problem.knots_per_slot
    for members in problem.ground.groups:
        ordered = [r for r in problem.ground.order if r in members]
        if not set(members) <= set(dynamics.z):
            continue
        program.add("modes", sum(dynamics.z[r] for r in members) == len(members) - 1)
        for r in members:
            lands = (program.S + dynamics.D[r, "wheel"] - 1).T
            program.add("modes", *implies_below(lands, dynamics.z[r][rho - 1 :: rho], 1.0))
        rolls = (dynamics.group(members[0]) - program.S).T
        for i in range(1, len(ordered)):
            for part in (ordered[:i], ordered[i:]):
                on = len(part) - sum(dynamics.z[r] for r in part)
                end = on[rho - 1 :: rho]
                start = np.isin(problem.start_regions, part).astype(float)[None]
                begin = cp.vstack([start, end[:-1]]) if problem.slots > 1 else start
                for at in range(rho - 1):
                    program.add("modes", *implies_below(rolls, on[at::rho] - begin - end, 1.0))


def _motion(program: Program, dynamics: Dynamics, grid: Grid) -> None:
    """State Paper A, eqs 2–6 and 18–21: which knots follow the spline, stay, or roll."""
    problem, p, x, v = program.problem, program.p, program.x, program.v
    K, L, rho = problem.knots, problem.legs, problem.knots_per_slot
    swing, walks, rolls = (grid.spread @ m.T for m in (program.S, dynamics.carrying("foot"), program.wheel))
    ends = grid.begin.argmax(axis=1) + rho
    big = 1.0 + problem.limits.speed[0] * problem.duration
    columns = np.ones((1, L))
    for i in range(2):
        begin, now, end = grid.begin @ p[i], p[i][1:], p[i][ends]
        spline = begin + cp.multiply(grid.step.sum(axis=1)[:, None], end - begin)
        stays = now - p[i][:-1]
        step = p[i][rho::rho] - p[i][:-1:rho]
        program.add("step", *implies_below(program.S.T, step - problem.limits.step[i], big))
        program.add("step", *implies_below(program.S.T, -step - problem.limits.step[i], big))
        if i == 1 or not problem.wheels:
            program.add("motion", *implies(swing, now - spline, big), *implies(1 - swing, stays, big))
            continue
        carried = sum(dynamics.before(r, "wheel") for r in range(problem.ground.count))
        at_ends = (grid.spread @ carried.T, rolls)
        speeds = [cp.reshape(v[0][at], (K, 1), order="C") @ columns for at in (ends - rho, ends)]
        weights = [grid.lift.sum(axis=1)[:, None], grid.land.sum(axis=1)[:, None]]
        for lifts in (0, 1):
            for lands in (0, 1):
                path = spline + sum(
                    cp.multiply(w, s) * on for w, s, on in zip(weights, speeds, (lifts, lands), strict=True)
                )
                which = [z if on else 1 - z for z, on in zip(at_ends, (lifts, lands), strict=True)]
                program.add("motion", *implies(swing + which[0] + which[1] - 2, now - path, big))
        rolled = cp.reshape(x[0][1:] - x[0][:-1], (K, 1), order="C") @ columns
        program.add("motion", *implies(walks - swing, stays, big))
        program.add("motion", *implies(rolls - swing, stays - rolled, big))
    rise, (lowest, highest) = problem.robot.swing_height, _heights(problem)
    big = 2 * (highest - lowest + rise)
    begin, now, end = grid.begin @ p[2], p[2][1:], p[2][ends]
    apex = rise * grid.apex[1:].sum(axis=1)[:, None] @ columns
    spline = begin + cp.multiply(grid.climb.sum(axis=1)[:, None], end - begin) + apex
    program.add("motion", *implies(swing, now - spline, big), *implies(walks - swing, now - p[2][:-1], big))
    if problem.wheels:
        # Regions of a group join without a step, so no wheel climbs faster than the steepest lets it.
        climb = problem.ground.steepest * max(problem.limits.speed) * problem.dt * grid.age[:, None] @ columns
        program.add("motion", *implies_below(rolls - swing, now - begin - climb, big))
        program.add("motion", *implies_below(rolls - swing, begin - now - climb, big))


def _heights(problem: Problem) -> tuple[float, float]:
    """Return the lowest and the highest ground."""
    z = np.concatenate([region.vertices[:, 2] for region in problem.ground.regions])
    return float(z.min()), float(z.max())


def _regions(program: Program, dynamics: Dynamics, grid: Grid) -> None:
    """State Paper A, eqs 18 and 22–24: feet are on regions where slots end, wheels in groups at all knots."""
    problem, ground, p = program.problem, program.problem.ground, program.p
    rho, rise = problem.knots_per_slot, problem.robot.swing_height
    places = Places.of(problem, MotionBounds.of(problem))
    lowest, highest = _heights(problem)
    low = np.array([*places.low.min(axis=(1, 2)), lowest])
    high = np.array([*places.high.max(axis=(1, 2)), highest + rise])

    def most(normal: np.ndarray) -> float:
        return float(np.maximum(normal * low, normal * high).sum())

    inner = grid.spread * (grid.age < rho)[:, None]
    for r, region in enumerate(ground.regions):
        a_x, a_y, constant = ground.planes[r]
        plane = np.array([-a_x, -a_y, 1.0])
        steepness = max(most(plane) - constant, most(-plane) + constant, 0.0)
        conditions = [(dynamics.D[r, "foot"].T, slice(rho, None, rho))]
        if problem.wheels:
            group = grid.spread @ dynamics.group(r).T
            conditions.append((group - inner @ program.S.T - dynamics.off(r), slice(1, None)))
        for condition, knots in conditions:
            x, y, z = (p[i][knots] for i in range(3))
            for a, b in zip(*region.halfspaces, strict=True):
                big = max(most(np.array([*a, 0.0])) - b, 0.0)
                program.add("regions", *implies_below(condition, a[0] * x + a[1] * y - b, big))
            program.add("regions", *implies(condition, z - a_x * x - a_y * y - constant, steepness))


def _forces(program: Program, dynamics: Dynamics, grid: Grid) -> None:
    """State Paper A, eqs 7, 18 and 26–29, in the basis of the region below when the interval ends."""
    problem, force, limit = program.problem, program.force, program.problem.limits.force
    swing, walks = (grid.spread @ m.T for m in (program.S, dynamics.carrying("foot")))
    surfaces = problem.ground.surfaces
    most = np.max([_largest_force(surface, problem) for surface in surfaces], axis=0)
    drag = max(surface.rolling_resistance for surface in surfaces) * limit
    resists = [i for i in range(3) if isinstance(program.friction[i], cp.Variable)]
    program.add("friction", *(row for i in range(3) for row in implies(swing, force[i], most[i])))
    for i in resists:
        f = program.friction[i]
        program.add("friction", *implies(swing, f, drag), *implies(walks, f, drag))
    for (r, e), D in dynamics.D.items():
        surface = next(surface for surface in surfaces if r in surface.regions)
        normal, tangent, _ = surface.basis
        n = sum(normal[i] * force[i] for i in range(3))
        condition = grid.spread @ D.T - swing
        if e == "wheel":
            condition = grid.spread @ dynamics.group(r).T - swing - dynamics.off(r)
        # The pyramid of the basis itself: each side as its coefficients of the force's components.
        for side in friction_pyramid(*surface.basis, *surface.friction[e]):
            inside = sum(side[i] * force[i] for i in range(3) if side[i])
            program.add("friction", *implies_below(condition, inside, np.abs(side) @ most))
        program.add("friction", *implies_below(condition, n - limit, np.abs(normal) @ most))
        for i in resists if e == "wheel" else ():
            drawn = tangent[i] * rolling_friction(n, surface.rolling_resistance)
            big = drag * (1.0 + np.abs(normal) @ most / limit)
            program.add("friction", *implies(condition, program.friction[i] - drawn, big))


def _largest_force(surface: Surface, problem: Problem) -> np.ndarray:
    """Return the largest magnitude of each component of a contact force, in body weights."""
    mu = np.max([surface.friction[e] for e in problem.end_effectors], axis=0)
    return problem.limits.force * (np.array([1.0, *mu]) @ np.abs(surface.basis))


def _centroid(program: Program, grid: Grid) -> None:
    """State Paper A, eqs 10–15, with ``s₀`` and without ``n = N_l``."""
    problem = program.problem
    L, J, K = problem.legs, problem.slots, problem.knots
    most = max(len(p) for p in problem.patterns)
    s = program.discrete["s"] = cp.Variable((most + 1, J), boolean=True, name="s")
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


def gait_of(program: Program) -> Gait:
    """Return the gait that the binaries' values say: where feet are from D, and wheels from z."""
    problem, values = program.problem, {k: np.rint(v.value) for k, v in program.discrete.items()}
    ground, rho = problem.ground, problem.knots_per_slot
    S = values["S"].astype(int)
    wheel, occupied = np.zeros_like(S), []
    for r in range(ground.count):
        occupied.append(values["D", r, "foot"])
        if problem.wheels:
            group = sum(values["D", m, "wheel"] for m in ground.groups[ground.group_of[r]])
            on = 1 - values["z", r][rho - 1 :: rho].T if ("z", r) in values else 1
            occupied[r] = occupied[r] + group * on
            wheel += values["D", r, "wheel"].astype(int)
    return Gait(S, wheel, np.argmax(occupied, axis=0))


def solve(
    problem: Problem,
    gap: float,
    time_limit: float,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Give the paper's program to SCIP through CVXPY (see :func:`wfbook.planner.solve`)."""
    begin = time.perf_counter()
    check_start(problem)
    program = build(problem)
    stated = cp.Problem(cp.Minimize(program.cost), program.rows())
    data, chain, inverse = stated.get_problem_data(cp.SCIP)
    built = time.perf_counter() - begin
    options = {"scip_params": {"limits/gap": gap, "limits/time": time_limit}}
    solver = Watched(progress, _offset(inverse))
    answer = solver.solve_via_data(data, warm_start=False, verbose=False, solver_opts=options)
    spent = time.perf_counter() - begin - built
    model = answer["model"]
    if solver.error is not None and not isinstance(solver.error, KeyboardInterrupt):
        raise solver.error
    if model.getNSols() == 0:
        if model.getStatus() == "infeasible":
            raise why_not(problem)
        if model.getStatus() == "userinterrupt":
            raise KeyboardInterrupt
        raise NoPlanError(f"no plan found within {spent:.1f} s")
    with warnings.catch_warnings():
        # "May be inaccurate" is how CVXPY calls a gap or time limit; the plan's meta says which it was.
        warnings.simplefilter("ignore", UserWarning)
        stated.unpack_results(answer, chain, inverse)
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
        # SCIP calls the root's bound infinite when it closes the root by cutting it off.
        "root_bound": min(model.getDualboundRoot() + _offset(inverse), bound),
        "rejected_gaits": 0,
        "solve_time": spent,
        "build_time": built,
    }
    return plan_of(problem, read(program), gait_of(program), meta)


def _offset(inverse: list[Any]) -> float:
    """Return the constant of the objective, which the solver does not see."""
    return float(inverse[-1].get("offset", 0.0))
