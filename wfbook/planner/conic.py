"""Convex programs that are solved again and again: compiled once by CVXPY, solved by Clarabel."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import clarabel
import cvxpy as cp
import numpy as np
from scipy import sparse


@dataclass(frozen=True)
class Solution:
    """What Clarabel found.

    Attributes:
        status: "solved", "cut" (stopped when the bound had passed a cutoff), "infeasible" or "failed"
            (no answer to be trusted).
        value: the primal objective; infinite if infeasible, NaN if cut or failed.
        bound: a lower bound of the optimum: the lesser of primal and dual objective; ``-inf`` if failed.
        y: the compiled program's variables.
    """

    status: str
    value: float
    bound: float
    y: np.ndarray


_STATUS = clarabel.SolverStatus
_SOLVED = (_STATUS.Solved, _STATUS.AlmostSolved)


def solve(P: Any, q: Any, A: Any, b: Any, cones: list[Any], offset: float = 0.0) -> Solution:
    """Minimise ``½ y'P y + q'y`` over ``b − A y`` in the cones."""
    solver = clarabel.DefaultSolver(P, q, A, b, cones, settings())
    return _read(solver.solve(), offset)


def settings() -> Any:
    """Return Clarabel's settings for this package: one thread and no presolve, so that runs repeat."""
    result = clarabel.DefaultSettings()
    result.verbose = False
    # "auto" takes a threaded factorisation, five times slower on programs of this size.
    result.direct_solve_method = "qdldl"
    result.presolve_enable = False  # else `update` is refused
    result.max_iter = 60
    return result


def rough_settings() -> Any:
    """Return settings for bounds that are thrown away: five digits, a third of the time."""
    result = settings()
    result.tol_gap_abs = result.tol_gap_rel = 1e-5
    result.tol_feas = 1e-6
    result.iterative_refinement_enable = False
    return result


def _read(result: Any, offset: float) -> Solution:
    y = np.asarray(result.x)
    if result.status in _SOLVED:
        primal, dual = result.obj_val + offset, result.obj_val_dual + offset
        return Solution("solved", primal, min(primal, dual), y)
    if result.status == _STATUS.PrimalInfeasible:
        return Solution("infeasible", np.inf, np.inf, y)
    # "Almost infeasible" is not a proof, and a numerical failure says nothing: keep the node open.
    return Solution("failed", np.nan, -np.inf, y)


@dataclass(frozen=True)
class Conic:
    """A convex program ``min ½ y'P y + q'y + offset`` with ``b − A y`` in a product of cones.

    Attributes:
        P: upper triangle of the cost's matrix.
        q: linear cost.
        offset: constant cost.
        A: rows of equalities, then of inequalities ``A y ≤ b``, then of second-order cones.
        b: right-hand side.
        equalities: how many rows are equalities.
        inequalities: how many rows are inequalities.
        cones: Clarabel's second-order cones.
        layout: first column of each CVXPY variable, by its id.
    """

    P: sparse.csc_matrix
    q: np.ndarray
    offset: float
    A: sparse.csc_matrix
    b: np.ndarray
    equalities: int
    inequalities: int
    cones: list[Any]
    layout: dict[int, int]

    @classmethod
    def compile(cls, cost: Any, constraints: list[Any]) -> "Conic":
        """Compile a CVXPY program without parameters.

        Args:
            cost: convex expression.
            constraints: CVXPY constraints.
        """
        data, _, _ = cp.Problem(cp.Minimize(cost), constraints).get_problem_data(cp.CLARABEL)
        n, dims = len(data["c"]), data["dims"]
        quadratic = data.get("P") is not None
        P = sparse.triu(data["P"]).tocsc() if quadratic else sparse.csc_matrix((n, n))
        applied = data["param_prob"].apply_parameters(quad_obj=quadratic)
        return cls(
            P=P,
            q=data["c"],
            offset=float(applied[2] if quadratic else applied[1]),
            A=data["A"].tocsc(),
            b=data["b"],
            equalities=dims.zero,
            inequalities=dims.nonneg,
            cones=[clarabel.SecondOrderConeT(size) for size in dims.soc],
            layout=data["param_prob"].var_id_to_col,
        )

    def columns(self, variable: Any) -> np.ndarray:
        """Return the columns of a CVXPY variable, in its own shape."""
        start = self.layout[variable.id]
        return np.arange(start, start + variable.size).reshape(variable.shape, order="F")

    def value(self, variable: Any, y: np.ndarray) -> np.ndarray:
        """Return a CVXPY variable's value in a solution."""
        return y[self.columns(variable)]

    def with_rows(self, equal: Any, equal_b: np.ndarray, below: Any, below_b: np.ndarray) -> "Conic":
        """Return the program with further rows ``equal y = equal_b`` and ``below y ≤ below_b``."""
        cut = self.equalities, self.equalities + self.inequalities
        A = [self.A[: cut[0]], equal, self.A[cut[0] : cut[1]], below, self.A[cut[1] :]]
        b = [self.b[: cut[0]], equal_b, self.b[cut[0] : cut[1]], below_b, self.b[cut[1] :]]
        return replace(
            self,
            A=sparse.vstack(A, format="csc"),
            b=np.concatenate(b),
            equalities=self.equalities + len(equal_b),
            inequalities=self.inequalities + len(below_b),
        )

    @cached_property
    def linear(self) -> sparse.csr_matrix:
        """Rows of equalities and inequalities, by rows."""
        return self.A[: self.equalities + self.inequalities].tocsr()

    @property
    def all_cones(self) -> list[Any]:
        """All cones in the order of the rows."""
        return [
            clarabel.ZeroConeT(self.equalities),
            clarabel.NonnegativeConeT(self.inequalities),
            *self.cones,
        ]


class Boxed:
    """A compiled program some of whose variables are bounded anew at each solve, without a new set-up."""

    def __init__(self, conic: Conic, columns: np.ndarray):
        """Set the solver up once.

        Args:
            conic: the program.
            columns: of the variables that will be bounded; a solution's ``y`` holds these only.
        """
        self._offset, self._cutoff, self._q = conic.offset, np.inf, conic.q
        self._columns = columns
        n = len(columns)
        pick = sparse.csc_matrix((np.ones(n), (np.arange(n), columns)), shape=(n, conic.A.shape[1]))
        A = sparse.vstack([conic.A, pick, -pick], format="csc")
        self._b = np.concatenate([conic.b, np.ones(n), np.zeros(n)])
        self._n = n
        self._solver = clarabel.DefaultSolver(
            conic.P,
            conic.q,
            A,
            self._b,
            [*conic.all_cones, clarabel.NonnegativeConeT(2 * n)],
            rough_settings(),
        )

        # The dual objective bounds the optimum up to (dual residual) · ‖y‖₁; entries of y are of order 1.
        self._slack = 10.0 * A.shape[1]
        self._solver.set_termination_callback(self._passed)

    def _passed(self, info: Any) -> bool:
        return info.cost_dual + self._offset - self._slack * info.res_dual > self._cutoff

    def solve(self, lower: np.ndarray, upper: np.ndarray, cutoff: float = np.inf) -> Solution:
        """Minimise with the box variable between two vectors.

        Args:
            lower: bound of the box variable.
            upper: likewise.
            cutoff: stop as soon as the optimum is known to be higher.
        """
        self._cutoff = cutoff
        self._b[-2 * self._n : -self._n] = upper
        self._b[-self._n :] = -lower
        self._solver.update(b=self._b)
        result = self._solver.solve()
        if result.status == _STATUS.CallbackTerminated:
            return Solution("cut", np.nan, cutoff, np.zeros(0))
        found = _read(result, self._offset)
        return replace(found, y=found.y[self._columns])

    def minimise(self, lower: np.ndarray, upper: np.ndarray, linear: np.ndarray) -> tuple[float, float]:
        """Minimise the cost plus a further linear one.

        Args:
            lower: bound of the box variable.
            upper: likewise.
            linear: coefficients of all variables of the program.

        Returns:
            A lower bound of the optimum, ``-inf`` without an answer, and the linear part at the minimiser.
        """
        self._solver.update(q=self._q + linear)
        self._cutoff = np.inf
        self._b[-2 * self._n : -self._n] = upper
        self._b[-self._n :] = -lower
        self._solver.update(b=self._b)
        found = _read(self._solver.solve(), self._offset)
        self._solver.update(q=self._q)
        return (found.bound, float(linear @ found.y)) if found.status == "solved" else (-np.inf, 0.0)
