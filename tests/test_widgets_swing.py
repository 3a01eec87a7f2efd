"""The swing's widgets and drawings show what the spline and the leg's equations of motion say."""

import numpy as np
import pytest

from wfbook import planner
from wfbook.go1 import FOOT_RADIUS, nominal
from wfbook.swing import swing_position
from wfbook.view.drawings import swing as drawings
from wfbook.view.style import FOOT, WHEEL
from wfbook.view.widgets.swing import MixedSwings, SwingPlayground


@pytest.fixture
def playground():
    return SwingPlayground()


def line(picture, gid, axes=0):
    """The data of the line with that name, ``(n, 2)``."""
    (found,) = [drawn for drawn in picture.axes[axes].lines if drawn.get_gid() == gid]
    return np.column_stack(found.get_data())


def test_the_path_drawn_starts_ends_and_peaks_where_asked(playground):
    playground.step.value, playground.rise.value, playground.apex.value = 0.15, 0.04, 0.05
    path = line(playground.pictures["path"], "path") / 100
    assert path[0] == pytest.approx([0.0, 0.0], abs=1e-9) and path[-1] == pytest.approx([0.15, 0.04])
    assert path[60, 1] == pytest.approx(0.02 + 0.05), "the apex is above the mean of the ends"
    landing = next(
        drawn for drawn in playground.pictures["path"].axes[0].lines if drawn.get_gid() == "landing"
    )
    assert landing.get_color() == WHEEL
    playground.lands_on.value = "foot"
    landing = next(
        drawn for drawn in playground.pictures["path"].axes[0].lines if drawn.get_gid() == "landing"
    )
    assert landing.get_color() == FOOT


def test_the_leg_drawn_reaches_the_end_effector(playground):
    playground.lands_on.value = "foot"
    legs = [drawn for drawn in playground.pictures["path"].axes[0].lines if drawn.get_gid() == "leg"]
    path = line(playground.pictures["path"], "path")
    ends = np.array([np.column_stack(leg.get_data())[-1] for leg in legs])
    # drawn as if the leg were not splayed, which it is by a few millimetres
    assert ends[[0, -1]] == pytest.approx(path[[0, -1]] + [0.0, 100 * FOOT_RADIUS], abs=0.05)
    for leg in legs:
        links = np.linalg.norm(np.diff(np.column_stack(leg.get_data()), axis=0), axis=1)
        assert links == pytest.approx([21.3, 21.3], abs=1e-6)


def test_a_wheel_that_lands_with_the_robots_speed_and_a_foot_at_rest_do_not_jump(playground):
    assert np.abs(playground.jumps).max() < 1e-9 and "Nothing jumps" in playground.status.value
    playground.speed.value = 0.7
    assert playground.jumps[1, 0] == pytest.approx(0.2)
    assert "lands on its wheel with a jump of velocity of 0.20" in playground.status.value
    playground.end_velocity.value = 0.7
    assert np.abs(playground.jumps).max() < 1e-9
    playground.lands_on.value = "foot"
    assert playground.jumps[1, 0] == pytest.approx(0.7)


def test_without_acceleration_conditions_it_jumps_and_without_velocity_conditions_so_does_velocity(
    playground,
):
    playground.given.value = 1
    assert playground.jumps[:, 0] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert playground.jumps[:, 1].min() > 10.0 and "Acceleration jumps" in playground.status.value
    drawn = line(playground.pictures["time"], "z", axes=1)
    assert drawn[1, 0] == drawn[2, 0] == 0.0 and drawn[2, 1] - drawn[1, 1] > 10.0, "a vertical stroke at 0"
    playground.given.value = 0
    assert playground.jumps[:, 0].min() > 0.5


def test_half_the_time_takes_about_four_times_the_acceleration_and_more_torque(playground):
    for slider in (playground.speed, playground.end_velocity):
        slider.value = 0.0
    before, load = line(playground.pictures["time"], "x", axes=1)[:, 1].max(), playground.load
    playground.duration.value = 0.15
    assert line(playground.pictures["time"], "x", axes=1)[:, 1].max() == pytest.approx(4 * before)
    assert playground.load > 1.5 * load


def test_velocity_drawn_is_the_slope_of_the_path_drawn(playground):
    velocity = line(playground.pictures["time"], "x")[2:-2]
    path = line(playground.pictures["path"], "path")[:, 0] / 100
    slope = np.gradient(path, velocity[:, 0] / 1e3)
    assert velocity[5:-5, 1] == pytest.approx(slope[5:-5], abs=2e-3)


def test_a_leg_too_short_is_said_in_words(playground):
    playground.duration.value, playground.speed.value, playground.step.value = 0.6, 1.0, -0.1
    assert "reach" in playground.status.value and not playground.pictures
    playground.step.value = 0.2
    assert playground.pictures


def test_a_mixture_of_swings_is_a_swing_until_the_durations_differ():
    mixed = MixedSwings()
    assert mixed.mismatch < 1e-12 and "last digit" in mixed.status.value
    mixed.board.move("A", 5.0, -2.0)
    mixed.share.value = 0.25
    direct, mixture = line(mixed.pictures["board"], "direct"), line(mixed.pictures["board"], "mixture")
    assert direct[-1] == pytest.approx([0.75 * 5 + 0.25 * 28, 0.75 * -2 + 0.25 * 4])
    assert mixture == pytest.approx(direct, abs=1e-9)
    mixed.hurry.value = True
    assert mixed.mismatch > 1e-3 and "apart" in mixed.status.value
    mixed.velocity_b.value = mixed.velocity_a.value
    assert mixed.mismatch < 1e-12, "with one velocity, T v is as linear as T"
    mixed.velocity_a.value = mixed.velocity_b.value = 0.0
    assert mixed.mismatch < 1e-12, "from rest to rest the shape does not depend on time"


def test_the_curve_through_the_knots_is_the_plans():
    plan = planner.stored("flat")
    leg = int(plan.S.sum(axis=1).argmax())
    picture = drawings.knots(plan, leg, 1)
    spline, knots = line(picture, "spline"), line(picture, "knots")
    for knot in knots:
        assert np.linalg.norm(spline - knot, axis=1).min() < 0.3, "within a sample of the curve, in cm"


def test_the_end_conditions_drawn_are_those_of_the_names():
    start = nominal()["hip_offsets"][0] - nominal()["trunk"] + [-0.1, 0.0, FOOT_RADIUS]
    picture = drawings.ends(start, 0.2, 0.06, 0.3)
    for smoothness, jumps in ((2, (0, 0)), (1, (0, 1)), (0, (1, 1))):
        for axes, jump in ((1, jumps[0]), (2, jumps[1])):
            drawn = line(picture, f"smoothness {smoothness}", axes)[:, 1]
            assert (abs(drawn[2] - drawn[1]) > 0.3) == bool(jump)
    torque = line(picture, "smoothness 2", 3)[:, 1]
    assert abs(torque[2] - torque[1]) < 1e-9 and abs(torque[-3] - torque[-2]) < 1e-9


def test_the_bases_are_the_librarys():
    drawn = line(drawings.bases(), "$p_f$")
    path = swing_position(drawn[:, 0], 1.0, np.zeros(3), np.array([1.0, 0, 0]), 0.0)
    assert drawn[:, 1] == pytest.approx(path[:, 0])
