"""Chapter 3's widgets and drawings: what is drawn is what the rows say."""

import re

import numpy as np
import pytest

from wfbook.modes import start_dynamics
from wfbook.planner import stored
from wfbook.planner.one_step import OneStep
from wfbook.planner.root import Root
from wfbook.view import replay
from wfbook.view.drawings.modes import centroid, roots, rows_table, trellis
from wfbook.view.style import FOOT, WHEEL
from wfbook.view.widgets.modes import EXAMPLES, BigM, LegEditor, Stones


def named(axes, name):
    return [artist for artist in axes.get_children() if artist.get_gid() == name]


@pytest.fixture(scope="module")
def shared_editor():
    return LegEditor()


@pytest.fixture
def editor(shared_editor):
    # One for all tests, for pictures take their time; as it is at first.
    shared_editor.keep.value = False
    shared_editor.speed.value = 0.5
    if shared_editor.S.tolist() != [0, 1, 0, 0, 0, 0] or not shared_editor.D[1:, 1, 1].all():
        shared_editor.example.value = "walk"
        shared_editor.example.value = "land on the wheel"
    return shared_editor


def test_the_path_is_drawn_as_its_modes_move(editor):
    assert editor.broken == [] and "Allowed: 1 swing," in editor.status.value
    axes = editor.pictures["time"].axes[0]
    (foot,), (swing,), wheel = (named(axes, name) for name in ("foot", "swing", "wheel"))
    assert foot.get_color() == FOOT and np.ptp(foot.get_ydata()) < 1e-9, "eq. 19"
    assert len(wheel) == 4 and wheel[0].get_color() == WHEEL
    for line in wheel:
        speed = np.diff(line.get_ydata()) / np.diff(line.get_xdata())
        assert np.allclose(speed, editor.speed.value), "eq. 20"
    assert swing.get_ydata()[0] == pytest.approx(foot.get_ydata()[-1])
    assert swing.get_ydata()[-1] == pytest.approx(wheel[0].get_ydata()[0])
    side = editor.pictures["side"].axes[0]
    (air,), rolled = named(side, "swing"), named(side, "wheel")
    assert air.get_ydata().max() > 0.05
    ground = np.interp(rolled[-1].get_xdata(), *named(side, "region 2")[0].get_data())
    assert np.allclose(rolled[-1].get_ydata(), ground, atol=1e-6), "the wheel is on the slope"


def test_clicking_a_second_cell_breaks_17_and_marks_it(editor):
    editor.dynamics[3, 0, 0].value = True
    assert [(b.rule, b.slot) for b in editor.broken] == [("eq. 17", 3), ("eq. 16", 3), ("eq. 16", 4)]
    assert "eq. 17: FL, slot 3: D has 2 entries" in editor.status.value
    assert "wf-broken" in editor.dynamics[3, 0, 0]._dom_classes
    assert "wf-broken" not in editor.dynamics[2, 0, 0]._dom_classes
    axes = editor.pictures["time"].axes[0]
    assert editor.path is None and not named(axes, "wheel")
    assert named(axes, "broken 3") and named(axes, "broken 4") and not named(axes, "broken 2")
    editor.dynamics[3, 0, 0].value = False
    assert editor.broken == [] and "wf-broken" not in editor.dynamics[3, 0, 0]._dom_classes


def test_a_switch_on_the_ground_becomes_legal_by_one_cell_of_s(editor):
    editor.example.value = "switch on the ground"
    assert [(b.rule, b.slot) for b in editor.broken] == [("eq. 16", 3)]
    editor.swing[3].value = True
    assert editor.broken == [] and editor.swing[3].description == "1"


@pytest.mark.parametrize(
    "name, rule",
    [
        ("roll into the gap", "eq. 23"),
        ("too far", "eq. 22"),
        ("stay", "eq. 30"),
        ("on nothing, on two", "eq. 17"),
    ],
)
def test_each_forbidden_example_is_forbidden_by_its_equation(editor, name, rule):
    editor.example.value = name
    assert editor.broken[0].rule == rule and f"Forbidden. {rule}" in editor.status.value


def test_a_slow_body_does_not_roll_into_the_gap(editor):
    editor.example.value = "roll into the gap"
    editor.speed.value = 0.1
    assert editor.broken == []


def test_filling_in_obeys_16_and_17_whatever_is_clicked(editor):
    editor.keep.value = True
    editor.dynamics[3, 1, 0].value = True
    assert editor.D[1:, 1, 0].all(), "the foot from where the leg landed"
    assert {b.rule for b in editor.broken} <= {"eq. 30", "step limit"}
    editor.swing[4].value = True
    editor.dynamics[5, 2, 1].value = True
    assert (editor.D[4:, 2, 1] == 1).all() and (editor.D[1:4, 1, 0] == 1).all()
    editor.dynamics[0, 0, 1].value = True
    assert editor.D[0].tolist() == editor.ride.start_dynamics.tolist(), "nothing swings before slot 0"
    editor.swing[4].value = False
    assert (editor.D[4:, 1, 0] == 1).all()
    assert all(b.rule not in ("eq. 16", "eq. 17") for b in editor.broken)


def test_examples_have_six_slots():
    for swings, modes in EXAMPLES.values():
        assert len(swings) == len(modes.split()) == 6


def test_big_m_is_drawn_with_its_bound():
    widget = BigM()
    left, middle, right = widget.pictures["sets"].axes
    (loose,), (hull,) = named(left, "allowed"), named(middle, "allowed")
    assert loose.get_xy()[:, 1].max() > 0.6 and hull.get_xy()[:, 1].max() == pytest.approx(0.3)
    (dot,) = named(right, "big-M")
    assert dot.get_ydata()[0] == pytest.approx(widget.bounds["big-M"])
    assert widget.bounds["big-M"] < widget.bounds["hull"] < widget.bounds["optimum"]
    assert widget.bounds["perspective"] == pytest.approx(widget.bounds["optimum"], abs=1e-5)
    (curve,) = named(right, "curve")
    assert (np.diff(curve.get_ydata()) < 1e-7).all(), "a larger M never helps"
    (best,) = named(left, "best")
    S, step = best.get_xdata()[0], best.get_ydata()[0]
    assert OneStep().cost(S, step) == pytest.approx(widget.bounds["big-M"], abs=1e-6)


def test_a_small_m_is_called_no_bound():
    widget = BigM()
    assert "no bound" not in widget.status.value
    widget.big.value = 0.15
    assert widget.bounds["big-M"] > widget.bounds["optimum"] and "no bound" in widget.status.value
    widget.price.value = 0.6
    assert widget.bounds["optimum"] == pytest.approx(0.6)


def test_stones_draw_both_intervals():
    widget = Stones()
    for D in ((0.0, 0.0), (1.0, 0.5), (0.35, 0.5), (0.5, 1.0)):
        widget.first.value, widget.second.value = D
        axes = widget.pictures["stones"].axes[0]
        for name, (low, high) in widget.intervals.items():
            (bar,) = named(axes, name)
            assert (bar.get_x(), bar.get_width()) == pytest.approx((low, high - low))
        assert widget.D.sum() == pytest.approx(1.0)
        (big, hull) = (np.diff(widget.intervals[name])[0] for name in ("big-M", "hull"))
        assert big >= hull - 1e-12
    widget.first.value, widget.second.value = 0.0, 0.0
    assert widget.intervals["big-M"] == pytest.approx((widget.LOW[2], widget.HIGH[2]))


def test_the_table_of_a_leg_belongs_to_its_slots():
    plan = stored("flat")
    text = rows_table(plan, "FL")
    lines = [re.findall(r"data-from=\"([^\"]+)\"[^>]*>(\d)", row) for row in text.split("<tr>")[1:]]
    assert [int(v) for _, v in lines[1]] == plan.S[0].tolist()
    assert [int(v) for _, v in lines[3]] == plan.D[0, :, 0, 1].tolist()
    assert np.allclose([float(t) for t, _ in lines[1]], plan.slot_duration * np.arange(10))
    ramp = rows_table(stored("ramp-down"), "FL")
    assert "D, wheel, region 0" in ramp and "region 1</th>" not in ramp
    assert [int(v) for v in re.findall(r">(\d)<", ramp.split("region under it")[1])] == [0, 0] + [1] * 8


def test_a_replay_carries_what_stands_beside_it():
    plan = stored("flat")
    page = replay.html(plan, beside=rows_table(plan, "FL"))
    assert '<div id="beside"><style>' in page and 'data-from="0.3"' in page
    assert '<div id="beside"></div>' in replay.html(plan)


def test_the_trellis_has_a_line_for_each_legal_step():
    plan = stored("flat")
    start = start_dynamics([0], ["foot"], 1)[0]
    axes = trellis(plan.S[0], plan.D[0], start).axes[0]
    path, edges = named(axes, "path"), named(axes, "edge")
    # From anything a leg may swing to 2 or stand on: 3 ways out of each dot.
    assert len(path) == plan.slots and len(path) + len(edges) == 3 + 9 * 4 * 3


def test_the_centroid_is_drawn_between_the_legs_that_stand():
    plan = stored("flat")
    for axes, slot in zip(centroid(plan, (0, 3)).axes, (0, 3), strict=True):
        (cross,), (com,) = named(axes, "centroid"), named(axes, "com")
        knot = 3 * (slot + 1)
        standing = plan.p[knot, plan.S[:, slot] == 0, :2]
        assert np.allclose(np.ravel(cross.get_data()), standing.mean(axis=0), atol=1e-5)
        assert np.allclose(np.ravel(com.get_data()), plan.x[knot, :2])


def test_roots_are_drawn_as_bars_below_the_plan():
    plan = stored("flat")
    zeros = np.zeros((31, 4, 3)), np.zeros((30, 4))
    found = {n: Root(b, np.full((4, 10), b), np.zeros((4, 10)), *zeros) for n, b in (("a", 0.1), ("b", 0.3))}
    *matrices, bars = roots(found, plan).axes
    assert [bar.get_width() for bar in bars.patches] == [0.1, 0.3]
    (line,) = named(bars, "objective")
    assert line.get_xdata()[0] == plan.meta["objective"]
    assert np.allclose(matrices[1].images[0].get_array(), 0.3)
    assert np.array_equal(matrices[2].images[0].get_array(), plan.S)
