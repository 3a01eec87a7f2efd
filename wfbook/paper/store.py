"""What was planned and simulated, kept on disk: an interrupted comparison goes on where it was.

A result is found by a digest of everything that it depends on: its definition (problem, options, seed), the
package's version and the text of its modules, and the versions of the packages that compute. Whoever changes
a weight, or a line of the planner, gets new plans; a line of the controller, new runs of the old plans.
"""

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar

import wfbook
from wfbook.report import plain
from wfbook.terrain import Terrain

T = TypeVar("T")

_PACKAGES = ("clarabel", "cvxpy", "daqp", "mujoco", "numpy", "osqp", "pin", "pyscipopt", "scipy")
_DRIVING = ("crocoddyl",)
"""Likewise, of what drives and plans nothing."""

_PLANNING = (
    *("archive.py", "centroidal.py", "friction.py", "leg_path.py", "modes.py", "planner", "polygon.py"),
    *("swing.py", "terrain.py"),
)
"""What plans depend on: the modules in the order of the chapters up to the planner."""

_TELLING = (
    "__main__.py",
    "arguments.py",
    "book",
    "classroom",
    "omni_command.py",
    "quoted.py",
    "report.py",
    "results.py",
    "paper",
    "study",
    "table2",
    "view",
)
"""Modules and packages that tell, draw or compare, and change no plan and no run."""


class Store:
    """A folder of results, made when the first is kept.

    Attributes:
        folder: where they are.
    """

    def __init__(self, folder: str | os.PathLike, stamp: str | None = None) -> None:
        """Use a folder; ``stamp`` stands for the code that computes, by default :func:`code_stamp`."""
        self.folder = Path(folder)
        self._stamp = stamp

    def path(self, kind: str, definition: dict[str, Any]) -> Path:
        """Return where the result of a definition is kept."""
        stamp = self._stamp or code_stamp(planning=kind in ("plan", "trial"))
        text = json.dumps([stamp, kind, described(definition)], sort_keys=True)
        return self.folder / f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:20]}.npz"

    def get(
        self,
        kind: str,
        definition: dict[str, Any],
        make: Callable[[], T],
        read: Callable[[Path], T],
        write: Callable[[T, Path], None],
    ) -> T:
        """Return what is kept; or make it, and keep it.

        Args:
            kind: of result, part of its file's name.
            definition: everything that it depends on besides the code.
            make: computes it; what it raises is not kept.
            read: reads it from a file. A file that is no such result (ValueError) is made again.
            write: writes it, whole or not at all.
        """
        path = self.path(kind, definition)
        try:
            return read(path)
        except (FileNotFoundError, ValueError):
            result = make()
        self.folder.mkdir(parents=True, exist_ok=True)
        write(result, path)
        return result


def described(value: Any) -> Any:
    """Return a value as JSON types, all the fields of dataclasses in it by name."""
    if isinstance(value, Terrain):
        return value.to_dict()
    if is_dataclass(value):
        return {field.name: described(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {str(key): described(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [described(entry) for entry in value]
    return plain(value)


@cache
def code_stamp(planning: bool) -> str:
    """Return a digest of the code that plans, or plans and simulates: the library, its model, its packages.

    Args:
        planning: leave out what only simulates.
    """
    root = Path(wfbook.__file__).parent
    parts = {path: path.relative_to(root).parts[0] for path in root.rglob("*.py")}
    sources = [
        path for path in parts if (parts[path] in _PLANNING if planning else parts[path] not in _TELLING)
    ]
    sources += (root.parent / "assets").rglob("*.json")
    sources += [] if planning else (root.parent / "assets").rglob("*.xml")
    digest = hashlib.sha256(wfbook.__version__.encode())
    for path in sorted(sources):
        digest.update(str(path.relative_to(root.parent)).encode() + b"\0" + path.read_bytes())
    versions = {name: metadata.version(name) for name in _PACKAGES + (() if planning else _DRIVING)}
    digest.update(json.dumps(versions, sort_keys=True).encode())
    return digest.hexdigest()
