"""Which tests exercise which equations, read from the tests' source.

A test exercises an equation if it

- *calls* a function that is this equation: the test refers to it, or a helper or fixture in its file does; or
- *names* the equation, in its docstring, its own name or any other string, or uses a helper that does, as the
  plan checker; and there is a way from what it refers to, through the library, to a function that is it.

A test whose docstring names an equation and that has no such way is wrong: it never meets what it tests.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from wfbook.equations.calls import Graph, Node
from wfbook.equations.citations import citations
from wfbook.equations.docstrings import Documented, paper_of
from wfbook.equations.titles import TITLES, Equation

PACKAGE = "wfbook"

OF_THE_MAP = "test_equations"
"""The file of the tests of this package: what it names is made up."""


@dataclass(frozen=True, order=True)
class Witness:
    """A test that exercises an equation; the most telling come first.

    Attributes:
        unnamed: whether it does not name the equation itself.
        elsewhere: whether its file is not that of a module that is this equation.
        indirect: whether it does not call a function that is this equation, but only comes to one.
        breadth: how many equations the function is at once, that which is least.
        name: with its module, ``test_friction.test_the_pyramid``.
        line: where it is defined.
    """

    unnamed: bool
    elsewhere: bool
    indirect: bool
    breadth: int
    name: str
    line: int

    @property
    def id(self) -> str:
        """As pytest takes it."""
        module, _, name = self.name.partition(".")
        return f"tests/{module}.py::{name.replace('.', '::')}"


@dataclass(frozen=True)
class Exercised:
    """What the tests exercise.

    Attributes:
        tests: of each equation, in order.
        wrong: what is wrong, one line each.
    """

    tests: dict[Equation, tuple[Witness, ...]]
    wrong: tuple[str, ...]


def exercised(graph: Graph, documents: Iterable[Documented]) -> Exercised:
    """Find the tests of every equation.

    Args:
        graph: of the library and the tests.
        documents: the library's docstrings.
    """
    owners: dict[Equation, dict[str, int]] = {}
    for document in documents:
        for equation in document.claims if document.implements else ():
            owners.setdefault(equation, {})[document.name] = len(document.claims)
    found: dict[Equation, list[Witness]] = {equation: [] for equation in TITLES}
    wrong = []
    for node in sorted(graph.nodes.values(), key=lambda node: node.name):
        module, _, name = node.name.rpartition(".")
        if not module.startswith("test_") or not name.startswith("test_") or module == OF_THE_MAP:
            continue
        direct = graph.reach([node.name], within=lambda name: not name.startswith(PACKAGE))
        words = name.replace("_", " ").replace(" eq ", " eq. ")
        own, claimed = named_by(graph, node, (words, *node.texts)), named_by(graph, node, (node.doc,))
        helpers = [graph.nodes[name] for name in direct.nodes if not name.startswith(PACKAGE)]
        named = own.union(*(named_by(graph, helper, helper.texts) for helper in helpers))
        called = _called(graph, node.name)
        ways = graph.reach([node.name]).nodes if named else set()
        for equation in sorted(named - TITLES.keys()):
            wrong.append(f"tests: {node.name} names eq. {equation}, which does not exist")
        for equation in TITLES:
            implementing = owners.get(equation, {})
            met = implementing.keys() & called
            calls = bool(met)
            if not calls and equation in named:
                met = implementing.keys() & ways
            if met:
                breadth = min(implementing[name] for name in met)
                elsewhere = not any(module.startswith(f"test_{name.split('.')[1]}") for name in met)
                order = (equation not in own, elsewhere, not calls, breadth)
                found[equation].append(Witness(*order, node.name, node.line))
            elif equation in claimed:
                wrong.append(f"tests: {node.name} names eq. {equation} but never comes to what implements it")
    tests = {equation: tuple(sorted(witnesses)) for equation, witnesses in found.items()}
    return Exercised(tests, (*wrong, *_unkept(graph, owners)))


def _unkept(graph: Graph, owners: dict[Equation, dict[str, int]]) -> Iterable[str]:
    """What the docstring of a file of tests names, its tests come to."""
    for file, module in graph.modules.items():
        named = {citation.equation for citation in citations(module.text, paper_of(file))}
        if not file.startswith("test_") or not named:
            continue
        tests = [
            node.name for own, node in module.nodes.items() if own.rpartition(".")[2].startswith("test_")
        ]
        ways = graph.reach(tests).nodes
        for equation in sorted(named):
            if not owners.get(equation, {}).keys() & ways:
                yield f"tests: {file} names eq. {equation} but never comes to what implements it"


def named_by(graph: Graph, node: Node, texts: Iterable[str]) -> set[Equation]:
    """Return the equations that texts of a test or of a helper name."""
    file = node.name.split(".")[0]
    first = citations(graph.modules[file].text, paper_of(file))
    paper = first[0].equation.paper if first else paper_of(file)
    # A backslash is what a regular expression escapes a full stop with.
    return {c.equation for text in texts for c in citations(text.replace("\\", ""), paper)}


def _called(graph: Graph, test: str) -> set[str]:
    """Return the functions of the library that a test refers to; of methods, those of classes in sight."""
    file = test.split(".")[0]
    direct = graph.reach([test], within=lambda name: name.startswith(f"{file}."))
    called = {name for name in direct.nodes if name.startswith(PACKAGE)}
    for name in graph.reach(called).nodes:
        called |= {f"{name}.{part}" for part in graph.nodes[name].members & direct.attributes}
    return called
