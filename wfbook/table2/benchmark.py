"""The rows of Table II, and how the time grows: what is measured, in which order, and what is kept."""

import itertools
import os
import platform
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from wfbook.modes import END_EFFECTORS
from wfbook.quoted import value
from wfbook.table2 import trial
from wfbook.table2.trial import Trial
from wfbook.terrain import Terrain, flat, ramp

FORMAT = 1
"""Version of ``table2.json``."""

GOAL_PER_SLOT = 0.1
APART = "-apart"
"""Ends the name of a row, and of its terrain, where each region is a group of its own."""

GROWTH_SLOTS = tuple(range(4, 13))
GROWTH_REGIONS = tuple(range(1, 7))
REGIONS_AT_SLOTS = 5
"""Slots of the problems that show how time grows with regions."""

_PACKAGES = ("clarabel", "cvxpy", "numpy", "pyscipopt", "scipy")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Row:
    """A row of Table II.

    Attributes:
        terrain: its regions are the paper's N_r.
        types: N_e, number of end-effector types: 1 feet only, 2 feet and wheels.
        slots: N_j.
        gurobi_s: the paper's time.
    """

    terrain: Terrain
    types: int
    slots: int
    gurobi_s: float

    @property
    def name(self) -> str:
        """N_r, N_e and N_j, as in the paper."""
        suffix = APART if self.terrain.name.endswith(APART) else ""
        return f"{len(self.terrain.regions)},{self.types},{self.slots}{suffix}"


def apart(terrain: Terrain) -> Terrain:
    """Return a terrain with each region in a group of its own, so that wheels can't roll to the next."""
    regions = (replace(r, group=f"{r.group} {i}") for i, r in enumerate(terrain.regions))
    return Terrain(terrain.name + APART, tuple(regions))


def cut(regions: int) -> Terrain:
    """Return level ground cut across the way into so many regions of one group.

    Whatever the cuts, the plans are the same: only their search grows.
    """
    (ground,) = flat().regions
    x = ground.vertices[:, 0]
    # From behind the hind legs' start to before the front legs' end.
    inner = np.linspace(-0.3, GOAL_PER_SLOT * REGIONS_AT_SLOTS + 0.3, regions + 1)[1:-1]
    strips = []
    for begin, end in itertools.pairwise((x.min(), *inner, x.max())):
        vertices = ground.vertices.copy()
        vertices[:, 0] = np.where(x == x.min(), begin, end)
        strips.append(replace(ground, vertices=vertices))
    return Terrain(f"flat-in-{regions}", tuple(strips))


_DOWN = ramp(direction="down")

ROWS = (
    Row(flat(), 1, 5, value("table2.1,1,5")),
    Row(flat(), 1, 10, value("table2.1,1,10")),
    Row(flat(), 2, 5, value("table2.1,2,5")),
    Row(flat(), 2, 10, value("table2.1,2,10")),
    Row(_DOWN, 1, 5, value("table2.3,1,5")),
    Row(_DOWN, 1, 10, value("table2.3,1,10")),
    Row(_DOWN, 2, 5, value("table2.3,2,5")),
    Row(apart(_DOWN), 2, 5, value("table2.3,2,5")),
)


@dataclass(frozen=True)
class Options:
    """What the benchmark is asked.

    Attributes:
        gap: relative gap to prove.
        time_limit: of each search by the tight formulation, in seconds.
        cap: of each search by the paper's formulation; 0 leaves them out.
        repeat: how often the tight formulation searches a row, as long as that is quick.
        growth: also measure how time grows with slots and regions.
        growth_limit: of each search for that, in seconds.
    """

    gap: float = 1e-3
    time_limit: float = 300.0
    cap: float = 300.0
    repeat: int = 3
    growth: bool = False
    growth_limit: float = 60.0


@dataclass
class Benchmark:
    """A run of the benchmark, and what it has found so far.

    Attributes:
        rows: of the table.
        paper_rows: names of those that the paper's formulation searches, too.
        options: what is asked.
        report: what ``table2.json`` holds. It is filled while :meth:`run` goes on; what has not been
            measured (yet) is None. Outcomes are those of :data:`wfbook.table2.trial.OUTCOME`.
    """

    rows: Sequence[Row]
    paper_rows: Sequence[str]
    options: Options = field(default_factory=Options)
    report: dict[str, Any] = field(init=False)

    def __post_init__(self) -> None:
        self.report = {
            "format": FORMAT,
            "complete": False,
            "begun": datetime.now(UTC).isoformat(timespec="seconds"),
            "machine": machine(),
            "options": asdict(self.options),
            "rows": [self._entry(row) for row in self.rows],
            "growth": {"slots": [], "regions": []},
        }

    @property
    def finished(self) -> int:
        """Number of trials that are finished."""
        report = self.report
        outcomes = [row[key] for row in report["rows"] for key in ("tight", "paper")]
        outcomes += [point["tight"] for axis in report["growth"].values() for point in axis]
        return sum(outcome is not None for outcome in outcomes)

    @property
    def proven(self) -> bool:
        """Whether the tight formulation proved every row's optimum to the gap."""
        return all(row["tight"] and row["tight"]["status"] == "optimal" for row in self.report["rows"])

    def run(self, show: Callable[[str], None] = lambda text: None) -> None:
        """Run all trials, one after another, each in a process of its own.

        Args:
            show: called now and then with a line of text.
        """
        trials = list(self._trials())
        for number, (label, asked, record, key) in enumerate(trials, 1):
            head = f"{number} of {len(trials)}  {label}  "
            record[key] = trial.run(asked, lambda text, head=head: show(head + text))
            if "ratio_gurobi" in record:
                _compare(record)
        self.report["complete"] = True

    def _entry(self, row: Row) -> dict[str, Any]:
        return {
            "row": row.name,
            "terrain": row.terrain.name,
            "regions": len(row.terrain.regions),
            "end_effectors": list(END_EFFECTORS[: row.types]),
            "slots": row.slots,
            "gurobi_s": row.gurobi_s,
            "tight": None,
            "paper": None,
            "ratio_gurobi": None,
            "ratio_paper": None,
            "ratio_paper_at_least": None,
        }

    def _trials(self) -> Iterator[tuple[str, Trial, dict[str, Any], str]]:
        """Yield what to show, a trial, and where its outcome goes; the rows of the table first."""
        options, entries = self.options, self.report["rows"]
        for row, entry in zip(self.rows, entries, strict=True):
            asked = self._trial(row.terrain, row.slots, row.types, options.time_limit)
            yield f"{row.name} tight", asked, entry, "tight"
        for row, entry in zip(self.rows, entries, strict=True):
            if options.cap > 0 and row.name in self.paper_rows:
                asked = self._trial(row.terrain, row.slots, row.types, options.cap)
                yield f"{row.name} paper", replace(asked, formulation="paper", repeat=1), entry, "paper"
        if not options.growth:
            return
        problems = [("slots", n, flat(), n) for n in GROWTH_SLOTS]
        problems += [("regions", n, cut(n), REGIONS_AT_SLOTS) for n in GROWTH_REGIONS]
        for axis, count, terrain, slots in problems:
            for types in (1, 2):
                kinds = END_EFFECTORS[:types]
                point = {"count": count, "end_effectors": list(kinds), "tight": None}
                self.report["growth"][axis].append(point)
                asked = self._trial(terrain, slots, types, options.growth_limit)
                yield f"{count} {axis}, {' and '.join(kinds)}", asked, point, "tight"

    def _trial(self, terrain: Terrain, slots: int, types: int, limit: float) -> Trial:
        return Trial(
            terrain,
            goal=(GOAL_PER_SLOT * slots, 0.0),
            slots=slots,
            end_effectors=END_EFFECTORS[:types],
            gap=self.options.gap,
            time_limit=limit,
            repeat=self.options.repeat,
        )


def _compare(row: dict[str, Any]) -> None:
    """Note how many times the tight formulation's search time the others' is, if it proved the row."""
    tight, paper = row["tight"], row["paper"]
    if tight is None or tight["status"] != "optimal":
        return
    row["ratio_gurobi"] = row["gurobi_s"] / tight["search_s"]
    if paper is not None and paper["search_s"] is not None:
        row["ratio_paper"] = paper["search_s"] / tight["search_s"]
        row["ratio_paper_at_least"] = paper["status"] != "optimal"


def machine() -> dict[str, Any]:
    """Return what the times depend on: processor, system, versions, threads."""
    cpuinfo = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    models = [line.split(":", 1)[1].strip() for line in cpuinfo if line.startswith("model name")]
    return {
        "processor": models[0] if models else platform.machine(),
        "cores": os.cpu_count(),
        "usable_cores": len(os.sched_getaffinity(0)),
        "memory_mb": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2**20,
        "system": platform.platform(),
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in _PACKAGES},
        "threads": {name: os.environ.get(name) for name in _THREADS},
    }
