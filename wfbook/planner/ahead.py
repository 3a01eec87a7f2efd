"""Plan a window in another process, while this one does something else.

The search of a window ends with a number of relaxations rather than seconds, so that the same question has
the same answer however busy the machine is; how long it took is part of the answer.
"""

import contextlib
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wfbook.planner.explain import InfeasibleError, NoPlanError
from wfbook.planner.gait import Gait
from wfbook.planner.plan import Plan
from wfbook.planner.polish import Polisher
from wfbook.planner.problem import Problem
from wfbook.planner.solve import Search, first_executable
from wfbook.planner.worker import Worker, available

_STOP = 3  # slots that a stop takes, at most

_UNLIMITED = 1e6  # seconds; the budget ends the search


class Answer(NamedTuple):
    """What became of the planning of a window.

    Attributes:
        status: of the relaxed plan, or "infeasible" or "no plan".
        plans: the relaxed plan and its polish; None if there is none.
        duration: how long it took to answer, in seconds.
        cpu_time: seconds of a core in that time; less where other programs are at work.
    """

    status: str
    plans: tuple[Plan, Plan] | None
    duration: float
    cpu_time: float


def plan_window(problem: Problem, gaits: Sequence[Gait], gap: float, budget: int) -> Answer:
    """Search a window and polish what is found.

    Args:
        problem: of the window.
        gaits: to be tried first.
        gap: at which the search ends.
        budget: of relaxations and exact programs.
    """
    begin, cpu_begin = time.perf_counter(), time.process_time()
    status, plans = "infeasible", None
    if problem.start_in_reach:
        try:
            search = Search(problem, gap, _UNLIMITED, gaits=gaits, explain=False, budget=budget)
            with contextlib.closing(search):
                plans = first_executable(search, Polisher(problem))
            status = plans[0].meta["status"]
        except NoPlanError:
            status = "no plan"
        except InfeasibleError:
            status = "infeasible"
    if status == "interrupted":  # half an answer is none
        raise KeyboardInterrupt
    return Answer(status, plans, time.perf_counter() - begin, time.process_time() - cpu_begin)


def hints(gait: Gait, offset: int, slots: int) -> list[Gait]:
    """Return what is worth trying first, once some slots of a window are done.

    The rest of the old gait and then standing is a plan, unless the robot went astray. The old gait ends
    with a stop; those that put it off, and meanwhile walk or roll on as before it, are often better.

    Args:
        gait: of the old window.
        offset: how many slots of it are done.
        slots: of the new window.
    """
    whole = gait.S.shape[1]
    rest = np.arange(min(offset, whole), whole)[:slots]
    more = slots - len(rest)
    stand = np.full(more, whole - 1)
    found = [_picked(gait, np.concatenate([rest, stand]), len(rest))]
    for stop in range(1, min(_STOP, len(rest), whole - 2) + 1 if more else 1):
        cycle = whole - stop - 2 + np.arange(more) % 2  # walking repeats itself every two slots
        found.append(_picked(gait, np.concatenate([rest[:-stop], cycle, rest[-stop:]]), slots))
    return found


def _picked(gait: Gait, slots: np.ndarray, swings: int) -> Gait:
    """Return a gait of some slots of another, in which no leg swings after a number of them."""
    S, wheel, region = (part[:, slots] for part in gait)
    S = np.where(np.arange(len(slots)) < swings, S, 0)
    return Gait(S, wheel, region)


class Planner:
    """Answers one question at a time, in another process where there is a core for it."""

    def __init__(self) -> None:
        """Start the process."""
        self._worker = Worker(plan_window) if available() else None
        self._answer: Answer | None = None

    def ask(self, problem: Problem, gaits: Sequence[Gait], gap: float, budget: int) -> None:
        """Ask for a window (see :func:`plan_window`); without a second core, planning is done here."""
        if self._worker is not None:
            self._worker.ask(problem, gaits, gap, budget)
        else:
            self._answer = plan_window(problem, gaits, gap, budget)

    def answer(self, timeout: float | None = None) -> Answer | None:
        """Return the answer; None if it is not there after some seconds."""
        if self._worker is not None:
            if timeout is not None and not self._worker.answered(timeout):
                return None
            return self._worker.answer()
        answer, self._answer = self._answer, None
        return answer

    def cancel(self) -> None:
        """Forget the question."""
        if self._worker is not None:
            self._worker.kill()
            self._worker = Worker(plan_window)
        self._answer = None

    def close(self) -> None:
        """End the process at once."""
        if self._worker is not None:
            self._worker.kill()
            self._worker = None
