"""Controls of one width, so that they stand below each other in columns, with labels that fit."""

from collections.abc import Sequence
from typing import Any

import ipywidgets


def slider(value: float, low: float, high: float, step: float, name: str) -> ipywidgets.FloatSlider:
    """Return a slider that answers when it is let go."""
    return ipywidgets.FloatSlider(
        value=value, min=low, max=high, step=step, description=name, continuous_update=False, **_shape()
    )


def choice(options: Sequence[Any], value: Any, name: str) -> ipywidgets.Dropdown:
    """Return a list to choose from: values, or pairs of a text and a value."""
    return ipywidgets.Dropdown(options=options, value=value, description=name, **_shape())


def _shape() -> dict[str, Any]:
    """Return layout and style; each control needs its own."""
    return {"style": {"description_width": "10em"}, "layout": ipywidgets.Layout(width="26em")}
