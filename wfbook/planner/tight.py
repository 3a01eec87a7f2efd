"""The tight formulation: no big-M, every product of a binary and a motion bounded exactly.

What makes it tight, against the paper's big-M of the same feasible set:

* A foot's motion is a sum of *steps*, each zero unless its slot is a swing. A swing of zero step *is*
  the stationary foot, so eqs 6 and 19 need no implication.
* A wheel's roll is a binary times a bounded displacement: McCormick's four inequalities, which are
  exact at binaries and the convex hull between them.
* Where a leg stands and what it stands on is a path through a small graph (:mod:`.contacts`), whose flow
  constraints have integral corners.
* Where a slot ends, each contact point is a sum of one share for each region, zero unless the contact
  is there: the convex hull of the regions instead of eqs 24–25.
* Force is split by end effector and kind of surface, each part zero unless its leg stands on that
  (eqs 7, 27–29).
* The centroid is written relative to the centre of mass, where the reach box bounds every term, and
  eq. 15 is split by the number of swinging legs.
"""

from collections.abc import Sequence
from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.friction import friction_pyramid, rolling_friction
from wfbook.planner.bounds import MotionBounds
from wfbook.planner.contacts import Contacts
from wfbook.planner.ground import Places
from wfbook.planner.problem import Problem
from wfbook.planner.program import Grid, Program, common, within


def build(problem: Problem) -> Program:
    """State the tight formulation, with binaries relaxed to ``[0, 1]``.

    Args:
        problem: what is asked.

    Returns:
        The program. It is the mixed-integer one when ``program.discrete`` is required to be integers.
    """
    places, grid = Places.of(problem, MotionBounds.of(problem)), Grid.of(problem)
    contacts = Contacts.of(problem, places, inner_knots=True)
    force, friction, rows = _forces(contacts, grid)
    program = common(problem, contacts.S, contacts.wheel, force, friction, per_leg=False)
    program.add("friction", *rows)
    program.add("modes", *contacts.rows)
    program.discrete, program.contacts = contacts.discrete(), contacts
    _motion(program, contacts, grid)
    _regions(program, contacts, places)
    _heights(program, contacts, grid, places)
    _centroid(program, contacts, grid)
    return program


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
    lower, upper = problem.body.reach_lower[:, axis], problem.body.reach_upper[:, axis]
    standing = [[leg for leg in range(problem.legs) if leg not in p] for p in problem.patterns if len(p) == n]
    return min(lower[s].mean() for s in standing), max(upper[s].mean() for s in standing)


def region_shares(contacts: Contacts, places: Places) -> tuple[dict[int, dict[int, Any]], list[Any]]:
    """Split the contact points at slot ends by region, each share inside its own (Paper A, eqs 22–25).

    Args:
        contacts: whose occupancy scales the shares.
        places: boxes of what is in reach.

    Returns:
        By region and axis (0 x, 1 y; only those that matter) the shares ``(L, J)``, zero where the region
        is not occupied, and constraints.
    """
    shares, rows = {}, []
    for r in places.used:
        occupied, open_ = contacts.occupancy(r), places.reachable[r].astype(float)
        if not open_.all():
            rows.append(occupied <= open_)
        share = shares[r] = {i: cp.Variable(occupied.shape, name=f"share{r}_{i}") for i in places.axes}
        for i, part in share.items():
            rows.append(part >= cp.multiply(open_ * places.within[r, i], occupied))
            rows.append(part <= cp.multiply(open_ * places.upto[r, i], occupied))
        for a, b in places.edges(r):
            rows.append(sum(a[i] * share[i] for i in share if a[i]) <= b * occupied)
    return shares, rows


def _forces(contacts: Contacts, grid: Grid) -> tuple[list[Any], list[Any], list[Any]]:
    """State Paper A, eqs 7 and 26–29, for forces split by end effector and surface.

    Returns:
        Contact force and rolling friction in body weights, components ``(K, L)``, and constraints.
    """
    problem = contacts.problem
    shape = (problem.knots, problem.legs)
    constraints, total, rolling = [], [0, 0, 0], [np.zeros(shape) for _ in range(3)]
    for s, surface in enumerate(problem.ground.surfaces):
        used = [r for r in surface.regions if r in contacts.regions]
        for e in problem.end_effectors if used else ():
            mu_t, mu_b = surface.friction[e]
            n, b = (cp.Variable(shape, name=f"{axis}{s}_{e}") for axis in "nb")
            t = cp.Variable(shape, name=f"t{s}_{e}") if mu_t > 0 else np.zeros(shape)
            sides = friction_pyramid(n, t, b, mu_t, mu_b)
            constraints += [
                side <= 0 for side in sides if isinstance(side, cp.Expression) and not side.is_constant()
            ]
            constraints.append(n <= problem.limits.force * _loaded(contacts, grid, e, used))
            for part, direction in zip((n, t, b), surface.basis, strict=True):
                total = [c + d * part if d else c for c, d in zip(total, direction, strict=True)]
            if e == "wheel" and surface.rolling_resistance > 0:
                drag = rolling_friction(n, surface.rolling_resistance)
                along = surface.basis[1]
                rolling = [c + d * drag if d else c for c, d in zip(rolling, along, strict=True)]
    return total, rolling, constraints


def _loaded(contacts: Contacts, grid: Grid, end_effector: str, regions: Sequence[int]) -> Any:
    """Return at which intervals a leg may push with an end effector on some regions, ``(K, L)``."""
    if end_effector == "foot":
        return grid.spread @ sum(contacts.foot_stance[r] for r in regions).T
    total = 0
    for g, members in contacts.groups.items():
        if set(members) <= set(regions):
            total = total + grid.spread @ contacts.wheel_stance[g].T
            continue
        for at, here in enumerate((*contacts.passing, contacts.zone)):
            part = [here[r] for r in members if r in regions]
            if part:
                total = total + (grid.spread * (grid.age == at + 1)[:, None]) @ sum(part).T
    return total


def _motion(program: Program, contacts: Contacts, grid: Grid) -> None:
    """State Paper A, eqs 2–6 and 19–21: steps and rolls, horizontally.

    Not as printed, eq. 6: it is no implication. A foot moves by steps, each zero unless its slot is a swing,
    and the spline of a zero step is the stationary foot.
    """
    problem, p, x, v = program.problem, program.p, program.x, program.v
    J, K, L, rho = problem.slots, problem.knots, problem.legs, problem.knots_per_slot
    step = [cp.Variable((L, J), name=f"step{i}") for i in range(2)]
    for i in range(2):
        program.add("step", *within(step[i], problem.limits.step[i] * program.S))
    moved = [grid.step @ step[i].T for i in range(2)]
    if problem.wheels:
        low, high = -problem.limits.speed[1], problem.limits.speed[0]
        rows, columns = np.ones((L, 1)), np.ones((1, L))
        lift, exact = mccormick(
            contacts.carried() - contacts.rolling,
            rows @ cp.reshape(v[0][0:K:rho], (1, J), order="C"),
            low,
            high,
        )
        land, exact_land = mccormick(
            contacts.landing_wheel(),
            rows @ cp.reshape(v[0][rho : K + 1 : rho], (1, J), order="C"),
            low,
            high,
        )
        age = problem.dt * grid.age[:, None]
        travelled = cp.reshape(x[0][1:] - grid.begin @ x[0], (K, 1), order="C") @ columns
        roll, exact_roll = mccormick(grid.spread @ contacts.rolling.T, travelled, low * age, high * age)
        program.add("motion", *exact, *exact_land, *exact_roll)
        moved[0] = moved[0] + grid.lift @ lift.T + grid.land @ land.T + roll
    program.add("motion", *(p[i][1:] == grid.begin @ p[i] + moved[i] for i in range(2)))


def _regions(program: Program, contacts: Contacts, places: Places) -> None:
    """State Paper A, eqs 22–25: contacts lie inside regions where slots end, and rolling wheels always."""
    problem, ground, p = program.problem, program.problem.ground, program.p
    rho = problem.knots_per_slot
    shares, rows = region_shares(contacts, places)
    ends = [p[i][rho::rho].T for i in range(2)]
    program.add("regions", *rows)
    program.add("regions", *(sum(s[i] for s in shares.values()) == ends[i] for i in places.axes))
    if ground.level is None:
        heights = 0
        for r in contacts.regions:
            *slopes, constant = ground.planes[r]
            heights = heights + constant * contacts.occupancy(r)
            heights = heights + sum(slopes[i] * shares[r][i] for i in places.axes if slopes[i])
        program.add("regions", heights - p[2][rho::rho].T == 0)
    for at, here in enumerate(contacts.passing, start=1):
        point = [p[i][at::rho].T for i in range(3)]
        for r, inside in here.items():
            program.add("regions", *_inside(point, r, inside, places, problem.robot.swing_height))


def _inside(point: list[Any], region: int, inside: Any, places: Places, apex: float) -> list[Any]:
    """State that a rolling wheel is on a region if ``inside`` is 1.

    A big-M with the least M that reach allows: the wheel's place when the slot ends, where the hull is
    exact, leaves the knots within the slot little freedom.
    """
    ground, rows = places.ground, []
    outside = 1 - inside
    for i in places.axes:
        below = np.maximum(places.within[region, i] - places.low[i], 0.0)
        above = np.maximum(places.high[i] - places.upto[region, i], 0.0)
        rows.append(point[i] >= places.within[region, i] - cp.multiply(below, outside))
        rows.append(point[i] <= places.upto[region, i] + cp.multiply(above, outside))
    for a, b in places.edges(region):
        most = sum(np.maximum(a[i] * places.low[i], a[i] * places.high[i]) for i in range(2))
        over = np.maximum(most - b, 0.0)
        rows.append(sum(a[i] * point[i] for i in range(2) if a[i]) <= b + cp.multiply(over, outside))
    if ground.level is None:
        slope_x, slope_y, constant = ground.planes[region]
        off = point[2] - slope_x * point[0] - slope_y * point[1] - constant
        least, most = ground.heights(region, places.low, places.high)
        rows.append(off <= cp.multiply(places.highest + apex - least, outside))
        rows.append(-off <= cp.multiply(most - places.lowest, outside))
    return rows


def _heights(program: Program, contacts: Contacts, grid: Grid, places: Places) -> None:
    """State the vertical spline (Paper A, eq. 5) and how contacts rise and fall while they roll."""
    problem, z, S = program.problem, program.p[2], program.S
    bump = problem.robot.swing_height * (grid.apex[1:] @ S.T)
    if problem.ground.level is not None:
        program.add("motion", z[1:] == problem.ground.level + bump)
        return
    most = float((places.highest - places.lowest).max())
    climb = cp.Variable(S.shape, name="climb")
    program.add("motion", *within(climb, most * S))
    moved = grid.climb @ climb.T + bump
    if problem.wheels and problem.ground.steepest > 0:
        rolled = cp.Variable((problem.knots, problem.legs), name="rolled_height")
        farthest = problem.ground.steepest * max(problem.limits.speed) * problem.dt * grid.age[:, None]
        rolls = grid.spread @ contacts.rolling.T
        program.add("motion", *within(rolled, cp.multiply(farthest, rolls)))
        moved = moved + rolled
    program.add("motion", z[1:] == grid.begin @ z + moved)


def _centroid(program: Program, contacts: Contacts, grid: Grid) -> None:
    """State Paper A, eqs 10–15, relative to the centre of mass, split by the number of swinging legs.

    Not as printed, eq. 11: the vertex of a swinging leg is zero relative to the centre of mass, not in the
    world, where its M grows with the distance from the origin. (:mod:`.bigm` keeps that.)
    """
    problem, sizes = program.problem, contacts.sizes
    K, L = problem.knots, problem.legs
    swing = grid.spread @ program.S.T
    ones = np.ones((1, L))
    for i in range(2):
        lower, upper = problem.body.reach_lower[:, i], problem.body.reach_upper[:, i]
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
