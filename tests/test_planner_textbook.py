"""The textbook's branch and bound finds what the planner finds, and its nodes say what is true."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from wfbook import terrain
from wfbook.planner import Problem, solve
from wfbook.planner.demands import cost_parts, friction_needed, reach_needed
from wfbook.planner.plan import Plan
from wfbook.planner.stored import stored
from wfbook.planner.textbook import Node, grow

FEET = Problem(terrain.flat(), goal=(0.3, 0.0), slots=3, end_effectors=("foot",))
ROLLING = Problem(terrain.flat(rolling_resistance=0.02), goal=(0.2, 0.0), slots=2)
GAP = 1e-3


@pytest.fixture(scope="module", params=["tight", "paper"])
def tree(request) -> list[Node]:
    return grow(FEET, request.param)


@pytest.mark.parametrize("problem", [FEET, ROLLING])
def test_both_trees_end_with_the_planners_optimum(problem):
    costs = [grow(problem, name)[-1].incumbent for name in ("tight", "paper")]
    assert costs[0] == pytest.approx(costs[1], rel=2e-3)
    assert costs[0] == pytest.approx(solve(problem, gap=1e-4).meta["objective"], rel=2e-3)


def test_a_childs_bound_is_at_least_its_parents(tree):
    for node in tree[1:]:
        assert node.bound >= tree[node.parent].bound - 1e-9
        assert tree[node.parent].fate == "split"


def test_the_proof_rises_the_incumbent_falls_and_they_meet(tree):
    proven, incumbent = ([getattr(n, name) for n in tree] for name in ("proven", "incumbent"))
    assert (np.diff(proven) >= -1e-9).all()
    assert all(after <= before for before, after in pairwise(incumbent))
    assert incumbent[-1] - proven[-1] <= GAP * incumbent[-1] * (1 + 1e-6)
    assert {n.fate for n in tree} <= {"split", "plan", "pruned", "infeasible"}


def test_a_node_is_thrown_away_only_for_a_plan_that_was_known_then(tree):
    for node in tree:
        if node.fate == "pruned":
            assert node.number < node.decided <= len(tree)
            assert node.bound >= tree[node.decided - 1].incumbent * (1 - GAP)


def test_plans_are_integral_and_the_root_is_not(tree):
    for node in tree:
        off = np.abs(node.S - np.rint(node.S)).max()
        assert off < 1e-3 if node.fate == "plan" else node.number or off > 0.02


def test_the_tight_root_is_higher():
    roots = [grow(FEET, name, most=1)[0] for name in ("tight", "paper")]
    assert roots[0].bound > roots[1].bound + 0.05
    assert roots[0].fate == "open" and roots[0].decision == ""


def test_what_it_can_not_draw_is_refused():
    with pytest.raises(ValueError, match="formulation: 'loose'"):
        grow(FEET, "loose")
    with pytest.raises(ValueError, match="has 3 regions, expected 1"):
        grow(replace(FEET, terrain=terrain.ramp()))


@pytest.mark.parametrize("name", ["flat", "flat-friction", "ramp-down", "stepping-stones", "far"])
def test_the_parts_of_the_cost_add_up_to_the_objective(name):
    plan = stored(name, relaxed=True)
    assert sum(cost_parts(plan).values()) == pytest.approx(plan.meta["objective"], rel=1e-6)


def test_what_a_plan_needs_is_within_what_it_was_allowed():
    plan: Plan = stored("flat-feet", relaxed=True)
    assert 0 < friction_needed(plan) <= 0.7 + 1e-5
    assert friction_needed(plan, "wheel") == 0.0
    assert (reach_needed(plan) <= np.array(plan.meta["reach"][:2]) + 1e-5).all()
    lam = plan.lam.copy()
    standing = np.flatnonzero(plan.S[:, 0] == 0)[0]
    lam[0, standing] = [30.0, 0.0, 20.0]
    assert friction_needed(replace(plan, lam=lam)) == pytest.approx(1.5)
