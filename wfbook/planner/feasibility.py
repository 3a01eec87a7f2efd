"""Is there a motion at all? Mixed-integer *linear* programs, answered by HiGHS.

Torque and rotation have slack of their own: whatever the legs do, some bounds U± allow for it (eq. 9), so
they never are the reason why there is no plan. Without them all that is left is linear.
"""

from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import highspy
import numpy as np
from scipy import sparse

from wfbook.modes import DIAGONAL_PATTERNS
from wfbook.planner import tight
from wfbook.planner.conic import Conic
from wfbook.planner.contacts import Contacts
from wfbook.planner.problem import Problem
from wfbook.planner.program import Program

SOFT = ("torque bounds", "torque", "rotation", "tilt", "centroid")
"""Groups of the program that never exclude a motion."""

_TROT = [frozenset(p) for p in DIAGONAL_PATTERNS if len(p) == 2]
_ANY = 1e9  # a relative gap that any point is within


def possible(problem: Problem, time_limit: float) -> bool | None:
    """Tell whether a problem has a plan.

    Args:
        problem: what is asked.
        time_limit: in seconds.

    Returns:
        None if there was not enough time to tell.
    """
    if not problem.start_in_reach:
        return False
    program = tight.build(problem)
    conic, integer = compiled(program, program.rows(without=SOFT))
    free = np.full(len(integer), np.inf)
    return exists(conic, integer, -free, free, time_limit, program.contacts)


def compiled(program: Program, rows: list[Any]) -> tuple[Conic, np.ndarray]:
    """Compile rows.

    Args:
        program: whose discrete variables must be integers.
        rows: linear constraints.

    Returns:
        The compiled rows, and 1 for each column that must be an integer.
    """
    discrete = list(program.discrete.values())
    # Mentioned without effect, so that every discrete variable has columns.
    conic = Conic.compile(cp.sum(discrete[0]), rows + [v <= 1 for v in discrete] + [v >= 0 for v in discrete])
    integer = np.zeros(conic.A.shape[1])
    for variable in discrete:
        integer[conic.columns(variable).ravel()] = 1
    return conic, integer


def region_columns(conic: Conic, contacts: Contacts) -> tuple[np.ndarray, np.ndarray]:
    """Find the discrete variables of regions.

    Returns:
        ``(R, n, L, J)`` columns of the n variables that sum to the contacts in each region when a slot
        ends, and likewise of those that sum to the legs that swing and will land there.
    """
    stands, lands = [contacts.foot_stance], [contacts.foot_landing]
    if contacts.problem.wheels:
        stands.append(contacts.zone)
        lands.append(contacts.wheel_landing)
    regions = contacts.foot_stance
    landing = np.array([[conic.columns(part[r]) for part in lands] for r in regions])
    standing = np.array([[conic.columns(part[r]) for part in stands] for r in regions])
    return np.concatenate([standing, landing], axis=1), landing


def exists(
    conic: Conic,
    integer: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    time_limit: float,
    contacts: Contacts,
    below: tuple[Any, np.ndarray] | None = None,
) -> bool | None:
    """Tell whether there is a point.

    Args:
        conic: as for :func:`solve`, like the others.
        integer: 1 for columns that must be integers.
        lower: bounds of the columns.
        upper: likewise.
        time_limit: in seconds.
        contacts: the discrete variables.
        below: further rows ``A y ≤ b``.

    Returns:
        None if there was not enough time to tell.
    """
    # Looking for few swings finds some soon.
    costly = region_columns(conic, contacts)[1]
    patterns = [frozenset(p) for p in contacts.problem.patterns]
    chosen = conic.columns(contacts.pattern)
    trot = [_TROT[j % 2] for j in range(chosen.shape[1] - 1)] + [frozenset()]
    if set(trot) <= set(patterns):
        # What can be done at all can be done at a trot, nearly always, and that is told in no time.
        low, high = lower.copy(), upper.copy()
        high[chosen] = 0.0
        at = chosen[[patterns.index(p) for p in trot], range(len(trot))]
        low[at] = high[at] = 1.0
        if solve(conic, integer, low, high, time_limit, costly, below).possible:
            return True
    return solve(conic, integer, lower, upper, time_limit, costly, below).possible


@dataclass(frozen=True)
class Answer:
    """What HiGHS found.

    Attributes:
        possible: whether there is a point; None if there was not enough time to tell.
        least: a lower bound of the cost.
    """

    possible: bool | None
    least: float


def solve(
    conic: Conic,
    integer: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    time_limit: float,
    costly: Any,
    below: tuple[Any, np.ndarray] | None = None,
    gap: float = _ANY,
) -> Answer:
    """Ask HiGHS for a point of a program.

    Args:
        conic: its rows; cones are not allowed.
        integer: 1 for columns that must be integers.
        lower: bounds of the columns, and of columns to be added.
        upper: likewise.
        time_limit: in seconds.
        costly: columns whose sum is to be small.
        below: further rows ``A y ≤ b``.
        gap: relative gap of that sum at which to stop; default at the first point.
    """
    added = len(upper) - len(integer)
    A = sparse.hstack([conic.A, sparse.csc_array((conic.A.shape[0], added))])
    high = conic.b
    if below is not None:
        A, high = sparse.vstack([A, below[0]]), np.r_[high, below[1]]
    A, low = sparse.csc_array(A), high.copy()
    low[conic.equalities :] = -np.inf

    program = highspy.HighsLp()
    program.num_row_, program.num_col_ = A.shape
    program.col_cost_ = np.bincount(np.ravel(costly), minlength=len(upper)).astype(float)
    program.col_lower_, program.col_upper_ = lower, upper
    program.row_lower_, program.row_upper_ = low, high
    matrix = program.a_matrix_
    matrix.format_ = highspy.MatrixFormat.kColwise
    matrix.start_, matrix.index_, matrix.value_ = A.indptr, A.indices, A.data
    kinds = highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger
    program.integrality_ = [kinds[int(i)] for i in np.r_[integer, np.zeros(added)]]

    highs = highspy.Highs()
    highs.silent()
    for option, value in (("time_limit", time_limit), ("mip_rel_gap", gap), ("parallel", "off")):
        highs.setOptionValue(option, value)
    highs.passModel(program)
    highs.run()
    status, info = highs.getModelStatus(), highs.getInfo()
    if status == highspy.HighsModelStatus.kInfeasible:
        return Answer(False, np.inf)
    found = info.primal_solution_status == highspy.SolutionStatus.kSolutionStatusFeasible
    return Answer(True if found else None, info.mip_dual_bound)
