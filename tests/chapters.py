"""The chapters' notebooks, as the tests read them."""

import ast
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import nbformat

FOLDER = Path(__file__).parent.parent / "notebooks"
PATHS = sorted(FOLDER.glob("*.ipynb"))
BEGIN, END = "### BEGIN SOLUTION", "### END SOLUTION"
_HEADING = re.compile(r"^(#{1,6}) (.*)$", re.MULTILINE)


@dataclass(frozen=True)
class Chapter:
    """A notebook.

    Attributes:
        path: of its file.
    """

    path: Path

    @cached_property
    def notebook(self) -> nbformat.NotebookNode:
        """As it is stored."""
        return nbformat.read(self.path, as_version=nbformat.NO_CONVERT)

    @property
    def number(self) -> str:
        """Of the chapter, two digits."""
        return self.path.stem[:2]

    @property
    def cells(self) -> list[nbformat.NotebookNode]:
        """All cells."""
        return self.notebook.cells

    @property
    def code(self) -> list[nbformat.NotebookNode]:
        """The code cells."""
        return [cell for cell in self.cells if cell.cell_type == "code"]

    @property
    def headings(self) -> list[tuple[int, str, int]]:
        """Level, text and cell of every heading."""
        found = [
            (len(marks), text, index)
            for index, cell in enumerate(self.cells)
            if cell.cell_type == "markdown"
            for marks, text in _HEADING.findall(_without_listings(cell.source))
        ]
        return found

    @cached_property
    def trees(self) -> list[ast.Module]:
        """The code cells as Python."""
        return [ast.parse(cell.source) for cell in self.code]

    def imported_from(self, module: str) -> set[str]:
        """Return the modules under ``module``, with itself, from which cells import."""
        names = {
            node.module
            for tree in self.trees
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and node.module
        }
        return {name for name in names if name == module or name.startswith(module + ".")}


def calls(tree: ast.Module) -> set[str]:
    """Return what a cell calls, as it is written: ``Replay``, ``check.torque``."""
    return {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}


def cleared(source: str) -> str:
    """Return a solution cell as a student gets it: nbgrader's ClearSolutions does the same."""
    lines, inside = [], False
    for line in source.splitlines():
        if BEGIN in line:
            indent = line[: len(line) - len(line.lstrip())]
            lines += [f"{indent}# YOUR CODE HERE", f"{indent}raise NotImplementedError()"]
            inside = True
        elif END in line:
            inside = False
        elif not inside:
            lines.append(line)
    return "\n".join(lines)


def _without_listings(text: str) -> str:
    return re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
