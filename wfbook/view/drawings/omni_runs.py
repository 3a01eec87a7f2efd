"""Chapter 12's drawings: hands over waves, who does the work, what a lever explains, modes, three clocks."""

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from wfbook.modes import LEGS
from wfbook.omni.machine import Mode
from wfbook.omni.robot import ARM_V, HAND_HEIGHT, locked_model
from wfbook.view.style import (
    BODY,
    HAND,
    INK,
    LIMIT,
    MEASURED,
    PALE,
    PLANNED,
    SWING,
    WHEEL,
    Picture,
    tidy,
)

if TYPE_CHECKING:
    from wfbook.omni.runs import OmniRun
    from wfbook.terrain import Terrain

STYLES = ("-", "--", "-.", ":", (0, (1, 3)), (0, (6, 2, 1, 2, 1, 2)))
"""Strokes of runs that are compared."""

_ANGLES = ("about x", "about y", "about z")
_LETTERS = 115
"""That fit in a row of a legend, marks and gaps counted as letters."""
_LEAST_MM, _MOST_MM = 0.03, 1000.0


def heights(runs: "Mapping[str, OmniRun]", zoom: float = 8.0) -> Picture:
    """Draw the hand's height over the way, and under it its error, magnified.

    Args:
        runs: by name, on one terrain, along x.
        zoom: what the magnified view shows to each side, in millimetres.
    """
    figure = Picture(9.0, 5.0)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.2, 1.0))
    for axes in (top, bottom):
        tidy(axes)
    terrain = next(iter(runs.values())).terrain
    ways = np.concatenate([run.pose[:, 0] for run in runs.values()])
    _draw_ground(top, terrain, float(ways.min()), float(ways.max()))
    top.axhline(HAND_HEIGHT, color=PLANNED, linewidth=3.0, alpha=0.35, gid="target")
    bottom.axhline(0.0, color=PLANNED, linewidth=3.0, alpha=0.35)
    for (name, run), style in zip(runs.items(), STYLES, strict=False):
        way, look = run.pose[:, 0], {"color": HAND, "linestyle": style, "linewidth": 1.5, "gid": name}
        error = 1e3 * (run.hand[:, 2] - run.hand_ref[:, 2])
        top.plot(way, run.hand[:, 2], label=name, **look)
        bottom.plot(way, error, **look)
        if not run.metrics["upright"]:
            top.plot(way[-1], run.hand[-1, 2], "X", color=LIMIT, markersize=9, gid=f"{name} falls")
    top.set_ylim(-0.03, 1.25)
    top.set_ylabel("hand, ground (m)")
    bottom.set_ylim(-zoom, zoom)
    bottom.set_ylabel("hand, from where\nit should be (mm)")
    bottom.set_xlabel("way of the commanded base (m)")
    bottom.set_xlim(float(ways.min()), float(ways.max()))
    handles, _ = top.get_legend_handles_labels()
    handles.append(Line2D([], [], color=PLANNED, linewidth=3.0, alpha=0.35, label="target"))
    _name(figure, handles)
    return figure


def _name(figure: Picture, handles: list[Line2D]) -> None:
    """Put a legend above the axes, in as many columns as its longest text leaves room for."""
    longest = max(len(handle.get_label()) for handle in handles)
    columns = min(len(handles), max(1, _LETTERS // (longest + 8)))
    figure.legend(handles=handles, loc="outside upper center", ncols=columns, frameon=False)


def _draw_ground(axes: Axes, terrain: "Terrain", first: float, last: float) -> None:
    """Fill the ground's profile along x."""
    x = np.linspace(first, last, 400)
    z = [height if (height := terrain.height(place, 0.0)) is not None else 0.0 for place in x]
    axes.fill_between(x, z, -0.03, color=PALE, linewidth=0.0, gid="ground")


def errors(runs: "Mapping[str, OmniRun]") -> Picture:
    """Draw how far the hand is from where it should be over time; a cross is a fall.

    Args:
        runs: by name.
    """
    figure = Picture(9.0, 3.6)
    axes = figure.add_subplot()
    tidy(axes)
    for (name, run), style in zip(runs.items(), STYLES, strict=False):
        error = 1e3 * np.linalg.norm(run.hand - run.hand_ref, axis=1)
        look = {"color": HAND, "linestyle": style, "linewidth": 1.4}
        axes.semilogy(run.t, np.maximum(error, _LEAST_MM), label=name, gid=name, **look)
        if run.events:
            when = min(run.events[0][0], float(run.t[-1]))
            height = np.clip(np.interp(when, run.t, error), _LEAST_MM, _MOST_MM)
            axes.plot(when, height, "X", color=LIMIT, markersize=9, gid=f"{name} ends")
    axes.set_xlim(0.0)
    axes.set_ylim(_LEAST_MM, _MOST_MM)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("hand's error (mm)")
    handles, _ = axes.get_legend_handles_labels()
    handles.append(Line2D([], [], color=LIMIT, marker="X", linestyle="", markersize=9, label="given up"))
    _name(figure, handles)
    return figure


def pitch(run: "OmniRun") -> np.ndarray:
    """Return the trunk's pitch ``(N,)``, nose down positive."""
    w, x, y, z = run.qpos[:, 3:7].T
    return np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))


def arm_room(run: "OmniRun") -> np.ndarray:
    """Return how far the arm's joint that is nearest to a limit is from it, ``(N,)``."""
    model, angles = locked_model(), run.qpos[:, 1 + ARM_V]
    low, high = model.lowerPositionLimit[15:], model.upperPositionLimit[15:]
    return np.minimum(angles - low, high - angles).min(axis=1)


def shares(runs: "Mapping[str, OmniRun]") -> Picture:
    """Draw who does the work: the trunk's height and pitch, and the room that the arm's joints have left.

    Args:
        runs: by name, along x.
    """
    figure = Picture(9.0, 5.2)
    rows = figure.subplots(3, 1, sharex=True)
    for (name, run), style in zip(runs.items(), STYLES, strict=False):
        way, look = run.pose[:, 0], {"linestyle": style, "linewidth": 1.5, "gid": name}
        rows[0].plot(way, run.qpos[:, 2], color=BODY, label=name, **look)
        rows[1].plot(way, np.degrees(pitch(run)), color=BODY, **look)
        rows[2].plot(way, np.degrees(arm_room(run)), color=HAND, **look)
    rows[2].axhline(0.0, color=LIMIT, linewidth=2.0, gid="limit")
    for axes in rows:
        tidy(axes)
    rows[0].set_ylabel("trunk (m)")
    rows[1].set_ylabel("trunk's pitch,\nnose down (°)")
    rows[2].set_ylabel("room of the\narm's joints (°)")
    rows[2].set_xlabel("way of the commanded base (m)")
    handles = [
        Line2D([], [], color=INK, linestyle=style, label=name)
        for name, style in zip(runs, STYLES, strict=False)
    ]
    _name(figure, handles)
    return figure


def levers(run: "OmniRun") -> Picture:
    """Draw the error of the hand's height beside what the trunk's tilt alone makes of it.

    The hand is put where it should be in axes that are turned with the trunk.

    Args:
        run: of an arm that takes its trunk to be level.
    """
    figure = Picture(9.0, 2.8)
    axes = figure.add_subplot()
    tidy(axes)
    way, error = run.pose[:, 0], run.hand[:, 2] - run.hand_ref[:, 2]
    axes.plot(way, 1e3 * error, color=HAND, linewidth=3.5, alpha=0.45, label="measured", gid="measured")
    look = {"color": PLANNED, "linewidth": 1.5, "linestyle": "--"}
    axes.plot(way, 1e3 * _tilted(run), label="from the tilt", gid="from the tilt", **look)
    axes.set_xlabel("way of the commanded base (m)")
    axes.set_ylabel("hand too high (mm)")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _tilted(run: "OmniRun") -> np.ndarray:
    """Return how much higher than it should be a hand is that tilts with the trunk, ``(N,)``."""
    rows = zip(run.hand_ref - run.qpos[:, :3], run.qpos[:, 3:7], run.pose[:, 2], strict=True)
    level = (
        (away, pin.Quaternion(*q).toRotationMatrix(), pin.utils.rotate("z", -yaw)) for away, q, yaw in rows
    )
    return np.array([(R_wb @ back @ away - away)[2] for away, R_wb, back in level])


def hand_turns(run: "OmniRun") -> np.ndarray:
    """Return how the hand is turned from how it should be: about the commanded base's axes, ``(N, 3)``."""
    rows = zip(run.pose[:, 2], run.hand_rotation, run.hand_rotation_ref, strict=True)
    return np.array([pin.utils.rotate("z", -yaw) @ pin.log3(R @ wanted.T) for yaw, R, wanted in rows])


def hand_pose(run: "OmniRun") -> Picture:
    """Draw how far the hand is from its place and its turn over time; Paper B's Figs 6, 7 and 10 show both.

    Args:
        run: whose hand.
    """
    figure = Picture(9.0, 4.2)
    top, bottom = figure.subplots(2, 1, sharex=True)
    error = 1e3 * (run.hand - run.hand_ref)
    angles = np.degrees(hand_turns(run))
    for axes, values, names in ((top, error, "xyz"), (bottom, angles, _ANGLES)):
        tidy(axes)
        axes.axhline(0.0, color=PLANNED, linewidth=3.0, alpha=0.35)
        for line, name, style in zip(values.T, names, ("--", ":", "-"), strict=True):
            axes.plot(run.t, line, color=HAND, linestyle=style, linewidth=1.5, label=name, gid=name)
        axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    top.set_ylabel("hand, from where\nit should be (mm)")
    bottom.set_ylabel("hand, from how it\nshould be turned (°)")
    bottom.set_xlabel("time (s)")
    return figure


def modes(run: "OmniRun") -> Picture:
    """Draw over time in which mode the robot is, which wheels stand, and how far the hand is off.

    Args:
        run: in which modes change.
    """
    figure = Picture(9.0, 5.0)
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(1.5, 1.0, 1.0))
    names = [mode.name.lower() for mode in Mode]
    for mode, first, last in _spans(run.mode):
        colour = PLANNED if mode in (Mode.WHEELED, Mode.LEGGED) else LIMIT if mode == Mode.HALTED else PALE
        span, name = run.t[last] - run.t[first], names[mode]
        top.barh(mode, span, left=run.t[first], height=0.7, color=colour, linewidth=0, gid=name)
    top.set_yticks(range(len(names)), names)
    for leg, name in enumerate(LEGS):
        for stands, first, last in _spans(run.stance[:, leg].astype(int)):
            span, colour = run.t[last] - run.t[first], WHEEL if stands else SWING
            middle.barh(leg, span, left=run.t[first], height=0.7, color=colour, linewidth=0, gid=name)
    middle.set_yticks(range(len(LEGS)), LEGS)
    bottom.plot(run.t, 1e3 * (run.hand[:, 2] - run.hand_ref[:, 2]), color=HAND, linewidth=1.5, gid="hand")
    for axes in (top, middle, bottom):
        tidy(axes)
    for axes, rows in ((top, len(names)), (middle, len(LEGS))):
        axes.set_ylim(rows - 0.4, -0.6)
        axes.grid(axis="y", visible=False)
    top.set_ylabel("mode")
    middle.set_ylabel("wheels that\nstand or swing")
    bottom.set_ylabel("hand too\nhigh (mm)")
    bottom.set_xlabel("time (s)")
    bottom.set_xlim(0.0, run.t[-1])
    return figure


def _spans(values: np.ndarray) -> list[tuple[int, int, int]]:
    """Return each value that lasts, with its first sample and that of the next value (or the last)."""
    edges = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values) - 1]
    return [(int(values[first]), first, last) for first, last in pairwise(edges)]


def clocks(t: np.ndarray, torques: Mapping[str, np.ndarray], plans: np.ndarray) -> Picture:
    """Draw one motor's torque as planned, fed back and acting, over a few hundredths of a second.

    Args:
        t: ``(N,)`` milliseconds.
        torques: ``(N,)`` by name, from the slowest clock to the fastest.
        plans: times of new plans.
    """
    figure = Picture(9.0, 3.0)
    axes = figure.add_subplot()
    tidy(axes)
    for when in plans:
        axes.axvline(when, color=PALE, linewidth=1.2, gid="plan")
    looks = zip((PLANNED, BODY, MEASURED), (3.0, 2.0, 1.0), strict=True)
    for (name, values), (colour, width) in zip(torques.items(), looks, strict=True):
        axes.step(t, values, where="post", color=colour, linewidth=width, label=name, gid=name)
    axes.set_xlim(t[0], t[-1])
    axes.set_xlabel("time (ms)")
    axes.set_ylabel("torque (N m)")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure
