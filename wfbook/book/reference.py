"""Sources of the library's reference: a page for each module, in the order of the chapters."""

import ast
from collections.abc import Iterator
from pathlib import Path

import wfbook

ROOT = Path(wfbook.__file__).resolve().parent

GROUPS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Ground", ("polygon", "terrain")),
    ("Chapter 1: forces and torques", ("centroidal",)),
    ("Chapter 2: swings", ("swing",)),
    ("Chapter 3: the swing matrix and the dynamics matrix", ("modes", "leg_path")),
    ("Chapter 4: friction", ("friction", "standing")),
    ("Chapter 5: planning", ("planner", "archive")),
    ("The robot of part I", ("go1", "go1_dynamics")),
    ("Chapter 6: whole-body control", ("reference", "qp", "wbc", "stance")),
    ("Chapter 7: state estimation", ("kalman", "sensors", "leg_odometry", "estimator", "recording", "ideal")),
    ("Chapter 8: execution", ("flights", "footing", "lean", "drift", "tracking", "runs", "simulate")),
    ("Chapter 8: planning on the way", ("forecast", "receding")),
    ("Part II: steered wheels and an arm", ("omni",)),
    ("Pictures, replays and widgets", ("view",)),
    ("Checks of the exercises", ("exercises",)),
    ("The papers' numbers", ("quoted", "paper", "table2", "study")),
)
"""Headings of the reference, and the modules and packages under them."""

_REST = "The command line, and what serves it"
_UNSEEN = {"wfbook.__init__", "wfbook.__main__", "wfbook.book.conf"}


def groups() -> list[tuple[str, list[str]]]:
    """Return headings and the modules under each; those that no chapter claims come last."""
    found = [(title, [name for package in names for name in modules(package)]) for title, names in GROUPS]
    claimed = {name for _, names in found for name in names} | _UNSEEN
    tops = sorted({path.relative_to(ROOT).with_suffix("").parts[0] for path in ROOT.rglob("*.py")})
    rest = [name for top in tops for name in modules(top) if name not in claimed]
    return [*found, (_REST, rest)]


def modules(name: str) -> list[str]:
    """Return the dotted names of a module, or of a package and all modules in it.

    Args:
        name: under ``wfbook``.
    """
    if (ROOT / f"{name}.py").exists():
        return [f"wfbook.{name}"]
    found = []
    for path in sorted(
        (ROOT / name).rglob("*.py"), key=lambda path: (path.parent, path.name != "__init__.py")
    ):
        parts = path.relative_to(ROOT.parent).with_suffix("").parts
        found.append(".".join(parts[:-1] if parts[-1] == "__init__" else parts))
    return [module for module in found if module not in _UNSEEN]


def write(folder: Path) -> None:
    """Write the reference's sources.

    Args:
        folder: where; it must exist.
    """
    for name in (name for _, names in groups() for name in names):
        (folder / f"{name}.rst").write_text("\n".join(_page(name)) + "\n", encoding="utf-8")
    (folder / "index.rst").write_text("\n".join(_index()) + "\n", encoding="utf-8")


def _index() -> Iterator[str]:
    yield from _heading("Library reference", "=")
    yield "The library reads in the order of the chapters, and so does this list: a module uses only what"
    yield "stands above it. ``import wfbook`` is quick; a module loads what it needs when it is first used."
    yield ""
    for title, names in groups():
        yield from _heading(title, "-")
        yield ".. list-table::"
        yield "   :widths: 35 65"
        yield "   :class: wfbook-modules"
        yield ""
        for name in names:
            yield f"   * - :mod:`{name}`"
            yield f"     - {_first_line(name)}"
        yield ""


def _page(name: str) -> Iterator[str]:
    # Two hundred entries more in the navigation of every page would hide the chapters.
    yield ":orphan:"
    yield ""
    yield from _heading(name, "=")
    yield ":doc:`Library reference <index>`"
    yield ""
    yield f".. automodule:: {name}"
    passed_on = _passed_on(name)
    if _path(name).name == "__init__.py":
        yield "   :no-members:"
        yield ""
        for name_in_all, module in passed_on:
            yield f"- :obj:`{name_in_all} <{module}.{name_in_all}>` of :mod:`{module}`"
    yield ""


def _passed_on(name: str) -> list[tuple[str, str]]:
    """Return what a package passes on from its modules, as it imports it: name and module."""
    tree = ast.parse(_path(name).read_text(encoding="utf-8"))
    return [
        (alias.name, node.module)
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith(f"{name}.")
        for alias in node.names
    ]


def _path(name: str) -> Path:
    """Return the file of a module."""
    path = ROOT.parent.joinpath(*name.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _first_line(name: str) -> str:
    """Return what a module says of itself in its first line."""
    doc = ast.get_docstring(ast.parse(_path(name).read_text(encoding="utf-8"))) or ""
    return " ".join(doc.split("\n\n")[0].split())


def _heading(text: str, line: str) -> Iterator[str]:
    yield text
    yield line * len(text)
    yield ""
