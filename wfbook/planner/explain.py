"""Why is there no plan? A smallest set of constraint groups that exclude each other."""

import cvxpy as cp
import numpy as np
from scipy import optimize, sparse

from wfbook.planner import tight
from wfbook.planner.conic import Conic
from wfbook.planner.problem import Problem

MEANING = {
    "start": "the start posture",
    "end": "rest at the end with every contact near its nominal place",
    "reach": "the reach boxes",
    "speed": "the speed limits",
    "step": "the longest step",
    "regions": "the edges of the region",
    "friction": "friction and the largest force",
    "patterns": "which legs may swing together",
    "modes": "when legs may swing and change end effector",
    "dynamics": "Newton's law",
    "motion": "how feet and wheels move",
}
"""What the groups of :class:`~.program.Program` mean, most often to blame first."""

_TIME_LIMIT = 10.0


class InfeasibleError(ValueError):
    """No plan satisfies all constraints.

    Attributes:
        groups: names of constraint groups that exclude each other; without any one of them there is a
            plan. Empty if a plan exists but every one was cut off because it can't be polished.
    """

    def __init__(self, groups: tuple[str, ...], rejected: int = 0):
        self.groups = groups
        if groups:
            reasons = " and ".join(f"{MEANING[g]} ({g})" for g in groups)
            message = f"infeasible: no plan satisfies {reasons}" + (" together" if len(groups) > 1 else "")
        else:
            message = f"infeasible: none of the {rejected} gaits that reach the end can be executed (torque)"
        super().__init__(message)


class NoPlanError(RuntimeError):
    """The search ended without a plan, and without a proof that there is none."""


def conflicting_groups(problem: Problem) -> tuple[str, ...]:
    """Return constraint groups that exclude each other, none of which can be left out.

    A deletion filter: leave out one group after another, and keep out what is not needed for the
    contradiction. Torque and rotation have slack and never take part, so each question is a
    mixed-integer *linear* feasibility problem.

    Args:
        problem: one without a plan.

    Returns:
        Names of groups; empty if the constraints do not contradict each other.
    """
    if (problem.start_regions < 0).any():
        return ("start", "regions")
    if not problem.start_in_reach:
        return ("start", "reach")
    program = tight.build(problem)
    soft = ("torque bounds", "torque", "rotation", "centroid")
    dropped = set(soft)
    if _feasible(program, dropped):
        return ()
    for group in reversed(MEANING):
        if group in program.constraints and not _feasible(program, dropped | {group}):
            dropped.add(group)
    return tuple(g for g in MEANING if g in program.constraints and g not in dropped)


def _feasible(program, dropped: set[str]) -> bool:
    """Tell whether the program has a point without some groups."""
    discrete = list(program.discrete.values())
    # Mentioned without effect, so that every discrete variable has columns.
    rows = program.rows(without=tuple(dropped)) + [v <= 1 for v in discrete] + [v >= 0 for v in discrete]
    conic = Conic.compile(cp.sum(discrete[0]), rows)
    n = conic.A.shape[1]
    integer = np.zeros(n)
    for variable in discrete:
        integer[conic.columns(variable).ravel()] = 1
    low = conic.b.copy()
    low[conic.equalities :] = -np.inf
    result = optimize.milp(
        np.zeros(n),
        constraints=optimize.LinearConstraint(sparse.csc_array(conic.A), low, conic.b),
        integrality=integer,
        bounds=optimize.Bounds(-np.inf, np.inf),
        options={"time_limit": _TIME_LIMIT},
    )
    # A time limit proves nothing: the group then stays among those to blame.
    return result.status != 2
