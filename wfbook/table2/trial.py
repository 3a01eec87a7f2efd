"""One planning problem, solved and measured in a process of its own.

    python -m wfbook.table2.trial < trial.json

Nothing that ran before can warm it up or be counted as its memory, and if it crashes, the other trials of a
benchmark don't. It reads a trial as JSON and writes lines of JSON: ``{"progress": text}`` now and then, at
last ``{"outcome": {…}}``.
"""

import contextlib
import json
import os
import resource
import select
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, BinaryIO

from wfbook.report import plain, search_line
from wfbook.terrain import Terrain

ENOUGH_S = 10.0
"""A search is not repeated once all runs together took this long: noise no longer matters."""

OUTCOME = (
    *("status", "message", "time_limit_s", "search_s", "searches_s", "build_s", "nodes", "relaxations"),
    *("leaves", "objective", "bound", "root_bound", "gap", "peak_memory_mb"),
)
"""What an outcome tells; what is unknown is None.

``status`` is that of :func:`wfbook.planner.solve` if there is a plan; else "no plan" (it gave up before the
first), "infeasible", "refused" (the planner doesn't take such a problem), or "failed" (a crash), and
``message`` explains.
``build_s`` is modelling and compiling. ``search_s`` is the median of ``searches_s``, or the time limit if
there is no plan. ``peak_memory_mb`` adds the peaks of the process and of the largest that it forked, so pages
that they share count twice.
"""


@dataclass(frozen=True)
class Trial:
    """A planning problem and how to search it.

    Attributes:
        terrain: where.
        goal: ``(x, y)`` of the centre of mass.
        slots: number of slots.
        end_effectors: what a leg may carry.
        formulation: "tight" or "paper".
        gap: relative gap at which the search ends.
        time_limit: of each search, in seconds.
        repeat: how often to search, as long as the runs are short (see ``ENOUGH_S``).
    """

    terrain: Terrain
    goal: tuple[float, float]
    slots: int
    end_effectors: tuple[str, ...]
    formulation: str = "tight"
    gap: float = 1e-3
    time_limit: float = 300.0
    repeat: int = 1

    def to_json(self) -> str:
        """Return the trial as :meth:`from_json` reads it."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return json.dumps(fields | {"terrain": self.terrain.to_dict()})

    @classmethod
    def from_json(cls, text: str) -> "Trial":
        """Read a trial."""
        fields = json.loads(text)
        return cls(**fields | {"terrain": Terrain.from_dict(fields["terrain"])})


def run(trial: Trial, show: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Solve a trial in a fresh process.

    Args:
        trial: what to solve.
        show: called about twice a second with how far it is.

    Returns:
        The entries of ``OUTCOME``, as plain JSON types.

    Raises:
        KeyboardInterrupt: like any other exception that ``show`` or a signal raises, after the process and
            those that it forked were ended.
    """
    command = [sys.executable, "-m", "wfbook.table2.trial"]
    pipe = subprocess.PIPE
    with (
        tempfile.TemporaryFile() as log,
        # A process group of its own: Ctrl-C at the terminal is for the caller alone.
        subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=log, process_group=0) as process,
    ):
        try:
            with contextlib.suppress(BrokenPipeError), process.stdin:
                process.stdin.write(trial.to_json().encode())
            outcome = _answer(process.stdout, show)
            if outcome is None:
                code = process.wait()
        finally:
            if process.poll() is None:  # interrupted, or about to end after its answer
                os.killpg(process.pid, signal.SIGKILL)
        if outcome is not None:
            return outcome
        log.seek(0)
        said = log.read().decode(errors="replace").strip()
    ended = f"ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
    return dict.fromkeys(OUTCOME) | {
        "status": "failed",
        "message": said or ended,
        "time_limit_s": trial.time_limit,
    }


def _answer(stream: BinaryIO, show: Callable[[str], None]) -> dict[str, Any] | None:
    """Return the outcome that a process writes, or None if it ends without."""
    begin, text, rest = time.monotonic(), "", b""
    while True:
        show(text or f"{time.monotonic() - begin:.0f} s")
        if not select.select([stream], [], [], 0.5)[0]:
            continue
        chunk = os.read(stream.fileno(), 1 << 16)
        if not chunk:
            return None
        *lines, rest = (rest + chunk).split(b"\n")
        for line in lines:
            said = json.loads(line)
            if "outcome" in said:
                return said["outcome"]
            text = said["progress"]


def measure(trial: Trial, show: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Solve a trial here and now.

    Args:
        trial: what to solve.
        show: called now and then with how far the search is.

    Returns:
        The entries of ``OUTCOME``, as plain JSON types.
    """
    from wfbook.planner import InfeasibleError, NoPlanError, Problem, solve

    outcome = dict.fromkeys(OUTCOME) | {"time_limit_s": trial.time_limit}
    metas: list[dict[str, Any]] = []
    begin = time.perf_counter()
    try:
        problem = Problem(
            trial.terrain, goal=trial.goal, slots=trial.slots, end_effectors=trial.end_effectors
        )
        while not metas or (
            len(metas) < trial.repeat
            and metas[-1]["status"] == "optimal"
            and time.perf_counter() - begin < ENOUGH_S
        ):
            plan = solve(
                problem,
                formulation=trial.formulation,
                gap=trial.gap,
                time_limit=trial.time_limit,
                progress=lambda now: show(search_line(now)),
            )
            metas.append(plan.meta)
            outcome["peak_memory_mb"] = outcome["peak_memory_mb"] or peak_memory_mb()
    except InfeasibleError as error:
        outcome |= {"status": "infeasible", "message": str(error)}
    except NoPlanError as error:
        outcome |= {"status": "no plan", "message": str(error), "search_s": trial.time_limit}
    except ValueError as error:
        outcome |= {"status": "refused", "message": str(error)}
    else:
        searches = [meta["solve_time"] for meta in metas]
        outcome |= {name: metas[-1][name] for name in OUTCOME if name in metas[-1]}
        outcome |= {
            "searches_s": searches,
            "search_s": statistics.median(searches),
            "build_s": statistics.median(meta["build_time"] for meta in metas),
        }
    outcome["peak_memory_mb"] = outcome["peak_memory_mb"] or peak_memory_mb()
    return plain(outcome)


def peak_memory_mb() -> float:
    """Return the peak resident memory of this process and of the largest that it forked and waited for.

    This process' own peak is the kernel's high-water mark: ``ru_maxrss`` survives ``exec`` and would still
    be that of whoever started it.
    """
    with open("/proc/self/status", encoding="ascii") as status:
        own = next(int(line.split()[1]) for line in status if line.startswith("VmHWM:"))
    return (own + resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) / 1024.0


def _serve() -> None:
    """Read a trial from standard input, solve it and answer."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print must not get between the answers

    def say(message: dict[str, Any]) -> None:
        print(json.dumps(message), file=answers, flush=True)

    trial = Trial.from_json(sys.stdin.read())
    say({"outcome": measure(trial, lambda text: say({"progress": text}))})


if __name__ == "__main__":
    _serve()
