"""The chapters as the book has them: read from their notebooks, and made ready to become pages."""

import html
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import nbformat

from wfbook.book.still import still
from wfbook.view.meshcat_static import sharing

FOLDER = Path(__file__).resolve().parent.parent.parent / "notebooks"
_FRAME = re.compile(r'<iframe srcdoc="([^"]*)" style="([^"]*)" title="replay"></iframe>')
_TO_START = re.compile(r"^\| \*\*To start\*\* \|.*$", re.MULTILINE)
_ROW = re.compile(r"^\| \*\*([\w ]+)\*\* \| (.*) \|$", re.MULTILINE)
_PROMISE = re.compile(r"\*\*At the end of this chapter you can\*\*\s*(.*?)(?:\n\n|\Z)", re.DOTALL)
_CHECKED = "# NBVAL_CHECK_OUTPUT\n"
_MARKS = ("### BEGIN SOLUTION", "### END SOLUTION")


@dataclass(frozen=True)
class Chapter:
    """A chapter.

    Attributes:
        path: of its notebook, ``NN_title.ipynb``.
    """

    path: Path

    @property
    def number(self) -> int:
        """Of the chapter."""
        return int(self.path.stem[:2])

    @property
    def page(self) -> str:
        """Where it is in the book, without an ending."""
        return f"chapters/{self.path.stem}"

    @cached_property
    def opening(self) -> str:
        """What stands before the first code."""
        cells = nbformat.read(self.path, as_version=4).cells
        first = next((i for i, cell in enumerate(cells) if cell.cell_type == "code"), len(cells))
        return "\n\n".join(cell.source for cell in cells[:first])

    @property
    def title(self) -> str:
        """Without the number."""
        return self.opening.splitlines()[0].removeprefix("# ")

    @property
    def promise(self) -> str:
        """What a reader can do at the end; empty if the chapter does not say."""
        found = _PROMISE.search(self.opening)
        return " ".join(found[1].split()) if found else ""

    @property
    def needs(self) -> dict[str, str]:
        """The table of the opening: what to know, which equations, how long."""
        return dict(_ROW.findall(self.opening))


def chapters() -> list[Chapter]:
    """Return all chapters in reading order."""
    return [Chapter(path) for path in sorted(FOLDER.glob("[0-9][0-9]_*.ipynb"))]


def page_of(
    chapter: Chapter, notebook: nbformat.NotebookNode, replays: Path, address: str
) -> nbformat.NotebookNode:
    """Return an executed chapter as Sphinx gets it.

    Widgets are stills, replays are files, solutions are folded away, and nothing is left that only helps
    who runs or grades the notebook.

    Args:
        chapter: which it is.
        notebook: executed; it is changed.
        replays: folder to write the replays to.
        address: of that folder, from the chapter's page.

    Raises:
        OSError: a replay can't be written.
        ValueError: a widget can't be shown.
    """
    try:
        still(notebook)
    except ValueError as error:
        raise ValueError(f"{chapter.path.name}: {error}") from None
    count = 0

    def moved(match: re.Match) -> str:
        nonlocal count
        count += 1
        name = f"{chapter.path.stem[:2]}-{count}.html"
        (replays / name).write_text(sharing(html.unescape(match[1]), "viewer.js"), encoding="utf-8")
        place = f"{address}/{name}"
        return (
            f'<iframe src="{place}" style="{match[2]}" title="replay" loading="lazy"></iframe>'
            f'<a class="wfbook-alone" href="{place}" target="_blank">full window</a>'
        )

    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "markdown":
            cell.source = _TO_START.sub(
                f"| **To run it** | `python -m wfbook lab`, then open `{chapter.path.name}` |", cell.source
            )
        else:
            _tidy(cell)
        for output in cell.get("outputs", ()):
            for kind, text in output.get("data", {}).items():
                if kind == "text/html":
                    output.data[kind] = _FRAME.sub(moved, text)
    first = notebook.cells[0]
    first.source = first.source.replace("# ", f"# {chapter.number}. ", 1)
    return notebook


def _tidy(cell: nbformat.NotebookNode) -> None:
    """Take marks out of a code cell, fold a solution away, and give pictures their size."""
    cell.source = cell.source.removeprefix(_CHECKED)
    if cell.metadata.get("nbgrader", {}).get("solution"):
        cell.metadata["tags"] = ["hide-input"]
        lines = [line for line in cell.source.splitlines() if line.strip() not in _MARKS]
        cell.source = "\n".join(lines)
    for output in cell.outputs:
        size = output.get("metadata", {}).get("image/png", {})
        if "width" in size:
            cell.metadata["mystnb"] = {"image": {"width": f"{size['width']}px"}}
