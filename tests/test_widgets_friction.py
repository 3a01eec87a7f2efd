"""Chapter 4's widgets and drawings: what is drawn is the cone, and what the physics did."""

import numpy as np
import pytest

from wfbook.standing import plane, stand
from wfbook.view.drawings import friction as drawings
from wfbook.view.style import FOOT, WHEEL
from wfbook.view.widgets.friction import ForceOnSlope, TiltingTable


@pytest.fixture
def dragged():
    return ForceOnSlope()


def patch(picture, gid):
    (found,) = [drawn for drawn in picture.axes[0].patches if drawn.get_gid() == gid]
    return found


def fan(widget):
    """The angles between the normal and the two edges of the admissible fan, in degrees."""
    corners = patch(widget.pictures["side"], "admissible").get_xy()[1:3]
    n, t = widget.basis[0][[0, 2]], widget.basis[1][[0, 2]]
    return sorted(np.degrees(np.arctan2(corners @ t, corners @ n)))


def dot(picture, gid):
    (found,) = [drawn for drawn in picture.axes[0].lines if drawn.get_gid() == gid]
    return np.ravel(found.get_data())


def test_the_fan_is_as_wide_as_the_friction_angle(dragged):
    for mu in (0.2, 0.7):
        dragged.mu.value = mu
        assert fan(dragged) == pytest.approx(np.degrees([-np.arctan(mu), np.arctan(mu)]))
    dragged.end_effector.value = "wheel"
    assert fan(dragged) == pytest.approx([0.0, 0.0])
    dragged.friction.value = False
    assert fan(dragged) == pytest.approx([45.0, 90.0]), "the whole half-plane above the ground"


def test_the_normal_turns_with_the_slope(dragged):
    dragged.slope.value = 20.0
    normal = dragged.basis[0]
    assert np.degrees(np.arccos(normal[2])) == pytest.approx(20.0) and normal[0] > 0, "downhill is ahead"
    assert dragged.basis @ dragged.basis.T == pytest.approx(np.eye(3), abs=1e-12)


def test_a_force_inside_is_given_and_one_outside_only_in_part(dragged):
    assert dragged.given == pytest.approx(dragged.asked) and "inside the cone" in dragged.status.value
    dragged.board.move("force", -30.0, 30.0)
    assert "outside the pyramid" in dragged.status.value and "slides" in dragged.status.value
    n, t, b = dragged.given
    assert np.hypot(t, b) == pytest.approx(dragged.mu.value * n) and n == pytest.approx(dragged.asked[0])
    section = dragged.pictures["section"]
    assert dot(section, "asked") == pytest.approx(dragged.asked[1:])
    assert dot(section, "given") == pytest.approx(dragged.given[1:])


def test_the_corner_of_the_pyramid_is_promised_and_not_given(dragged):
    dragged.slope.value = 0.0
    dragged.board.move("force", 0.9 * 0.4 * 50.0, 50.0)
    dragged.across.value = 18.0
    assert "inside the pyramid of eq. 26, but outside the cone" in dragged.status.value
    assert np.linalg.norm(dragged.given[1:]) == pytest.approx(20.0)


def test_a_wheel_rolls_whatever_is_asked_along_it(dragged):
    dragged.end_effector.value = "wheel"
    dragged.board.move("force", 10.0, 40.0)
    assert (
        dragged.given[1] == 0.0 and "rolls" in dragged.status.value and "impossible" in dragged.status.value
    )
    dragged.slope.value = 0.0
    assert "Standing still (grey) is possible" in dragged.status.value


def test_standing_is_said_to_end_at_the_friction_angle(dragged):
    dragged.mu.value = 0.4  # 21.8 degrees
    for slope, word in ((21.0, "possible"), (22.0, "impossible"), (-21.0, "possible")):
        dragged.slope.value = slope
        assert f"is {word} here" in dragged.status.value


def test_pulling_is_no_contact(dragged):
    dragged.board.move("force", 0.0, -5.0)
    assert "pulls at the ground" in dragged.status.value and not dragged.given.any()


def test_without_the_constraint_anything_that_pushes_goes(dragged):
    dragged.friction.value = False
    dragged.board.move("force", 55.0, 10.0)
    assert "Without eqs 26 and 27" in dragged.status.value
    assert not [drawn for drawn in dragged.pictures["section"].axes[0].patches if drawn.get_gid()]


@pytest.fixture(scope="module")
def table():
    return TiltingTable()


def test_the_table_shows_what_the_ground_gave(table):
    assert table.predicted == pytest.approx(np.arctan(0.4))
    assert np.degrees(table.standing.slip_angle) == pytest.approx(21.8, abs=1.5)
    (measured,) = [d for d in table.pictures["grip"].axes[0].lines if d.get_gid() == "feet"]
    slope, grip = measured.get_data()
    assert measured.get_color() == FOOT
    early, late = (slope > 5) & (slope < 18), slope > 24
    assert grip[early] == pytest.approx(np.tan(np.radians(slope[early])), abs=0.02)
    assert grip[late] == pytest.approx(0.4, abs=0.03)


def test_wheels_on_the_table_roll_and_mixed_legs_hold_less(table):
    for leg in ("RL", "RR"):
        table.wheels[leg].value = True
    front = table.standing.slip_angle
    assert table.predicted is None and "2 of four legs" in table.status.value
    assert np.radians(12.0) < front < np.radians(19.0)
    for leg in ("FL", "FR"):
        table.wheels[leg].value = True
    assert table.predicted == 0.0 and np.degrees(table.standing.slip_angle) < 0.5
    (measured,) = [d for d in table.pictures["grip"].axes[0].lines if d.get_gid() == "wheels"]
    assert measured.get_color() == WHEEL


def test_the_section_has_corners_on_the_circle_inside_and_outside_of_it():
    picture = drawings.section(0.5)
    inner = patch(picture, "inner pyramid").get_xy()
    eight = patch(picture, "eight sides").get_xy()
    outer = patch(picture, "pyramid").get_xy()
    assert np.linalg.norm(inner, axis=1) == pytest.approx(0.5) and np.linalg.norm(
        eight, axis=1
    ) == pytest.approx(0.5)
    assert np.linalg.norm(outer, axis=1) == pytest.approx(0.5 * np.sqrt(2))
    assert np.linalg.norm(patch(picture, "cone").get_xy(), axis=1) == pytest.approx(0.5)


def test_coasting_is_drawn_beside_both_signs():
    coasting = stand(plane(0.4, 0.02), ("wheel",) * 4, 0.5, speed=0.6)
    picture = drawings.coasting(coasting, 0.02)
    lines = {drawn.get_gid(): drawn.get_ydata() for drawn in picture.axes[0].lines}
    corrected, printed = lines["against rolling (eq. 29, corrected)"], lines["eq. 29 as printed"]
    assert corrected[-1] < 0.6 < printed[-1]
    assert lines["measured"][-1] == pytest.approx(corrected[-1], abs=0.01)


def test_slip_angles_are_drawn_on_the_arc_tangent():
    picture = drawings.slip_angles((0.2, 0.4), {"foot": (0.2, 0.38), "wheel": (0.2, 0.38)})
    predicted = next(d for d in picture.axes[0].lines if d.get_gid() == "predicted")
    mu, angle = predicted.get_data()
    assert np.tan(np.radians(angle)) == pytest.approx(mu)
    assert dot(picture, "foot") == pytest.approx([0.2, 0.4, *np.degrees([0.2, 0.38])])
