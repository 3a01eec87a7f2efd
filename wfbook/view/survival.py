"""Survival maps: at what disturbance robots still stay upright to the end.

One panel for each factor that was changed alone, with a curve for each plan and Wilson's intervals; one map
for each two that were changed together, with a panel for each plan. Maps go from dark (all fell) to light
(all stayed up) in a scale of rising brightness, and say in each cell how many of how many.
"""

import math
from typing import Any

from matplotlib import colormaps
from matplotlib.lines import Line2D

from wfbook.view.style import BODY, ESTIMATED, FORCE, INK, MEASURED, PAPER, Picture, tidy

_LINES = ((MEASURED, "o", "-"), (ESTIMATED, "s", "--"), (FORCE, "^", "-."), (BODY, "D", ":"))
_COLUMNS = 3
_SCALE = "cividis"
_DARK = 0.5
"""Share below which a cell is dark, and its text white."""


def sweeps(report: dict[str, Any]) -> Picture:
    """Draw the survival share over each factor that was changed alone.

    Args:
        report: as in ``study.json``.
    """
    names = list(dict.fromkeys(sweep["name"] for sweep in report["sweeps"]))
    plans = list(report["definition"]["plans"])
    columns = min(_COLUMNS, len(names))
    rows = math.ceil(len(names) / columns)
    figure = Picture(max(3.0 * columns, 4.5), 2.6 * rows + 0.5)
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for axes, name in zip(panels.flat, names, strict=False):
        mine = [sweep for sweep in report["sweeps"] if sweep["name"] == name]
        tidy(axes)
        axes.set_xlabel(mine[0]["labels"][0])
        axes.set_ylim(-0.05, 1.05)
        axes.locator_params(axis="x", nbins=5)
        axes.axvline(_usual(report, name), color=BODY, linewidth=0.8, linestyle=":", gid="usual")
        for sweep in mine:
            _curve(axes, sweep, len(mine), plans.index(sweep["plan"]))
    for axes in panels.flat[len(names) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("share upright to the end")
    handles = [_handle(i, plan) for i, plan in enumerate(plans)]
    handles += [Line2D([], [], color=BODY, linewidth=0.8, linestyle=":", label="in all other runs")]
    figure.legend(handles=handles, loc="outside upper left", ncols=len(handles), frameon=False)
    return figure


def grid(report: dict[str, Any], name: str) -> Picture:
    """Draw the survival share over two factors, a panel for each plan.

    Args:
        report: as in ``study.json``.
        name: of the grid.
    """
    mine = [grid for grid in report["grids"] if grid["name"] == name]
    down, across = mine[0]["labels"]
    heights = list(dict.fromkeys(cell["values"][0] for cell in mine[0]["cells"]))
    widths = list(dict.fromkeys(cell["values"][1] for cell in mine[0]["cells"]))
    size = 0.62 * len(widths) * len(mine) + 2.6, 0.45 * len(heights) + 1.5
    figure = Picture(max(size[0], 4.5), max(size[1], 3.0))
    panels = figure.subplots(1, len(mine), squeeze=False, sharey=True)[0]
    colours = colormaps[_SCALE].with_extremes(bad=PAPER)
    for axes, one in zip(panels, mine, strict=True):
        shares = [[math.nan] * len(widths) for _ in heights]
        for cell in one["cells"]:
            row, column = heights.index(cell["values"][0]), widths.index(cell["values"][1])
            if cell["share"] is not None:
                shares[row][column] = cell["share"]
            dark = cell["share"] is not None and cell["share"] < _DARK
            style = {"ha": "center", "va": "center", "fontsize": "small", "color": PAPER if dark else INK}
            text = f"{cell['upright']}/{cell['runs']}" + f"\n{cell['errors']} error" * bool(cell["errors"])
            axes.text(column, row, text, **style)
        places = [[n - 0.5 for n in range(len(levels) + 1)] for levels in (widths, heights)]
        image = axes.pcolormesh(
            *places, shares, cmap=colours, vmin=0.0, vmax=1.0, edgecolors=PAPER, linewidth=1
        )
        axes.set_xticks(range(len(widths)), [f"{value:g}" for value in widths])
        axes.set_yticks(range(len(heights)), [f"{value:g}" for value in heights])
        axes.set_xlabel(across)
        axes.set_title(one["plan"], fontsize="medium")
        axes.spines[:].set_visible(False)
    panels[0].set_ylabel(down)
    figure.colorbar(image, ax=panels, label="share upright to the end")
    return figure


def _curve(axes: Any, sweep: dict[str, Any], count: int, index: int) -> None:
    """Draw the curve of one plan; the curves stand a little beside each other."""
    cells = [cell for cell in sweep["cells"] if cell["runs"]]
    if not cells:
        return
    colour, marker, line = _LINES[index % len(_LINES)]
    values = [cell["values"][0] for cell in cells]
    shift = 0.012 * (max(values) - min(values)) * (index - (count - 1) / 2)
    shares = [cell["share"] for cell in cells]
    below = [cell["share"] - cell["low"] for cell in cells]
    above = [cell["high"] - cell["share"] for cell in cells]
    style = {"color": colour, "marker": marker, "linestyle": line, "markersize": 4, "linewidth": 1.2}
    places = [value + shift for value in values]
    drawn = axes.errorbar(places, shares, yerr=(below, above), elinewidth=0.8, capsize=2, **style)
    drawn.lines[0].set_gid(f"{sweep['name']} {sweep['plan']}")


def _handle(index: int, plan: str) -> Line2D:
    colour, marker, line = _LINES[index % len(_LINES)]
    return Line2D([], [], color=colour, marker=marker, linestyle=line, label=plan)


def _usual(report: dict[str, Any], name: str) -> float:
    """Return the value of an axis in all other runs; nowhere if it was drawn."""
    value = report["definition"]["base"][name]
    return math.nan if value is None else value
