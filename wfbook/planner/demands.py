"""What a plan asks of the ground and of the legs, whatever was allowed, and what it pays for."""

import numpy as np

from wfbook.centroidal import GRAVITY
from wfbook.modes import END_EFFECTORS
from wfbook.planner.extract import gait_of, problem_of
from wfbook.planner.plan import Plan
from wfbook.planner.program import Grid, Program, cost_terms

_LOADED = 0.02
"""Of the weight; under a lighter leg the ratio of two small forces says nothing."""


def friction_needed(plan: Plan, end_effector: str = "foot") -> float:
    """Return the least coefficient of friction that holds all contacts of a kind (Paper A, eq. 26).

    Args:
        plan: its forces are seen in the basis of the region in which each contact is.
        end_effector: "foot"; or "wheel", of which the force along the rolling direction counts.

    Returns:
        The largest ratio of tangential to normal force, each direction by itself; 0 without such contacts.
    """
    regions, rho = plan.terrain.regions, plan.knots // plan.slots
    weight, worst = float(plan.meta["mass"]) * GRAVITY, 0.0
    for leg, slot in np.argwhere((plan.S == 0) & (plan.end_effector == END_EFFECTORS.index(end_effector))):
        region = regions[int(plan.D[leg, slot].sum(axis=1).argmax())]
        force = plan.lam[rho * slot : rho * (slot + 1), leg]
        normal = force @ region.normal
        along, across = (np.abs(force @ d) for d in (region.tangent, region.binormal))
        sideways = np.maximum(along, across) if end_effector == "foot" else along
        loaded = normal > _LOADED * weight
        worst = max(worst, float((sideways[loaded] / normal[loaded]).max(initial=0.0)))
    return worst


def load_carried(plan: Plan) -> np.ndarray:
    """Return the share of the weight with which each leg presses on the ground, ``(K, L)``.

    Args:
        plan: its forces count along the normal of the region in which each leg ends its slot.

    Returns:
        Nothing (NaN) for a leg in the air.
    """
    weight, (_, _, normal) = float(plan.meta["mass"]) * GRAVITY, _bases(plan)
    return np.where(_stands(plan), np.sum(plan.lam * normal, axis=-1) / weight, np.nan)


def grip_used(plan: Plan) -> np.ndarray:
    """Return the share of its friction pyramid that each leg's force uses, ``(K, L)`` (Paper A, eq. 26).

    Args:
        plan: its forces are seen in the basis of the region in which each leg ends its slot.

    Returns:
        Of a foot the larger of the two directions', of a wheel that along its axle; nothing (NaN) for a leg
        in the air or hardly loaded.
    """
    regions, (tangent, binormal, _) = plan.terrain.regions, _bases(plan)
    share = load_carried(plan)
    ends = np.repeat(plan.end_effector, plan.knots // plan.slots, axis=1).T
    wheel = ends == END_EFFECTORS.index("wheel")
    along, across = (np.abs(np.sum(plan.lam * d, axis=-1)) for d in (tangent, binormal))
    where = np.repeat(gait_of(plan).region, plan.knots // plan.slots, axis=1).T
    mu_foot, mu_wheel = (
        np.array([getattr(region, name) for region in regions])[where]
        for name in ("mu_foot", "mu_wheel_lateral")
    )
    sideways = np.where(wheel, across / mu_wheel, np.maximum(along, across) / mu_foot)
    normal = np.where(share > _LOADED, share, np.nan) * float(plan.meta["mass"]) * GRAVITY
    return sideways / normal


def _stands(plan: Plan) -> np.ndarray:
    """``(K, L)`` bool, which legs stand."""
    return np.repeat(plan.S == 0, plan.knots // plan.slots, axis=1).T


def _bases(plan: Plan) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return t, b and n of the region under each leg, ``(K, L, 3)`` each."""
    where = np.repeat(gait_of(plan).region, plan.knots // plan.slots, axis=1).T
    directions = (
        [getattr(r, name) for r in plan.terrain.regions] for name in ("tangent", "binormal", "normal")
    )
    return tuple(np.array(group)[where] for group in directions)


def reach_needed(plan: Plan) -> np.ndarray:
    """Return how far contacts get from their nominal places under the body (Paper A, eq. 30).

    Args:
        plan: at all of its knots.

    Returns:
        ``(2,)`` along x and y, the largest of all legs.
    """
    away = plan.p[..., :2] - plan.x[:, None, :2] - np.array(plan.meta["stance"])
    return np.abs(away).max(axis=(0, 1))


def cost_parts(plan: Plan) -> dict[str, float]:
    """Return what each term of the cost contributes (Paper A, eqs 31–33), by the name of its weight.

    Args:
        plan: relaxed, for the parts to add up to its objective; the U± of a polished plan are others.
    """
    problem = problem_of(plan)
    vectors = {name: list(getattr(plan, name).T) for name in ("x", "v", "a", "theta", "omega", "alpha")}
    p, force, friction = (list(np.moveaxis(values, -1, 0)) for values in (plan.p, plan.lam, plan.f))
    weight, level = problem.robot.weight, problem.ground.level
    if level is None:
        level = (p[2] - problem.robot.swing_height * Grid.of(problem).apex @ plan.S.T).mean(axis=1)
    sides = [list(side.sum(axis=1).T / weight) for side in (plan.U_plus, plan.U_minus)]
    program = Program(
        problem,
        **vectors,
        p=p,
        force=[F / weight for F in force],
        friction=[f / weight for f in friction],
        U_plus=sides[0],
        U_minus=sides[1],
        centroid=list((plan.c - plan.x[1:]).T[:2]),
        S=plan.S,
        wheel=plan.end_effector,
        constraints={},
        ground=level,
    )
    parts = {name: float(term.value) for name, term in cost_terms(program).items()}
    return parts | {"bounds": problem.priced.bounds * float(np.sum(sides))}
