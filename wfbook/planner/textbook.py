"""Branch and bound as a textbook has it: small enough to be read, and to be drawn node by node.

Every node relaxes the binaries that its branch leaves open to ``[0, 1]`` and solves one convex program. No
heuristics, no logic, no symmetry: what the search of :mod:`.tree` saves, it saves against this. It takes either
formulation, so that their trees can be compared.
"""

import heapq
from dataclasses import dataclass
from typing import Any

import cvxpy as cp
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
    """A node of the tree, in the order in which they are visited.

    Attributes:
        number: its place in that order, from 0.
        parent: number of the node that it was split from; None for the root.
        decision: what its branch adds to its parent's, for a person; empty for the root.
        bound: the optimum of its relaxation; infinite if there is none.
        fate: "split"; "plan" if its binaries came out integral; "pruned" if its bound says that nothing in it is
            worth the search; "infeasible"; or "unclear" if the solver had no answer, then it is split too.
        incumbent: cost of the best plan after this node; infinite before the first.
        proven: no plan costs less: the least bound that is open after this node, or the incumbent's.
        S: ``(L, J)`` the relaxed swing matrix; of NaN if there is none.
    """

    number: int
    parent: int | None
    decision: str
    bound: float
    fate: str
    incumbent: float
    proven: float
    S: np.ndarray


def grow(problem: Problem, formulation: str = "tight", gap: float = 1e-3, most: int = 200) -> list[Node]:
    """Search best-first, splitting on the most fractional binary.

    Args:
        problem: on a single region, and small: five slots are too many.
        formulation: "tight" or "paper".
        gap: relative gap at which a node is not worth being split.
        most: nodes, after which the search gives up.

    Returns:
        The nodes as they were visited. The search is complete if the last one's ``proven`` is within the gap of
        its ``incumbent``.

    Raises:
        ValueError: the formulation is none of these, or the terrain has several regions.
        InfeasibleError: a leg starts over nothing, or out of reach.
    """
    if formulation not in _BUILDERS:
        raise ValueError(f"formulation: {formulation!r}, expected one of {tuple(_BUILDERS)}")
    if problem.ground.count > 1:
        raise ValueError(f"terrain: {problem.terrain.name!r} has {problem.ground.count} regions, expected 1")
    check_start(problem)
    program = _BUILDERS[formulation](problem)
    binaries = _binaries(program, formulation)
    for variable in program.discrete.values():
        variable.attributes["boolean"] = False
    box = [side for v in binaries.values() for side in (v >= 0, v <= 1)]
    conic = Conic.compile(program.cost, program.rows() + box)
    columns = np.concatenate([conic.columns(v).ravel() for v in binaries.values()])
    kinds = [(kind, *place) for kind, v in binaries.items() for place in np.ndindex(v.shape)]
    swings = conic.columns(binaries["swing"])

    nodes: list[Node] = []
    incumbent, count = np.inf, 0
    queue: list[tuple] = [(-np.inf, 0, None, "", np.full(len(columns), np.nan))]
    while queue and len(nodes) < most:
        inherited, _, parent, decision, fixed = heapq.heappop(queue)
        known = ~np.isnan(fixed)
        found = solve_fixed(conic, columns[known], fixed[known])
        solved = found.status == "solved"
        bound = max(found.bound, inherited) if solved or found.status == "infeasible" else inherited
        z = np.where(known, fixed, found.y[columns]) if solved else np.where(known, fixed, 0.5)
        doubt = np.abs(z - np.rint(z))
        fate = "split" if solved else "unclear"
        if found.status == "infeasible":
            bound, fate = np.inf, "infeasible"
        elif bound >= incumbent * (1 - gap):
            fate = "pruned"
        elif solved and doubt.max() <= _INTEGRAL:
            fate, incumbent = "plan", found.value
        if fate in ("split", "unclear"):
            # Which legs swing goes first, then what they land on; of equals the earliest slot.
            order = [list(binaries).index(kind) for kind, *_ in kinds]
            at = min(
                np.flatnonzero(doubt > _INTEGRAL), key=lambda i: (order[i], -round(doubt[i], 3), kinds[i][2])
            )
            for value in (1.0, 0.0):
                count += 1
                child = fixed.copy()
                child[at] = value
                heapq.heappush(queue, (bound, count, len(nodes), _told(kinds[at], value), child))
        proven = min([incumbent, *(entry[0] for entry in queue)])
        S = found.y[swings] if solved else np.full(swings.shape, np.nan)
        nodes.append(Node(len(nodes), parent, decision, bound, fate, incumbent, proven, S))
    return nodes


def _binaries(program: Any, formulation: str) -> dict[str, cp.Variable]:
    """Return the binaries that decide everything, by kind, in the order in which to split on them."""
    found = {"swing": program.S}
    if program.problem.wheels:
        found["wheel"] = program.wheel if formulation == "tight" else program.discrete["D", 0, "wheel"]
    if formulation == "paper":
        found["count"] = program.discrete["s"]
    return found


def _told(kind: tuple[str, int, int], value: float) -> str:
    """Say a decision in words."""
    what, i, slot = kind
    if what == "count":
        return f"{'' if value else 'not '}{i} swing in slot {slot}"
    words = {"swing": ("stands", "swings"), "wheel": ("on foot", "on wheel")}[what]
    return f"{LEGS[i]} {words[int(value)]} in slot {slot}"
