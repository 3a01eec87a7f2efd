"""A picture with points that can be dragged, by mouse, by finger or with the arrow keys."""

import base64
from collections.abc import Mapping
from pathlib import Path

import anywidget
import numpy as np
import traitlets
from matplotlib.axes import Axes

from wfbook.view.style import INK, Picture


class Board(anywidget.AnyWidget):
    """A picture with handles on it; where they are is known in the coordinates of its axes.

    The kernel draws, the browser only moves the handles: what is behind them is redrawn when they move.
    A test moves a handle by setting ``points``.

    Args:
        points: by name, where the handles are first, in data coordinates.
        colours: by name, the handles' colours; ink without one.

    Attributes:
        points: by name, ``[x, y]`` of each handle in the data coordinates of the axes last shown. Observe it.
        picture: the picture behind the handles, None before :meth:`show`.
    """

    _esm = Path(__file__).with_name("board.js")
    points = traitlets.Dict().tag(sync=True)
    _colours = traitlets.Dict().tag(sync=True)
    _image = traitlets.Unicode().tag(sync=True)
    _description = traitlets.Unicode().tag(sync=True)
    _size = traitlets.List([1, 1]).tag(sync=True)
    _frame = traitlets.List([0.0, 0.0, 1.0, 1.0]).tag(sync=True)
    """Where data coordinates (0, 0) and (1, 1) are, in pixels from the picture's top left corner."""
    _limits = traitlets.List([0.0, 1.0, 0.0, 1.0]).tag(sync=True)
    """Handles stay inside of the axes: smallest and largest x, smallest and largest y."""

    def __init__(
        self, points: Mapping[str, tuple[float, float]], colours: Mapping[str, str] | None = None
    ) -> None:
        colours = colours or {}
        super().__init__(
            points={name: [float(x), float(y)] for name, (x, y) in points.items()},
            _colours={name: colours.get(name, INK) for name in points},
        )
        self.picture: Picture | None = None

    @traitlets.validate("points")
    def _keep_names(self, proposal: dict) -> dict[str, list[float]]:
        """Refuse points that are not pairs of finite numbers, or other points than those there are."""
        points = proposal["value"]
        if self.points and set(points) != set(self.points):
            raise traitlets.TraitError(f"points: {sorted(points)} instead of {sorted(self.points)}")
        for name, place in points.items():
            if np.shape(place) != (2,) or not np.isfinite(place).all():
                raise traitlets.TraitError(f"points[{name!r}]: {place!r} is not a pair of finite numbers")
        return points

    def move(self, name: str, x: float, y: float) -> None:
        """Move one handle to ``(x, y)``, as a reader does with the mouse."""
        self.points = {**self.points, name: [float(x), float(y)]}

    def show(self, picture: Picture, axes: Axes, description: str) -> None:
        """Put a picture behind the handles.

        Args:
            picture: to be shown.
            axes: of the picture, with linear scales: the handles' coordinates.
            description: alternative text, for readers who can't see the picture.
        """
        data = base64.b64encode(picture.png()).decode("ascii")  # drawing it settles the layout
        width, height = picture.get_size_inches() * 96
        corners = axes.transData.transform([(0.0, 0.0), (1.0, 1.0)]) * 96 / picture.dpi
        (x0, y0), (x1, y1) = [(float(x), float(height - y)) for x, y in corners]
        self.picture = picture
        with self.hold_sync():
            self._size = [round(width), round(height)]
            self._frame = [x0, y0, x1, y1]
            self._limits = [*map(float, sorted(axes.get_xlim())), *map(float, sorted(axes.get_ylim()))]
            self._description = description
            self._image = f"data:image/png;base64,{data}"
