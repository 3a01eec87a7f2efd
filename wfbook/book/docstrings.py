"""Sphinx extension: the docstrings' own habits, where Sphinx would read something else into them."""

import re
from typing import Any

from docutils import nodes
from sphinx.addnodes import desc_signature, pending_xref
from sphinx.application import Sphinx

from wfbook.book.execute import ROOT

_BEFORE_NAPOLEON = 400
_NO_PYTHON = re.compile(r"<(?:[^<>]|<[^<>]*>)*>")
_PATH = re.compile(rf"PosixPath\('{re.escape(str(ROOT))}/([^']*)'\)")
_VALUES = {"attribute", "data", "property"}


def _not_a_type(_app: Sphinx, what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Keep the words before a colon: napoleon takes "Kinds of contact: ..." for a constant of that type.

    And what comes after "Returns:" likewise, unless its type is given as empty.
    """
    if what in _VALUES:
        lines[:0] = ["..", ""]
    for index, line in enumerate(lines[:-1]):
        if line.strip() in ("Returns:", "Yields:") and ":" in lines[index + 1]:
            text = lines[index + 1].lstrip()
            lines[index + 1] = f"{lines[index + 1].removesuffix(text)}: {text}"


def _several(_app: Sphinx, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Keep "model, data: MuJoCo's" together: a field takes what stands before a blank for a type."""
    for index, line in enumerate(lines):
        field, mark, text = line.partition(": ")
        if mark and field.startswith((":ivar ", ":param ")):
            kind, names = field.split(" ", 1)
            lines[index] = f"{kind} {names.replace(', ', ',')}: {text}"


def _readable(
    _app: Sphinx,
    _what: str,
    _name: str,
    _thing: Any,
    _options: Any,
    signature: str | None,
    returned: str | None,
) -> tuple[str | None, str | None]:
    """Write defaults that are no Python, like ``<factory>``, as dots: Sphinx would give up on them."""
    if signature is not None:
        signature = _PATH.sub(r"'\1'", _NO_PYTHON.sub("...", signature))
    return signature, returned


def _own_paths(_app: Sphinx, document: nodes.document) -> None:
    """Show values that are files of the project without where the project happened to be."""
    for signature in document.findall(desc_signature):
        for text in list(signature.findall(nodes.Text)):
            if str(ROOT) in text:
                text.parent.replace(text, nodes.Text(_PATH.sub(r"'\1'", text.astext())))


def _names(_app: Sphinx, document: nodes.document) -> None:
    """Write several names as one would; nothing else is called by all of them."""
    for node in list(document.findall(pending_xref)):
        if "," in node.get("reftarget", ""):
            node.replace_self(nodes.strong("", node.astext().replace(",", ", ")))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension (Sphinx's interface)."""
    app.connect("autodoc-process-docstring", _not_a_type, _BEFORE_NAPOLEON)
    app.connect("autodoc-process-docstring", _several, 2 * _BEFORE_NAPOLEON)
    app.connect("autodoc-process-signature", _readable)
    app.connect("doctree-read", _names)
    app.connect("doctree-read", _own_paths)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
