"""What the whole-body controller does besides its program, left out one at a time."""

from dataclasses import fields

import numpy as np
import pytest

from wfbook.omni.base import Base
from wfbook.omni.controller import FEEDBACK, WholeBody
from wfbook.omni.habits import Habits
from wfbook.omni.locked import MOTORS
from wfbook.omni.robot import NV, WHEEL_POSITIONS, Omni, posture
from wfbook.omni.rolling import Wheels
from wfbook.omni.simulate import Noise, run
from wfbook.omni.waves import Ground, waves
from wfbook.terrain import flat

UP = np.tile([0.0, 0.0, 1.0], (4, 1))
STAND = [(0.6, [0.0, 0.0, 0.0])]


def ticked(ticks, **options):
    """A driver that has been told the same state of a robot so many times, and its last command."""
    driver, state = WholeBody(Ground(flat()), **options), Omni(flat())
    state.reset(posture())
    qvel = np.full(29, 0.02)
    for _ in range(ticks):
        command = driver.tick(state.data.qpos.copy(), qvel, np.zeros(3))
    return driver, command


def test_everything_is_done_unless_it_is_left_out():
    assert all(getattr(Habits(), each.name) is True for each in fields(Habits))
    assert WholeBody(Ground(flat())).habits == Habits()


@pytest.mark.parametrize("predicts", [True, False])
def test_a_late_robot_falls_unless_it_predicts(predicts):
    late = run(flat(), [(1.0, [0.3, 0.0, 0.0])], delay=0.014, habits=Habits(predicts=predicts))
    assert late.metrics["finished"] == predicts


def test_torques_without_feedback_are_those_planned():
    for feeds_back in (True, False):
        driver, command = ticked(3, habits=Habits(feeds_back=feeds_back))
        planned = driver.ocp.us[0]
        same = np.allclose(command.torques[MOTORS], planned)
        assert same != feeds_back


def test_without_weighing_no_payload_is_found():
    loaded, light = (
        run(flat(), STAND, payload=0.7, habits=Habits(weighs=weighs)) for weighs in (True, False)
    )
    assert loaded.meta["payload_estimate"] > 0.5
    assert light.meta["payload_estimate"] == 0.0
    assert light.hand[-1, 2] < loaded.hand[-1, 2]


def test_without_the_integral_the_hand_stays_where_the_weight_pulls_it():
    lasting = [
        run(flat(), STAND, payload=1.0, habits=Habits(weighs=False, integrates=integrates))
        for integrates in (True, False)
    ]
    errors = [np.linalg.norm(each.hand[-1] - each.hand_ref[-1]) for each in lasting]
    assert errors[0] < 0.5 * errors[1]


def test_a_cold_start_is_from_standing_still(monkeypatch):
    monkeypatch.setattr("wfbook.omni.problem.OptimalControl.shift", lambda self: pytest.fail("warm"))
    driver, _ = ticked(11, habits=Habits(starts_warm=False))
    assert np.isfinite(driver.ocp.xs).all()


@pytest.mark.parametrize("looks_ahead", [True, False])
def test_who_does_not_look_ahead_takes_the_ground_to_go_on(looks_ahead, monkeypatch):
    told = []
    monkeypatch.setattr("wfbook.omni.problem.OptimalControl.roll", lambda self, speeds: told.append(speeds))
    base, qpos = Base(), posture()
    base.state[:] = 0.5, 0.0, 0.0, 1.0, 0.0, 0.0
    qpos[0] = 0.5
    driver = WholeBody(Ground(waves()), base=base, habits=Habits(looks_ahead=looks_ahead))
    driver.tick(qpos, np.zeros(NV), np.array([1.0, 0.0, 0.0]))
    rising = told[0][:, :, 2]
    front = WHEEL_POSITIONS[0, 0] + 0.5 + 0.02 * np.arange(len(rising))
    slope = 0.1 * 2.0 * np.pi / 2.3 * np.sin(2.0 * np.pi * front / 2.3)  # of the ground under a front wheel
    if looks_ahead:
        np.testing.assert_allclose(rising[:, 0], slope, atol=0.04)
    else:
        np.testing.assert_allclose(rising, rising[:1].repeat(len(rising), axis=0), atol=1e-9)
        assert rising[0, 0] == pytest.approx(slope[0], abs=0.04)


def test_wheels_that_keep_no_places_do_as_the_base_says():
    wheels = Wheels(Base())
    for _ in range(600):
        wheels.advance(np.array([0.5, 0.0, 0.0]), FEEDBACK)
    right = np.column_stack([WHEEL_POSITIONS, np.zeros(4)])
    off = right + np.array([0.05, -0.03, 0.0])
    as_said = wheels.command(right, UP)
    assert np.abs(wheels.command(off, UP) - as_said).max() > 0.1
    wheels.keep_places = False
    np.testing.assert_allclose(wheels.command(off, UP), as_said)
    np.testing.assert_allclose(wheels.steering, wheels.base.steering, atol=1e-12)


def test_noise_can_be_made_louder():
    louder = Noise().times(3.0)
    for each in fields(Noise):
        assert getattr(louder, each.name) == pytest.approx(3.0 * getattr(Noise(), each.name))
