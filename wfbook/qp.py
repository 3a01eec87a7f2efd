"""A quadratic program of one fixed sparsity pattern, solved again and again."""

from typing import Literal

import daqp
import numpy as np
import osqp
from scipy import sparse

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

    Attributes:
        rescues: how many programs OSQP left to DAQP.
    """

    def __init__(self, P_pattern: np.ndarray, A_pattern: np.ndarray, solver: Solver = "osqp") -> None:
        self.solver = solver
        if solver not in ("osqp", "daqp"):
            raise ValueError(f"solver: {solver!r} is neither 'osqp' nor 'daqp'")
        self._P_index = np.flatnonzero(np.triu(P_pattern).ravel(order="F"))
        self._A_index = np.flatnonzero(A_pattern.ravel(order="F"))
        self._P = sparse.csc_matrix(np.triu(P_pattern).astype(float))
        self._A = sparse.csc_matrix(A_pattern.astype(float))
        self._osqp: osqp.OSQP | None = None
        self.rescues = 0

    def solve(
        self, P: np.ndarray, q: np.ndarray, A: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> np.ndarray | None:
        """Return the minimiser ``(n,)``, or None when it was not found or is not finite."""
        if not (np.isfinite(P).all() and np.isfinite(q).all() and np.isfinite(A).all()):
            return None
        if self.solver == "osqp":
            found = self._solve_osqp(P, q, A, lower, upper)
            if found is not None:
                return found
            self.rescues += 1
        return _solve_daqp(P, q, A, lower, upper)

    def _solve_osqp(self, P, q, A, lower, upper) -> np.ndarray | None:
        P_values = P.ravel(order="F")[self._P_index]
        A_values = A.ravel(order="F")[self._A_index]
        if self._osqp is None:
            self._P.data[:], self._A.data[:] = P_values, A_values
            self._osqp = osqp.OSQP()
            self._osqp.setup(self._P, q, self._A, lower, upper, **_SETTINGS)
        else:
            self._osqp.update(q=q, l=lower, u=upper, Px=P_values, Ax=A_values)
        result = self._osqp.solve(raise_error=False)
        if result.info.status_val not in (1, 2) or not np.isfinite(result.x).all():
            self._osqp = None
            return None
        return np.array(result.x)


def _solve_daqp(P, q, A, lower, upper) -> np.ndarray | None:
    """Solve with DAQP's active-set method, exact to rounding."""
    bound = 1e30
    sense = np.where(lower == upper, 5, 0).astype(np.int32)
    lower, upper = np.maximum(lower, -bound), np.minimum(upper, bound)
    u, _, flag, _ = daqp.solve(P, q, np.ascontiguousarray(A), upper, lower, sense)
    return np.array(u) if flag > 0 and np.isfinite(u).all() else None
