"""Chapter 5: the mixed-integer program (Paper A, sections II-E and II-F).

In reading order: :mod:`.problem` says what is asked, :mod:`.program` states what every formulation
shares, :mod:`.bigm` is the paper's own, :mod:`.tight` the fast one; :mod:`.relaxation` bounds it
cheaply, :mod:`.kernel` branches, :mod:`.gaits` guesses, :mod:`.tree` lets SCIP search; :mod:`.polish`
makes the result true, :mod:`.plan` keeps it.
"""

from wfbook.planner.explain import InfeasibleError, NoPlanError
from wfbook.planner.plan import Plan
from wfbook.planner.polish import polish, repaired, torque_mismatch
from wfbook.planner.problem import Limits, Problem, Weights
from wfbook.planner.solve import solve, solve_executable
from wfbook.planner.tree import Progress

__all__ = [
    "InfeasibleError",
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
