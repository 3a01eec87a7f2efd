"""``python -m wfbook book``: build the whole book, or a part of it, as web pages."""

import argparse
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wfbook.arguments import FAILED, OK, WRONG_INPUT, CommandError, load, whole, whole_folder, wrong_input
from wfbook.report import ProgressLine
from wfbook.results import undisturbed

if TYPE_CHECKING:
    from wfbook.book.chapters import Chapter

PARTS = ("api", "equations", "paper")
"""What there is besides chapters, and pages that every book has."""

MARK = "objects.inv"
"""A file that every book has, and few other folders."""


def add_to(commands: Any) -> None:
    """Add the command's parser to the subparsers of the program's."""
    parser = commands.add_parser(
        "book", help="build the book as web pages that open offline", allow_abbrev=False
    )
    parser.set_defaults(command=run)
    parser.add_argument(
        "--out",
        metavar="DIR",
        default="results/book",
        help="folder; DIR/index.html is the title page (results/book)",
    )
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="NAME",
        help=f"chapters by number, and of {', '.join(PARTS)} (everything)",
    )
    parser.add_argument(
        "--paper",
        metavar="DIR",
        default="results/paper",
        help="folder that python -m wfbook paper wrote (results/paper)",
    )
    parser.add_argument(
        "--cache",
        metavar="DIR",
        help="keep executed chapters here, and take from here those that have not changed (execute all)",
    )
    parser.add_argument("--workers", type=whole(1), help="processes at a time (one for each core)")


def run(arguments: argparse.Namespace) -> int:
    """Build the book; what stands at its place is replaced in the end, or left as it is.

    Raises:
        CommandError: wrong input, a chapter fails, or the sources have faults.
    """
    began = time.monotonic()
    load("wfbook.book.build")
    from wfbook.book.build import BuildError, build
    from wfbook.book.execute import ChapterError

    chapters, parts = _chosen(arguments.only)
    workers = arguments.workers or len(os.sched_getaffinity(0))
    kept = Path(arguments.cache) if arguments.cache else None
    if kept is not None and kept.exists() and not kept.is_dir():
        raise CommandError(f"--cache {str(kept)!r} is no folder", WRONG_INPUT)
    with whole_folder(arguments.out, MARK) as folder, ProgressLine(sys.stderr) as line:
        try:
            with wrong_input():
                build(
                    chapters,
                    parts,
                    Path(arguments.paper),
                    folder.path,
                    folder.scratch,
                    workers,
                    kept,
                    line.show,
                )
        except ChapterError as error:
            raise CommandError(str(error), FAILED) from None
        except BuildError as error:
            raise CommandError(f"the book's sources have faults:\n{error}", FAILED) from None
        with undisturbed():
            folder.publish()
    size = sum(path.stat().st_size for path in folder.target.rglob("*") if path.is_file())
    print(f"{len(chapters)} chapters, {size / 1e6:.1f} MB in {time.monotonic() - began:.0f} s")
    print(f"open {folder.target / 'index.html'}")
    return OK


def _chosen(only: list[str] | None) -> "tuple[list[Chapter], list[str]]":
    """Return the chapters and the other parts that are asked for."""
    from wfbook.book.chapters import FOLDER, chapters

    found = {chapter.number: chapter for chapter in chapters()}
    if not found:
        raise CommandError(f"no notebooks at {str(FOLDER)!r}: install with pip install -e .", FAILED)
    if only is None:
        return list(found.values()), list(PARTS)
    numbers, parts = set(), []
    for name in only:
        if name in PARTS:
            parts.append(name)
        elif name.isdigit() and int(name) in found:
            numbers.add(int(name))
        else:
            known = f"a chapter of {min(found)} to {max(found)}, or of {', '.join(PARTS)}"
            raise CommandError(f"--only: {name!r} is not {known}", WRONG_INPUT)
    return [found[number] for number in sorted(numbers)], parts
