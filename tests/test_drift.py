"""A robot that rolls off takes its plan along, and stays upright; where it will be is foreseen."""

from types import SimpleNamespace

import handmade
import numpy as np
import pytest

from wfbook import terrain
from wfbook.drift import SLACK, Drift
from wfbook.flights import interpolate
from wfbook.forecast import expected_state
from wfbook.planner import Problem
from wfbook.simulate import run

UP = np.array([0.0, 0.0, 1.0])


def robot(x, speed):
    return SimpleNamespace(com=np.array([x, 0.0, 0.26]), com_velocity=np.array([speed, 0.0, 0.0]))


def planned(x, speed):
    return np.array([x, 0.0, 0.26]), np.array([speed, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])


def test_a_little_error_is_no_drift():
    drift = Drift()
    given = planned(0.5, 0.4)
    for got, was in zip(drift.update(0.0, given, robot(0.52, 0.1), True, UP), given, strict=True):
        np.testing.assert_array_equal(got, was)
    assert drift.pace == 1.0


def test_the_plan_goes_along_while_the_robot_rolls_and_at_its_pace_when_a_foot_is_down():
    drift = Drift()
    com, velocity, acceleration = drift.update(0.0, planned(0.5, 0.4), robot(0.6, 0.5), True, UP)
    assert com[0] == pytest.approx(0.6 - SLACK)
    assert velocity[0] == pytest.approx(0.5) and acceleration[0] == pytest.approx(-1.25)
    ahead = drift.after(0.08)[0]
    com, *_ = drift.update(0.2, planned(0.58, 0.4), robot(9.9, 9.9), False, UP)
    assert com[0] - 0.58 == pytest.approx(ahead) == pytest.approx(0.07 + 0.25 * 0.08)
    drift.end_at(0.3)
    com, velocity, _ = drift.update(0.3, planned(0.62, 0.4), robot(9.9, 9.9), False, UP)
    assert com[0] == 0.62 and velocity[0] == 0.4


def test_the_offset_goes_along_the_slope():
    normal = np.array([0.6, 0.0, 0.8])
    drift = Drift()
    drift.update(0.0, planned(0.0, 0.4), robot(0.5, 0.5), True, normal)
    assert drift.offset[0] > 0.1 and drift.offset @ normal == pytest.approx(0.0)


@pytest.fixture(scope="module")
def coast():
    return handmade.coast()


@pytest.mark.parametrize("push", [20.0, -20.0])
def test_a_push_along_the_way_is_survived_and_foreseen(coast, push):
    rolling = np.flatnonzero(((coast.end_effector == 1) & (coast.S == 0)).all(axis=0))
    slot = rolling[0] + 1
    ahead, expected, real = 2, [], []
    problem = Problem(terrain.flat())

    def watch(t, tracker, robot):
        if t >= slot * 0.3 + 0.15 and not expected:
            expected.append(expected_state(problem, coast, slot + ahead, t, tracker, robot))
        if t >= (slot + ahead) * 0.3 and not real:
            real.append((robot.com, robot.com_velocity, robot.centres))

    start = slot * 0.3 - 0.15
    result = run(coast, hold=0.3, push=(np.array([push, 0.0, 0.0]), start, 0.2), continuation=watch)
    assert result.metrics["upright"]
    away = result.com[-1, 0] - interpolate(coast, 1e3)[0][0]
    assert away * push > 0 and abs(away) > 2 * SLACK
    (state,), ((com, velocity, centres),) = expected, real
    assert np.abs(state.position - com)[:2].max() < 0.04
    assert np.abs(state.velocity - velocity)[:2].max() < 0.25
    assert np.abs(state.contacts - centres)[:, :2].max() < 0.05
