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
from wfbook.planner.problem import Problem
from wfbook.planner.program import Grid, within
from wfbook.planner.tight import centroid_bounds, flow, mccormick, pattern_hull
from wfbook.swing import quintic_basis, septic_basis


@dataclass
class Relaxation:
    """The node QP in CVXPY's terms.

    Attributes:
        cost: a lower bound of eq. 31.
        constraints: of the QP.
        S: swing matrix, ``(L, J)`` expression.
        wheel: the wheel's dynamics matrix, ``(L, J)`` expression; zeros where no wheel is allowed.
        discrete: variables that are integers in the program, by the keys of :func:`.tight.assignment`.
    """

    cost: Any
    constraints: list[Any]
    S: Any
    wheel: Any
    discrete: dict[Any, Any]


def build(problem: Problem) -> Relaxation:
    """State the QP for a problem, with binaries relaxed to ``[0, 1]``."""
    J, K, L, dt = problem.slots, problem.knots, problem.legs, problem.dt
    w, robot, limits = problem.weights, problem.robot, problem.limits
    stance = {e: cp.Variable((L, J)) for e in problem.end_effectors}
    landing = {e: cp.Variable((L, J)) for e in problem.end_effectors}
    S = sum(landing.values())
    wheel = stance["wheel"] + landing["wheel"] if problem.wheels else np.zeros((L, J))
    chosen = cp.Variable((len(problem.patterns), J))
    sizes, hull = pattern_hull(problem, S, chosen)
    discrete = {"pattern": chosen} | {("stance", e): v for e, v in stance.items()}
    discrete |= {("landing", e): v for e, v in landing.items()}
    constraints = flow(problem, S, stance, landing) + hull
    cost = w.swing * cp.sum(S @ problem.slot_numbers)

    x, v, a = ([cp.Variable(n) for _ in range(3)] for n in (K + 1, K + 1, K))
    height = problem.ground + robot.height
    rise = x[2]
    x[2] = height + rise
    state = problem.start_state
    constraints += [r == 0 for r in midpoint_integration(x, v, a, dt)]
    constraints += [x[i][0] == state.position[i] for i in range(3)]
    constraints += [v[i][0] == state.velocity[i] for i in range(3)]
    constraints += [v[0] <= limits.speed[0], v[0] >= -limits.speed[1], *within(rise, robot.reach[2])]
    if problem.final_stance:
        constraints += [v[i][K] == 0 for i in range(3)] + [S[:, -1] == 0]
    cost += w.goal * sum(cp.square(x[i][K] - problem.goal[i]) for i in range(2))
    cost += w.acceleration * sum(cp.sum_squares(a[i]) for i in range(3))
    cost += w.height * cp.sum_squares(rise)

    force_cost, force_rows = _forces(problem, a, stance, sizes)
    lever_cost, lever_rows = _levers(problem, x, S, stance, landing, sizes)
    vertical = _vertical_levers(problem, x[2], sizes)
    cost = cost + force_cost + lever_cost + vertical
    return Relaxation(cost, constraints + force_rows + lever_rows, S, wheel, discrete)


def _forces(problem: Problem, a: list[Any], stance: dict, sizes: Any) -> tuple[Any, list[Any]]:
    """Bound the cost of force by its sum over legs; state eqs 1, 26 and 29 for that sum."""
    K, L, region = problem.knots, problem.legs, problem.region
    spread = Grid.of(problem).spread
    weight = problem.weights.force + 4 * problem.weights.bounds
    counts = L - np.arange(sizes.shape[0])
    chosen = spread @ sizes.T
    # The variable is what is squared, for CVXPY gives the square of anything else a variable of its own.
    squared = cp.Variable((K, sizes.shape[0]))
    parts = squared @ np.diag(np.sqrt(counts)) - 1 + chosen
    rows = [parts >= 0, parts <= problem.limits.force * chosen @ np.diag(counts)]
    cost = weight * (cp.sum_squares(squared) - cp.sum((1 - chosen) @ np.diag(1.0 / counts)))
    normal = 1.0 + a[2] / GRAVITY
    rows.append(cp.sum(parts, axis=1) == normal)
    on_wheels = 0
    if problem.wheels:
        on_wheels = cp.Variable(K, nonneg=True)
        rows.append(on_wheels <= problem.limits.force * (spread @ cp.sum(stance["wheel"], axis=0)))
    on_feet = normal - on_wheels
    rows.append(on_feet >= 0)
    rows.append(on_feet <= problem.limits.force * (spread @ cp.sum(stance["foot"], axis=0)))
    # Newton's law leaves nothing free in the other two: what is not rolling friction is contact force.
    along, across = a[0] / GRAVITY, a[1] / GRAVITY
    cost += weight / L / GRAVITY**2 * cp.sum_squares(a[1])
    if problem.wheels and region.rolling_resistance > 0:
        along = along + region.rolling_resistance * on_wheels
        cost += weight / L * cp.sum_squares(along)
    else:
        cost += weight / L / GRAVITY**2 * cp.sum_squares(a[0])
    rows += within(along, region.mu_foot * on_feet + region.mu_wheel * on_wheels)
    rows += within(across, region.mu_foot * on_feet + region.mu_wheel_lateral * on_wheels)
    return cost, rows


def _levers(
    problem: Problem, x: list[Any], S: Any, stance: dict, landing: dict, sizes: Any
) -> tuple[Any, list[Any]]:
    """Bound the horizontal cost of levers and centroid; state eqs 19–22 and 30 at slot ends."""
    J, K, L, rho = problem.slots, problem.knots, problem.legs, problem.knots_per_slot
    w, robot, limits = problem.weights, problem.robot, problem.limits
    ones, legs = np.ones((1, J)), np.ones((L, 1))
    grid = Grid.of(problem)
    mean = np.kron(np.eye(J), np.full((1, rho), 1.0 / rho))
    share = quintic_basis(np.arange(1, rho + 1) / rho).mean(axis=0)
    counts = L - np.arange(sizes.shape[0])
    cost, rows = 0, []
    for i in range(2):
        place, step = cp.Variable((L, J + 1)), cp.Variable((L, J))
        rows += [place[:, 0] == problem.start_contacts[:, i], *within(step, limits.step[i] * S)]
        ends = x[i][0 : K + 1 : rho]
        during = cp.Variable(J)
        rows.append(during == mean @ x[i][1:])
        rolled = rolled_mean = slack = 0
        if problem.wheels and i == 0:
            low, high = -limits.speed[1], limits.speed[0]
            rolled, exact = mccormick(
                stance["wheel"],
                legs @ cp.reshape(ends[1:] - ends[:-1], (1, J), order="C"),
                low * problem.slot_duration,
                high * problem.slot_duration,
            )
            age = problem.dt * grid.age[:rho].mean()
            rolled_mean, exact_mean = mccormick(
                stance["wheel"],
                legs @ cp.reshape(during - ends[:-1], (1, J), order="C"),
                low * age,
                high * age,
            )
            slack = cp.Variable((L, J))
            reach = problem.slot_duration * np.array([share[1], share[3]])
            extremes = [min(low * r, high * r) for r in reach], [max(low * r, high * r) for r in reach]
            rows += exact + exact_mean + [slack >= sum(extremes[0]) * S, slack <= sum(extremes[1]) * S]
        rows.append(place[:, 1:] == place[:, :-1] + step + rolled)
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
            rolling = grid.spread @ cp.sum(stance["wheel"], axis=0)
            about, varied = varied, cp.Variable(K, nonneg=True)
            rows += [varied >= side - most * rolling for side in (about, -about)]
        cost += w.centroid * cp.sum_squares(varied)
    return cost, rows


def _vertical_levers(problem: Problem, z: Any, sizes: Any) -> Any:
    """Return ``4 w_U Σ_kl r_z²`` exactly, as a convex function of height and number of swinging legs.

    With ``h`` the swing's height at mid-interval, ``Σ_l (h S_l − z)² = (2 z − h T/2)² + h² (T − T²/4)``
    for four legs, ``T = Σ_l S_l``; and ``T² = Σ_n n² s_n``.
    """
    J, L, rho = problem.slots, problem.legs, problem.knots_per_slot
    profile = problem.robot.swing_height * septic_basis(np.arange(rho + 1) / rho)[:, 2]
    h = np.tile(0.5 * (profile[1:] + profile[:-1]), J)
    n = np.arange(sizes.shape[0])
    spread = Grid.of(problem).spread
    swinging, square = spread @ (sizes.T @ n), spread @ (sizes.T @ n**2)
    above = 0.5 * (z[1:] + z[:-1]) - problem.ground
    root = np.sqrt(L)
    mixed = cp.sum_squares(root * above - cp.multiply(h, swinging) / root)
    return 4 * problem.weights.bounds * (mixed + cp.sum(cp.multiply(h**2, swinging - square / L)))
