"""The search's own mathematics: how good a box of gaits can be, and what a gait costs.

The kernel knows no tree and no solver of trees: SCIP drives it (:mod:`.tree`), and so can a test.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import cvxpy as cp
import numpy as np
from scipy import sparse

from wfbook.planner import relaxation, tight
from wfbook.planner.bounds import PROBES, MotionBounds, least, tightened
from wfbook.planner.boxes import Boxes
from wfbook.planner.conic import Boxed, Conic, Solution
from wfbook.planner.contacts import assignment
from wfbook.planner.crossings import CLOSE, Crossings
from wfbook.planner.gait import UNKNOWN, Gait
from wfbook.planner.ground import Places
from wfbook.planner.presolve import solve_fixed
from wfbook.planner.problem import Problem
from wfbook.planner.program import Program
from wfbook.planner.symmetry import MIRROR, mirror_row, mirror_symmetric
from wfbook.planner.worker import Worker, available

INTEGRAL = 1e-5
"""How close to an integer counts as one."""


@dataclass
class Kernel:
    """Bounds, leaves and branching for one problem.

    Attributes:
        problem: what is asked.
        program: the tight formulation, whose value at fixed binaries is the truth.
        boxes: of gaits.
        motion: bounds within which the relaxation holds.
        precision: relative gap to which a leaf's value is known.
        excluded: gaits that are not to be found (they could not be polished).
        qps: relaxations solved so far.
        leaves: exact programs solved so far.
        pruned: the lowest bound of any box that was put aside for exceeding a cutoff. What is proven at
            the end is no more than this.
    """

    problem: Problem
    precision: float = CLOSE
    program: Program = field(init=False)
    boxes: Boxes = field(init=False)
    motion: MotionBounds = field(init=False)
    excluded: set[bytes] = field(default_factory=set)
    qps: int = 0
    leaves: int = 0
    pruned: float = np.inf

    def __post_init__(self):
        problem = self.problem
        self._anywhere = MotionBounds.of(problem)
        self.boxes = Boxes(problem, Places.of(problem, self._anywhere).reachable)
        self.program = tight.build(problem)
        self.conic = Conic.compile(self.program.cost, self.program.rows())
        self._discrete = np.concatenate(
            [self.conic.columns(v).ravel() for v in self.program.discrete.values()]
        )
        self._crossings = Crossings(self.program, self.conic, self.precision)
        self._leaves: dict[bytes, Solution] = {}
        self._mirror = cp.Variable()
        self._symmetric = mirror_symmetric(problem)
        self._worker: Worker | None = None
        self._shares = False
        self._bound_within(self._anywhere)

    def _bound_within(self, bounds: MotionBounds) -> None:
        """Compile the relaxation for a motion within bounds, and forget what others said."""
        problem, order = self.problem, self.problem.ground.order
        self.motion = bounds
        if self._worker is not None:
            self.close()  # it knows the old programs
        relaxed = relaxation.build(problem, bounds)
        contacts = relaxed.contacts
        S, wheel, C = (cp.Variable(contacts.shape) for _ in range(3))
        T = cp.Variable(problem.slots)
        ladder = [cp.Variable(contacts.shape) for _ in order[1:]]
        rows = [*relaxed.constraints, S == contacts.S, self._mirror == mirror_row(S)]
        rows += [C[:, 0] == S[:, 0], C[:, 1:] == C[:, :-1] + S[:, 1:], cp.sum(C, axis=0) == T]
        for m, G in enumerate(ladder, start=1):
            behind = [contacts.occupancy(r) for r in order[m:] if r in contacts.regions]
            rows.append(sum(behind) - G == 0 if behind else G == 0)
        box = [S, C, T, *ladder]
        if problem.wheels:
            rows.append(wheel == contacts.wheel)
            box.insert(1, wheel)
        conic = self._qp_conic = Conic.compile(relaxed.cost, rows)
        self._columns = np.concatenate([conic.columns(v).ravel() for v in box])
        self._places = [conic.columns(v)[:, 1:] for v in relaxed.places]
        self._x = conic.columns(relaxed.x)
        discrete = contacts.discrete()
        self._qp_discrete = np.concatenate([conic.columns(v).ravel() for v in discrete.values()])
        self._qp_keys = list(discrete)
        self._qp = Boxed(self._symmetry_broken(), self._columns)
        self._bounds: dict[bytes, Solution] = {}
        self._fork()

    def tighten(self, cutoff: float, stop: Callable[[], bool] = lambda: False) -> None:
        """Narrow the motion to that of plans cheaper than a cutoff; from then on bounds hold for those only.

        Args:
            cutoff: of the cost. On a single region it narrows too little to be worth a new program.
            stop: asked now and then; once true, what is not narrowed yet stays as it is.
        """
        root = self.boxes.root()
        if root is None or self.problem.ground.count == 1:
            return
        base = self.bound(*root).bound
        n, rho = self._qp_conic.A.shape[1], self.problem.knots_per_slot
        ends = self._x[rho::rho]
        begins = self._x[:-1:rho]

        def rows(plus: np.ndarray, minus: np.ndarray) -> np.ndarray:
            result, j = np.zeros((len(ends), n)), np.arange(len(ends))[:, None]
            np.add.at(result, (j, plus), 1.0 / plus.shape[1])
            np.add.at(result, (j, minus), -1.0)
            return result

        none = np.zeros((len(ends), 0), int)
        quantities = {"place": rows(ends[:, None], none)}
        if self.problem.wheels:
            quantities["travel"] = rows(ends[:, None], begins[:, None])
            quantities["drift"] = rows(self._x[1:].reshape(-1, rho), begins[:, None])

        def least_of(rows: list[np.ndarray]) -> list[float]:
            self.qps += PROBES * len(rows)
            return self._shared(self._least, [(row, base, cutoff) for row in rows])

        self._bound_within(tightened(self._anywhere, quantities, least_of, stop))
        self.boxes = Boxes(self.problem, Places.of(self.problem, self.motion).reachable)
        self.pruned = min(self.pruned, cutoff)

    def _least(self, row: np.ndarray, base: float, cutoff: float) -> float:
        lower, upper = (side.astype(float) for side in self.boxes.root())
        return least(row, lambda linear: self._qp.minimise(lower, upper, linear), base, cutoff)

    def relax(self) -> None:
        """Take back what :meth:`tighten` did."""
        if self.motion is not self._anywhere:
            self._bound_within(self._anywhere)
            self.boxes = Boxes(self.problem, Places.of(self.problem, self._anywhere).reachable)

    def _symmetry_broken(self) -> Conic:
        """Return the QP with one of each pair of mirror images cut off, where the problem has them."""
        conic = self._qp_conic
        if not self._symmetric:
            return conic
        n = conic.A.shape[1]
        row = sparse.csc_matrix(([-1.0], ([0], [int(conic.columns(self._mirror))])), shape=(1, n))
        return conic.with_rows(sparse.csc_matrix((0, n)), np.zeros(0), row, np.zeros(1))

    def open(self) -> None:
        """Start the worker process, if there is a second core for it; results are the same without."""
        self._shares = available()
        self._fork()

    def _fork(self) -> None:
        if self._worker is None and self._shares:
            self._worker = Worker(self._work)

    def close(self) -> None:
        """End the worker process; the kernel goes on without it."""
        if self._worker is not None:
            self._worker.close()
            self._worker = None

    def _work(self, method: str, tasks: list[tuple]) -> list[Any]:
        """Do a share of the work, in the worker process or here."""
        return [getattr(self, method)(*task) for task in tasks]

    def _shared(self, method: Callable[..., Any], tasks: list[tuple]) -> list[Any]:
        """Call a method for each task, every other one in the worker process if there is one."""
        if self._worker is None or len(tasks) < 2:
            return self._work(method.__name__, tasks)
        self._worker.ask(method.__name__, tasks[1::2])
        results: list[Any] = [None] * len(tasks)
        try:
            results[::2] = self._work(method.__name__, tasks[::2])
        finally:  # whatever happens here, the next answer must be the next question's
            results[1::2] = self._worker.answer()
        return results

    def _solve(self, lower: np.ndarray, upper: np.ndarray, cutoff: float) -> Solution:
        return self._qp.solve(lower.astype(float), upper.astype(float), cutoff)

    def bound_both(self, children: list, cutoff: float) -> None:
        """Bound two boxes at once, where neither is known yet."""
        if any(c is None or self._known(*c, cutoff) for c in children):
            return
        self.qps += 2
        found = self._shared(self._solve, [(*child, cutoff) for child in children])
        for child, solution in zip(children, found, strict=True):
            self._bounds[_key(*child)] = solution

    def _known(self, lower: np.ndarray, upper: np.ndarray, cutoff: float) -> Solution | None:
        """Return what is remembered of a box, if it says enough."""
        found = self._bounds.get(_key(lower, upper))
        return None if found is None or (found.status == "cut" and found.bound < cutoff) else found

    def bound(self, lower: np.ndarray, upper: np.ndarray, cutoff: float = np.inf) -> Solution:
        """Solve the QP relaxation over a box; remembered, for children are bounded before they are made.

        Args:
            lower: the box's lower vector.
            upper: its upper vector.
            cutoff: stop as soon as the bound is known to be higher.
        """
        found = self._known(lower, upper, cutoff)
        if found is None:
            self.qps += 1
            found = self._bounds[_key(lower, upper)] = self._solve(lower, upper, cutoff)
        return found

    def leaf(self, gait: Gait, cutoff: float = np.inf, quick: bool = False) -> Solution:
        """Solve the exact program at fixed binaries; infeasible if the gait is excluded.

        What is left open keeps the proven bound below its own, unless ``quick``: then the gait will be asked
        for again before its box is closed.

        Args:
            gait: with its regions.
            cutoff: if the gait can't cost less, its cost may stay unknown (status "cut").
            quick: be content with a plan of the gait, if not the best (status "rough").
        """
        key = gait.key
        if key in self.excluded:
            return Solution("infeasible", np.inf, np.inf, np.zeros(0))
        known = self._leaves.get(key)
        if known is None or self._open(known, cutoff, quick):
            self._enter(gait, self._exact(gait, cutoff, quick))
        found = self._leaves[key]
        if found.status in ("solved", "cut") or (found.status == "rough" and not quick):
            self.pruned = min(self.pruned, found.bound)
        elif found.status == "failed" and not quick:
            self.pruned = min(self.pruned, self._gait_qp(gait).bound)
        return found

    @staticmethod
    def _open(known: Solution, cutoff: float, quick: bool) -> bool:
        """Tell whether what is known of a leaf leaves a question open."""
        return known.bound < cutoff and (known.status == "cut" or (known.status == "rough" and not quick))

    def price(self, gaits: list[Gait], cutoff: float = np.inf, quick: bool = False) -> list[float]:
        """Return costs of gaits (see :meth:`leaf`); infinite where infeasible, excluded or above a cutoff."""
        fresh = [g for g in gaits if g.key not in self._leaves and g.key not in self.excluded]
        found = self._shared(self._exact, [(g, cutoff, quick) for g in fresh])
        for gait, solution in zip(fresh, found, strict=True):
            self._enter(gait, solution)
        leaves = [self.leaf(gait, cutoff, quick) for gait in gaits]
        return [leaf.value if leaf.status in ("solved", "rough") else np.inf for leaf in leaves]

    def _enter(self, gait: Gait, found: Solution) -> None:
        """Remember a leaf."""
        self.leaves += 1
        self._leaves[gait.key] = found

    def _exact(self, gait: Gait, cutoff: float, quick: bool) -> Solution:
        assigned = assignment(self.problem, gait, self.program.discrete)
        fixed = np.concatenate([assigned[k].ravel() for k in self.program.discrete])
        return self._crossings.solve(self._discrete, fixed, cutoff, quick)

    def placed(self, lower: np.ndarray, upper: np.ndarray) -> tuple[Solution, Gait | None]:
        """Bound a box in which only regions are open by the exact program with the regions relaxed.

        Returns:
            The solution, and the gait that it rounds to, if that is admissible.
        """
        G = self.boxes.layout.G
        gait = self.boxes.gait(lower)
        known = (lower[G] == upper[G]).all(axis=0)
        assigned = assignment(
            self.problem, gait._replace(region=np.where(known, gait.region, UNKNOWN)), self.program.discrete
        )
        fixed = np.concatenate([assigned[k].ravel() for k in self.program.discrete])
        chosen = ~np.isnan(fixed)
        self.leaves += 1
        found = solve_fixed(self.conic, self._discrete[chosen], fixed[chosen])
        if found.status != "solved":
            return found, None
        rho = self.problem.knots_per_slot
        p = [self.conic.value(c, found.y)[rho::rho].T for c in self.program.p[:2]]
        region = self.boxes.nearest(lower, upper, np.stack(p, axis=-1))
        # Between swings a foot stays where it landed.
        for j in range(1, gait.S.shape[1]):
            stays = (gait.S[:, j] == 0) & (gait.wheel[:, j] == 0)
            region[stays, j] = region[stays, j - 1]
        rounded = gait._replace(region=np.where(known, gait.region, region))
        return found, rounded if self.boxes.admissible(rounded) else None

    def priced(self) -> list[Gait]:
        """Return the feasible gaits that were solved exactly, the cheapest first."""
        feasible = [(v.value, key) for key, v in self._leaves.items() if np.isfinite(v.value)]
        return [Gait.from_key(key, self.problem.legs) for _, key in sorted(feasible)]

    def gait_bounds(self, gaits: list[Gait], cutoff: float = np.inf) -> list[float]:
        """Return the relaxation's lower bounds of the costs of gaits, whose regions may be open.

        Args:
            gaits: none of them impossible (see :meth:`.boxes.Boxes.of_modes`).
            cutoff: a bound may be no better than this.
        """
        self.qps += len(gaits)
        boxes = [self.boxes.of_modes(self._kept(gait)) for gait in gaits]
        return [found.bound for found in self._shared(self._solve, [(*box, cutoff) for box in boxes])]

    def _kept(self, gait: Gait) -> Gait:
        """Return the gait or its mirror image, whichever the relaxation keeps."""
        if self._symmetric and mirror_row(gait.S) < 0:
            return Gait(*(part[list(MIRROR)] for part in gait.open()))
        return gait

    def _gait_qp(self, gait: Gait) -> Solution:
        assigned = assignment(self.problem, gait, self._qp_keys)
        fixed = np.concatenate([assigned[k].ravel() for k in self._qp_keys])
        known = ~np.isnan(fixed)
        return solve_fixed(self._qp_conic, self._qp_discrete[known], fixed[known])

    def complete(self, gaits: list[Gait]) -> list[Gait | None]:
        """Choose regions for gaits that leave them open, slot by slot where the QP would like them to be.

        Returns:
            For each gait one with regions, or None where the choice led nowhere.
        """
        if self.problem.ground.count == 1:
            return [gait._replace(region=np.zeros_like(gait.S)) for gait in gaits]
        self.qps += len(gaits)
        return self._shared(self._dive, [(gait,) for gait in gaits])

    def _dive(self, gait: Gait) -> Gait | None:
        box = self.boxes.of_modes(gait)
        G = self.boxes.layout.G
        while box is not None:
            lower, upper = box
            known = (lower[G] == upper[G]).all(axis=0)
            places = self.boxes.gait(lower).region
            partial = gait._replace(region=np.where(known, places, UNKNOWN))
            if known.all():
                return partial
            found = self._gait_qp(partial)
            if found.status != "solved":
                return None
            # The first slot that is open is decided by where its contacts are; the next QP adapts the rest.
            slot = np.flatnonzero(~known.all(axis=0))[0]
            wanted = self.boxes.nearest(lower, upper, np.stack([found.y[at] for at in self._places], axis=-1))
            take = ~known & (np.arange(known.shape[1]) == slot)
            lower, upper = lower.copy(), upper.copy()
            steps = self.boxes.ladder(wanted)
            lower[G], upper[G] = np.where(take, steps, lower[G]), np.where(take, steps, upper[G])
            box = self.boxes.propagate(lower, upper)
        return None


def _key(lower: np.ndarray, upper: np.ndarray) -> bytes:
    """Return a key for a box."""
    return np.concatenate([lower, upper]).astype(np.int16).tobytes()
