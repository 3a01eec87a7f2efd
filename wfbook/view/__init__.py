"""What the book shows: figures, 3D replays and widgets.

The only part of the library that imports matplotlib, Meshcat and ipywidgets; a module loads when it is
first used.
"""

import importlib
from types import ModuleType

__all__ = ["figures", "replay", "style", "widgets"]


def __getattr__(name: str) -> ModuleType:
    """Load a view on first use (PEP 562), so that drawing a figure does not import Meshcat."""
    if name in __all__:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
