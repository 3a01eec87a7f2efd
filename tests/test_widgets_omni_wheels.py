"""Chapter 9's widgets and drawings show what the wheels do."""

import numpy as np
import pytest

from wfbook.omni.robot import WHEEL_POSITIONS
from wfbook.omni.wheels import ackermann, body_twist, crab, pivot, rotation, twist_about, wheel_velocities
from wfbook.view.drawings import omni_wheels as drawings
from wfbook.view.style import PLANNED, WHEEL, Picture
from wfbook.view.widgets.omni_wheels import CentreOfRotation, DriveTheBase


def lines(axes) -> dict:
    return {line.get_gid(): line for line in axes.lines if line.get_gid()}


@pytest.fixture(scope="module")
def panel() -> DriveTheBase:
    return DriveTheBase()


def test_the_sliders_choose_the_twist(panel):
    panel.turn.value, panel.sideways.value, panel.ahead.value = 0.8, -0.4, 0.3
    np.testing.assert_allclose(panel.drive.twist[-1], [0.3, -0.4, 0.8], atol=1e-9)
    found, skid = body_twist(panel.drive.steering[-1], panel.drive.speed[-1], WHEEL_POSITIONS)
    np.testing.assert_allclose(found, panel.wanted, atol=1e-9)
    np.testing.assert_allclose(skid, 0.0, atol=1e-9)
    above, way = panel.pictures["above"].axes
    centre = np.array(lines(above)["centre"].get_xydata()[0])
    np.testing.assert_allclose(wheel_velocities(panel.wanted, centre[None, ::-1]), 0.0, atol=1e-9)
    assert lines(way)["path"].get_color() == PLANNED
    assert "Rank of A: 3" in panel.status.value
    steering, speed, _ = panel.pictures["time"].axes
    for leg, name in enumerate(("FL", "FR", "RL", "RR")):
        drawn = lines(steering)[name].get_ydata()
        np.testing.assert_allclose(drawn, np.degrees(panel.drive.steering[:, leg]))
        np.testing.assert_allclose(lines(speed)[name].get_ydata(), panel.drive.speed[:, leg])
        assert lines(steering)[name].get_color() == WHEEL


def test_crabbing_has_no_centre_and_rank_two():
    panel = DriveTheBase()
    panel.sideways.value = 0.5
    assert "No centre of rotation. Rank of A: 2." in panel.status.value
    assert "centre" not in lines(panel.pictures["above"].axes[0])


def test_the_base_goes_on_from_where_it_was():
    panel = DriveTheBase()
    steering = panel.drive.steering[-1]
    panel.turn.value = 1.0
    np.testing.assert_allclose(panel.drive.steering[0], steering, atol=1e-9)
    np.testing.assert_allclose(panel.drive.twist[0], [0.6, 0.0, 0.0], atol=1e-9)


def test_a_base_that_steers_while_it_starts_skids():
    skids = {}
    for first in (True, False):
        panel = DriveTheBase()
        panel.steer_first.value = first
        panel.ahead.value = 0.0
        panel.sideways.value = 1.0
        skids[first] = np.abs(panel.drive.skid).max()
    assert skids[True] < 0.01 < 0.05 < skids[False]


def test_the_way_is_drawn_in_the_axes_of_its_start():
    panel = DriveTheBase()
    panel.turn.value = 1.5
    panel.turn.value = 0.0
    path = lines(panel.pictures["above"].axes[1])["path"].get_xydata()
    np.testing.assert_allclose(path[0], 0.0, atol=1e-12)
    assert path[5, 1] > 0.0 and abs(path[5, 0]) < 0.2 * path[5, 1]  # first it goes ahead


def test_dragging_the_centre():
    widget = CentreOfRotation()
    for y, x in ((0.6, 0.0), (-0.3, 0.5), (0.0, 0.0), (0.1, -0.9)):
        widget.board.move("centre", y, x)
        np.testing.assert_allclose(widget.twist, twist_about(np.array([x, y]), 0.8))
        found, skid = body_twist(widget.steering, widget.speed, WHEEL_POSITIONS)
        np.testing.assert_allclose(found, widget.twist, atol=1e-9)
        np.testing.assert_allclose(skid, 0.0, atol=1e-9)
        centre = lines(widget.board.picture.axes[0])["centre"].get_xydata()[0]
        np.testing.assert_allclose(centre, [y, x], atol=1e-12)
    steering = widget.steering
    widget.rate.value = -0.8
    np.testing.assert_allclose(widget.steering, steering, atol=1e-9)  # reversed, not steered
    assert "Steering FL" in widget.status.value


def test_a_wheel_at_the_centre_stands_and_holds():
    widget = CentreOfRotation()
    before = widget.steering[0]
    widget.board.move("centre", *WHEEL_POSITIONS[0, ::-1])
    assert widget.speed[0] == 0.0 and widget.steering[0] == before


def test_four_modes_one_drawing():
    twists = {
        "Ackermann": ackermann(0.6, 0.8, -0.28),
        "crab": crab(0.6, 0.7),
        "in place": rotation(1.2),
        "pivot": pivot(0.5, 0.55),
    }
    picture = drawings.modes(twists)
    assert isinstance(picture, Picture)
    assert [axes.get_title(loc="left") for axes in picture.axes] == list(twists)
    centres = [
        lines(axes)["centre"].get_xydata()[0] if name != "crab" else None
        for axes, name in zip(picture.axes, twists, strict=True)
    ]
    np.testing.assert_allclose(centres[0], [0.8, -0.28], atol=1e-12)
    np.testing.assert_allclose(centres[2], [0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(centres[3], [0.55, 0.0], atol=1e-12)
    assert "centre" not in lines(picture.axes[1])
