"""The library reads in chapter order, and importing it is quick because it imports nothing heavy."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import wfbook

ROOT = Path(wfbook.__file__).parent
ORDER = (
    "archive", "polygon", "terrain", "centroidal", "swing", "modes", "leg_path", "friction", "planner",
    "go1", "go1_dynamics", "standing", "reference", "qp", "wbc", "stance", "kalman", "sensors",
    "leg_odometry", "estimator", "recording", "ideal", "flights", "footing", "lean", "drift", "tracking",
    "runs", "simulate", "forecast", "receding", "omni", "view", "report", "results", "arguments", "quoted",
    "omni_command", "table2", "study", "paper", "equations", "book", "exercises", "classroom", "__main__",
)  # fmt: skip
"""The modules and packages, helpers before the chapter that they serve."""

DRAWING = {"anywidget", "matplotlib", "meshcat", "ipywidgets"}


def files_of(name: str) -> list[Path]:
    """The files of a module or package."""
    return sorted((ROOT / name).glob("*.py")) or [ROOT / f"{name}.py"]


def imports(path: Path) -> set[str]:
    """The dotted names that a file imports at run time, wherever in it."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            node.body = []
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def test_every_module_has_its_place():
    found = {p.stem for p in ROOT.glob("*.py")} | {p.parent.name for p in ROOT.glob("*/__init__.py")}
    assert found - {"__init__"} == set(ORDER)


@pytest.mark.parametrize("name", ORDER)
def test_a_module_imports_only_what_stands_above_it(name):
    above = set(ORDER[: ORDER.index(name) + 1])
    for path in files_of(name):
        used = {dotted.split(".")[1] for dotted in imports(path) if dotted.startswith("wfbook.")}
        assert used <= above, f"{path.name} imports {sorted(used - above)}"


@pytest.mark.parametrize("name", [n for n in ORDER if n != "view"])
def test_only_view_draws(name):
    for path in files_of(name):
        assert not {dotted.split(".")[0] for dotted in imports(path)} & DRAWING


def test_importing_the_package_imports_nothing_heavy():
    script = "import sys, wfbook; print(*sorted({m.split('.')[0] for m in sys.modules}))"
    loaded = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout.split()
    heavy = {"cvxpy", "dask", "distributed", "mujoco", "pinocchio", "pyarrow", "pyscipopt", "scipy"}
    assert not (heavy | DRAWING) & set(loaded)
