"""Plans joined end to end: what a robot has done, is doing, and will do next.

A window's plan begins in the state in which the robot is expected. Where that is not quite the state that
the plan before has, the joined plan has a seam: at its knot stand the later plan's values.
"""

from dataclasses import replace

import numpy as np

from wfbook.centroidal import GRAVITY
from wfbook.modes import END_EFFECTORS
from wfbook.planner.extract import gait_of, plan_of
from wfbook.planner.gait import Gait
from wfbook.planner.plan import Plan
from wfbook.planner.polish import torque_mismatch
from wfbook.planner.problem import Problem

_SERIES = ("x", "v", "theta", "omega", "p", "a", "alpha", "lam", "f", "U_plus", "U_minus", "c")


def stitched(before: Plan, slot: int, after: Plan) -> Plan:
    """Return a plan that is another from a slot on.

    Args:
        before: of which the slots before ``slot`` are kept.
        slot: the first slot of ``after``, at most one more than ``before`` has.
        after: of the same terrain and robot, on the same end effectors there.

    Returns:
        The joined plan; ``meta`` is that of ``before``, with the regions of both.
    """
    k = slot * (before.knots // before.slots)
    gaits = zip(gait_of(before), gait_of(after), strict=True)
    gait = Gait(*(np.hstack([old[:, :slot], new]) for old, new in gaits))
    series = {name: (getattr(before, name)[:k], getattr(after, name)) for name in _SERIES}
    return replace(
        before.with_meta(regions=gait.region.tolist()),
        t=before.dt * np.arange(k + after.knots + 1),
        S=np.hstack([before.S[:, :slot], after.S]),
        D=np.concatenate([before.D[:, :slot], after.D], axis=1),
        **{name: np.concatenate(parts) for name, parts in series.items()},
    )


def standing(problem: Problem, region: np.ndarray) -> Plan:
    """Return the plan to stand as long as a problem has slots, in the posture in which it begins.

    Args:
        problem: that begins at rest.
        region: ``(L,)`` index of the region under each leg.
    """
    state, K = problem.start_state, problem.knots
    lever = state.contacts - state.position
    # Upward forces that carry the weight and turn nothing; of all such the most even ones.
    balance = np.vstack([np.ones(len(lever)), lever[:, :2].T])
    lift = np.linalg.lstsq(balance, np.array([problem.robot.mass * GRAVITY, 0.0, 0.0]))[0]
    motion = {"x": state.position, "p": state.contacts}
    values = {name: np.repeat(array[None], K + 1, axis=0) for name, array in motion.items()}
    values |= {name: np.zeros((K + 1, 3)) for name in ("v", "theta", "omega")}
    values |= {name: np.zeros((K, 3)) for name in ("a", "alpha")}
    force = np.zeros((K, problem.legs, 3))
    force[..., 2] = lift / problem.robot.weight
    values |= {"force": force, "friction": 0.0 * force}
    wheel = np.array([END_EFFECTORS.index(name) for name in problem.start_end_effectors])
    gait = Gait(*(np.repeat(m[:, None], problem.slots, axis=1) for m in (0 * wheel, wheel, region)))
    components = {name: list(np.moveaxis(array, -1, 0)) for name, array in values.items()}
    plan = plan_of(problem, components, gait, {"stage": "polished"})
    return plan.with_meta(torque_mismatch_nm=torque_mismatch(plan).tolist())
