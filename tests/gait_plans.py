"""Plans for given gaits: what is optimised is the motion, so that a test waits for no search."""

import numpy as np

from wfbook.planner import Problem, tight
from wfbook.planner.conic import Conic
from wfbook.planner.contacts import assignment
from wfbook.planner.crossings import Crossings
from wfbook.planner.extract import fill, plan_of, read
from wfbook.planner.gait import Gait
from wfbook.planner.plan import Plan
from wfbook.terrain import Terrain


def relaxed(terrain: Terrain, goal: float, legs: list[str], regions: list[list[int]]) -> Plan:
    """Return the relaxed plan of a gait.

    Args:
        terrain: the ground.
        goal: x of the CoM at the end.
        legs: for each leg a letter a slot: ``.`` it stands or rolls, ``f`` it swings and lands on its foot,
            ``w`` on its wheel.
        regions: for each leg the region under it when each slot ends.
    """
    S = np.array([[int(letter != ".") for letter in leg] for leg in legs])
    wheel = np.zeros_like(S)
    for leg, slot in np.argwhere(S):
        wheel[leg, slot:] = legs[leg][slot] == "w"
    kinds = ("foot", "wheel") if wheel.any() else ("foot",)
    problem = Problem(terrain, goal=(goal, 0.0), slots=S.shape[1], end_effectors=kinds)
    gait = Gait(S, wheel, np.array(regions))
    program = tight.build(problem)
    conic = Conic.compile(program.cost, program.rows())
    columns = np.concatenate([conic.columns(v).ravel() for v in program.discrete.values()])
    known = assignment(problem, gait, program.discrete)
    values = np.concatenate([known[key].ravel() for key in program.discrete])
    found = Crossings(program, conic).solve(columns, values, np.inf, quick=False)
    assert found.status == "solved", f"this gait is {found.status}"
    fill(program, conic, found.y)
    meta = {
        "stage": "relaxed",
        "objective": found.value,
        "bound": found.bound,
        "status": "optimal",
        "nodes": 0,
    }
    meta["gap"] = max(found.value - found.bound, 0.0) / found.value
    return plan_of(problem, read(program), gait, meta)
