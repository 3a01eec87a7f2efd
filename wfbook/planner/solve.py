"""Solve a planning problem: formulation, search, plan; then the gait that can also be executed."""

import contextlib
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from wfbook.planner import bigm
from wfbook.planner.crossings import CLOSE
from wfbook.planner.explain import InfeasibleError, NoPlanError, check_start, why_not
from wfbook.planner.extract import fill, gait_of, plan_of, read
from wfbook.planner.gait import Gait
from wfbook.planner.kernel import Kernel
from wfbook.planner.plan import Plan
from wfbook.planner.polish import Polisher, repaired
from wfbook.planner.problem import Problem
from wfbook.planner.tree import Progress, Tree

FORMULATIONS = ("tight", "paper")


def solve(
    problem: Problem,
    formulation: str = "tight",
    gap: float = 1e-3,
    time_limit: float = 60.0,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Solve the mixed-integer program (Paper A, section II).

    Args:
        problem: what is asked.
        formulation: "tight", searched by SCIP with conic bounds from Clarabel; or "paper", the paper's
            big-M program given to SCIP as it is. Both have the same feasible set.
        gap: relative gap ``(objective − bound) / objective`` at which the search ends.
        time_limit: of the search, in seconds.
        progress: called now and then.

    Returns:
        The relaxed plan. ``meta`` holds objective, bound, gap, nodes, status ("optimal", "time limit",
        "interrupted", or "unclear" where a solver's failure keeps the gap open), solve_time and build_time
        in seconds. A time limit or an interrupt returns the incumbent and what was proven.

    Raises:
        ValueError: an argument is wrong.
        InfeasibleError: there is no plan; it names the constraints that exclude each other.
        NoPlanError: the time limit came before the first plan.
        KeyboardInterrupt: the interrupt came before the first plan.
    """
    if formulation not in FORMULATIONS:
        raise ValueError(f"formulation: {formulation!r}, expected one of {FORMULATIONS}")
    check_limits(gap, time_limit)
    if formulation == "paper":
        return bigm.solve(problem, gap, time_limit, progress)
    with contextlib.closing(Search(problem, gap, time_limit, progress)) as search:
        return search.run()


def solve_executable(
    problem: Problem,
    formulation: str = "tight",
    gap: float = 1e-3,
    time_limit: float = 60.0,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[Plan, Plan]:
    """Solve, polish, and search on while the best gait can't be polished.

    Args:
        problem: as for :func:`solve`, like the others.
        formulation: "tight" or "paper"; only the first searches on after a gait that can't be polished.
        gap: relative gap at which the search ends.
        time_limit: of all searching, in seconds.
        progress: called now and then.

    Returns:
        The relaxed plan and its polish. ``meta["rejected_gaits"]`` says how many gaits were cut off
        because no true torque could execute them; bound and gap are those of the gaits that remain.

    Raises:
        NoPlanError: the time limit came before a plan that can be polished.
        InfeasibleError: there is no plan.
    """
    check_limits(gap, time_limit)
    check_start(problem)
    polisher = Polisher(problem)
    if formulation == "paper":
        relaxed = solve(problem, formulation, gap, time_limit, progress)
        polished = polisher.polish(relaxed)
        if not repaired(polished):
            raise NoPlanError(
                "the paper formulation's gait can't be polished; formulation='tight' searches on"
            )
        return relaxed, polished
    with contextlib.closing(Search(problem, gap, time_limit, progress)) as search:
        return first_executable(search, polisher)


def first_executable(search: "Search", polisher: Polisher) -> tuple[Plan, Plan]:
    """Return the best gait that can be polished, as a relaxed and a polished plan."""
    while True:
        relaxed = search.run()
        polished = polisher.polish(relaxed)
        if repaired(polished):
            return relaxed, polished
        search.exclude(relaxed)
        if relaxed.meta["status"] != "optimal":
            # No time to search on, but gaits that were not the best are at hand; the bound holds for all.
            for second in search.known():
                polished = polisher.polish(second)
                if repaired(polished):
                    return second, polished
                search.exclude(second)
            raise NoPlanError(f"{relaxed.meta['status']} before a gait was found that can be polished")


def check_limits(gap: float, time_limit: float) -> None:
    """Refuse a gap or a time limit that is not a positive number."""
    if not (np.isfinite(gap) and gap > 0):
        raise ValueError(f"gap: {gap!r} is not a positive number")
    if not (np.isfinite(time_limit) and time_limit > 0):
        raise ValueError(f"time_limit: {time_limit!r} is not a positive number of seconds")


class Search:
    """A search that can go on after a gait is excluded: bounds and leaves are remembered."""

    def __init__(
        self,
        problem: Problem,
        gap: float,
        time_limit: float,
        progress: Callable[[Progress], None] | None = None,
        gaits: Sequence[Gait] = (),
        explain: bool = True,
        budget: float = np.inf,
    ):
        """Build and compile both programs.

        Args:
            problem: what is asked.
            gap: relative gap at which a search ends.
            time_limit: of all searches together, in seconds.
            progress: called now and then.
            gaits: to be priced first, whatever the time limit.
            explain: say why, should there be no plan; that can take longer than to find it out.
            budget: of all searches together, in relaxations and exact programs.
        """
        check_start(problem)
        begin = time.perf_counter()
        self.problem, self.gap, self.progress, self.gaits = problem, gap, progress, gaits
        self.explain = explain
        self.kernel = Kernel(problem, min(CLOSE, 0.2 * gap))
        self.build_time = time.perf_counter() - begin
        self._left, self._budget = time_limit, budget
        self._spent, self._nodes = 0.0, 0

    def exclude(self, plan: Plan) -> None:
        """Cut a plan's gait off."""
        self.kernel.excluded.add(gait_of(plan).key)

    def close(self) -> None:
        """End the worker process."""
        self.kernel.close()

    def run(self) -> Plan:
        """Search with the time that is left (see :func:`solve`)."""
        kernel = self.kernel
        kernel.pruned = np.inf
        kernel.relax()
        kernel.open()
        tree = Tree(kernel, self.gap, self._left, self.progress, self.gaits, self._budget)
        status, bound, nodes = tree.run()
        self._left = max(self._left - tree.elapsed, 1e-3)
        self._budget = max(self._budget - tree.spent, 1)
        self._spent, self._nodes = self._spent + tree.elapsed, self._nodes + nodes
        if status == "infeasible":
            rejected = len(kernel.excluded)
            raise why_not(self.problem, rejected) if self.explain else InfeasibleError((), rejected)
        if tree.best is None:
            if status == "interrupted":
                raise KeyboardInterrupt
            if status == "unclear":
                raise NoPlanError("no plan found, but for some gaits the solver could not tell")
            raise NoPlanError(f"no plan found within {self._spent:.1f} s and {kernel.qps} relaxations")
        self._bound, self._root_bound, self._status = bound, tree.root_bound, status
        return self._plan(tree.best[1])

    def known(self) -> Iterator[Plan]:
        """Yield plans of the gaits priced so far that are not excluded, the cheapest first."""
        for gait in self.kernel.priced():
            if gait.key not in self.kernel.excluded:
                yield self._plan(gait)

    def _plan(self, gait: Gait) -> Plan:
        """Return the plan of a priced gait, with what is proven of all gaits."""
        kernel = self.kernel
        found = kernel.leaf(gait, quick=True)
        fill(kernel.program, kernel.conic, found.y)
        meta = {
            "stage": "relaxed",
            "formulation": "tight",
            "objective": found.value,
            "bound": min(self._bound, found.value),
            "gap": max(found.value - self._bound, 0.0) / found.value,
            "gap_target": self.gap,
            "status": self._status,
            "nodes": self._nodes,
            "root_bound": self._root_bound,
            "relaxations": kernel.qps,
            "leaves": kernel.leaves,
            "rejected_gaits": len(kernel.excluded),
            "solve_time": self._spent,
            "build_time": self.build_time,
        }
        return plan_of(self.problem, read(kernel.program), gait, meta)
