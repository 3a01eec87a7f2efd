"""A widget's last state as HTML that needs neither a kernel nor a script.

Without a kernel a slider may be moved, but nothing answers. So a page of the book shows what the widget
showed last: its controls with their values, and the pictures that belong to them.
"""

import html
import math
from collections.abc import Callable, Mapping
from typing import Any

import nbformat

VIEW = "application/vnd.jupyter.widget-view+json"
STATE = "application/vnd.jupyter.widget-state+json"
_REFERENCE = "IPY_MODEL_"
_BOARD = "wfbook.view.widgets.board.Board"
_NOTE = '<p class="wfbook-note">A still. In the notebook its controls move.</p>'

_KEPT = (
    *("align_items", "display", "flex", "flex_flow", "grid_gap", "grid_template_columns", "justify_content"),
    *("height", "margin", "overflow", "padding", "width"),
)
"""What of a widget's layout holds on a page, too."""


def still(notebook: nbformat.NotebookNode) -> None:
    """Replace the widgets in a notebook's outputs, in place, and drop their state.

    Args:
        notebook: executed, with the widgets' state in its metadata.

    Raises:
        ValueError: a widget's state is missing, or there is no way to show a widget of its kind.
    """
    models = notebook.metadata.pop("widgets", {}).get(STATE, {}).get("state", {})
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            view = output.get("data", {}).get(VIEW)
            if view is not None:
                page = f'<div class="wfbook-still">{_NOTE}{drawn(models, view["model_id"])}</div>'
                output.data = nbformat.from_dict({"text/html": page})


def drawn(models: Mapping[str, Any], name: str) -> str:
    """Return a widget as HTML, with all that it holds.

    Args:
        models: state by the models' names, as a notebook's metadata has it.
        name: of the widget's model.

    Raises:
        ValueError: the state is missing, or there is no way to show a widget of this kind.
    """
    name = name.removeprefix(_REFERENCE)
    if name not in models:
        raise ValueError(f"no state of the widget {name!r}")
    model = models[name]["model_name"]
    state = models[name]["state"]
    if model in _HOLDERS:
        inside = "".join(drawn(models, child) for child in state["children"])
        return f"<div {_looks(models, state, _HOLDERS[model])}>{inside}</div>"
    if model == "AnyModel" and state["_anywidget_id"] == _BOARD:
        return _board(state)
    if model not in _DRAWN:
        raise ValueError(f"no still of a widget of kind {state.get('_anywidget_id', model)!r}")
    return _DRAWN[model](state, _looks(models, state, f"wfbook-{_words(model)}"))


def _looks(models: Mapping[str, Any], state: Mapping[str, Any], kind: str) -> str:
    """Return the attributes class and style."""
    layout = models[state["layout"].removeprefix(_REFERENCE)]["state"]
    style = ";".join(f"{key.replace('_', '-')}:{layout[key]}" for key in _KEPT if layout.get(key) is not None)
    classes = " ".join([kind, *state["_dom_classes"]])
    return f'class="{html.escape(classes)}" style="{html.escape(style)}"'


def _control(looks: str, name: str, *parts: str) -> str:
    label = f'<span class="wfbook-name">{html.escape(name)}</span>'
    return f"<div {looks}>{label if name else ''}{''.join(parts)}</div>"


def _slider(state: Mapping[str, Any], looks: str, at: float, text: str) -> str:
    track = f'<span class="wfbook-track"><i style="left:{100 * min(max(at, 0.0), 1.0):.1f}%"></i></span>'
    return _control(looks, state["description"], track, _value(text))


def _value(text: str) -> str:
    return f'<span class="wfbook-value">{html.escape(text)}</span>'


def _linear(state: Mapping[str, Any], looks: str) -> str:
    low, high, value = state["min"], state["max"], state["value"]
    return _slider(state, looks, (value - low) / (high - low), format(value, state["readout_format"]))


def _logarithmic(state: Mapping[str, Any], looks: str) -> str:
    low, high, exponent = state["min"], state["max"], math.log(state["value"], state["base"])
    at = (exponent - low) / (high - low)
    return _slider(state, looks, at, format(state["value"], state["readout_format"]))


def _steps(state: Mapping[str, Any], looks: str) -> str:
    labels, index = state["_options_labels"], state["index"]
    return _slider(state, looks, index / max(len(labels) - 1, 1), labels[index])


def _dropdown(state: Mapping[str, Any], looks: str) -> str:
    chosen = "" if state["index"] is None else state["_options_labels"][state["index"]]
    return _control(looks, state["description"], _value(f"{chosen} ▾"))


def _buttons(state: Mapping[str, Any], looks: str) -> str:
    parts = []
    for index, text in enumerate(state["_options_labels"]):
        chosen = " mod-active" if index == state["index"] else ""
        parts.append(f'<span class="wfbook-choice{chosen}">{html.escape(text)}</span>')
    return _control(looks, state["description"], *parts)


def _checkbox(state: Mapping[str, Any], looks: str) -> str:
    mark, text = "checked" if state["value"] else "", html.escape(state["description"])
    return (
        f'<div {looks}><input type="checkbox" disabled {mark} aria-label="{text}"><span>{text}</span></div>'
    )


def _toggle(state: Mapping[str, Any], looks: str) -> str:
    if state["value"]:
        looks = looks.replace('class="', 'class="mod-active ', 1)
    text = state["description"] or ("1" if state["value"] else "")
    return f"<div {looks}>{html.escape(text)}</div>"


def _button(state: Mapping[str, Any], looks: str) -> str:
    return f"<div {looks}>{html.escape(state['description'])}</div>"


def _label(state: Mapping[str, Any], looks: str) -> str:
    return f"<div {looks}>{html.escape(state['value'])}</div>"


def _html(state: Mapping[str, Any], looks: str) -> str:
    return f"<div {looks}>{state['value']}</div>" if state["value"] else ""


def _board(state: Mapping[str, Any]) -> str:
    """Return a board's picture with its handles, as ``board.js`` draws them."""
    (width, height), (x0, y0, x1, y1) = state["_size"], state["_frame"]
    colours, parts = state["_colours"], []
    places = {name: (x0 + x * (x1 - x0), y0 + y * (y1 - y0)) for name, (x, y) in state["points"].items()}
    for name, carrier in state["_carriers"].items():
        (ax, ay), (bx, by) = places[carrier], places[name]
        parts.append(
            f'<line x1="{ax:.1f}" y1="{ay:.1f}" x2="{bx:.1f}" y2="{by:.1f}" stroke="{colours[name]}" '
            'stroke-width="2.5"/>'
        )
    for name, (x, y) in places.items():
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="9" fill="{colours[name]}" fill-opacity="0.75" '
            f'stroke="white" stroke-width="2"><title>{html.escape(name)}</title></circle>'
        )
    return (
        f'<div class="wfbook-board" style="width:{width}px">'
        f'<img src="{state["_image"]}" alt="{html.escape(state["_description"])}">'
        f'<svg viewBox="0 0 {width} {height}">{"".join(parts)}</svg></div>'
    )


def _words(model: str) -> str:
    return model.removesuffix("Model").lower()


_HOLDERS = {"BoxModel": "wfbook-row", "HBoxModel": "wfbook-row", "VBoxModel": "wfbook-column",
            "GridBoxModel": "wfbook-grid"}  # fmt: skip
"""Widgets that hold others: CSS class by model."""

_DRAWN: dict[str, Callable[[Mapping[str, Any], str], str]] = {
    "ButtonModel": _button,
    "CheckboxModel": _checkbox,
    "DropdownModel": _dropdown,
    "FloatLogSliderModel": _logarithmic,
    "FloatSliderModel": _linear,
    "HTMLModel": _html,
    "IntSliderModel": _linear,
    "LabelModel": _label,
    "SelectionSliderModel": _steps,
    "ToggleButtonModel": _toggle,
    "ToggleButtonsModel": _buttons,
}
"""What draws a widget from its state and its attributes, by model."""
