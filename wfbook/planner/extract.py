"""From a solved program to a :class:`~.plan.Plan`."""

from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.centroidal import Robot, least_bounds
from wfbook.modes import END_EFFECTORS, LEGS, contact_centroid, dynamics_matrix
from wfbook.planner.conic import Conic
from wfbook.planner.gait import Gait
from wfbook.planner.plan import Plan
from wfbook.planner.problem import InitialState, Limits, Problem, Weights
from wfbook.planner.program import Program


def fill(program: Program, conic: Conic, y: np.ndarray) -> None:
    """Give the program's CVXPY variables their values in a solution."""
    for variable in cp.Problem(cp.Minimize(0), program.rows()).variables():
        if variable.id in conic.layout:
            variable.save_value(conic.value(variable, y))


def read(program: Program, bounds: bool = True) -> dict[str, list[np.ndarray]]:
    """Return the values of a program's motion and forces, and with ``bounds`` of eq. 9's U±."""
    names = ["x", "v", "a", "theta", "omega", "alpha", "p", "force", "friction"]
    names += ["U_plus", "U_minus"] if bounds else []
    return {
        name: [c.value if isinstance(c, cp.Expression) else c for c in getattr(program, name)]
        for name in names
    }


def plan_of(problem: Problem, values: dict[str, Any], gait: Gait, meta: dict[str, Any]) -> Plan:
    """Assemble a plan from the program's values.

    Args:
        problem: what was asked.
        values: components of ``x, v, a, theta, omega, alpha, p, force, friction`` and, for a relaxed
            plan, ``U_plus`` and ``U_minus`` summed over legs in body weights. Without them U± are set
            to their squares.
        gait: swings, end effectors and regions.
        meta: entries of ``meta`` besides those that describe the problem.
    """
    weight = problem.robot.weight
    world = {
        name: np.stack(values[name], axis=-1) for name in ("x", "v", "a", "theta", "omega", "alpha", "p")
    }
    force, friction = ([np.asarray(c, float) for c in values[name]] for name in ("force", "friction"))
    lever = [world["p"][..., i] - world["x"][:, i, None] for i in range(3)]
    middle = [0.5 * (r[1:] + r[:-1]) for r in lever]
    sides = least_bounds(middle, force)
    if "U_plus" in values:
        # The program knows only the sum over legs: what exceeds the squares is shared evenly.
        for squares, total in zip(sides, (values["U_plus"], values["U_minus"]), strict=True):
            for i in range(3):
                excess = np.maximum(total[i] - squares[i].sum(axis=1), 0.0)
                squares[i] += excess[:, None] / len(LEGS)
    S = np.asarray(gait.S, np.int8)
    return Plan(
        t=problem.dt * np.arange(problem.knots + 1),
        **world,
        lam=weight * np.stack(force, axis=-1),
        f=weight * np.stack(friction, axis=-1),
        U_plus=weight * np.stack(sides[0], axis=-1),
        U_minus=weight * np.stack(sides[1], axis=-1),
        S=S,
        D=dynamics_matrix(*gait, problem.start_regions, problem.ground.count),
        c=contact_centroid(world["p"][1:], S),
        terrain=problem.terrain,
        meta=describe(problem) | {"regions": np.asarray(gait.region).tolist()} | meta,
    )


def gait_of(plan: Plan) -> Gait:
    """Return a plan's gait.

    Where wheels are when slots end is in ``meta["regions"]``; in a plan without it they stay where they
    touched down.
    """
    regions = plan.meta.get("regions", plan.D.sum(axis=3).argmax(axis=2))
    return Gait(plan.S.astype(int), plan.end_effector.astype(int), np.array(regions, int))


def describe(problem: Problem) -> dict[str, Any]:
    """Return the entries of a plan's ``meta`` that describe the problem, ready for JSON."""
    robot = problem.robot
    return {
        "goal": list(map(float, problem.goal)),
        "start": list(map(float, problem.start)),
        "start_end_effectors": list(problem.start_end_effectors),
        "initial": None if problem.initial is None else _plain(problem.initial),
        "end_effectors": [e for e in END_EFFECTORS if e in problem.end_effectors],
        "knots_per_slot": problem.knots_per_slot,
        "mass": robot.mass,
        "inertia": robot.inertia.tolist(),
        "com_height": robot.height,
        "stance": robot.stance.tolist(),
        "reach_lower": robot.reach_lower.tolist(),
        "reach_upper": robot.reach_upper.tolist(),
        "reach": list(robot.reach),
        "swing_height": robot.swing_height,
        "torque_scale": robot.weight,
        "weights": vars(problem.weights).copy(),
        "limits": {k: list(v) if isinstance(v, tuple) else v for k, v in vars(problem.limits).items()},
        "options": {
            "patterns": [list(p) for p in problem.patterns],
            "stance_between_swings": problem.stance_between_swings,
            "final_stance": problem.final_stance,
            "beyond_reach": problem.beyond_reach,
            "goal_tolerance": problem.goal_tolerance and list(map(float, problem.goal_tolerance)),
            "without": list(problem.without),
        },
    }


def _plain(state: InitialState) -> dict[str, Any]:
    """Return a state ready for JSON."""
    return {k: v.tolist() if isinstance(v, np.ndarray) else int(v) for k, v in vars(state).items()}


def problem_of(plan: Plan) -> Problem:
    """Return the problem a plan answers, as its ``meta`` describes it.

    Raises:
        ValueError: an entry of ``meta`` is missing or wrong.
    """
    meta = plan.meta
    try:
        initial = InitialState(**meta["initial"]) if meta.get("initial") else None
        contacts = plan.p[0] if initial is None else initial.contacts
        robot = Robot(
            mass=meta["mass"],
            inertia=np.array(meta["inertia"]),
            height=meta["com_height"],
            stance=np.array(meta["stance"]),
            reach=tuple(meta["reach"]),
            swing_height=meta["swing_height"],
        )
        limits = {k: tuple(v) if isinstance(v, list) else v for k, v in meta["limits"].items()}
        options = meta["options"] | {"patterns": tuple(map(tuple, meta["options"]["patterns"]))}
        if options.get("goal_tolerance"):
            options["goal_tolerance"] = tuple(options["goal_tolerance"])
        options["without"] = tuple(options.get("without", ()))
        return Problem(
            plan.terrain,
            goal=tuple(meta["goal"]),
            slots=plan.slots,
            slot_duration=plan.slot_duration,
            knots_per_slot=meta["knots_per_slot"],
            end_effectors=tuple(meta["end_effectors"]),
            start=tuple(meta["start"]),
            start_offsets=contacts[:, :2] - meta["start"] - robot.stance,
            start_end_effectors=tuple(meta["start_end_effectors"]),
            initial=initial,
            robot=robot,
            weights=Weights(**meta["weights"]),
            limits=Limits(**limits),
            **options,
        )
    except (KeyError, TypeError) as error:
        raise ValueError(f"meta: does not describe a problem ({error!r})") from error
