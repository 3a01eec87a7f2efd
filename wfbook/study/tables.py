"""What came out: all rows as one Parquet file, and how many robots stayed up at each level."""

import json
import statistics
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from wfbook.study.axes import AXES
from wfbook.study.design import Study, name_of, points

CONFIDENCE = 0.95
"""Of the intervals of survival shares."""

ARRIVED = 0.1, 0.02
"""A robot arrives if its distance is so near to the plan's: a share of that, or metres, whichever is more."""

_TEXTS = ("error", "traceback", "wheel_model", "worker", "status")
"""Columns that may be empty in all runs, and would hold text."""


def rows_of(study: Study, finished: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows of a study in its own order, whatever the order in which they finished.

    Args:
        study: that was asked.
        finished: rows by key.

    Returns:
        For each finished case what :func:`wfbook.study.case.execute` gave, with the case's key as ``run``,
        the plan's name, the sweeps and grids it belongs to, and a column for each version.
    """
    rows = []
    for key, (plan, _, experiments) in study.cases.items():
        if key in finished:
            row = dict(finished[key])
            versions = {f"{name}_version": version for name, version in row.pop("versions").items()}
            rows.append({"run": key, "plan": plan, "experiments": experiments} | row | versions)
    return rows


def write_parquet(path: Path, rows: list[dict[str, Any]], description: dict[str, Any]) -> None:
    """Write one row a run.

    Args:
        path: of the file.
        rows: of :func:`rows_of`.
        description: of the study; as JSON in the file's metadata, under ``wfbook``.
    """
    import pyarrow as pa
    from pyarrow import parquet

    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {}
    for name in names:
        column = pa.array([row.get(name) for row in rows])
        if pa.types.is_null(column.type):  # no run has it
            column = column.cast(pa.string() if name in _TEXTS else pa.float64())
        elif name in {axis.column for axis in AXES.values()}:
            column = column.cast(pa.float64())
        columns[name] = column
    table = pa.table(columns).replace_schema_metadata({"wfbook": json.dumps(description)})
    parquet.write_table(table, path)


def wilson(survived: int, runs: int) -> tuple[float, float] | None:
    """Return Wilson's score interval of a share at ``CONFIDENCE``; None without runs.

    Unlike the usual interval it is right for few runs, and where all or none survive.
    """
    if not runs:
        return None
    z = statistics.NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
    share, spread = survived / runs, z * z / runs
    middle = (share + spread / 2) / (1 + spread)
    half = (share * (1 - share) * spread + spread * spread / 4) ** 0.5 / (1 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)


def survival(rows: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """Return how many of these runs stayed upright to the end, of those without an error.

    A robot may stand upright before a step that its wheels can't take: ``arrived`` are those that stayed
    upright and moved as far as they were to.
    """
    rows = list(rows)
    runs = [row for row in rows if row["error"] is None]
    upright = sum(row["upright"] for row in runs)
    low, high = wilson(upright, len(runs)) or (None, None)
    errors = [row["base_rms_m"] for row in runs if row["upright"]]
    return {
        "runs": len(runs),
        "upright": upright,
        "arrived": sum(row["upright"] and _arrived(row) for row in runs),
        "share": upright / len(runs) if runs else None,
        "low": low,
        "high": high,
        "errors": len(rows) - len(runs),
        "base_rms_m_median": statistics.median(errors) if errors else None,
    }


def _arrived(row: dict[str, Any]) -> bool:
    planned = row["planned_distance_m"]
    return abs(row["distance_m"] - planned) <= max(ARRIVED[0] * planned, ARRIVED[1])


def summary(study: Study, finished: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return survival at each level of each sweep and in each cell of each grid, for every plan.

    Args:
        study: that was asked.
        finished: rows by key; what is missing does not count.

    Returns:
        ``sweeps`` and ``grids``, lists of ``name``, ``axes``, their ``labels``, ``plan`` and ``cells``;
        a cell has the ``values`` of the axes beside what :func:`survival` says.
    """
    found: dict[str, Any] = {}
    for kind, experiments in (("sweeps", [(sweep,) for sweep in study.sweeps]), ("grids", study.grids)):
        found[kind] = []
        for factors in experiments:
            for plan in study.plans:
                cells = []
                for values in points(factors):
                    keys = [study.key(plan, seed, **values) for seed in range(study.seeds)]
                    kept = [finished[key] for key in keys if key in finished]
                    cells.append({"values": list(values.values())} | survival(kept))
                found[kind].append(
                    {
                        "name": name_of(*factors),
                        "axes": [axis.name for axis, _ in factors],
                        "labels": [axis.label for axis, _ in factors],
                        "plan": plan,
                        "cells": cells,
                    }
                )
    return found
