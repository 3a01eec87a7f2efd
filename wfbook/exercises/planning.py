"""Checks of chapter 5's exercises: relaxations, big-M, pruning, conflicts and weights.

Problems are small, so that a check plans within seconds; what is true is asked of the planner, never stored.
"""

from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.modes import LEGS

if TYPE_CHECKING:
    from wfbook.planner import Plan, Problem, Weights

BLAMED = ("force", "friction", "goal", "patterns", "reach", "regions", "speed", "step")
"""What a reader may blame; laws of motion and what the robot is asked to do at the end are not at issue."""

FACTOR = 30.0
"""By which one weight is multiplied in :func:`without_wheels`."""

TORQUE_NM = 2.5
DISTANCE_M = 0.25
"""What :func:`honest_weights` asks of a relaxed plan: torque missing at most, and way at least."""

_GAP = 0.01
_PATIENCE = 10.0


def gap_problem() -> "Problem":
    """Return the walk of the first exercise: over a gap of 35 cm, on feet."""
    from wfbook.planner import Problem
    from wfbook.terrain import stepping_stones

    return Problem(
        stepping_stones(gap=0.35, stones=0, start=0.25),
        goal=(0.5, 0.0),
        goal_tolerance=(0.05, 0.05),
        slots=5,
        end_effectors=("foot",),
    )


def small_problem(wheels: bool = False) -> "Problem":
    """Return four slots on flat ground towards a goal 0.4 m ahead."""
    from wfbook.planner import Problem
    from wfbook.terrain import flat

    return Problem(flat(), goal=(0.4, 0.0), slots=4, end_effectors=("foot", "wheel") if wheels else ("foot",))


def conflict(blamed: Iterable[str]) -> str:
    """Check a prediction of which of :data:`BLAMED` take part in the conflict of :func:`gap_problem`.

    Raises:
        WrongAnswer: something is missing, or does no harm; the message says what the planner says.
    """
    from wfbook.planner import InfeasibleError, solve

    if isinstance(blamed, str) or not isinstance(blamed, Iterable):
        raise WrongAnswer(f"blamed is {blamed!r}, not a set of names")
    names = set(blamed)
    if unknown := sorted(map(str, names - set(BLAMED))):
        raise WrongAnswer(f"{', '.join(unknown)}: none of {', '.join(BLAMED)}")
    try:
        solve(gap_problem(), time_limit=_PATIENCE)
    except InfeasibleError as error:
        found, said = error.groups, str(error)
    truth = set(found) & set(BLAMED)
    if innocent := sorted(names - truth):
        raise WrongAnswer(
            f"{', '.join(innocent)}: without {'it' if len(innocent) == 1 else 'them'} there would still "
            "be no plan; what can be left out of a conflict is not part of it"
        )
    if missed := sorted(truth - names):
        hints = {
            "regions": "where the ground ends matters",
            "step": "how far a leg can swing matters",
            "goal": "a robot that may stay where it is has a plan",
        }
        hint = "; ".join(hints.get(name, f"{name} matters") for name in missed)
        raise WrongAnswer(f"{len(missed)} of the {len(truth)} are missing: {hint}")
    return f"Right. The planner says: {said}"


def what_is_left(function: Callable[..., Any], seed: int = 3) -> str:
    """Check the bookkeeping of branch and bound.

    Args:
        function: ``function(bounds, incumbent, gap)`` returns which open nodes must still be searched,
            ``(n,)`` bool, and what is proven: a number that no plan's cost is below.
        seed: of the searches that are tried.

    Raises:
        WrongAnswer: a node is dropped or kept wrongly, or the proof is wrong; with the node's number.
    """
    rng = draws(seed)
    for trial in range(40):
        bounds = rng.uniform(0.2, 1.2, int(rng.integers(1, 8))).round(3)
        incumbent = np.inf if trial == 0 else round(float(rng.uniform(0.3, 1.2)), 3)
        gap = float(rng.choice([1e-3, 0.05, 0.2]))
        if trial % 5 == 3:
            bounds[rng.integers(len(bounds))] = incumbent * (1 - 0.5 * gap)
        answer = called(function, bounds, incumbent, gap, name="what_is_left")
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise WrongAnswer("what_is_left returns two things: which nodes are left, and what is proven")
        left = array(answer[0], bounds.shape, "which nodes are left").astype(bool)
        proven = number(answer[1], "what is proven")
        known = "no plan is known" if np.isinf(incumbent) else f"the best plan costs {incumbent:.3f}"
        for i, bound in enumerate(bounds):
            said = f"node {i} has bound {bound:.4f}, {known}, gap {gap:g}"
            if left[i] and bound >= incumbent * (1 - gap):
                raise WrongAnswer(f"{said}: nothing in it would narrow the gap further; drop it")
            if not left[i] and bound < incumbent * (1 - gap):
                raise WrongAnswer(f"{said}: a plan better by more than the gap may be in it; keep it")
        true = float(min([incumbent, *bounds]))
        if proven > true + 1e-9:
            raise WrongAnswer(
                f"bounds {bounds}, {known}: a plan may cost {true:.4f}, so {proven:.4f} is not proven. "
                "What was dropped within the gap counts, too"
            )
        if proven < true - 1e-9:
            raise WrongAnswer(f"bounds {bounds}, {known}: more than {proven:.4f} is proven, {true:.4f}")
    return "Right: 40 searches, nothing dropped that matters, and no proof that is not one."


def without_wheels(weight: str) -> str:
    """Check a prediction: which weight, :data:`FACTOR` times as large, leaves the robot on its feet.

    Raises:
        WrongAnswer: with that weight the plan still uses wheels; the message says which leg, and when.
    """
    from wfbook.planner import Weights, solve

    names = [f.name for f in fields(Weights)]
    if weight not in names:
        raise WrongAnswer(f"{weight!r} is no weight; there are {', '.join(names)}")
    problem = small_problem(wheels=True)
    changed = replace(problem.weights, **{weight: FACTOR * getattr(problem.weights, weight)})
    plan = solve(replace(problem, weights=changed), gap=_GAP, time_limit=_PATIENCE)
    rolls = np.argwhere((plan.S == 0) & (plan.end_effector == 1))
    if len(rolls):
        leg, slot = rolls[0]
        raise WrongAnswer(
            f"with {weight} × {FACTOR:g} leg {LEGS[leg]} is on its wheel in slot {slot}; the plan has "
            f"{int(plan.S.sum())} swings and gets {plan.distance:.2f} m far. A wheel costs nothing; what "
            "does it take to get one on the ground?"
        )
    return (
        f"Right: with {weight} × {FACTOR:g} no leg uses its wheel. It makes {int(plan.S.sum())} swings "
        f"and gets {plan.distance:.2f} m far: the price is paid for the way onto the wheel."
    )


def honest_weights(weights: "Weights") -> str:
    """Check weights with which the relaxed plan on feet makes up little torque, and still gets ahead.

    Raises:
        WrongAnswer: the torque that is missing, or the way; the message says on which axis and how much.
    """
    from wfbook.planner import NoPlanError, Weights, solve

    if not isinstance(weights, Weights):
        raise WrongAnswer(f"weights is {type(weights).__name__}, not planner.Weights(...)")
    wrong = [f.name for f in fields(weights) if not 0 <= getattr(weights, f.name) < np.inf]
    if wrong:
        raise WrongAnswer(f"{wrong[0]} is {getattr(weights, wrong[0])}; a weight is zero or more")
    try:
        plan = solve(replace(small_problem(), weights=weights), gap=_GAP, time_limit=_PATIENCE)
    except NoPlanError as error:
        raise WrongAnswer(f"{error}; try weights closer to those of the book") from error
    return _judged(plan)


def _judged(plan: "Plan") -> str:
    from wfbook.planner import torque_mismatch

    missing = torque_mismatch(plan)
    axis = int(missing.argmax())
    told = f"{missing[axis]:.1f} N m rms are missing in {('roll', 'pitch', 'yaw')[axis]}"
    if missing[axis] > TORQUE_NM:
        excess = np.abs(plan.alpha @ np.array(plan.meta["inertia"]).T - plan.contact_torque)[:, axis]
        knot = int(excess.argmax())
        raise WrongAnswer(
            f"{told}, more than {TORQUE_NM:g}; most of it at knot {knot}, in slot "
            f"{knot // (plan.knots // plan.slots)}. The plan gets {plan.distance:.2f} m far"
        )
    if plan.distance < DISTANCE_M:
        raise WrongAnswer(
            f"the robot gets {plan.distance:.2f} m far, less than {DISTANCE_M:g} m; {told}. "
            "Who does not move needs no torque"
        )
    return f"Right: {told}, and the robot gets {plan.distance:.2f} m far."
