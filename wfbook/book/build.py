"""From chapters to a folder of web pages."""

import io
import os
import re
import shutil
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import nbformat
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util.docutils import docutils_namespace, patch_docutils

from wfbook.book import front, reference
from wfbook.book.chapters import Chapter, page_of
from wfbook.book.execute import execute
from wfbook.view.meshcat_static import viewer_script

HERE = Path(__file__).resolve().parent
KATEX = HERE.parent.parent / "assets" / "katex"

_UNUSED = ("locales", "images", "scripts/*.map", "styles/*.map")
"""What the theme brings under ``_static`` and no page asks for: translations, logos, maps to sources."""
_COLOURS = re.compile(r"\x1b\[[\d;]*m")


class BuildError(Exception):
    """Sphinx found something wrong in the book's sources; the text has a line for each."""


def build(
    chosen: Sequence[Chapter],
    parts: Collection[str],
    paper: Path,
    out: Path,
    scratch: Path,
    cores: int,
    kept: Path | None,
    show: Callable[[str], None],
) -> None:
    """Build the book.

    Args:
        chosen: the chapters.
        parts: of :data:`wfbook.book.command.PARTS`, what else is wanted.
        paper: folder with the comparison that ``python -m wfbook paper`` wrote.
        out: empty folder for the pages.
        scratch: empty folder for everything else.
        cores: processes at a time.
        kept: folder of executed chapters, or None.
        show: is told how far it is.

    Raises:
        BuildError: there is something wrong with the sources.
        ChapterError: a cell failed.
        OSError: something can't be read or written.
        ValueError: a notebook is none, or shows what a page can't.
    """
    out, scratch = out.resolve(), scratch.resolve()  # Sphinx would look beside its settings
    sources, extra = scratch / "sources", scratch / "extra"
    (sources / "chapters").mkdir(parents=True)
    replays = extra / "replays"
    replays.mkdir(parents=True)
    executed = execute([chapter.path for chapter in chosen], cores, kept, show)
    show("writing the pages")
    for chapter in chosen:
        page = page_of(chapter, executed[chapter.path], replays, "../replays")
        nbformat.write(page, sources / f"{chapter.page}.ipynb")
    front.write(sources, replays, chosen, parts, paper)
    if "api" in parts:
        (sources / "api").mkdir()
        reference.write(sources / "api")
    (replays / "viewer.js").write_text(viewer_script(), encoding="utf-8")
    static = scratch / "static"
    shutil.copytree(HERE / "static", static)
    shutil.copytree(KATEX, static / "katex")
    run_sphinx(sources, out, scratch / "doctrees", {
        "html_static_path": [str(static)],
        "html_extra_path": [str(extra)],
    }, cores)  # fmt: skip


def run_sphinx(sources: Path, out: Path, doctrees: Path, settings: dict[str, object], cores: int) -> None:
    """Run Sphinx with the book's settings, in which every warning is an error.

    Raises:
        BuildError: with all warnings.
    """
    warnings = io.StringIO()
    with patch_docutils(str(HERE)), docutils_namespace():
        try:
            app = Sphinx(
                srcdir=sources, confdir=HERE, outdir=out, doctreedir=doctrees, buildername="html",
                confoverrides=settings, status=None, warning=warnings, freshenv=True, parallel=cores,
            )  # fmt: skip
            app.build(force_all=True)
        except SphinxError as error:
            warnings.write(str(error))
    for name in _UNUSED:
        for path in out.glob(f"_static/{name}"):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    if text := _COLOURS.sub("", warnings.getvalue()).replace(f"{sources}{os.sep}", "").strip():
        raise BuildError(text)
