"""The picture of Table II: search times of rows and formulations, and how they grow.

Green is feet only and orange feet and wheels, as everywhere. A filled marker is a search that proved its
gap; an open one did not finish, and its gap stands beside it.
"""

from collections.abc import Sequence
from typing import Any

from matplotlib.lines import Line2D

from wfbook.view.style import BODY, FOOT, INK, MEASURED, PAPER, PLANNED, WHEEL, Picture, tidy

_SERIES = (("tight", "tight formulation", PLANNED, "o"), ("paper", "paper's formulation on SCIP", BODY, "s"))
_KINDS = (("feet only", ["foot"], FOOT), ("feet and wheels", ["foot", "wheel"], WHEEL))


def table2(report: dict[str, Any]) -> Picture:
    """Draw what :class:`wfbook.table2.benchmark.Benchmark` found.

    Args:
        report: of the benchmark, complete or not.

    Returns:
        Time over the table's rows, and below it over slots and regions if that was measured.
    """
    layout = [["rows", "rows"]] if report["rows"] else []
    layout += [["slots", "regions"]] if any(report["growth"].values()) else []
    figure = Picture(8.0, 4.0 + 3.0 * (len(layout) > 1))
    panels = figure.subplot_mosaic(layout)
    for axes in panels.values():
        tidy(axes)
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylabel("search time (s)")
    if report["rows"]:
        _rows(panels["rows"], report["rows"])
        handles = [Line2D([], [], color=MEASURED, marker="D", linestyle="", label="Gurobi, in the paper")]
        handles += [Line2D([], [], color=c, marker=m, linestyle="", label=text) for _, text, c, m in _SERIES]
        _legend(panels["rows"], handles)
    if "slots" in panels:
        panels["regions"].sharey(panels["slots"])
        for axis in ("slots", "regions"):
            _growth(panels[axis], axis, report["growth"][axis])
        handles = [Line2D([], [], color=colour, marker="o", label=text) for text, _, colour in _KINDS]
        _legend(panels["slots"], handles)
    return figure


def _legend(axes: Any, handles: list[Line2D]) -> None:
    """Put a legend in one line above the axes."""
    axes.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(handles), frameon=False
    )


def _rows(axes: Any, rows: Sequence[dict[str, Any]]) -> None:
    for place, row in enumerate(rows):
        axes.plot(place, row["gurobi_s"], "D", color=MEASURED, gid=f"{row['row']} Gurobi")
        for i, (key, _, colour, marker) in enumerate(_SERIES):
            if row[key] is not None:
                _point(axes, (place, 0.02 + 0.07 * i), row[key], colour, marker, f"{row['row']} {key}")
    names = [row["terrain"].removesuffix("-apart") + "\n" + row["row"].replace("-", "\n") for row in rows]
    axes.set_xticks(range(len(rows)), names)
    axes.set_xlim(-0.5, len(rows) - 0.2)
    axes.set_xlabel("terrain and row: regions, end-effector types, slots")


def _growth(axes: Any, axis: str, points: Sequence[dict[str, Any]]) -> None:
    for i, (name, kinds, colour) in enumerate(_KINDS):
        mine = [p for p in points if p["end_effectors"] == kinds and p["tight"] is not None]
        timed = [(p["count"], p["tight"]["search_s"]) for p in mine if p["tight"]["search_s"] is not None]
        if timed:
            axes.plot(*zip(*timed, strict=True), color=colour, linewidth=1.2)
        for point in mine:
            place = (point["count"], 0.02 + 0.08 * i)
            _point(axes, place, point["tight"], colour, "o", f"{point['count']} {axis} {name}")
    axes.set_xticks(sorted({point["count"] for point in points}))
    axes.set_xlabel(axis)


def _point(
    axes: Any, place: tuple[float, float], outcome: dict[str, Any], colour: str, marker: str, name: str
) -> None:
    """Draw an outcome: filled if proven, else open with its gap, or only its status if it has no time.

    Args:
        axes: to draw in.
        place: x in data, and the height in shares of the axes at which a status may stand.
        outcome: of a trial.
        colour: of the marker.
        marker: its shape.
        name: of what is drawn.
    """
    x, low = place
    style = {"color": colour, "gid": name}
    if outcome["search_s"] is None:
        where = ("data", "axes fraction")
        axes.annotate(outcome["status"], (x, low), xycoords=where, ha="center", fontsize="small", **style)
        return
    proven = outcome["status"] == "optimal"
    axes.plot(x, outcome["search_s"], marker, markerfacecolor=colour if proven else PAPER, **style)
    if not proven:
        text = outcome["status"] if outcome["gap"] is None else f"gap {100 * outcome['gap']:.2g} %"
        axes.annotate(
            text,
            (x, outcome["search_s"]),
            textcoords="offset points",
            xytext=(6, 0),
            va="center",
            color=INK,
            fontsize="small",
        )
