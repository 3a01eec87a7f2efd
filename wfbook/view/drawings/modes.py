"""Chapter 3: the rows of S and D, the paths through them, the centroid, and the two relaxations."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from scipy.spatial import ConvexHull

from wfbook.modes import END_EFFECTORS, LEGS
from wfbook.view.style import FOOT, INK, LIMIT, PALE, PAPER, PLANNED, RELAXED, SWING, WHEEL, Picture, tidy

if TYPE_CHECKING:
    from wfbook.planner import Plan, Root

_GREYS = LinearSegmentedColormap.from_list("swing", [PAPER, PALE])
"""From a leg that stands to one that swings."""

_TABLE_STYLE = """<style>
.rows-of-a-leg td, .rows-of-a-leg th { padding: 1px 6px; text-align: center; font: 13px system-ui, sans-serif;
  border: 1px solid #fff; color: #222; }
.rows-of-a-leg th { text-align: left; font-weight: normal; }
.rows-of-a-leg .now { border-color: #222; font-weight: bold; }
</style>"""


def rows_table(plan: "Plan", leg: str) -> str:
    """Return the rows of S and D of one leg as an HTML table.

    Its columns belong to their slot's stretch of time (see :func:`wfbook.view.meshcat_static.page`).

    Args:
        plan: relaxed or polished.
        leg: its name.

    Returns:
        One line for S, one for each region and end effector of D; zeros are white. On several regions the
        lines of D without a 1 are left out, and one more line says which region is under the contact when a
        slot ends.
    """
    index = LEGS.index(leg)
    D, several = plan.D[index], plan.D.shape[2] > 1
    lines = [("slot", np.arange(plan.slots), PAPER), (f"S, {leg} swings", plan.S[index], SWING)]
    for region, e in np.ndindex(D.shape[1:]):
        if not several or D[:, region, e].any():
            where = f", region {region}" if several else ""
            lines.append((f"D, {END_EFFECTORS[e]}{where}", D[:, region, e], (FOOT, WHEEL)[e]))
    if several:
        lines.append(("region under it", np.array(plan.meta["regions"][index]), PAPER))
    rows = []
    for name, values, colour in lines:
        cells = "".join(_cell(plan, j, int(value), colour) for j, value in enumerate(values))
        rows.append(f"<tr><th>{name}</th>{cells}</tr>")
    return f'{_TABLE_STYLE}<table class="rows-of-a-leg">{"".join(rows)}</table>'


def _cell(plan: "Plan", slot: int, value: int, colour: str) -> str:
    start = plan.t[0] + slot * plan.slot_duration
    shade = colour if value and colour != PAPER else PAPER
    when = f'data-from="{start:.6g}" data-to="{start + plan.slot_duration:.6g}"'
    return f'<td {when} style="background:{shade}">{value}</td>'


def trellis(S: np.ndarray, D: np.ndarray, start: np.ndarray) -> Picture:
    """Draw what one leg may do as paths from slot to slot (Paper A, eqs 16, 17).

    Args:
        S: ``(J,)`` swing row: its path is drawn strong.
        D: ``(J, R, E)`` dynamics rows.
        start: ``(R, E)`` D before slot 0.

    Returns:
        A dot for each thing that a leg can do in a slot, to stand on or to swing to a region with an end
        effector; a line from slot to slot where eq. 16 allows it.
    """
    kinds = list(np.ndindex(start.shape))
    states = [(0, *kind) for kind in kinds] + [(1, *kind) for kind in kinds]  # stand, then swing
    path = [(0, *np.argwhere(start)[0])]
    path += [(int(s), *np.argwhere(d)[0]) for s, d in zip(S, D, strict=True)]
    columns = [[path[0]], *[states] * len(S)]
    figure = Picture(8.0, 0.6 + 0.32 * len(states))
    axes = figure.add_subplot()
    tidy(axes)
    axes.grid(visible=False)
    for j in range(len(S)):
        for before in columns[j]:
            for after in states:
                if after[0] or after[1:] == before[1:]:
                    on = (before, after) == (path[j], path[j + 1])
                    style = (
                        {"color": PLANNED, "linewidth": 3, "zorder": 3} if on else {"color": PALE, "lw": 0.8}
                    )
                    ends = [states.index(before), states.index(after)]
                    axes.plot([j - 1, j], ends, **style, gid="path" if on else "edge")
    for j, column in enumerate(columns, start=-1):
        for state in column:
            swings, _, e = state
            colour = (FOOT, WHEEL)[e]
            axes.plot(
                j,
                states.index(state),
                "o",
                ms=9,
                mfc=SWING if swings else colour,
                mec=colour,
                mew=2,
                zorder=4,
            )
    names = [f"{'swing to' if s else 'stand on'} {r}, {END_EFFECTORS[e]}" for s, r, e in states]
    axes.set_yticks(range(len(states)), names)
    axes.set_ylim(len(states) - 0.4, -0.6)
    axes.set_xticks(range(-1, len(S)), ["before", *map(str, range(len(S)))])
    axes.set_xlabel("slot")
    axes.set_ylabel("mode")
    return figure


def centroid(plan: "Plan", slots: Sequence[int]) -> Picture:
    """Draw contacts, centroid and centre of mass from above, at the end of some slots (eqs 10–15)."""
    figure = Picture(8.0, 3.0)
    per_slot = plan.knots // plan.slots
    for slot, axes in zip(slots, np.atleast_1d(figure.subplots(1, len(slots), sharey=True)), strict=True):
        tidy(axes)
        knot = (slot + 1) * per_slot
        stands = plan.S[:, slot] == 0
        contacts, x, c = plan.p[knot, stands, :2], plan.x[knot, :2], plan.c[knot - 1, :2]
        corners = contacts[ConvexHull(contacts).vertices] if len(contacts) > 2 else contacts
        axes.add_patch(Polygon(corners, closed=True, facecolor="none", edgecolor=PALE, linewidth=2))
        for leg in range(len(LEGS)):
            colour = (FOOT, WHEEL)[plan.end_effector[leg, slot]] if stands[leg] else SWING
            edge = colour if stands[leg] else PALE
            axes.plot(*plan.p[knot, leg, :2], "o", color=colour, mec=edge, ms=11, gid=LEGS[leg])
            axes.annotate(
                LEGS[leg], plan.p[knot, leg, :2], (0, 10), textcoords="offset points", ha="center", color=INK
            )
        axes.plot(*zip(x, c, strict=True), color=LIMIT, linewidth=1.5, gid="away")
        axes.plot(*c, "+", color=INK, ms=13, mew=2.5, gid="centroid")
        axes.plot(*x, "o", color=PLANNED, ms=7, gid="com")
        axes.set_title(f"end of slot {slot}, {int((~stands).sum())} swing", fontsize="medium", color=INK)
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.15, 0.25)
        axes.set_xlabel("x, forward (m)")
    figure.axes[0].set_ylabel("y, left (m)")
    dot = {"linestyle": "", "marker": "o", "markersize": 9}
    handles = [
        Line2D([], [], color=FOOT, label="on its foot", **dot),
        Line2D([], [], color=WHEEL, label="on its wheel", **dot),
        Line2D([], [], color=SWING, mec=PALE, label="swings", **dot),
        Line2D([], [], color=INK, linestyle="", marker="+", mew=2.5, ms=11, label="centroid c"),
        Line2D([], [], color=PLANNED, linestyle="", marker="o", label="CoM"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=5, frameon=False)
    return figure


def roots(found: Mapping[str, "Root"], plan: "Plan") -> Picture:
    """Draw what relaxations know before the search, beside the plan that the search ends with.

    Args:
        found: by name, relaxations of one problem.
        plan: of the same.

    Returns:
        Above, each swing matrix: 0 white, 1 grey, and the numbers. Below, each bound as a bar, the plan's
        objective as a line.
    """
    names = [*found, "the plan"]
    matrices = [root.S for root in found.values()] + [plan.S]
    figure = Picture(8.0, 4.4)
    grid = figure.add_gridspec(2, len(names), height_ratios=(1.5, 1.0))
    for column, (name, S) in enumerate(zip(names, matrices, strict=True)):
        axes = figure.add_subplot(grid[0, column])
        axes.imshow(S, cmap=_GREYS, vmin=0.0, vmax=1.0, aspect="auto", gid=name)
        for (leg, slot), value in np.ndenumerate(np.abs(np.round(S, 2))):
            axes.text(slot, leg, f"{value:.2f}".rstrip("0").rstrip("."), ha="center", va="center", color=INK)
        axes.set_title(f"S, {name}", fontsize="medium", color=INK)
        axes.set_xticks(range(S.shape[1]))
        axes.set_yticks(range(len(LEGS)), LEGS if column == 0 else [""] * len(LEGS))
        axes.set_xlabel("slot")
    axes = figure.add_subplot(grid[1, :])
    tidy(axes)
    axes.grid(axis="y", visible=False)
    axes.barh(list(found), [root.bound for root in found.values()], color=RELAXED, edgecolor=INK, height=0.55)
    for row, root in enumerate(found.values()):
        axes.text(root.bound, row, f" {root.bound / plan.meta['objective']:.0%}", va="center", color=INK)
    axes.axvline(plan.meta["objective"], color=PLANNED, linewidth=2, gid="objective")
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.15 * plan.meta["objective"])
    axes.set_xlabel("cost (1)")
    handles = [
        Patch(facecolor=RELAXED, edgecolor=INK, label="bound of the relaxation"),
        Line2D([], [], color=PLANNED, linewidth=2, label="cost of the best plan"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    return figure
