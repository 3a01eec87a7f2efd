"""Chapter 2's drawings: what a swing is made of, what its smoothness is good for, how well it is tracked."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from wfbook.flights import swings_of
from wfbook.go1_dynamics import leg_motion
from wfbook.modes import LEGS
from wfbook.swing import quintic_basis, septic_basis, swing_position
from wfbook.view.style import FOOT, INK, MEASURED, MODE_COLOURS, PLANNED, SWING, WHEEL, Picture, tidy

if TYPE_CHECKING:
    from wfbook.planner import Plan
    from wfbook.simulate import Run

SMOOTHNESS_STYLES = {2: "-", 1: "--", 0: ":"}
SMOOTHNESS_NAMES = {
    2: "position, velocity, acceleration",
    1: "position, velocity",
    0: "position",
}
"""What is given at a swing's ends, by :func:`wfbook.swing.conditions`' smoothness."""

_AXES = ((0, "x", "forward"), (2, "z", "up"))


def bases() -> Picture:
    """Draw the polynomials that all swings are mixed from (Paper A, eqs 2–5)."""
    phase = np.linspace(0.0, 1.0, 201)
    figure = Picture(8.0, 2.9)
    left, right = figure.subplots(1, 2)
    for axes, basis, names, title in (
        (left, quintic_basis(phase), ("$p_0$", "$T v_0$", "$p_f$", "$T v_f$"), "horizontal: quintic"),
        (right, septic_basis(phase), ("$z_0$", "$z_f$", "$z_{1/2}$"), "vertical: septic"),
    ):
        tidy(axes)
        for weights, name, style in zip(basis.T, names, ("--", ":", "-", "-."), strict=False):
            axes.plot(phase, weights, color=PLANNED, linestyle=style, linewidth=1.8, label=name, gid=name)
        axes.set_title(title, loc="left", fontsize="medium", color=INK)
        axes.set_xlabel("phase of the swing (1)")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    left.set_ylabel("weight (1)")
    return figure


def ends(start_b: np.ndarray, step: float, apex: float, duration: float, leg: int = 0) -> Picture:
    """Draw the same step with more and with fewer conditions at its ends.

    The foot stands before and after. The trunk is held.

    Args:
        start_b: ``(3,)`` where the leg's end lifts, in the trunk's frame.
        step: how far ahead it lands.
        apex: how high it is lifted.
        duration: of the swing.
        leg: index in :data:`wfbook.modes.LEGS`.
    """
    figure = Picture(9.0, 4.6)
    panels = figure.subplots(2, 2, sharex=True)
    titles = ("height (cm)", "vertical velocity (m/s)", "vertical acceleration (m/s²)", "torque, thigh (N m)")
    for axes, title in zip(panels.flat, titles, strict=True):
        tidy(axes)
        axes.set_ylabel(title)
    phase, end = np.linspace(0.0, 1.0, 201), np.asarray(start_b) + step * np.eye(3)[0]
    time = np.r_[-0.1, 0.0, phase, 1.0, 1.1] * 1e3 * duration
    for smoothness, style in SMOOTHNESS_STYLES.items():
        path = [
            swing_position(phase, duration, start_b, end, apex, None, None, d, smoothness) for d in range(3)
        ]
        torque = leg_motion(leg, *path)[2][:, 1]
        still = leg_motion(leg, path[0][[0, -1]], np.zeros((2, 3)), np.zeros((2, 3)))[2][:, 1]
        rows = (
            (1e2 * (path[0][:, 2] - start_b[2]), 0.0, 0.0),
            (path[1][:, 2], 0.0, 0.0),
            (path[2][:, 2], 0.0, 0.0),
            (torque, still[0], still[1]),
        )
        for axes, (values, before, after) in zip(panels.flat, rows, strict=True):
            axes.plot(
                time,
                np.r_[before, before, values, after, after],
                color=PLANNED if smoothness == 2 else INK,
                linestyle=style,
                linewidth=1.8 if smoothness == 2 else 1.2,
                gid=f"smoothness {smoothness}",
            )
    for axes in panels[-1]:
        axes.set_xlabel("time since lift-off (ms)")
    handles = [
        Line2D([], [], color=PLANNED if s == 2 else INK, linestyle=style, label=SMOOTHNESS_NAMES[s])
        for s, style in SMOOTHNESS_STYLES.items()
    ]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=3, frameon=False, title="given at the ends"
    )
    return figure


def knots(plan: "Plan", leg: int, number: int = 0) -> Picture:
    """Draw what a program with knots knows of a swing, and the spline that goes through it.

    Args:
        plan: whose swing.
        leg: index in :data:`wfbook.modes.LEGS`.
        number: of the leg's swing slots.
    """
    per_slot = plan.knots // plan.slots
    slot = int(np.flatnonzero(plan.S[leg])[number])
    first, last = slot * per_slot, (slot + 1) * per_slot
    path = spline_of(plan, leg, slot, np.linspace(0.0, 1.0, 101))
    figure = Picture(8.0, 2.6)
    axes = figure.subplots()
    tidy(axes)
    axes.plot(100 * path[:, 0], 100 * path[:, 2], color=PLANNED, linewidth=1.6, label="spline", gid="spline")
    shown = 100 * plan.p[first : last + 1, leg]
    axes.plot(
        shown[:, 0], shown[:, 2], "o", color=PLANNED, markersize=7, label="knots of the plan", gid="knots"
    )
    _ends_of(axes, plan, leg, slot, shown)
    axes.set_xlabel("x, forward (cm)")
    axes.set_ylabel("z, up (cm)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return figure


def spline_of(plan: "Plan", leg: int, slot: int, phase: np.ndarray) -> np.ndarray:
    """Return a planned swing at any phase of its slot, ``(n, 3)``: eqs 2–6 with the plan's own ends.

    A leg that lifts from its wheel or lands on it has the CoM's forward speed there (eq. 20).
    """
    per_slot = plan.knots // plan.slots
    first, last = slot * per_slot, (slot + 1) * per_slot
    modes = np.array(plan.meta["start_end_effectors"])[leg] == "wheel"
    before = bool(plan.end_effector[leg, slot - 1]) if slot else bool(modes)
    rolls = np.array([[before], [bool(plan.end_effector[leg, slot])]])
    velocity = plan.v[[first, last]] * [1.0, 0.0, 0.0] * rolls
    return swing_position(
        phase,
        plan.slot_duration,
        plan.p[first, leg],
        plan.p[last, leg],
        plan.meta["swing_height"],
        *velocity,
    )


def tracked(run: "Run", plan: "Plan", leg: int, number: int = 0) -> Picture:
    """Draw a swing as the controller asked for it and as the robot made it.

    Args:
        run: of the plan.
        plan: that was executed.
        leg: index in :data:`wfbook.modes.LEGS`.
        number: of the leg's flights.
    """
    flight = swings_of(plan)[leg][number]
    during = (run.t >= flight.start - 0.05) & (run.t <= flight.end + 0.05)
    figure = Picture(8.0, 4.2)
    rows = figure.subplots(2, 1, sharex=True)
    for axes, (axis, name, meaning) in zip(rows, _AXES, strict=True):
        tidy(axes)
        axes.axvspan(flight.start, flight.end, color=SWING, linewidth=0)
        axes.axvline(
            flight.start + flight.duration, color=MODE_COLOURS[flight.kind], linewidth=1.5, gid="aim"
        )
        axes.plot(
            run.t[during], 100 * run.p_ref[during, leg, axis], color=PLANNED, linewidth=2.4, gid="reference"
        )
        axes.plot(
            run.t[during], 100 * run.p[during, leg, axis], color=MEASURED, linewidth=1.1, gid="measured"
        )
        axes.set_ylabel(f"{name}, {meaning} (cm)")
    rows[-1].set_xlabel("time (s)")
    handles = [
        Line2D([], [], color=PLANNED, linewidth=2.4, label=f"{LEGS[leg]} asked for"),
        Line2D([], [], color=MEASURED, linewidth=1.1, label="measured"),
        Line2D([], [], color=SWING, linewidth=8, label="slot of the plan"),
        Line2D([], [], color=MODE_COLOURS[flight.kind], linewidth=1.5, label="aims to land"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
    return figure


def _ends_of(axes: Any, plan: "Plan", leg: int, slot: int, shown: np.ndarray) -> None:
    """Mark lift-off and landing with the colour of what the leg stands on there."""
    before = plan.end_effector[leg, slot - 1] if slot else 0
    for place, kind, name in (
        (shown[0], before, "lifts from"),
        (shown[-1], plan.end_effector[leg, slot], "lands on"),
    ):
        what = ("foot", "wheel")[int(kind)]
        colour = (FOOT, WHEEL)[int(kind)]
        axes.plot(place[0], place[2], "o", color=colour, markersize=11, label=f"{name} {what}", gid=name)
