"""The comparison as text: Markdown for the results' folder, a table for the terminal."""

from collections.abc import Iterator
from typing import Any

from wfbook.report import aligned

_HEADINGS = ("", "paper", "ours", "over the seeds", "ours / paper", "rests on")


def markdown(report: dict[str, Any]) -> str:
    """Return the whole comparison as Markdown.

    Args:
        report: what ``paper.json`` holds.
    """
    return "\n".join(_markdown(report)) + "\n"


def table(report: dict[str, Any]) -> str:
    """Return the comparison for the terminal: what is compared, the paper's value and ours."""
    parts = []
    for experiment in report["experiments"]:
        rows = [(experiment["name"], "paper", "ours", "ours / paper")]
        for record in experiment["records"]:
            what, paper, ours, _, ratio, _ = cells(record)
            rows.append((what, paper, ours, ratio))
        parts.append(aligned(rows))
        parts += experiment["troubles"]
    if not report["complete"]:
        parts.append("incomplete: interrupted before the rest was done; the same command goes on from here")
    return "\n\n".join(parts)


def cells(record: dict[str, Any]) -> tuple[str, ...]:
    """Return a record as the cells of a table's row.

    Args:
        record: as :meth:`wfbook.paper.record.Record.to_dict` has it.

    Returns:
        What it is, the paper's value, ours, its range over the seeds, the ratio, and what it rests on.
    """
    paper, ours, unit = record["paper"], record["ours"], record["unit"]
    said, decimals = "", 0
    if paper is not None:
        said = "stated" if paper["value"] is None else _printed(paper["value"], unit)
        decimals = len(f"{paper['value'] or 0:g}".partition(".")[2])
    shown = "none" if ours is None else amount(ours, unit, decimals)
    if record["holds"] is not None:
        shown = f"{'yes' if record['holds'] else 'no'}: {shown}"
    spread = ""
    if record["low"] is not None and record["high"] > record["low"]:
        spread = f"{number(record['low'], decimals)} to {number(record['high'], decimals)}"
    ratio = ""
    if paper is not None and paper["value"] and ours is not None:
        ratio = f"{ours / paper['value']:.2f}"
    return record["what"], said, shown, spread, ratio, record["proof"]


def amount(value: float, unit: str, decimals: int = 0) -> str:
    """Return a value with its unit."""
    return number(value, decimals) if unit in ("", "1") else f"{number(value, decimals)} {unit}"


def number(value: float, decimals: int = 0) -> str:
    """Return a number with three significant digits, or as it is if it is whole or large.

    Args:
        value: the number.
        decimals: that it has at least, unless it is whole or large: as many as what it stands beside.
    """
    if value == int(value) or abs(value) >= 1000:
        return f"{value:.0f}"
    short = f"{value:#.3g}".rstrip(".")
    return short if len(short.partition(".")[2]) >= decimals else f"{value:.{decimals}f}"


def _printed(value: float, unit: str) -> str:
    """Return a number of a paper's with as many digits as are printed, but at least as many as ours have."""
    return amount(value, unit, len(f"{value:g}".partition(".")[2]))


def _markdown(report: dict[str, Any]) -> Iterator[str]:
    options, machine = report["options"], report["machine"]
    yield "# The papers' results beside ours"
    yield ""
    yield (
        f"Done on {machine['usable_cores']} of {machine['cores']} cores, {machine['processor']}. Searches "
        f"end at a gap of {100 * options['gap']:g} % or after {options['time_limit']:g} s. Each plan is "
        f"simulated with {len(options['seeds'])} seeds; the controller sees the {options['state']} state, "
        f"and torques act after {options['delay_ms']:g} ms. Of paper B's robot that is the age of what is "
        "measured, with noise if its state is estimated. Ours is the median over the seeds."
    )
    if not report["complete"]:
        yield "\n**Incomplete**: interrupted before the rest was done; the same command goes on from here."
    for experiment in report["experiments"]:
        yield f"\n## {experiment['title']} ({experiment['where']})\n"
        yield f"| {' | '.join(_HEADINGS)} |"
        yield "|---|" + "---:|" * 4 + "---|"
        for record in experiment["records"]:
            yield f"| {' | '.join(cells(record))} |"
        if experiment["lines"]:
            yield "\n```\n" + "\n".join(experiment["lines"]) + "\n```"
        for name in experiment["pictures"]:
            yield f"\n![{experiment['title']}]({name})"
        settings = ", ".join(
            f"{name} {entry}" for name, entry in experiment["settings"].items() if not isinstance(entry, dict)
        )
        yield f"\nSettings: {settings}."
        for text in experiment["notes"]:
            yield f"\n- {text}"
        for text in experiment["troubles"]:
            yield f"\n- **{text}**"
    if report["unused"]:
        yield "\n## Not compared\n"
        for said in report["unused"]:
            yield f"- {said['where']}, {said['says']}: {said['unused']}"
