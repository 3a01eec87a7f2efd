"""The smallest program with a binary: one leg, one slot, one direction. Big-M and hull, side by side.

A leg would like to be ``goal`` ahead, and a swing has its price: minimise
``weight (step − goal)² + price · S`` where ``S = 0 ⟹ step = 0`` and ``S = 1 ⟹ |step| ≤ limit``. The rows are
those of the two formulations, :func:`.bigm.implies` and :func:`.program.within`; what their relaxations
allow is a polygon in the plane of S and step.
"""

from dataclasses import dataclass
from itertools import combinations

import cvxpy as cp
import numpy as np

from wfbook.planner.bigm import implies, implies_below
from wfbook.planner.conic import Conic
from wfbook.planner.program import within

_SAME = 1e-9


@dataclass(frozen=True)
class OneStep:
    """One decision: to swing or not.

    Attributes:
        goal: where the leg should be.
        price: of a swing.
        limit: longest step.
        weight: of the squared distance from the goal.
    """

    goal: float = 0.25
    price: float = 0.2
    limit: float = 0.3
    weight: float = 10.0

    def cost(self, S: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the cost of points ``(S, step)``, whole or not."""
        return self.weight * (step - self.goal) ** 2 + self.price * S

    @property
    def optimum(self) -> float:
        """The cost of the better of the two decisions."""
        step = np.clip(self.goal, -self.limit, self.limit)
        return float(min(self.cost(0.0, 0.0), self.cost(1.0, step)))

    def big_m(self, big: float) -> tuple[list[cp.Variable], list[cp.Constraint]]:
        """Return S and step, and what the paper's format says of them, with M = ``big``."""
        S, step = variables = cp.Variable(name="S"), cp.Variable(name="step")
        stays = implies(1 - S, step, big)
        reaches = [row for side in (step, -step) for row in implies_below(S, side - self.limit, big)]
        return list(variables), [S >= 0, S <= 1, *stays, *reaches]

    def tight(self) -> tuple[list[cp.Variable], list[cp.Constraint]]:
        """Return S and step, and the row that is their convex hull."""
        S, step = variables = cp.Variable(name="S"), cp.Variable(name="step")
        return list(variables), [S >= 0, S <= 1, *within(step, self.limit * S)]

    def bound(self, variables: list[cp.Variable], rows: list[cp.Constraint]) -> tuple[float, np.ndarray]:
        """Minimise over a relaxation.

        Returns:
            The least cost, which bounds that of both decisions if neither is cut off, and where it is.
        """
        S, step = variables
        problem = cp.Problem(cp.Minimize(self.weight * cp.square(step - self.goal) + self.price * S), rows)
        problem.solve(solver=cp.CLARABEL)
        return float(problem.value), np.array([S.value, step.value], float)

    def perspective_bound(self) -> float:
        """Minimise over the hull of decisions *and* their costs: ``step²`` becomes ``step² / S``."""
        (S, step), rows = self.tight()
        spread = cp.quad_over_lin(step, S) - 2 * self.goal * step + self.goal**2
        problem = cp.Problem(cp.Minimize(self.weight * spread + self.price * S), rows)
        problem.solve(solver=cp.CLARABEL)
        return float(problem.value)


def corners(variables: list[cp.Variable], rows: list[cp.Constraint]) -> np.ndarray:
    """Return the corners of what linear rows allow two variables.

    Returns:
        ``(n, 2)``, counter-clockwise.
    """
    conic = Conic.compile(cp.Constant(0) * variables[0], rows)
    A = conic.linear.toarray()[:, [conic.layout[v.id] for v in variables]]
    found = []
    for pair in combinations(range(len(A)), 2):
        at = list(pair)
        if abs(np.linalg.det(A[at])) > _SAME:
            point = np.linalg.solve(A[at], conic.b[at])
            if (A @ point <= conic.b[: len(A)] + _SAME).all():
                found.append(point)
    points = np.unique(np.round(found, 9), axis=0)
    around = points - points.mean(axis=0)
    return points[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]


def least_m_interval(low: np.ndarray, high: np.ndarray, D: np.ndarray) -> tuple[float, float]:
    """Return where big-M lets a foot be that is on several stones by halves (Paper A, eq. 22).

    Each stone has the least M that cuts nothing off: as far as the farthest other stone.

    Args:
        low: ``(R,)`` where the stones begin.
        high: ``(R,)`` where they end.
        D: ``(R,)`` at least 0, of sum 1.
    """
    off = 1.0 - D
    return float((low - (low - low.min()) * off).max()), float((high + (high.max() - high) * off).min())


def shares_interval(low: np.ndarray, high: np.ndarray, D: np.ndarray) -> tuple[float, float]:
    """Return where the convex hull of the stones lets it be: a share on each, in proportion to D.

    Arguments as for :func:`least_m_interval`.
    """
    return float(low @ D), float(high @ D)
