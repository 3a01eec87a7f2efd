"""Chapter 5's drawings: the tree of a branch and bound, and how incumbent and bound close in on each other.

Blue is a plan that somebody has, red the bound that nobody can get below.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from wfbook.modes import LEGS
from wfbook.view.style import FOOT, INK, LIMIT, PALE, PAPER, PLANNED, SWING, WHEEL, Picture, tidy

if TYPE_CHECKING:
    from wfbook.planner import Plan, Progress
    from wfbook.planner.textbook import Node

_STYLES = ("-", "--", ":")
_FATES = {
    "split": ("o", LIMIT, LIMIT, "split in two"),
    "open": ("o", PALE, LIMIT, "open"),
    "pruned": ("o", PAPER, LIMIT, "thrown away: nothing in it is better"),
    "plan": ("*", PLANNED, PLANNED, "a plan: all binaries came out 0 or 1"),
    "infeasible": ("x", INK, INK, "no motion at all"),
    "unclear": ("s", PALE, INK, "the solver could not tell"),
}
_SOONEST = 0.02  # seconds; where a logarithmic time axis begins
_LEAST_GAP = 1e-4


def tree(nodes: Sequence["Node"], shown: int | None = None) -> Picture:
    """Draw a branch and bound, each node at the height of its bound.

    Args:
        nodes: of a whole search, as :func:`wfbook.planner.textbook.grow` returns them.
        shown: how many of them have been visited; default all.

    Returns:
        A tree that grows upwards from the root's bound until it meets the incumbent, the blue line.
    """
    nodes_now = nodes[: len(nodes) if shown is None else shown]
    across = _across(nodes)
    finite = [n.bound for n in nodes if np.isfinite(n.bound)]
    low, high = min(finite), max([*finite, *(n.incumbent for n in nodes if np.isfinite(n.incumbent))])
    room = 0.08 * (high - low or 1.0)
    heights: dict[int, float] = {}
    for n in nodes:
        heights[n.number] = n.bound if np.isfinite(n.bound) else heights[n.parent] + 1.5 * room
    figure = Picture(8.0, 4.2)
    axes = figure.add_subplot()
    tidy(axes)
    axes.grid(axis="x", visible=False)
    for n in nodes_now:
        if n.parent is not None:
            ends = (n.parent, n.number)
            axes.plot([across[i] for i in ends], [heights[i] for i in ends], color=PALE, lw=1.0, zorder=1)
    for fate, (marker, colour, edge, label) in _FATES.items():
        some = [n.number for n in nodes_now if (n.fate if n.decided <= len(nodes_now) else "open") == fate]
        if some:
            axes.plot(
                [across[i] for i in some],
                [heights[i] for i in some],
                marker,
                color=colour,
                markeredgecolor=edge,
                markersize=13 if fate == "plan" else 6.5,
                label=label,
                gid=fate,
                zorder=3,
            )
    if nodes_now:
        last = nodes_now[-1]
        if np.isfinite(last.incumbent):
            axes.axhline(last.incumbent, color=PLANNED, lw=1.6, label="best plan so far", gid="incumbent")
        axes.axhline(last.proven, color=LIMIT, lw=1.2, ls="--", label="proven: nothing below", gid="proven")
        right = across[last.number] < 0.7 * max(across.values())
        axes.annotate(
            last.decision or "root",
            (across[last.number], heights[last.number]),
            textcoords="offset points",
            xytext=(9 if right else -9, -13),
            ha="left" if right else "right",
            color=INK,
            bbox={"facecolor": "white", "edgecolor": PALE, "pad": 2},
            zorder=4,
        )
    axes.set_xlim(-0.6, max(across.values()) + 0.6)
    axes.set_ylim(low - room, high + 2 * room)
    axes.set_xticks([])
    axes.set_ylabel("bound, and cost of plans")
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize="small")
    return figure


def _across(nodes: Sequence["Node"]) -> dict[int, float]:
    """Return where each node is from left to right: leaves side by side, parents above their children."""
    children: dict[int | None, list[int]] = {}
    for n in nodes:
        children.setdefault(n.parent, []).append(n.number)
    places: dict[int, float] = {}
    leaves = 0
    stack = [(number, False) for number in reversed(children.get(None, []))]
    while stack:
        number, done = stack.pop()
        own = children.get(number, [])
        if done:
            places[number] = float(np.mean([places[c] for c in own]))
        elif own:
            stack.append((number, True))
            stack += [(c, False) for c in reversed(own)]
        else:
            places[number] = float(leaves)
            leaves += 1
    return places


def half_swings(node: "Node") -> Picture:
    """Draw the swing matrix of a relaxation, with its fractions."""
    S = node.S
    figure = Picture(0.9 * S.shape[1] + 1.6, 2.1)
    axes = figure.add_subplot()
    for leg, slot in np.ndindex(S.shape):
        value = S[leg, slot]
        axes.barh(leg, 1.0, left=slot, height=0.9, color=PAPER, edgecolor=PALE)
        axes.barh(leg, value, left=slot, height=0.9, color=SWING, gid=f"{LEGS[leg]} {slot}")
        axes.text(slot + 0.5, leg, f"{abs(value):.2f}", ha="center", va="center", color=INK)
    axes.set_yticks(range(len(LEGS)), LEGS)
    axes.set_xticks(np.arange(S.shape[1]) + 0.5, range(S.shape[1]))
    axes.set_xlim(0, S.shape[1])
    axes.set_ylim(len(LEGS) - 0.5, -0.5)
    axes.set_xlabel("slot")
    axes.set_ylabel("leg")
    for side in axes.spines.values():
        side.set_visible(False)
    return figure


def convergence(traces: Mapping[str, Sequence["Progress"]], soon: bool = False) -> Picture:
    """Draw incumbent and bound of searches over time, and below them the gap.

    Args:
        traces: by the search's name, what it told of its progress, in order.
        soon: a logarithmic time axis, where some searches take much longer than others.

    Returns:
        Blue steps down are incumbents, red steps up are bounds; the lines of the first search are solid.
    """
    figure = Picture(8.0, 3.8)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    latest = max([p.time for trace in traces.values() for p in trace], default=1.0)
    for (name, trace), style in zip(traces.items(), _STYLES, strict=False):
        if not trace:
            continue
        times = np.array([p.time for p in trace] + [trace[-1].time])
        times = np.maximum(times, _SOONEST) if soon else times
        incumbent, bound = (_steps([getattr(p, n) for p in trace]) for n in ("incumbent", "bound"))
        gap = 100 * np.maximum(_steps([p.gap for p in trace]), _LEAST_GAP)
        drawn = {"drawstyle": "steps-post", "linestyle": style}
        top.plot(times, incumbent, color=PLANNED, lw=1.8, gid=f"{name} incumbent", **drawn)
        top.plot(times, bound, color=LIMIT, lw=1.8, gid=f"{name} bound", **drawn)
        if len(traces) == 1:
            top.fill_between(times, bound, incumbent, step="post", color=SWING, zorder=0)
        bottom.plot(times, gap, color=INK, lw=1.4, gid=f"{name} gap", **drawn)
    _scale(top, traces)
    bottom.set_yscale("log")
    bottom.set_ylim(0.03, 150)
    bottom.set_yticks([0.1, 1, 10, 100], ["0.1 %", "1 %", "10 %", "100 %"])
    bottom.minorticks_off()
    if soon:
        bottom.set_xscale("log")
        bottom.set_xlim(_SOONEST, 1.1 * latest)
        bottom.xaxis.set_major_formatter("{x:g}")
    else:
        bottom.set_xlim(0.0, 1.02 * latest)
    top.set_ylabel("cost")
    bottom.set_ylabel("gap")
    bottom.set_xlabel("time (s)")
    for axes in (top, bottom):
        tidy(axes)
    handles: list[Any] = [
        Line2D([], [], color=PLANNED, lw=1.8, label="best plan (incumbent)"),
        Line2D([], [], color=LIMIT, lw=1.8, label="bound"),
    ]
    if len(traces) == 1:
        handles.append(Patch(color=SWING, label="gap"))
    else:
        named = zip(traces, _STYLES, strict=False)
        handles += [Line2D([], [], color=INK, lw=1.4, ls=style, label=name) for name, style in named]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return figure


def _steps(values: Sequence[float]) -> np.ndarray:
    """Return values with the last one held; what is not finite is not drawn."""
    steps = np.array([*values, values[-1]], float)
    steps[~np.isfinite(steps)] = np.nan
    return steps


def _scale(axes: Any, traces: Mapping[str, Sequence["Progress"]]) -> None:
    """Show what matters at the end: first plans may cost ten times as much as the last one."""
    told = [p for trace in traces.values() for p in trace]
    best = [p.incumbent for p in told if np.isfinite(p.incumbent)]
    bounds = [p.bound for p in told if np.isfinite(p.bound) and p.bound > 0]
    if best:
        low = min([*bounds, min(best)])
        top = min(max(best), min(best) + 1.5 * (min(best) - low) + 0.05 * min(best))
        room = 0.08 * (top - low or top)
        axes.set_ylim(low - room, top + room)


def costs(plans: "Mapping[str, Plan]") -> Picture:
    """Draw what each term of the cost contributes to relaxed plans (Paper A, eqs 31–33).

    Args:
        plans: by name. Plans that roll are orange, plans that walk are green.

    Returns:
        A bar for each term and plan, the dearest terms on top; what is next to nothing is left out.
    """
    from wfbook.planner.demands import cost_parts

    parts = {name: cost_parts(plan) for name, plan in plans.items()}
    dearest = {term: max(part[term] for part in parts.values()) for term in next(iter(parts.values()))}
    terms = sorted((t for t in dearest if dearest[t] > 1e-3 * max(dearest.values())), key=dearest.get)
    figure = Picture(8.0, 0.9 + 0.45 * len(terms))
    axes = figure.add_subplot()
    tidy(axes)
    axes.grid(axis="y", visible=False)
    height = 0.8 / len(parts)
    for i, (name, part) in enumerate(parts.items()):
        colour = WHEEL if plans[name].end_effector.any() else FOOT
        places = np.arange(len(terms)) + 0.4 - (i + 0.5) * height
        label = f"{name}: {sum(part.values()):.3f} in all"
        axes.barh(places, [part[t] for t in terms], height=0.92 * height, color=colour, label=label, gid=name)
    axes.set_yticks(range(len(terms)), [term.replace("_", " ") for term in terms])
    axes.set_xlabel("cost")
    figure.legend(loc="outside upper center", ncols=len(parts), frameon=False)
    return figure


def sway(relaxed: "Plan", polished: "Plan") -> Picture:
    """Draw from above how a relaxed plan and its polish move their centres of mass, sideways magnified.

    Args:
        relaxed: its path is broken.
        polished: the same gait, whose lines of support are drawn where two legs stand.
    """
    figure = Picture(8.0, 3.2)
    axes = figure.add_subplot()
    tidy(axes)
    rho = polished.knots // polished.slots
    for slot in range(polished.slots):
        standing = np.flatnonzero(polished.S[:, slot] == 0)
        if len(standing) == 2:
            ends = polished.p[slot * rho + rho // 2, standing]
            label = "line between the two legs that stand"
            axes.plot(ends[:, 0], 100 * ends[:, 1], color=PALE, lw=1.0, label=label, gid=f"support {slot}")
    for plan, style, name in ((relaxed, "--", "CoM, relaxed"), (polished, "-", "CoM, polished")):
        axes.plot(plan.x[:, 0], 100 * plan.x[:, 1], color=PLANNED, ls=style, lw=1.8, label=name, gid=name)
    most = 100 * max(np.abs(plan.x[:, 1]).max() for plan in (relaxed, polished))
    axes.set_ylim(-1.4 * most - 1, 1.4 * most + 1)
    axes.set_xlim(polished.x[0, 0] - 0.05, polished.x[-1, 0] + 0.05)
    axes.set_xlabel("x, forward (m)")
    axes.set_ylabel("y, left (cm)")
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    figure.legend(once.values(), once.keys(), loc="outside upper center", ncols=3, frameon=False)
    return figure
