"""IV-D: Table II, and what the paper says about how search times grow.

The rows are those of :mod:`wfbook.table2`, each searched by the tight formulation in a process of its own;
the paper's own formulation is left to ``python -m wfbook table2``.
"""

import json
from pathlib import Path
from typing import Any

from wfbook import terrain as ground
from wfbook.modes import END_EFFECTORS
from wfbook.paper.bench import Bench
from wfbook.paper.gaits import SLOT_S
from wfbook.paper.record import Record, Result, compared, measured, stated
from wfbook.quoted import value
from wfbook.report import percent
from wfbook.table2 import benchmark
from wfbook.table2.benchmark import APART, FORMAT, GOAL_PER_SLOT, ROWS, Benchmark
from wfbook.table2.trial import OUTCOME, Trial

ROLLING = "1,2,5 with rolling friction"
"""A row that the paper's table leaves out: what it calls rolling friction added to 1,2,5."""

_HALF_SECOND_ROW = "1,1,5"
_GROWING = (("1,1,5", "1,1,10"), ("1,1,10", "1,2,10"), ("1,1,10", "3,1,10"))
"""Rows that differ in slots, in end-effector types and in regions only; the second is larger."""

_HARDER = (("1,2,5", ROLLING), (f"3,2,5{APART}", "3,2,5"))
"""Rows without, and with, rolling friction and rolling between regions."""


def run(bench: Bench) -> Result:
    """Search the rows, or read what ``table2`` found, and compare times."""
    given = bench.options.table2
    report = read(given) if given else _searched(bench)
    outcomes = {row["row"]: row["tight"] for row in report["rows"] if row["tight"]}
    if not given:
        outcomes[ROLLING] = bench.time(_trial(bench, ground.builtin("flat-friction"), 5, 2), ROLLING)
    result = Result(
        settings={"slot_s": SLOT_S, "goal_m_per_slot": GOAL_PER_SLOT, "machine": report["machine"]}
    )
    result.settings["source"] = str(given) if given else "searched"
    result.records = [compared("table2.short", 5 * SLOT_S), compared("table2.long", 10 * SLOT_S)]
    for name, outcome in outcomes.items():
        result.records.append(_record(name, outcome))
    result.records += _statements(outcomes)
    result.notes = [
        "Times are those of the machine named in the settings, with whatever else it did; the paper's are "
        "Gurobi's. A time without a proven gap is that of a search that did not finish.",
        f"The paper's table is without rolling between regions: that is the row {APART[1:]!r}.",
    ]
    result.troubles = [
        f"{name}: {outcome['status']}: {outcome['message'].splitlines()[-1]}"
        for name, outcome in outcomes.items()
        if outcome["message"]
    ]
    result.pictures["table2.png"] = lambda: _picture(report)
    return result


def read(path: Path) -> dict[str, Any]:
    """Read what ``python -m wfbook table2`` left.

    Raises:
        ValueError: the file is no such report; the message names it.
        OSError: it can't be read.
    """
    text = path.read_text(encoding="utf-8")
    try:
        report = json.loads(text)
        if report["format"] != FORMAT:
            raise ValueError(f"{path}: format {report['format']!r}, this program reads {FORMAT}")
        for row in report["rows"]:
            if row["tight"] is not None and not set(OUTCOME) <= set(row["tight"]):
                raise ValueError(f"{path}: row {row['row']!r}: an entry is missing")
        _ = report["machine"], report["growth"], report["complete"]
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise ValueError(f"{path}: not a report of table2 ({error!r})") from None
    return report


def _searched(bench: Bench) -> dict[str, Any]:
    """Return the report of the table's rows, each searched or known from before."""
    options = benchmark.Options(gap=bench.options.gap, time_limit=bench.options.time_limit, cap=0.0)
    table = Benchmark(ROWS, (), options)
    for row, entry in zip(ROWS, table.report["rows"], strict=True):
        asked = _trial(bench, row.terrain, row.slots, row.types)
        entry["tight"] = bench.time(asked, f"{row.terrain.name} {row.name}")
        if entry["tight"]["status"] == "optimal":
            entry["ratio_gurobi"] = row.gurobi_s / entry["tight"]["search_s"]
    table.report["complete"] = True
    return table.report


def _trial(bench: Bench, terrain: ground.Terrain, slots: int, types: int) -> Trial:
    options = bench.options
    return Trial(
        terrain,
        goal=(GOAL_PER_SLOT * slots, 0.0),
        slots=slots,
        end_effectors=END_EFFECTORS[:types],
        gap=options.gap,
        time_limit=options.time_limit,
    )


def _record(name: str, outcome: dict[str, Any]) -> Record:
    """Return a row's time beside the paper's."""
    found = f"{outcome['status']}" + (
        f", gap {percent(outcome['gap'])}" if outcome["gap"] is not None else ""
    )
    key = f"table2.{name}"
    if name in _ROW_NAMES:
        said = compared(key, outcome["search_s"], found)
        return Record(f"{said.what}, row {name}", said.ours, said.unit, key, proof=found)
    return measured(f"search time, row {name}", outcome["search_s"], "s", found)


def _statements(outcomes: dict[str, dict[str, Any]]) -> list[Record]:
    """Return what the paper says about growth; the value is the least factor among the pairs of rows."""
    times = {name: outcome["search_s"] for name, outcome in outcomes.items() if outcome["search_s"]}
    records = []
    for key, pairs in (("times.grow", _GROWING), ("times.harder", _HARDER)):
        known = [(a, b) for a, b in pairs if a in times and b in times]
        factors = [times[larger] / times[smaller] for smaller, larger in known]
        names = ", ".join(f"{larger} over {smaller}" for smaller, larger in known)
        if factors:
            shown = ", ".join(f"{factor:.2g}" for factor in factors)
            least = min(factors)
            records.append(stated(key, least > 1.0, least, "times at least", f"{names}: {shown}"))
    if _HALF_SECOND_ROW in times:
        row = f"row {_HALF_SECOND_ROW}; the paper's own time for it is {value('table2.1,1,5'):g} s"
        records.append(compared("times.half_second", times[_HALF_SECOND_ROW], row))
    return records


_ROW_NAMES = tuple(row.name for row in ROWS if not row.name.endswith(APART))


def _picture(report: dict[str, Any]):
    from wfbook.view import benchmarks

    return benchmarks.table2(report)
