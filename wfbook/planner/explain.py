"""Why is there no plan? A smallest set of limits that exclude each other, found by leaving them out."""

from wfbook.modes import LEGS
from wfbook.planner.elastic import LAWS, Elastic
from wfbook.planner.neighbours import distance
from wfbook.planner.problem import Problem
from wfbook.planner.reasons import Reason, reasons, words

MEANING = {
    "start": "the start posture",
    "goal": "the goal",
    "end": "rest at the end with every contact near its nominal place",
    "regions": "the edges of the regions",
    "step": "the longest step",
    "motion": "how feet and wheels move",
    "modes": "when legs may change end effector and region",
    "pause": "a slot of standing between two swings",
    "patterns": "which legs may swing together",
    "dynamics": "Newton's law",
    "force": "the largest force of a leg",
    "friction": "friction",
    "speed": "the speed limits",
    "reach": "the reach boxes",
}
"""What groups of constraints mean. What comes late is left out first, so what comes early is blamed."""

PATIENCE = 5.0
"""Seconds for one question. A group about which nothing can be told in that time stays among the blamed."""

TOTAL = 30.0
"""Seconds for all questions."""


class InfeasibleError(ValueError):
    """No plan satisfies all constraints.

    Attributes:
        groups: names of constraint groups (keys of :data:`MEANING`) that exclude each other; without any
            one of them, but those in ``undecided``, they don't. Empty if the limits don't contradict each
            other, but every plan was cut off because it can't be polished.
        details: what of these groups is to blame, by leg, region and slot, and by how much.
        undecided: groups that may not matter; there was not enough time to tell.
    """

    def __init__(
        self,
        groups: tuple[str, ...],
        rejected: int = 0,
        details: tuple[Reason, ...] = (),
        undecided: tuple[str, ...] = (),
    ):
        self.groups, self.details, self.undecided = groups, details, undecided
        if details:
            limits = ", ".join(g for g in groups if g not in LAWS)
            message = f"{'; '.join(d.text for d in details)} (conflicting: {limits}{_when(details)})"
        elif groups:
            reasons = " and ".join(f"{MEANING[g]} ({g})" for g in groups)
            message = f"no plan satisfies {reasons}" + (" together" if len(groups) > 1 else "")
        elif rejected:
            message = f"none of the {rejected} gaits that reach the end can be executed (torque)"
        else:
            message = "which limits exclude each other could not be told"
        if groups and undecided:
            message += (
                f"; there was no time to tell whether {words(undecided)} matter{'s' * (len(undecided) == 1)}"
            )
        super().__init__(f"infeasible: {message}")


def _when(details: tuple[Reason, ...]) -> str:
    """Say within how many slots the conflict shows, if not in all, and not at once."""
    slots = details[0].slots
    return f"; already in slots 0 to {slots[1]}" if slots and slots[1] > 0 else ""


class NoPlanError(RuntimeError):
    """The search ended without a plan, and without a proof that there is none."""


def check_start(problem: Problem) -> None:
    """Refuse a start posture with which no plan can begin.

    Raises:
        InfeasibleError: a leg starts over no region, or out of reach.
    """
    if not problem.start_in_reach:
        raise why_not(problem)


def why_not(problem: Problem, rejected: int = 0) -> InfeasibleError:
    """Explain why a problem has no plan.

    A deletion filter: leave out one group of limits after another, and keep out what is not needed for the
    contradiction. Then the same for the parts of what is left.

    Args:
        problem: one without a plan.
        rejected: how many gaits were excluded because they can't be polished.

    Returns:
        The error to raise.
    """
    unsupported = _unsupported(problem)
    if unsupported:
        return InfeasibleError(("start", "regions"), rejected, unsupported)
    elastic = Elastic(problem, PATIENCE, TOTAL)
    if elastic.feasible(elastic.parts) is not False:
        return InfeasibleError((), rejected)
    present = {part.group for part in elastic.parts}
    kept, undecided = [g for g in MEANING if g in present], []
    for group in reversed(kept):
        rest = [g for g in kept if g != group]
        verdict = elastic.feasible([part for part in elastic.parts if part.group in rest])
        if verdict is False:
            kept = rest
        elif verdict is None:
            undecided.append(group)
    groups = tuple(g for g in MEANING if g in kept)
    return InfeasibleError(groups, rejected, reasons(elastic, groups), tuple(reversed(undecided)))


def _unsupported(problem: Problem) -> tuple[Reason, ...]:
    """Name legs that start over no region, and where."""
    found = []
    for leg in (problem.start_regions < 0).nonzero()[0]:
        place = problem.start_contacts[leg]
        away = [distance(region, place) for region in problem.terrain.regions]
        nearest = away.index(min(away))
        text = (
            f"leg {LEGS[leg]} starts at ({place[0]:.2f}, {place[1]:.2f}), over no region, "
            f"{away[nearest]:.2f} m from region {nearest}"
        )
        found.append(Reason("start", text, (LEGS[leg],), (nearest,), (0, 0), missing=away[nearest]))
    return tuple(found)
