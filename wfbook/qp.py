"""A quadratic program of one fixed sparsity pattern, solved again and again."""

import math
from typing import Literal

import daqp
import numpy as np
import osqp
from scipy import linalg, sparse

Solver = Literal["osqp", "daqp"]

_SETTINGS = {
    "eps_abs": 1e-6,
    "eps_rel": 1e-8,  # relative to forces of 100 N, 1e-6 leaves torques wrong by 0.2 N m
    "scaling": 0,
    "check_termination": 10,
    # A change of the step size costs a factorisation and the warm start's good begin: at every 50 iterations
    # (the default) programs take twice as many, and one in 200 does not converge.
    "adaptive_rho_interval": 100,
    "max_iter": 1000,
    "verbose": False,
}


class QuadraticProgram:
    """``min ½ uᵀP u + qᵀu`` subject to ``lower ≤ A u ≤ upper``.

    OSQP analyses the pattern once; afterwards only numbers change, and the last solution starts the
    next search. Where it does not converge, DAQP's active-set method, which needs no tuning, has a try.

    Args:
        P_pattern: ``(n, n)`` bool, where P may be non-zero.
        A_pattern: ``(m, n)`` bool, where A may be non-zero.
        solver: ``"osqp"``, or ``"daqp"`` for every program.
        units: ``(n,)`` of each unknown, in which OSQP counts it. OSQP has one step size for all unknowns and
            rows, so it needs the fewer steps the more alike they are. (Its own scaling evens out columns and
            rows of the matrices, not the answer's numbers, and costs a new scaling at every update.)
        row_units: ``(m,)`` of each row of A.

    Attributes:
        rescues: how many programs OSQP left to DAQP.
        iterations: OSQP's, over all programs.
    """

    def __init__(
        self,
        P_pattern: np.ndarray,
        A_pattern: np.ndarray,
        solver: Solver = "osqp",
        units: np.ndarray | None = None,
        row_units: np.ndarray | None = None,
    ) -> None:
        self.solver = solver
        if solver not in ("osqp", "daqp"):
            raise ValueError(f"solver: {solver!r} is neither 'osqp' nor 'daqp'")
        m, n = A_pattern.shape
        self._units = np.ones(n) if units is None else np.array(units, float)
        self._per_row = np.ones(m) if row_units is None else 1.0 / np.array(row_units, float)
        # Where the entries of the compressed columns stand in P and A, whose rows stand one after the other.
        (P_columns, P_rows), (A_columns, A_rows) = np.triu(P_pattern).T.nonzero(), A_pattern.T.nonzero()
        self._P_index, self._A_index = n * P_rows + P_columns, n * A_rows + A_columns
        self._P_scale = self._units[P_rows] * self._units[P_columns]
        self._A_scale = self._per_row[A_rows] * self._units[A_columns]
        self._P = sparse.csc_matrix(np.triu(P_pattern).astype(float))
        self._A = sparse.csc_matrix(A_pattern.astype(float))
        self._osqp: osqp.OSQP | None = None
        self.rescues = self.iterations = 0

    def solve(
        self, P: np.ndarray, q: np.ndarray, A: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> np.ndarray | None:
        """Return the minimiser ``(n,)``, or None when it was not found or is not finite."""
        if not math.isfinite(P.sum() + q.sum() + A.sum()):  # a sum with NaN or an infinity is none
            return None
        if self.solver == "osqp":
            found = self._solve_osqp(P, q, A, lower, upper)
            if found is not None:
                return found
            self.rescues += 1
        return _solve_daqp(P, q, A, lower, upper)

    def _solve_osqp(self, P, q, A, lower, upper) -> np.ndarray | None:
        P_values = P.take(self._P_index) * self._P_scale
        A_values = A.take(self._A_index) * self._A_scale
        q, lower, upper = q * self._units, lower * self._per_row, upper * self._per_row
        if self._osqp is None:
            self._P.data[:], self._A.data[:] = P_values, A_values
            self._osqp = osqp.OSQP()
            self._osqp.setup(self._P, q, self._A, lower, upper, **_SETTINGS)
        else:
            self._osqp.update(q=q, l=lower, u=upper, Px=P_values, Ax=A_values)
        result = self._osqp.solve(raise_error=False)
        self.iterations += result.info.iter
        if result.info.status_val not in (1, 2) or not math.isfinite(result.x.sum()):
            self._osqp = None
            return None
        return result.x * self._units


def _solve_daqp(P, q, A, lower, upper) -> np.ndarray | None:
    """Solve with DAQP's active-set method, exact to rounding."""
    bound = 1e30
    sense = np.where(lower == upper, 5, 0).astype(np.int32)
    lower, upper = np.maximum(lower, -bound), np.minimum(upper, bound)
    u, _, flag, _ = daqp.solve(P, q, np.ascontiguousarray(A), upper, lower, sense)
    return np.array(u) if flag > 0 and np.isfinite(u).all() else None


def directions_left(
    P: np.ndarray, A: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the curvatures of the cost in the directions that the equality constraints leave.

    The minimiser is unique exactly when none is zero; their ratio is the condition number of what is left to
    decide. (Inequalities that bind can decide more.)

    Args:
        P: ``(n, n)``.
        A: ``(m, n)``.
        lower: ``(m,)``.
        upper: ``(m,)``; where it is equal to ``lower``, the row is an equality.

    Returns:
        Curvatures ``(d,)``, ascending, and as columns of ``(n, d)`` the directions, of length one.
    """
    free = linalg.null_space(A[lower == upper])
    curvatures, turned = np.linalg.eigh(free.T @ P @ free)
    return curvatures, free @ turned
