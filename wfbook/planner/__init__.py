"""Chapter 5: the mixed-integer program (Paper A, sections II-E and II-F).

In reading order: :mod:`.ground` reads the terrain and :mod:`.problem` says what is asked. :mod:`.program`
states what every formulation shares, :mod:`.bigm` is the paper's own, :mod:`.watched` while SCIP searches it;
:mod:`.contacts` and :mod:`.tight` are the fast one, and :mod:`.root` says what each knows before a search.
:mod:`.conic` compiles them for Clarabel, :mod:`.presolve` removes what fixed binaries decide,
:mod:`.crossings` finds where wheels cross edges; :mod:`.textbook` is a search to be read. :mod:`.relaxation`
bounds cheaply, :mod:`.bounds` narrows. :mod:`.gait`, :mod:`.boxes` and :mod:`.symmetry` are the logic of
gaits. :mod:`.kernel` bounds and prices, on two cores with :mod:`.worker`; :mod:`.gaits` guesses,
:mod:`.branching` splits, :mod:`.tree` lets SCIP search by its :mod:`.plugins`. :mod:`.extract` reads the
solution, :mod:`.polish` makes it true, :mod:`.plan` keeps it, :mod:`.demands` says what it asks of robot and
ground, :mod:`.windows` plans far, :mod:`.ahead` in another process, and :mod:`.stitch` joins the plans;
:mod:`.stored` reads those that come with the book.

:mod:`.explain` says why there is nothing to find: :mod:`.elastic` answers, on a :mod:`.wide` problem and with
:mod:`.feasibility`, what would be possible without some limits; :mod:`.reasons` and :mod:`.neighbours` name
what is to blame.
"""

from wfbook.planner.explain import InfeasibleError, NoPlanError
from wfbook.planner.plan import Plan
from wfbook.planner.polish import polish, repaired, torque_mismatch
from wfbook.planner.problem import OPTIONAL, InitialState, Limits, Problem, Weights
from wfbook.planner.reasons import Reason
from wfbook.planner.root import Root, root
from wfbook.planner.solve import solve, solve_executable
from wfbook.planner.stored import stored
from wfbook.planner.tree import Progress
from wfbook.planner.windows import solve_windows

__all__ = [
    "OPTIONAL",
    "InfeasibleError",
    "InitialState",
    "Limits",
    "NoPlanError",
    "Plan",
    "Problem",
    "Progress",
    "Reason",
    "Root",
    "Weights",
    "polish",
    "repaired",
    "root",
    "solve",
    "solve_executable",
    "solve_windows",
    "stored",
    "torque_mismatch",
]
