"""A study of a handful of runs, one after the other in this process: for a chapter, without a cluster."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wfbook.study.case import execute
from wfbook.study.design import Study
from wfbook.study.tables import summary

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan


def plan_file(plan: "Plan") -> bytes:
    """Return the content of a plan's file, which is what a study is about."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.npz"
        plan.save(path)
        return path.read_bytes()


def run(
    study: Study,
    finished: dict[str, dict[str, Any]] | None = None,
    told: Callable[[dict[str, Any], int, int], None] | None = None,
) -> dict[str, Any]:
    """Run what is missing of a study.

    Args:
        study: that is asked.
        finished: rows by key of what was run before; what is run now is added.
        told: called after each run with the report so far, how many runs are done, and of how many.

    Returns:
        The report, as ``study.json`` has it: ``definition``, ``sweeps`` and ``grids``.
    """
    finished = {} if finished is None else finished
    missing = [key for key in study.cases if key not in finished]
    for count, key in enumerate(missing, start=1):
        plan, case, _ = study.cases[key]
        finished[key] = execute(case, study.plans[plan])
        if told is not None:
            told(report(study, finished), count, len(missing))
    return report(study, finished)


def report(study: Study, finished: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return what is known of a study, as ``study.json`` has it."""
    return {"definition": study.description()} | summary(study, finished)
