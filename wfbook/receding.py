"""Chapter 8: plan the next window while the robot executes this one.

A plan in windows (:mod:`wfbook.planner.windows`) need not be complete before the robot sets off. While it
executes the first slots of a window, the next window is planned in another process, from the state in
which the robot will be then: where the plan has it, corrected by what the robot knows of itself. It may have
been pushed, and then feet stand beside their places, or the robot rolls too fast.

Every window is polished and ends at rest. If the next one is not there in time, or there is none, the robot
carries the present one to its end, stands, and goes on when there is a plan again.

**Time.** Planning and simulation are on one clock: a plan that is asked for at a time of the simulation and
takes a second is there a second later, by that clock. How long planning takes is different in every run, so
by default (``clock="budget"``) plans count as there in time, and a budget of relaxations sees to it that they
nearly are; two runs of one seed are then the same. How long each took is measured and reported beside the
time that there was. With ``clock="wall"`` a plan is there only after its planning time.
"""

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook.forecast import expected_state
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.modes import END_EFFECTORS
from wfbook.planner.ahead import Answer, Planner, hints
from wfbook.planner.explain import NoPlanError, check_start, why_not
from wfbook.planner.extract import describe, gait_of
from wfbook.planner.gait import Gait
from wfbook.planner.problem import InitialState, Problem
from wfbook.planner.solve import check_limits
from wfbook.planner.stitch import standing, stitched
from wfbook.planner.windows import check_windows, state_after, window_problem
from wfbook.runs import Run
from wfbook.simulate import run as execute
from wfbook.tracking import Tracker

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan

Clock = str | Callable[[int, float], float]

_FIRST = 8
"""How much more may be spent on the first window, which has all the time it takes."""

_WAITING = 6
"""How much more on another one that begins at rest: there is no gait to go on with, and the robot waits."""

_AHEAD = 0.003
"""How long before its first lift-off a plan is taken over: more than a tick, less than two."""

_LEAST = 2
"""Slots of the shortest window: one to swing, one to stand."""

_ATTEMPTS = 3
"""How often a robot that stands asks for a plan that there is not."""

_EVENTS = ("late", "without_plan", "waited_slots")
"""What a run's ``meta`` says of the windows: all but times, which differ from run to run."""


def run(
    problem: Problem,
    window: int = 8,
    commit: int = 4,
    gap: float = 0.02,
    budget: int = 30,
    clock: Clock = "budget",
    goal: Callable[[float], tuple[float, float]] | None = None,
    **execution: Any,
) -> tuple[Run, "Plan", "Plan"]:
    """Plan and execute a long horizon, window by window.

    Args:
        problem: what is asked, from rest. Slots in which the robot waits for a plan do not count as its.
        window: number of slots that are planned at once.
        commit: number of slots of a window that are executed before the next one takes over.
        gap: at which the search of a window ends.
        budget: of relaxations and exact programs for a window; the first has eight times as much, another
            one that begins at rest six times.
        clock: "budget", "wall", or a function from a window's number and its measured planning time to the
            seconds that it counts as.
        goal: where to go, ``(x, y)``, from the time; asked whenever a window is planned. Default: the
            problem's.
        execution: options of :func:`wfbook.simulate.run`.

    Returns:
        The run and what was executed, joined from the windows: the relaxed and the polished plan. The run's
        ``metrics["replanning"]`` lists the windows: slots, goal, status, gap, budget spent, planning time
        (``planning_s``, and of a core ``planning_cpu_s``), the time there was (``available_s``), their ratio
        ``share``, by how much planning took too long (``late_s``), and how far from the plan before it the
        robot was expected (``correction_m``). It counts those that were ``late`` by the clock in use and
        those ``without_plan``, and the ``waited_slots``.

    Raises:
        ValueError: an argument is wrong.
        InfeasibleError: the first window has no plan.
        NoPlanError: none was found.
    """
    check_windows(window, commit)
    check_limits(gap, 1.0)
    if isinstance(budget, bool) or not isinstance(budget, int | np.integer) or budget < 1:
        raise ValueError(f"budget: {budget!r} is not a whole number of at least 1")
    if clock not in ("budget", "wall") and not callable(clock):
        raise ValueError(f"clock: {clock!r} is neither 'budget' nor 'wall' nor a function")
    if problem.initial is not None:
        raise ValueError("initial: the robot begins at rest")
    if not problem.stance_between_swings:
        raise ValueError("stance_between_swings: False, but a swing must end with its window")
    check_start(problem)
    with contextlib.closing(Planner()) as planner:
        loop = _Loop(problem, planner, window, commit, gap, int(budget), clock, goal)
        result = execute(loop.plans[1], continuation=loop, **execution)
    relaxed, polished = loop.executed()
    known = {name: polished.meta[name] for name in ("status", "objective", "bound", "gap", "nodes")}
    known |= {"solve_time_s": polished.meta["solve_time"], "replanning": loop.summary(result)}
    events = {key: value for key, value in known["replanning"].items() if key in _EVENTS}
    events |= {"window": window, "commit": commit, "gap": gap, "budget": int(budget)}
    events["clock"] = clock if isinstance(clock, str) else "function"
    run = replace(result, metrics=result.metrics | known, meta=result.meta | {"replanning": events})
    return run, relaxed, polished


@dataclass
class _Question:
    """A window that is being planned.

    Attributes:
        problem: of the window.
        asked: time of the simulation.
        clock: wall time when it was asked.
        correction: of the centre of mass where it begins, from the plan before it.
        answer: if it came, but too late so far.
    """

    problem: Problem
    asked: float
    clock: float
    correction: float = 0.0
    answer: Answer | None = None


class _Loop:
    """What a simulation asks after every tick for a plan to go on with.

    Attributes:
        plans: relaxed and polished, from the first slot to the end of the present window.
        records: of the windows.
        waited: slots in which the robot stood for want of a plan.
    """

    def __init__(
        self,
        problem: Problem,
        planner: Planner,
        window: int,
        commit: int,
        gap: float,
        budget: int,
        clock: Clock,
        goal: Callable[[float], tuple[float, float]] | None,
    ) -> None:
        self.problem, self.planner, self.goal = problem, planner, goal
        self.window, self.commit = window, commit
        self.gap, self.budget, self.clock = gap, budget, clock
        self.records: list[dict[str, Any]] = []
        self.waited = 0
        self._question: _Question | None = None
        self._failures = 0
        self._gait: Gait | None = None
        self._began = 0  # slot of the executed plan in which the present window began
        self._moved = 0  # slots of the problem before it
        self._next: int | None = None  # slot of the executed plan from which another plan is wanted
        self._begin()

    def __call__(self, t: float, tracker: Tracker, robot: Go1Dynamics) -> "tuple[Plan, int] | None":
        """Return a plan to go on with if it is time for one (see :data:`wfbook.simulate.Continuation`)."""
        if self._next is None or t < self._began * self.problem.slot_duration:
            return None
        if self._question is None:
            self._ask(t, tracker, robot)
        if t + tracker.delay + _AHEAD < self._next * self.problem.slot_duration:
            return None
        question, there = self._question, t - self._question.asked
        answer, late = self._answer(question, there)
        at_rest = self._next == self.plans[1].slots
        if late and at_rest:
            question.answer = answer
            return self._stand()
        self._question = None
        self._record(question, answer, there, "late" if late else answer.status)
        if not late and answer.plans is not None:
            self._failures = 0
            return self._take(answer.plans)
        if answer is None:
            self.planner.cancel()
        if not at_rest:  # to the end of the window, where the robot can wait
            end = self.plans[1].slots
            self._next = end if self._left(end) >= _LEAST else None
            return None
        self._failures += 1
        if self._failures == _ATTEMPTS:
            self._next = None
            return None
        return self._stand()

    def summary(self, run: Run) -> dict[str, Any]:
        """Return what ``metrics["replanning"]`` holds."""
        later = self.records[1:]
        planning = [record["planning_s"] for record in later]
        goal = self.problem.goal
        return {
            "late": sum(record["status"] == "late" for record in later),
            "without_plan": sum(record["status"] in ("infeasible", "no plan") for record in later),
            "waited_slots": self.waited,
            "planning_s_median": float(np.median(planning)) if planning else None,
            "share_max": max((record["share"] for record in later), default=None),
            "goal_distance_m": float(np.linalg.norm(run.com[-1, :2] - goal)),
            "windows": self.records,
        }

    def executed(self) -> "tuple[Plan, Plan]":
        """Return the relaxed and the polished plan that were executed."""
        known = {key: None for key in ("objective", "bound", "gap", "gap_target", "root_bound")}
        known |= {"status": "replanned", "how": "replanned", "windows": self.records}
        known["nodes"] = sum(record["nodes"] or 0 for record in self.records)
        known["solve_time"] = sum(record["planning_s"] for record in self.records)
        return tuple(plan.with_meta(**describe(self.problem), **known) for plan in self.plans)

    def _begin(self) -> None:
        """Plan the first window, for which the robot waits."""
        question = self._asked(self.problem.start_state, self.problem.start_end_effectors, 0, 0.0)
        self.planner.ask(question.problem, [], self.gap, _FIRST * self.budget)
        answer = self.planner.answer()
        self._record(question, answer, None, answer.status)
        if answer.status == "infeasible":
            raise why_not(question.problem)
        if answer.plans is None:
            raise NoPlanError("no plan found for the first window within its budget")
        self.plans = answer.plans
        self._enter(answer.plans[0], 0)

    def _asked(self, state: InitialState, kinds: Sequence[str], moved: int, t: float) -> _Question:
        """Return the question for a window."""
        if self.goal is not None:
            self.problem = replace(self.problem, goal=self.goal(t), beyond_reach=True)
        slots = min(self.window, self.problem.slots - moved)
        part = window_problem(self.problem, state, slots, moved + slots == self.problem.slots)
        if moved or self.records:
            part = part.begun(replace(state, slot=moved), kinds)
        return _Question(part, t, time.perf_counter())

    def _ask(self, t: float, tracker: Tracker, robot: Go1Dynamics) -> None:
        """Ask for the window that begins in the slot from which another plan is wanted."""
        plan, slot = self.plans[1], self._next
        state = expected_state(self.problem, plan, slot, t, tracker, robot)
        kinds = [END_EFFECTORS[e] for e in plan.end_effector[:, slot - 1]]
        question = self._asked(state, kinds, self.problem.slots - self._left(slot), t)
        knot = slot * self.problem.knots_per_slot
        question.correction = float(np.linalg.norm((state.position - plan.x[knot])[:2]))
        known = hints(self._gait, slot - self._began, question.problem.slots)
        budget = self.budget * (_WAITING if slot == plan.slots else 1)
        self.planner.ask(question.problem, known, self.gap, budget)
        self._question = question

    def _left(self, slot: int) -> int:
        """Return how many slots of the problem are left when a slot of the executed plan begins."""
        return self.problem.slots - self._moved - min(slot - self._began, self._gait.S.shape[1])

    def _answer(self, question: _Question, there: float) -> tuple[Answer | None, bool]:
        """Return the answer, and whether it took longer than the time that there was."""
        answer = question.answer
        if answer is None:
            timeout = None
            if self.clock == "wall":
                timeout = max(there - (time.perf_counter() - question.clock), 0.0)
            answer = self.planner.answer(timeout)
        if answer is None:
            return None, True
        if self.clock == "budget":
            return answer, False
        taken = answer.duration if self.clock == "wall" else self.clock(len(self.records), answer.duration)
        return answer, taken > there

    def _take(self, plans: "tuple[Plan, Plan]") -> "tuple[Plan, int]":
        """Go on with a window's plans."""
        slot = self._next
        self.plans = tuple(stitched(old, slot, new) for old, new in zip(self.plans, plans, strict=True))
        self._moved = self.problem.slots - self._left(slot)
        self._enter(plans[0], slot)
        return self.plans[1], slot

    def _enter(self, plan: "Plan", slot: int) -> None:
        """Note that a window begins, and from when on the next one is wanted."""
        self._gait, self._began = gait_of(plan), slot
        self._next = slot + self.commit
        if self._left(self._next) < _LEAST:
            self._next = None

    def _stand(self) -> "tuple[Plan, int]":
        """Stand for another slot."""
        self.waited += 1
        slot = self._next
        state = state_after(self.problem, self.plans[1], slot)
        kinds = [END_EFFECTORS[e] for e in self.plans[1].end_effector[:, -1]]
        still = replace(state, velocity=np.zeros(3), angles=np.zeros(3), rates=np.zeros(3))
        part = self.problem.begun(still, kinds, slots=1, beyond_reach=True)
        plan = standing(part, gait_of(self.plans[1]).region[:, -1])
        self.plans = tuple(stitched(old, slot, plan) for old in self.plans)
        self._next += 1
        return self.plans[1], slot

    def _record(self, question: _Question, answer: Answer | None, there: float | None, status: str) -> None:
        """Note what became of a window.

        Args:
            question: the window.
            answer: None if it was not there yet.
            there: for how long the robot could wait for it; None for the first.
            status: of it.
        """
        part, plans = question.problem, answer.plans if answer else None
        taken = answer.duration if answer else time.perf_counter() - question.clock
        begin = self._next or 0
        record = {
            "slots": [begin, begin + part.slots],
            "goal": list(map(float, part.goal)),
            "status": status,
            "planning_s": taken,
            "planning_cpu_s": answer.cpu_time if answer else None,
            "available_s": there,
            "share": None if there is None else taken / max(there, 1e-9),
            "late_s": None if there is None else max(taken - there, 0.0),
            "correction_m": question.correction,
        }
        known = plans[0].meta if plans else {}
        keys = ("objective", "bound", "gap", "nodes", "relaxations", "leaves", "rejected_gaits")
        self.records.append(record | {key: known.get(key) for key in keys})
