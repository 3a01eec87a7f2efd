"""What is left of a convex program when some of its variables are known.

With the binaries fixed, most of a leaf's rows say ``0 ≤ y ≤ 0`` or state an equality as two
inequalities: an interior-point method finds no interior there, runs longer, and ends "almost solved".
Removing what is decided leaves a third of the program.
"""

from dataclasses import replace

import clarabel
import numpy as np
from scipy import optimize, sparse

from wfbook.planner.conic import Conic, Solution, solve

_TOLERANCE = 1e-9

_PATIENCE = 5.0  # seconds

_INFEASIBLE = 2
"""The status with which SciPy's ``linprog`` says so."""

_NOTHING = 1e-11
"""A coefficient that is rounding error: dividing by it would decide a variable by noise."""


def solve_fixed(conic: Conic, columns: np.ndarray, values: np.ndarray) -> Solution:
    """Minimise a program with some variables fixed.

    Args:
        conic: the program.
        columns: which variables are fixed.
        values: at what.

    Returns:
        The solution, its ``y`` in the program's own columns.
    """
    n = conic.A.shape[1]
    y, known = np.zeros(n), np.zeros(n, bool)
    y[columns], known[columns] = values, True
    zero, nonneg = conic.equalities, conic.inequalities
    linear = conic.linear
    equal = np.arange(zero + nonneg) < zero
    keep = np.ones(zero + nonneg, bool)
    b = conic.b[: zero + nonneg]
    while True:
        fresh = _decide(linear, b, equal, keep, y, known)
        if fresh is None:
            return Solution("infeasible", np.inf, np.inf, y)
        if not fresh:
            break
    free = np.flatnonzero(~known)
    cone = conic.A[zero + nonneg :]
    rest = b - linear @ y
    order = np.concatenate([np.flatnonzero(keep & equal), np.flatnonzero(keep & ~equal)])
    A = sparse.vstack([linear[order][:, free], cone[:, free]], format="csc")
    b = np.concatenate([rest[order], conic.b[zero + nonneg :] - cone @ y])
    full = conic.P + sparse.triu(conic.P, 1).T
    gradient = full @ y
    P = sparse.triu(full[free][:, free]).tocsc()
    offset = conic.offset + conic.q @ y + 0.5 * y @ gradient
    sizes = int((keep & equal).sum()), int((keep & ~equal).sum())
    cones = [clarabel.ZeroConeT(sizes[0]), clarabel.NonnegativeConeT(sizes[1]), *conic.cones]
    result = solve(P, (conic.q + gradient)[free], A, b, cones, offset)
    if result.status == "failed" and _contradictory(A, b, *sizes):
        result = replace(result, status="infeasible", value=np.inf, bound=np.inf)
    if result.status != "infeasible":
        y[free] = result.y
    return Solution(result.status, result.value, result.bound, y)


def _contradictory(A: sparse.csc_matrix, b: np.ndarray, equalities: int, inequalities: int) -> bool:
    """Tell whether linear rows have no point, by the simplex method.

    An interior-point method often ends "almost infeasible", which is no proof: here it is settled.
    """
    linear, below = A[:equalities], A[equalities : equalities + inequalities]
    answer = optimize.linprog(
        np.zeros(A.shape[1]),
        A_ub=below,
        b_ub=b[equalities : equalities + inequalities],
        A_eq=linear,
        b_eq=b[:equalities],
        bounds=(None, None),
        options={"time_limit": _PATIENCE},
    )
    return answer.status == _INFEASIBLE


def _decide(
    A: sparse.csr_matrix, b: np.ndarray, equal: np.ndarray, keep: np.ndarray, y: np.ndarray, known: np.ndarray
) -> bool | None:
    """Run one round over the rows ``A y = b`` and ``A y ≤ b`` that are still kept.

    Updates ``equal``, ``keep``, ``y`` and ``known`` in place.

    Returns:
        Whether anything was decided; None if the rows contradict each other.
    """
    rows = np.flatnonzero(keep)
    free = np.flatnonzero(~known)
    rest = b[rows] - A[rows] @ y
    part = A[rows][:, free].tocsr()
    part.data[np.abs(part.data) < _NOTHING] = 0.0
    part.eliminate_zeros()
    count = np.diff(part.indptr)
    is_equal = equal[rows]
    empty = count == 0
    if (is_equal[empty] & (np.abs(rest[empty]) > 1e-7)).any() or (rest[empty] < -1e-7).any():
        return None
    keep[rows[empty]] = False

    single = np.flatnonzero(count == 1)
    column, slope = part.indices[part.indptr[single]], part.data[part.indptr[single]]
    limit = rest[single] / slope
    low, high = np.full(len(free), -np.inf), np.full(len(free), np.inf)
    for side, at, which in (
        (high, np.minimum, is_equal[single] | (slope > 0)),
        (low, np.maximum, is_equal[single] | (slope < 0)),
    ):
        at.at(side, column[which], limit[which])
    if (low > high + 1e-7).any():
        return None
    fixed = low >= high - _TOLERANCE
    y[free[fixed]] = 0.5 * (low[fixed] + high[fixed])
    known[free[fixed]] = True

    # A y ≤ b and A y ≥ b together are an equality; a random projection finds such pairs of rows.
    hashes = part @ np.random.default_rng(0).standard_normal(len(free))
    others = np.flatnonzero(~is_equal & (count > 1))
    order = others[np.argsort(np.abs(hashes[others]), kind="stable")]
    first, second = order[:-1], order[1:]
    opposite = np.abs(hashes[first] + hashes[second]) < 1e-12
    opposite &= np.abs(rest[first] + rest[second]) < _TOLERANCE
    equal[rows[first[opposite]]] = True
    keep[rows[second[opposite]]] = False
    return bool(fixed.any() or opposite.any())
