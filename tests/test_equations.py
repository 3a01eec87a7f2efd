"""The equation map is whole, what it names is there, and it tells what is missing or leads nowhere."""

import importlib
import inspect
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from wfbook import equations
from wfbook.__main__ import main
from wfbook.equations.atlas import REPOSITORY, drawn
from wfbook.equations.calls import Graph, sources
from wfbook.equations.chapters import chapters, read
from wfbook.equations.citations import citations, oddly_named
from wfbook.equations.docstrings import documented
from wfbook.equations.exercised import exercised
from wfbook.equations.text import records, table
from wfbook.equations.titles import TITLES, Equation

FUNCTION = '''"""Chapter 1: of one thing ({module})."""

def force():
    """Return a force ({function})."""
    return 1
'''
NOTEBOOK = """# A chapter

| **Equations** | {opening} |

$$x \\tag{{A 1}}$$

## Where the paper and this book differ

- {item}

## Summary
"""
KNOWN = {"A": (8, 9, 13, 14, 15, 17, 29, 30, 33, 35, 38, 39, 41, 44), "B": (1, 3, 7, 9, 13, 14, 21, 22)}
"""Equations that can't be taken as the papers print them, found before the library was written."""


@pytest.fixture(scope="module")
def parts():
    """What the map of this checkout is drawn from."""
    documents = documented(REPOSITORY / "wfbook")
    graph = Graph.of(sources(REPOSITORY / "wfbook", "wfbook") | sources(REPOSITORY / "tests"))
    return documents, chapters(REPOSITORY / "notebooks"), exercised(graph, documents)


@pytest.fixture(scope="module")
def whole(parts):
    return drawn(*parts)


def library(folder: Path, **files: str) -> Path:
    """A package with these modules."""
    root = folder / "wfbook"
    root.mkdir()
    for name, text in {"__init__": '"""A library."""\n', **files}.items():
        (root / f"{name}.py").write_text(text)
    return root


def chapter(opening: str = "Paper A, eq. 1", item: str = "**Nothing**"):
    """Chapter 1, which labels equation A 1."""
    cell = {"cell_type": "markdown", "source": [NOTEBOOK.format(opening=opening, item=item)]}
    return read("01_a_chapter.ipynb", json.dumps({"cells": [cell]}))


def test_the_map_of_this_checkout_is_whole(whole):
    assert "\n".join(whole.wrong) == ""
    assert [len(whole.of(paper)) for paper in "AB"] == [44, 22]


def test_every_function_of_the_map_can_be_imported_and_says_what_it_is(whole):
    for entry in whole.entries:
        for document in entry.functions:
            found = importlib.import_module(document.file)
            for name in document.name.removeprefix(f"{document.file}.").split("."):
                found = inspect.getattr_static(found, name)
            found = getattr(found, "__func__", found)
            first = " ".join(inspect.cleandoc(found.__doc__).split("\n\n")[0].split())
            paper, number = entry.equation
            assert f"Paper {paper}, eq" in first, document.name
            assert entry.equation in {c.equation for c in citations(first, paper)}, (document.name, number)


def test_every_test_of_the_map_is_there(whole):
    for witness in {witness for entry in whole.entries for witness in entry.tests}:
        path, *name = witness.id.split("::")
        line = (REPOSITORY / path).read_text().splitlines()[witness.line - 1]
        assert line.strip().startswith(f"def {name[-1]}("), witness


def test_what_is_known_to_be_misprinted_has_a_reason(whole):
    explained = {entry.equation for entry in whole.entries if entry.reasons}
    assert {Equation(paper, n) for paper, numbers in KNOWN.items() for n in numbers} <= explained


def test_the_page_has_every_equation_and_links_that_lead_somewhere(whole):
    page = equations.text.page(whole, "../notebooks")
    for equation in TITLES:
        assert page.count(f"({equation.anchor})=") == 1
    links = re.findall(r"\]\(\.\./notebooks/(.*?)\)", page)
    assert len(links) >= 44 and all((REPOSITORY / "notebooks" / link).is_file() for link in links)
    assert page.count("*not as printed:*") == sum(len(entry.reasons) for entry in whole.entries)
    assert page.count("$$") >= 2 * 60 and "\\tag" not in page
    assert "``" not in page and not re.search(r":\w+:`", page.replace("{py:obj}`", ""))


def test_the_table_fits_a_terminal_and_the_records_hold_the_same(whole):
    lines = table(whole).splitlines()
    assert max(map(len, lines)) <= 120
    assert sum(bool(re.match(r"[AB] \d+\*? ", line)) for line in lines) == len(TITLES)
    assert [record["equation"] for record in json.loads(json.dumps(records(whole)))] == list(map(str, TITLES))


def test_the_command_prints_what_is_wrong_and_says_so(whole, monkeypatch, capsys):
    monkeypatch.setattr("wfbook.equations.command.atlas", lambda: whole)
    assert main(["equations", "--markdown"]) == 0
    assert capsys.readouterr().out.startswith("# The equations of both papers")
    monkeypatch.setattr("wfbook.equations.command.atlas", lambda: replace(whole, wrong=("eq. A 1: lost",)))
    assert main(["equations"]) == 1
    assert "WRONG: eq. A 1: lost" in capsys.readouterr().out
    assert main(["equations", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["wrong"] == ["eq. A 1: lost"]


@pytest.mark.parametrize("lost", ["A 7", "A 44", "B 1", "B 22"])
def test_an_equation_that_loses_its_function_its_chapter_or_its_tests_is_missed(parts, lost):
    documents, books, tests = parts
    equation = next(equation for equation in TITLES if str(equation) == lost)
    without = [replace(d, claims=tuple(q for q in d.claims if q != equation)) for d in documents]
    assert f"eq. {lost}: no docstring of the library is it" in drawn(without, books, tests).wrong
    unlabelled = [replace(book, covers=book.covers - {equation}) for book in books]
    assert f"eq. {lost}: no chapter writes it down" in drawn(documents, unlabelled, tests).wrong
    untested = replace(tests, tests=tests.tests | {equation: ()})
    assert f"eq. {lost}: no test exercises it" in drawn(documents, books, untested).wrong


def test_an_equation_whose_chapter_is_still_to_be_written_waits_for_it(parts):
    documents, books, tests = parts
    equation = Equation("A", 44)
    before = [book for book in books if book.number < 7]
    waiting = drawn(documents, before, tests).entries[43]
    assert waiting.equation == equation and waiting.coming == 7
    without = [replace(b, covers=b.covers - {equation}, announced=b.announced - {equation}) for b in books]
    assert drawn(documents, without, tests).entries[43].coming is None


@pytest.mark.parametrize(
    ("text", "paper", "found"),
    [
        ("as in Paper A, eq. 12", "B", "A 12"),
        ("eqs 10–12 and 15", "A", "A 10, A 11, A 12, A 15"),
        ("Eqs 13, 14, 16, 17 and more", "A", "A 13, A 14, A 16, A 17"),
        ("Equation 8 and, in Paper B,\n    eqs 4 to 6; then eq. 7", "A", "A 8, B 4, B 5, B 6, B 7"),
        ("eq. 7, 4 legs", "B", "B 7"),
        ("Paper A, section 4", "A", ""),
    ],
)
def test_names_of_equations_are_read(text, paper, found):
    assert ", ".join(str(citation.equation) for citation in citations(text, paper)) == found


def test_only_a_name_with_its_paper_is_a_claim():
    assert [c.full for c in citations("Paper B, eq. 2; eq. 3 (Paper B, after eq. 21)", "B")] == [
        True,
        False,
        False,
    ]


@pytest.mark.parametrize("text", ["eqs. 3", "Eq 3", "eq.3", "eq. (3)", "eqs 3-5", "the paper's eq. 3"])
def test_other_ways_to_write_a_name_are_found(text):
    assert bool(oddly_named(text)) or citations(text, "A") == citations("eq. 3", "A")
    assert oddly_named("Paper A, eqs 3 to 5, and eq. 7") == []


@pytest.mark.parametrize("name", ["Paper A, eq. 45", "Paper B, eq. 23", "Paper A, eq. 0", "eq.12"])
def test_a_docstring_that_names_what_does_not_exist_is_found(tmp_path, name):
    root = library(tmp_path, one=FUNCTION.format(module="Paper A, eq. 1", function=name))
    assert [line for d in documented(root) for line in d.wrong() if line.startswith("wfbook.one.force")]


def test_a_module_that_says_more_than_its_functions_is_found(tmp_path, parts):
    text = FUNCTION.format(module="Paper A, eqs 1 and 2", function="Paper A, eq. 1")
    wrong = drawn(documented(library(tmp_path, one=text)), *parts[1:]).wrong
    (line,) = (line for line in wrong if line.startswith("wfbook.one "))
    assert line.startswith("wfbook.one says that it is eq. A 2, but none of its functions says so")


def test_what_draws_or_asks_does_not_implement(tmp_path, parts):
    text = FUNCTION.format(module="nothing", function="Paper A, eq. 1")
    entry = drawn(documented(library(tmp_path, view=text)), *parts[1:]).entries[0]
    assert not entry.functions and [document.name for document in entry.shown] == ["wfbook.view.force"]


def test_reasons_are_read_with_their_equations(tmp_path):
    text = 'def f():\n    """Do it (Paper A, eqs 1 and 2).\n\n    {}\n    """\n'
    for i, (paragraph, expected) in enumerate(
        {
            "Not as printed: it has\n    two signs.": [(1, "it has two signs."), (2, "it has two signs.")],
            "Not as printed, eq. 2: no.\n\n    Not as printed, eq. 1: nor this.": [
                (2, "no."),
                (1, "nor this."),
            ],
            "It is as printed.": [],
        }.items()
    ):
        (tmp_path / str(i)).mkdir()
        found = documented(library(tmp_path / str(i), one=text.format(paragraph)))[-1].reasons
        assert [(equation.number, reason) for equation, reason in found] == expected


def test_a_chapter_announces_what_it_labels():
    assert chapter().wrong() == []
    assert chapter("Paper A, eqs 1 and 2").wrong() == [
        "01_a_chapter.ipynb announces eq. A 2 but does not label it"
    ]
    assert chapter("Paper A, section I").wrong() == [
        "01_a_chapter.ipynb labels eq. A 1 but does not announce it"
    ]
    assert chapter("Paper A, eq. 1; eqs 2 and 3 at work").wrong() == []
    assert "names eq. A 45" in chapter(item="see eq. 45").wrong()[0]


def test_chapters_and_docstrings_have_to_agree_on_what_is_misprinted(tmp_path, parts):
    claim = "Paper A, eq. 1).\n\n    Not as printed: the sign is wrong. (It is"
    silent, speaking = (
        documented(library(tmp_path / name, one=FUNCTION.format(module="one", function=text)))
        for name, text in (("silent", "Paper A, eq. 1"), ("speaking", claim))
        if (tmp_path / name).mkdir() is None
    )
    alone = "eq. A 1: 01_a_chapter.ipynb says that it is used otherwise, no docstring does"
    unsaid = "eq. A 1: a docstring says that it is used otherwise, no chapter does"
    differs = chapter(item="**Equation 1** has the wrong sign")
    for documents, book, expected in (
        (silent, chapter(), set()),
        (silent, differs, {alone}),
        (speaking, chapter(), {unsaid}),
        (speaking, differs, set()),
    ):
        assert {alone, unsaid} & set(drawn(documents, [book], parts[2]).wrong) == expected


TESTS = {
    "wfbook": '"""A library."""\n',
    "wfbook.one": FUNCTION.format(module="Paper A, eq. 1", function="Paper A, eq. 1"),
    "wfbook.two": "from wfbook.one import force\n\ndef plan():\n    return force()\n",
    "tool": "from wfbook.one import force\n\ndef made():\n    return force()\n",
    "checker": 'def check(plan):\n    """Newton (eq. 1)."""\n',
    "test_a": '''"""Tests."""
import pytest
import tool
import checker
from wfbook import one, two

@pytest.fixture
def given():
    return one.force()

def test_calls(given):
    assert given

def test_names_and_comes_to_it():
    """Eq. 1 by way of the plan."""
    two.plan()

def test_checks():
    checker.check(two.plan())

def test_checks_something_else():
    checker.check(3)

def test_has_it_from_a_tool():
    tool.made()

def test_only_names():
    """Eq. 1, so it says."""
    assert 1 + 1 == 2
''',
}


def test_a_test_calls_or_names_and_comes_to_it(tmp_path):
    documents = documented(library(tmp_path, one=TESTS["wfbook.one"], two=TESTS["wfbook.two"]))
    found = exercised(Graph.of(TESTS), documents)
    names = [witness.name.removeprefix("test_a.test_") for witness in found.tests[Equation("A", 1)]]
    assert names == ["names_and_comes_to_it", "calls", "checks"]
    assert found.wrong == (
        "tests: test_a.test_only_names names eq. A 1 but never comes to what implements it",
    )


def test_a_way_through_classes_is_found_by_the_methods_that_are_asked_for():
    code = """
class Body:
    def __init__(self):
        self.mass = mass()

    def push(self):
        return force()

    def turn(self):
        return torque()

def mass(): ...
def force(): ...
def torque(): ...
def pushed():
    body = Body()
    return body.push()
"""
    reached = Graph.of({"one": code}).reach(["one.pushed"]).nodes
    assert {"one.mass", "one.force", "one.Body.push"} <= reached
    assert not {"one.torque", "one.Body.turn"} & reached


def test_names_are_followed_through_imports():
    graph = Graph.of(
        {
            "wfbook": "",
            "wfbook.planner": "from wfbook.planner.solve import solve\n",
            "wfbook.planner.solve": "def solve(): ...\n",
            "test_b": "import wfbook\nfrom wfbook import planner as p\n\ndef test_one():\n    p.solve()\n"
            "\ndef test_two():\n    wfbook.planner.solve()\n",
        }
    )
    assert graph.resolve("test_b:p.solve") == "wfbook.planner.solve.solve"
    assert graph.resolve("test_b:p.solved") is graph.resolve("test_b:numpy.linalg") is None
    for name in ("one", "two"):
        assert "wfbook.planner.solve.solve" in graph.reach([f"test_b.test_{name}"]).nodes


def test_a_folder_that_is_no_checkout_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="no wfbook in"):
        equations.atlas(tmp_path)
