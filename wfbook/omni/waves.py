"""Chapter 12: paper B's wave-shaped terrain, and how a controller looks up the ground under a wheel.

The paper gives 11.5 m of length and a peak height of 0.2 m. How many waves it has is not given: a parameter,
and five by default, ``0.1 (1 - cos(2 pi x / 2.3))``.
"""

import numpy as np

from wfbook.terrain import Region, Terrain

LENGTH, PEAK, COUNT = 11.5, 0.2, 5
RUN_UP = 1.5
"""Level ground before the first wave and after the last one."""

_HALF_WIDTH = 2.0
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
    """The ground's normals and heights under points, looked up quickly among many regions.

    Args:
        terrain: to look at.
    """

    def __init__(self, terrain: Terrain) -> None:
        self._regions = terrain.regions
        corners = [region.vertices[:, :2] for region in terrain.regions]
        self._low = np.array([c.min(axis=0) for c in corners]) - 1e-9
        self._high = np.array([c.max(axis=0) for c in corners]) + 1e-9

    def under(self, point: np.ndarray) -> tuple[float, np.ndarray]:
        """Return height and unit normal ``(3,)`` of the highest region under a point; level 0 over none."""
        near = np.flatnonzero(((self._low <= point[:2]) & (point[:2] <= self._high)).all(axis=1))
        best, normal = -np.inf, np.array([0.0, 0.0, 1.0])
        for i in near:
            region = self._regions[i]
            height = region.height(point[0], point[1])
            if height > best and region.contains(point[0], point[1], 1e-9):
                best, normal = height, region.normal
        return (0.0, normal) if best == -np.inf else (best, normal)

    def below(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return heights ``(n,)`` and normals ``(n, 3)`` under points ``(n, 3)``."""
        found = [self.under(point) for point in points]
        return np.array([height for height, _ in found]), np.array([normal for _, normal in found])
