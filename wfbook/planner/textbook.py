"""Branch and bound as a textbook has it: small enough to be read, and to be drawn node by node.

Every node relaxes the binaries that its branch leaves open to ``[0, 1]`` and solves one convex program. No
heuristics, no logic, no symmetry: what the search of :mod:`.tree` saves, it saves against this. It takes
either formulation, so that their trees can be compared.
"""

import heapq
from dataclasses import dataclass, replace

import numpy as np

from wfbook.modes import LEGS
from wfbook.planner import bigm, tight
from wfbook.planner.conic import Conic
from wfbook.planner.explain import check_start
from wfbook.planner.presolve import solve_fixed
from wfbook.planner.problem import Problem

_INTEGRAL = 1e-4
_BUILDERS = {"tight": tight.build, "paper": bigm.build}


@dataclass(frozen=True)
class Node:
    """A node of the tree.

    Attributes:
        number: its place in the order in which nodes are bounded, from 0.
        parent: number of the node that it was split from; None for the root.
        decision: what its branch adds to its parent's, for a person; empty for the root.
        bound: the optimum of its relaxation, at least its parent's; infinite if there is none.
        fate: "split"; "plan" if its binaries came out integral; "pruned" if its bound says that nothing in
            it is worth the search; "infeasible"; "unclear" if the solver had no answer and nothing is open;
            "open" if the search gave up before.
        decided: how many nodes were bounded when its fate was known.
        incumbent: cost of the best plan after this node; infinite before the first.
        proven: no plan costs less: the least bound that is open after this node, or the incumbent's.
        S: ``(L, J)`` the relaxed swing matrix; where there is none, what is fixed and NaN.
    """

    number: int
    parent: int | None
    decision: str
    bound: float
    fate: str
    decided: int
    incumbent: float
    proven: float
    S: np.ndarray


def grow(problem: Problem, formulation: str = "tight", gap: float = 1e-3, most: int = 200) -> list[Node]:
    """Search best-first, splitting on the most fractional binary.

    Args:
        problem: on a single region, and small: five slots are too many.
        formulation: "tight" or "paper".
        gap: relative gap at which a node is not worth being split.
        most: nodes, about, after which the search gives up.

    Returns:
        The nodes in the order in which they were bounded.

    Raises:
        ValueError: the formulation is none of these, or the terrain has several regions.
        InfeasibleError: a leg starts over nothing, or out of reach.
    """
    relaxation = _Relaxation(problem, formulation)
    nodes: list[Node] = []
    open_: list[tuple[float, int, np.ndarray, int]] = []
    incumbent = unclear = np.inf

    def bounded(parent: int | None, decision: str, fixed: np.ndarray) -> None:
        """Solve a node's relaxation; keep it open if it may hold something better than the incumbent."""
        nonlocal incumbent, unclear
        number = len(nodes)
        least = -np.inf if parent is None else nodes[parent].bound
        status, bound, z = relaxation.solve(fixed)
        bound, split, fate = max(bound, least), relaxation.split(z), "open"
        if status == "infeasible":
            fate = "infeasible"
        elif bound >= incumbent * (1 - gap):
            fate = "pruned"
        elif status == "solved" and split is None:
            fate, incumbent = "plan", bound
        elif split is None:
            fate, unclear = "unclear", min(unclear, bound)
        else:
            heapq.heappush(open_, (bound, number, fixed, split))
        # Until its second child is bounded, a parent's bound is what is proven of it.
        waits = [least] if parent is not None and number % 2 else []
        proven = min([incumbent, unclear, *waits, *(entry[0] for entry in open_)])
        S = z[: problem.legs * problem.slots].reshape(problem.legs, problem.slots)
        nodes.append(Node(number, parent, decision, bound, fate, number + 1, incumbent, proven, S))

    bounded(None, "", np.full(len(relaxation.places), np.nan))
    while open_ and open_[0][0] < incumbent * (1 - gap) and len(nodes) < most:
        _, number, fixed, split = heapq.heappop(open_)
        nodes[number] = replace(nodes[number], fate="split", decided=len(nodes))
        for value in (1.0, 0.0):
            child = fixed.copy()
            child[split] = value
            bounded(number, _told(relaxation.places[split], value), child)
    for _, number, *_ in open_:
        closed = [n.number for n in nodes if nodes[number].bound >= n.incumbent * (1 - gap)]
        if closed:
            nodes[number] = replace(nodes[number], fate="pruned", decided=max(closed[0], number) + 1)
    return nodes


class _Relaxation:
    """The convex program of a node: some binaries fixed, the others anywhere between 0 and 1.

    Attributes:
        places: of each binary its kind, its leg (or how many legs) and its slot; those of S come first.
    """

    def __init__(self, problem: Problem, formulation: str):
        if formulation not in _BUILDERS:
            raise ValueError(f"formulation: {formulation!r}, expected one of {tuple(_BUILDERS)}")
        count = problem.ground.count
        if count > 1:
            raise ValueError(f"terrain: {problem.terrain.name!r} has {count} regions, expected 1")
        check_start(problem)
        program = _BUILDERS[formulation](problem)
        for variable in program.discrete.values():
            variable.attributes["boolean"] = False
        # What decides everything, in the order in which it is split on.
        binaries = {"swing": program.S}
        if problem.wheels:
            binaries["wheel"] = program.discrete.get(("D", 0, "wheel"), program.wheel)
        if formulation == "paper":
            binaries["count"] = program.discrete["s"]
        rows = program.rows() + [side for v in binaries.values() for side in (v >= 0, v <= 1)]
        self._conic = Conic.compile(program.cost, rows)
        self._columns = np.concatenate([self._conic.columns(v).ravel() for v in binaries.values()])
        self.places = [(kind, *place) for kind, v in binaries.items() for place in np.ndindex(v.shape)]
        self._rank = np.array([list(binaries).index(kind) for kind, *_ in self.places])

    def solve(self, fixed: np.ndarray) -> tuple[str, float, np.ndarray]:
        """Return status, bound and the binaries' values; NaN in ``fixed`` is open."""
        known = ~np.isnan(fixed)
        found = solve_fixed(self._conic, self._columns[known], fixed[known])
        if found.status == "infeasible":
            return found.status, np.inf, fixed
        if found.status != "solved":
            return found.status, -np.inf, fixed
        return found.status, found.bound, np.where(known, fixed, found.y[self._columns])

    def split(self, z: np.ndarray) -> int | None:
        """Return which binary to split on; None if all are integral.

        Which legs swing goes first, then what they land on; of equals the most fractional, and the earliest.
        """
        doubt = np.abs(np.nan_to_num(z, nan=0.5) - np.rint(np.nan_to_num(z, nan=0.5)))
        open_ = np.flatnonzero(doubt > _INTEGRAL)
        if not len(open_):
            return None
        return int(min(open_, key=lambda i: (self._rank[i], -round(doubt[i], 3), self.places[i][2])))


def _told(kind: tuple[str, int, int], value: float) -> str:
    """Say a decision in words."""
    what, i, slot = kind
    if what == "count":
        return f"{'' if value else 'not '}{i} legs swing in slot {slot}"
    words = {"swing": ("stands", "swings"), "wheel": ("on foot", "on wheel")}[what]
    return f"{LEGS[i]} {words[int(value)]} in slot {slot}"
