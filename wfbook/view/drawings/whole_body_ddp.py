"""Chapter 11's drawings: value functions and their parabolas, iterates, costs, planned motions."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from wfbook.modes import LEGS
from wfbook.omni.bellman import Table
from wfbook.omni.tasks import Attempt, Planned
from wfbook.view.style import (
    BODY,
    ESTIMATED,
    FOOT,
    FORCE,
    HAND,
    INK,
    LIMIT,
    PALE,
    PLANNED,
    WHEEL,
    Picture,
    tidy,
)

_LEVELS = (0.5, 1, 2, 3, 4, 6, 9, 13, 17)
_STYLES = ("-", "--", ":", "-.")
_COLOURS = (PLANNED, LIMIT, FORCE, FOOT, WHEEL, ESTIMATED)
MOTORS = (*(f"{leg} {part}" for leg in LEGS for part in ("hip", "knee")), *(f"arm {i}" for i in range(1, 7)))
"""Names of the 14 torques, in their order."""


def draw_map(axes: Axes, table: Table, dt: float, first: int = 0) -> None:
    """Fill time and angle with what is left to pay from there: dark is dear.

    Args:
        axes: to draw in.
        table: the value function.
        dt: duration of a step.
        first: row of the table that is time 0.
    """
    axes.set_facecolor("white")
    left = table.value[first:]
    t, angle = dt * np.arange(len(left)), np.degrees(table.grid)
    shade = np.sqrt(np.maximum(left.T, 0.0))  # what is left in the beginning is little beside the end's
    axes.pcolormesh(t, angle, shade, cmap="Greys", shading="nearest", alpha=0.6, vmax=1.2 * shade.max())
    axes.contour(t, angle, left.T, levels=_LEVELS, colors=BODY, linewidths=0.6)
    axes.set_xlim(0.0, t[-1])
    axes.set_ylim(angle[0], angle[-1])
    axes.set_yticks(np.arange(-180, 181, 90))
    axes.set_xlabel("time (s)")
    axes.set_ylabel("angle (°), 0 hangs, ±180 is upright")


def value_map(table: Table, dt: float, ways: Mapping[str, np.ndarray]) -> Picture:
    """Draw the value function of a pendulum in honey over time and angle, with ways through it.

    Args:
        table: the value function.
        dt: duration of a step.
        ways: by name, angles ``(N + 1,)``.
    """
    figure = Picture(9.0, 3.8)
    over, slices = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    draw_map(over, table, dt)
    for (name, way), style in zip(ways.items(), _STYLES, strict=False):
        over.plot(
            dt * np.arange(len(way)), np.degrees(way), color=PLANNED, linestyle=style, linewidth=2.2, gid=name
        )
    tidy(slices)
    last = len(table.value) - 1
    for step, style in zip((0, last // 2, last), _STYLES, strict=False):
        slices.plot(
            np.degrees(table.grid),
            table.value[step],
            color=INK,
            linestyle=style,
            label=f"{dt * (last - step):.1f} s left",
            gid=f"value {step}",
        )
    slices.set_xlim(-180, 180)
    slices.set_xticks(np.arange(-180, 181, 90))
    slices.set_xlabel("angle (°)")
    slices.set_ylabel("V, left to pay")
    slices.legend(frameon=False, fontsize="small")
    handles = [
        Line2D([], [], color=PLANNED, linestyle=style, label=name)
        for name, style in zip(ways, _STYLES, strict=False)
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return figure


def draw_ways(axes: Axes, ways: Sequence[np.ndarray], shown: int, dt: float) -> None:
    """Draw the trajectories of all iterates, pale, and one of them in full."""
    for index, way in enumerate(ways):
        paint = {"color": PLANNED, "linewidth": 2.6} if index == shown else {"color": PALE, "linewidth": 1.0}
        axes.plot(
            dt * np.arange(len(way)),
            np.degrees(way),
            gid="shown" if index == shown else f"iterate {index}",
            zorder=3 if index == shown else 2,
            **paint,
        )


def draw_parabola(
    axes: Axes, table: Table, step: int, state: float, parabola: tuple[float, float, float] | None
) -> None:
    """Draw a value function at one step, and what DDP takes it for near a state.

    Args:
        axes: to draw in.
        table: the value function.
        step: row of the table.
        state: on the trajectory.
        parabola: value, slope and curvature there; None where there is none.
    """
    tidy(axes)
    angle = np.degrees(table.grid)
    axes.plot(angle, table.value[step], color=INK, linewidth=1.8, label="V, on a grid", gid="value")
    if parabola is not None:
        height, slope, bend = parabola
        off = np.linspace(-1.2, 1.2, 121)
        axes.plot(
            np.degrees(state + off),
            height + slope * off + 0.5 * bend * off * off,
            color=PLANNED,
            linewidth=2.4,
            linestyle="--",
            label="DDP's parabola",
            gid="parabola",
        )
        axes.plot(np.degrees(state), height, "o", color=PLANNED, markersize=8, gid="state")
    highest = float(table.value[step].max())
    top = 1.25 * (highest if parabola is None else max(highest, parabola[0])) + 0.5
    axes.set_ylim(-0.15 * top, top)
    axes.set_xlim(angle[0], angle[-1])
    axes.set_xticks(np.arange(-180, 181, 90))
    axes.set_xlabel("angle (°)")
    axes.set_ylabel("left to pay")
    axes.legend(frameon=False, fontsize="small", loc="upper right")


def draw_costs(axes: Axes, costs: Mapping[str, np.ndarray], shown: int | None = None) -> None:
    """Draw costs over iterations on a logarithmic scale, a curve for each search.

    Args:
        axes: to draw in.
        costs: by name, ``(I + 1,)``.
        shown: iteration to be marked on the first curve.
    """
    tidy(axes)
    for (name, curve), colour, style in zip(costs.items(), _COLOURS, 2 * _STYLES, strict=False):
        paint = {"color": colour, "linestyle": style, "linewidth": 2.0}
        axes.plot(np.arange(len(curve)), curve, marker=".", label=name, gid=name, **paint)
    if shown is not None:
        first = next(iter(costs.values()))
        axes.plot(shown, first[shown], "o", color=PLANNED, markersize=9, gid="shown")
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("iteration")
    axes.set_ylabel("cost")
    if len(costs) > 1:
        axes.legend(frameon=False, fontsize="small")


def costs(curves: Mapping[str, np.ndarray]) -> Picture:
    """Draw the costs of several searches over their iterations."""
    figure = Picture(7.4, 3.2)
    draw_costs(figure.subplots(), curves)
    return figure


def attempts(found: Mapping[str, Attempt]) -> Picture:
    """Draw what several solves cost, and how far their states were from obeying the dynamics."""
    figure = Picture(9.0, 3.2)
    left, right = figure.subplots(1, 2)
    draw_costs(left, {name: one.costs for name, one in found.items()})
    draw_costs(right, {name: np.maximum(one.gaps, 1e-6) for name, one in found.items()})
    right.set_ylabel("largest gap (below 1e−6: none)")
    if right.get_legend() is not None:
        right.get_legend().remove()
    return figure


def motion(shown: Planned) -> Picture:
    """Draw a planned motion over time: the hand, what the motors give, what the wheels carry."""
    figure = Picture(9.0, 5.4)
    hand, load, force = figure.subplots(3, 1, sharex=True)
    for axes in (hand, load, force):
        tidy(axes)
    moved, asked = shown.hand - shown.hand[0], shown.asked - shown.hand[0]
    for axis, name, style in zip(range(3), ("ahead", "left", "up"), _STYLES, strict=False):
        hand.plot(shown.t, 100 * moved[:, axis], color=HAND, linestyle=style, label=name, gid=f"hand {name}")
        hand.plot(shown.t, 100 * asked[:, axis], color=PALE, linestyle=style, zorder=1, gid=f"asked {name}")
    hand.set_ylabel("hand (cm)")
    for column in range(shown.load.shape[1]):
        colour = WHEEL if column < 8 else HAND
        load.plot(
            shown.t[:-1], shown.load[:, column], color=colour, linewidth=1.2, gid=f"load {MOTORS[column]}"
        )
    load.axhline(1.0, color=LIMIT, linestyle="--", gid="limit")
    load.set_ylim(0.0, max(1.2, 1.05 * float(shown.load.max())))
    load.set_ylabel("torque / limit")
    for leg, style in zip(range(4), _STYLES, strict=True):
        force.plot(
            shown.t[:-1],
            shown.contact_force[:-1, leg, 2],
            color=WHEEL,
            linestyle=style,
            label=LEGS[leg],
            gid=f"force {LEGS[leg]}",
        )
    force.axhline(0.0, color=LIMIT, linestyle="--", linewidth=1.0)
    force.set_ylabel("normal force (N)")
    force.set_xlabel("time (s)")
    hand.plot([], [], color=PALE, label="asked")
    hand.legend(frameon=False, fontsize="small", ncols=4)
    force.legend(frameon=False, fontsize="small", ncols=4)
    load.legend(
        handles=[
            Line2D([], [], color=WHEEL, label="legs"),
            Line2D([], [], color=HAND, label="arm"),
            Line2D([], [], color=LIMIT, linestyle="--", label="limit"),
        ],
        frameon=False,
        fontsize="small",
        ncols=3,
    )
    return figure


def draw_loads(axes: Axes, load: np.ndarray) -> None:
    """Draw the largest torque of every motor as a share of its limit.

    Args:
        axes: to draw in.
        load: ``(14,)``.
    """
    tidy(axes)
    colours = [LIMIT if share > 1.0 + 1e-6 else (WHEEL if i < 8 else HAND) for i, share in enumerate(load)]
    for index, (share, colour) in enumerate(zip(load, colours, strict=True)):
        axes.bar(index, share, color=colour, gid=f"load {MOTORS[index]}")
    axes.axhline(1.0, color=LIMIT, linestyle="--")
    axes.set_xticks(range(len(load)), MOTORS, rotation=90, fontsize="small")
    axes.set_ylim(0.0, max(1.5, 1.05 * float(load.max())))
    axes.set_ylabel("largest torque / limit")


def rides(cases: Mapping[str, np.ndarray], period: float = 0.002) -> Picture:
    """Draw how far the hand is from where the plan has it, over time, on a logarithmic scale.

    Args:
        cases: by name, distances ``(M + 1,)`` in m.
        period: between two of them.
    """
    figure = Picture(7.4, 3.0)
    axes = figure.subplots()
    tidy(axes)
    for (name, distance), colour, style in zip(cases.items(), _COLOURS, _STYLES, strict=False):
        axes.plot(
            period * np.arange(len(distance)),
            1e3 * distance,
            color=colour,
            linestyle=style,
            linewidth=2.0,
            label=name,
            gid=name,
        )
    axes.set_yscale("log")
    axes.set_xlabel("time (s)")
    axes.set_ylabel("hand off the plan (mm)")
    figure.legend(loc="outside right center", frameon=False)
    return figure


def gifts(moments: Mapping[str, np.ndarray], dt: float) -> Picture:
    """Draw moments about axles over time, that no wheel can have.

    Args:
        moments: by contact, ``(N,)`` N m.
        dt: time step.
    """
    figure = Picture(7.4, 2.8)
    axes = figure.subplots()
    tidy(axes)
    for (name, moment), style in zip(moments.items(), _STYLES, strict=False):
        axes.plot(dt * np.arange(len(moment)), moment, color=FORCE, linestyle=style, label=name, gid=name)
    axes.axhline(0.0, color=INK, linewidth=1.0)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("moment about the axle (N m)")
    axes.legend(frameon=False)
    return figure
