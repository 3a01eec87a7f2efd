"""The figure of a run of part II: what its wheels do, and how still its hand is."""

from dataclasses import replace

import numpy as np
import pytest

from wfbook.omni import scenarios
from wfbook.omni.robot import STEERS_V, WHEEL_RADIUS, WHEELS_V
from wfbook.view import omni
from wfbook.view.style import SWINGING


@pytest.fixture(scope="module")
def run():
    return scenarios.crab(way=0.4)


def test_wheels_roll_stand_or_swing(run):
    modes = omni.wheel_modes(run)
    assert set(np.unique(modes)) == {0, 1}
    assert np.all(modes[-50:] == 0)
    speed = np.abs(WHEEL_RADIUS * run.qvel[:, WHEELS_V])
    assert np.all(modes[speed > 0.1] == 1)
    force = run.contact_force.copy()
    force[60:100, 2] = 0.0
    assert np.all(omni.wheel_modes(replace(run, contact_force=force))[60:100, 2] == SWINGING)


def test_arrows_point_where_the_wheels_roll(run):
    figure = omni.gait(run, "crab")
    arrows = [q for q in figure.axes[0].collections if str(q.get_gid()).endswith("ways")]
    assert len(arrows) == 4
    for wheel, quiver in enumerate(arrows):
        assert len(quiver.U) > 4
        # Once it is steered, to the left of ahead, which is up: minus x on the page.
        assert np.all(quiver.U[2:] < -0.99), wheel
    assert np.abs(run.qpos[-1, 1 + STEERS_V]) == pytest.approx(np.full(4, np.pi / 2), abs=0.05)


def test_errors_are_those_of_the_run(run):
    figure = omni.gait(run)
    drawn = {line.get_gid(): line.get_ydata() for axes in figure.axes for line in axes.lines}
    np.testing.assert_allclose(drawn["height"], 1e3 * (run.hand - run.hand_ref)[:, 2])
    assert np.abs(drawn["yaw"]).max() == pytest.approx(1e3 * run.metrics["hand_yaw_max_error_rad"])
    assert "event" not in drawn
    fallen = omni.gait(replace(run, events=[(0.5, "fallen: the trunk is tipped over")]))
    assert {line.get_gid() for axes in fallen.axes for line in axes.lines} >= {"event"}
