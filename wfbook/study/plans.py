"""The plans of a study: from files, or made once for a terrain and kept beside the results."""

import hashlib
import json
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from wfbook.arguments import GOAL_PER_SLOT, LONG, file_name
from wfbook.modes import END_EFFECTORS
from wfbook.study.design import digest
from wfbook.terrain import Terrain


def from_files(paths: Sequence[str]) -> dict[str, bytes]:
    """Read plan files.

    Returns:
        Their content by name: that of the file, or its whole path where that is not enough.

    Raises:
        ValueError: a file is no plan, or is given twice.
        OSError: a file can't be read.
    """
    from wfbook.planner import Plan

    stems = [Path(path).stem for path in paths]
    found: dict[str, bytes] = {}
    digests: dict[str, str] = {}
    for path, stem in zip(paths, stems, strict=True):
        Plan.load(path)
        content = Path(path).read_bytes()
        same = digests.setdefault(digest(content), path)
        if same != path or path in found:
            raise ValueError(f"--plan: {path!r} is the same plan as {same!r}")
        found[stem if stems.count(stem) == 1 else path] = content
    return found


def for_terrain(
    terrain: Terrain,
    slots: int,
    feet_only: bool,
    time_limit: float,
    folder: Path,
    show: Callable[[str], None],
) -> tuple[Path, bytes]:
    """Plan on a terrain, or take the plan that was made for the same question before.

    A search that is ended by its time limit finds another plan each time, and a study that goes on needs the
    one that it began with.

    Args:
        terrain: to plan on; the goal is ``GOAL_PER_SLOT`` ahead for each slot.
        slots: number of slots.
        feet_only: without wheels.
        time_limit: of the search, in seconds.
        folder: of the results.
        show: called now and then with a line of text.

    Returns:
        The file where the plan is kept or, if it is new, is to be kept; and its content.

    Raises:
        ValueError: the kept file is no plan, or the planner doesn't take such a problem.
        wfbook.planner.InfeasibleError: there is no plan.
        wfbook.planner.NoPlanError: none was found in time.
    """
    from wfbook import planner
    from wfbook.report import search_line

    end_effectors = END_EFFECTORS[:1] if feet_only else END_EFFECTORS
    asked = json.dumps([terrain.to_dict(), slots, end_effectors, time_limit])
    path = folder / f"plan-{file_name(terrain.name)}-{hashlib.sha256(asked.encode()).hexdigest()[:8]}.npz"
    if path.exists():
        planner.Plan.load(path)
        return path, path.read_bytes()
    problem = planner.Problem(
        terrain, goal=(GOAL_PER_SLOT * slots, 0.0), slots=slots, end_effectors=end_effectors
    )
    search = planner.solve_windows if slots > LONG else planner.solve_executable
    _, plan = search(
        problem,
        time_limit=time_limit,
        progress=lambda now: show(f"planning {terrain.name} {search_line(now)}"),
    )
    with tempfile.TemporaryDirectory() as scratch:
        plan.save(Path(scratch) / "plan.npz")
        return path, (Path(scratch) / "plan.npz").read_bytes()
