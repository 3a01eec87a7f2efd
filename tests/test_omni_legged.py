"""Legged mode in the closed loop: over a bar, into the air, and what happens when it goes wrong."""

import numpy as np
import pytest

from wfbook.modes import LEGS
from wfbook.omni.legged import REAR, bar, flights, lifts, over_the_bar, run_jump
from wfbook.omni.machine import ON_LEGS, Mode
from wfbook.omni.robot import WHEELS_V
from wfbook.omni.simulate import OmniRun, run
from wfbook.omni.stride import Gait
from wfbook.omni.two_modes import RollTo, StepTo
from wfbook.terrain import flat
from wfbook.view.motion import motion_of_driving
from wfbook.view.spans import SWINGING

FAR_FACE = 0.95
ONE_STEP = StepTo({"FL": 0.4}, Gait(shift=0.5, swing=0.8))


@pytest.fixture(scope="module")
def over():
    return run(bar(), over_the_bar(beyond=0.1), start=0.4)


@pytest.fixture(scope="module")
def jumped():
    return run_jump()


def spells(modes: np.ndarray) -> list[Mode]:
    """The modes one after the other."""
    return [Mode(m) for m in modes[np.flatnonzero(np.diff(modes, prepend=-1))]]


def test_the_robot_gets_over_the_bar(over):
    assert over.metrics["finished"] and over.metrics["upright"]
    assert over.p[0, :, 0].max() < 0.9 and over.p[-1, :, 0].min() > FAR_FACE
    assert np.abs(over.p[-1, :, 2]).max() < 0.003
    assert over.metrics["rest_speed_m_s"] < 0.02


def test_the_hand_stays_up_meanwhile(over):
    assert over.metrics["hand_height_std_m"] < 0.002
    assert over.metrics["hand_height_max_error_m"] < 0.005
    assert over.metrics["hand_turn_max_rad"] < 0.05


def test_modes_change_in_order_and_twice(over):
    order = [Mode.WHEELED, Mode.STOPPING, Mode.ALIGNING, Mode.LOCKING, Mode.LEGGED, Mode.RELEASING]
    assert spells(over.mode) == [*order, *order, Mode.WHEELED]


def test_wheels_are_lifted_in_legged_mode_alone_and_one_at_a_time(over):
    lifted = ~over.stance
    assert lifted.sum(axis=1).max() == 1
    assert np.all(over.mode[lifted.any(axis=1)] == Mode.LEGGED)
    # What is taken to be in the air carries nothing. At the end it may brush the ground before it is felt.
    inside = lifted & np.roll(lifted, 30, axis=0) & np.roll(lifted, -30, axis=0)
    assert over.contact_force[inside][:, 2].max() == 0.0
    assert over.contact_force[lifted][:, 2].max() < 60.0
    for leg in range(4):
        assert lifted[:, leg].sum() > 60
        assert over.p[lifted[:, leg], leg, 2].max() > 0.1
    assert all(margin > 0.01 for margin in lifts(over)["lift_margin_m"].values())


def test_locked_wheels_do_not_turn(over):
    turning = np.abs(over.qvel[:, WHEELS_V])
    on_legs = np.isin(over.mode, [int(mode) for mode in ON_LEGS])
    angles = over.qpos[:, 1 + WHEELS_V]
    begins = np.flatnonzero(np.diff(on_legs.astype(int)) == 1) + 1
    for begin in begins:
        stretch = slice(begin, begin + int(np.argmin(on_legs[begin:])))
        assert np.ptp(angles[stretch], axis=0).max() < 0.1
    assert turning[~on_legs].max() > 2.0


def test_a_replay_shows_no_prints_of_lifted_wheels(over):
    shown = motion_of_driving(over)
    assert np.any(shown.modes == SWINGING)
    still = motion_of_driving(run(flat(), [(0.1, [0.0, 0.0, 0.0])]))
    assert np.all(still.modes == 1)


def test_the_robot_jumps_lands_and_rolls_on(jumped):
    assert jumped.metrics["finished"] and jumped.metrics["upright"]
    figures = flights(jumped)
    assert figures["flight_s"] > 0.15
    assert figures["com_rise_m"] > 0.05 and figures["wheel_rise_m"] > 0.03
    assert figures["landing_miss_m"] < 0.05
    assert jumped.metrics["hand_height_max_error_m"] < 0.08
    assert jumped.qpos[-1, 0] - jumped.qpos[0, 0] == pytest.approx(0.6, abs=0.2)
    # In the air it falls as everything does.
    flying = np.flatnonzero(jumped.contact_force[:, :, 2].max(axis=1) == 0.0)
    rising = np.gradient(jumped.com[:, 2], jumped.t)
    bend = np.polyfit(jumped.t[flying[3:-3]], rising[flying[3:-3]], 1)[0]
    assert bend == pytest.approx(-9.81, abs=0.3)


def test_a_step_that_can_not_be_planned_is_noted_and_the_robot_stays_up():
    stopped = run(flat(), [StepTo({"FL": 0.4}, Gait(margin=0.3))])
    assert stopped.metrics["upright"] and not stopped.metrics["finished"]
    assert "no plan: stride: FL can't be lifted" in stopped.events[0][1]
    assert stopped.mode[-1] == Mode.HALTED
    assert stopped.metrics["rest_speed_m_s"] < 0.02


def test_a_step_out_of_reach_is_noted():
    stopped = run(flat(), [StepTo({"FL": 0.9}, ONE_STEP.gait)])
    assert stopped.metrics["upright"]
    assert "no plan" in stopped.events[0][1]


def test_solutions_that_are_not_finite_end_the_run_in_legged_mode(monkeypatch):
    from wfbook.omni.problem import OptimalControl

    solve = OptimalControl.solve

    def fails(self, x, iterations=100):
        if self.mode == "legged":
            raise FloatingPointError
        return solve(self, x, iterations)

    monkeypatch.setattr(OptimalControl, "solve", fails)
    stopped = run(flat(), [ONE_STEP])
    assert "no finite solution" in stopped.events[0][1] or "no plan" in stopped.events[0][1]
    assert stopped.metrics["upright"]
    assert stopped.metrics["rest_speed_m_s"] < 0.05


def test_a_fall_on_three_wheels_is_noted_and_the_robot_comes_to_rest():
    fallen = run(flat(), [ONE_STEP], push=([0.0, 500.0, 0.0], 1.2, 0.25))
    assert not fallen.metrics["upright"]
    assert "fallen" in fallen.events[0][1]
    assert not fallen.stance.all()
    # It lies on its back, which is round, and rocks.
    assert fallen.metrics["rest_speed_m_s"] < 0.1 * np.abs(fallen.qvel[:, :3]).max()


def test_a_course_may_hold_twists_among_tasks(tmp_path):
    mixed = run(flat(), [(0.5, [0.3, 0.0, 0.0]), RollTo(0.3), (0.3, [0.0, 0.0, 0.5])])
    assert mixed.metrics["finished"]
    assert mixed.pose[-1, 0] == pytest.approx(0.3, abs=0.01)
    assert mixed.pose[-1, 2] > 0.02  # the wheels steer first
    assert mixed.meta["course"][1] == {"roll_to": 0.3, "legs": list(LEGS), "speed": 0.4}
    mixed.save(tmp_path / "run.npz")
    back = OmniRun.load(tmp_path / "run.npz")
    np.testing.assert_array_equal(back.mode, mixed.mode)
    np.testing.assert_array_equal(back.stance, mixed.stance)


def test_what_is_wrong_is_said():
    with pytest.raises(ValueError, match="controller: 'ik-true' can't step"):
        run(flat(), [ONE_STEP], controller="ik-true")
    with pytest.raises(ValueError, match="bar: height 0"):
        bar(height=0.0)
    assert set(REAR) < set(LEGS)
