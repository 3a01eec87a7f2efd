"""Sphinx extension: plain words become links.

Authors write what they would write on paper: "eq. 8", "eqs 12 to 15", "Paper B, eq. 7", "chapter 3", and
names of the library in code, ``wfbook.swing.quintic_basis``. Without a paper an equation is one of the paper
that the page is about: A in part I and B in part II. What there is no page for stays text.
"""

import ast
import importlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.addnodes import desc_signature, pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

from wfbook.book.mathematics import anchor, equations

SECOND_PART = 9
"""The first chapter on paper B."""

_MORE = r"(?:(?:, | and |, and | or | to |–|-)\d+)*"
_EQUATIONS = re.compile(
    rf"(?:Paper (?P<paper>[AB])(?:,|'s) )?\b[Ee]q(?:s\.? |uations )(?P<several>\d+{_MORE})"
    r"|(?:Paper (?P<its>[AB])(?:,|'s) )?\b[Ee]q(?:\.|uation) (?P<one>\d+)"
)
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

    def places(text: str) -> Iterator[tuple[int, int, str]]:
        """Yield where links begin and end, and what they lead to."""
        for match in _EQUATIONS.finditer(text):
            paper = match["paper"] or match["its"] or home
            group = "several" if match["several"] else "one"
            numbers = list(_NUMBER.finditer(match[group]))
            for at in numbers:
                pages = known.get((paper, at[0]), ())
                if pages:
                    target = page if page in pages else pages[0]
                    begin = match.start() if len(numbers) == 1 else match.start(group) + at.start()
                    address = "" if target == page else app.builder.get_relative_uri(page, target)
                    yield begin, match.start(group) + at.end(), f"{address}#{anchor((paper, at[0]))}"
        for match in _CHAPTERS.finditer(text):
            numbers = list(_NUMBER.finditer(match["numbers"]))
            for at in numbers:
                target = chapters.get(int(at[0]))
                if target not in (None, page):
                    begin = match.start() if len(numbers) == 1 else match.start("numbers") + at.start()
                    address = app.builder.get_relative_uri(page, target)
                    yield begin, match.start("numbers") + at.end(), address

    for text in list(document.findall(nodes.Text)):
        if not _within(text, _UNTOUCHED):
            _replace(text, sorted(places(text.astext())))
    for code in list(document.findall(nodes.literal)):
        match = _NAME.match(code.astext())
        if match and not isinstance(code.parent, nodes.reference) and (found := _entry(app.env, match[0])):
            target, name = found
            link = nodes.reference("", "", internal=True)
            link["refuri"] = f"{app.builder.get_relative_uri(page, target)}#{name}"
            code.replace_self(link)
            link += code


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


def _say_which(app: Sphinx, document: nodes.document) -> None:
    """Give the names in signatures the module that they are imported from: several modules have a ``Run``."""
    for node in document.findall(pending_xref):
        module, name = node.get("py:module"), node.get("reftarget", "")
        if node.get("refdomain") == "py" and module and "." not in name:
            node["reftarget"] = _imported(module).get(name, name)


@cache
def _imported(module: str) -> dict[str, str]:
    """Return what a module takes from the library, also what only its type hints need: full name by name."""
    tree = ast.parse(Path(importlib.import_module(module).__file__).read_text(encoding="utf-8"))
    return {
        alias.asname or alias.name: _definition(f"{node.module}.{alias.name}")
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("wfbook")
        for alias in node.names
    }


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
