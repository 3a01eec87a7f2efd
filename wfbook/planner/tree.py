"""SCIP's tree around the kernel: it keeps the nodes, chooses the next one, and knows bound, gap and time.

Before it begins, common gaits give a first plan, which narrows the search to what is better.
"""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pyscipopt import SCIP_HEURTIMING, SCIP_PARAMSETTING, SCIP_RESULT, Heur, Model

from wfbook.planner.gait import Gait
from wfbook.planner.gaits import improve
from wfbook.planner.kernel import Kernel
from wfbook.planner.plugins import Bound, Gaits, Price, Split


@dataclass(frozen=True)
class Progress:
    """Where a search stands.

    Attributes:
        nodes: of the tree, so far.
        incumbent: cost of the best plan; infinite if there is none.
        bound: no plan costs less.
        gap: ``(incumbent − bound) / incumbent``; infinite without an incumbent.
        time: since the search began.
        part: which slots are searched, where that is not all of them.
    """

    nodes: int
    incumbent: float
    bound: float
    gap: float
    time: float
    part: str = ""


@dataclass
class Tree:
    """One search.

    Attributes:
        kernel: of the problem.
        gap: relative gap at which the search ends.
        time_limit: in seconds, for the search.
        progress: called with a :class:`Progress` now and then.
        gaits: to be priced before anything else, whatever the time limit.
        budget: of relaxations and exact programs, for the search. Unlike the time limit it ends all runs
            of a problem at the same place.
        best: cost and gait of the incumbent.
    """

    kernel: Kernel
    gap: float
    time_limit: float
    progress: Callable[[Progress], None] | None = None
    gaits: Sequence[Gait] = ()
    budget: float = np.inf
    best: tuple[float, Gait] | None = None
    root_bound: float = -np.inf
    error: BaseException | None = None
    model: Model | None = None
    dual_bound: float = np.inf
    _begin: float = field(default_factory=time.perf_counter)
    _shown: float = -np.inf
    _before: int = field(init=False)

    def __post_init__(self):
        self._before = self.kernel.qps + self.kernel.leaves

    @property
    def elapsed(self) -> float:
        """Time since the search began."""
        return time.perf_counter() - self._begin

    @property
    def spent(self) -> int:
        """Relaxations and exact programs solved since the search began."""
        return self.kernel.qps + self.kernel.leaves - self._before

    @property
    def incumbent(self) -> float:
        """Cost of the incumbent; infinite if there is none."""
        return self.best[0] if self.best else np.inf

    @property
    def cutoff(self) -> float:
        """Boxes of this bound or more hold nothing that would narrow the gap further."""
        return self.incumbent * (1 - self.gap)

    def run(self) -> tuple[str, float, int]:
        """Search.

        Returns:
            Status ("optimal", "infeasible", "unclear", "time limit", "budget" or "interrupted"), proven
            bound, node count. It is unclear where the tree is exhausted, but a solver had no answer for
            some leaf.
        """
        with self._interruptible():
            root = self.kernel.boxes.root()
            if root is None or self.kernel.bound(*root).status == "infeasible":
                return "infeasible", np.inf, 0
            self.root_bound = self.kernel.bound(*root).bound
            self.guarded(self._prepare)
            nodes = self._branch() if self.error is None else 0
        # No box is below the root, whatever a solver failed to say of it.
        bound = max(min(self.dual_bound, self.kernel.pruned), self.root_bound)
        bound = min(bound, self.incumbent)
        if isinstance(self.error, KeyboardInterrupt):
            return "interrupted", bound, nodes
        if self.error is not None:
            raise self.error
        exhausted = self.model is None or self.model.getStatus() in ("infeasible", "optimal", "inforunbd")
        # A leaf without an answer, which lowered what is proven, may have been the plan.
        if self.best is None and exhausted and self.kernel.pruned == np.inf:
            return "infeasible", np.inf, nodes
        if self.best is not None and self.incumbent - bound <= self.gap * self.incumbent * (1 + 1e-9):
            return "optimal", bound, nodes
        if exhausted:
            return "unclear", bound, nodes
        return "budget" if self.spent >= self.budget else "time limit", bound, nodes

    def _prepare(self) -> dict[str, Any]:
        """Find a first plan, and narrow the search to what is better."""
        for value, gait in improve(self.kernel, self._late, self.gaits):
            if value < self.incumbent:
                self._keep(value, gait)
        if self.best is not None and self.cutoff > self.root_bound:
            self.kernel.tighten(self.cutoff, self._late)
        return {}

    def _late(self) -> bool:
        """Tell whether it is time to stop."""
        self.report()
        return self.error is not None or self.elapsed > self.time_limit or self.spent >= self.budget

    def _branch(self) -> int:
        """Let SCIP search; return how many nodes it took."""
        root = self.kernel.boxes.root()
        if root is None:
            return 0
        self.model = model = Model()
        model.hideOutput()
        model.setPresolve(SCIP_PARAMSETTING.OFF)
        model.setHeuristics(SCIP_PARAMSETTING.OFF)
        model.setSeparating(SCIP_PARAMSETTING.OFF)
        model.setParams(
            {
                "lp/solvefreq": -1,  # bounds come from the relaxator
                "limits/gap": self.gap,
                "limits/time": max(self.time_limit - self.elapsed, 0.0),
                "misc/catchctrlc": False,  # Python's own handler raises in the next callback
                "nodeselection/bfs/stdpriority": 1000000,
                "nodeselection/bfs/maxplungedepth": 0,
            }
        )
        self.variables = [
            model.addVar(f"z{i}", "I", lb=int(low), ub=int(up))
            for i, (low, up) in enumerate(zip(*root, strict=True))
        ]
        self.cost = model.addVar("cost", "C", lb=0.0, obj=1.0)
        model.includeConshdlr(
            Price(self), "price", "cost at fixed binaries", enfopriority=-1, chckpriority=-1, needscons=False
        )
        model.includeRelax(Bound(self), "bound", "conic relaxation of a box", priority=10, freq=1)
        model.includeBranchrule(Split(self), "split", "prefix counts and totals", 1000000, -1, 1.0)
        model.includeHeur(
            Gaits(self),
            "gaits",
            "common gaits, improved",
            "g",
            freq=0,
            timingmask=SCIP_HEURTIMING.BEFORENODE,
        )
        model.optimize()
        self.dual_bound = model.getDualbound()
        return int(model.getNTotalNodes())

    @contextlib.contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Let the first interrupt end the search, in the next callback, and a second one raise as ever.

        An exception that Python raises between two callbacks is printed by PySCIPOpt and lost.
        """
        main = threading.current_thread() is threading.main_thread()
        if not main or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            yield
            return

        def note(number: int, frame: Any) -> None:
            self.error = KeyboardInterrupt()
            signal.signal(signal.SIGINT, before)

        before = signal.signal(signal.SIGINT, note)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds of the focus node."""
        lower = np.array([round(v.getLbLocal()) for v in self.variables])
        upper = np.array([round(v.getUbLocal()) for v in self.variables])
        return lower, upper

    def price(self, gait: Gait) -> float:
        """Return a gait's cost, and keep it if it is the best so far."""
        value = self.kernel.price([gait], self.cutoff)[0]
        if value < self.incumbent:
            self._keep(value, gait)
        return value

    def _keep(self, value: float, gait: Gait) -> None:
        self.best = (value, gait)
        self.report(force=True)

    def submit(self, heuristic: Heur | None = None) -> bool:
        """Hand the incumbent to SCIP."""
        value, gait = self.best
        solution = self.model.createSol(heuristic)
        for variable, number in zip(self.variables, self.kernel.boxes.vector(gait), strict=True):
            self.model.setSolVal(solution, variable, float(number))
        self.model.setSolVal(solution, self.cost, value)
        return self.model.trySol(solution, printreason=False, checkbounds=False)

    def report(self, force: bool = False) -> None:
        """Call the progress callback, ten times a second at most."""
        if self.progress is None or (not force and self.elapsed - self._shown < 0.1):
            return
        self._shown = self.elapsed
        begun = self.model is not None
        dual = self.model.getDualbound() if begun else -np.inf
        bound = min(max(min(dual, self.kernel.pruned), self.root_bound), self.incumbent)
        gap = (self.incumbent - bound) / self.incumbent if self.best else np.inf
        nodes = int(self.model.getNTotalNodes()) if begun else 0
        self.progress(Progress(nodes, self.incumbent, bound, gap, self.elapsed))

    def guarded(
        self, action: Callable[[], dict[str, Any]], otherwise: Any = SCIP_RESULT.DIDNOTRUN
    ) -> dict[str, Any]:
        """Run a callback's body, unless the budget is spent.

        SCIP would print and ignore an exception, so stop it and raise later.

        Args:
            action: the body.
            otherwise: what to answer from then on; each kind of callback has its own that is harmless.
        """
        if self.error is None and (self.model is None or self.spent < self.budget):
            try:
                return action()
            except BaseException as error:
                self.error = error
        if self.model is not None:
            self.model.interruptSolve()
        return {"result": otherwise}
