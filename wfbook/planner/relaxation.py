"""A small convex program whose optimum is a lower bound of the mixed-integer one.

The search solves hundreds of relaxations, so they must be cheap. This one is a QP: rotation is
dropped, but the squares that bound the torque (eq. 9) stay in the cost, for ``U⁺ + U⁻`` is never less
than the sum of its squares. It knows feet only where slots begin and end, and forces only by their
sum over legs. Each shortening is a bound:

* ``Σ_k r_k² ≥ ρ r̄²`` with the mean over a slot's knots, for levers and for the centroid;
* ``Σ_l F_l² ≥ N²/m`` for ``m`` standing legs that carry ``N`` together, which is split by the number
  of swinging legs. Each part ``N_n²/m`` of a chosen ``n`` may be written
  ``((N_n + 1 − s_n)² − (1 − s_n))/m``, the same at ``s_n ∈ {0, 1}`` and much higher between.
"""

from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.centroidal import GRAVITY, midpoint_integration
from wfbook.friction import friction_pyramid
from wfbook.planner.bounds import MotionBounds
from wfbook.planner.contacts import Contacts
from wfbook.planner.ground import Places, Surface
from wfbook.planner.problem import Problem
from wfbook.planner.program import Grid, within
from wfbook.planner.tight import centroid_bounds, mccormick, region_shares
from wfbook.swing import quintic_basis, septic_basis


@dataclass
class Relaxation:
    """The node QP in CVXPY's terms.

    Attributes:
        cost: a lower bound of eq. 31.
        constraints: of the QP.
        contacts: its discrete variables.
        x: of the centre of mass, ``(K+1,)``.
        places: of the contacts when slots end, x and y, each ``(L, J+1)``.
    """

    cost: Any
    constraints: list[Any]
    contacts: Contacts
    x: Any
    places: list[Any]


def build(problem: Problem, bounds: MotionBounds) -> Relaxation:
    """State the QP for a problem, with binaries relaxed to ``[0, 1]``.

    Args:
        problem: what is asked.
        bounds: of the centre of mass; if they hold for plans below some cost only, so does the QP.
    """
    J, K, dt = problem.slots, problem.knots, problem.dt
    w, robot, limits, ground = problem.priced, problem.body, problem.limits, problem.ground
    places = Places.of(problem, bounds)
    contacts = Contacts.of(problem, places, inner_knots=False)
    S = contacts.S
    constraints = list(contacts.rows)
    cost = w.swing * cp.sum(S @ problem.slot_numbers)

    x, v, a = ([cp.Variable(n) for _ in range(3)] for n in (K + 1, K + 1, K))
    rise = x[2]
    state = problem.start_state
    x[2] = state.position[2] + rise
    constraints += [r == 0 for r in midpoint_integration(x, v, a, dt)]
    constraints += [x[i][0] == state.position[i] for i in range(3)]
    constraints += [v[i][0] == state.velocity[i] for i in range(3)]
    constraints += [v[0] <= limits.speed[0], v[0] >= -limits.speed[1]]
    if problem.final_stance:
        constraints += [v[i][K] == 0 for i in range(3)] + [S[:, -1] == 0]
    if problem.goal_tolerance is not None:
        for i in (0, 1):
            constraints += within(x[i][K] - problem.goal[i], problem.goal_tolerance[i])
    cost += w.goal * sum(cp.square(x[i][K] - problem.goal[i]) for i in range(2))
    cost += w.acceleration * sum(cp.sum_squares(a[i]) for i in range(3))

    shares, rows = region_shares(contacts, places)
    constraints += rows
    if ground.level is not None:
        clearance = x[2] - ground.level - robot.height
        constraints += within(clearance[1:], robot.reach[2])
        cost += w.height * cp.sum_squares(clearance[1:]) + _vertical_levers(problem, x[2], contacts.sizes)
    else:
        part, rows = _heights(contacts, shares, x[2])
        cost += part
        constraints += rows
    ends = [cp.Variable((problem.legs, J + 1)) for _ in range(2)]
    for part, rows in (_forces(contacts, a), _levers(contacts, x, ends, shares, bounds)):
        cost = cost + part
        constraints += rows
    return Relaxation(cost, constraints, contacts, x[0], ends)


def _forces(contacts: Contacts, a: list[Any]) -> tuple[Any, list[Any]]:
    """Bound the cost of force by its sum over legs; state Paper A, eqs 1, 26 and 29, for it."""
    problem, sizes = contacts.problem, contacts.sizes
    K, L = problem.knots, problem.legs
    spread = Grid.of(problem).spread
    weight, most = problem.priced.force + 4 * problem.priced.bounds, problem.limits.force
    counts = L - np.arange(sizes.shape[0])
    chosen = spread @ sizes.T
    # The variable is what is squared, for CVXPY gives the square of anything else a variable of its own.
    squared = cp.Variable((K, sizes.shape[0]))
    parts = squared @ np.diag(np.sqrt(counts)) - 1 + chosen
    surfaces = problem.ground.surfaces
    steepest = max(_upward(s) for s in surfaces)
    rows = [parts >= 0, parts <= most * steepest * chosen @ np.diag(counts)]
    cost = weight * (cp.sum_squares(squared) - cp.sum((1 - chosen) @ np.diag(1.0 / counts)))
    normal = 1.0 + a[2] / GRAVITY
    plain = len(surfaces) == 1 and surfaces[0].level
    along, across, upward, more = (_on_level if plain else _on_surfaces)(contacts, a, normal, spread)
    rows.append(cp.sum(parts, axis=1) == upward)
    cost += weight / L / GRAVITY**2 * cp.sum_squares(a[1] if plain else GRAVITY * across)
    resists = problem.wheels and any(s.rolling_resistance > 0 for s in surfaces)
    # A square of the acceleration itself is cheaper than one of an expression.
    cost += weight / L * (cp.sum_squares(a[0]) / GRAVITY**2 if not resists else cp.sum_squares(along))
    return cost, rows + more


def _upward(surface: Surface) -> float:
    """Return the largest vertical force for a unit of normal force."""
    n, t, b = surface.basis
    mu = np.max(list(surface.friction.values()), axis=0)
    return float(n[2] + mu[0] * abs(t[2]) + mu[1] * abs(b[2]))


def _on_level(
    contacts: Contacts, a: list[Any], normal: Any, spread: np.ndarray
) -> tuple[Any, Any, Any, list[Any]]:
    """Share the normal force between feet and wheels on one level surface.

    Newton's law leaves nothing free in the other two directions: what is not rolling friction is contact
    force.

    Returns:
        The contact force along x, y and z, ``(K,)``, and constraints.
    """
    problem, surface = contacts.problem, contacts.problem.ground.surfaces[0]
    most, on_wheels, rows = problem.limits.force, 0, []
    if problem.wheels:
        on_wheels = cp.Variable(problem.knots, nonneg=True)
        rows.append(on_wheels <= most * (spread @ cp.sum(contacts.rolling, axis=0)))
    on_feet = normal - on_wheels
    rows += [on_feet >= 0, on_feet <= most * (spread @ cp.sum(contacts.feet, axis=0))]
    along, across = a[0] / GRAVITY, a[1] / GRAVITY
    if problem.wheels and surface.rolling_resistance > 0:
        along = along + surface.rolling_resistance * on_wheels
    foot, wheel = surface.friction["foot"], surface.friction["wheel"]
    rows += within(along, foot[0] * on_feet + wheel[0] * on_wheels)
    rows += within(across, foot[1] * on_feet + wheel[1] * on_wheels)
    return along, across, normal, rows


def _on_surfaces(
    contacts: Contacts, a: list[Any], normal: Any, spread: np.ndarray
) -> tuple[Any, Any, Any, list[Any]]:
    """Share the force between feet and wheels on surfaces of several slopes or frictions.

    Returns:
        The contact force along x, y and z, ``(K,)``, and constraints.
    """
    problem = contacts.problem
    most, total, drag, rows, wheels = problem.limits.force, [0, 0, 0], [0, 0, 0], [], 0
    for surface in problem.ground.surfaces:
        used = [r for r in surface.regions if r in contacts.regions]
        for e in problem.end_effectors if used else ():
            n, t, b = (cp.Variable(problem.knots) for _ in range(3))
            rows += [side <= 0 for side in friction_pyramid(n, t, b, *surface.friction[e])]
            rows.append(n <= most * (spread @ cp.sum(_carrying(contacts, e, used), axis=0)))
            for force, direction in zip((n, t, b), surface.basis, strict=True):
                total = [c + d * force if d else c for c, d in zip(total, direction, strict=True)]
            if e == "wheel":
                wheels = wheels + n
                resisted = surface.rolling_resistance * surface.basis[1]
                drag = [c - d * n if d else c for c, d in zip(drag, resisted, strict=True)]
    if problem.wheels:
        rows.append(wheels <= most * (spread @ cp.sum(contacts.rolling, axis=0)))
    rows += [a[i] / GRAVITY == total[i] + drag[i] for i in range(2)]
    rows.append(normal == total[2] + drag[2])
    return *total, rows


def _carrying(contacts: Contacts, end_effector: str, regions: list[int]) -> Any:
    """Return an upper bound of which legs may push on some regions during a slot, ``(L, J)``.

    A wheel that crosses an edge pushes on both sides of it, and if it can pass a whole region within a
    slot, on what its ends do not show.
    """
    if end_effector == "foot":
        return sum(contacts.foot_stance[r] for r in regions)
    problem, ground = contacts.problem, contacts.problem.ground
    farthest = max(problem.limits.speed) * problem.slot_duration
    total = 0
    for g, members in contacts.groups.items():
        inside = [r for r in members if r in regions]
        short = any(np.ptp(ground.regions[r].vertices[:, 0]) <= farthest for r in inside)
        if set(members) <= set(inside) or (inside and short):
            total = total + contacts.wheel_stance[g]
        else:
            total = total + sum(contacts.before(r) + contacts.zone[r] for r in inside)
    return total


def _heights(contacts: Contacts, shares: dict, z: Any) -> tuple[Any, list[Any]]:
    """Bound the cost of heights on ground that is not one level plane; state Paper A, eq. 30, vertically.

    The mean height of the ground under the legs follows the splines between slot ends (eq. 5), but for
    legs that roll, which are given what slopes and speed allow. ``Σ_l r_z² ≥ L mean²``.

    Returns:
        The cost, and constraints.
    """
    problem, w, robot, heights = contacts.problem, contacts.problem.priced, contacts.problem.body, 0
    J, K, L, rho, grid = problem.slots, problem.knots, problem.legs, problem.knots_per_slot, Grid.of(problem)
    for r in contacts.regions:
        *slopes, constant = problem.ground.planes[r]
        heights = heights + constant * contacts.occupancy(r)
        heights = heights + sum(slopes[i] * part for i, part in shares[r].items() if slopes[i])
    lever = heights - np.ones((L, 1)) @ cp.reshape(z[rho::rho], (1, J), order="C")
    rows = [lever >= robot.reach_lower[0, 2], lever <= robot.reach_upper[0, 2]]

    # The clearance is the height above the mean of the ground, less the nominal one.
    ground, clearance = cp.Variable(J + 1), cp.Variable(K + 1)
    rows += [ground[0] == problem.start_heights.mean(), ground[1:] == cp.sum(heights, axis=0) / L]
    between = grid.spread @ np.eye(J, J + 1) + grid.climb @ (np.eye(J, J + 1, 1) - np.eye(J, J + 1))
    above = z[1:] - robot.height - between @ ground
    if problem.wheels and problem.ground.steepest > 0:
        rolled = cp.Variable(K)
        inner = grid.age < rho
        farthest = problem.ground.steepest * max(problem.limits.speed) * problem.slot_duration / L * inner
        rows += within(rolled, cp.multiply(farthest, grid.spread @ cp.sum(contacts.rolling, axis=0)))
        above = above + rolled
    first = problem.start_state.position[2] - problem.start_heights.mean() - robot.height
    rows += [clearance[0] == first, clearance[1:] == above]
    bump, n = _bumps(problem), np.arange(contacts.sizes.shape[0])
    swinging = grid.spread @ (contacts.sizes.T @ n)
    middle = 0.5 * (clearance[1:] + clearance[:-1]) + robot.height
    levers = cp.sum_squares(np.sqrt(L) * middle - cp.multiply(bump, swinging) / np.sqrt(L))
    return w.height * cp.sum_squares(clearance) + 4 * w.bounds * levers, rows


def _bumps(problem: Problem) -> np.ndarray:
    """Return the height of a swing at mid-interval, ``(K,)``."""
    rho = problem.knots_per_slot
    profile = problem.robot.swing_height * septic_basis(np.arange(rho + 1) / rho)[:, 2]
    return np.tile(0.5 * (profile[1:] + profile[:-1]), problem.slots)


def _levers(
    contacts: Contacts, x: list[Any], places: list[Any], shares: dict, bounds: MotionBounds
) -> tuple[Any, list[Any]]:
    """Bound the horizontal cost of levers and centroid; state Paper A, eqs 19–22 and 30."""
    problem, S, sizes = contacts.problem, contacts.S, contacts.sizes
    J, K, L, rho = problem.slots, problem.knots, problem.legs, problem.knots_per_slot
    w, robot, limits = problem.priced, problem.body, problem.limits
    ones, legs = np.ones((1, J)), np.ones((L, 1))
    grid = Grid.of(problem)
    mean = np.kron(np.eye(J), np.full((1, rho), 1.0 / rho))
    share = quintic_basis(np.arange(1, rho + 1) / rho).mean(axis=0)
    counts = L - np.arange(sizes.shape[0])
    cost, rows = 0, []
    for i in range(2):
        place, step = places[i], cp.Variable((L, J))
        rows += [place[:, 0] == problem.start_contacts[:, i], *within(step, limits.step[i] * S)]
        ends = x[i][0 : K + 1 : rho]
        during = cp.Variable(J)
        rows.append(during == mean @ x[i][1:])
        rolled = rolled_mean = slack = 0
        if problem.wheels and i == 0:
            low, high = -limits.speed[1], limits.speed[0]
            rolled, exact = mccormick(
                contacts.rolling,
                legs @ cp.reshape(ends[1:] - ends[:-1], (1, J), order="C"),
                *bounds.travel,
            )
            rolled_mean, exact_mean = mccormick(
                contacts.rolling,
                legs @ cp.reshape(during - ends[:-1], (1, J), order="C"),
                *bounds.drift,
            )
            slack = cp.Variable((L, J))
            reach = problem.slot_duration * np.array([share[1], share[3]])
            extremes = [min(low * r, high * r) for r in reach], [max(low * r, high * r) for r in reach]
            rows += exact + exact_mean + [slack >= sum(extremes[0]) * S, slack <= sum(extremes[1]) * S]
        rows.append(place[:, 1:] == place[:, :-1] + step + rolled)
        if any(i in share for share in shares.values()):
            rows.append(place[:, 1:] == sum(share[i] for share in shares.values()))
        nominal = robot.stance[:, [i]] @ ones
        lever = place - legs @ cp.reshape(ends, (1, J + 1), order="C")
        rows += within(lever[:, 1:] - nominal, robot.reach[i])
        if problem.final_stance:
            rows += within(lever[:, -1] - robot.stance[:, i], limits.rest_offset[i])
        foot = place[:, :-1] + share[2] * step + rolled_mean + slack
        lever_mean = foot - legs @ cp.reshape(during, (1, J), order="C")
        middle = lever_mean + (lever[:, :-1] - lever[:, 1:]) / (2 * rho)
        cost += 4 * w.bounds * rho * cp.sum_squares(middle)

        vertex, away, parts = cp.Variable((L, J)), cp.Variable((L, J)), cp.Variable(sizes.shape)
        lower, upper = robot.reach_lower[:, [i]] @ ones, robot.reach_upper[:, [i]] @ ones
        rows += [vertex >= cp.multiply(lower, 1 - S), vertex <= cp.multiply(upper, 1 - S)]
        rows.append(vertex + away == lever_mean)
        rows += [away >= cp.multiply(lower, S), away <= cp.multiply(upper, S)]
        edge = [centroid_bounds(problem, n, i) for n in range(sizes.shape[0])]
        rows += [
            parts >= np.diag([e[0] for e in edge]) @ sizes,
            parts <= np.diag([e[1] for e in edge]) @ sizes,
        ]
        rows.append(cp.sum(vertex, axis=0) == counts @ parts)
        cost += w.centroid * rho * cp.sum_squares(cp.sum(parts, axis=0))
        # Within a slot whose standing legs are all feet, c − x varies as the centre of mass does.
        varied = x[i][1:] - grid.spread @ during
        if problem.wheels:
            most = 0.5 * (rho - 1) * problem.dt * max(*limits.speed, limits.lateral_speed)
            rolling = grid.spread @ cp.sum(contacts.rolling, axis=0)
            about, varied = varied, cp.Variable(K, nonneg=True)
            rows += [varied >= side - most * rolling for side in (about, -about)]
        cost += w.centroid * cp.sum_squares(varied)
    return cost, rows


def _vertical_levers(problem: Problem, z: Any, sizes: Any) -> Any:
    """Return ``4 w_U Σ_kl r_z²`` exactly, as a convex function of height and number of swinging legs.

    With ``h`` the swing's height at mid-interval, ``Σ_l (h S_l − z)² = (2 z − h T/2)² + h² (T − T²/4)``
    for four legs, ``T = Σ_l S_l``; and ``T² = Σ_n n² s_n``.
    """
    L, h = problem.legs, _bumps(problem)
    n = np.arange(sizes.shape[0])
    spread = Grid.of(problem).spread
    swinging, square = spread @ (sizes.T @ n), spread @ (sizes.T @ n**2)
    above = 0.5 * (z[1:] + z[:-1]) - problem.ground.level
    root = np.sqrt(L)
    mixed = cp.sum_squares(root * above - cp.multiply(h, swinging) / root)
    return 4 * problem.priced.bounds * (mixed + cp.sum(cp.multiply(h**2, swinging - square / L)))
