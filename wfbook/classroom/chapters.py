"""The chapters as a classroom sees them: exercises, what is around them, and which names they use."""

import json
import re
import symtable
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent.parent.parent / "notebooks"
"""Where the chapters are."""

_WORD = re.compile(r"\b[^\W\d]\w*")
_CHECK = "-check"


@dataclass(frozen=True)
class Cell:
    """A cell.

    Attributes:
        id: of the cell, unique in its notebook; empty if it has none.
        kind: ``"code"`` or ``"markdown"``.
        source: its text.
        grade_id: its name for nbgrader; empty if it has none.
        role: ``"answer"``, ``"check"`` or neither, ``""``.
        points: for an answer that passes this check.
    """

    id: str
    kind: str
    source: str
    grade_id: str = ""
    role: str = ""
    points: float = 0.0


@dataclass(frozen=True)
class Exercise:
    """An exercise.

    Attributes:
        name: as its check is named, without the ending: ``05-blamed``.
        points: for a right answer.
        answers: positions of the cells where the answer is.
        check: position of the cell that checks it.
        names: that the check takes from the answers.
    """

    name: str
    points: float
    answers: tuple[int, ...]
    check: int
    names: tuple[str, ...]


@dataclass(frozen=True)
class Chapter:
    """A chapter with its solutions.

    Attributes:
        path: of its notebook.
    """

    path: Path

    @property
    def name(self) -> str:
        """Of its file, without the ending."""
        return self.path.stem

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """All of its cells."""
        return read_cells(json.loads(self.path.read_text(encoding="utf-8")))

    @cached_property
    def exercises(self) -> tuple[Exercise, ...]:
        """Its exercises, in order."""
        found: list[Exercise] = []
        answers: list[int] = []
        given: set[str] = set()
        for position, cell in enumerate(self.cells):
            if cell.role == "answer":
                answers.append(position)
                given |= bound(cell.source)
            elif cell.role == "check":
                names = tuple(sorted(given & words(cell.source)))
                name = cell.grade_id.removesuffix(_CHECK)
                found.append(Exercise(name, cell.points, tuple(answers), position, names))
                answers = []
        return tuple(found)

    @cached_property
    def setup(self) -> tuple[int, ...]:
        """Positions of the code cells that belong to no exercise."""
        cells = enumerate(self.cells)
        return tuple(position for position, cell in cells if cell.kind == "code" and not cell.role)


def chapters(folder: Path = FOLDER) -> tuple[Chapter, ...]:
    """Return all chapters in reading order."""
    return tuple(Chapter(path) for path in sorted(folder.glob("*.ipynb")))


def chosen(asked: Sequence[str] | None, folder: Path = FOLDER) -> tuple[Chapter, ...]:
    """Return the chapters that are asked for, by number or by name, in reading order; by default all.

    Raises:
        ValueError: there is no such chapter, or there are none at all.
    """
    every = chapters(folder)
    if not every:
        raise ValueError(f"no chapters at {str(folder)!r}: install with pip install -e .")
    if not asked:
        return every
    wanted = set()
    for text in asked:
        fitting = [c for c in every if c.name == text.removesuffix(".ipynb") or _same(c.name[:2], text)]
        if not fitting:
            raise ValueError(
                f"--chapters: {text!r} is no chapter; there are {every[0].name[:2]} to {every[-1].name[:2]}"
            )
        wanted |= set(fitting)
    return tuple(chapter for chapter in every if chapter in wanted)


def read_cells(notebook: dict[str, Any]) -> tuple[Cell, ...]:
    """Return a notebook's cells.

    Raises:
        ValueError: it is none.
    """
    cells = notebook.get("cells") if isinstance(notebook, dict) else None
    if not isinstance(cells, list) or not all(isinstance(cell, dict) for cell in cells):
        raise ValueError("it is no notebook: it has no list of cells")
    return tuple(map(_cell, cells))


def bound(source: str) -> set[str]:
    """Return the names that code binds outside of its functions; none if it can't be read."""
    try:
        symbols = symtable.symtable(source, "cell", "exec").get_symbols()
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return set()
    return {s.get_name() for s in symbols if s.is_assigned() or s.is_imported()}


def words(source: str | Iterable[str]) -> set[str]:
    """Return everything that may be a name in code, also inside of texts."""
    if not isinstance(source, str):
        source = "\n".join(source)
    return set(_WORD.findall(source))


def _same(number: str, text: str) -> bool:
    return text.isascii() and text.isdigit() and int(number) == int(text)


def _cell(data: dict[str, Any]) -> Cell:
    """Read one cell as far as it is well-formed; students' notebooks have been through many editors."""
    source = data.get("source", "")
    if isinstance(source, list):
        source = "".join(line for line in source if isinstance(line, str))
    if not isinstance(source, str):
        source = ""
    metadata = data.get("metadata")
    role = metadata.get("nbgrader") if isinstance(metadata, dict) else None
    role = role if isinstance(role, dict) else {}
    points = role.get("points", 0.0)
    return Cell(
        id=data["id"] if isinstance(data.get("id"), str) else "",
        kind="code" if data.get("cell_type") == "code" else "markdown",
        source=source,
        grade_id=role["grade_id"] if isinstance(role.get("grade_id"), str) else "",
        role="answer" if role.get("solution") is True else "check" if role.get("grade") is True else "",
        points=float(points) if isinstance(points, int | float) else 0.0,
    )
