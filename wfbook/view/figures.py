"""The book's figures of a plan and of a run.

Every function returns a :class:`~wfbook.view.style.Picture` and shows nothing. Colours mean the same
everywhere: green foot, orange wheel, grey swing, blue planned, dark measured.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from scipy.spatial import ConvexHull

from wfbook.modes import LEGS
from wfbook.view.spans import plan_modes, spans
from wfbook.view.style import (
    FORCE,
    INK,
    MEASURED,
    MODE_COLOURS,
    MODE_NAMES,
    PALE,
    PLANNED,
    SWINGING,
    Picture,
    tidy,
)

if TYPE_CHECKING:
    from wfbook.planner import Plan
    from wfbook.simulate import Run

_BAR_HEIGHT = 0.72
_LABELS = 20  # on the time axis of a gait, at most; more would overlap
_COMPONENTS = ("x", "y", "z")
_AXES = ("roll", "pitch", "yaw")


def gait(plan: "Plan", title: str | None = None) -> Picture:
    """Draw what each leg stands on over time, as Paper A's figs 8 to 12.

    Args:
        plan: relaxed or polished; both have the same S and D.
        title: above the diagram; by default none.

    Returns:
        One bar for every stretch in which a leg keeps its mode.
    """
    figure = Picture(8.0, 2.3)
    axes = figure.add_subplot()
    edges = plan.t[0] + plan.slot_duration * np.arange(plan.slots + 1)
    draw_gait(axes, edges, plan_modes(plan.S, plan.end_effector))
    axes.set_xlim(edges[0], edges[-1])
    axes.set_xticks(edges, minor=True)
    axes.set_xticks(edges[:: -(-plan.slots // _LABELS)])
    axes.xaxis.set_major_formatter("{x:.1f}")
    axes.set_xlabel("time (s)")
    axes.set_ylabel("leg")
    if title:
        axes.set_title(title, loc="left", color=INK)
    handles = [Patch(color=colour, label=name) for colour, name in zip(MODE_COLOURS, MODE_NAMES, strict=True)]
    figure.legend(handles=handles, loc="outside right upper", frameon=False)
    return figure


def draw_gait(axes: Any, edges: np.ndarray, modes: np.ndarray) -> None:
    """Draw a bar for every stretch in which a leg keeps its mode.

    Args:
        axes: to draw in.
        edges: ``(T+1,)`` times between which the modes hold.
        modes: ``(L, T)``, 0 stands on its foot, 1 on its wheel, 2 swings.
    """
    tidy(axes)
    axes.grid(axis="y", visible=False)
    for leg, mode, start, stop in spans(modes):
        axes.barh(
            leg,
            edges[stop] - edges[start],
            left=edges[start],
            height=_BAR_HEIGHT,
            color=MODE_COLOURS[mode],
            gid=f"{LEGS[leg]} {MODE_NAMES[mode]}",
        )
    axes.set_yticks(range(len(LEGS)), LEGS)
    axes.set_ylim(len(LEGS) - 0.5, -0.5)


def com_path(plan: "Plan", run: "Run | None" = None, polygons: bool = False) -> Picture:
    """Draw the centre of mass and the contacts from above.

    Args:
        plan: its path is blue, its footholds green dots, its rolling contacts orange strokes; grey rings
            are where the legs start. Several regions are outlined.
        run: when given, the measured path beside the planned one.
        polygons: also outline the support polygon of every slot.

    Returns:
        A top view with equal scales, x forward to the right and y left upwards.
    """
    figure = Picture(8.0, 3.6)
    axes = figure.add_subplot()
    tidy(axes)
    if len(plan.terrain.regions) > 1:
        for region in plan.terrain.regions:
            # As an artist: the far ends of the ground must not widen the view.
            axes.add_artist(Polygon(region.vertices[:, :2], fill=False, edgecolor=PALE, gid="region"))
    if polygons:
        _support_polygons(axes, plan)
    per_slot = plan.knots // plan.slots
    for leg, mode, start, stop in spans(plan_modes(plan.S, plan.end_effector)):
        if mode == SWINGING:
            continue
        contact = plan.p[start * per_slot : stop * per_slot + 1, leg]
        colour, name = MODE_COLOURS[mode], f"{LEGS[leg]} {MODE_NAMES[mode]}"
        axes.plot(contact[:, 0], contact[:, 1], color=colour, linewidth=4, solid_capstyle="round", gid=name)
        axes.plot(*contact[0, :2], "o", color=colour, markersize=7, gid=f"{name} touch-down")
    axes.plot(plan.p[0, :, 0], plan.p[0, :, 1], "o", color=PALE, markersize=9, fillstyle="none", gid="start")
    for leg, name in enumerate(LEGS):
        outward = np.sign(plan.p[0, leg, 1] - plan.x[0, 1])
        axes.annotate(
            name,
            plan.p[0, leg, :2],
            textcoords="offset points",
            xytext=(0, 12 * outward),
            ha="center",
            va="center",
            color=INK,
        )
    used = np.unique(plan_modes(plan.S, plan.end_effector))
    used = used[used != SWINGING]
    handles = [Line2D([], [], color=MODE_COLOURS[mode], marker="o", linewidth=4) for mode in used]
    labels = [f"{MODE_NAMES[mode]} contact" for mode in used]
    handles += axes.plot(plan.x[:, 0], plan.x[:, 1], color=PLANNED, linewidth=2, gid="planned")
    labels.append("CoM planned")
    if run is not None:
        handles += axes.plot(
            run.com[:, 0], run.com[:, 1], color=MEASURED, linewidth=1.2, linestyle="--", gid="measured"
        )
        labels.append("CoM measured")
    axes.margins(0.06, 0.14)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, forward (m)")
    axes.set_ylabel("y, left (m)")
    figure.legend(handles, labels, loc="outside upper center", ncols=len(handles), frameon=False)
    return figure


def _support_polygons(axes: Any, plan: "Plan") -> None:
    """Outline the convex hull of the standing legs' contacts at the middle of every slot."""
    per_slot = plan.knots // plan.slots
    for slot in range(plan.slots):
        standing = plan.S[:, slot] == 0
        corners = plan.p[slot * per_slot + per_slot // 2, standing, :2]
        if len(corners) > 2:
            corners = corners[ConvexHull(corners).vertices]
        shade = 0.35 + 0.5 * slot / plan.slots
        axes.add_patch(
            Polygon(corners, closed=True, fill=False, edgecolor=PALE, alpha=shade, gid=f"support {slot}")
        )


def forces(plan: "Plan", run: "Run | None" = None, component: str = "z") -> Picture:
    """Draw the contact force of each leg over time.

    Args:
        plan: its forces act over whole intervals: blue steps.
        run: when given, the measured forces beside them.
        component: "x" along the rolling direction, "y" to the left or "z" upwards.

    Raises:
        ValueError: ``component`` is another one.
    """
    if component not in _COMPONENTS:
        raise ValueError(f"component must be one of {', '.join(_COMPONENTS)}, not {component!r}")
    axis = _COMPONENTS.index(component)
    figure = Picture(8.0, 5.0)
    rows = figure.subplots(len(LEGS), 1, sharex=True, sharey=True)
    planned = plan.lam[..., axis] + plan.f[..., axis]
    edges = plan.t[0] + plan.slot_duration * np.arange(plan.slots + 1)
    for leg, mode, start, stop in spans(plan_modes(plan.S, plan.end_effector)):
        rows[leg].axvspan(edges[start], edges[stop], color=MODE_COLOURS[mode], alpha=0.22, linewidth=0)
    for leg, axes in enumerate(rows):
        tidy(axes)
        axes.set_ylabel(f"{LEGS[leg]} (N)")
        if run is not None:
            axes.plot(run.t, run.contact_force[:, leg, axis], color=MEASURED, linewidth=0.7, gid="measured")
        axes.stairs(planned[:, leg], plan.t, color=PLANNED, linewidth=1.8, baseline=None, gid="planned")
    low, high = planned.min(), planned.max()
    if run is not None:
        # The spikes of a stumble would flatten everything else.
        measured = np.percentile(run.contact_force[..., axis], (0.3, 99.7))
        low, high = min(low, measured[0]), max(high, measured[1])
    margin = 0.15 * max(high - low, 1.0)
    rows[0].set_ylim(low - margin, high + margin)
    rows[0].set_xlim(plan.t[0], plan.t[-1])
    rows[-1].set_xlabel("time (s)")
    handles = [Line2D([], [], color=PLANNED, linewidth=1.8, label="planned")]
    if run is not None:
        handles.append(Line2D([], [], color=MEASURED, linewidth=0.7, label="measured"))
    handles += [
        Patch(color=c, alpha=0.22, label=name) for c, name in zip(MODE_COLOURS, MODE_NAMES, strict=True)
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    figure.supylabel(f"contact force, {component}", fontsize="medium")
    return figure


def tracking(run: "Run") -> Picture:
    """Draw how far the run is from its reference: the centre of mass in mm, the attitude in degrees.

    The trunk is to lean with the ground; the angles are how far it is from that.
    """
    figure = Picture(8.0, 3.8)
    top, bottom = figure.subplots(2, 1, sharex=True)
    error_mm = 1e3 * (run.com - run.com_ref)
    for i, (name, style) in enumerate(zip(_COMPONENTS, ("-", "--", ":"), strict=True)):
        top.plot(run.t, error_mm[:, i], color=MEASURED, linestyle=style, linewidth=1.2, label=name, gid=name)
    for i, (name, style) in enumerate(zip(_AXES, ("-", "--", ":"), strict=True)):
        angle_deg = np.rad2deg(run.rpy[:, i] - run.rpy_ref[:, i])
        bottom.plot(run.t, angle_deg, color=MEASURED, linestyle=style, linewidth=1.2, label=name, gid=name)
    top.set_ylabel("CoM error (mm)")
    bottom.set_ylabel("attitude error (°)")
    bottom.set_xlabel("time (s)")
    for axes in (top, bottom):
        tidy(axes)
        axes.axhline(0.0, color=PLANNED, linewidth=1.0)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    top.set_xlim(run.t[0], run.t[-1])
    return figure


def torque_mismatch(relaxed: "Plan", polished: "Plan") -> Picture:
    """Draw the torque a plan claims beside the torque its own forces make (Paper A, eqs 8 and 9).

    The claimed torque is Σ (U⁺ − U⁻)/4, the real one Σ (p − x) × λ at the middle of each interval.
    The pink between them is torque that no contact makes: the robot will feel it missing.

    Args:
        relaxed: left column, the convex program's plan.
        polished: right column, the same gait with the true torque.
    """
    figure = Picture(8.0, 4.6)
    grid = figure.subplots(3, 2, sharex=True, sharey=True)  # one scale: large and small torques side by side
    for column, (name, plan) in enumerate((("relaxed", relaxed), ("polished", polished))):
        claimed = (plan.U_plus - plan.U_minus).sum(axis=1) / 4.0
        real = plan.contact_torque
        for axis, axes in enumerate(grid[:, column]):
            tidy(axes)
            step = np.append(claimed[:, axis], claimed[-1, axis]), np.append(real[:, axis], real[-1, axis])
            axes.fill_between(plan.t, *step, step="post", color=FORCE, alpha=0.45, linewidth=0)
            axes.stairs(claimed[:, axis], plan.t, color=PLANNED, linewidth=1.6, baseline=None, gid="claimed")
            axes.stairs(real[:, axis], plan.t, color=MEASURED, linewidth=1.0, baseline=None, gid="real")
        mismatch = np.sqrt(np.mean((claimed - real) ** 2, axis=0))
        values = " / ".join(f"{value:.2f}" for value in mismatch)
        grid[0, column].set_title(f"{name}: rms mismatch {values} N m", fontsize="medium")
        grid[-1, column].set_xlabel("time (s)")
    for axis, name in enumerate(_AXES):
        grid[axis, 0].set_ylabel(f"{name} (N m)")
    handles = [
        Line2D([], [], color=PLANNED, linewidth=1.6, label="torque in the plan"),
        Line2D([], [], color=MEASURED, linewidth=1.0, label="torque of its forces"),
        Patch(color=FORCE, alpha=0.45, label="made by nothing"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
    return figure
