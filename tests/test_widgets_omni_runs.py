"""Chapter 12's widgets and drawings: what is drawn is what the runs hold."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from matplotlib.colors import to_hex

from wfbook.omni.habits import Habits
from wfbook.omni.machine import Mode
from wfbook.omni.robot import NOMINAL_HEIGHT
from wfbook.omni.scenarios import SCENARIOS
from wfbook.omni.simulate import CONTROLLERS, OmniRun
from wfbook.omni.waves import PEAK, wave_height
from wfbook.view.drawings import omni_runs as drawings
from wfbook.view.style import HAND, PLANNED, SWING
from wfbook.view.widgets.omni_runs import (
    GROUNDS,
    HABITS,
    WHO,
    Experiment,
    HabitBench,
    ScenarioBench,
    Trip,
    WavesBench,
    done,
    ending,
    travelled,
)

FAST = Trip(speed=1.5)
BLIND = Trip(speed=1.5, delay_ms=24.0, habits=Habits(predicts=False))


@pytest.fixture(scope="module")
def run() -> OmniRun:
    """One real run for all tests."""
    return travelled(FAST)


@pytest.fixture(scope="module")
def fallen() -> OmniRun:
    """One that falls early."""
    return travelled(BLIND)


def simulator(run, told_of):
    def simulate(asked, told):
        told(0.5, 2.0)
        told_of.append(asked)
        return run

    return simulate


def lines(picture, gid):
    return [line for axes in picture.axes for line in axes.lines if line.get_gid() == gid]


def test_a_trip_is_what_it_says(run, fallen):
    assert not run.events and run.p[:, :, 2].max() > 0.9 * PEAK
    assert run.pose[-1, 0] - run.pose[0, 0] == pytest.approx(2.8, abs=0.05)
    assert fallen.meta["delay"] == 0.024 and "fallen" in ending(fallen)
    assert ending(run) == "to the end"
    assert str(BLIND) == "whole body, 1.50 m/s, 24 ms, without predict"
    assert str(Trip("ik-true", low=True, noise=2.0, payload=1.5)) == "arm, true trunk low, noise × 2, 1.5 kg"
    assert set(WHO) == set(CONTROLLERS)
    assert set(HABITS.values()) == set(vars(Habits()))


@pytest.mark.parametrize("ground", GROUNDS)
def test_every_ground_is_simulated_as_it_is_called(ground, monkeypatch):
    asked = []
    monkeypatch.setattr("wfbook.omni.simulate.run", lambda *a, **k: asked.append((a, k)))
    travelled(Trip("ik-level", low=True, ground=ground, count=3, noise=2.0, delay_ms=4.0, payload=1.0))
    (terrain, course), options = asked[0]
    assert options["target"].height == pytest.approx(NOMINAL_HEIGHT - PEAK / 2)
    assert options["target"].hand[2] == pytest.approx(0.92)
    assert (options["delay"], options["payload"], options["controller"]) == (0.004, 1.0, "ik-level")
    assert options["noise"].position == pytest.approx(1e-3)
    assert ("push" in options) == (ground == "a push")
    assert (course[0][1][2] != 0.0) == (ground == "a circle")
    assert (terrain.name == "3 waves") == (ground == "one wave")


def test_the_controls_of_the_waves_choose_the_trip(run):
    asked = []
    bench = WavesBench(simulator=simulator(run, asked))
    assert not bench.pictures and "press Simulate" in bench.status.value
    bench.controller.value, bench.trunk.value, bench.count.value = "ik-true", True, 7
    bench.speed.value, bench.delay.value, bench.noise.value, bench.payload.value = 1.25, 10.0, 3.0, 2.0
    bench.button.click()
    wanted = Trip("ik-true", True, count=7, speed=1.25, delay_ms=10.0, noise=3.0, payload=2.0)
    assert asked == [wanted] and bench.run is run
    assert 'title="replay"' in bench.replay.value
    cells = bench.row(wanted, run)
    assert cells[:7] == ("arm, true trunk", "low", "7", "1.25", "10 ms", "× 3", "2.0 kg")
    assert all(cell in bench.history.value for cell in cells)
    assert f"{1e3 * run.metrics['hand_height_std_m']:.1f}" in cells
    bench.button.click()
    assert len(asked) == 1  # it is known


def test_heights_of_runs_over_the_same_waves_are_drawn_together(run, fallen):
    bench = WavesBench({FAST: run, Trip(count=3): run}, simulator(fallen, []))
    assert not lines(bench.pictures["height"], str(Trip(count=3)))  # another number of waves
    bench.speed.value, bench.delay.value = 1.5, 24.0
    assert bench.run is None and lines(bench.pictures["height"], str(FAST))
    bench.button.click()
    top, magnified = lines(bench.pictures["height"], str(FAST))
    np.testing.assert_allclose(top.get_ydata(), run.hand[:, 2])
    np.testing.assert_allclose(magnified.get_ydata(), 1e3 * (run.hand - run.hand_ref)[:, 2])
    assert top.get_color() == HAND
    name = str(bench.asked)
    assert lines(bench.pictures["height"], f"{name} falls")
    assert "fallen" in bench.status.value and "fallen" in bench.history.value


def test_the_ground_is_drawn_as_it_is(run):
    picture = drawings.heights({"a run": run})
    (ground,) = [c for c in picture.axes[0].collections if c.get_gid() == "ground"]
    x, z = ground.get_paths()[0].vertices.T
    crest = x[z.argmax()]
    assert z.max() == pytest.approx(PEAK, abs=1e-3) and crest == pytest.approx(1.15, abs=0.03)
    assert wave_height(crest) == pytest.approx(PEAK, abs=1e-3)


def test_habits_are_left_out_one_by_one(run, fallen):
    asked = []
    known = {replace(FAST, delay_ms=12.0): run}
    bench = HabitBench(known, simulator(fallen, asked))
    assert lines(bench.pictures["errors"], str(next(iter(known))))
    bench.ground.value = "a push"
    assert not bench.pictures
    for label, name in HABITS.items():
        bench.switches[label].value = False
        assert bench.asked.habits == Habits(**{name: False})
        bench.switches[label].value = True
    bench.ground.value = "one wave"
    bench.switches["predict"].value, bench.delay.value = False, 24.0
    bench.noise.value, bench.payload.value = 1.0, 0.5
    bench.button.click()
    assert asked == [Trip(delay_ms=24.0, noise=1.0, payload=0.5, habits=Habits(predicts=False))]
    cells = bench.row(asked[0], fallen)
    assert cells[:5] == ("one wave", "predict", "24 ms", "× 1", "0.5 kg") and "fallen" in cells[-1]
    error = lines(bench.pictures["errors"], str(asked[0]))[0].get_ydata()
    np.testing.assert_allclose(error[1:], np.linalg.norm(fallen.hand - fallen.hand_ref, axis=1)[1:] * 1e3)
    cross = lines(bench.pictures["errors"], f"{asked[0]} ends")[0].get_xydata()[0]
    assert cross[0] == pytest.approx(fallen.events[0][0])


def test_an_error_is_shown():
    def broken(asked, told):
        raise RuntimeError("no such robot")

    for bench in (
        WavesBench(simulator=broken),
        HabitBench(simulator=broken),
        ScenarioBench(simulator=broken),
    ):
        with pytest.raises(RuntimeError):
            bench.simulate()
        bench.button.click()
        assert "no such robot" in bench.status.value and not bench.button.disabled


def test_every_experiment_of_the_paper_can_be_asked_for(run):
    asked = []
    bench = ScenarioBench(simulator=simulator(run, asked))
    for name, scenario in SCENARIOS.items():
        bench.name.value = name
        assert scenario.where in bench.status.value
    bench.name.value, bench.delay.value, bench.payload.value = "turn", 6.0, 1.0
    bench.button.click()
    assert asked == [Experiment("turn", 6.0, 0.0, 1.0)]
    assert "turn, 6 ms, 1.0 kg" in bench.history.value
    drawn = lines(bench.pictures["pose"], "z")[0].get_ydata()
    np.testing.assert_allclose(drawn, 1e3 * (run.hand - run.hand_ref)[:, 2])
    way = lines(bench.pictures["way"], "robot")[0].get_xydata()
    np.testing.assert_allclose(way, run.qpos[:, :2])


def test_an_experiment_gets_what_disturbs_it(monkeypatch):
    asked = {}
    monkeypatch.setitem(
        SCENARIOS, "crab", replace(SCENARIOS["crab"], run=lambda **options: asked.update(options))
    )
    done(Experiment("crab", 8.0, 2.0, 1.5))
    assert (asked["delay"], asked["payload"]) == (0.008, 1.5) and asked["noise"].angle == pytest.approx(2e-4)


def test_turns_of_the_hand_are_from_where_it_should_point(run):
    about = pin.utils.rotate("z", 0.8)
    turned = replace(
        run,
        pose=run.pose + np.array([0.0, 0.0, 0.8]),
        hand_rotation=about @ pin.exp3(np.array([0.0, 0.2, 0.0])) @ run.hand_rotation_ref,
        hand_rotation_ref=about @ run.hand_rotation_ref,
    )
    found = drawings.hand_turns(turned)
    np.testing.assert_allclose(found, np.tile([0.0, 0.2, 0.0], (len(run.t), 1)), atol=1e-9)
    drawn = lines(drawings.hand_pose(turned), "about y")[0].get_ydata()
    np.testing.assert_allclose(drawn, np.degrees(0.2))


def test_who_does_the_work_is_read_from_the_joints(run):
    picture = drawings.shares({"a run": run})
    height, pitch, room = lines(picture, "a run")
    np.testing.assert_allclose(height.get_ydata(), run.qpos[:, 2])
    trunk = [pin.rpy.matrixToRpy(pin.Quaternion(*q).toRotationMatrix())[1] for q in run.qpos[:, 3:7]]
    np.testing.assert_allclose(pitch.get_ydata(), np.degrees(trunk), atol=1e-6)
    assert room.get_ydata()[0] == pytest.approx(np.degrees(drawings.arm_room(run)[0]))
    assert 20.0 < room.get_ydata()[0] < 60.0


def test_modes_and_swings_are_drawn_as_long_as_they_last(run):
    n = len(run.t)
    mode, stance = np.zeros(n, np.int8), np.ones((n, 4), bool)
    mode[50:60], mode[60:120] = Mode.STOPPING, Mode.LEGGED
    stance[70:100, 1] = False
    picture = drawings.modes(replace(run, mode=mode, stance=stance))
    spans = {}
    for axes in picture.axes:
        for bar in axes.patches:
            span = (bar.get_x(), bar.get_x() + bar.get_width(), to_hex(bar.get_facecolor()).upper())
            spans.setdefault(bar.get_gid(), []).append(span)
    assert spans["legged"] == [(pytest.approx(run.t[60]), pytest.approx(run.t[120]), PLANNED)]
    assert [span[0] for span in spans["wheeled"]] == pytest.approx([0.0, run.t[120]])
    swings = [span for span in spans["FR"] if span[2] == SWING]
    assert swings == [(pytest.approx(run.t[70]), pytest.approx(run.t[100]), SWING)]
    assert len(spans["FL"]) == 1
    covered = sum(last - first for mode in Mode for first, last, _ in spans.get(mode.name.lower(), []))
    assert covered == pytest.approx(run.t[-1] - run.t[0])


def test_what_a_tilt_makes_of_the_hands_height_is_a_lever(run):
    qpos, angles = run.qpos.copy(), np.linspace(-0.3, 0.3, len(run.t))
    qpos[:, 3:7] = np.column_stack([np.cos(angles / 2), 0 * angles, np.sin(angles / 2), 0 * angles])
    pitched = replace(run, qpos=qpos, pose=np.zeros_like(run.pose))
    away = run.hand_ref - qpos[:, :3]
    expected = -away[:, 0] * np.sin(angles) + away[:, 2] * (np.cos(angles) - 1.0)
    drawn = lines(drawings.levers(pitched), "from the tilt")[0].get_ydata()
    np.testing.assert_allclose(drawn, 1e3 * expected, atol=1e-9)


def test_clocks_are_drawn_as_given():
    t = np.arange(100)
    clocks = drawings.clocks(t, {"slow": t // 20, "mid": t // 2, "fast": t}, t[t % 20 == 0])
    assert len(lines(clocks, "plan")) == 5
    np.testing.assert_array_equal(lines(clocks, "mid")[0].get_ydata(), t // 2)
