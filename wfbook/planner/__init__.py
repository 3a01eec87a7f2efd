"""Chapter 5: the mixed-integer program (Paper A, sections II-E and II-F).

In reading order: :mod:`.problem` says what is asked, :mod:`.program` states what every formulation
shares, :mod:`.bigm` is the paper's own, :mod:`.tight` the fast one. :mod:`.conic` compiles them for
Clarabel, :mod:`.presolve` removes what fixed binaries decide, :mod:`.relaxation` bounds cheaply.
:mod:`.boxes` and :mod:`.symmetry` are the logic of gaits, :mod:`.kernel` bounds and splits, on two cores
with :mod:`.worker`, :mod:`.gaits` guesses, :mod:`.tree` lets SCIP search, :mod:`.explain` says why there is
nothing to find. :mod:`.polish` makes the result true, :mod:`.plan` keeps it.
"""

from wfbook.planner.explain import InfeasibleError, NoPlanError
from wfbook.planner.plan import Plan
from wfbook.planner.polish import polish, repaired, torque_mismatch
from wfbook.planner.problem import InitialState, Limits, Problem, Weights
from wfbook.planner.solve import solve, solve_executable
from wfbook.planner.tree import Progress

__all__ = [
    "InfeasibleError",
    "InitialState",
    "Limits",
    "NoPlanError",
    "Plan",
    "Problem",
    "Progress",
    "Weights",
    "polish",
    "repaired",
    "solve",
    "solve_executable",
    "torque_mismatch",
]
