"""Sphinx extension: plain words become links.

Authors write what they would write on paper: "eq. 8", "eqs 12 to 15", "Paper B, eq. 7", "(B 7)",
"chapter 3", and names of the library in code, ``wfbook.swing.quintic_basis``. Without a paper an equation is
one of the paper that the paragraph named last, or that the page is about: A in part I and B in part II. What
there is no page for stays text.
"""

import ast
import importlib
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.addnodes import desc_signature, pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

from wfbook.book.mathematics import MAP, Number, anchor, equations

SECOND_PART = 9
"""The first chapter on paper B."""

_MORE = r"(?:(?:, and | and |, | or | to |–)\d+)*"
_EQUATIONS = re.compile(
    r"(?:\bPaper (?P<paper>[AB]), (?:after )?)?"
    rf"\b(?:[Ee]q\. (?P<one>\d+)|[Ee]quation (?P<spelt>\d+)|(?:[Ee]qs|[Ee]quations) (?P<many>\d+{_MORE}))"
)
_TAGS = re.compile(r"(?<=\()(?P<paper>[AB]) (?P<one>\d+)(?=\))")
_CHAPTERS = re.compile(rf"\b[Cc]hapters? (?P<numbers>\d+{_MORE})")
_NUMBER = re.compile(r"\d+")
_NAME = re.compile(r"wfbook(?:\.\w+)+(?=(?:\(\))?$)")
_UNTOUCHED = (
    *(nodes.literal, nodes.literal_block, nodes.math, nodes.math_block, nodes.raw, nodes.reference),
    *(nodes.title, nodes.comment, desc_signature, pending_xref),
)


def _link(app: Sphinx, document: nodes.document, page: str) -> None:
    """Put links into a page's text."""
    known = equations(app.env)
    chapters = {int(m[1]): name for name in app.env.found_docs if (m := re.search(r"/(\d\d)_", name))}
    home = "B" if _about_b(page) else "A"
    named: dict[int, str] = {}  # by block of text, the paper that was named last in it

    def place_of(number: Number) -> str | None:
        """Return where an equation stands: here, in the chapter that explains it, or in the map of all."""
        pages = known.get(number, ())
        if page in pages:
            return f"#{anchor(number)}"
        target = pages[0] if pages else MAP if MAP in app.env.found_docs and page != MAP else None
        return target and f"{app.builder.get_relative_uri(page, target)}#{anchor(number)}"

    def places(text: str, block: int) -> Iterator[tuple[int, int, str]]:
        """Yield where links begin and end, and what they lead to."""
        for match in _EQUATIONS.finditer(text):
            named[block] = paper = match["paper"] or named.get(block, home)
            yield from _links(match, ("one", "spelt", "many"), lambda n, p=paper: place_of((p, n)))
        for match in _TAGS.finditer(text):
            yield from _links(match, ("one",), lambda n, p=match["paper"]: place_of((p, n)))
        for match in _CHAPTERS.finditer(text):
            yield from _links(match, ("numbers",), chapter_of)

    def chapter_of(number: str) -> str | None:
        target = chapters.get(int(number))
        return None if target in (None, page) else app.builder.get_relative_uri(page, target)

    for text in list(document.findall(nodes.Text)):
        if not _within(text, _UNTOUCHED):
            _replace(text, sorted(places(text.astext(), _block(text))))
    for code in list(document.findall(nodes.literal)):
        match = _NAME.match(code.astext())
        if match and not isinstance(code.parent, nodes.reference) and (found := _entry(app.env, match[0])):
            target, name = found
            link = nodes.reference("", "", internal=True)
            link["refuri"] = f"{app.builder.get_relative_uri(page, target)}#{name}"
            code.replace_self(link)
            link += code


def _links(
    match: re.Match, groups: tuple[str, ...], place: Callable[[str], str | None]
) -> Iterator[tuple[int, int, str]]:
    """Yield begin, end and address of what a match names; a single thing is linked with its words."""
    group = next(group for group in groups if match[group])
    numbers = list(_NUMBER.finditer(match[group]))
    for at in numbers:
        if (address := place(at[0])) is not None:
            begin = match.start() if len(numbers) == 1 else match.start(group) + at.start()
            yield begin, match.start(group) + at.end(), address


def _block(node: nodes.Node) -> int:
    """Return what identifies the paragraph, or the like, that a text is in."""
    while isinstance(node.parent, nodes.Inline):
        node = node.parent
    return id(node.parent)


def _about_b(page: str) -> bool:
    """Whether a page is about paper B."""
    chapter = re.search(r"/(\d\d)_", page)
    return int(chapter[1]) >= SECOND_PART if chapter else "omni" in page


def _within(node: nodes.Node, kinds: tuple[type, ...]) -> bool:
    while node is not None:
        if isinstance(node, kinds):
            return True
        node = node.parent
    return False


def _replace(text: nodes.Text, places: list[tuple[int, int, str]]) -> None:
    """Replace a text node by text and references."""
    if not places:
        return
    whole, parts, after = text.astext(), [], 0
    for begin, end, address in places:
        parts += [
            nodes.Text(whole[after:begin]),
            nodes.reference("", whole[begin:end], refuri=address, internal=True),
        ]
        after = end
    parent = text.parent
    parent.replace(text, [*(part for part in parts if part.astext()), nodes.Text(whole[after:])])


def _entry(environment: BuildEnvironment, name: str) -> tuple[str, str] | None:
    """Return page and anchor of a module, class, function or constant in the reference."""
    objects = environment.domains["py"].objects
    found = objects.get(name) or objects.get(_definition(name))
    return (found.docname, found.node_id) if found else None


def _definition(name: str) -> str:
    """Return under which name something is documented that is known by several: where it is defined."""
    path, _, last = name.rpartition(".")
    try:
        thing = getattr(importlib.import_module(path), last)
    except (ImportError, AttributeError, ValueError):
        return name
    return f"{getattr(thing, '__module__', path)}.{getattr(thing, '__qualname__', last)}"


def _say_which(_app: Sphinx, document: nodes.document) -> None:
    """Say in which module a name is, where several have one of that name."""
    for node in document.findall(pending_xref):
        module, name = node.get("py:module"), node.get("reftarget", "")
        if node.get("refdomain") == "py" and module and "." not in name:
            node["reftarget"] = _meant(module).get(name, name)


@cache
def _meant(module: str) -> dict[str, str]:
    """Return what names mean in a module, in full: its own, imported ones, those beside it in its package."""
    path = Path(importlib.import_module(module).__file__)
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    found = {}
    for beside in sorted(path.parent.glob("*.py")) if "." in package else ():
        name = f"{package}.{beside.stem}"
        found |= {beside.stem: name} | {defined: f"{name}.{defined}" for defined in _defined(beside)}
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("wfbook"):
            for alias in node.names:
                found[alias.asname or alias.name] = _definition(f"{node.module}.{alias.name}")
    return found | {name: f"{module}.{name}" for name in _defined(path)}


def _defined(path: Path) -> list[str]:
    """Return the classes and functions of a module."""
    return [node.name for node in _tree(path).body if isinstance(node, ast.ClassDef | ast.FunctionDef)]


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _elsewhere(
    app: Sphinx, environment: BuildEnvironment, node: pending_xref, content: nodes.Element
) -> nodes.reference | None:
    """Resolve names by which a package passes on what one of its modules defines."""
    found = _entry(environment, node.get("reftarget", ""))
    if node.get("refdomain") != "py" or found is None:
        return None
    page, name = found
    address = f"{app.builder.get_relative_uri(node['refdoc'], page)}#{name}"
    return nodes.reference("", "", content, internal=True, refuri=address)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension (Sphinx's interface)."""
    app.connect("doctree-read", _say_which)
    app.connect("doctree-resolved", _link)
    app.connect("missing-reference", _elsewhere)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
