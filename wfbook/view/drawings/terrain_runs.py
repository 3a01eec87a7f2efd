"""Chapter 8's drawings: runs beside each other, edges, the trunk's lean, what plans keep in hand, windows."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from wfbook.footing import Footing
from wfbook.go1 import FOOT_RADIUS, WHEEL_RADIUS
from wfbook.lean import BY, Lean, knee_room
from wfbook.planner.demands import grip_used, load_carried
from wfbook.planner.margins import GRIP, LOAD
from wfbook.view.motion import motion_of_plan
from wfbook.view.style import (
    BODY,
    FOOT,
    LIMIT,
    MEASURED,
    PALE,
    PLANNED,
    SWINGING,
    WHEEL,
    Picture,
    tidy,
)
from wfbook.view.tracks import FPS

if TYPE_CHECKING:
    from wfbook.planner import Plan
    from wfbook.simulate import Run
    from wfbook.terrain import Terrain

STYLES = ("-", "--", "-.", ":", (0, (1, 3)), (0, (6, 2, 1, 2, 1, 2)))
"""Strokes of runs or plans that are compared: all are dark, for all are measured, or blue."""

_BY_TEXTS = {"hips": "by the ground under the hips", "contacts": "by the plane through the contacts"}
_BY_TEXTS |= {"nothing": "not at all"}


def errors(runs: "Mapping[str, Run]") -> Picture:
    """Draw how far the centre of mass is from its reference over time; a cross is a fall.

    Args:
        runs: by name.
    """
    figure = Picture(8.0, 3.2)
    axes = figure.add_subplot()
    tidy(axes)
    for (name, run), style in zip(runs.items(), STYLES, strict=False):
        going = run.t >= 0.0
        error = 1e3 * np.linalg.norm(run.com - run.com_ref, axis=1)[going]
        axes.semilogy(
            run.t[going], error, color=MEASURED, linestyle=style, linewidth=1.3, label=name, gid=name
        )
        if run.metrics["fell"]:
            axes.plot(run.t[-1], error[-1], "X", color=LIMIT, markersize=9, gid=f"{name} falls")
    axes.set_xlim(0.0)
    axes.set_ylim(0.1, 1000.0)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("CoM error (mm)")
    handles, _ = axes.get_legend_handles_labels()
    handles.append(Line2D([], [], color=LIMIT, marker="X", linestyle="", markersize=9, label="falls"))
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def footing(terrain: "Terrain", ahead: float = 0.3) -> Picture:
    """Draw the slope of the ground that a controller counts on while a foot and a wheel pass over two edges.

    Args:
        terrain: three regions that join along x.
        ahead: velocity along x.

    Returns:
        For each edge of the middle region, the slope by the region under the leg's end, and by the point that
        touches, for both ends.
    """
    figure = Picture(8.0, 2.9)
    panels = figure.subplots(1, 2, sharey=True)
    edges = terrain.regions[1].vertices[:, 0].min(), terrain.regions[1].vertices[:, 0].max()
    for axes, edge in zip(panels, edges, strict=True):
        tidy(axes)
        x = edge + np.linspace(-0.03, 0.03, 601)
        slopes = [_slope(terrain.regions[terrain.region_at(place, 0.0)].normal) for place in x]
        look = {"color": PALE, "linewidth": 5.0, "label": "of the region below", "gid": "region"}
        axes.plot(1e3 * (x - edge), slopes, **look)
        for name, radius, colour in (("foot", FOOT_RADIUS, FOOT), ("wheel", WHEEL_RADIUS, WHEEL)):
            slopes = _felt(terrain, x, radius, ahead if name == "wheel" else 0.0)
            look = {"color": colour, "label": f"where a {name} touches", "gid": name}
            axes.plot(1e3 * (x - edge), slopes, linewidth=2.0, **look)
        axes.set_xlabel(f"middle of the leg's end, beyond x = {edge:.2f} m (mm)")
        axes.set_xlim(-30.0, 30.0)
    panels[0].set_ylabel("slope (°)")
    handles, _ = panels[0].get_legend_handles_labels()
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
    return figure


def _felt(terrain: "Terrain", x: np.ndarray, radius: float, ahead: float) -> list[float]:
    """Return the slope at the point that a round end touches while its middle passes over ``x``."""
    start = np.tile([x[0], 0.0, terrain.height(x[0], 0.0)], (4, 1))
    below, slopes = Footing(terrain, start, np.zeros(4, int)), []
    around = np.linspace(-radius, radius, 401)
    fine = np.linspace(x[0] - radius, x[-1] + radius, 1001)
    ground = np.array([terrain.height(place, 0.0) for place in fine])
    for place in x:
        # The end rests where the ground under its roundness holds it highest.
        height = np.interp(place + around, fine, ground) + np.sqrt(radius**2 - around**2)
        below.stand(0, np.array([place, 0.0, height.max()]), ahead)
        slopes.append(_slope(below.normals[0]))
    return slopes


def _slope(normal: np.ndarray) -> float:
    """Return how steeply ground falls along x, in degrees; upwards positive."""
    return float(np.degrees(np.arctan2(-normal[0], normal[2])))


def leans(plan: "Plan") -> Picture:
    """Draw the trunk's pitch by each rule over time, and how much room it leaves under the knees.

    Args:
        plan: on whose contacts the robot is posed.
    """
    figure = Picture(8.0, 4.4)
    top, bottom = figure.subplots(2, 1, sharex=True)
    for by, style in zip(BY, STYLES, strict=False):
        lean = Lean(plan, by)
        pitch = [-np.degrees(lean.at(t)[0][1]) for t in plan.t - plan.t[0]]
        top.plot(plan.t, pitch, color=PLANNED, linestyle=style, linewidth=1.6, label=_BY_TEXTS[by], gid=by)
        t, room = least_room(plan, by)
        bottom.plot(t, 1e3 * room, color=PLANNED, linestyle=style, linewidth=1.6, gid=by)
    ground = [np.degrees(np.arctan2(-_normal_at(plan, x)[0], _normal_at(plan, x)[2])) for x in plan.x]
    top.plot(plan.t, ground, color=PALE, linewidth=3.5, zorder=0, label="ground under the CoM", gid="ground")
    bottom.axhline(0.0, color=LIMIT, linewidth=1.6)
    bottom.text(plan.t[0], 2.0, " a calf lies on the ground", color=LIMIT, va="bottom", fontsize="small")
    top.set_ylabel("nose up (°)")
    bottom.set_ylabel("room under\nthe lowest knee (mm)")
    bottom.set_xlabel("time (s)")
    bottom.set_xlim(plan.t[0], plan.t[-1])
    bottom.set_ylim(-20.0)
    for axes in (top, bottom):
        tidy(axes)
    top.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def least_room(plan: "Plan", by: str = "hips") -> tuple[np.ndarray, np.ndarray]:
    """Return the least room under a standing leg's knee over time.

    Args:
        plan: as whose contacts and body want it, the robot is posed.
        by: by what the trunk leans.

    Returns:
        Times and distances, ``(N,)`` each.
    """
    motion = motion_of_plan(plan, by)
    room = np.where(motion.modes == SWINGING, np.inf, knee_room(motion.qpos, motion.terrain))
    return motion.start + np.arange(len(room)) / FPS, room.min(axis=1)


def _normal_at(plan: "Plan", place: np.ndarray) -> np.ndarray:
    return plan.terrain.regions[plan.terrain.region_at(*place[:2])].normal


def in_hand(plans: "Mapping[str, Plan]") -> Picture:
    """Draw what plans keep of their friction, of the load on their legs, and of the room under their knees.

    Args:
        plans: by name, of one terrain and one duration.
    """
    figure = Picture(8.0, 5.4)
    rows = figure.subplots(3, 1, sharex=True)
    for (name, plan), style in zip(plans.items(), STYLES, strict=False):
        look = {"color": PLANNED, "linestyle": style, "linewidth": 1.5, "label": name, "gid": name}
        grip, load = grip_used(plan), load_carried(plan)
        feet = np.repeat(plan.end_effector, plan.knots // plan.slots, axis=1).T == 0
        # Of legs that are all in the air or on wheels there is no largest.
        most = np.max(np.where(feet, np.nan_to_num(grip), 0.0), axis=1)
        many = np.sum(np.isfinite(load), axis=1) >= 3
        least = np.where(many, np.min(np.where(np.isfinite(load), load, np.inf), axis=1), np.nan)
        rows[0].stairs(most, plan.t, baseline=None, **look)
        rows[1].stairs(least, plan.t, baseline=None, **look)
        t, room = least_room(plan)
        rows[2].plot(t, 1e3 * room, **look)
    for axes, level in zip(rows, (1.0, 0.0, 0.0), strict=True):
        tidy(axes)
        axes.axhline(level, color=LIMIT, linewidth=3.0, zorder=1, gid="limit")
    for axes, level in ((rows[0], GRIP), (rows[1], LOAD)):
        axes.axhline(level, color=BODY, linewidth=1.0, linestyle=":", gid="margin")
    rows[0].set_ylabel("grip used,\nthe worst foot")
    rows[1].set_ylabel("least load of\n3 legs or more")
    rows[2].set_ylabel("room under\nknees (mm)")
    rows[0].set_ylim(0.0, 1.15)
    rows[1].set_ylim(-0.03, 0.3)
    rows[2].set_xlabel("time (s)")
    rows[2].set_xlim(float(min(plan.t[0] for plan in plans.values())))
    handles, _ = rows[0].get_legend_handles_labels()
    handles += [
        Line2D([], [], color=LIMIT, linewidth=1.6, label="limit"),
        Line2D([], [], color=BODY, linewidth=1.0, linestyle=":", label="with margin"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return figure


def windows(
    slots: int, window: int, commit: int, slot_s: float = 0.3, records: Sequence[dict[str, Any]] = ()
) -> Picture:
    """Draw which slots each window of a receding plan covers, and when it has to be found.

    Args:
        slots: of the whole way.
        window: slots that are planned at once.
        commit: slots of a window that are executed before the next takes over.
        slot_s: duration of a slot.
        records: of the windows that were planned (see :func:`wfbook.receding.run`), if any: beside the time
            that there was, how long each took.
    """
    figure = Picture(8.0, 3.2)
    axes = figure.add_subplot()
    tidy(axes)
    axes.grid(axis="y", visible=False)
    begins = _begins(slots, window, commit) if not records else [r["slots"] for r in records]
    for row, (begin, end) in enumerate(begins):
        last = row == len(begins) - 1
        kept = end if last else min(begins[row + 1][0], end)
        style = {"height": 0.55, "linewidth": 0}
        axes.barh(row, (kept - begin) * slot_s, left=begin * slot_s, color=PLANNED, gid="executed", **style)
        axes.barh(
            row, (end - kept) * slot_s, left=kept * slot_s, color=PLANNED, alpha=0.3, gid="dropped", **style
        )
        if row:
            there = (begin - begins[row - 1][0]) * slot_s
            axes.plot(
                [begin * slot_s - there, begin * slot_s], [row, row], color=PALE, linewidth=5.0, gid="there"
            )
        if records and row:
            taken, asked = records[row]["planning_s"], begin * slot_s - records[row]["available_s"]
            axes.plot([asked, asked + taken], [row, row], color=MEASURED, linewidth=2.0, gid="taken")
    axes.set_yticks(range(len(begins)))
    axes.set_ylim(len(begins) - 0.4, -0.6)
    axes.set_ylabel("window")
    axes.set_xlabel("time (s)")
    axes.set_xlim(-0.05, slots * slot_s + 0.05)
    handles = [
        Line2D([], [], color=PLANNED, linewidth=8.0, label="executed"),
        Line2D([], [], color=PLANNED, alpha=0.3, linewidth=8.0, label="planned, replaced by the next"),
        Line2D([], [], color=PALE, linewidth=5.0, label="time there is to plan it"),
    ]
    if records:
        handles.append(Line2D([], [], color=MEASURED, linewidth=2.0, label="time it took"))
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return figure


def _begins(slots: int, window: int, commit: int) -> list[tuple[int, int]]:
    """Return first slot and end of each window, if each is there in time."""
    found = [(0, min(window, slots))]
    while slots - (found[-1][0] + commit) >= 2:  # what is left is enough for a swing and a stance
        begin = found[-1][0] + commit
        found.append((begin, min(begin + window, slots)))
    return found
