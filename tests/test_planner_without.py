"""Groups of constraints that are left out: by the search, by both formulations, and known to the checker."""

from dataclasses import replace

import numpy as np
import plan_checker
import pytest
from test_planner_formulations import BOTH, PROBLEMS, Both, random_gait

from wfbook import terrain
from wfbook.planner import OPTIONAL, InfeasibleError, NoPlanError, Plan, Problem, Progress, polish, solve
from wfbook.planner.extract import problem_of
from wfbook.planner.feasibility import possible
from wfbook.terrain import Terrain

FAST = Problem(terrain.flat(rolling_resistance=0.02), goal=(0.9, 0.0), slots=4)
"""A goal at the limit of what can be reached, where every group of constraints costs something."""

EQUATIONS = {"friction": "26", "rolling friction": "29", "reach": "30", "angular bounds": "9 sum"}
"""What a plan breaks when a group is left out and the checker is not told."""


@pytest.fixture(scope="module")
def plans() -> dict[str, Plan]:
    """Plans of the fast problem, without each group, and with all of them."""
    names = ("", *OPTIONAL)
    return {n: solve(replace(FAST, without=(n,) if n else ()), gap=5e-3, time_limit=60) for n in names}


@pytest.mark.parametrize("name", OPTIONAL)
def test_a_plan_without_a_group_keeps_all_the_others(plans, name):
    plan = plans[name]
    assert plan_checker.check(plan)[0] == []
    told = plan.meta["options"]
    plain = plan.with_meta(options=told | {"without": []})
    broken = {v.equation for v in plan_checker.check(plain)[0]}
    assert EQUATIONS.get(name, "31-33") in broken, "and the checker notices what was left out"
    assert problem_of(plan).without == (name,)


@pytest.mark.parametrize("name", ["friction", "reach", "angular bounds", "centroid"])
def test_leaving_out_a_restriction_or_a_price_never_costs(plans, name):
    assert plans[name].meta["bound"] <= plans[""].meta["objective"]


def test_a_polish_gives_true_torque_to_a_gait_that_was_found_without(plans):
    polished = polish(plans["angular bounds"])
    assert plan_checker.check(polished)[0] == []
    assert np.max(polished.meta["relaxed_torque_mismatch_nm"]) > 1.0
    assert np.max(polished.meta["torque_mismatch_nm"]) < 0.1


@pytest.mark.parametrize("without", [*((name,) for name in OPTIONAL), tuple(OPTIONAL)])
def test_both_formulations_leave_out_the_same(without):
    asked = replace(PROBLEMS["ramp up, resisted"], without=without)
    both, rng, finite = Both(asked), np.random.default_rng(5), 0
    for _ in range(12):
        fast, paper = both.values(*random_gait(rng, asked))
        assert fast == pytest.approx(paper, rel=1e-5)
        finite += np.isfinite(fast)
    assert finite > 2


def test_a_group_that_is_left_out_is_never_blamed():
    apart = np.array([[0.3, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    far = Problem(terrain.flat(), goal=(0.0, 0.0), slots=3, start_offsets=apart)
    with pytest.raises(InfeasibleError) as caught:
        solve(far)
    assert "reach" in caught.value.groups
    free = replace(far, without=("reach",))
    assert possible(free, 60.0) is True
    slippery = replace(FAST.terrain.regions[0], mu_foot=0.02, mu_wheel=0.0, mu_wheel_lateral=0.02)
    ice = replace(FAST, terrain=Terrain("ice", (slippery,)), goal=(0.3, 0.0), goal_tolerance=(0.05, 0.05))
    with pytest.raises(InfeasibleError) as caught:
        solve(ice)
    assert "friction" in caught.value.groups
    assert possible(replace(ice, without=("friction",)), 60.0) is True
    with pytest.raises(InfeasibleError) as caught:
        solve(
            replace(
                ice, without=("friction",), limits=replace(ice.limits, speed=(0.1, 0.1)), beyond_reach=True
            )
        )
    assert "speed" in caught.value.groups and "friction" not in caught.value.groups


def test_nothing_left_out_is_the_problem_as_it_was():
    assert FAST.priced == FAST.weights and FAST.body is FAST.robot and FAST.turns
    assert [r.mu_foot for r in FAST.ground.regions] == [r.mu_foot for r in FAST.terrain.regions]


@pytest.mark.parametrize("without", ["friction", ("fricton",), ("dynamics",)])
def test_only_known_groups_can_be_left_out(without):
    with pytest.raises(ValueError, match=r"without: .*expected names of friction, rolling friction"):
        replace(FAST, without=without)


def small(slots: int) -> Problem:
    """Feet only, for which even the paper's formulation has something to tell within seconds."""
    return Problem(terrain.flat(), goal=(0.1 * slots, 0.0), slots=slots, end_effectors=BOTH[:1])


def test_the_papers_formulation_tells_its_progress():
    told: list[Progress] = []
    plan = solve(small(1), formulation="paper", progress=told.append, time_limit=20)
    assert told and all(0.0 <= p.bound <= p.incumbent for p in told)
    assert [p.bound for p in told] == sorted(p.bound for p in told), "a bound never falls"
    assert all(p.bound <= plan.meta["objective"] + 1e-6 for p in told)
    assert np.diff([p.time for p in told]).min(initial=1.0) > 0.05


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_what_a_progress_callback_raises_ends_the_papers_search(error):
    def refuse(_progress: Progress) -> None:
        raise error("enough")

    with pytest.raises((error, NoPlanError)):
        solve(small(2), formulation="paper", progress=refuse, time_limit=30)
