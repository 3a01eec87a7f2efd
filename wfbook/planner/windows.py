"""Long horizons: gaits found in overlapping windows, then priced, bounded and polished as a whole.

The search doubles with every slot or so, but what a robot does in the first second hardly depends on
the tenth. So the gait is found in *windows* of a few slots. Each begins in the state that the one before
reached and ends at rest; its first slots are kept, and the next window begins there. Ending at rest
costs something, but what it decides is mostly thrown away, and it makes sure that the next window has a
plan: the rest of the old one, and then standing. That plan is also the first that the next search
prices.

What windows find is only a gait. Its cost is that of one convex program over the whole horizon, and the
bound is the whole problem's, so the gap means what it always means. Time that the windows leave goes to
the search of the whole, which begins with their gait.
"""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wfbook.modes import END_EFFECTORS
from wfbook.planner.explain import InfeasibleError, NoPlanError, check_start
from wfbook.planner.extract import gait_of
from wfbook.planner.gait import Gait
from wfbook.planner.plan import Plan
from wfbook.planner.polish import Polisher
from wfbook.planner.problem import InitialState, Problem
from wfbook.planner.solve import Search, check_limits, first_executable, solve_executable
from wfbook.planner.tree import Progress

_LEAST = 0.05  # of the search of the whole, in seconds: what is needed to end it in good order


def solve_windows(
    problem: Problem,
    window: int = 8,
    commit: int = 4,
    gap: float = 1e-2,
    time_limit: float = 60.0,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[Plan, Plan]:
    """Plan a long horizon in overlapping windows, and polish it as a whole.

    Args:
        problem: what is asked.
        window: number of slots that are searched at once; a problem that is no longer is searched whole.
        commit: number of slots of a window that are kept.
        gap: relative gap at which the search of a window, and of the whole, ends.
        time_limit: of all searching, in seconds. Every window gets an equal share of what is left, and
            so does the whole after them.
        progress: called now and then; ``part`` says which slots are searched.

    Returns:
        The relaxed plan and its polish. ``meta`` is that of :func:`wfbook.planner.solve_executable` for
        the whole problem: objective, bound and gap hold for the whole horizon. Besides, ``meta["how"]``
        is "windows" if the gait is theirs, or "whole", and ``meta["windows"]`` lists for each window its
        slots, goal, objective, bound, gap, status, nodes, solve_time and rejected_gaits. An interrupt or
        the time limit keeps what is planned so far: the robot goes where the last window ends, and
        stands.

    Raises:
        As for :func:`wfbook.planner.solve_executable`.
    """
    check_windows(window, commit)
    check_limits(gap, time_limit)
    check_start(problem)
    begin = time.perf_counter()
    if problem.slots <= window:
        plans = solve_executable(problem, gap=gap, time_limit=time_limit, progress=progress)
        return tuple(plan.with_meta(how="whole", windows=[]) for plan in plans)

    def told(now: Progress, part: str = "") -> None:
        progress(replace(now, time=time.perf_counter() - begin, part=part))

    show = told if progress else None
    windows = _Windows(problem, window, commit, gap, begin + time_limit, show)
    windows.run()
    gaits = [windows.gait] if windows.gait else []
    left = 0.0 if windows.interrupted else begin + time_limit - time.perf_counter()
    with contextlib.closing(Search(problem, gap, max(left, _LEAST), show, gaits)) as search:
        plans = first_executable(search, Polisher(problem))
    meta = plans[0].meta
    changes = {
        "how": "windows" if windows.found(plans[0]) else "whole",
        "windows": windows.records,
        "nodes": meta["nodes"] + sum(record["nodes"] for record in windows.records),
        "solve_time": meta["solve_time"] + sum(record["solve_time"] for record in windows.records),
    }
    if windows.interrupted and meta["status"] != "optimal":
        changes["status"] = "interrupted"
    return tuple(plan.with_meta(**changes) for plan in plans)


@dataclass
class _Windows:
    """The windows of one problem.

    Attributes:
        problem: the whole.
        window: slots in a window.
        commit: slots of it that are kept.
        gap: at which a window's search ends.
        deadline: of everything, on the clock of ``time.perf_counter``.
        progress: called with a window's progress and its name.
        gait: over the whole horizon, standing where nothing is planned yet; None before the first plan.
        records: what ``meta["windows"]`` holds.
        end: slots that the windows cover so far.
        interrupted: by the user.
    """

    problem: Problem
    window: int
    commit: int
    gap: float
    deadline: float
    progress: Callable[[Progress, str], None] | None
    gait: Gait | None = None
    records: list[dict[str, Any]] = field(default_factory=list)
    end: int = 0
    interrupted: bool = False

    def run(self) -> None:
        """Plan window by window, up to the horizon or to the first window without a plan."""
        problem, begin = self.problem, 0
        state, kinds = problem.start_state, problem.start_end_effectors
        while True:
            size = min(self.window, problem.slots - begin)
            part = window_problem(problem, state, size, begin + size == problem.slots)
            if self.gait is not None:
                part = part.begun(state, kinds)
            try:
                relaxed, polished = self._solve(part, begin)
            except KeyboardInterrupt:
                if self.gait is None:
                    raise
                self.interrupted = True
                return
            except (NoPlanError, InfeasibleError) as error:
                # The search of the whole has the last word, with the gait found so far if there is one.
                status = "infeasible" if isinstance(error, InfeasibleError) else "no plan"
                self._record(part, begin, {"status": status, "nodes": 0, "solve_time": 0.0})
                return
            self._keep(relaxed, begin)
            self._record(part, begin, relaxed.meta)
            if self.interrupted or self.end == problem.slots:
                return
            begin += self.commit
            state = state_after(part, polished, self.commit)
            kinds = [END_EFFECTORS[e] for e in polished.end_effector[:, self.commit - 1]]

    def found(self, plan: Plan) -> bool:
        """Tell whether a plan's gait is the windows' own."""
        if self.gait is None:
            return False
        return gait_of(plan).key == self.gait.key

    def _solve(self, part: Problem, begin: int) -> tuple[Plan, Plan]:
        """Search one window."""
        size, J = part.slots, self.problem.slots
        known = [Gait(*(m[:, begin : begin + size] for m in self.gait))] if self.gait else []
        windows_left = 1 + max(0, -(-(J - begin - size) // self.commit))
        share = (self.deadline - time.perf_counter()) / (windows_left + 1)
        name = f"slots {begin + 1}–{begin + size} of {J}"
        show = self.progress and (lambda now: self.progress(now, name))
        limit = max(share, _LEAST)
        with contextlib.closing(Search(part, self.gap, limit, show, known, explain=False)) as search:
            return first_executable(search, Polisher(part))

    def _keep(self, plan: Plan, begin: int) -> None:
        """Enter a window's gait into the whole one."""
        end = self.end = begin + plan.slots
        nothing = np.zeros((self.problem.legs, self.problem.slots), int)
        parts = []
        for old, new in zip(self.gait or (nothing, nothing, nothing), gait_of(plan), strict=True):
            whole = old.copy()
            whole[:, begin:end], whole[:, end:] = new, new[:, -1:]
            parts.append(whole)
        parts[0][:, end:] = 0
        self.gait = Gait(*parts)
        self.interrupted = plan.meta["status"] == "interrupted"

    def _record(self, part: Problem, begin: int, meta: dict[str, Any]) -> None:
        """Note a window and what is known of its search; None where there is no plan."""
        keys = ("objective", "bound", "gap", "status", "nodes", "solve_time", "rejected_gaits")
        record = {"slots": [begin, begin + part.slots], "goal": list(map(float, part.goal))}
        self.records.append(record | {key: meta.get(key) for key in keys})


def check_windows(window: int, commit: int) -> None:
    """Refuse numbers of slots that are no window and no part of one."""
    for name, value, least in (("window", window, 2), ("commit", commit, 1)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise ValueError(f"{name}: {value!r} is not a whole number of at least {least}")
    if commit >= window:
        raise ValueError(f"commit: {commit} is not less than the window's {window} slots")


def window_problem(problem: Problem, state: InitialState, slots: int, last: bool) -> Problem:
    """Return the problem of a window, but for the state in which it begins (:meth:`.Problem.begun`).

    Args:
        problem: the whole.
        state: in which the window begins.
        slots: of the window.
        last: whether it is to end as the whole does; any other ends at rest, towards the goal.
    """
    if last:
        goal, rest, near = problem.goal, problem.final_stance, problem.goal_tolerance
    else:
        goal, rest, near = intermediate_goal(problem, state, slots), True, None
    return replace(problem, slots=slots, goal=goal, final_stance=rest, beyond_reach=True, goal_tolerance=near)


def intermediate_goal(problem: Problem, state: InitialState, slots: int) -> tuple[float, float]:
    """Return the goal of a window: towards the goal, as far as the robot can walk or roll on.

    Any goal is sound, for what windows find is a gait whose cost and bound are those of the whole. But
    a goal much too far makes each window a sprint and a hard stop; and one that is reached early makes
    it stop halfway, in the slots that are kept. So it lies where a walk of the longest steps would be at
    the window's end if it did not have to stop there, or where the robot would be at the speed that it has.

    Args:
        problem: the whole.
        state: in which the window begins.
        slots: of the window.
    """
    limits = problem.limits
    here, there = state.position[:2], np.asarray(problem.goal, float)
    distance = float(np.linalg.norm(there - here))
    if distance == 0.0:
        return problem.goal
    along = (there - here) / distance
    largest = max(len(pattern) for pattern in problem.patterns)
    cycle = max(-(-problem.legs // max(largest, 1)), 1 + problem.stance_between_swings)
    speed = limits.speed[int(along[0] < 0)], limits.lateral_speed
    walk, top = (
        min(s / abs(u) for s, u in zip(most, along, strict=True) if u) for most in (limits.step, speed)
    )
    pace = max(walk / cycle, float(state.velocity[:2] @ along) * problem.slot_duration)
    reach = slots * min(pace, top * problem.slot_duration)
    if reach >= distance:
        return problem.goal
    return tuple(map(float, here + reach * along))


def state_after(problem: Problem, plan: Plan, slots: int) -> InitialState:
    """Return the state of a window's plan after some slots.

    Solvers leave limits exceeded by their tolerance, which a start may not: it is moved back inside.
    """
    k, robot, limits = slots * problem.knots_per_slot, problem.body, problem.limits
    low = [-limits.speed[1], -limits.lateral_speed, -limits.lateral_speed]
    high = [limits.speed[0], limits.lateral_speed, limits.lateral_speed]
    contacts = np.clip(plan.p[k], plan.x[k] + robot.reach_lower, plan.x[k] + robot.reach_upper)
    return InitialState(
        position=plan.x[k],
        velocity=np.clip(plan.v[k], low, high),
        angles=np.clip(plan.theta[k], -limits.angle, limits.angle),
        rates=plan.omega[k],
        contacts=contacts,
        swung=plan.S[:, slots - 1] == 1,
        slot=problem.start_state.slot + slots,
    )
