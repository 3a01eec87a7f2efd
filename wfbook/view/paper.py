"""Pictures of the comparison with the papers: gaits, ways over time, and where work is spent.

Colours mean what they mean everywhere; of two conditions with wheels, that with rolling friction is dashed.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from wfbook.view.figures import draw_gait
from wfbook.view.spans import plan_modes
from wfbook.view.style import FOOT, INK, MEASURED, MODE_COLOURS, MODE_NAMES, PAPER, WHEEL, Picture, tidy

if TYPE_CHECKING:
    from wfbook.paper.bench import Execution
    from wfbook.planner import Plan

_LOOKS = {"feet": (FOOT, "-"), "both": (WHEEL, "-"), "friction": (WHEEL, (0, (4, 2)))}
"""Colour and stroke of the cases of IV-B, and of IV-C by what is in their names."""


def gait(plan: "Plan", run: "Execution", title: str) -> Picture:
    """Draw a gait as planned, as the paper's figs 8 to 12 do, and below it as it was executed.

    Args:
        plan: of the gait.
        run: of the plan; a leg swings where it touches nothing.
        title: above the picture.
    """
    figure = Picture(8.0, 4.2)
    top, bottom = figure.subplots(2, 1, sharex=True)
    edges = plan.t[0] + plan.slot_duration * np.arange(plan.slots + 1)
    draw_gait(top, edges, plan_modes(plan.S, plan.end_effector))
    going = (run.t >= plan.t[0]) & (run.t <= plan.t[-1])
    times = run.t[going]
    draw_gait(bottom, np.append(times, times[-1] + times[1] - times[0]), run.modes[going].T)
    for axes, name in ((top, "planned"), (bottom, "in contact")):
        axes.set_ylabel(name)
    top.set_xlim(edges[0], edges[-1])
    top.set_xticks(edges)
    top.xaxis.set_major_formatter("{x:.1f}")
    bottom.set_xlabel("time (s)")
    top.set_title(title, loc="left", color=INK)
    handles = [Patch(color=colour, label=name) for colour, name in zip(MODE_COLOURS, MODE_NAMES, strict=True)]
    figure.legend(handles=handles, loc="outside right upper", frameon=False)
    return figure


def way(
    cases: "Mapping[str, tuple[str, Plan, Execution]]", ends: Mapping[str, tuple[float, float]]
) -> Picture:
    """Draw how far the robot is over time, planned and simulated, as the paper's fig. 13.

    Args:
        cases: by key, a name, the plan that was executed and a run of it.
        ends: by key, time and distance that the paper reports.

    Returns:
        Thick lines planned, thin dark ones simulated, and the paper's ends as diamonds.
    """
    figure = Picture(8.0, 3.6)
    axes = figure.add_subplot()
    tidy(axes)
    handles = []
    for key, (name, plan, run) in cases.items():
        colour, stroke = _LOOKS[key]
        handles += axes.plot(
            plan.t, plan.x[:, 0] - plan.x[0, 0], color=colour, linestyle=stroke, linewidth=3, label=name
        )
        handles[-1].set_gid(f"{key} planned")
        going = run.t >= 0.0
        moved = run.com[going, 0] - run.com[going][0, 0]
        axes.plot(run.t[going], moved, color=MEASURED, linewidth=1.0, gid=f"{key} simulated")
        style = {"color": colour, "markeredgecolor": INK, "clip_on": False, "zorder": 3}
        axes.plot(*ends[key], "D", **style, gid=f"{key} paper")
    handles.append(Line2D([], [], color=MEASURED, linewidth=1.0, label="simulated"))
    handles.append(Line2D([], [], marker="D", color=PAPER, markeredgecolor=INK, label="end, in the paper"))
    axes.set_xlabel("time (s)")
    axes.set_ylabel("way of the centre of mass (m)")
    axes.set_xlim(0.0, max(float(plan.t[-1]) for _, plan, _ in cases.values()))
    axes.set_ylim(0.0)
    axes.legend(handles=handles, loc="upper left", frameon=False)
    return figure


def transport(cases: "Mapping[str, Execution]") -> Picture:
    """Draw the work of the motors, absolute and positive, and the way, over time.

    Args:
        cases: by name, a run.
    """
    figure = Picture(8.0, 5.0)
    top, bottom = figure.subplots(2, 1, sharex=True)
    for name, run in cases.items():
        going = run.t >= 0.0
        colour = FOOT if "wheels" not in name else WHEEL
        stroke = "--" if "friction" in name else "-"
        for column, width, what in ((0, 2.0, "absolute"), (1, 0.9, "positive")):
            top.plot(
                *(run.t[going], run.work[going, column]),
                color=colour,
                linestyle=stroke,
                linewidth=width,
                gid=f"{name} {what}",
            )
        moved = run.com[going, 0] - run.com[going][0, 0]
        bottom.plot(run.t[going], moved, color=colour, linestyle=stroke, linewidth=2.0, label=name)
    top.set_ylabel("work of the motors (J)")
    bottom.set_ylabel("way (m)")
    bottom.set_xlabel("time (s)")
    for axes in (top, bottom):
        tidy(axes)
        axes.set_ylim(0.0)
    bottom.set_xlim(0.0, max(float(run.t[-1]) for run in cases.values()))
    handles: list[Any] = [
        Line2D([], [], color=INK, linewidth=2.0, label="absolute work"),
        Line2D([], [], color=INK, linewidth=0.9, label="positive work alone"),
    ]
    top.legend(handles=handles, loc="upper left", frameon=False)
    bottom.legend(loc="lower right", frameon=False)
    return figure
