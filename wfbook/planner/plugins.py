"""SCIP's plug-ins around the kernel: a relaxator, a branching rule, a constraint handler and a heuristic.

SCIP sees integer variables only and a cost that no row explains: the relaxator bounds it, the branching
rule splits boxes, the constraint handler prices what is fixed, the heuristic hands the first plan over.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from pyscipopt import SCIP_RESULT, Branchrule, Conshdlr, Heur
from pyscipopt.scip import Relax

from wfbook.planner.branching import Branching
from wfbook.planner.gait import Gait
from wfbook.planner.kernel import INTEGRAL

if TYPE_CHECKING:
    from wfbook.planner.tree import Tree


class Bound(Relax):
    """Bounds a node by the kernel's QP."""

    def __init__(self, tree: "Tree"):
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


class Split(Branchrule):
    """Splits a node where the kernel says."""

    def __init__(self, tree: "Tree"):
        self.tree = tree
        self._branching = Branching(tree.kernel)
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
            self._round(found.y)
            if tree.incumbent < before:
                tree.submit()
        if (box[0] == box[1]).all():
            tree.price(kernel.boxes.gait(box[0]))
            return {"result": SCIP_RESULT.CUTOFF}
        children = self._branching.split(*box, found, tree.cutoff)
        if not children:
            return {"result": SCIP_RESULT.CUTOFF}
        before = tree.box()
        for lower, upper in children:
            bound = max(kernel.bound(lower, upper).bound, found.bound)
            node = tree.model.createChild(0.0, bound)
            tree.model.updateNodeLowerbound(node, max(bound, tree.root_bound))
            for variable, was_low, was_up, low, up in zip(tree.variables, *before, lower, upper, strict=True):
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


class Price(Conshdlr):
    """Accepts a solution only at the cost of its gait, and closes nodes that hold a single gait."""

    def __init__(self, tree: "Tree"):
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
        # The incumbent may lie outside of the boxes, which were narrowed to what is better than it.
        known = tree.best is not None and gait.key == tree.best[1].key
        if np.abs(z - np.rint(z)).max() > INTEGRAL or not (known or tree.kernel.boxes.admissible(gait)):
            return {"result": SCIP_RESULT.INFEASIBLE}
        cost = tree.model.getSolVal(solution, tree.cost)
        right = cost >= tree.kernel.leaf(gait, quick=True).value - 1e-9
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


class Gaits(Heur):
    """Hands SCIP the plan that was found before its tree began."""

    def __init__(self, tree: "Tree"):
        self.tree = tree

    def heurexec(self, timing, node_infeasible) -> dict[str, Any]:
        """Run once, before the root is bounded."""
        return self.tree.guarded(self._run)

    def _run(self) -> dict[str, Any]:
        found = self.tree.best is not None and self.tree.submit(self)
        return {"result": SCIP_RESULT.FOUNDSOL if found else SCIP_RESULT.DIDNOTFIND}
