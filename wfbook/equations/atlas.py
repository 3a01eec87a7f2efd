"""The map: of every equation what it says, what implements it, where it is taught and what tests it."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from wfbook.equations.calls import Graph, sources
from wfbook.equations.chapters import Chapter, chapters
from wfbook.equations.docstrings import Documented, documented
from wfbook.equations.exercised import PACKAGE, Exercised, Witness, exercised
from wfbook.equations.titles import TITLES, Equation

LIBRARY = Path(__file__).resolve().parent.parent
REPOSITORY = LIBRARY.parent


@dataclass(frozen=True)
class Entry:
    """An equation's line in the map.

    Attributes:
        equation: which.
        title: what it says.
        functions: what implements it, the chapters' own first.
        shown: what draws it, asks for it in an exercise or compares it.
        reasons: why it is not used as it is printed; empty if it is.
        chapters: that write it down.
        coming: the number of a chapter that is not written yet and will, as the functions' modules say.
        tests: that exercise it, the most telling first.
    """

    equation: Equation
    title: str
    functions: tuple[Documented, ...]
    shown: tuple[Documented, ...]
    reasons: tuple[str, ...]
    chapters: tuple[Chapter, ...]
    coming: int | None
    tests: tuple[Witness, ...]


@dataclass(frozen=True)
class Atlas:
    """The whole map.

    Attributes:
        entries: of every equation, in order.
        wrong: what is missing or leads nowhere, one line each; empty if nothing is.
    """

    entries: tuple[Entry, ...]
    wrong: tuple[str, ...]

    def of(self, paper: str) -> tuple[Entry, ...]:
        """Return one paper's entries."""
        return tuple(entry for entry in self.entries if entry.equation.paper == paper)


def atlas(root: Path = REPOSITORY) -> Atlas:
    """Draw the map of a checkout.

    Args:
        root: its folder, with ``wfbook``, ``notebooks`` and ``tests`` in it.

    Raises:
        FileNotFoundError: one of them is not there.
    """
    for folder in (PACKAGE, "notebooks", "tests"):
        if not (root / folder).is_dir():
            raise FileNotFoundError(f"no {folder} in {str(root)!r}: the map is drawn from a checkout")
    graph = Graph.of(sources(root / PACKAGE, PACKAGE) | sources(root / "tests"))
    documents = documented(root / PACKAGE)
    return drawn(documents, chapters(root / "notebooks"), exercised(graph, documents))


def drawn(documents: list[Documented], books: list[Chapter], tests: Exercised) -> Atlas:
    """Draw the map from what was read."""
    entries = tuple(_entry(equation, documents, books, tests) for equation in TITLES)
    wrong = [line for source in (*documents, *books) for line in source.wrong()]
    wrong += [*_unkept(documents), *_holes(entries), *_unexplained(entries, books)]
    return Atlas(entries, (*wrong, *tests.wrong))


def _entry(equation: Equation, documents: list[Documented], books: list[Chapter], tests: Exercised) -> Entry:
    homes = {d.name: d.teaches for d in documents if d.kind == "module" and equation in d.claims}
    written = tuple(book for book in books if equation in book.covers)
    last = max((book.number for book in books), default=-1)
    coming = [number for number in homes.values() if number is not None and number > last]

    taught = {book.number for book in written} or {min(coming, default=None)} - {None}

    def first(document: Documented) -> tuple[bool, bool, bool, bool, int]:
        own, home = homes.get(document.file) in taught, document.file in homes
        return not own, not home, document.private, document.kind == "class", len(document.claims)

    claiming = [d for d in documents if equation in d.claims and d.kind != "module"]
    return Entry(
        equation,
        TITLES[equation],
        tuple(sorted((d for d in claiming if d.implements), key=first)),
        tuple(d for d in claiming if not d.implements),
        tuple(reason for d in documents for of, reason in d.reasons if of == equation),
        written,
        min(coming, default=None) if not written else None,
        tests.tests[equation],
    )


def _unkept(documents: list[Documented]) -> Iterable[str]:
    """A module that names equations in full holds the functions that are these."""
    for module in documents:
        if module.kind == "module":
            inside = {q for d in documents if d.file == module.name and d.kind != "module" for q in d.claims}
            for equation in sorted(set(module.claims) & TITLES.keys() - inside):
                yield (
                    f"{module.name} says that it is eq. {equation}, but none of its functions says so "
                    "(what a module only speaks of it names without the paper)"
                )


def _holes(entries: Iterable[Entry]) -> Iterable[str]:
    """Every equation has a function, a test and a chapter, which may be one that is not written yet."""
    for entry in entries:
        if not entry.functions:
            yield f"eq. {entry.equation}: no docstring of the library is it"
        if not entry.tests:
            yield f"eq. {entry.equation}: no test exercises it"
        if not entry.chapters and entry.coming is None:
            yield f"eq. {entry.equation}: no chapter writes it down"


def _unexplained(entries: Iterable[Entry], books: list[Chapter]) -> Iterable[str]:
    """Docstrings and chapters agree on what can't be taken as printed."""
    for entry in entries:
        differing = [book.file for book in books if entry.equation in book.differs]
        if differing and not entry.reasons:
            yield f"eq. {entry.equation}: {differing[0]} says that it is used otherwise, no docstring does"
        if entry.reasons and entry.chapters and not any(entry.equation in b.explained for b in books):
            yield f"eq. {entry.equation}: a docstring says that it is used otherwise, no chapter does"
