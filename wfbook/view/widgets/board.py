"""A picture with points that can be dragged, by mouse, by finger or with the arrow keys."""

import base64
from collections.abc import Mapping
from pathlib import Path

import anywidget
import numpy as np
import traitlets
from matplotlib.axes import Axes

from wfbook.view.style import INK, Picture

Limits = tuple[float, float, float, float]
"""Smallest and largest x, smallest and largest y."""


class Board(anywidget.AnyWidget):
    """A picture with handles on it; where they are is known in the coordinates of its axes.

    The kernel draws, the browser only moves the handles: what is behind them is redrawn when they move.
    A test moves a handle with :meth:`move` or by setting ``points``.

    Args:
        points: by name, where the handles are first, in data coordinates.
        colours: by name, the handles' colours; ink without one.
        limits: by name, where a handle may be; anywhere in the axes without one. Equal limits along y make
            it slide along x only.
        carriers: by name of a handle, the name of the one that carries it: when that moves, it moves along.
            A line joins the two.

    Attributes:
        points: by name, ``[x, y]`` of each handle in the data coordinates of the axes last shown. Observe it.
        picture: the picture behind the handles, None before :meth:`show`.

    Raises:
        ValueError: colours, limits or carriers name a handle that there is none of.
    """

    _esm = Path(__file__).with_name("board.js")
    points = traitlets.Dict().tag(sync=True)
    _colours = traitlets.Dict().tag(sync=True)
    _bounds = traitlets.Dict().tag(sync=True)
    _carriers = traitlets.Dict().tag(sync=True)
    _image = traitlets.Unicode().tag(sync=True)
    _description = traitlets.Unicode().tag(sync=True)
    _size = traitlets.List([1, 1]).tag(sync=True)
    _frame = traitlets.List([0.0, 0.0, 1.0, 1.0]).tag(sync=True)
    """Where data coordinates (0, 0) and (1, 1) are, in pixels from the picture's top left corner."""
    _limits = traitlets.List([0.0, 1.0, 0.0, 1.0]).tag(sync=True)
    """Handles stay inside of the axes: smallest and largest x, smallest and largest y."""

    def __init__(
        self,
        points: Mapping[str, tuple[float, float]],
        colours: Mapping[str, str] | None = None,
        limits: Mapping[str, Limits] | None = None,
        carriers: Mapping[str, str] | None = None,
    ) -> None:
        colours, limits, carriers = colours or {}, limits or {}, carriers or {}
        for name in {*colours, *limits, *carriers, *carriers.values()} - set(points):
            raise ValueError(f"points: there is no handle {name!r}, only {sorted(points)}")
        super().__init__(
            points={name: [float(x), float(y)] for name, (x, y) in points.items()},
            _colours={name: colours.get(name, INK) for name in points},
            _bounds={name: [float(limit) for limit in box] for name, box in limits.items()},
            _carriers=dict(carriers),
        )
        self.picture: Picture | None = None
        self._layout: tuple[object, list] | None = None

    @traitlets.validate("points")
    def _keep_names(self, proposal: dict) -> dict[str, list[float]]:
        """Refuse points that are not pairs of finite numbers, or other points than those there are.

        A place beyond a handle's own limits is moved to the nearest within.
        """
        points = proposal["value"]
        if self.points and set(points) != set(self.points):
            raise traitlets.TraitError(f"points: {sorted(points)} instead of {sorted(self.points)}")
        kept = {}
        for name, place in points.items():
            if np.shape(place) != (2,) or not np.isfinite(place).all():
                raise traitlets.TraitError(f"points[{name!r}]: {place!r} is not a pair of finite numbers")
            kept[name] = self._within(name, *place)
        return kept

    def _within(self, name: str, x: float, y: float) -> list[float]:
        left, right, low, high = self._bounds.get(name, (-np.inf, np.inf, -np.inf, np.inf))
        return [float(min(max(x, left), right)), float(min(max(y, low), high))]

    def move(self, name: str, x: float, y: float) -> None:
        """Move one handle to ``(x, y)`` and those that it carries, as a reader does with the mouse."""
        place = self._within(name, x, y)
        step = np.subtract(place, self.points[name])
        along = {
            carried: np.add(self.points[carried], step).tolist()
            for carried, carrier in self._carriers.items()
            if carrier == name
        }
        self.points = {**self.points, name: place, **along}

    def paint(self, **colours: str) -> None:
        """Give handles other colours, by name; with spaces in it, ``paint(**{"front foot": SWING})``."""
        for name in set(colours) - set(self.points):
            raise ValueError(f"points: there is no handle {name!r}, only {sorted(self.points)}")
        self._colours = {**self._colours, **colours}

    def show(self, picture: Picture, axes: Axes, description: str) -> None:
        """Put a picture behind the handles.

        The first picture's layout is kept for those that follow and have as many axes and the same size: a
        picture whose axes shift can't be dragged in, and finding a layout takes as long as drawing.
        Give all its axes limits that do not depend on the handles.

        Args:
            picture: to be shown.
            axes: of the picture, with linear scales: the handles' coordinates.
            description: alternative text, for readers who can't see the picture.
        """
        kind = (len(picture.axes), *picture.get_size_inches())
        if self._layout is not None and self._layout[0] == kind:
            picture.set_layout_engine(None)  # "none" keeps a placeholder, for which matplotlib draws twice
            for each, place in zip(picture.axes, self._layout[1], strict=True):
                each.set_position(place)
        data = base64.b64encode(picture.png()).decode("ascii")  # drawing it settles the layout
        self._layout = kind, [each.get_position(original=True).frozen() for each in picture.axes]
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
