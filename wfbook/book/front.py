"""The pages around the chapters: title, equations, the papers' numbers, licences."""

import re
import shutil
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from string import Template

import wfbook
from wfbook import equations
from wfbook.book.chapters import Chapter
from wfbook.book.links import SECOND_PART
from wfbook.view.meshcat_static import sharing

ROOT = Path(wfbook.__file__).resolve().parent.parent
PAGES = Path(__file__).resolve().parent / "pages"
TITLE_PLAN = "flat"
"""The stored plan that is executed on the title page."""

_PART_TITLES = ("Part I: feet and wheels", "Part II: steered wheels and an arm")
_TO_CHAPTER = re.compile(r"\[([^\]]*)\]\((chapters/[^)]*)\)")
_REPLAY = (
    '<iframe src="replays/title.html" style="width:100%;height:420px;border:0;display:block" title="replay">'
    "</iframe>"
)


def write(
    sources: Path, replays: Path, chosen: Sequence[Chapter], parts: Collection[str], paper: Path
) -> None:
    """Write all pages that are no chapters and no reference.

    Args:
        sources: Sphinx's source folder.
        replays: folder of the replays.
        chosen: the chapters in the book.
        parts: which of :data:`wfbook.book.command.PARTS` are in it.
        paper: folder with ``paper.md``, which need not exist.

    Raises:
        OSError: something can't be read or written.
    """
    pages = []
    if "equations" in parts:
        _put(sources / "equations.md", equation_map(chosen))
        pages.append("equations")
    if "paper" in parts:
        _put_paper(sources / "paper", paper)
        pages.append("paper/paper")
    if "api" in parts:
        pages.append("api/index")
    _put(sources / "licences.md", _licences())
    pages.append("licences")
    _put(replays / "title.html", sharing(_title_replay(), "viewer.js"))
    _put(sources / "index.md", _title_page(chosen, pages))


def equation_map(chosen: Sequence[Chapter]) -> str:
    """Return the map of all equations as Markdown.

    Args:
        chosen: the chapters in the book; links to others become text.
    """
    there = {f"{chapter.page}.ipynb" for chapter in chosen}
    page = equations.page(notebooks="chapters")
    return _TO_CHAPTER.sub(lambda link: link[0] if link[2] in there else link[1], page)


def _put(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _page(name: str, **parts: str) -> str:
    return Template((PAGES / name).read_text(encoding="utf-8")).substitute(parts)


def _title_replay() -> str:
    """Execute a stored plan, and return the page that replays it."""
    from wfbook import planner, simulate
    from wfbook.view import replay

    return replay.html(simulate.run(planner.stored(TITLE_PLAN)), "a Unitree Go1 on feet and wheels")


def _title_page(chosen: Sequence[Chapter], pages: Sequence[str]) -> str:
    first = [chapter for chapter in chosen if chapter.number < SECOND_PART]
    second = [chapter for chapter in chosen if chapter.number >= SECOND_PART]
    lines: list[str] = []
    for title, part in zip(_PART_TITLES, (first, second), strict=True):
        if part:
            lines += _map(title, part)
    for title, part in zip(_PART_TITLES, (first, second), strict=True):
        if part:
            lines += _toctree(title, [chapter.page for chapter in part])
    lines += _toctree("Reference", pages)
    return _page("index.md", replay=_REPLAY, map="\n".join(lines))


def _map(title: str, part: Sequence[Chapter]) -> Iterator[str]:
    """Show a part's chapters, each with what it promises."""
    yield f'## {title}\n\n<div class="wfbook-map">\n'
    for chapter in part:
        yield f'<div class="wfbook-chapter">\n\n[{chapter.number}. {chapter.title}]({chapter.page}.ipynb)\n'
        if chapter.promise:
            yield f"You will {chapter.promise}\n"
        if numbers := chapter.needs.get("Equations"):
            yield f"*{numbers}*\n"
        yield "</div>\n"
    yield "</div>\n"


def _toctree(caption: str, pages: Sequence[str]) -> Iterator[str]:
    yield f"```{{toctree}}\n:hidden:\n:caption: '{caption}'\n"
    yield from pages
    yield "```\n"


def _put_paper(folder: Path, paper: Path) -> None:
    """Write the page of the papers' numbers: what was compared, or how to do it."""
    folder.mkdir()
    if not (paper / "paper.md").exists():
        _put(folder / "paper.md", _page("no_paper.md"))
        return
    shutil.copyfile(paper / "paper.md", folder / "paper.md")
    for picture in paper.glob("*.png"):
        shutil.copyfile(picture, folder / picture.name)


def _licences() -> str:
    """Return the page of licences: this project's, and those of what it uses."""
    assets = (ROOT / "assets" / "README.md").read_text(encoding="utf-8")
    return _page(
        "licences.md",
        version=wfbook.__version__,
        licence=(ROOT / "LICENSE").read_text(encoding="utf-8"),
        assets=assets.replace("\n## ", "\n### ").replace("# Assets:", "## Assets:", 1),
    )
