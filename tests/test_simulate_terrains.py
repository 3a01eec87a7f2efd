"""Planned motion on slopes and stones: over a crest, through a hollow, across gaps, executed upright."""

import gait_plans
import numpy as np
import plan_checker
import pytest

from wfbook.go1 import nominal
from wfbook.modes import LEGS
from wfbook.planner import polish
from wfbook.planner.extract import gait_of, problem_of
from wfbook.planner.margins import MARGIN
from wfbook.simulate import run
from wfbook.terrain import Terrain, ramp, stepping_stones

CASES = {
    # FL and later FR reach a ramp that falls by 12 degrees, FL and RL on wheels; the feet brake.
    "crest": (
        ramp(12.0, "down", start=0.3, length=0.5),
        0.5,
        ["w......", ".f.f.f.", ".w.....", "w.f.f.."],
        [[0, 0, 0, 1, 1, 1, 1], [0, 1, 1, 1, 1, 1, 1], [0] * 7, [0] * 7],
    ),
    # FL rolls on to a ramp that rises by 12 degrees; the feet push.
    "hollow": (
        ramp(12.0, "up", start=0.3, length=0.5),
        0.4,
        ["w.....", ".f.f..", ".w....", "w.f..."],
        [[0, 0, 1, 1, 1, 1], [0, 1, 1, 1, 1, 1], [0] * 6, [0] * 6],
    ),
    "stones": (
        stepping_stones(gap=0.15, stone=0.2, start=0.26),
        0.45,
        ["f.f....", ".f.f...", ".f.f...", "f.f...."],
        [[0, 0, 1, 1, 1, 1, 1], [0, 0, 0, 1, 1, 1, 1], [0] * 7, [0] * 7],
    ),
}


@pytest.fixture(scope="module", params=CASES)
def case(request) -> tuple:
    """Relaxed and polished plan of a case, and the run."""
    relaxed = gait_plans.relaxed(*CASES[request.param])
    polished = polish(relaxed)
    return relaxed, polished, run(polished, hold=0.5)


def test_plans_obey_every_equation_before_and_after_the_polish(case):
    for plan in case[:2]:
        assert plan_checker.check(plan, 1e-5)[0] == []
    assert max(case[1].meta["torque_mismatch_nm"]) < 0.1
    assert case[1].distance == pytest.approx(case[0].distance, abs=0.03)


def test_a_polished_plan_keeps_off_edges(case):
    _, plan, _ = case
    regions, rho = plan.terrain.regions, plan.knots // plan.slots
    gait = gait_of(plan)
    for leg, slot in np.argwhere((plan.S == 1) & (plan.end_effector == 0)):
        x, y, _ = plan.p[rho * (slot + 1), leg]
        assert regions[gait.region[leg, slot]].outside(x, y) < -MARGIN + 1e-6


def test_the_robot_stays_up_and_arrives(case):
    _, plan, result = case
    metrics = result.metrics
    assert metrics["upright"]
    assert metrics["distance_m"] == pytest.approx(plan.distance, abs=0.005)
    assert metrics["base_rms_m"] < 0.01
    assert metrics["base_rms_rad"] < np.radians(1.5)
    assert metrics["final_speed_m_s"] < 0.005


def test_contacts_stay_on_their_regions_and_do_not_slide(case):
    _, plan, result = case
    assert result.metrics["region_violation_max_m"] < 0.01
    assert result.metrics["slip_max_m"] < 0.006
    pressing = result.in_contact & result.stance & (result.t > 0)[:, None]
    for k, leg in np.argwhere(pressing)[::7]:
        gap = min(
            np.linalg.norm(result.p[k, leg] - r.nearest(result.p[k, leg])) for r in plan.terrain.regions
        )
        assert gap < 0.003, (LEGS[leg], result.t[k])


def test_wheels_follow_the_plan_over_edges(case):
    _, _, result = case
    rolling = (result.end_effector == 1) & result.stance & result.in_contact & (result.t > 0)[:, None]
    away = result.p - result.p_ref - (result.com - result.com_ref)[:, None]
    assert np.abs(away[rolling, 0]).max(initial=0.0) < 0.015


def test_the_trunk_leans_until_front_and_rear_hips_are_as_high_above_their_contacts(case):
    _, plan, result = case
    hips, heights = nominal()["hip_offsets"][:, 0], plan.p[-1, :, 2]
    slope = (heights[:2].mean() - heights[2:].mean()) / (hips[:2].mean() - hips[2:].mean())
    assert result.rpy[-1, 1] == pytest.approx(-np.arctan(slope), abs=2e-3)
    flat = plan.terrain.name == "stepping-stones"
    assert (abs(slope) < 1e-9) == flat


def test_a_plan_from_a_file_of_regions_runs_like_one_from_the_builder(tmp_path):
    terrain, goal, legs, regions = CASES["stones"]
    terrain.save(tmp_path / "stones.json")
    plan = polish(gait_plans.relaxed(Terrain.load(tmp_path / "stones.json"), goal, legs, regions))
    assert problem_of(plan).terrain == terrain
    plan.save(tmp_path / "plan.npz")
    assert run(type(plan).load(tmp_path / "plan.npz"), hold=0.1).metrics["upright"]
