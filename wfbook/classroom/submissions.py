"""What students hand in: found, read with no trust at all, and matched with the chapter's cells."""

import json
import os
import re
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from wfbook.classroom.chapters import Cell, Chapter, Exercise, bound, read_cells, words

LARGEST = 50 * 2**20
"""Bytes of a notebook that is still read; outputs make it large, answers never do."""


class UnreadableError(ValueError):
    """A file is no notebook, or not one of the chapter."""


@dataclass(frozen=True)
class Submission:
    """A file that a student hands in.

    Attributes:
        student: name of the folder, or of the file.
        path: of the file.
        chapter: that the file's name tells, if it tells one.
    """

    student: str
    path: Path
    chapter: Chapter | None


@dataclass(frozen=True)
class Answer:
    """An answer to one exercise.

    Attributes:
        exercise: that it answers.
        cells: sources to run, and whether each is of the answer itself; empty if its cells are missing.
        untouched: whether it is as the student got it.
    """

    exercise: Exercise
    cells: tuple[tuple[str, bool], ...]
    untouched: bool


def find(folder: Path, chapters: Sequence[Chapter]) -> list[Submission]:
    """Return all notebooks in a folder: those of a sub-folder are one student's, as is a file beside it.

    Raises:
        OSError: the folder can't be read.
    """
    found = []
    for entry in sorted(folder.iterdir()):
        if entry.name.startswith("."):
            continue
        if entry.is_dir() and not entry.is_symlink():
            found += [Submission(entry.name, path, _named(path, chapters)) for path in _notebooks(entry)]
        elif entry.suffix == ".ipynb":
            chapter = _named(entry, chapters)
            found.append(Submission(_student(entry.stem, chapter), entry, chapter))
    return found


def read(path: Path) -> tuple[Cell, ...]:
    """Return the cells of a file.

    Raises:
        UnreadableError: it is none, or too large, or can't be read.
    """
    try:
        # Without waiting: what is named like a notebook may be a pipe.
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW), "rb") as file:
            state = os.fstat(file.fileno())
            if not stat.S_ISREG(state.st_mode):
                raise UnreadableError("it is no file")
            if state.st_size > LARGEST:
                raise UnreadableError(f"it has {state.st_size >> 20} MB; clear its outputs")
            return read_cells(json.loads(file.read(LARGEST)))
    except OSError as error:
        raise UnreadableError(f"it can't be read: {error.strerror}") from None
    except RecursionError:
        raise UnreadableError("it is no notebook: nested too deeply") from None
    except UnreadableError:
        raise
    except json.JSONDecodeError as error:
        raise UnreadableError(f"it is no notebook, or cut off: {error.msg} in line {error.lineno}") from None
    except ValueError as error:
        raise UnreadableError(str(error)) from None


def chapter_of(cells: Sequence[Cell], chapters: Sequence[Chapter]) -> Chapter | None:
    """Return the chapter whose answer cells are most of those in a notebook; None if there are none."""
    count = {chapter: sum(cell is not None for cell in _matched(cells, chapter)) for chapter in chapters}
    best = max(count, key=count.__getitem__)
    return best if count[best] else None


def answers(cells: Sequence[Cell], chapter: Chapter, student_copy: Sequence[str]) -> list[Answer]:
    """Return the answers in a notebook, each with what else of the student's it needs.

    Args:
        cells: of the notebook.
        chapter: that it answers.
        student_copy: sources of the chapter's cells as students get them.

    A helper that the student wrote in a cell of their own, or in an earlier answer, runs before the answer
    that mentions it. What the chapter itself defines is not taken from the student.
    """
    matched = _matched(cells, chapter)
    given = {position: student_copy[position] for position in range(len(student_copy))}
    from_chapter = set().union(*(bound(given[position]) for position in chapter.setup), set())
    known = set(given.values())
    own = [
        (index, cell.source, bound(cell.source) - from_chapter)
        for index, cell in enumerate(cells)
        if cell.kind == "code" and cell.role != "check" and cell.source not in known
    ]
    found = []
    for exercise in chapter.exercises:
        places = [matched[position] for position in exercise.answers]
        if any(place is None for place in places):
            found.append(Answer(exercise, (), False))
            continue
        sources = [cells[place].source for place in places]
        helpers = _helpers(sources, [each for each in own if each[0] < min(places)])
        untouched = [s.strip() for s in sources] == [given[p].strip() for p in exercise.answers]
        run = [(source, False) for source in helpers] + [(source, True) for source in sources]
        found.append(Answer(exercise, tuple(run), untouched))
    return found


def _helpers(sources: Sequence[str], own: Sequence[tuple[int, str, set[str]]]) -> list[str]:
    """Return which of the student's cells bind a name that is mentioned, and what those mention in turn."""
    mentioned, taken = words(sources), set()
    while True:
        new = [(i, source) for i, source, names in own if i not in taken and names & mentioned]
        if not new:
            return [source for i, source, _ in own if i in taken]
        taken |= {i for i, _ in new}
        mentioned |= words(source for _, source in new)


def _matched(cells: Sequence[Cell], chapter: Chapter) -> list[int | None]:
    """Return for each cell of the chapter where in a notebook it is; of answers only."""
    by_id = {cell.id: i for i, cell in reversed(list(enumerate(cells))) if cell.id and cell.kind == "code"}
    by_name = {
        cell.grade_id: i
        for i, cell in reversed(list(enumerate(cells)))
        if cell.role == "answer" and cell.kind == "code"
    }
    # Chapters number their cells alike. Where an editor took the names away, the checks say which one it is.
    sources = {cell.source.strip() for cell in cells}
    checks = [chapter.cells[exercise.check].source.strip() in sources for exercise in chapter.exercises]
    nameless = ("",) if 2 * sum(checks) > len(checks) else ()
    places: list[int | None] = []
    for cell in chapter.cells:
        place = by_id.get(cell.id) if cell.role == "answer" else None
        if place is not None and cells[place].grade_id not in (cell.grade_id, *nameless):
            place = None
        places.append(by_name.get(cell.grade_id) if place is None and cell.role == "answer" else place)
    return places


def _notebooks(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*.ipynb")):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if not hidden and not path.is_dir():
            yield path


def _named(path: Path, chapters: Sequence[Chapter]) -> Chapter | None:
    for chapter in chapters:
        if chapter.name in path.stem or re.match(rf"{chapter.name[:2]}(?!\d)", path.stem):
            return chapter
    return None


def _student(stem: str, chapter: Chapter | None) -> str:
    name = stem.replace(chapter.name, "") if chapter else stem
    return name.strip(" _-.") or stem
