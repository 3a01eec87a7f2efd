"""SCIP's tree around the kernel: a relaxator, a branching rule, a constraint handler and a heuristic.

SCIP keeps the nodes, chooses the next one, and knows incumbent, bound, gap and time. It sees integer
variables only and a cost that no row explains: the relaxator bounds it, the branching rule splits
boxes, the constraint handler prices what is fixed, the heuristic proposes gaits.
"""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pyscipopt import SCIP_HEURTIMING, SCIP_PARAMSETTING, SCIP_RESULT, Branchrule, Conshdlr, Heur, Model
from pyscipopt.scip import Relax

from wfbook.planner.gait import Gait
from wfbook.planner.gaits import improve
from wfbook.planner.kernel import INTEGRAL, Kernel


@dataclass(frozen=True)
class Progress:
    """Where a search stands.

    Attributes:
        nodes: of the tree, so far.
        incumbent: cost of the best plan; infinite if there is none.
        bound: no plan costs less.
        gap: ``(incumbent − bound) / incumbent``; infinite without an incumbent.
        time: since the search began.
    """

    nodes: int
    incumbent: float
    bound: float
    gap: float
    time: float


@dataclass
class Tree:
    """One search.

    Attributes:
        kernel: of the problem.
        gap: relative gap at which the search ends.
        time_limit: in seconds, for the search.
        progress: called with a :class:`Progress` now and then.
        first: gaits to try before others.
        best: cost and gait of the incumbent.
    """

    kernel: Kernel
    gap: float
    time_limit: float
    progress: Callable[[Progress], None] | None = None
    first: Sequence[Gait] = ()
    best: tuple[float, Gait] | None = None
    root_bound: float = -np.inf
    error: BaseException | None = None
    _begin: float = field(default_factory=time.perf_counter)
    _shown: float = -np.inf

    @property
    def elapsed(self) -> float:
        """Time since the search began."""
        return time.perf_counter() - self._begin

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
            Status ("optimal", "infeasible", "time limit" or "interrupted"), proven bound, node count.
        """
        root = self.kernel.boxes.root()
        if root is None or self.kernel.bound(*root).status == "infeasible":
            return "infeasible", np.inf, 0
        self.root_bound = self.kernel.bound(*root).bound
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
            _Price(self), "price", "cost at fixed binaries", enfopriority=-1, chckpriority=-1, needscons=False
        )
        model.includeRelax(_Bound(self), "bound", "conic relaxation of a box", priority=10, freq=1)
        model.includeBranchrule(_Split(self), "split", "prefix counts and totals", 1000000, -1, 1.0)
        model.includeHeur(
            _Gaits(self),
            "gaits",
            "common gaits, improved",
            "g",
            freq=0,
            timingmask=SCIP_HEURTIMING.BEFORENODE,
        )
        with self._interruptible():
            model.optimize()
        status, nodes = model.getStatus(), int(model.getNTotalNodes())
        bound = min(model.getDualbound(), self.kernel.pruned, self.incumbent)
        if isinstance(self.error, KeyboardInterrupt):
            return "interrupted", bound, nodes
        if self.error is not None:
            raise self.error
        if self.best is None and status in ("infeasible", "optimal", "inforunbd"):
            return "infeasible", np.inf, nodes
        if self.best is not None and self.incumbent - bound <= self.gap * self.incumbent * (1 + 1e-9):
            return "optimal", bound, nodes
        return "time limit", bound, nodes

    @contextlib.contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Let the first interrupt end the search, in the next callback, and a second one raise as ever.

        An exception that Python raises between two callbacks is printed by PySCIPOpt and lost.
        """
        if threading.current_thread() is not threading.main_thread():
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
        bound = min(max(self.model.getDualbound(), self.root_bound), self.kernel.pruned, self.incumbent)
        gap = (self.incumbent - bound) / self.incumbent if self.best else np.inf
        self.progress(Progress(int(self.model.getNTotalNodes()), self.incumbent, bound, gap, self.elapsed))

    def guarded(
        self, action: Callable[[], dict[str, Any]], otherwise: Any = SCIP_RESULT.DIDNOTRUN
    ) -> dict[str, Any]:
        """Run a callback's body; SCIP would print and ignore an exception, so stop it and raise later.

        Args:
            action: the body.
            otherwise: what to answer from then on; each kind of callback has its own that is harmless.
        """
        if self.error is None:
            try:
                return action()
            except BaseException as error:
                self.error = error
        self.model.interruptSolve()
        return {"result": otherwise}


class _Bound(Relax):
    """Bounds a node by the kernel's QP."""

    def __init__(self, tree: Tree):
        self.tree = tree

    def relaxexec(self) -> dict[str, Any]:
        """Bound the focus node."""
        return self.tree.guarded(self._bound)

    def _bound(self) -> dict[str, Any]:
        tree = self.tree
        tree.report()
        box = tree.kernel.boxes.propagate(*tree.box())
        if box is None:
            return {"result": SCIP_RESULT.CUTOFF}
        found = tree.kernel.bound(*box, tree.cutoff)
        if found.bound >= tree.cutoff:
            tree.kernel.pruned = min(tree.kernel.pruned, found.bound)
            return {"result": SCIP_RESULT.CUTOFF}
        return {"result": SCIP_RESULT.SUCCESS, "lowerbound": max(found.bound, tree.root_bound)}


class _Split(Branchrule):
    """Splits a node where the kernel says."""

    def __init__(self, tree: Tree):
        self.tree = tree
        self._completed: set[bytes] = set()

    def branchexecps(self, allowaddcons: bool) -> dict[str, Any]:
        """Make children of the focus node."""
        return self.tree.guarded(self._split)

    def branchexeclp(self, allowaddcons: bool) -> dict[str, Any]:
        """Make children of the focus node."""
        return self.tree.guarded(self._split)

    def _split(self) -> dict[str, Any]:
        tree, kernel = self.tree, self.tree.kernel
        box = kernel.boxes.propagate(*tree.box())
        if box is None:
            return {"result": SCIP_RESULT.CUTOFF}
        found = kernel.bound(*box)
        if found.status == "solved":
            before = tree.incumbent
            if self._placed(box):
                return {"result": SCIP_RESULT.CUTOFF}
            self._round(kernel.values(found))
            if tree.incumbent < before:
                tree.submit()
        if (box[0] == box[1]).all():
            tree.price(kernel.boxes.gait(box[0]))
            return {"result": SCIP_RESULT.CUTOFF}
        children = kernel.split(*box, found, tree.cutoff)
        if not children:
            return {"result": SCIP_RESULT.CUTOFF}
        for lower, upper in children:
            bound = max(kernel.bound(lower, upper).bound, found.bound)
            node = tree.model.createChild(0.0, bound)
            tree.model.updateNodeLowerbound(node, max(bound, tree.root_bound))
            for variable, was_low, was_up, low, up in zip(
                tree.variables, *tree.box(), lower, upper, strict=True
            ):
                if low > was_low:
                    tree.model.chgVarLbNode(node, variable, float(low))
                if up < was_up:
                    tree.model.chgVarUbNode(node, variable, float(up))
        return {"result": SCIP_RESULT.BRANCHED}


    def _placed(self, box: tuple[np.ndarray, np.ndarray]) -> bool:
        """Tell whether a box is of no interest in which only regions are open; price what it rounds to."""
        tree, kernel, layout = self.tree, self.tree.kernel, self.tree.kernel.boxes.layout
        modes = np.concatenate([layout.S.ravel(), layout.wheel.ravel()])
        if (box[0] == box[1]).all() or (box[0][modes] < box[1][modes]).any():
            return False
        found, gait = kernel.placed(*box)
        if found.bound >= tree.cutoff:
            kernel.pruned = min(kernel.pruned, found.bound)
            return True
        if gait is not None:
            tree.price(gait)
        return False

    def _round(self, z: np.ndarray) -> None:
        """Price the gait of a relaxation that is integral, at least in swings and wheels."""
        tree, boxes = self.tree, self.tree.kernel.boxes
        layout = boxes.layout

        def integral(index: np.ndarray) -> bool:
            return not index.size or np.abs(z[index] - np.rint(z[index])).max() <= INTEGRAL

        if not (integral(layout.S) and integral(layout.wheel)):
            return
        gait: Gait | None = boxes.gait(z)
        if not integral(layout.G):
            if gait.modes in self._completed:
                return
            self._completed.add(gait.modes)
            gait = tree.kernel.complete([gait.open()])[0]
        if gait is not None and boxes.admissible(gait):
            tree.price(gait)


class _Price(Conshdlr):
    """Accepts a solution only at the cost of its gait, and closes nodes that hold a single gait."""

    def __init__(self, tree: Tree):
        self.tree = tree

    def conscheck(
        self, constraints, solution, checkintegrality, checklprows, printreason, completely
    ) -> dict:
        """Check a solution's cost."""
        return self.tree.guarded(lambda: self._check(solution), SCIP_RESULT.INFEASIBLE)

    def _check(self, solution: Any) -> dict[str, Any]:
        tree = self.tree
        z = np.array([tree.model.getSolVal(solution, v) for v in tree.variables])
        gait = tree.kernel.boxes.gait(z)
        if np.abs(z - np.rint(z)).max() > INTEGRAL or not tree.kernel.boxes.admissible(gait):
            return {"result": SCIP_RESULT.INFEASIBLE}
        cost = tree.model.getSolVal(solution, tree.cost)
        right = cost >= tree.kernel.leaf(gait).value - 1e-9
        return {"result": SCIP_RESULT.FEASIBLE if right else SCIP_RESULT.INFEASIBLE}

    def consenfolp(self, constraints, n_useful, infeasible) -> dict[str, Any]:
        """Close the node if a single gait is left in it."""
        return self.tree.guarded(self._enforce, SCIP_RESULT.INFEASIBLE)

    def consenfops(self, constraints, n_useful, infeasible, objective_infeasible) -> dict[str, Any]:
        """Close the node if a single gait is left in it."""
        return self.tree.guarded(self._enforce, SCIP_RESULT.INFEASIBLE)

    def _enforce(self) -> dict[str, Any]:
        tree = self.tree
        lower, upper = tree.box()
        if (lower < upper).any():
            return {"result": SCIP_RESULT.INFEASIBLE}
        before = tree.incumbent
        gait = tree.kernel.boxes.gait(lower)
        if tree.kernel.boxes.admissible(gait):
            tree.price(gait)
        if tree.incumbent < before:
            tree.submit()
        return {"result": SCIP_RESULT.CUTOFF}

    def conslock(self, constraint, locktype, n_positive, n_negative) -> None:
        """Say that no variable may be rounded without asking."""
        for variable in (*self.tree.variables, self.tree.cost):
            self.tree.model.addVarLocks(variable, n_positive + n_negative, n_positive + n_negative)


class _Gaits(Heur):
    """Tries the gaits a roboticist would, and improves the best."""

    def __init__(self, tree: Tree):
        self.tree = tree

    def heurexec(self, timing, node_infeasible) -> dict[str, Any]:
        """Run once, before the root is bounded."""
        return self.tree.guarded(self._run)

    def _run(self) -> dict[str, Any]:
        tree, found = self.tree, False
        if tree.best is not None and np.isfinite(tree.kernel.leaf(tree.best[1]).value):
            found = tree.submit(self)

        def late() -> bool:
            tree.report()
            return tree.error is not None or tree.elapsed > tree.time_limit

        for value, gait in improve(tree.kernel, tree.first, late):
            if value < tree.incumbent:
                tree._keep(value, gait)
                found |= tree.submit(self)
        return {"result": SCIP_RESULT.FOUNDSOL if found else SCIP_RESULT.DIDNOTFIND}
