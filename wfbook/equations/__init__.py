"""The equation map: every numbered equation of both papers with its function, its chapter and its tests.

It is drawn from the sources of a checkout, which are read and not run. In reading order: :mod:`.titles` says
which equations there are, and :mod:`.citations` how a text names one; :mod:`.docstrings` and :mod:`.chapters`
read what library and notebooks say of them. :mod:`.calls` finds what refers to what, and :mod:`.exercised` by
that the tests of each. :mod:`.atlas` is the map and what is wrong with it, :mod:`.text` its table and its
page, and :mod:`.command` is ``python -m wfbook equations``.

    print(wfbook.equations.page())
"""

from pathlib import Path

from wfbook.equations import text
from wfbook.equations.atlas import REPOSITORY, Atlas, Entry, atlas

__all__ = ["Atlas", "Entry", "atlas", "page"]


def page(root: Path = REPOSITORY, notebooks: str = "notebooks") -> str:
    """Return the page of the book, in MyST Markdown.

    Args:
        root: folder of the checkout.
        notebooks: where the chapters are, from the page.
    """
    return text.page(atlas(root), notebooks)
