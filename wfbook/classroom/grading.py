"""Marks for a folder of submissions: read all, then run chapter after chapter in processes of their own."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import wfbook
from wfbook.classroom.chapters import Cell, Chapter, Exercise
from wfbook.classroom.copies import student_sources
from wfbook.classroom.judge import EMPTY, RIGHT, Limits
from wfbook.classroom.marks import Mark
from wfbook.classroom.submissions import (
    Answer,
    Submission,
    UnreadableError,
    answers,
    chapter_of,
    find,
    read,
)

MISSING, UNREADABLE, ELSEWHERE, UNGRADED = "missing", "unreadable", "wrong chapter", "not graded"
"""Verdicts about what is no answer at all, and about answers to a chapter that fails itself."""


class ChapterError(Exception):
    """A chapter can't be graded, because a cell of its own fails."""


@dataclass
class Assignment:
    """What is to be graded.

    Attributes:
        chapters: that count.
        marks: that are known without running anything.
        answers: to run, by chapter: of which student, and a remark about the file.
        students: how many.
    """

    chapters: tuple[Chapter, ...]
    marks: list[Mark] = field(default_factory=list)
    answers: dict[Chapter, list[tuple[str, Answer, str]]] = field(default_factory=dict)
    students: int = 0

    @property
    def waiting(self) -> int:
        """How many answers are to be run."""
        return sum(map(len, self.answers.values()))


@dataclass(frozen=True)
class Looked:
    """A file that was read.

    Attributes:
        path: of the file.
        chapter: that its name tells, or else its cells; None if neither does.
        cells: its cells.
        verdict: about a file without answers; else empty.
        message: why.
    """

    path: Path
    chapter: Chapter | None
    cells: tuple[Cell, ...] = ()
    verdict: str = ""
    message: str = ""


def assignment(folder: Path, every: Sequence[Chapter], asked: Sequence[Chapter] | None) -> Assignment:
    """Read all submissions into memory, so that nothing that runs later can change one.

    Args:
        folder: with one sub-folder or file a student.
        every: chapter that there is.
        asked: those to grade, each of every student; by default what each student hands in.

    Raises:
        OSError: the folder can't be read.
        ValueError: nothing in it is a submission.
    """
    submissions = find(folder, every)
    if not submissions:
        raise ValueError(f"{str(folder)!r} holds no notebooks: one sub-folder or .ipynb file a student")
    work = Assignment(tuple(asked or every), students=len({s.student for s in submissions}))
    sources = {chapter: student_sources(chapter) for chapter in work.chapters}
    handed_in: dict[tuple[str, Chapter], list[Looked]] = {}
    for submission in submissions:
        seen = _looked_at(submission, every)
        if seen.chapter is None:
            work.marks.append(Mark(submission.student, "", "", 0.0, 0.0, seen.verdict, seen.message))
        elif seen.chapter in work.chapters:
            handed_in.setdefault((submission.student, seen.chapter), []).append(seen)
    for (student, chapter), files in handed_in.items():
        seen = max(files, key=lambda file: file.path.lstat().st_mtime)
        remark = f"; {len(files)} files, {seen.path.name} is the newest" if len(files) > 1 else ""
        if seen.verdict:
            text = f"{seen.message}{remark}"
            work.marks += [_mark(student, chapter, e, seen.verdict, text) for e in chapter.exercises]
            continue
        for answer in answers(seen.cells, chapter, sources[chapter]):
            if not answer.cells:
                text = f"its cell is not in the notebook{remark}"
                work.marks.append(_mark(student, chapter, answer.exercise, MISSING, text))
            elif answer.untouched:
                text = f"the cell is as it was handed out{remark}"
                work.marks.append(_mark(student, chapter, answer.exercise, EMPTY, text))
            else:
                work.answers.setdefault(chapter, []).append((student, answer, remark))
    if asked:
        for student in sorted({s.student for s in submissions}):
            for chapter in asked:
                if (student, chapter) not in handed_in:
                    text = "the chapter is not handed in"
                    work.marks += [_mark(student, chapter, e, MISSING, text) for e in chapter.exercises]
    return work


def _looked_at(submission: Submission, every: Sequence[Chapter]) -> Looked:
    path, named = submission.path, submission.chapter
    try:
        cells = read(path)
    except UnreadableError as error:
        return Looked(path, named, verdict=UNREADABLE, message=f"{path.name}: {error}")
    inside = chapter_of(cells, every)
    if inside is None and named is None:
        return Looked(path, None, verdict=ELSEWHERE, message=f"{path.name}: no chapter's answers are in it")
    if inside is None or named in (None, inside):
        return Looked(path, named or inside, cells)
    return Looked(path, named, verdict=ELSEWHERE, message=f"{path.name}: it holds answers of {inside.name}")


def graded(work: Assignment, limits: Limits, at_once: int, salt: int) -> Iterator[Mark | str]:
    """Run what is to be run.

    Args:
        work: of :func:`assignment`.
        limits: of each answer.
        at_once: how many answers run at a time.
        salt: of the inputs that checks draw besides those in the chapter.

    Yields:
        Marks as they come, and lines that say what is going on.

    Raises:
        ChapterError: chapters failed before their answers did; the others' answers have their marks by then.
    """
    failures = []
    for chapter in work.chapters:
        waiting = dict(enumerate(work.answers.get(chapter, ())))
        if not waiting:
            continue
        with tempfile.TemporaryDirectory(prefix="wfbook-grade-") as folder:
            (Path(folder) / "salt").write_text(str(salt))
            try:
                yield from _chapter(chapter, waiting, limits, at_once, Path(folder))
            except ChapterError as error:
                failures.append(str(error))
                for student, answer, _ in waiting.values():
                    yield _mark(student, chapter, answer.exercise, UNGRADED, str(error))
    if failures:
        raise ChapterError("; ".join(failures))


def _chapter(
    chapter: Chapter, waiting: dict[int, tuple[str, Answer, str]], limits: Limits, at_once: int, folder: Path
) -> Iterator[Mark | str]:
    """Run one chapter's answers; what has its mark is waiting no longer."""
    jobs: dict[str, list[int]] = {}
    for number, (_, answer, _) in waiting.items():
        (folder / f"job-{number}.json").write_text(json.dumps(answer.cells))
        jobs.setdefault(answer.exercise.name, []).append(number)
    steps = _steps(chapter, jobs)
    cells = sum("position" in step for step in steps)
    plan = {"steps": steps, "folder": str(folder), "limits": asdict(limits), "at_once": at_once}
    (folder / "plan.json").write_text(json.dumps(plan))
    done = 0
    with _bench(folder) as process:
        for message in _messages(process):
            if "failed" in message:
                raise ChapterError(f"{chapter.name}: {message['failed']}")
            if "cell" in message:
                done += 1
                yield f"{chapter.name}: {done} of {cells} cells of the chapter itself"
                continue
            student, answer, remark = waiting.pop(message["job"])
            text = message["message"] + remark
            yield _mark(student, chapter, answer.exercise, message["verdict"], text)


def _steps(chapter: Chapter, jobs: dict[str, list[int]]) -> list[dict[str, Any]]:
    """Return what runs in order: the chapter's own cells, and the exercises that someone answered."""
    steps: list[tuple[int, dict[str, Any]]] = [
        (position, {"position": position, "source": chapter.cells[position].source})
        for position in chapter.setup
    ]
    last = 0
    for exercise in chapter.exercises:
        check = chapter.cells[exercise.check].source
        numbers = jobs.get(exercise.name, [])
        last = exercise.check if numbers else last
        step = {"name": exercise.name, "check": check, "names": exercise.names, "jobs": numbers}
        steps.append((exercise.check, {"exercise": step}))
    return [step for position, step in sorted(steps, key=lambda step: step[0]) if position <= last]


@contextlib.contextmanager
def _bench(folder: Path) -> Iterator[subprocess.Popen[str]]:
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL")}
    root = str(Path(wfbook.__file__).parent.parent)
    environment = os.environ | threads | {"PYTHONPATH": root, "MPLBACKEND": "agg"}
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "wfbook.classroom.bench", str(folder / "plan.json")],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        env=environment,
        start_new_session=True,  # an interrupt is for the grader, which then ends the others
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.communicate(timeout=10.0)
        except subprocess.TimeoutExpired:
            process.kill()  # its judges die with it
            process.communicate()


def _messages(process: subprocess.Popen[str]) -> Iterator[dict[str, Any]]:
    for line in process.stdout:
        yield json.loads(line)
    if process.wait() not in (0, 1):  # 1 comes with a message
        lines = process.stderr.read().splitlines()
        yield {"failed": lines[-1] if lines else f"its process ended with code {process.returncode}"}


def _mark(student: str, chapter: Chapter, exercise: Exercise, verdict: str, message: str) -> Mark:
    marks = exercise.points if verdict == RIGHT else 0.0
    return Mark(student, chapter.name, exercise.name, marks, exercise.points, verdict, message)
