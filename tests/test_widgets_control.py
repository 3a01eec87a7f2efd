"""Chapter 6's widgets, driven by their traits; what is drawn is compared with the physics."""

import numpy as np
import pytest

from wfbook.go1_dynamics import GRAVITY
from wfbook.reference import Gains, delay_margin
from wfbook.view.drawings import control as drawings
from wfbook.view.widgets.control import (
    CONSTRAINTS,
    MOTIONS,
    TASKS,
    Experiment,
    LateFeedback,
    OneProgram,
    Setting,
    gains_without,
    simulated,
)


@pytest.fixture(scope="module")
def runs():
    """Two short runs for all tests: one that stands, one that falls early."""
    stands = simulated(Setting("stand on four feet", push=50.0))
    falls = simulated(Setting("stand on a foot and three wheels", frozenset({"friction (42)"}), push=40.0))
    return {False: stands, True: falls}


@pytest.fixture
def experiment(runs):
    told = []

    def simulator(setting, progress):
        progress(0.5, 2.0)
        told.append(setting)
        return runs[bool(setting.left_out)]

    widget = Experiment(simulator=simulator)
    widget.told = told
    return widget


@pytest.fixture
def one():
    return OneProgram()


def drawn(picture, gid):
    """The data of everything drawn under a name."""
    return [line.get_xydata() for axes in picture.axes for line in axes.lines if line.get_gid() == gid]


def test_the_square_is_where_newton_puts_it(one):
    one.board.move("wanted", 3.0, -1.0)
    total = one.command.forces.sum(axis=0) / one.stance.robot.mass + GRAVITY
    np.testing.assert_allclose(one.got, total, atol=1e-6)
    np.testing.assert_allclose(drawn(one.board.picture, "got")[0][0], total[:2], atol=1e-6)
    np.testing.assert_allclose(drawn(one.board.picture, "wanted")[0][0], [3.0, -1.0])
    np.testing.assert_allclose(one.got[:2], [3.0, -1.0], atol=0.05)


def test_forces_stay_in_the_drawn_pyramids(one):
    one.mu.value = 0.4
    one.board.move("wanted", 5.0, 5.0)
    panels = one.pictures["answer"].axes[:4]
    for axes in panels:
        pyramid = next(p for p in axes.patches if p.get_gid() == "pyramid").get_path()
        force = next(line for line in axes.lines if line.get_gid() == "force").get_xydata()[0]
        assert pyramid.contains_point(force, radius=-0.1) or pyramid.contains_point(force, radius=0.1)
    assert any("friction" in line for line in one.limits) and "friction" in one.status.value


def test_without_friction_they_leave_them(one):
    one.mu.value = 0.2
    one.board.move("wanted", 0.0, 6.0)
    assert one.got[1] <= 0.2 * (9.81 + one.got[2]) + 0.01
    one.switches["friction (42)"].value = False
    assert one.got[1] > 4.0
    assert "more friction than there is" in one.status.value


def test_wheels_go_sideways_only(one):
    one.legs.value = "four wheels"
    one.board.move("wanted", 4.0, 2.0)
    np.testing.assert_allclose(one.got[:2], [0.0, 2.0], atol=0.05)
    one.legs.value = "one foot (FL), three wheels"
    assert one.got[0] > 1.0


def test_weak_motors_limit_a_jump(one):
    one.upwards.value = 40.0
    assert one.got[2] == pytest.approx(40.0, abs=0.5)
    one.motors.value = 30.0
    bars = [bar.get_height() for bar in one.pictures["answer"].axes[4].patches]
    assert one.got[2] < 30.0 and max(bars) == pytest.approx(1.0, abs=1e-6)
    assert "torque limit" in one.status.value
    one.motors.value = 100.0
    assert one.got[2] == pytest.approx(40.0, abs=0.5), "the motors are themselves again"


def test_without_the_attitude_task_the_trunk_pays(one):
    one.board.move("wanted", 5.0, 0.0)
    level = np.linalg.norm(one.command.acceleration[3:6])
    one.switches["attitude"].value = False
    assert np.linalg.norm(one.command.acceleration[3:6]) > 5.0 * level + 1.0


def test_without_the_com_task_nothing_moves_it(one):
    one.switches["CoM"].value = False
    one.board.move("wanted", 5.0, 0.0)
    assert np.linalg.norm(one.got) < 0.5


def test_the_delay_slider_makes_an_error_grow():
    late = LateFeedback()
    (early,) = drawn(late.pictures["error"], "error")
    assert np.abs(early[-100:, 1]).max() < 0.01
    assert late.margin == delay_margin(640.0, 50.0)
    late.delay.value = 30.0
    (grown,) = drawn(late.pictures["error"], "error")
    assert np.abs(grown[:, 1]).max() > 5.0 and late.delay.value > 1e3 * late.margin
    late.kp.value, late.kd.value = 300.0, 28.0
    (saved,) = drawn(late.pictures["error"], "error")
    assert np.abs(saved[-100:, 1]).max() < 0.05
    (margin,) = drawn(late.pictures["error"], "margin")
    assert 1e3 * delay_margin(300.0, margin[20, 0]) == pytest.approx(margin[20, 1])


def test_what_is_left_out_is_out():
    gains = gains_without(frozenset({"swing", "motor limits (43)"}))
    assert gains.swing_weight == 0.0 and gains.com_weight == Gains().com_weight
    assert not gains.constraints.torques and gains.constraints.friction
    everything = gains_without(frozenset(TASKS) | frozenset(CONSTRAINTS))
    kept = everything.constraints
    assert not any((kept.feet, kept.wheels, kept.friction, kept.pushing, kept.torques))
    assert not any(getattr(everything, weight) for weight in TASKS.values())


def test_nothing_is_simulated_before_the_button(experiment):
    assert experiment.told == [] and "press Simulate" in experiment.status.value
    assert not experiment.pictures
    experiment.button.click()
    assert experiment.told == [experiment.setting] and "stayed upright" in experiment.status.value
    assert "<iframe" in experiment.replay.value or "srcdoc" in experiment.replay.value


def test_the_plots_are_the_runs(experiment, runs):
    experiment.button.click()
    picture, run = experiment.pictures["limits"], runs[False]
    torque = drawn(picture, "RL")
    for joint in range(3):
        np.testing.assert_allclose(torque[joint][:, 1], run.tau[:, 6 + joint])
    limits = [
        line.get_ydata()[0] for axes in picture.axes[:3] for line in axes.lines if line.get_gid() == "limit"
    ]
    assert np.all(np.abs(run.tau).max(axis=0).reshape(4, 3).max(axis=0) < limits[::2])
    use, mu = drawings.friction_use(run)
    assert np.nanmax(use) <= mu * 1.02, "MuJoCo's cone"
    force = run.contact_force[100, 2]
    assert use[100, 2] == pytest.approx(np.hypot(*force[:2]) / force[2])


def test_another_setting_takes_the_pictures_away_and_the_old_one_brings_them_back(experiment):
    experiment.button.click()
    experiment.delay.value = 20.0
    assert not experiment.pictures and experiment.replay.value == ""
    assert "20 ms" in experiment.status.value and "press Simulate" in experiment.status.value
    experiment.delay.value = 9.0
    assert set(experiment.pictures) == {"limits", "tracking"} and len(experiment.told) == 1


def test_the_table_collects_what_was_tried(experiment):
    experiment.button.click()
    experiment.switches["friction (42)"].value = False
    experiment.button.click()
    assert "without: friction" in experiment.history.value
    assert "upright" in experiment.history.value and "fell" in experiment.history.value
    assert "fell after" in experiment.status.value and len(experiment.results) == 2


def test_an_error_is_shown_and_the_button_works_again():
    def broken(_setting, _progress):
        raise RuntimeError("no <robot>")

    widget = Experiment(simulator=broken)
    with pytest.raises(RuntimeError):
        widget._pressed()
    assert "no &lt;robot&gt;" in widget.status.value and not widget.button.disabled


def test_without_limits_of_friction_the_robot_falls(runs):
    assert not runs[False].metrics["fell"] and runs[True].metrics["fell"]
    assert runs[False].meta["delay"] == pytest.approx(0.009)


def test_every_motion_has_a_plan_and_stands_as_it_says():
    starts = {name: plan().meta["start_end_effectors"] for name, plan in MOTIONS.items()}
    assert starts["stand on four feet"] == ["foot"] * 4
    assert starts["stand on a foot and three wheels"] == ["wheel", "foot", "wheel", "wheel"]
    for name in ("stand on four feet", "stand on a foot and three wheels"):
        assert not MOTIONS[name]().S.any()
