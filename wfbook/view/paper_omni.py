"""Pictures of the comparison with paper B: the hand, the legs and the trunk over time.

Wine is where the hand is, blue what was asked for, dark what was measured of the rest. White diamonds with
bars are the paper's means and standard deviations. Its pitch is shown with a shift.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from wfbook.modes import LEGS
from wfbook.omni.robot import HAND_HEIGHT
from wfbook.omni.waves import wave_height
from wfbook.view.style import HAND, INK, MEASURED, PALE, PAPER, PLANNED, WHEEL, Picture, tidy

if TYPE_CHECKING:
    from wfbook.paper.drives import Drive

_ANGLES = ("roll", "pitch", "yaw")
_STROKES = ("-", "--", ":")
_ASIDE = 1.03
"""Where the paper's numbers stand, in durations."""


def heights(shown: "Mapping[str, Drive]", count: int, shift: float) -> Picture:
    """Draw the hand's height over waves under several controllers, as the paper's Fig. 6.

    Args:
        shown: by name, a run; the first one's roll, pitch and yaw are drawn, too.
        count: of the waves.
        shift: of the pitch.

    Returns:
        From above: the heights, the same magnified, the angles, and the ground.
    """
    figure = Picture(8.0, 6.4)
    top, middle, bottom, ground = figure.subplots(4, 1, sharex=True, height_ratios=(1.6, 1.2, 1.2, 0.4))
    still = sorted(shown.values(), key=lambda run: run.hand[:, 2].std())[:-1] or list(shown.values())
    for (name, run), stroke in zip(shown.items(), _STROKES, strict=True):
        for axes in (top, middle):
            axes.plot(
                *(run.trunk[:, 0], run.hand[:, 2]), color=HAND, linestyle=stroke, label=name, gid=name,
                linewidth=1.6 if stroke == "-" else 1.2,
            )  # fmt: skip
    first = next(iter(shown.values()))
    reach = max(np.abs(run.hand[:, 2] - HAND_HEIGHT).max() for run in still)
    middle.set_ylim(HAND_HEIGHT - 1.3 * reach, HAND_HEIGHT + 1.3 * reach)
    _angles(bottom, first.trunk[:, 0], np.add(first.rpy, [0.0, shift, 0.0]))
    for axes, text in ((top, "hand's height (m)"), (middle, "magnified (m)"), (bottom, "angles (rad)")):
        tidy(axes)
        axes.set_ylabel(text)
    for axes in (top, middle):
        axes.axhline(HAND_HEIGHT, color=PLANNED, linewidth=1.0, zorder=1)
    x = first.trunk[:, 0]
    ground.fill_between(x, wave_height(x, count), color=PALE, linewidth=0)
    ground.set_ylabel("ground\n(m)")
    ground.set_xlabel("way of the trunk (m)")
    tidy(ground)
    top.set_xlim(x.min(), x.max())
    target = Line2D([], [], color=PLANNED, linewidth=1.0, label="target")
    figure.legend(
        handles=[*top.lines[: len(shown)], target], loc="outside upper left", ncols=2, frameon=False
    )
    bottom.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def hand(run: "Drive", printed: Mapping[str, tuple[float, float]], shift: float, wheels: bool) -> Picture:
    """Draw the hand's height and angles over time beside the paper's numbers, as its Fig. 7.

    Args:
        run: to draw.
        printed: the paper's mean and standard deviation of ``height``, ``roll``, ``pitch`` and ``yaw``.
        shift: of the pitch.
        wheels: whether to draw how far the wheels and the trunk are ahead of where they were, too.
    """
    figure = Picture(8.0, 5.6 if wheels else 4.0)
    top, middle, *more = figure.subplots(3 if wheels else 2, 1, sharex=True)
    aside = _ASIDE * run.t[-1]
    top.plot(run.t, run.hand[:, 2], color=HAND, linewidth=1.6, gid="height")
    top.axhline(HAND_HEIGHT, color=PLANNED, linewidth=1.0, zorder=1)
    _printed(top, aside, printed["height"], "height in the paper")
    top.set_ylabel("hand's height (m)")
    _angles(middle, run.t, np.add(run.rpy, [0.0, shift, 0.0]))
    for place, name in enumerate(_ANGLES):
        at = aside + 0.05 * place * run.t[-1]
        _printed(middle, at, printed[name], f"{name} in the paper")
        middle.annotate(
            name,
            (at, sum(printed[name])),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            fontsize=7,
            color=INK,
        )
    middle.margins(y=0.12)
    middle.set_ylabel("angles (rad)")
    middle.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    handles: list[Any] = [
        Line2D([], [], color=HAND, label="hand"),
        Line2D([], [], color=PLANNED, linewidth=1.0, label="target"),
        Line2D([], [], marker="D", color=INK, markerfacecolor=PAPER, linestyle="-", label="in the paper"),
    ]
    top.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    for axes in more:
        shift = 100.0 * run.wheels
        for leg, name in enumerate(LEGS):
            axes.plot(run.t, shift[:, leg], color=WHEEL, linewidth=1.2, gid=f"{name} wheel")
        trunk = 100.0 * (run.trunk[:, 0] - run.trunk[0, 0])
        axes.plot(run.t, trunk, color=MEASURED, linewidth=1.2, gid="trunk")
        axes.set_ylabel("moved ahead (cm)")
        handles = [
            Line2D([], [], color=WHEEL, label="wheels"),
            Line2D([], [], color=MEASURED, label="trunk"),
        ]
        axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    for axes in (top, middle, *more):
        tidy(axes)
    top.set_xlim(0.0, aside + 0.13 * run.t[-1])
    (more or [middle])[-1].set_xlabel("time (s)")
    return figure


def legs(run: "Drive") -> Picture:
    """Draw hip and knee of each leg, planned and measured, as the paper's Fig. 9: hips left, knees right."""
    figure = Picture(9.0, 5.0)
    grid = figure.subplots(2, 2, sharex=True)
    for leg, (name, axes) in enumerate(zip(LEGS, grid.flat, strict=True)):
        right = axes.twinx()
        for side, joint, stroke in ((axes, 0, "-"), (right, 1, "--")):
            for angles, colour, width, what in (
                (run.legs_ref, PLANNED, 2.4, "planned"),
                (run.legs, MEASURED, 1.0, "measured"),
            ):
                side.plot(
                    *(run.t, angles[:, 2 * leg + joint]), color=colour, linewidth=width, linestyle=stroke,
                    gid=f"{name} {('hip', 'knee')[joint]} {what}",
                )  # fmt: skip
        tidy(axes)
        right.spines[["top"]].set_visible(False)
        axes.set_title(name, loc="left", color=INK)
        axes.set_ylabel("hip (rad)")
        right.set_ylabel("knee (rad)")
        for side in (axes, right):
            low, high = side.get_ylim()
            middle, half = 0.5 * (low + high), max(0.5 * (high - low), 0.05)
            side.set_ylim(middle - half, middle + half)
    for axes in grid[-1]:
        axes.set_xlabel("time (s)")
    grid[0, 0].set_xlim(run.t[0], run.t[-1])
    handles = [
        Line2D([], [], color=PLANNED, linewidth=2.4, label="planned"),
        Line2D([], [], color=MEASURED, linewidth=1.0, label="measured"),
        Line2D([], [], color=INK, label="hip"),
        Line2D([], [], color=INK, linestyle="--", label="knee"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
    return figure


def pose(run: "Drive") -> Picture:
    """Draw the hand's place and its angles in the trunk's axes, as the paper's Fig. 10."""
    figure = Picture(9.0, 3.6)
    left, right = figure.subplots(1, 2)
    moved = 1e3 * (run.hand - run.hand[0])
    for axis, name in enumerate("xy"):
        left.plot(run.t, moved[:, axis], color=HAND, linestyle=_STROKES[axis], label=name, gid=name)
    left.set_ylabel("x and y from the start (mm)")
    height = left.twinx()
    height.plot(run.t, run.hand[:, 2], color=HAND, linestyle=_STROKES[2], gid="z")
    height.axhline(HAND_HEIGHT, color=PLANNED, linewidth=1.0, zorder=1)
    height.set_ylim(HAND_HEIGHT - 0.02, HAND_HEIGHT + 0.02)
    height.set_ylabel("z (m)")
    height.spines[["top"]].set_visible(False)
    _angles(right, run.t, run.base_rpy)
    for axis in range(3):
        asked = run.base_rpy_ref[:, axis]
        right.plot(
            run.t, asked, color=PLANNED, alpha=0.5, linewidth=3.0, zorder=1, gid=f"{_ANGLES[axis]} asked"
        )
    right.set_ylabel("angles in the trunk's axes (rad)")
    for axes in (left, right):
        tidy(axes)
        axes.set_xlabel("time (s)")
        axes.set_xlim(run.t[0], run.t[-1])
    lines = [*left.lines, Line2D([], [], color=HAND, linestyle=_STROKES[2], label="z, right axis")]
    target = Line2D([], [], color=PLANNED, alpha=0.5, linewidth=3.0, label="asked for")
    for axes, handles in ((left, lines), (right, [*right.lines[:3], target])):
        axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, frameon=False)
    return figure


def squat(run: "Drive") -> Picture:
    """Draw how high the trunk and the hand are while the robot squats, and by how much the hand is off."""
    figure = Picture(8.0, 4.4)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    top.plot(run.t, run.hand[:, 2], color=HAND, linewidth=1.6, label="hand", gid="hand")
    top.plot(run.t, run.trunk[:, 2], color=MEASURED, linewidth=1.6, label="trunk", gid="trunk")
    top.axhline(HAND_HEIGHT, color=PLANNED, linewidth=1.0, zorder=1, label="hand's target")
    top.set_ylim(0.0)
    top.set_ylabel("height (m)")
    bottom.plot(run.t, 1e3 * (run.hand - run.hand_ref)[:, 2], color=HAND, linewidth=1.2, gid="error")
    bottom.axhline(0.0, color=PLANNED, linewidth=1.0, zorder=1)
    bottom.set_ylabel("hand, height\nerror (mm)")
    bottom.set_xlabel("time (s)")
    for axes in (top, bottom):
        tidy(axes)
    top.set_xlim(run.t[0], run.t[-1])
    top.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def _angles(axes: Any, x: np.ndarray, rpy: np.ndarray) -> None:
    """Draw the hand's roll, pitch and yaw ``(N, 3)``."""
    for axis, (name, stroke) in enumerate(zip(_ANGLES, _STROKES, strict=True)):
        axes.plot(x, rpy[:, axis], color=HAND, linestyle=stroke, linewidth=1.2, label=name, gid=name)


def _printed(axes: Any, x: float, said: tuple[float, float], gid: str) -> None:
    """Draw a mean and a standard deviation of the paper's."""
    style = {"color": INK, "markerfacecolor": PAPER, "capsize": 3.0, "markersize": 5.0, "zorder": 3}
    container = axes.errorbar(x, *said, fmt="D", **style)
    container.lines[0].set_gid(gid)
