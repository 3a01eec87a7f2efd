"""Part II of the comparison: what is kept of a run, what is run once, what is decided and drawn."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from paper_cases import Invented, by_key, drive, invented

from wfbook.omni import scenarios
from wfbook.omni.robot import HAND_RPY
from wfbook.omni.scenarios import SCENARIOS
from wfbook.omni.simulate import Noise
from wfbook.paper import hardware, level, solving, waves
from wfbook.paper.bench import DELAY, Bench
from wfbook.paper.drives import SHIFT, Drive, hand_records, over
from wfbook.paper.options import Options
from wfbook.paper.store import Store
from wfbook.quoted import value
from wfbook.view import paper_omni
from wfbook.view.style import HAND, PLANNED


@pytest.fixture(scope="module")
def run():
    target = scenarios.held_in_the_world()
    return scenarios.on_the_floor([(0.6, [0.0, 0.0, 0.25])], target=target)


def test_what_is_kept_of_a_run(run, tmp_path):
    kept = Drive.of(run)
    np.testing.assert_array_equal(kept.hand, run.hand[::2])
    np.testing.assert_allclose(kept.rpy[0], HAND_RPY, atol=0.01)
    # The hand keeps its direction in the world, so in the trunk's axes it turns as much as the trunk, back.
    np.testing.assert_allclose(kept.base_rpy[:, 2], HAND_RPY[2] - kept.yaw, atol=0.01)
    np.testing.assert_allclose(kept.base_rpy_ref[:, 2], HAND_RPY[2] - run.pose[::2, 2], atol=1e-3)
    np.testing.assert_allclose(kept.legs, run.qpos[::2][:, [7, 8, 11, 12, 15, 16, 19, 20]])
    assert np.abs(kept.legs - kept.legs_ref).max() < 0.05
    assert np.all(kept.wheels[0] == 0.0) and np.all(kept.arm_margin > 0.0)
    kept.save(tmp_path / "drive.npz")
    back = Drive.load(tmp_path / "drive.npz")
    assert all(np.array_equal(getattr(back, name), getattr(kept, name)) for name in Drive.ARRAYS)
    assert back.metrics == kept.metrics and back.meta == kept.meta


def test_a_scenario_is_run_once_for_each_seed(run, monkeypatch, tmp_path):
    asked = []

    def simulated(**options):
        asked.append({name: entry for name, entry in options.items() if name != "progress"})
        ended = [(0.1, "fallen")] if options["seed"] == 1 else []
        metrics = run.metrics | {"finished": not ended, "events": ["0.10 s: fallen"]}
        return replace(run, events=ended, metrics=metrics, meta=run.meta | {"seed": options["seed"]})

    monkeypatch.setitem(SCENARIOS, "waves", replace(SCENARIOS["waves"], run=simulated))
    bench = Bench(Store(tmp_path, "stamp"), Options(seeds=2))
    runs = bench.drive("waves", "five", count=5)
    assert asked == [{"delay": DELAY, "noise": Noise(), "seed": seed, "count": 5} for seed in (0, 1)]
    assert bench.troubles == ["five: 0.10 s: fallen, seed 1"]
    again = bench.drive("waves", "another name", count=5)
    assert len(asked) == 2
    assert [one.metrics for one in runs] == [other.metrics for other in again]
    assert len(bench.drive("waves", "five", 1, count=5)) == 1 and len(asked) == 2
    bench.drive("waves", "three", count=3)
    Bench(Store(tmp_path, "stamp"), Options(seeds=2, state="true")).drive("waves", "five", count=5)
    assert len(asked) == 6 and asked[-1]["noise"] is None


def test_times_are_measured_once(monkeypatch, tmp_path):
    monkeypatch.setattr(solving, "REPEATS", 2)
    monkeypatch.setattr(solving, "TICKS", 5)
    bench = Bench(Store(tmp_path, "stamp"))
    found = bench.solve("times")
    assert found["states"] == value("omni.states") and found["precision"] == value("omni.precision")
    assert len(found["cold"]) == 2 and min(found["cold"]) > 0.0
    assert found["cold_far_iterations"] > found["cold_iterations"] >= 1
    assert found["warm"] == sorted(found["warm"])
    monkeypatch.setattr(solving, "measure", lambda: pytest.fail("measured again"))
    assert bench.solve("times") == found


def test_figures_of_the_hand_are_those_of_the_runs():
    runs = [drive(seed) for seed in range(3)]
    found = {record.paper: record for record in hand_records("fixed", runs)}
    assert found["fixed.max"].ours == pytest.approx(1.1e-3)
    assert (found["fixed.max"].low, found["fixed.max"].high) == pytest.approx((1e-3, 1.2e-3))
    assert found["fixed.pitch"].ours == pytest.approx(SHIFT, abs=1e-3)
    assert found["fixed.roll"].ours == pytest.approx(-np.pi / 2, abs=1e-3)
    assert found["fixed.mean"].proof == "ddp, seeds 0, 1, 2, measured with noise"
    assert over(runs, lambda run: run.meta["seed"]) == (1.0, [0.0, 1.0, 2.0])


def test_waves_compare_both_baselines_and_say_what_is_impossible(tmp_path):
    result = waves.run(invented(tmp_path, seeds=2))
    found = by_key(result)
    assert found["waves.ik_std"].ours == pytest.approx(1.05 * 0.05 / np.sqrt(2), rel=0.02)
    assert found["waves.calmer"].holds and found["waves.calmer"].ours == pytest.approx(50.0)
    assert found["the same, trunk's pose known"].ours == pytest.approx(2.0)
    assert "need at least 8.9 mm" in found["waves.max"].proof
    assert "impossible" in result.notes[0]
    for count in waves.COUNTS[1:]:
        for name in waves.CASES.values():
            assert f"hand's height, largest error, {count} waves, {name}" in found


def test_statements_are_false_when_they_are(monkeypatch, tmp_path):
    def still(self, name, label, seeds=None, **options):
        run = drive(wobble=0.2)
        return [replace(run, wheels=0.0 * run.wheels, legs=0.0 * run.legs, yaw=0.3 * run.t, base_rpy=run.rpy)]

    monkeypatch.setattr(Invented, "drive", still)
    bench = invented(tmp_path)
    for experiment in (level.fixed, hardware.turn, hardware.squat):
        said = [record for record in experiment(bench).records if record.holds is not None]
        held = [record.paper for record in said if record.holds]
        assert said and held in ([], ["turn.legs"])


def test_an_arm_at_its_limit_is_told(monkeypatch, tmp_path):
    run = drive()
    monkeypatch.setattr(
        Invented, "drive", lambda self, *words, **options: [replace(run, arm_margin=0.0 * run.t - 0.01)]
    )
    assert by_key(hardware.turn(invented(tmp_path)))["turn.limit"].holds


def lines_of(figure):
    return {line.get_gid(): line for axes in figure.axes for line in axes.lines if line.get_gid()}


def test_curves_are_those_of_the_run():
    run = drive()
    drawn = lines_of(
        paper_omni.hand(run, dict.fromkeys(("height", "roll", "pitch", "yaw"), (0.9, 0.1)), -1.5, True)
    )
    np.testing.assert_allclose(drawn["height"].get_ydata(), run.hand[:, 2])
    np.testing.assert_allclose(drawn["pitch"].get_ydata(), run.rpy[:, 1] - 1.5)
    np.testing.assert_allclose(drawn["RL wheel"].get_ydata(), 100.0 * run.wheels[:, 2])
    assert drawn["height in the paper"].get_ydata() == [0.9]
    drawn = lines_of(paper_omni.legs(run))
    np.testing.assert_allclose(drawn["FR knee planned"].get_ydata(), run.legs_ref[:, 3])
    np.testing.assert_allclose(drawn["RL hip measured"].get_ydata(), run.legs[:, 4])
    assert to_hex(drawn["FR knee planned"].get_color()) == PLANNED.lower()
    drawn = lines_of(paper_omni.pose(run))
    np.testing.assert_allclose(drawn["y"].get_ydata(), 1e3 * (run.hand - run.hand[0])[:, 1])
    np.testing.assert_allclose(drawn["yaw"].get_ydata(), run.base_rpy[:, 2])
    drawn = lines_of(paper_omni.squat(run))
    np.testing.assert_allclose(drawn["trunk"].get_ydata(), run.trunk[:, 2])
    assert to_hex(drawn["hand"].get_color()) == HAND.lower()


def test_heights_are_magnified_for_those_that_hold_still():
    shown = {"one": drive(), "two": drive(wobble=0.05), "three": drive(wobble=0.002)}
    figure = paper_omni.heights(shown, 5, SHIFT)
    top, middle = figure.axes[:2]
    assert np.ptp(middle.get_ylim()) < 0.2 * np.ptp(top.get_ylim())
    for name, run in shown.items():
        np.testing.assert_allclose(lines_of(figure)[name].get_ydata(), run.hand[:, 2])
