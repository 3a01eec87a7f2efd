"""The pages around the chapters: title, equations, the papers' numbers, licences."""

import importlib.util
import shutil
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import nbformat

import wfbook
from wfbook.book.chapters import Chapter
from wfbook.book.links import SECOND_PART
from wfbook.view.meshcat_static import sharing

PARTS = ("api", "equations", "paper")
"""What there is besides chapters and the pages that every book has."""

ROOT = Path(wfbook.__file__).resolve().parent.parent
TITLE_PLAN = "flat"
"""The stored plan that is executed on the title page."""

_PART_TITLES = ("Part I: feet and wheels", "Part II: steered wheels and an arm")


def write(
    sources: Path, replays: Path, chosen: list[Chapter], parts: Collection[str], paper: Path
) -> None:
    """Write all pages that are no chapters and no reference.

    Args:
        sources: Sphinx's source folder.
        replays: folder of the replays.
        chosen: the chapters in the book.
        parts: which of ``PARTS`` are in it.
        paper: folder with ``paper.md``, which need not exist.

    Raises:
        OSError: something can't be read or written.
    """
    pages = []
    if "equations" in parts and (text := equation_map()) is not None:
        _put(sources / "equations.md", text)
        pages.append("equations")
    if "paper" in parts:
        _put_paper(sources, paper)
        pages.append("paper/paper")
    if "api" in parts:
        pages.append("api/index")
    _put(sources / "licences.md", "\n".join(_licences()) + "\n")
    pages.append("licences")
    replays.mkdir(parents=True, exist_ok=True)
    (replays / "title.html").write_text(sharing(_title_replay(), "viewer.js"), encoding="utf-8")
    _put(sources / "index.md", "\n".join(_title_page(chosen, pages)) + "\n")


def write_notebook(path: Path, notebook: nbformat.NotebookNode) -> None:
    """Write a notebook for Sphinx."""
    nbformat.write(notebook, path)


def equation_map() -> str | None:
    """Return the table of equations as Markdown; None while the library has none."""
    if importlib.util.find_spec("wfbook.equations") is None:
        return None
    from wfbook import equations

    return equations.markdown()


def _put(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _title_replay() -> str:
    """Execute a stored plan, and return the page that replays it."""
    from wfbook import planner, simulate
    from wfbook.view import replay

    return replay.html(simulate.run(planner.stored(TITLE_PLAN)), "a Unitree Go1 on feet and wheels")


def _title_page(chosen: list[Chapter], pages: list[str]) -> Iterator[str]:
    yield "# How wheeled-legged robots decide and move"
    yield ""
    yield "A robot stands on four legs. Each can touch the ground with a foot or with a wheel. Which legs swing"
    yield "when, where do they land, on what, and with what forces? This book answers by doing it: a mixed-integer"
    yield "program decides, a controller executes, a simulation judges, and you watch, break and mend each part."
    yield ""
    yield '<iframe src="replays/title.html" style="width:100%;height:420px;border:0;display:block" title="replay"></iframe>'
    yield '<p class="wfbook-note">A planned metre, executed in MuJoCo: green is a foot, orange a wheel. Drag to'
    yield "look around, click and scroll to zoom.</p>"
    yield ""
    yield "Everything on these pages was computed when they were built, by the notebooks that they show. What is a"
    yield "still here moves there: `python -m wfbook lab` opens them."
    yield ""
    for title, part in zip(_PART_TITLES, _split(chosen), strict=True):
        if not part:
            continue
        yield f"## {title}"
        yield ""
        yield '<div class="wfbook-map">'
        yield ""
        for chapter in part:
            yield '<div class="wfbook-chapter">'
            yield ""
            yield f"[{chapter.number}. {chapter.title}]({chapter.page}.ipynb)"
            yield ""
            if chapter.promise:
                yield f"You can then {chapter.promise}"
                yield ""
            if equations := chapter.needs.get("Equations"):
                yield f"<small>{equations}</small>"
                yield ""
            yield "</div>"
            yield ""
        yield "</div>"
        yield ""
    for title, part in zip(_PART_TITLES, _split(chosen), strict=True):
        if part:
            yield from _toctree(title, [chapter.page for chapter in part])
    yield from _toctree("Reference", pages)


def _split(chosen: list[Chapter]) -> tuple[list[Chapter], list[Chapter]]:
    first = [chapter for chapter in chosen if chapter.number < SECOND_PART]
    return first, [chapter for chapter in chosen if chapter.number >= SECOND_PART]


def _toctree(caption: str, pages: list[str]) -> Iterator[str]:
    yield "```{toctree}"
    yield ":hidden:"
    yield f":caption: {caption!r}" if ":" in caption else f":caption: {caption}"
    yield ""
    yield from pages
    yield "```"
    yield ""


def _put_paper(sources: Path, paper: Path) -> None:
    """Write the page of the papers' numbers: what was compared, or how to do it."""
    folder = sources / "paper"
    folder.mkdir()
    found = paper / "paper.md"
    if not found.exists():
        _put(folder / "paper.md", (
            "# The paper's results beside ours\n\n"
            "This book was built without them. `python -m wfbook paper` plans and simulates what the paper "
            "reports, and writes `results/paper/`; build the book again after it, or with `--paper DIR`.\n"
        ))  # fmt: skip
        return
    shutil.copyfile(found, folder / "paper.md")
    for picture in paper.glob("*.png"):
        shutil.copyfile(picture, folder / picture.name)


def _licences() -> Iterator[str]:
    yield "# How to cite, licences"
    yield ""
    yield "## How to cite"
    yield ""
    yield f"wfbook {wfbook.__version__}, *How wheeled-legged robots decide and move: a book that runs, and the library"
    yield "behind it*. Whoever uses a result should cite the paper that it is from:"
    yield ""
    yield "- **Paper A**: Morgan and Agheli, *Trajectory Optimization Through Mixed-Integer Optimization of Contact"
    yield "  Dynamics for Switching End Effector Locomotion*."
    yield "- **Paper B**: Chen, Li, Liu, Li, Yin and Li, *Whole-body Motion Control of an Omnidirectional"
    yield "  Wheel-Legged Mobile Manipulator via Contact-Aware Dynamic Optimization*."
    yield ""
    yield "## Licence of text and code"
    yield ""
    yield "```text"
    yield from (ROOT / "LICENSE").read_text(encoding="utf-8").splitlines()
    yield "```"
    yield ""
    assets = (ROOT / "assets" / "README.md").read_text(encoding="utf-8")
    yield assets.replace("\n## ", "\n### ").replace("# Assets:", "## Assets:", 1)
