r"""Sphinx extension: mathematics by KaTeX, from a file, and equations that carry the papers' numbers.

``\tag{A 8}`` in a displayed equation is equation 8 of paper A. It becomes an anchor, ``eq-a-8``, that text
on any page can link to (:mod:`.links`).
"""

import re
from collections import defaultdict
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging

TAG = re.compile(r"\\tag\{([AB]) (\d+[a-z]?)\}")
Number = tuple[str, str]
"""Of an equation: the paper, "A" or "B", and the number in it."""

MAP = "equations"
"""The page with all equations of both papers; it may be missing."""

_log = logging.getLogger(__name__)


def anchor(number: Number) -> str:
    """Return an equation's anchor on its page."""
    return f"eq-{number[0].lower()}-{number[1]}"


def equations(environment: BuildEnvironment) -> dict[Number, list[str]]:
    """Return the pages on which each equation stands, the one that explains it first."""
    found = defaultdict(list)
    for page, numbers in sorted(_pages(environment).items(), key=lambda entry: _rank(entry[0])):
        for number in numbers:
            found[number].append(page)
    return dict(found)


def _rank(page: str) -> tuple[bool, str]:
    """Chapter 0 quotes what later chapters explain."""
    return "00_" in page, page


def _pages(environment: BuildEnvironment) -> dict[str, list[Number]]:
    if not hasattr(environment, "wfbook_equations"):
        environment.wfbook_equations = {}
    return environment.wfbook_equations


def _collect(app: Sphinx, document: nodes.document) -> None:
    """Take the numbers out of the equations of a page."""
    numbers = _pages(app.env)[app.env.docname] = []
    for block in document.findall(nodes.math_block):
        text = block.astext()
        tags = TAG.findall(text)
        block["tex"] = TAG.sub("", text)
        for number in tags:
            if number in numbers:
                _log.warning("equation %s %s stands twice on a page", *number, location=block)
                continue
            numbers.append(number)
            block["ids"].append(anchor(number))
            block.setdefault("numbers", []).append(number)


def _forget(_app: Sphinx, environment: BuildEnvironment, page: str) -> None:
    _pages(environment).pop(page, None)


def _merge(_app: Sphinx, environment: BuildEnvironment, pages: set[str], other: BuildEnvironment) -> None:
    _pages(environment).update({page: _pages(other)[page] for page in pages if page in _pages(other)})


def _inline(self: Any, node: nodes.math) -> None:
    self.body.append(f'<span class="math notranslate nohighlight">{self.encode(node.astext())}</span>')
    raise nodes.SkipNode


def _displayed(self: Any, node: nodes.math_block) -> None:
    tex = node.get("tex", node.astext())
    self.body.append(self.starttag(node, "div", CLASS="equation"))
    self.body.append(f'<div class="math notranslate nohighlight" data-display>{self.encode(tex)}</div>')
    builder, place = self.builder, ""
    if MAP in builder.env.found_docs:  # what the number leads to: functions, chapters and tests
        place = builder.get_relative_uri(builder.current_docname, MAP)
    for paper, number in node.get("numbers", ()):
        address, name = f"{place}#{anchor((paper, number))}", f"Paper {paper}, eq. {number}"
        self.body.append(f'<a class="eqno" href="{address}" title="{name}">({paper} {number})</a>')
    self.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer (Sphinx's interface)."""
    app.add_html_math_renderer("katex", inline_renderers=(_inline, None), block_renderers=(_displayed, None))
    app.connect("doctree-read", _collect)
    app.connect("env-purge-doc", _forget)
    app.connect("env-merge-info", _merge)
    for file in ("katex/katex.min.css", "book.css"):
        app.add_css_file(file)
    for file in ("katex/katex.min.js", "mathematics.js"):
        app.add_js_file(file, loading_method="defer")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
