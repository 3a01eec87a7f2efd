"""The paper's experiments on invented plans and runs: what is compared, decided and drawn."""

import json

import numpy as np
import pytest
from matplotlib.colors import to_hex
from paper_cases import by_key, execution, invented, outcome, plan_of, report_file

from wfbook import planner, terrain
from wfbook.paper import gaits, speed, times, transport
from wfbook.paper.bench import Planned
from wfbook.paper.parts import EXPERIMENTS
from wfbook.paper.reading import Reading
from wfbook.paper.store import described
from wfbook.quoted import value
from wfbook.table2.benchmark import APART
from wfbook.view import paper as pictures
from wfbook.view.style import FOOT, SWING, WHEEL


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda e: e.name)
def test_an_experiment_compares_what_it_names_and_draws_its_pictures(experiment, tmp_path):
    result = experiment.run(invented(tmp_path, seeds=2))
    assert {record.paper for record in result.records if record.paper} == set(experiment.paper)
    assert tuple(result.pictures) == experiment.pictures
    assert result.settings
    assert not result.troubles
    for record in result.records:
        said = record.quoted
        assert record.ours is not None or record.holds is False
        assert (record.holds is None) == (said is None or said.value is not None)
        assert said is None or said.value is None or said.unit == record.unit
        assert record.low is None or record.low <= record.ours <= record.high
    json.dumps([record.to_dict() for record in result.records], allow_nan=False)


def test_speeds_and_gains_are_those_of_the_runs(tmp_path):
    found = by_key(speed.run(invented(tmp_path, seeds=3)))
    feet, both = 1.5, 3.0
    assert found["feet.distance"].ours == pytest.approx(feet - 0.01)
    assert (found["feet.distance"].low, found["feet.distance"].high) == pytest.approx((feet - 0.02, feet))
    assert found["both.speed"].ours == pytest.approx((both - 0.01) / 4.5)
    gains = [100 * ((both - 0.01 * s) / (feet - 0.01 * s) - 1) for s in range(3)]
    assert found["both.faster"].ours == pytest.approx(gains[1])
    assert found["both.faster"].high == pytest.approx(max(gains))
    assert found["planned to be faster than feet only, feet and wheels"].ours == pytest.approx(100.0)
    assert "gap 2.00 % (time limit, 0.5 s); seeds 0, 1, 2, true state" in found["feet.distance"].proof


def test_speed_is_asked_alike_of_all_three():
    problems = [speed.problem(case) for case in speed.CASES]
    assert {p.goal for p in problems} == {speed.GOAL}
    assert [p.duration for p in problems] == [pytest.approx(4.5)] * 3
    assert all(speed.GOAL[0] > p.limits.speed[0] * p.duration for p in problems), "out of reach"
    assert len({json.dumps(described([p.weights, p.limits])) for p in problems}) == 1


def test_costs_of_transport_are_of_equal_ways_from_rest_to_rest(tmp_path):
    bench = invented(tmp_path, seeds=2)
    asked = []
    plan = bench.plan
    bench.plan = lambda problem, label: (asked.append(problem), plan(problem, label))[1]
    result = transport.run(bench)
    assert [p.duration for p in asked] == [pytest.approx(9.0)] * 3
    assert all(p.final_stance for p in asked)
    feet, *wheels = asked
    assert feet.end_effectors == ("foot",)
    assert {p.goal[0] for p in wheels} == {result.settings["goal_of_wheels_m"]}
    assert wheels[0].goal[0] == pytest.approx(feet.goal[0])
    found = by_key(result)
    assert found["the shortest way is shorter than the longest by"].ours < 1.0
    assert (found["feet.cot"].ours, found["both.cot"].ours) == pytest.approx((0.6, 0.2))
    assert found["cot.improvement"].ours == pytest.approx(3.0)
    assert found["cot.reduction"].ours == pytest.approx(100 * 2 / 3)
    assert found["feet only over feet and wheels, positive work"].ours == pytest.approx(3.0)
    rolling = "feet only over feet and wheels, rolling friction"
    for text in ("absolute work", "positive work"):
        assert found[f"{rolling}, {text}"].ours == pytest.approx(2.0)


def test_a_fallen_robot_has_no_cost_of_transport(tmp_path):
    bench = invented(tmp_path, seeds=2)
    bench.execute = lambda plan, label: [execution(plan, seed, upright=False) for seed in range(2)]
    found = by_key(transport.run(bench))
    assert found["feet.cot"].ours is None
    assert found["distance, feet only"].ours is None
    assert found["cot.improvement"].ours is None
    assert found["of 2 runs upright to the end, feet only"].ours == 0

    def one_falls(plan, label):
        fallen = int(plan.end_effector.any())  # with wheels another one than on feet
        return [execution(plan, seed, 1.0 + seed, upright=seed != fallen) for seed in range(3)]

    bench.execute = one_falls
    found = by_key(transport.run(bench))
    assert found["feet.cot"].low == 2.0
    assert found["both.cot"].low == 1.0
    assert found["cot.improvement"].ours == found["cot.improvement"].high == 1.0, "of the same seed"


@pytest.mark.parametrize("missing", ["feet", "both"])
def test_what_is_not_planned_is_left_out_and_the_rest_compared(missing, tmp_path):
    bench = invented(tmp_path, seeds=1)
    plan = bench.plan
    lacking = ("foot",) if missing == "feet" else ("foot", "wheel")
    bench.plan = lambda problem, label: None if problem.end_effectors == lacking else plan(problem, label)
    found = by_key(speed.run(bench))
    assert found[f"{missing}.distance"].ours is None
    assert found[f"{'both' if missing == 'feet' else 'feet'}.distance"].ours is not None
    assert "both.faster" not in found
    assert "cot.improvement" not in by_key(transport.run(bench))
    bench.plan = lambda problem, label: None
    assert not gaits.run(bench, "ramp-up", 11).pictures


def test_a_gait_is_read():
    read = Reading.of(plan_of(["w..f..", ".woooo", ".woooo", "wooof."]))
    assert read.lines[1] == "FR .^oooo  regions 000000"
    assert read.swings == 6
    assert read.first_wheel_s == pytest.approx(0.3)
    assert read.all_on_wheels_s is None
    stance = 4 + 5 + 5 + 4
    assert read.share_on_wheels() == pytest.approx((4 + 4 + 3) / stance)
    assert read.share_on_wheels(np.arange(6) < 1) == pytest.approx(0.0)
    assert read.share_on_wheels(False) is None
    assert read.ending == (2, 2)
    assert read.foot_contacts == 2 + 1 + 1 + 1
    assert read.switched_back == 1
    assert read.feet_only_from_s is None
    early = Reading.of(plan_of(["wof.", "wof.", "wof.", "...."]))
    assert early.all_on_wheels_s is None
    assert early.feet_only_from_s == pytest.approx(0.6)
    assert Reading.of(plan_of(["woo", "woo", ".wo", ".wo"])).all_on_wheels_s == pytest.approx(0.6)
    assert Reading.of(plan_of(["..", "..", "..", ".f"])).first_wheel_s is None


def test_rolling_over_an_edge_is_no_swing():
    ramp = terrain.ramp(start=0.1)
    plan = plan_of(["wooo", "f...", "wooo", "...."], ["0112", "1111", "0000", "0000"], terrain=ramp)
    read = Reading.of(plan)
    assert list(read.before) == [1, 1, 0, 0]
    assert read.rolled_over_edges == 2
    assert read.share_on_wheels(read.regions == 1) == pytest.approx(2 / 5)


def test_the_longest_step_is_of_a_swing():
    plan = plan_of(["f.", "oo", "..", ".."], advance=0.8)
    assert Reading.of(plan).step_m == pytest.approx(3 * 0.02)
    assert Reading.of(plan_of(["..", "oo", "..", ".."])).step_m == 0.0


@pytest.mark.parametrize("name", terrain.BUILTIN_NAMES)
def test_goals_lie_beyond_the_terrain_and_weights_are_one_set(name):
    problem = gaits.problem(name)
    assert problem.weights == planner.Weights()
    assert problem.duration == pytest.approx(value("fig8.duration"))
    regions = problem.terrain.regions
    assert len(regions) == 1 or problem.goal[0] > regions[-1].vertices[:, 0].min()


def gait_result(name, legs, regions, tmp_path):
    """What is said of a gait on a terrain."""
    bench = invented(tmp_path, seeds=1)
    plan = plan_of(legs, regions, terrain=terrain.builtin(name))
    bench.plan = lambda problem, label: Planned(plan, plan) if label == name else plan_pair("flat")
    return by_key(gaits.run(bench, name, 8))


def plan_pair(name):
    """A gait on a terrain with two stances on feet."""
    plan = plan_of(["wooo", "....", "wooo", "wof."], terrain=terrain.builtin(name))
    return Planned(plan, plan)


def test_what_the_paper_states_is_decided_by_the_gait(tmp_path):
    found = gait_result("flat", ["woof.", ".wooo", "woooo", "woooo"], None, tmp_path)
    assert found["fig8.start"].holds
    assert (found["fig8.feet_at_end"].ours, found["fig8.wheels_at_end"].ours) == (1, 3)
    assert not gait_result("flat", ["f....", ".wooo", "woooo", "woooo"], None, tmp_path)["fig8.start"].holds

    few = gait_result("flat-friction", ["wooo", ".woo", "wooo", "wof."], None, tmp_path)
    assert not few["fig9.more_feet"].holds
    assert few["fig9.mostly_wheels"].holds
    many = gait_result("flat-friction", ["f.f.", "f.f.", "f.f.", "...."], None, tmp_path)
    assert many["fig9.more_feet"].holds
    assert not many["fig9.mostly_wheels"].holds

    down = gait_result(
        "ramp-down", ["wof.", "wooo", "wooo", "...."], ["0112", "0112", "0112", "0000"], tmp_path
    )
    assert all(down[f"fig10.{key}"].holds for key in ("rolls_down", "crosses", "stops"))
    down = gait_result(
        "ramp-down", ["f.f.", "f.f.", "....", "wooo"], ["1122", "1122", "0000", "0000"], tmp_path
    )
    assert not any(down[f"fig10.{key}"].holds for key in ("rolls_down", "crosses", "stops"))

    up = gait_result("ramp-up", ["wof.", "....", "....", "...."], ["0011", "1111", "1111", "1111"], tmp_path)
    assert up["fig11.mixed"].holds
    assert up["fig11.feet"].holds
    up = gait_result("ramp-up", ["oooo", "oooo", "oooo", "oooo"], ["0011"] * 4, tmp_path)
    assert not up["fig11.mixed"].holds
    assert not up["fig11.feet"].holds

    feet = gait_result("stepping-stones", ["f.f.", "wooo", "....", "...."], ["1133", "0000"] * 2, tmp_path)
    assert feet["fig12.feet"].holds
    assert feet["fig12.gap"].ours == pytest.approx(20.0)
    wheels = gait_result(
        "stepping-stones", ["woof", "....", "....", "...."], ["1113"] + ["0000"] * 3, tmp_path
    )
    assert not wheels["fig12.feet"].holds


def test_times_are_compared_row_by_row(tmp_path):
    found = by_key(times.run(invented(tmp_path)))
    assert found["table2.1,1,5"].ours == pytest.approx(0.5)
    assert found["table2.3,1,10"].ours == pytest.approx(3.0)
    assert found["times.half_second"].ours == pytest.approx(0.5)
    assert found["times.grow"].holds
    assert found["times.grow"].ours == pytest.approx(2.0)
    assert not found["times.harder"].holds, "the same time is no further time"
    assert found[f"search time, row 3,2,5{APART}"].ours == pytest.approx(3.0)


def test_table_two_is_taken_from_its_report(tmp_path):
    path = report_file(tmp_path, tight=outcome(None, "failed", None, "a\nb"))
    bench = invented(tmp_path, table2=path)
    bench.time = None  # nothing is searched
    result = times.run(bench)
    found = by_key(result)
    assert found["table2.1,2,5"].ours == 2.0
    assert found["table2.1,1,5"].ours is None
    assert result.troubles == ["1,1,5: failed: b"]
    assert result.settings["source"] == str(path)


def lines(figure, name):
    """The curves and markers with this name."""
    return [line.get_xydata() for axes in figure.axes for line in axes.lines if line.get_gid() == name]


def test_the_picture_of_a_gait_shows_plan_and_run():
    plan = plan_of(["wooo", "f...", "....", "...."])
    figure = pictures.gait(plan, execution(plan, 0), "Fig. 8: flat")
    planned, run = (
        [
            (round(b.get_y() + 0.36), *b.get_bbox().intervalx, to_hex(b.get_facecolor()).upper())
            for b in axes.patches
        ]
        for axes in figure.axes
    )
    assert [bar[0] for bar in planned] == [0, 0, 1, 1, 2, 3]
    assert [bar[3] for bar in planned[:4]] == [SWING, WHEEL, SWING, FOOT]
    assert np.allclose([bar[1:3] for bar in planned[:2]], [(0, 0.3), (0.3, 1.2)])
    assert [(bar[0], bar[3]) for bar in run] == [(bar[0], bar[3]) for bar in planned]
    assert np.allclose([bar[1:3] for bar in run], [bar[1:3] for bar in planned], atol=0.02)
    assert figure.axes[0].get_title(loc="left") == "Fig. 8: flat"


def test_the_picture_of_ways_has_the_papers_ends(tmp_path):
    figure = speed.run(invented(tmp_path, seeds=1)).pictures["fig13.png"]()
    for case, end in (("feet", 1.5), ("both", 3.0), ("friction", 3.0)):
        assert lines(figure, f"{case} paper")[0] == pytest.approx(
            np.array([[4.5, value(f"{case}.distance")]])
        )
        assert lines(figure, f"{case} planned")[0][-1] == pytest.approx([4.5, end])
        assert lines(figure, f"{case} simulated")[0][0] == pytest.approx([0.0, 0.0], abs=0.011)
    names = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert names[:3] == [name for name, *_ in speed.CASES.values()]


def test_the_picture_of_transport_has_both_works_of_each_case(tmp_path):
    figure = transport.run(invented(tmp_path, seeds=1)).pictures["transport.png"]()
    for name, *_ in transport.CASES.values():
        absolute, positive = (lines(figure, f"{name} {what}")[0] for what in ("absolute", "positive"))
        assert positive[-1, 1] == pytest.approx(0.5 * absolute[-1, 1])
