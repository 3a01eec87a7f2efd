r"""What the chapters say of equations, read from the notebooks.

A chapter *covers* an equation that it writes down and labels (``\tag{A 12}``). The line *Equations* of its
opening lists just these; what comes after a semicolon and ends in *at work* is used there and covered
elsewhere. The section *Where the paper and this book differ* names, in bold at the head of an item, what
can't be taken as printed.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

from wfbook.equations.citations import citations
from wfbook.equations.titles import TITLES, Equation

_LABEL = re.compile(r"\\tag\{([AB]) (\d+)\}")
_DISPLAY = re.compile(r"\$\$(.*?)\$\$", re.DOTALL)
_OPENING = re.compile(r"^\| \*\*Equations\*\* \| (.*) \|$", re.MULTILINE)
_DIFFER = re.compile(r"^## Where the paper and this book differ\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_BOLD = re.compile(r"\*\*(.*?)\*\*")


@dataclass(frozen=True)
class Chapter:
    """A notebook.

    Attributes:
        file: its name, ``01_centroidal_dynamics.ipynb``.
        title: its heading.
        covers: equations that it labels.
        announced: equations that its opening lists as covered.
        named: all that it names, which may be some that don't exist.
        differs: those that its list of differences is about.
        explained: all that the items of that list name.
        formulas: TeX of equations that it displays, without the label.
    """

    file: str
    title: str
    covers: frozenset[Equation]
    announced: frozenset[Equation]
    named: frozenset[Equation]
    differs: frozenset[Equation]
    explained: frozenset[Equation]
    formulas: dict[Equation, str]

    @property
    def number(self) -> int:
        """Of the chapter."""
        return int(self.file[:2])

    def wrong(self) -> list[str]:
        """Return what is wrong with the equations that it names, one line each."""
        missing = sorted((self.named | self.covers) - TITLES.keys())
        lines = [f"{self.file} names eq. {equation}, which does not exist" for equation in missing]
        for equation in sorted(self.covers ^ self.announced):
            which = "labels" if equation in self.covers else "announces"
            other = "announce" if equation in self.covers else "label"
            lines.append(f"{self.file} {which} eq. {equation} but does not {other} it")
        return lines


def chapters(folder: Path) -> list[Chapter]:
    """Read all chapters in a folder, in order."""
    return [read(path.name, path.read_text()) for path in sorted(folder.glob("[0-9][0-9]_*.ipynb"))]


def read(file: str, notebook: str) -> Chapter:
    """Read a chapter.

    Args:
        file: its name.
        notebook: its JSON.
    """
    cells = [cell for cell in json.loads(notebook)["cells"] if cell["cell_type"] == "markdown"]
    text = "\n\n".join("".join(cell["source"]) for cell in cells)
    opening = (_OPENING.findall(text) or [""])[0]
    first = re.search(r"Paper ([AB])", opening)
    paper = first[1] if first else "A"
    parts = [part for part in opening.split(";") if not part.rstrip().endswith("at work")]
    items = [item for part in _DIFFER.findall(text) for item in re.split(r"^- ", part, flags=re.MULTILINE)]
    heads = [" ".join(_BOLD.findall(item)[:1]) for item in items]

    def named(lines: list[str]) -> frozenset[Equation]:
        return frozenset(citation.equation for line in lines for citation in citations(line, paper))

    formulas = {
        equation: _LABEL.sub("", tex).strip() for tex in _DISPLAY.findall(text) for equation in _labels(tex)
    }
    title = re.search(r"^# (.*)$", text, re.MULTILINE)
    return Chapter(
        file,
        title[1] if title else file,
        _labels(text),
        named(parts),
        named([text]),
        named(heads),
        named(items),
        formulas,
    )


def _labels(text: str) -> frozenset[Equation]:
    return frozenset(Equation(letter, int(number)) for letter, number in _LABEL.findall(text))
