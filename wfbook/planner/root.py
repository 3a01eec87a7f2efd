"""What a formulation knows before the search: its relaxation with no binary decided.

The search adds to this bound, node by node. How much it has to add is what a formulation is good for.
"""

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from wfbook.planner import bigm, tight
from wfbook.planner.conic import Conic, solve
from wfbook.planner.problem import Problem

_BUILD = {"paper": bigm.build, "tight": tight.build}


@dataclass(frozen=True)
class Root:
    """A solved relaxation.

    Attributes:
        bound: no plan costs less.
        S: ``(L, J)`` swing matrix, anything from 0 to 1.
        wheel: ``(L, J)`` the share of each leg's D that is on wheels, likewise.
        p: ``(K+1, L, 3)`` contact points.
        force: ``(K, L)`` vertical contact forces, in body weights.
    """

    bound: float
    S: np.ndarray
    wheel: np.ndarray
    p: np.ndarray
    force: np.ndarray


def root(problem: Problem, formulation: str) -> Root:
    """Solve a formulation with all binaries relaxed to ``[0, 1]``.

    Args:
        problem: what is asked.
        formulation: "tight" or "paper".

    Raises:
        ValueError: another formulation.
        RuntimeError: the relaxation has no solution, or the solver found none.
    """
    if formulation not in _BUILD:
        raise ValueError(f"formulation: {formulation!r}, expected one of {tuple(_BUILD)}")
    program = _BUILD[formulation](problem)
    relaxed = []
    for variable in program.discrete.values():
        variable.attributes["boolean"] = False
        relaxed += [variable >= 0, variable <= 1]
    conic = Conic.compile(program.cost, program.rows() + relaxed)
    found = solve(conic.P, conic.q, conic.A, conic.b, conic.all_cones, conic.offset)
    if found.status != "solved":
        raise RuntimeError(f"relaxation: {found.status}")

    def value(expression: cp.Expression | np.ndarray) -> np.ndarray:
        if not isinstance(expression, cp.Expression):
            return np.asarray(expression, float)
        for variable in expression.variables():
            variable.save_value(conic.value(variable, found.y))
        return expression.value

    return Root(
        bound=found.bound,
        S=value(program.S),
        wheel=value(program.wheel),
        p=np.stack([value(part) for part in program.p], axis=-1),
        force=value(program.force[2]),
    )
