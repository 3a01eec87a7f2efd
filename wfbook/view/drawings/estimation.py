"""Chapter 7's drawings: what is measured, how estimates drift, and how sure the filter is.

Black is what is true or measured, light blue what the filter believes. Bands and ellipses are where it
believes the truth to be, 95 times in a hundred. The ground is orange while the robot stands on wheels alone.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse, FancyBboxPatch, Patch
from matplotlib.ticker import NullLocator
from scipy.stats import chi2

from wfbook.view.spans import spans
from wfbook.view.style import BODY, ESTIMATED, FOOT, INK, MEASURED, PALE, PAPER, WHEEL, Picture, tidy

if TYPE_CHECKING:
    from wfbook.recording import Estimate, Recording

_SHARE = 0.95
SIDE = float(np.sqrt(chi2.ppf(_SHARE, 1)))
"""Standard deviations on either side that hold 95 % of a normal distribution."""
_ROUND = float(np.sqrt(chi2.ppf(_SHARE, 2)))
"""Likewise the size of an ellipse in the plane, in standard deviations."""

_STROKES = ("-", "--", ":", "-.")
_MAGNIFICATIONS = (1, 2, 5, 10, 20, 50)
_VISIBLE = 0.12
"""Up to which size in metres errors are magnified in the view from above."""


def measuring_stick() -> Picture:
    """Sketch what the filter knows of a standing leg: where its end is, and where the trunk sees it."""
    figure = Picture(8.0, 3.2)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.axhline(0.0, color=PALE, linewidth=1.5)
    trunk = np.array([0.62, 0.36])
    axes.add_patch(
        FancyBboxPatch(
            trunk - [0.24, 0.05], 0.48, 0.1, boxstyle="round,pad=0.01", facecolor="#EDEFF1", edgecolor=BODY
        )
    )
    for hip, knee, end, colour, name in (
        (0.43, (0.35, 0.2), (0.45, 0.02), FOOT, "foot"),
        (0.81, (0.74, 0.2), (0.83, 0.04), WHEEL, "wheel"),
    ):
        joints = np.array([(hip, 0.34), knee, end])
        axes.plot(*joints.T, color=BODY, linewidth=5, solid_capstyle="round", zorder=1)
        radius = end[1]
        axes.add_patch(Circle(end, radius, facecolor=colour, edgecolor=INK, zorder=2))
        axes.annotate(name, (end[0], -0.05), ha="center", va="center", color=INK)
    foot = np.array([0.45, 0.02])
    axes.plot(*trunk, "s", color=INK, markersize=7, zorder=4)
    axes.annotate("inertial unit: force and turning", (trunk[0], trunk[1] + 0.1), ha="center", color=INK)
    for start, stop, colour, label, place in (
        ((0.0, 0.0), trunk, ESTIMATED, r"$\mathbf{r}$", (0.26, 0.2)),
        ((0.0, 0.0), foot, ESTIMATED, r"$\mathbf{p}_l$", (0.2, 0.035)),
        (trunk, foot, MEASURED, "encoders:\n" + r"$\mathbf{R}^T(\mathbf{p}_l - \mathbf{r})$", (0.52, 0.1)),
    ):
        arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", stop, start, arrowprops=arrow, zorder=3)
        axes.annotate(label, place, color=INK, fontsize="large", ha="left")
    axes.plot(0.0, 0.0, "+", color=INK, markersize=14, markeredgewidth=2)
    axes.annotate("where it began", (0.0, -0.05), ha="center", va="center", color=INK)
    handles = [
        Line2D([], [], color=ESTIMATED, linewidth=2.0, label="to be estimated"),
        Line2D([], [], color=MEASURED, linewidth=2.0, label="measured"),
    ]
    axes.legend(handles=handles, loc="center right", frameon=False)
    axes.set_xlim(-0.15, 1.35)
    axes.set_ylim(-0.09, 0.52)
    return figure


def rolling_end(radius: float, turn: float, colour: str, moved: float) -> Picture:
    """Draw a round end before and after it rolled.

    Args:
        radius: of the foot or the wheel, m.
        turn: by which it turned, rad, forwards positive.
        colour: of the end.
        moved: how far its centre got, m.
    """
    figure = Picture(8.0, 2.4)
    axes = figure.add_subplot()
    tidy(axes)
    axes.set_aspect("equal")
    axes.axhline(0.0, color=INK, linewidth=1.2)
    for place, angle, alpha, name in ((0.0, 0.0, 0.25, "before"), (moved, turn, 1.0, "after")):
        centre = np.array([1e3 * place, 1e3 * radius])
        axes.add_patch(
            Circle(centre, 1e3 * radius, facecolor=colour, edgecolor=INK, alpha=alpha, gid=f"end {name}")
        )
        mark = centre + 1e3 * radius * np.array([-np.sin(angle), -np.cos(angle)])
        axes.plot(*np.array([centre, mark]).T, color=PAPER, linewidth=3.0, gid=f"mark {name}")
        axes.plot(*centre, "o", color=INK, alpha=alpha, markersize=4)
    arrow = {"arrowstyle": "-|>", "color": MEASURED, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (1e3 * moved, 1e3 * radius), (0.0, 1e3 * radius), arrowprops=arrow)
    axes.set_xlim(-110, 110)
    axes.set_ylim(-6, 86)
    axes.set_xlabel("x, forward (mm)")
    axes.set_ylabel("z (mm)")
    return figure


def paths(recording: "Recording", believed: Mapping[str, np.ndarray], axis: int = 0) -> Picture:
    """Draw one coordinate of the true and of believed positions over time, and by how much they differ.

    Args:
        recording: with the truth.
        believed: by name, ``(N, 3)`` positions of the inertial unit.
        axis: 0 forward, 1 left, 2 up.
    """
    figure = Picture(8.0, 3.6)
    top, bottom = figure.subplots(2, 1, sharex=True)
    start, going = int(np.searchsorted(recording.t, 0.0)), recording.t >= 0.0
    true = recording.path[:, axis] - recording.path[start, axis]
    name = ("x, forward", "y, left", "z, up")[axis]
    top.plot(recording.t[going], true[going], color=MEASURED, linewidth=2.0, label="true", gid="true")
    for (label, path), stroke in zip(believed.items(), _STROKES, strict=False):
        moved = path[:, axis] - path[start, axis]
        line = {"color": ESTIMATED, "linestyle": stroke, "linewidth": 2.0, "label": label, "gid": label}
        top.plot(recording.t[going], moved[going], **line)
        bottom.plot(recording.t[going], 1e3 * (moved - true)[going], **line)
    bottom.axhline(0.0, color=MEASURED, linewidth=1.0)
    top.set_ylabel(f"{name} (m)")
    bottom.set_ylabel("believed − true (mm)")
    bottom.set_xlabel("time (s)")
    bottom.set_xlim(0.0, recording.t[-1])
    for axes in (top, bottom):
        tidy(axes)
        _shade_wheels(axes, recording)
    top.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def above(recording: "Recording", estimate: "Estimate", every: float = 0.4) -> Picture:
    """Draw the believed and the true path from above, with where the filter thinks that the truth is.

    Errors are millimetres on a way of a metre. So the ellipses, and the distance from the believed path to
    the true one, are drawn larger by a factor that the title says.

    Args:
        recording: with the truth.
        estimate: of a filter.
        every: time between two ellipses, s.
    """
    figure = Picture(8.0, 3.4)
    axes = figure.add_subplot()
    tidy(axes)
    going = estimate.t >= 0.0
    error, covariance = estimate.error[going, :2], estimate.covariance[going, :2, :2]
    size = max(float(np.abs(error).max()), _ROUND * float(np.sqrt(covariance[:, [0, 1], [0, 1]].max())))
    factor = max((m for m in _MAGNIFICATIONS if m * size < _VISIBLE), default=1)
    path = estimate.path[going, :2]
    true = path + factor * error
    axes.plot(*path.T, color=ESTIMATED, linewidth=2.5, label="believed", gid="believed")
    axes.plot(*true.T, color=MEASURED, linewidth=1.5, label="true", gid="true")
    for k in np.flatnonzero(np.diff(np.floor(estimate.t[going] / every + 1e-9), prepend=-1.0)):
        values, vectors = np.linalg.eigh(covariance[k])
        width, height = 2 * _ROUND * factor * np.sqrt(np.maximum(values, 0.0))
        angle = np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0]))
        style = {"facecolor": ESTIMATED, "alpha": 0.3, "edgecolor": ESTIMATED, "linewidth": 1.0}
        axes.add_patch(Ellipse(path[k], width, height, angle=angle, gid="ellipse", **style))
        axes.plot(*np.array([path[k], true[k]]).T, color=MEASURED, linewidth=0.7)
        axes.plot(*true[k], "o", color=MEASURED, markersize=4)
    axes.margins(0.05, 0.1)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, forward (m)")
    axes.set_ylabel("y, left (m)")
    scale = "errors to scale" if factor == 1 else f"errors drawn {factor} times as large"
    axes.set_title(f"from above, {scale}", loc="left", fontsize="medium", color=INK)
    handles, _ = axes.get_legend_handles_labels()
    handles.append(Patch(color=ESTIMATED, alpha=0.3, label="95 % ellipse"))
    figure.legend(handles=handles, loc="outside upper right", ncols=3, frameon=False)
    return figure


def errors(recording: "Recording", estimate: "Estimate") -> Picture:
    """Draw the errors of position and velocity over time, in the bands where the filter thinks they are."""
    figure = Picture(9.0, 4.0)
    grid = figure.subplots(2, 3, sharex=True)
    going = estimate.t >= 0.0
    t, deviations = estimate.t[going], estimate.deviations[going]
    for row, unit in enumerate(("position (mm)", "velocity (mm/s)")):
        for axis, name in enumerate("xyz"):
            axes, state = grid[row, axis], 3 * row + axis
            tidy(axes)
            _shade_wheels(axes, recording)
            band = 1e3 * SIDE * deviations[:, state]
            axes.fill_between(t, -band, band, color=ESTIMATED, alpha=0.35, linewidth=0, gid="band")
            axes.plot(
                t, 1e3 * estimate.error[going, state], color=MEASURED, linewidth=1.1, gid=f"error {state}"
            )
            if row == 0:
                axes.set_title(name, fontsize="medium")
        grid[row, 0].set_ylabel(f"error of the\n{unit}")
    for axes in grid[1]:
        axes.set_xlabel("time (s)")
    grid[0, 0].set_xlim(0.0, t[-1])
    handles = [
        Line2D([], [], color=MEASURED, label="true − believed"),
        Patch(color=ESTIMATED, alpha=0.35, label="95 % band of the filter"),
        Patch(color=WHEEL, alpha=0.12, label="wheels only"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
    return figure


def uncertainty(estimate: "Estimate", title: str | None = None) -> Picture:
    """Draw the standard deviations that the filter has of position, velocity and orientation over time."""
    figure = Picture(9.0, 2.8)
    panels = figure.subplots(1, 3)
    groups = (
        ("position (mm)", 0, 1e3, ("x", "y", "z")),
        ("velocity (mm/s)", 3, 1e3, ("x", "y", "z")),
        ("orientation (°)", 6, 180.0 / np.pi, ("roll", "pitch", "yaw")),
    )
    for axes, (name, first, scale, components) in zip(panels, groups, strict=True):
        tidy(axes)
        for i, (component, stroke) in enumerate(zip(components, _STROKES, strict=False)):
            line = {"color": ESTIMATED, "linestyle": stroke, "linewidth": 2.0, "label": component}
            axes.plot(estimate.t, scale * estimate.deviations[:, first + i], gid=component, **line)
        axes.set_title(name, fontsize="medium")
        axes.set_ylim(0.0)
        axes.set_xlim(estimate.t[0], estimate.t[-1])
        axes.set_xlabel("time (s)")
        axes.legend(frameon=False, fontsize="small")
    panels[0].set_ylabel("standard deviation")
    if title:
        figure.suptitle(title, fontsize="medium")
    return figure


def speeds(true: float, believed: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Picture:
    """Draw how fast filters believe a robot to be that rolls at a constant speed.

    Args:
        true: speed, m/s.
        believed: by name, times and speeds.
    """
    figure = Picture(8.0, 2.8)
    axes = figure.add_subplot()
    tidy(axes)
    axes.axhline(true, color=MEASURED, linewidth=1.5, label="true", gid="true")
    for (name, (t, v)), stroke in zip(believed.items(), _STROKES, strict=False):
        axes.plot(t, v, color=ESTIMATED, linestyle=stroke, linewidth=2.0, label=name, gid=name)
    axes.set_ylim(0.0, 1.25 * true)
    axes.set_xlim(0.0, max(t[-1] for t, _ in believed.values()))
    axes.set_xlabel("time (s)")
    axes.set_ylabel("speed along x (m/s)")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def consistency(t: np.ndarray, values: np.ndarray, states: int, bounds: tuple[float, float]) -> Picture:
    """Draw the mean NEES of several runs over time, between its bounds.

    Args:
        t: ``(N,)`` time.
        values: ``(runs, N)`` NEES.
        states: how many numbers are estimated: what the mean is to be.
        bounds: in which it is to be 95 % of the time.
    """
    figure = Picture(8.0, 2.6)
    axes = figure.add_subplot()
    draw_consistency(axes, t, values, states, bounds)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def draw_consistency(
    axes: Any, t: np.ndarray, values: np.ndarray, states: int, bounds: tuple[float, float]
) -> None:
    """Draw what :func:`consistency` draws; above the bounds a filter is too sure, below too shy."""
    tidy(axes)
    mean = values.mean(axis=0)
    axes.axhspan(*bounds, color=ESTIMATED, alpha=0.3, linewidth=0, label="95 % bounds", gid="bounds")
    axes.axhline(states, color=ESTIMATED, linewidth=1.0)
    axes.plot(t, mean, color=MEASURED, linewidth=1.3, label="mean NEES", gid="nees")
    axes.set_xlim(t[0], t[-1])
    axes.set_yscale("log")
    axes.set_yticks([states * factor for factor in (0.2, 0.5, 1, 2, 5, 10, 100, 1000)])
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylim(min(0.3 * bounds[0], 0.8 * mean.min()), max(3.0 * bounds[1], 1.3 * mean.max()))
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"mean NEES of {len(values)} runs")


def _shade_wheels(axes: Any, recording: "Recording") -> None:
    """Colour the time in which the robot stands on wheels and on no foot."""
    feet = (recording.touching & ~recording.wheels).any(axis=1)
    alone = (recording.touching & recording.wheels).any(axis=1) & ~feet
    for _, on, first, stop in spans(alone[None].astype(int)):
        if on and recording.t[stop - 1] > 0.0:
            axes.axvspan(
                max(recording.t[first], 0.0), recording.t[stop - 1], color=WHEEL, alpha=0.12, linewidth=0
            )
