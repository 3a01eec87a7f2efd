"""The process of one chapter: it runs what stands before an exercise once, then forks for every answer.

Started as ``python -m wfbook.classroom.bench PLAN``. It reads no answer itself and holds no solution, so that
no answer finds another one in the memory that it inherits.
"""

import contextlib
import gc
import json
import os
import select
import shutil
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TextIO

from wfbook.classroom import fence
from wfbook.classroom.judge import CRASH, TIME, Limits, judge, run_imports

CHECK_SECONDS = 300.0
"""What a check may take beyond what the answer may; no answer can make it longer."""

FOLDER_BYTES, FOLDER_FILES = 256 * 2**20, 500
"""What an answer may write, at most."""


@dataclass(frozen=True)
class Running:
    """An answer that is being judged.

    Attributes:
        job: its number.
        pid: of its judge, whose process group holds the answer's process.
        folder: where the answer works.
        until: when it is over, by the monotonic clock.
    """

    job: int
    pid: int
    folder: Path
    until: float


class Judges:
    """Those at work, and where their verdicts go."""

    def __init__(self, plan: dict[str, Any], results: TextIO) -> None:
        self._plan = plan
        self._limits = Limits(**plan["limits"])
        self._results = results
        self._running: dict[int, Running] = {}

    def grade(self, exercise: dict[str, Any], namespace: dict[str, Any]) -> None:
        """Judge all answers to an exercise, several at once."""
        waiting = list(exercise["jobs"])
        gc.freeze()
        while waiting or self._running:
            while waiting and len(self._running) < self._plan["at_once"]:
                self._start(waiting.pop(0), exercise, namespace)
            ready, _, _ = select.select(list(self._running), [], [], 0.2)
            for pipe in ready:
                self._finish(pipe)
            for pipe, one in list(self._running.items()):
                if time.monotonic() > one.until:
                    self._finish(pipe, (TIME, "it is not over in time"))
                elif _size(one.folder) > FOLDER_BYTES:
                    self._finish(pipe, (CRASH, f"it writes more than {FOLDER_BYTES >> 20} MB"))

    def tell(self, message: dict[str, Any]) -> None:
        """Write one line to whoever started this."""
        print(json.dumps(message), file=self._results, flush=True)

    def stop(self) -> None:
        """End all that are at work."""
        for one in self._running.values():
            self._end(one)
        self._running.clear()

    def _start(self, job: int, exercise: dict[str, Any], namespace: dict[str, Any]) -> None:
        home = Path(self._plan["folder"])
        folder = home / f"work-{job}"
        folder.mkdir()
        read, write = os.pipe()
        pid = os.fork()
        if pid == 0:
            self._judge(write, home / f"job-{job}.json", exercise, namespace, folder)
        os.close(write)
        until = time.monotonic() + self._limits.seconds + CHECK_SECONDS
        self._running[read] = Running(job, pid, folder, until)

    def _judge(
        self, write: int, file: Path, exercise: dict[str, Any], namespace: dict[str, Any], folder: Path
    ) -> NoReturn:
        """Be a judge."""
        try:
            os.setsid()
            fence.die_with_parent()
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            cells = json.loads(file.read_text())
            verdict = judge(
                cells,
                exercise["check"],
                exercise["names"],
                namespace,
                folder,
                self._limits,
                file.parent / "salt",
            )
            os.write(write, json.dumps([part[:1000] for part in verdict]).encode())
        finally:
            os._exit(0)

    def _finish(self, pipe: int, verdict: tuple[str, str] | None = None) -> None:
        one = self._running.pop(pipe)
        said = None if verdict else os.read(pipe, 2**16)
        self._end(one)
        os.close(pipe)
        if said is not None:
            verdict = json.loads(said) if said else (CRASH, "its check ended without a verdict")
        self.tell({"job": one.job, "verdict": verdict[0], "message": verdict[1]})

    def _end(self, one: Running) -> None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(one.pid, signal.SIGKILL)
        with contextlib.suppress(ProcessLookupError):  # it may not be the leader of its group yet
            os.kill(one.pid, signal.SIGKILL)
        os.waitpid(one.pid, 0)
        shutil.rmtree(one.folder, ignore_errors=True)


def main(file: str) -> int:
    """Run a chapter and judge what was answered.

    Args:
        file: JSON with ``steps`` (sources of cells and exercises, in the chapter's order), ``folder``,
            ``limits`` and ``at_once``; the folder has a file ``salt`` and one for each job.

    Returns:
        0, or 1 if a cell of the chapter fails.
    """
    plan = json.loads(Path(file).read_text())
    results = os.fdopen(os.dup(1), "w")
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nothing, stream)
    judges = Judges(plan, results)
    namespace: dict[str, Any] = {"__name__": "__main__", "display": lambda *_: None}
    try:
        for step in plan["steps"]:
            if "exercise" in step:
                run_imports(step["exercise"]["check"], namespace)
                judges.grade(step["exercise"], namespace)
            else:
                exec(compile(step["source"], f"<cell {step['position']}>", "exec"), namespace)
                judges.tell({"cell": step["position"]})
    except Exception as error:
        where = f"cell {step['position']}" if "position" in step else step["exercise"]["name"]
        judges.tell({"failed": f"{where} raises {type(error).__name__}: {error}"})
        return 1
    finally:
        judges.stop()
    return 0


def _size(folder: Path) -> int:
    """Return how many bytes are in a folder; too many files count as too many bytes."""
    total = 0
    with contextlib.suppress(OSError):
        for number, entry in enumerate(folder.rglob("*")):
            total += entry.lstat().st_blocks * 512
            if number > FOLDER_FILES:
                return FOLDER_BYTES + 1
    return total


if __name__ == "__main__":
    fence.die_with_parent()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    sys.exit(main(sys.argv[1]))
