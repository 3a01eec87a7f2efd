"""How long each chapter takes under nbval, beside its budget in ``chapter_times.json``.

Every run ends with a table of the chapters that were run whole. In CI (``CI=true``) it fails when one took
more than double its budget. ``python -m pytest notebooks --write-chapter-times`` writes the budgets again,
best on a machine that does nothing else; with the path of a chapter it writes that one's alone.

Machines differ, and so does what else they do. So a fixed piece of work, a few hundredths of a second long,
is timed before each cell, while the chapter's kernel waits. Its mean over the chapter, against its mean when
the budget was written, says how slow the machine was meanwhile, and the chapter's time is divided by that. A
machine that was faster does not count as such: searches that end by the clock take as long there.
"""

import json
import os
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean

import nbformat
import numpy as np
import pytest

OPTION = "--write-chapter-times"
FILE = Path("tests") / "chapter_times.json"
FACTOR = 2.0
"""Over the budget by which CI fails."""

LEAST = 5.0
"""Budgets below it, in seconds, count as this much: starting a kernel alone may take double."""

_CALIBRATION = "calibration_s"


def calibrate() -> float:
    """Return how many seconds a fixed piece of work takes, half in Python's loops and half in NumPy's."""
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(60, 60)) / 60
    begin = time.perf_counter()
    for _ in range(300):
        matrix = np.tanh(matrix @ matrix + 0.1)
    total = 0.0
    for i in range(100_000):
        total += i % 7
    return time.perf_counter() - begin


@dataclass
class Timed:
    """A chapter as it goes by.

    Attributes:
        seconds: of setting up, running and ending its cells so far.
        calibrations: before each cell.
        passed: number of cells that passed.
        failed: whether one did not.
    """

    seconds: float = 0.0
    calibrations: list[float] = field(default_factory=list)
    passed: int = 0
    failed: bool = False


@dataclass(frozen=True)
class Line:
    """A chapter's time, and what it may take.

    Attributes:
        name: of the chapter.
        seconds: as measured.
        calibration: mean of the fixed work's times meanwhile.
        budget: seconds and calibration when the budget was written; None without one.
    """

    name: str
    seconds: float
    calibration: float
    budget: tuple[float, float] | None

    @property
    def slowness(self) -> float:
        """How many times slower the machine was than when the budget was written, at least 1."""
        return max(1.0, self.calibration / self.budget[1]) if self.budget else 1.0

    @property
    def over(self) -> bool:
        """Whether it took more than double its budget."""
        if self.budget is None:
            return False
        return self.seconds / self.slowness > FACTOR * max(LEAST, self.budget[0])

    def __str__(self) -> str:
        if self.budget is None:
            return f"{self.name:32}{self.seconds:8.1f}  no budget"
        text = f"{self.name:32}{self.seconds:8.1f}{self.slowness:9.2f}{self.budget[0]:9.1f}"
        return text + ("  MORE THAN DOUBLE" if self.over else "")


def read(path: Path) -> dict[str, tuple[float, float]]:
    """Return the budgets by chapter; none without a file."""
    if not path.is_file():
        return {}
    found = json.loads(path.read_text(encoding="utf-8"))
    return {name: (entry["seconds"], entry["calibration_s"]) for name, entry in found.items()}


def write(path: Path, lines: Iterable[Line], chapters: Iterable[str]) -> None:
    """Set the budgets of some chapters, and forget chapters that are no more."""
    there = set(chapters)
    budgets = read(path) | {line.name: (round(line.seconds, 1), round(line.calibration, 4)) for line in lines}
    kept = {
        name: {"seconds": seconds, "calibration_s": calibration}
        for name, (seconds, calibration) in sorted(budgets.items())
        if name in there
    }
    path.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


def cells_of(path: Path) -> int:
    """Return how many code cells a notebook has."""
    return sum(cell.cell_type == "code" for cell in nbformat.read(path, as_version=4).cells)


class ChapterTimes:
    """A plugin of pytest: measures in whatever process runs the cells, and reports where the terminal is."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._root = config.rootpath
        self._timed: dict[str, Timed] = {}
        self._lines: list[Line] = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Time the fixed work; the reports carry it to the process that has the terminal."""
        if item.path.suffix == ".ipynb":
            item.user_properties.append((_CALIBRATION, calibrate()))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up a chapter."""
        path = report.nodeid.partition("::")[0]
        if not path.endswith(".ipynb"):
            return
        timed = self._timed.setdefault(path, Timed())
        timed.seconds += report.duration
        timed.failed |= report.outcome != "passed"
        if report.when == "setup":
            spent = [value for name, value in report.user_properties if name == _CALIBRATION]
            timed.calibrations += spent
            timed.seconds -= sum(spent)
        elif report.when == "call":
            timed.passed += report.outcome == "passed"

    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        """Compare with the budgets, or write them."""
        if hasattr(self._config, "workerinput"):  # of pytest-xdist: the other process has all reports
            return
        budgets = read(self._root / FILE)
        whole = {
            path: timed
            for path, timed in sorted(self._timed.items())
            if not timed.failed and timed.passed == cells_of(self._root / path)
        }
        if self._config.getoption(OPTION):
            lines = self._lines_of(whole, {})
            folders = {(self._root / path).parent for path in self._timed}
            write(self._root / FILE, lines, (p.stem for folder in folders for p in folder.glob("*.ipynb")))
            budgets = read(self._root / FILE)
        self._lines = self._lines_of(whole, budgets)
        failing = os.environ.get("CI") == "true" and any(line.over for line in self._lines)
        if failing and exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the table."""
        if not self._timed:
            return
        terminalreporter.section("chapter times")
        terminalreporter.line(f"{'':32}{'seconds':>8}{'slowness':>9}{'budget':>9}")
        for line in self._lines:
            terminalreporter.line(str(line), red=line.over)
        total = sum(line.seconds for line in self._lines)
        terminalreporter.line(f"{'all':32}{total:8.1f}")
        if left := sorted(set(map(_name, self._timed)) - {line.name for line in self._lines}):
            terminalreporter.line(f"not run whole, or failed: {', '.join(left)}")
        if over := [line.name for line in self._lines if line.over]:
            terminalreporter.line(
                f"more than {FACTOR:g} times the budget, the machine's slowness taken off: "
                f"{', '.join(over)}. Make them quicker, or write new budgets with {OPTION} and say why.",
                red=True,
            )

    def _lines_of(self, whole: dict[str, Timed], budgets: dict[str, tuple[float, float]]) -> list[Line]:
        return [
            Line(_name(path), timed.seconds, mean(timed.calibrations), budgets.get(_name(path)))
            for path, timed in whole.items()
        ]


def _name(path: str) -> str:
    return Path(path).stem
