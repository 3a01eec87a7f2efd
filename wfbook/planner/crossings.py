"""Between which knots does a wheel cross an edge? The last integers of a gait.

A gait says where every contact is when slots end. Where a wheel rolls from one region to the next, the
knots in between are open, but hardly free: the trajectory of the relaxation says where the wheel is. That
choice is tried first, and what it costs more than the relaxation is searched for only if it matters.
"""

import heapq
from dataclasses import replace
from typing import Any

import numpy as np

from wfbook.planner.conic import Conic, Solution
from wfbook.planner.presolve import solve_fixed
from wfbook.planner.problem import Problem
from wfbook.planner.program import Program

CLOSE = 2e-4
"""Relative gap at which the search for crossings ends, if none is asked for; it stays in the bound."""

_NODES = 30
_QUICK = 4


class Crossings:
    """Solves the tight program where all discrete variables are known but those of crossings."""

    def __init__(self, program: Program, conic: Conic, close: float = CLOSE):
        """Note where the variables stand.

        Args:
            program: the tight one.
            conic: the same, compiled.
            close: relative gap at which the search ends.
        """
        self._program, self._conic, self._close = program, conic, close

    def solve(self, columns: np.ndarray, values: np.ndarray, cutoff: float, quick: bool) -> Solution:
        """Minimise over all crossings.

        Args:
            columns: of the discrete variables.
            values: theirs; NaN where a crossing leaves them open.
            cutoff: if no crossing costs less, which one is best is not asked: the status is "cut".
            quick: try no more than the most likely crossings: if that leaves doubt, the status is "rough".

        Returns:
            The best solution. Its bound holds for every crossing.
        """
        open_ = np.isnan(values)
        found = solve_fixed(self._conic, columns[~open_], values[~open_])
        if not open_.any() or found.status != "solved":
            return found
        if found.bound >= cutoff:
            return replace(found, status="cut", value=np.nan)
        best: Solution | None = None
        # Bounds of what stays open: nodes that wait, and such as a solver has no answer for.
        queue, unclear = [(found.bound, 0, values, found)], np.inf
        for count in range(1, _QUICK if quick else _NODES):
            if not queue or queue[0][0] >= self._enough(cutoff, best):
                break
            bound, _, known, relaxed = heapq.heappop(queue)
            rounded = self._where_it_is(known, relaxed.y)
            tried = solve_fixed(self._conic, columns, rounded)
            if tried.status == "solved" and (best is None or tried.value < best.value):
                best = tried
            if best and (quick or bound >= best.value * (1 - self._close)):
                unclear = min(unclear, bound)
                break
            left = np.flatnonzero(np.isnan(known))
            if not len(left):
                if tried.status == "failed":
                    unclear = min(unclear, bound)
                continue
            doubt = np.abs(relaxed.y[columns[left]] - rounded[left])
            at = left[np.argmax(doubt)]
            for side, value in enumerate((1 - rounded[at], rounded[at])):
                child = known.copy()
                child[at] = value
                fixed = ~np.isnan(child)
                answer = solve_fixed(self._conic, columns[fixed], child[fixed])
                if answer.status != "infeasible":
                    heapq.heappush(queue, (max(answer.bound, bound), 2 * count + side, child, answer))
        bound = min([unclear, *(entry[0] for entry in queue)])
        if best is None and bound == np.inf:
            return Solution("infeasible", np.inf, np.inf, found.y)
        if best is None:
            return Solution("rough" if quick else "cut", np.inf, bound, found.y)
        status = "rough" if bound < self._enough(cutoff, best) else "solved"
        return Solution(status, best.value, min(best.bound, bound), best.y)

    def _enough(self, cutoff: float, best: Solution | None) -> float:
        """Return the bound from which on a node is of no interest."""
        return min(cutoff, best.value * (1 - self._close)) if best else cutoff

    def _where_it_is(self, known: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the values with every open wheel in the region over which it is in a solution."""
        values, start = {}, 0
        for key, variable in self._program.discrete.items():
            values[key] = known[start : start + variable.size].reshape(variable.shape)
            start += variable.size
        p = np.stack([self._conic.value(c, y) for c in self._program.p[:2]], axis=-1)
        settled = settle(self._program.problem, values, p)
        return np.concatenate([settled[key].ravel() for key in self._program.discrete])


def settle(problem: Problem, values: dict[Any, np.ndarray], p: np.ndarray) -> dict[Any, np.ndarray]:
    """Put every wheel that crosses an edge into the region over which it is.

    Args:
        problem: what was asked.
        values: of the discrete variables, as :func:`~.contacts.assignment` returns them.
        p: ``(K+1, L, 2+)`` contact points.

    Returns:
        The values without NaN.
    """
    settled = {key: value.copy() for key, value in values.items()}
    regions, rho = problem.terrain.regions, problem.knots_per_slot
    for i in range(rho - 1):
        here = {key[1]: value for key, value in settled.items() if key[0] == f"passing {i}"}
        for leg, j in np.argwhere(sum(np.isnan(value) for value in here.values()) > 0) if here else ():
            states = {r: value[leg, j] for r, value in here.items()}
            free = [r for r, state in states.items() if np.isnan(state)]
            point = p[i + 1 + rho * j, leg, :2]
            distances = [regions[r].outside(*point) for r in free]
            nearest = free[int(np.argmin(distances))]
            taken = any(state == 1 for state in states.values())
            for r in free:
                here[r][leg, j] = float(r == nearest and not taken)
    return settled
