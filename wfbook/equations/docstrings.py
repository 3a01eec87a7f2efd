"""What the library's docstrings say of equations, read from its source: nothing is imported.

A function, class or property *is* an equation if the first paragraph of its docstring names it in full
(``Paper A, eq. 12``; see :mod:`.citations`). A paragraph that begins with ``Not as printed:`` says why the
equation can't be taken as the paper has it; it speaks of the equations of the first paragraph, or of those
that it names itself (``Not as printed, eqs 13–15:``).
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from wfbook.equations.citations import citations, oddly_named
from wfbook.equations.titles import TITLES, Equation

BESIDE = ("equations", "exercises", "paper", "quoted", "report", "study", "table2", "view")
"""Parts of the library that draw, ask or compare: what they name they show, and do not implement."""

_DIFFERS = re.compile(r"Not as printed(?P<which>, [^:]*)?: (?P<reason>.*)")


@dataclass(frozen=True)
class Documented:
    """A module, class, function, method or variable that has a docstring.

    Attributes:
        name: dotted, from ``wfbook`` on.
        file: the module that it is in, likewise.
        kind: ``"module"``, ``"class"``, ``"function"``, ``"method"``, ``"property"`` or ``"variable"``.
        line: of the definition.
        text: the docstring.
        claims: the equations that it is, in order; of a module: that its functions are.
        named: all equations that it names, claims among them, which may be some that don't exist.
        reasons: why equations can't be taken as they are printed.
    """

    name: str
    file: str
    kind: str
    line: int
    text: str
    claims: tuple[Equation, ...]
    named: frozenset[Equation]
    reasons: tuple[tuple[Equation, str], ...]

    @property
    def module(self) -> str:
        """The part of the library: ``"centroidal"``, ``"planner"``."""
        return f"{self.name}.".split(".")[1]

    @property
    def teaches(self) -> int | None:
        """The chapter that a module says it is for; None if it does not begin with that."""
        match = re.match(r"Chapter (\d+): ", self.text) if self.kind == "module" else None
        return int(match[1]) if match else None

    @property
    def implements(self) -> bool:
        """Whether it can be an equation's implementation."""
        return self.kind not in ("module", "variable") and self.module not in BESIDE

    @property
    def private(self) -> bool:
        """Whether it is not for others to call."""
        return any(part.startswith("_") for part in self.name.split("."))

    def wrong(self) -> list[str]:
        """Return what is wrong with the equations that it names, one line each."""
        missing = sorted(self.named - TITLES.keys())
        lines = [f"{self.name} names eq. {equation}, which does not exist" for equation in missing]
        lines += [f"{self.name} names an equation as {odd!r}" for odd in oddly_named(self.text)]
        return lines


def paragraphs(text: str) -> list[str]:
    """Return the paragraphs and list items of a docstring, each in one line."""
    blocks = re.split(r"\n\s*\n|\n(?=\s*- )", text.strip())
    return [" ".join(block.split()).removeprefix("- ") for block in blocks if block.strip()]


def paper_of(name: str) -> str:
    """Return the paper that a module or file is about if it does not say: part II is in ``omni``."""
    return "B" if "omni" in name else "A"


def documented(root: Path) -> list[Documented]:
    """Read all docstrings of a package.

    Args:
        root: its folder.

    Returns:
        In the order of the files' names and of the lines in them.
    """
    found = []
    for path in sorted(root.rglob("*.py")):
        parts = path.relative_to(root.parent).with_suffix("").parts
        module = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found += _of_module(module, ast.parse(path.read_text()))
    return found


def _of_module(module: str, tree: ast.Module) -> Iterator[Documented]:
    text = ast.get_docstring(tree) or ""
    first = citations(text, paper_of(module))
    paper = first[0].equation.paper if first else paper_of(module)
    if text:
        yield _read(module, module, "module", 1, text, paper)
    yield from _of_body(module, module, tree.body, paper)


def _of_body(
    module: str, owner: str, body: list[ast.stmt], paper: str, inside: str = ""
) -> Iterator[Documented]:
    for node, after in pairwise([*body, None]):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            name = f"{owner}.{node.name}"
            text = ast.get_docstring(node)
            if text:
                yield _read(name, module, _kind(node, inside), node.lineno, text, paper)
            yield from _of_body(module, name, node.body, paper, type(node).__name__)
        elif isinstance(node, ast.Assign | ast.AnnAssign) and isinstance(after, ast.Expr):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            if isinstance(target, ast.Name) and isinstance(getattr(after.value, "value", None), str):
                text = after.value.value
                yield _read(f"{owner}.{target.id}", module, "variable", node.lineno, text, paper)


def _kind(node: ast.FunctionDef | ast.ClassDef, inside: str) -> str:
    if isinstance(node, ast.ClassDef):
        return "class"
    if inside != "ClassDef":
        return "function"
    names = {getattr(d, "id", getattr(d, "attr", "")) for d in node.decorator_list}
    return "property" if names & {"property", "cached_property"} else "method"


def _read(name: str, module: str, kind: str, line: int, text: str, paper: str) -> Documented:
    parts = paragraphs(text)
    claims = [c.equation for c in citations(parts[0], paper) if c.full]
    claims = [] if kind == "variable" else list(dict.fromkeys(claims))
    named = frozenset(c.equation for c in citations(text, paper))
    if claims:
        paper = claims[0].paper
    reasons = []
    for part in parts[1:]:
        if match := _DIFFERS.match(part):
            which = [c.equation for c in citations(match["which"] or "", paper)] or claims
            reasons += [(equation, match["reason"]) for equation in which]
    return Documented(name, module, kind, line, text, tuple(claims), named, tuple(reasons))
