"""A table of marks: one line for each student and exercise."""

import csv
import io
import os
import re
import tempfile
from collections import Counter
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from wfbook.report import aligned

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]+")
_LONGEST = 300


@dataclass(frozen=True, order=True)
class Mark:
    """Of one answer.

    Attributes:
        student: as the folder or file is named.
        chapter: of the exercise; empty if nobody can tell.
        exercise: its name; empty if there is none.
        marks: what the answer gets.
        max_marks: what it could.
        verdict: in a word or three.
        message: why, in one line.
    """

    student: str
    chapter: str
    exercise: str
    marks: float
    max_marks: float
    verdict: str
    message: str


def text(marks: Iterable[Mark]) -> str:
    """Return marks as CSV, in order of student, chapter and exercise."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(field.name for field in fields(Mark))
    for mark in sorted(marks):
        writer.writerow(_plain(value) for value in astuple(mark))
    return stream.getvalue()


def write(path: Path, marks: Iterable[Mark]) -> None:
    """Write the table, whole or not at all.

    Raises:
        OSError: it can't be written.
    """
    descriptor, scratch = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8", newline="") as file:
            file.write(text(marks))
        os.chmod(scratch, 0o644)
        os.replace(scratch, path)
    except BaseException:
        os.unlink(scratch)
        raise


def summary(marks: Iterable[Mark]) -> str:
    """Return a table of how many answers got which verdict, chapter by chapter."""
    marks = list(marks)
    verdicts = [verdict for verdict, _ in Counter(mark.verdict for mark in marks).most_common()]
    rows = [["chapter", *verdicts, "marks"]]
    for chapter in sorted({mark.chapter for mark in marks}):
        here = [mark for mark in marks if mark.chapter == chapter]
        count = Counter(mark.verdict for mark in here)
        total = f"{sum(m.marks for m in here):g} of {sum(m.max_marks for m in here):g}"
        rows.append([chapter or "unknown", *(str(count[verdict]) for verdict in verdicts), total])
    return aligned(rows)


def _plain(value: str | float) -> str:
    """Return a value as one line that no spreadsheet takes for a formula."""
    if not isinstance(value, str):
        return f"{value:g}"
    line = _CONTROL.sub(" ", value).strip()
    line = line if len(line) <= _LONGEST else line[: _LONGEST - 1] + "…"
    return f"'{line}" if line.startswith(("=", "+", "-", "@")) else line
