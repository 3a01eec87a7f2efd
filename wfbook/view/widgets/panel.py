"""What all widgets share: controls in a row, a line for messages, and pictures that follow the controls."""

import base64
import html
from collections.abc import Sequence

import ipywidgets

from wfbook.view.style import Picture

PANEL = "wfbook-panel"
"""CSS class of a widget with controls and pictures that follow them; the browser test looks for it."""


def image(picture: Picture, description: str) -> str:
    """Return a picture as an HTML element that needs no file; ``description`` is read to who can't see it."""
    data = base64.b64encode(picture.png()).decode("ascii")
    width = round(96 * picture.get_size_inches()[0])
    return (
        f'<img src="data:image/png;base64,{data}" alt="{html.escape(description)}" '
        f'style="width:{width}px;max-width:100%">'
    )


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return an HTML table of texts, which are escaped."""
    cell = '<td style="padding:2px 12px 2px 0;text-align:left">'
    lines = [
        f"<tr>{''.join(cell + html.escape(text) + '</td>' for text in row)}</tr>" for row in (columns, *rows)
    ]
    return f"<table>{''.join(lines)}</table>"


class Panel(ipywidgets.VBox):
    """Controls over pictures that follow them.

    A subclass makes its controls, calls this constructor with them and with the names of its pictures, and
    says in :meth:`redraw` what they look like now. Every change of a control's ``value`` redraws. On a page a
    panel has the CSS class ``wfbook-panel``.

    Args:
        controls: laid out from left to right, wrapped where the page is narrow.
        pictures: names of the pictures, from top to bottom.

    Attributes:
        status: one line above the pictures: numbers, hints, or what went wrong.
        views: by name, the widgets that hold the pictures.
        pictures: by name, the pictures that are shown now; tests read what was drawn from their axes.
    """

    def __init__(self, controls: Sequence[ipywidgets.Widget], pictures: Sequence[str]) -> None:
        self.status = ipywidgets.HTML()
        self.views = {name: ipywidgets.HTML() for name in pictures}
        self.pictures: dict[str, Picture] = {}
        row = ipywidgets.HBox(list(controls), layout=ipywidgets.Layout(flex_flow="row wrap"))
        super().__init__([row, self.status, *self.views.values()])
        self.add_class(PANEL)
        self.watch(*controls)
        self._follow()

    def watch(self, *controls: ipywidgets.Widget) -> None:
        """Redraw whenever the ``value`` of one of these controls changes."""
        for control in controls:
            if control.has_trait("value"):
                control.observe(self._follow, names="value")

    def redraw(self) -> None:
        """Draw everything for the controls' present values."""
        raise NotImplementedError

    def show(self, name: str, picture: Picture, description: str) -> None:
        """Put a picture in the place of that name; ``description`` is its alternative text."""
        self.pictures[name] = picture
        self.views[name].value = image(picture, description)

    def say(self, text: str) -> None:
        """Write a line of plain text above the pictures."""
        self.status.value = html.escape(text)

    def warn(self, text: str) -> None:
        """Write a line that something is wrong, and take the pictures of something else away."""
        self.status.value = f'<b role="alert">{html.escape(text)}</b>'
        for view in self.views.values():
            view.value = ""
        self.pictures.clear()

    def _follow(self, _change: object = None) -> None:
        try:
            self.redraw()
        except Exception as error:
            # A widget's errors go to a log that few readers open.
            self.warn(f"{type(error).__name__}: {error}")
            raise
