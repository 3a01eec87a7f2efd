"""Chapter 10's widgets and drawings: what is drawn are the cone's rows and the contacts' areas."""

import numpy as np
import pytest
from matplotlib.patches import Polygon

from wfbook.centroidal import GRAVITY
from wfbook.omni.support import support_area
from wfbook.omni.tipping import tip
from wfbook.omni.wrench import COMPONENTS, decoupled, line_contact, line_ends, wrench_of
from wfbook.view.drawings import omni_wrench as drawings
from wfbook.view.style import FORCE, LIMIT, WHEEL
from wfbook.view.widgets.omni_wrench import KINDS, ConeSlice, Support


@pytest.fixture
def sliced():
    return ConeSlice()


@pytest.fixture
def support():
    return Support()


def patch(picture, gid, axes=0):
    found = [drawn for drawn in picture.axes[axes].patches if drawn.get_gid() == gid]
    return found[0].get_xy() if found else None


def line(picture, gid, axes=0):
    (found,) = [drawn for drawn in picture.axes[axes].lines if drawn.get_gid() == gid]
    return found


def put(widget, **values):
    for name, value in values.items():
        widget.components[name].value = value


def test_the_slice_is_a_diamond_as_wide_as_friction_and_lever(sliced):
    put(sliced, τx=0.0)
    corners = patch(sliced.pictures["slice"], "admitted")
    assert np.abs(corners).max(axis=0) == pytest.approx([60.0, 0.6 * 0.02 * 100.0])
    sliced.width.value, sliced.mu.value = 8.0, 0.3
    corners = patch(sliced.pictures["slice"], "admitted")
    assert np.abs(corners).max(axis=0) == pytest.approx([30.0, 0.3 * 0.04 * 100.0])
    put(sliced, τx=4.0)
    corners = patch(sliced.pictures["slice"], "admitted")
    assert np.ptp(corners @ [0.04, 1.0]) < 1e-5 * 100, "one end carries all: push and twist are one"


def test_a_point_that_is_dragged_out_breaks_the_row_that_is_drawn_red(sliced):
    assert "Inside" in sliced.status.value
    sliced.board.move("wrench", 70.0, 0.9)
    assert "Outside. Broken: right end: fx ≤ μ fz." in sliced.status.value
    picture = sliced.pictures["slice"]
    row = line(picture, "row right end: fx ≤ μ fz")
    assert row.get_color() == LIMIT and line(picture, "wrench").get_color() == LIMIT
    assert sliced.wrench[[0, 5]] == pytest.approx([70.0, 0.9])
    cone = line_contact(0.6, 0.04)
    assert f"Penalty of eq. 9: {0.5 * max(cone.residual(sliced.wrench)) ** 2:.3g}" in sliced.status.value
    sliced.board.move("wrench", 0.0, 0.0)
    assert line(sliced.pictures["slice"], "wrench").get_color() == FORCE
    assert "row" not in {str(drawn.get_gid())[:3] for drawn in sliced.pictures["slice"].axes[0].lines}


def test_the_ends_show_forces_that_make_the_wrench(sliced):
    put(sliced, fx=30.0, τx=-0.8, τz=0.2)
    tips = [
        drawn.xy
        for drawn in sliced.pictures["ends"].axes[0].texts
        if getattr(drawn, "get_gid", str)() == "force"
    ]
    heights = [tip[1] for tip in tips]
    assert heights == pytest.approx([(100 - 40) / 2, (100 + 40) / 2])


def test_axes_are_chosen_and_swapped(sliced):
    sliced.across.value, sliced.up.value = "τx", "fz"
    picture = sliced.pictures["slice"].axes[0]
    assert (picture.get_xlabel(), picture.get_ylabel()) == ("τx (N m)", "fz (N)")
    assert sliced.components["τx"].disabled and not sliced.components["fx"].disabled
    assert sliced.board.points["wrench"] == pytest.approx([0.5, 100.0])
    sliced.up.value = "τx"
    assert (sliced.across.value, sliced.up.value) == ("fz", "τx")
    sliced.across.value = "τx"
    assert (sliced.across.value, sliced.up.value) == ("τx", "fz")
    wedge = patch(sliced.pictures["slice"], "admitted")
    assert (np.abs(wedge[:, 0]) <= 0.02 * wedge[:, 1] + 1e-6).all(), "tilt needs pressure"


def test_a_moment_about_the_axle_is_a_line(sliced):
    sliced.up.value = "τy"
    assert np.abs(patch(sliced.pictures["slice"], "admitted")[:, 1]).max() < 1e-6
    sliced.kind.value = KINDS[3]
    assert np.ptp(patch(sliced.pictures["slice"], "admitted")[:, 1]) == pytest.approx(8.0), (
        "free in the paper"
    )
    put(sliced, τz=0.0, τx=0.0)
    sliced.board.move("wrench", 0.0, 3.0)
    assert "a real line of this width has no such forces" in sliced.status.value


def test_a_hand_has_no_moments_and_a_sole_has_all(sliced):
    put(sliced, τx=0.0, τz=0.0)
    sliced.kind.value = KINDS[1]
    assert "Inside" in sliced.status.value
    put(sliced, τx=0.2)
    assert "Broken: τx ≤ 0" in sliced.status.value
    sliced.kind.value = KINDS[2]
    put(sliced, τy=3.0)
    assert "Inside" in sliced.status.value, "a sole of 12 cm"
    sliced.kind.value = KINDS[4]
    put(sliced, fx=110.0, τy=0.0)
    assert "a real line of this width has no such forces" in sliced.status.value, "μ |fx| ≤ fz"


def test_what_is_admitted_is_what_the_cone_admits(sliced):
    random = np.random.default_rng(0)
    for kind in KINDS:
        sliced.kind.value = kind
        for _ in range(3):
            sliced.board.move("wrench", *random.uniform([-120, -4], [120, 4]))
            inside = "Inside" in sliced.status.value or "admit it" in sliced.status.value
            assert inside == bool(sliced.cone.admits(sliced.wrench, 1e-6))


def test_the_area_is_the_librarys(support):
    for kind in ("full", "pendular", "static"):
        support.kind.value = kind
        com = np.array([*support.board.points["com"], support.height.value])
        drawn = patch(support.pictures["above"], "area")
        expected = support_area(support.contacts, kind, com)
        assert drawn[:-1] == pytest.approx(expected)
    assert patch(support.pictures["above"], "polygon")[:-1] == pytest.approx(support.polygon)
    treads = [drawn for drawn in support.pictures["above"].axes[0].lines if drawn.get_gid() == "wheel"]
    assert len(treads) == 4 and treads[0].get_color() == WHEEL


def test_the_point_says_what_acceleration_it_means(support):
    support.board.move("com", 0.1, 0.0)
    support.board.move("zmp", 0.0, 0.05)
    acceleration = GRAVITY * np.array([0.1, -0.05]) / 0.45
    assert f"({acceleration[0]:.1f}, {acceleration[1]:.1f}) m/s²" in support.status.value
    assert "possible" in support.status.value and "impossible" not in support.status.value
    support.mu.value = 0.1
    assert "impossible" in support.status.value and "inside the polygon" in support.status.value


def test_a_lifted_wheel_and_a_hand_change_where_it_can_rest(support):
    support.kind.value = "static"
    support.board.move("com", 0.15, -0.12)
    assert "is held" in support.status.value
    support.wheels["FR"].value = False
    assert "is not held" in support.status.value and len(support.contacts) == 3
    support.wheels["FR"].value = True
    support.board.move("com", 0.36, 0.0)
    assert "is not held" in support.status.value
    support.hand.value = True
    assert "is held" in support.status.value and "outside the polygon" in support.status.value
    support.kind.value = "full"
    assert "with some motion" in support.status.value


def test_wheels_can_be_steered_dragged_and_all_lifted(support):
    support.steer.value = 90.0
    assert np.ptp(support.polygon, axis=0) == pytest.approx([0.56 + 0.04, 0.38])
    support.board.move("FL", 0.4, 0.3)
    assert support.polygon[:, 0].max() == pytest.approx(0.42)
    for box in support.wheels.values():
        box.value = False
    assert "No wheel" in support.status.value and patch(support.pictures["above"], "area") is None


def test_drawings_of_slices_and_penalty():
    cones = {"line": (line_contact(0.5, 0.04), WHEEL), "box": (decoupled(0.5, (0.02, 0.0, 0.01)), LIMIT)}
    picture = drawings.compared(cones, "fx", "τz", {"fz": 80.0})
    assert len(patch(picture, "line")) == 5 and len(patch(picture, "box")) == 5
    assert np.abs(patch(picture, "line")).max(axis=0) == pytest.approx(
        np.abs(patch(picture, "box")).max(axis=0)
    )
    picture = drawings.penalties(cones["line"][0], {"fz": 100.0})
    mended, whole = line(picture, "row by row"), line(picture, "whole vector")
    force, charge = mended.get_data()
    assert charge[np.abs(force) < 50.0].max() == 0.0 and charge[np.abs(force) > 51.0].min() > 0.0
    assert np.abs(np.diff(charge)).max() < 50.0, "no step"
    assert np.abs(np.diff(whole.get_ydata())).max() > 1000.0, "a step"
    nothing = drawings.compared(cones, "fx", "τz", {"fz": -80.0})
    assert patch(nothing, "line") is None


def test_drawings_of_a_robot_that_is_pushed():
    tipping = tip(duration=1.0)
    picture = drawings.pushed({"it": tipping})
    push, pressed = line(picture, "FL").get_data()
    assert pressed[-1] > pressed[0] and push[-1] == pytest.approx(60.0)
    assert line(picture, "zmp", 1).get_ydata()[-1] == pytest.approx(tipping.zmp[-1, 1])
    picture = drawings.in_the_cones(tipping)
    for axes, column in ((0, 0), (1, 1)):
        points, press = line(picture, "forces", axes).get_data()
        assert (np.abs(points) <= tipping.mu * press + 1.0).all(), column
    picture = drawings.areas(tipping.contacts(), tipping.com[0], 0.04)
    assert [axes.get_title(loc="left").split(":")[0] for axes in picture.axes] == [
        "full",
        "pendular",
        "static",
    ]
    assert all(isinstance(drawn, Polygon) for axes in picture.axes for drawn in axes.patches)


def test_the_widgets_wrench_is_made_of_its_components(sliced):
    forces = np.array([[10.0, 2.0, 60.0], [5.0, 1.0, 40.0]])
    put(sliced, **dict(zip(COMPONENTS, wrench_of(line_ends(0.04), forces), strict=True)))
    assert "Inside" in sliced.status.value
    assert sliced.wrench[:3] == pytest.approx(forces.sum(axis=0))
