"""What ``study`` prints."""

from collections import Counter
from typing import Any

from wfbook.report import aligned
from wfbook.study.tables import CONFIDENCE

_HEADING = ("upright", "share", f"{100 * CONFIDENCE:.0f} % interval", "arrived", "body rms (mm)", "errors")


def report_text(report: dict[str, Any]) -> str:
    """Return the summary of a study: a table for each sweep, and the shares of each grid.

    Args:
        report: as in ``study.json``.
    """
    several = len(report["definition"]["plans"]) > 1
    blocks = []
    for sweep in report["sweeps"]:
        rows = [(*sweep["labels"], *_HEADING)]
        rows += [(f"{cell['values'][0]:g}", *_cell(cell)) for cell in sweep["cells"]]
        blocks.append(_titled(f"plan {sweep['plan']}" if several else "", aligned(rows, left=())))
    for grid in report["grids"]:
        down, across = grid["labels"]
        rows = [(f"{down} \\ {across}", *dict.fromkeys(f"{c['values'][1]:g}" for c in grid["cells"]))]
        for level in dict.fromkeys(cell["values"][0] for cell in grid["cells"]):
            cells = [cell for cell in grid["cells"] if cell["values"][0] == level]
            rows.append((f"{level:g}", *(f"{cell['upright']}/{cell['runs']}" for cell in cells)))
        title = "upright" + (f", plan {grid['plan']}" if several else "")
        blocks.append(_titled(title, aligned(rows, left=())))
    counted = Counter(failure["error"] for failure in report["failures"])
    if counted:
        blocks.append("\n".join(f"{count} runs ended with {error}" for error, count in counted.items()))
    finished, asked = report["finished"], report["asked"]
    blocks.append(f"{finished} runs" if finished == asked else f"{finished} of {asked} runs: incomplete")
    return "\n\n".join(blocks)


def _titled(title: str, text: str) -> str:
    return f"{title}\n{text}" if title else text


def _cell(cell: dict[str, Any]) -> tuple[str, ...]:
    if not cell["runs"]:
        return "0/0", "", "", "", "", str(cell["errors"] or "")
    rms = cell["base_rms_m_median"]
    return (
        f"{cell['upright']}/{cell['runs']}",
        f"{100 * cell['share']:.0f} %",
        f"{100 * cell['low']:.0f} to {100 * cell['high']:.0f} %",
        str(cell["arrived"]),
        "" if rms is None else f"{1e3 * rms:.1f}",
        str(cell["errors"] or ""),
    )
