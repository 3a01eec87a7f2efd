"""The map as a table for the terminal, as a page of the book, and as JSON."""

import re
import textwrap
from collections.abc import Iterable
from typing import Any

from wfbook.equations.atlas import Atlas, Entry
from wfbook.equations.chapters import Chapter
from wfbook.equations.docstrings import Documented
from wfbook.equations.exercised import Witness
from wfbook.equations.titles import NAMES, SECTIONS

FUNCTIONS, TESTS = 6, 4
"""How many the page names; of the others it says how many there are."""

_ROLE = re.compile(r":\w+:`[~.!]*([^`<]*?)`")
_HEAD = ("", "what it says", "function", "chapter", "tests")
_WIDTHS = (6, 48, 40, 7, 5)

_INTRODUCTION = """\
Every numbered equation of both papers: what it says, the functions that are it, the chapters that write it
down, and tests that exercise it. Where this book does not use an equation as it is printed, it says why.

Nobody keeps this list. The functions are those whose docstring names the equation (`Paper A, eq. 12`), the
chapters those that label it, the tests those that refer to such a function, or that name the equation and
come to one; the most telling stand first. A test fails where an equation has no function, no chapter or no
test, where a docstring, a chapter or a test names an equation that does not exist, and where docstrings and
chapters do not agree on what can't be taken as printed. `python -m wfbook equations` draws the same map from
a checkout."""


def table(atlas: Atlas) -> str:
    """Return the map as a table of one line or two for each equation."""
    lines = [_line(_HEAD), ""]
    for entry in atlas.entries:
        more = f" +{len(entry.functions) - 1}" if len(entry.functions) > 1 else ""
        function = f"{short(entry.functions[0])}{more}" if entry.functions else "–"
        name = f"{entry.equation}{'*' if entry.reasons else ''}"
        cells = (name, entry.title, function, _numbers(entry), str(len(entry.tests)))
        columns = [textwrap.wrap(cell, width) or [""] for cell, width in zip(cells, _WIDTHS, strict=True)]
        for row in range(max(map(len, columns))):
            lines.append(_line(column[row] if row < len(column) else "" for column in columns))
    used = sum(bool(entry.reasons) for entry in atlas.entries)
    lines += ["", f"* not used as printed ({used} of {len(atlas.entries)}); --markdown says why"]
    return "\n".join([*lines, *(f"WRONG: {line}" for line in atlas.wrong)])


def page(atlas: Atlas, notebooks: str = "notebooks") -> str:
    """Return the map as a page of the book, in MyST Markdown.

    Every equation has a label, ``eq-a-12``, and functions are roles of the Python domain.

    Args:
        atlas: the map.
        notebooks: where the chapters are, from the page.
    """
    parts = ["# The equations of both papers", _INTRODUCTION]
    for paper, sections in SECTIONS.items():
        parts.append(f"(equations-{paper.lower()})=\n## Paper {paper}\n\n{NAMES[paper]}.")
        rest = iter(atlas.of(paper))
        for section in sections:
            parts.append(f"### {section.name}")
            parts += [_block(next(rest), notebooks) for _ in section.titles]
    return "\n\n".join(parts) + "\n"


def records(atlas: Atlas) -> list[dict[str, Any]]:
    """Return the map in JSON's types."""
    return [
        {
            "equation": str(entry.equation),
            "title": entry.title,
            "functions": [document.name for document in entry.functions],
            "shown_by": [document.name for document in entry.shown],
            "not_as_printed": [plain(reason) for reason in entry.reasons],
            "chapters": [chapter.file for chapter in entry.chapters],
            "coming_in_chapter": entry.coming,
            "tests": [witness.id for witness in entry.tests],
        }
        for entry in atlas.entries
    ]


def short(document: Documented) -> str:
    """Return a function's name without the package's."""
    return document.name.partition(".")[2]


def plain(text: str) -> str:
    """Return a docstring's text with what it marks up as code in single backticks."""
    return _ROLE.sub(r"`\1`", text).replace("``", "`")


def _line(cells: Iterable[str]) -> str:
    return "  ".join(f"{cell:<{width}}" for cell, width in zip(cells, _WIDTHS, strict=True)).rstrip()


def _numbers(entry: Entry) -> str:
    if entry.coming is not None:
        return f"({entry.coming})"
    return ", ".join(str(chapter.number) for chapter in entry.chapters)


def _block(entry: Entry, notebooks: str) -> str:
    """Return an equation's part of the page."""
    rows = [f"({entry.equation.anchor})=", f"**{entry.equation}**: {entry.title}", ""]
    formulas = [
        chapter.formulas[entry.equation] for chapter in entry.chapters if entry.equation in chapter.formulas
    ]
    if formulas:
        rows += ["$$", *formulas[-1].splitlines(), "$$", ""]
    rows += [f"- *not as printed:* {plain(reason)}" for reason in entry.reasons]
    rows.append(f"- functions: {_some([_role(d) for d in entry.functions], FUNCTIONS)}")
    if entry.shown:
        rows.append(f"- drawings and exercises: {_some([_role(d) for d in entry.shown], FUNCTIONS)}")
    written = ", ".join(_link(chapter, notebooks) for chapter in entry.chapters)
    coming = f"{entry.coming}, to be written" if entry.coming is not None else "none"
    rows.append(f"- chapter: {written or coming}")
    rows.append(f"- tests: {_tests(entry.tests)}")
    return "\n".join(rows)


def _some(items: list[str], most: int) -> str:
    """Return a list of which the first few are named."""
    left = len(items) - most
    named = ", ".join(items[:most]) or "none"
    return f"{named}, and {left} more" if left > 0 else named


def _tests(witnesses: tuple[Witness, ...]) -> str:
    """Return the first few tests, by file and in words: their names are sentences."""
    files: dict[str, list[str]] = {}
    for witness in witnesses[:TESTS]:
        file, _, name = witness.name.partition(".")
        files.setdefault(file, []).append(name.removeprefix("test_").replace("_", " "))
    named = ". ".join(f"`{file}.py`: {'; '.join(names)}" for file, names in files.items())
    left = len(witnesses) - TESTS
    return f"{named}; and {left} more" if left > 0 else named or "none"


def _role(document: Documented) -> str:
    """Return a link to a function; what is private is in no reference."""
    return f"`{short(document)}`" if document.private else f"{{py:obj}}`{short(document)} <{document.name}>`"


def _link(chapter: Chapter, notebooks: str) -> str:
    return f"[{chapter.number} {chapter.title}]({notebooks}/{chapter.file})"
