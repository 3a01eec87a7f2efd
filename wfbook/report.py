"""What the command line shows: a progress line, a summary table, numbers as JSON."""

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TextIO

import numpy as np

if TYPE_CHECKING:
    from wfbook.planner import Progress


def plain(value: Any) -> Any:
    """Return the value in JSON's types: NumPy's numbers as Python's, what is not finite as None."""
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def percent(gap: float | None) -> str:
    """Return a relative gap as text."""
    return f"{100.0 * gap:.2f} %" if gap is not None and math.isfinite(gap) else "unknown"


def search_line(now: "Progress") -> str:
    """Return where a search stands as one line of text."""
    incumbent = f"{now.incumbent:.4f}" if math.isfinite(now.incumbent) else "none"
    return (
        f"{now.time:6.1f} s  nodes {now.nodes:6d}  incumbent {incumbent}  "
        f"bound {now.bound:.4f}  gap {percent(now.gap)}"
    )


def aligned(rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> str:
    """Return rows of cells as lines with aligned columns.

    Args:
        rows: equally many cells each, the heading first.
        left: columns that begin at the same place; the others end there, as numbers do.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = zip(row, widths, strict=True)
        texts = [c.ljust(w) if i in left else c.rjust(w) for i, (c, w) in enumerate(cells)]
        lines.append("  ".join(texts).rstrip())
    return "\n".join(lines)


def summary_table(metrics: dict[str, Any], folder: Path) -> str:
    """Return the summary that is printed at the end.

    Args:
        metrics: of the run.
        folder: where the results are.
    """

    def number(name: str, form: str = ".2f", scale: float = 1.0) -> str:
        value = metrics.get(name)
        return "unknown" if value is None else format(value if scale == 1.0 else scale * value, form)

    rows = {
        "terrain": metrics["terrain"],
        "end effectors": ", ".join(metrics["end_effectors"]),
        "search": f"{metrics['status'] or 'unknown'}, {number('nodes', 'd')} nodes, "
        f"{number('solve_time_s')} s",
        "objective": f"{number('objective', '.4f')}, bound {number('bound', '.4f')}, "
        f"gap {percent(metrics['gap'])}",
        "planned": f"{number('planned_distance_m', '.3f')} m in {number('plan_duration_s')} s, "
        f"{metrics['swings']} swings",
        "moved": f"{number('distance_m', '.3f')} m in {number('duration_s')} s, {number('speed_m_s')} m/s",
        "cost of transport": f"{number('cot_abs', '.3f')}, "
        f"of positive work alone {number('cot_positive', '.3f')}",
        "body error, rms": f"{number('base_rms_m', '.1f', 1e3)} mm, "
        f"{number('base_rms_rad', '.2f', math.degrees(1.0))} degrees",
        "slip, at most": f"{number('slip_max_m', '.1f', 1e3)} mm",
        "control tick": f"{number('tick_ms_median')} ms median, {number('tick_ms_p99')} ms p99",
        "real-time factor": number("real_time_factor"),
        "upright": "yes" if metrics["upright"] else "no",
        "results": str(folder),
    }
    if metrics["status"] is None:  # a plan that no search made
        del rows["search"], rows["objective"]
    if (ahead := metrics.get("replanning")) is not None:
        del rows["objective"]
        rows["search"] = (
            f"{len(ahead['windows'])} windows, {ahead['late']} late, {ahead['without_plan']} without a plan"
        )
        if ahead["share_max"] is not None:
            rows["search"] += (
                f"; {ahead['planning_s_median']:.2f} s median, at most {100 * ahead['share_max']:.0f} % "
                "of the time there was"
            )
    return "\n".join(f"{label:18} {text}" for label, text in rows.items())


class ProgressLine:
    """One line that is written over on a terminal, and at most one line a second elsewhere."""

    def __init__(self, stream: TextIO) -> None:
        """Write to this stream."""
        self._stream = stream
        self._terminal = stream.isatty()
        self._next = 0.0
        self._text = ""

    def __enter__(self) -> Self:
        return self

    def show(self, text: str) -> None:
        """Show the text now if it is time for it, else at the end unless another follows."""
        self._text = text
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + (0.1 if self._terminal else 1.0)
        self._print()

    def __exit__(self, *_: object) -> None:
        if self._text:
            self._print()
        if self._terminal and self._next:
            print(file=self._stream)

    def _print(self) -> None:
        start, end = ("\r\x1b[K", "") if self._terminal else ("", "\n")
        print(start + self._text, end=end, file=self._stream, flush=True)
        self._text = ""
