"""Figures draw what the arrays say: bars, paths and steps are read back from the figure."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from view_cases import KIND, SLOT, SWING, small_plan, small_run

from wfbook.modes import LEGS
from wfbook.view import figures
from wfbook.view.spans import plan_modes, spans
from wfbook.view.style import FOOT, MODE_COLOURS, WHEEL
from wfbook.view.style import SWING as SWING_COLOUR


def bars(figure):
    """(leg, start, stop, colour) of every bar of a gait diagram."""
    return [
        (
            round(bar.get_y() + bar.get_height() / 2),
            *bar.get_bbox().intervalx,
            to_hex(bar.get_facecolor()).upper(),
        )
        for bar in figure.axes[0].patches
    ]


def lines(figure, name):
    """Every curve with this gid."""
    return [line.get_xydata() for axes in figure.axes for line in axes.lines if line.get_gid() == name]


def random_modes(seed, slots=9):
    rng = np.random.default_rng(seed)
    return (rng.random((4, slots)) < 0.3).astype(int), (rng.random((4, slots)) < 0.5).astype(int)


def test_gait_bars_are_the_swing_and_dynamics_matrices():
    drawn = bars(figures.gait(small_plan()))
    expected = [
        *[(0, 0.0, 0.3, FOOT), (0, 0.3, 0.6, SWING_COLOUR), (0, 0.6, 1.5, WHEEL)],
        *[(1, 0.0, 1.5, FOOT), (2, 0.0, 1.5, FOOT)],
        *[(3, 0.0, 0.9, FOOT), (3, 0.9, 1.2, SWING_COLOUR), (3, 1.2, 1.5, FOOT)],
    ]
    assert [(leg, colour) for leg, _, _, colour in drawn] == [(leg, colour) for leg, _, _, colour in expected]
    assert np.allclose([bar[1:3] for bar in drawn], [bar[1:3] for bar in expected])


@pytest.mark.parametrize("seed", range(5))
def test_gait_covers_every_slot_once_in_its_colour(seed):
    S, kind = random_modes(seed)
    drawn = bars(figures.gait(small_plan(S, kind, advance=0.0)))
    for leg, slot in np.ndindex(*S.shape):
        middle = (slot + 0.5) * SLOT
        over = [colour for row, start, stop, colour in drawn if row == leg and start < middle < stop]
        assert over == [MODE_COLOURS[2 if S[leg, slot] else kind[leg, slot]]]


def test_gait_has_legs_from_the_front_and_a_legend():
    figure = figures.gait(small_plan(), title="flat")
    axes = figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == list(LEGS)
    assert axes.yaxis_inverted(), "FL belongs on top"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["foot", "wheel", "swing"]
    assert "time" in axes.get_xlabel() and axes.get_title(loc="left") == "flat"


def test_com_path_draws_both_paths_and_every_contact():
    plan = small_plan()
    run = small_run()
    figure = figures.com_path(plan, run, polygons=True)
    assert np.array_equal(lines(figure, "planned")[0], plan.x[:, :2])
    assert np.array_equal(lines(figure, "measured")[0], run.com[:, :2])
    rolled = lines(figure, "FL wheel")[0]
    assert np.allclose(rolled, plan.p[6:, 0, :2]) and np.ptp(rolled[:, 0]) > 0.01
    assert np.ptp(lines(figure, "FR foot")[0], axis=0).max() == 0.0, "a foot that stands is one point"
    assert len(lines(figure, "RR foot")) == 2, "before and after its step"
    corners = [len(patch.get_xy()) - 1 for patch in figure.axes[0].patches]
    assert corners == [4, 3, 4, 3, 4], "as many corners as legs stand"


@pytest.mark.parametrize("component", ["x", "y", "z"])
def test_forces_are_steps_between_the_knots(component):
    plan = small_plan()
    figure = figures.forces(plan, small_run(), component)
    axis = "xyz".index(component)
    for leg, axes in enumerate(figure.axes):
        steps = next(patch for patch in axes.patches if patch.get_gid() == "planned").get_data()
        assert np.array_equal(steps.values, plan.lam[:, leg, axis] + plan.f[:, leg, axis])
        assert np.array_equal(steps.edges, plan.t)


def test_forces_refuse_an_unknown_component():
    with pytest.raises(ValueError, match="'n'"):
        figures.forces(small_plan(), component="n")


def test_tracking_is_in_millimetres_and_degrees():
    figure = figures.tracking(small_run(shift=0.003))
    assert np.allclose(lines(figure, "y")[0][:, 1], 3.0) and np.allclose(lines(figure, "x")[0][:, 1], 0.0)
    assert np.allclose(lines(figure, "pitch")[0][:, 1], np.rad2deg(0.01))


def test_torque_of_forces_agrees_with_the_cross_product():
    plan = small_plan()
    middle = 0.5 * ((plan.p - plan.x[:, None])[1:] + (plan.p - plan.x[:, None])[:-1])
    assert np.allclose(plan.contact_torque, np.cross(middle, plan.lam).sum(axis=1))


def test_torque_mismatch_draws_the_claim_and_the_truth():
    plan = small_plan()
    figure = figures.torque_mismatch(plan, plan)
    claimed = ((plan.U_plus - plan.U_minus) / 4.0).sum(axis=1)
    for row, axes in enumerate(figure.axes[::2]):
        data = {patch.get_gid(): patch.get_data().values for patch in axes.patches if patch.get_gid()}
        assert np.allclose(data["claimed"], claimed[:, row])
        assert np.allclose(data["real"], plan.contact_torque[:, row])


def test_pictures_show_themselves_the_same_each_time_on_white():
    figure = figures.gait(small_plan())
    png, size = figure._repr_png_()
    assert png.startswith(b"\x89PNG") and size == {"width": 768, "height": 221}
    assert png == figures.gait(small_plan()).png()
    assert to_hex(figure.get_facecolor()) == "#ffffff"


def test_spans_tile_the_time_of_every_leg():
    modes = plan_modes(np.array(SWING), np.array(KIND))
    rebuilt = np.full_like(modes, -1)
    for leg, mode, start, stop in spans(modes):
        assert np.all(rebuilt[leg, start:stop] == -1) and start < stop
        rebuilt[leg, start:stop] = mode
    assert np.array_equal(rebuilt, modes)
