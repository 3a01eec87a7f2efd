"""Chapter 12: paper B's wave-shaped terrain, and how a controller looks up the ground under a wheel.

The paper gives 11.5 m of length and a peak height of 0.2 m. How many waves it has is not given: a parameter,
and five by default, ``0.1 (1 - cos(2 pi x / 2.3))``.
"""

import numpy as np

from wfbook.omni.robot import WHEEL_HALF_WIDTH, WHEEL_RADIUS
from wfbook.terrain import Region, Terrain

LENGTH, PEAK, COUNT = 11.5, 0.2, 5
RUN_UP = 1.5
"""Level ground before the first wave and after the last one."""

_HALF_WIDTH = 2.0
_CELL, _MOST_CELLS = 0.1, 1e5
"""Of the grid that regions are looked up in: width, m, unless there would be too many."""
_TREAD = WHEEL_RADIUS * np.linspace(-0.9, 0.9, 11)
"""Where a wheel's lower half is looked at, ahead of its middle."""

_SURFACE = {"mu_foot": 0.7, "mu_wheel": 0.0, "mu_wheel_lateral": 0.7, "rolling_resistance": 0.0}


def wave_height(x: np.ndarray | float, count: int = COUNT, peak: float = PEAK) -> np.ndarray:
    """Return the height of the waves at x, zero before and after them."""
    x = np.asarray(x, dtype=float)
    height = 0.5 * peak * (1.0 - np.cos(2.0 * np.pi * count * x / LENGTH))
    return np.where((x > 0.0) & (x < LENGTH), height, 0.0)


def waves(count: int = COUNT, peak: float = PEAK, strips: int = 48) -> Terrain:
    """Return waves along x from 0 to 11.5 m, between level ground, 4 m wide.

    Args:
        count: of waves.
        peak: height of the crests.
        strips: planar regions in a wave.

    Raises:
        ValueError: no wave, or too few strips to show one.
    """
    if count < 1 or strips < 8:
        raise ValueError(f"waves: count {count} and strips {strips} must be at least 1 and 8")
    x = np.linspace(0.0, LENGTH, count * strips + 1)
    z = wave_height(x, count, peak)
    x, z = np.concatenate([[-RUN_UP], x, [LENGTH + RUN_UP]]), np.concatenate([[0.0], z, [0.0]])
    regions = []
    for x0, z0, x1, z1 in zip(x[:-1], z[:-1], x[1:], z[1:], strict=True):
        corners = [
            [x0, -_HALF_WIDTH, z0],
            [x1, -_HALF_WIDTH, z1],
            [x1, _HALF_WIDTH, z1],
            [x0, _HALF_WIDTH, z0],
        ]
        regions.append(Region(corners, **_SURFACE, group="waves"))
    return Terrain(f"{count} waves", tuple(regions))


class Ground:
    """The ground's heights and normals, looked up for many points at once among many regions.

    Args:
        terrain: to look at.
    """

    def __init__(self, terrain: Terrain) -> None:
        regions = terrain.regions
        edges = max(len(region.vertices) for region in regions)
        self._normals = np.array([region.normal for region in regions])
        # Height is planes @ (x, y, 1). Inside is a x + b y <= c in all rows; what a region lacks holds.
        slopes = -self._normals[:, :2] / self._normals[:, 2:]
        self._planes = np.vstack([slopes.T, [region.height(0.0, 0.0) for region in regions]])
        self._rows = np.zeros((edges, 3, len(regions)))
        self._rows[:, 2] = 1.0
        for i, region in enumerate(regions):
            A, b = region.halfspaces
            self._rows[: len(b), :, i] = np.column_stack([A, b + 1e-9])
        self._index(np.array([[f(r.vertices[:, :2], axis=0) for f in (np.min, np.max)] for r in regions]))

    def _index(self, boxes: np.ndarray) -> None:
        """Note for each cell of a grid which regions' boxes ``(n, 2, 2)`` meet it."""
        self._low = boxes[:, 0].min(axis=0) - 1e-9
        size = boxes[:, 1].max(axis=0) + 1e-9 - self._low
        self._cell = max(_CELL, float(np.sqrt(size.prod() / _MOST_CELLS)))
        self._shape = np.maximum(1, np.ceil(size / self._cell).astype(int))
        margin = np.array([[-1e-9], [1e-9]])
        spans = ((boxes + margin - self._low) // self._cell).astype(int)
        lists: list[list[int]] = [[] for _ in range(self._shape.prod())]
        for i, ((x0, y0), (x1, y1)) in enumerate(np.clip(spans, 0, self._shape - 1)):
            for x in range(x0, x1 + 1):
                for cell in range(x * self._shape[1] + y0, x * self._shape[1] + y1 + 1):
                    lists[cell].append(i)
        # One column more than any cell needs: the last one of every row is empty.
        self._regions = np.full((len(lists) + 1, max(map(len, lists))), -1)
        for row, found in zip(self._regions, lists, strict=False):
            row[: len(found)] = found

    def below(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return heights ``(n,)`` and unit normals ``(n, 3)`` of the highest regions below points.

        Where there is no region the ground is level at height 0.

        Args:
            points: ``(n, 2)`` or ``(n, 3)``, x and y first.
        """
        points = np.asarray(points, dtype=float)[:, :2]
        cells = (points - self._low) // self._cell
        inside = ((cells >= 0) & (cells < self._shape)).all(axis=1)
        rows = np.where(inside, cells @ [self._shape[1], 1], -1).astype(int)
        near = self._regions[rows]
        x, y, over = points[:, :1], points[:, 1:], near >= 0
        for a, b, c in self._rows:
            over &= a.take(near) * x + b.take(near) * y <= c.take(near)
        a, b, c = self._planes
        heights = np.where(over, a.take(near) * x + b.take(near) * y + c.take(near), -np.inf)
        best = heights.argmax(axis=1)
        each = np.arange(len(points))
        found = over[each, best]
        return (
            np.where(found, heights[each, best], 0.0),
            np.where(found[:, None], self._normals[near[each, best]], [0.0, 0.0, 1.0]),
        )

    def ride(self, places: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how wheels stand on the ground: heights ``(n,)`` of their middles, normals ``(n, 3)``.

        A wheel is an upright disc that rests where it touches first. That is not below its middle: on a slope
        it is uphill of it, in a hollow it may be on both sides. And an edge does not jump under a wheel as it
        does under a point. The normal is that of the disc where it touches.

        Args:
            places: ``(n, 2)`` x and y of the wheels' middles.
            along: ``(n, 2)`` unit vectors of the directions in which they roll.
        """
        across = np.column_stack([-along[:, 1], along[:, 0]])
        samples = places[:, None] + _TREAD[:, None] * along[:, None]
        heights = self.below(samples.reshape(-1, 2))[0].reshape(len(places), -1)
        clear = heights + np.sqrt(WHEEL_RADIUS**2 - _TREAD**2)
        # The top of the parabola through the highest sample and its neighbours, if it has both.
        best, each = clear.argmax(axis=1), np.arange(len(places))
        before, at, after = (clear[each, np.clip(best + i, 0, len(_TREAD) - 1)] for i in (-1, 0, 1))
        shift = np.where(
            (before < at) & (after < at), 0.5 * (before - after) / (before - 2 * at + after), 0.0
        )
        ahead = np.interp(best + shift, np.arange(len(_TREAD)), _TREAD)
        middles = at + 0.25 * (after - before) * shift
        touch = places + ahead[:, None] * along
        sides = [self.below(touch + side * across)[0] for side in (-WHEEL_HALF_WIDTH, WHEEL_HALF_WIDTH)]
        rise = ahead / np.sqrt(WHEEL_RADIUS**2 - ahead**2)
        tilt = (sides[1] - sides[0]) / (2.0 * WHEEL_HALF_WIDTH)
        level = rise[:, None] * along + tilt[:, None] * across
        normals = np.column_stack([-level, np.ones(len(places))])
        return middles, normals / np.linalg.norm(normals, axis=1, keepdims=True)
