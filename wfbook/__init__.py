"""How wheeled-legged robots decide and move: the library behind the book.

The modules read in the order of the chapters. ``import wfbook`` is quick: a module, and the heavy
packages under it (cvxpy, MuJoCo, Pinocchio), load when they are first used.
"""

import importlib
from types import ModuleType

__version__ = "0.1.0"

_CHAPTERS = (
    "terrain",
    "centroidal",
    "swing",
    "modes",
    "friction",
    "planner",
    "go1",
    "wbc",
    "sensors",
    "estimator",
    "simulate",
    "view",
)

__all__ = ["__version__", *_CHAPTERS]


def __getattr__(name: str) -> ModuleType:
    """Load a chapter's module on first use (PEP 562)."""
    if name in _CHAPTERS:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the chapters besides the ordinary attributes."""
    return sorted([*globals(), *_CHAPTERS])
