"""Chapter 8's widgets, driven by their traits; what is drawn is compared with the runs."""

from dataclasses import replace

import handmade
import numpy as np
import pytest

from wfbook import planner
from wfbook import terrain as ground
from wfbook.lean import Lean
from wfbook.quoted import value
from wfbook.runs import Run
from wfbook.study import here
from wfbook.tracking import Habits
from wfbook.view.drawings import terrain_runs as drawings
from wfbook.view.widgets.robustness import BASE, LEVELS, Ahead, Margins, SmallStudy, Windows, small_study
from wfbook.view.widgets.terrain_runs import JOURNEYS, Journey, TerrainRuns, TrackerBench, travelled

SHORT, FAR, LONG = JOURNEYS


@pytest.fixture(scope="module")
def run() -> Run:
    """One real run for all tests."""
    return travelled(Journey("flat", habits=Habits(feels=True)))


@pytest.fixture(scope="module")
def fallen() -> Run:
    """One that falls early."""
    return travelled(Journey("flat", feet_only=True, habits=Habits(interpolates=False)))


def simulator(run, told_of):
    def simulate(asked, told):
        told(0.5, 2.0)
        told_of.append(asked)
        return run

    return simulate


def lines(picture, gid):
    return [line for axes in picture.axes for line in axes.lines if line.get_gid() == gid]


def test_every_stored_plan_is_a_journey():
    found = {
        Journey(name, way, feet).stored
        for name in ground.BUILTIN_NAMES
        for way in JOURNEYS
        for feet in (False, True)
    }
    assert found - {None} == set(planner.stored.__globals__["names"]())
    friction = Journey("flat-friction", SHORT, feet_only=True).plan()
    assert friction.terrain.regions[0].rolling_resistance > 0.0
    with pytest.raises(ValueError, match="no plan is stored for ramp-up"):
        Journey("ramp-up", FAR).plan()


def test_a_terrain_shows_its_plan_until_it_is_simulated(run):
    asked = []
    bench = TerrainRuns(simulator=simulator(run, asked))
    assert bench.run is None and 'title="replay"' in bench.replay.value and not asked
    flat_gait = bench.views["gait"].value
    bench.terrain.value = "ramp-up"
    assert bench.views["gait"].value != flat_gait
    bars = [p for p in bench.pictures["gait"].axes[0].patches if p.get_gid() == "FL swing"]
    plan = planner.stored("ramp-up")
    starts = plan.slot_duration * np.flatnonzero(np.diff(plan.S[0], prepend=0) == 1)
    assert [bar.get_x() for bar in bars] == pytest.approx(starts.tolist())
    bench.terrain.value = "flat"
    bench.button.click()
    assert asked == [Journey("flat")] and bench.run is run
    bench.button.click()
    assert len(asked) == 1


def test_where_no_plan_is_stored_it_says_how_to_find_one(run):
    bench = TerrainRuns(simulator=simulator(run, []))
    bench.terrain.value, bench.ends.value = "ramp-down", True
    assert bench.asked is None and bench.button.disabled and not bench.pictures
    assert "python -m wfbook run ramp-down --feet-only" in bench.status.value
    bench.button.click()
    assert not bench.results
    with pytest.raises(ValueError, match="no plan"):
        bench.simulate()
    bench.terrain.value = "flat"
    assert not bench.button.disabled and bench.pictures["gait"]


def test_the_table_stands_beside_the_paper(run):
    metrics = run.metrics
    long_run = replace(run, metrics=metrics | {"cot_abs": 0.1234})
    bench = TerrainRuns({Journey("flat"): run, Journey("flat", LONG): long_run, Journey("flat", FAR): run})
    table = bench.history.value
    assert f"{metrics['cot_abs']:.3f}" in table and "0.123" in table
    assert f"{value('both.cot'):.3f}" in table and f"{value('both.speed'):.2f}" in table
    short, far = (bench.row(Journey("flat", way), run) for way in (SHORT, FAR))
    assert f"{metrics['cot_abs']:.3f}" in short and "–" in short
    assert f"{metrics['cot_abs']:.3f}" not in far  # it does not end at rest
    friction = bench.row(Journey("flat-friction", FAR), run)
    assert f"{value('friction.speed'):.2f}" in friction


def test_a_run_draws_its_work_and_its_way(run):
    bench = TerrainRuns({Journey("flat"): run})
    way = bench.pictures["work"].axes[1].lines[0].get_ydata()
    assert way[-1] == pytest.approx(run.metrics["distance_m"], abs=1e-3)
    work = lines(bench.pictures["work"], "on feet and wheels absolute")[0].get_ydata()
    assert (np.diff(work) >= 0.0).all()
    cost = work[-1] / (13.3 * 9.81 * run.metrics["distance_m"])
    assert cost == pytest.approx(run.metrics["cot_abs"], rel=0.03)
    assert f"{run.metrics['cot_abs']:.3f}" in bench.status.value


def test_the_trackers_habits_are_what_is_asked(run, fallen):
    asked = []
    bench = TrackerBench({Journey("flat", feet_only=True): run}, simulator(fallen, asked))
    assert bench.run is run and "without nothing" in bench.status.value
    bench.switches["interpolate"].value = False
    assert bench.run is None
    bench.leans.value, bench.delay.value, bench.push.value = "nothing", 12.0, -20.0
    bench.button.click()
    journey = asked[0]
    assert journey.habits == Habits(interpolates=False, leans="nothing")
    assert (journey.delay_ms, journey.push) == (12.0, -20.0)
    assert bench.run is fallen and "fell at" in bench.status.value
    assert "interpolate, leaning" in bench.history.value and "-20 N" in bench.history.value
    error = lines(bench.pictures["tracking"], "y")[0].get_ydata()
    np.testing.assert_allclose(error, 1e3 * (fallen.com - fallen.com_ref)[:, 1])
    bench.plan.value = "ramp-down"
    assert bench.asked.terrain == "ramp-down" and not bench.asked.feet_only


def test_an_error_is_shown(run):
    def broken(asked, told):
        raise RuntimeError("no such robot")

    bench = TrackerBench(simulator=broken)
    with pytest.raises(RuntimeError):
        bench.simulate()
    bench.button.click()
    assert "no such robot" in bench.status.value and not bench.button.disabled


def test_margins_are_polished_away(run):
    panel = Margins(simulator=simulator(run, []))
    panel.plan.value = "flat-feet"
    assert not lines(panel.pictures["in hand"], "without load")
    panel.switches["load"].value = False
    assert panel.asked == ("flat-feet", frozenset({"load"}))
    grips = [p for p in panel.pictures["in hand"].axes[0].patches if p.get_gid() == "without load"]
    assert len(grips) == 1
    room = lines(panel.pictures["in hand"], "all margins")[0].get_ydata()
    assert room.min() > 0.0
    panel.button.click()
    assert "load" in panel.history.value and "tracking" in panel.pictures


def test_a_small_study_runs_what_is_missing():
    content, ran = here.plan_file(handmade.stand(2)), []

    def runner(study, finished, told):
        for done, (key, (_, case, _)) in enumerate(study.cases.items(), 1):
            if key not in finished:
                ran.append(case.values)
                upright = case.values["push"] < 50.0
                row = {"error": None, "upright": upright, "base_rms_m": 0.01}
                finished[key] = row | {"planned_distance_m": 0.0, "distance_m": 0.0}
                told(here.report(study, finished), done, 9)

    panel = SmallStudy(content, runner=runner)
    assert "9 of 9 runs are missing" in panel.status.value
    panel.button.click()
    assert len(ran) == 9 and "All runs are done" in panel.status.value
    texts = [text.get_text() for text in panel.pictures["map"].axes[0].texts]
    assert texts == ["1/1"] * 6 + ["0/1"] * 3
    assert all(values["push_start"] == BASE["push_start"] for values in ran)
    panel.across.value = "delay"
    missing = "6 of 9"  # a push to the left at the usual delay is known
    assert missing in panel.status.value
    panel.button.click()
    assert len(ran) == 15
    panel.down.value = "delay"
    assert "two different" in panel.status.value and not panel.pictures
    panel.button.click()
    assert len(ran) == 15


def test_a_study_here_is_what_the_command_runs():
    content = here.plan_file(handmade.stand(1))
    study = small_study(content, "push", "delay", {"push": (0.0, 10.0), "delay": (9.0,)})
    finished, told = {}, []
    report = here.run(study, finished, lambda report, done, total: told.append((done, total)))
    assert told == [(1, 2), (2, 2)] and len(finished) == 2
    assert [cell["upright"] for cell in report["grids"][0]["cells"]] == [1, 1]
    here.run(study, finished, lambda *_: pytest.fail("nothing was missing"))
    assert set(LEVELS) == {axis for axis in LEVELS if len(LEVELS[axis]) == 3}


def planned_ahead(run):
    records = [
        {"slots": [0, 6], "status": "budget", "gap": 0.2, "planning_s": 2.0, "available_s": None},
        {"slots": [3, 9], "status": "optimal", "gap": 0.0, "planning_s": 1.2, "available_s": 0.89},
    ]
    records = [record | {"correction_m": 0.0, "share": 1.3} for record in records]
    ahead = {"windows": records, "late": 0, "waited_slots": 0}
    return replace(run, metrics=run.metrics | {"replanning": ahead})


def bars(picture, gid):
    return [(p.get_x(), p.get_width()) for p in picture.axes[0].patches if p.get_gid() == gid]


def test_windows_cover_the_way_once(run):
    asked = []
    panel = Windows(simulator(planned_ahead(run), asked))
    for commit in (1, 2, 3, 5):
        panel.commit.value = commit
        executed = bars(panel.pictures["windows"], "executed")
        ends = np.cumsum([width for _, width in executed])
        assert [x for x, _ in executed] == pytest.approx([0.0, *ends[:-1]])
        assert ends[-1] == pytest.approx(11 * 0.3)
        assert np.diff([x for x, _ in executed]) == pytest.approx([commit * 0.3] * (len(executed) - 1))
        assert 11 - (len(executed) * commit) < 2  # not enough left for another window
    panel.window.value = 4
    assert panel.asked is None and "longer than" in panel.status.value
    panel.button.click()
    assert not asked
    panel.commit.value, panel.window.value = 3, 6
    panel.button.click()
    assert asked == [Ahead(6, 3, 12)]
    taken = lines(panel.pictures["windows"], "taken")[0].get_xdata()
    assert np.ptp(taken) == pytest.approx(1.2)
    assert "0.89 s" in panel.windows.value and "1.20 s" in panel.history.value


def test_errors_end_where_robots_fall(run, fallen):
    picture = drawings.errors({"stands": run, "falls": fallen})
    assert not lines(picture, "stands falls")
    cross = lines(picture, "falls falls")[0].get_xydata()[0]
    assert cross[0] == pytest.approx(fallen.t[-1])
    assert cross[1] == pytest.approx(1e3 * np.linalg.norm((fallen.com - fallen.com_ref)[-1]))


def test_normals_turn_over_the_crest_as_far_as_ends_are_round():
    picture = drawings.footing(ground.builtin("ramp-down"))
    for gid, radius in (("foot", 0.02), ("wheel", 0.04)):
        x, slope = lines(picture, gid)[0].get_data()
        turning = x[(slope < -0.2) & (slope > -11.8)]
        assert np.ptp(turning) == pytest.approx(1e3 * radius * np.sin(np.radians(12.0)), rel=0.1)
    assert lines(picture, "region")[0].get_ydata()[[0, -1]] == pytest.approx([0.0, -12.0])


def test_leans_are_drawn_as_the_tracker_has_them():
    plan = planner.stored("ramp-down")
    picture = drawings.leans(plan)
    for by in ("hips", "contacts", "nothing"):
        pitch = lines(picture, by)[0].get_ydata()[20]
        assert pitch == pytest.approx(-np.degrees(Lean(plan, by).at(plan.t[20])[0][1]))
    assert lines(picture, "ground")[0].get_ydata()[-1] == pytest.approx(-12.0)
    assert lines(picture, "nothing")[1].get_ydata().min() < 0.0 < lines(picture, "hips")[1].get_ydata().min()
