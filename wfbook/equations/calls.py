"""Who refers to what: a graph of functions, from Python's source alone.

A function refers to the names that stand in it. Of an attribute of a value nobody knows without running what
it belongs to; it is taken for a method of every class that has one of that name and that is in sight by then.
So the graph has some ways too many and hardly one too few.
"""

import ast
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path


@dataclass(frozen=True)
class Node:
    """A function, a class without its methods, or what a variable of a module is made from.

    Attributes:
        name: dotted, with its module.
        line: where it is defined.
        names: dotted names of functions, imports and variables in it, with its module (``a:b.c``).
        attributes: names of attributes that it asks for, of whatever.
        doc: its docstring.
        texts: its strings, that among them.
        members: of a class, names of its methods and properties.
    """

    name: str
    line: int
    names: frozenset[str]
    attributes: frozenset[str]
    doc: str
    texts: tuple[str, ...]
    members: frozenset[str] = frozenset()


@dataclass
class Module:
    """A file.

    Attributes:
        text: its docstring.
        imports: of names that it imports the module and what they are in it, or nothing for all of it.
        nodes: by name without the module's, as ``Robot.weight``.
    """

    text: str
    imports: dict[str, tuple[str, str]] = field(default_factory=dict)
    nodes: dict[str, Node] = field(default_factory=dict)


@dataclass(frozen=True)
class Graph:
    """The files of some folders, by dotted name.

    Attributes:
        modules: by dotted name; tests have no package, as pytest imports them.
    """

    modules: dict[str, Module]

    @classmethod
    def of(cls, sources: dict[str, str]) -> "Graph":
        """Read files.

        Args:
            sources: text by dotted name of the module.
        """
        return cls({name: _module(name, ast.parse(text)) for name, text in sources.items()})

    @cached_property
    def nodes(self) -> dict[str, Node]:
        """All, by dotted name."""
        return {node.name: node for module in self.modules.values() for node in module.nodes.values()}

    def resolve(self, name: str) -> str | None:
        """Return the node that a name stands for, through imports; None if it is not in these files.

        Args:
            name: with the module in which it stands, as ``test_swing:swing.quintic_basis``.
        """
        module, _, dotted = name.partition(":")
        return self._find(module, dotted.split(".") if dotted else [], 0)

    def _find(self, at: str, parts: list[str], depth: int) -> str | None:
        """Return the node of a dotted name in a module."""
        if at not in self.modules or not parts or depth > 20:
            return None
        module, (name, *rest) = self.modules[at], parts
        if name in module.nodes:
            member = ".".join([name, *rest[:1]])
            return module.nodes[member if member in module.nodes else name].name
        source, original = module.imports.get(name, (at, name))
        if (source, original) != (at, name):  # from its own package a package imports modules
            return self._find(source, [original, *rest] if original else rest, depth + 1)
        return self._find(f"{at}.{name}", rest, depth + 1)

    def reach(self, start: Iterable[str], within: Callable[[str], bool] = lambda _: True) -> "Reached":
        """Return what some nodes lead to, themselves among it.

        Args:
            start: names of nodes.
            within: of a node's name; what is outside is reached, but not left.
        """
        found = Reached(set(), set())
        open_, classes = list(start), set()
        while open_:
            node = self.nodes[open_.pop()]
            if node.name in found.nodes:
                continue
            found.nodes.add(node.name)
            if not within(node.name):
                continue
            targets = {self.resolve(name) for name in node.names} - {None}
            new = node.attributes - found.attributes
            found.attributes.update(new)
            targets |= {f"{owner}.{name}" for owner in classes for name in self.nodes[owner].members & new}
            if node.members:
                classes.add(node.name)
                called = {name for name in node.members if name.startswith("__")} | found.attributes
                targets |= {f"{node.name}.{name}" for name in node.members & called}
            open_ += [target for target in targets if target not in found.nodes]
        return found


@dataclass(frozen=True)
class Reached:
    """What can be got at.

    Attributes:
        nodes: names.
        attributes: that are asked for on the way.
    """

    nodes: set[str]
    attributes: set[str]


def sources(root: Path, package: str = "") -> dict[str, str]:
    """Return the text of all Python files of a folder, by dotted name.

    Args:
        root: the folder.
        package: that it is; without one every file is a module of its own.
    """
    found = {}
    for path in sorted(root.rglob("*.py") if package else root.glob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        parts = (package, *parts) if package else parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text()
    return found


def _module(name: str, tree: ast.Module) -> Module:
    module = Module(ast.get_docstring(tree) or "")
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                first = alias.name.split(".")[0]
                module.imports[alias.asname or first] = (alias.name if alias.asname else first, "")
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                module.imports[alias.asname or alias.name] = (node.module, alias.name)
    defined: dict[str, list[ast.AST]] = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            defined[node.name] = [node]
            module.imports.pop(node.name, None)
        elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                for part in ast.walk(target):
                    if isinstance(part, ast.Name):
                        defined[part.id] = [node]
    for own, (node,) in defined.items():
        if not isinstance(node, ast.ClassDef):
            module.nodes[own] = _node(f"{name}.{own}", node.lineno, [node], name, module, set(defined))
            continue
        methods = {child.name: child for child in node.body if isinstance(child, ast.FunctionDef)}
        rest = [*node.bases, *node.decorator_list, *(c for c in node.body if c not in methods.values())]
        module.nodes[own] = _node(
            f"{name}.{own}", node.lineno, rest, name, module, set(defined), frozenset(methods)
        )
        for method, child in methods.items():
            full = f"{own}.{method}"
            module.nodes[full] = _node(f"{name}.{full}", child.lineno, [child], name, module, set(defined))
    return module


def _node(
    full: str,
    line: int,
    trees: list[ast.AST],
    module_name: str,
    module: Module,
    defined: set[str],
    members: frozenset[str] = frozenset(),
) -> Node:
    names, attributes, texts = set(), set(), []
    for tree in trees:
        for part in ast.walk(tree):
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                texts.append(part.value)
            elif isinstance(part, ast.arg):  # a fixture is asked for by the name of an argument
                names.add(part.arg)
            elif isinstance(part, ast.Name):
                names.add(part.id)
            elif isinstance(part, ast.Attribute):
                attributes.add(part.attr)
                chain, root = [part.attr], part.value
                while isinstance(root, ast.Attribute):
                    chain.append(root.attr)
                    root = root.value
                if isinstance(root, ast.Name):
                    names.add(".".join([root.id, *reversed(chain)]))
    known = defined | module.imports.keys()
    explained = frozenset(f"{module_name}:{name}" for name in names if name.split(".")[0] in known)
    doc = next((ast.get_docstring(tree) for tree in trees if isinstance(tree, ast.FunctionDef)), None)
    return Node(full, line, explained, frozenset(attributes), doc or "", tuple(texts), members)
