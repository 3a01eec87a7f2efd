"""``python -m wfbook classroom`` and ``python -m wfbook grade``."""

import argparse
import contextlib
import os
import secrets
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from wfbook.arguments import (
    FAILED,
    INTERRUPTED,
    OK,
    WRONG_INPUT,
    CommandError,
    load,
    number,
    result_folder,
    whole,
    wrong_input,
)
from wfbook.classroom import fence
from wfbook.classroom.chapters import chapters, chosen
from wfbook.report import ProgressLine
from wfbook.results import undisturbed

_EVERY = 2.0
"""Seconds between two times that the table of marks is written while there is more to come."""


def add_to(commands: Any) -> None:
    """Add both commands' parsers to the subparsers of the program's."""
    copies = commands.add_parser(
        "classroom", help="write the chapters for students, without solutions", allow_abbrev=False
    )
    copies.set_defaults(command=write_copies)
    copies.add_argument(
        "--out", metavar="DIR", required=True, help="folder for student and instructor copies"
    )
    copies.add_argument("--chapters", nargs="+", metavar="N", help="numbers or names (all)")
    copies.add_argument(
        "--run", action="store_true", help="run the instructor copies and keep what they show; takes minutes"
    )

    grade = commands.add_parser("grade", help="give marks to what students hand in", allow_abbrev=False)
    grade.set_defaults(command=grade_submissions)
    grade.add_argument(
        "submissions",
        metavar="SUBMISSIONS",
        help="folder with a sub-folder or an .ipynb file for each student",
    )
    grade.add_argument("--out", metavar="FILE", default="marks.csv", help="table of marks (marks.csv)")
    grade.add_argument(
        "--chapters", nargs="+", metavar="N", help="grade these of every student (what each one hands in)"
    )
    grade.add_argument("--jobs", type=whole(1), metavar="N", help="answers at a time (one each usable core)")
    grade.add_argument(
        "--time-limit", type=number(0.0, above=True), default=30.0, metavar="S", help="of an answer (30 s)"
    )
    grade.add_argument(
        "--memory", type=number(0.0, above=True), default=2.0, metavar="GB", help="of an answer (2 GB)"
    )
    grade.add_argument(
        "--seed", type=whole(0), help="of the inputs that answers are tried with besides the book's (random)"
    )
    grade.add_argument(
        "--no-fence",
        action="store_true",
        help="run answers with your own rights; only if you would run these notebooks yourself",
    )


def write_copies(arguments: argparse.Namespace) -> int:
    """Write copies of the chapters, all or none.

    Raises:
        CommandError: wrong input, or a chapter that fails.
    """
    with wrong_input():
        wanted = chosen(arguments.chapters)
    load("nbformat", "nbgrader.preprocessors")
    from wfbook.classroom.copies import instructor_copy, readme, student_copy, student_readme

    contents = {"README.md": readme(wanted), "student/README.md": student_readme(wanted)}
    files = [f"{kind}/{chapter.path.name}" for kind in ("student", "instructor") for chapter in wanted]
    names = (*contents, *files)
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(result_folder(arguments.out, names))
        line = stack.enter_context(ProgressLine(sys.stderr))
        for chapter in wanted:
            line.show(chapter.name)
            try:
                contents[f"student/{chapter.path.name}"] = student_copy(chapter)
                contents[f"instructor/{chapter.path.name}"] = instructor_copy(chapter, arguments.run)
            except ValueError as error:
                raise CommandError(" ".join(str(error).split()), FAILED) from None
        for name, content in contents.items():
            path = folder.path / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(content, encoding="utf-8")
        with undisturbed(), wrong_input():
            folder.publish()
    print(f"{len(wanted)} chapters for students and for instructors in {arguments.out}")
    return OK


def grade_submissions(arguments: argparse.Namespace) -> int:
    """Grade submissions; an interrupt keeps what is graded.

    Returns:
        0 whatever the marks are; 1 if a chapter itself failed.

    Raises:
        CommandError: wrong input, no fence, or interrupted.
    """
    every, folder, out = chapters(), Path(arguments.submissions), Path(arguments.out)
    lacking = fence.missing()
    if lacking and not arguments.no_fence:
        raise CommandError(
            f"this system has no {' and no '.join(lacking)} to fence answers in: use Linux on x86-64, or "
            "--no-fence for notebooks that you would run yourself",
            FAILED,
        )
    with wrong_input():
        asked = chosen(arguments.chapters)
    _try(out)
    load("nbformat", "nbgrader.preprocessors")
    from wfbook.classroom import grading, marks
    from wfbook.classroom.judge import RIGHT, Limits

    with wrong_input():
        work = grading.assignment(folder, every, asked if arguments.chapters else None)
    limits = Limits(arguments.time_limit, int(arguments.memory * 2**30), not arguments.no_fence)
    at_once = arguments.jobs or len(os.sched_getaffinity(0))
    seed = secrets.randbelow(10**6) if arguments.seed is None else arguments.seed
    found, asked_for, began, written = list(work.marks), work.waiting, time.monotonic(), 0.0
    failure = None
    with ProgressLine(sys.stderr) as line:
        try:
            with contextlib.closing(grading.graded(work, limits, at_once, seed)) as results:
                for result in results:
                    if isinstance(result, str):
                        line.show(result)
                        continue
                    found.append(result)
                    done = len(found) - len(work.marks)
                    line.show(f"{done} of {asked_for} answers of {work.students} students, {result.chapter}")
                    if time.monotonic() > written + _EVERY:
                        marks.write(out, found)
                        written = time.monotonic()
        except (KeyboardInterrupt, SystemExit) as stop:
            code = stop.code if isinstance(stop, SystemExit) else INTERRUPTED
            with undisturbed():
                marks.write(out, found)
            done = len(found) - len(work.marks)
            raise CommandError(
                f"interrupted, {done} of {asked_for} answers are graded in {str(out)!r}", code
            ) from None
        except grading.ChapterError as error:
            failure = str(error)
    with undisturbed():
        marks.write(out, found)
    right = sum(mark.verdict == RIGHT for mark in found)
    took = f"{time.monotonic() - began:.0f} s, seed {seed}"
    print(marks.summary(found))
    print(f"\n{work.students} students, {right} of {len(found)} answers right; {took}; marks in {out}")
    if failure:
        raise CommandError(failure, FAILED)
    return OK


def _try(out: Path) -> None:
    """Find out whether a file can be written, before the work."""
    try:
        if out.is_dir():
            raise CommandError(f"--out {str(out)!r} is a folder", WRONG_INPUT)
        with tempfile.TemporaryFile(dir=out.parent):
            pass
    except OSError as error:
        raise CommandError(f"--out {str(out)!r} can't be written: {error.strerror}", WRONG_INPUT) from None
