"""The benchmark's report as text."""

from collections.abc import Iterator
from typing import Any

from wfbook.report import aligned, percent
from wfbook.table2.benchmark import APART

_FOUND = ("nodes", "root bound", "bound", "objective", "gap", "memory, MB", "status")
_FOOTNOTE = (
    f"{APART}: every region a group of its own, so that wheels can't roll from one to the next, "
    "as in the paper's table"
)


def table(report: dict[str, Any]) -> str:
    """Return the report as text: times, what was proven, how time grows, what went wrong.

    Args:
        report: what ``table2.json`` holds.
    """
    host, options = report["machine"], report["options"]
    parts = [
        f"Table II to a gap of {percent(options['gap'])} on {host['usable_cores']} of {host['cores']} cores, "
        f"{host['processor']}",
        _times(report["rows"]) if report["rows"] else "",
        _details(report["rows"]),
        _FOOTNOTE if any(row["terrain"].endswith(APART) for row in report["rows"]) else "",
    ]
    if any(report["growth"].values()):
        parts.append(_growth(report["growth"]))
    parts.append("\n".join(_troubles(report)))
    if not report["complete"]:
        parts.append("incomplete: interrupted before the rest was measured")
    return "\n\n".join(part for part in parts if part)


def _times(rows: list[dict[str, Any]]) -> str:
    """Return the table of search times; the ratios are those times over the tight formulation's."""
    lines = [("search time, s", "Gurobi", "tight", "paper on SCIP", "Gurobi / tight", "paper / tight")]
    for row in rows:
        at_least = "> " if row["ratio_paper_at_least"] else ""
        lines.append(
            (
                _name(row),
                f"{row['gurobi_s']:.3f}",
                _time(row["tight"]),
                _time(row["paper"]),
                _number(row["ratio_gurobi"], ".2f"),
                at_least + _number(row["ratio_paper"], ".0f"),
            )
        )
    return aligned(lines)


def _details(rows: list[dict[str, Any]]) -> str:
    lines = [("formulation", "", "build, s", *_FOUND)]
    for row in rows:
        for formulation in ("tight", "paper"):
            outcome = row[formulation]
            if outcome is not None:
                build = _number(outcome["build_s"], ".3f")
                lines.append((_name(row), formulation, build, *_found(outcome)))
    return aligned(lines, left=(0, 1, len(lines[0]) - 1)) if len(lines) > 1 else ""


def _found(outcome: dict[str, Any]) -> tuple[str, ...]:
    return (
        _number(outcome["nodes"], "d"),
        _number(outcome["root_bound"], ".4f"),
        _number(outcome["bound"], ".4f"),
        _number(outcome["objective"], ".4f"),
        percent(outcome["gap"]) if outcome["gap"] is not None else "",
        _number(outcome["peak_memory_mb"], ".0f"),
        outcome["status"],
    )


def _growth(growth: dict[str, list[dict[str, Any]]]) -> str:
    lines = [("growth", "end effectors", "search, s", *_FOUND)]
    for axis, points in growth.items():
        for point in points:
            if point["tight"] is not None:
                kinds = ", ".join(point["end_effectors"])
                found = _found(point["tight"])
                lines.append((f"{point['count']} {axis}", kinds, _time(point["tight"]), *found))
    return aligned(lines, left=(0, 1, len(lines[0]) - 1))


def _troubles(report: dict[str, Any]) -> Iterator[str]:
    """Yield a line for each trial that has a message."""
    for row in report["rows"]:
        for formulation in ("tight", "paper"):
            if row[formulation] and row[formulation]["message"]:
                # Of a traceback, the last line tells what happened.
                last = row[formulation]["message"].splitlines()[-1]
                yield f"{_name(row)}, {formulation}: {row[formulation]['status']}: {last}"
    for axis, points in report["growth"].items():
        for point in points:
            if point["tight"] and point["tight"]["message"]:
                last = point["tight"]["message"].splitlines()[-1]
                yield f"{point['count']} {axis}, {', '.join(point['end_effectors'])}: {last}"


def _name(row: dict[str, Any]) -> str:
    return f"{row['terrain'].removesuffix(APART)} {row['row']}"


def _time(outcome: dict[str, Any] | None) -> str:
    """Return a search time; with "> " if the search did not finish."""
    if outcome is None or outcome["search_s"] is None:
        return "" if outcome is None else outcome["status"]
    return ("" if outcome["status"] == "optimal" else "> ") + f"{outcome['search_s']:.3f}"


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)
