"""What the planner knows of the ground: planes, groups, kinds of friction, and who can reach what when.

The dynamics matrix chooses a region for every contact. What a region means for motion and force is its
plane, its friction and its group; regions that share one of these are counted once.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wfbook.planner.bounds import MotionBounds
from wfbook.terrain import Region, Terrain

_SAME = 1e-9


@dataclass(frozen=True)
class Surface:
    """Regions on which a contact force obeys the same inequalities (Paper A, eqs 26–29).

    Attributes:
        regions: indices of the regions.
        basis: ``(3, 3)`` rows n, t, b.
        friction: by end effector, coefficients along t and b.
        rolling_resistance: of wheels.
    """

    regions: tuple[int, ...]
    basis: np.ndarray
    friction: dict[str, tuple[float, float]]
    rolling_resistance: float

    @property
    def level(self) -> bool:
        """Whether n points straight up, so that t and b are the world's x and y."""
        return bool(self.basis[0, 2] > 1.0 - _SAME)


@dataclass(frozen=True)
class GroundMap:
    """A terrain as the mixed-integer program sees it.

    Attributes:
        regions: of the terrain.
        groups: indices of the regions of each group (eq. 23); wheels roll within one.
        group_of: ``(R,)`` the group of each region.
        surfaces: kinds of contact force.
        planes: ``(R, 3)`` rows ``(a_x, a_y, c)``: height is ``a_x x + a_y y + c``.
        order: ``(R,)`` region indices from back to front, the order in which a search splits them.
    """

    regions: tuple[Region, ...]
    groups: tuple[tuple[int, ...], ...]
    group_of: np.ndarray
    surfaces: tuple[Surface, ...]
    planes: np.ndarray
    order: np.ndarray

    @classmethod
    def of(cls, terrain: Terrain) -> "GroundMap":
        """Read a terrain."""
        regions = terrain.regions
        names = list(dict.fromkeys(region.group for region in regions))
        group_of = np.array([names.index(region.group) for region in regions])
        groups = tuple(tuple(np.flatnonzero(group_of == g).tolist()) for g in range(len(names)))
        planes = np.array([_plane(region) for region in regions])
        kinds: dict[Any, list[int]] = {}
        for i, region in enumerate(regions):
            numbers = (*region.normal, region.mu_foot, region.mu_wheel, region.mu_wheel_lateral)
            kinds.setdefault((*np.round(numbers, 9), region.rolling_resistance), []).append(i)
        surfaces = tuple(_surface(regions, tuple(members)) for members in kinds.values())
        order = np.argsort([region.vertices[:, 0].mean() for region in regions], kind="stable")
        return cls(regions, groups, group_of, surfaces, planes, order)

    @property
    def count(self) -> int:
        """Number of regions ``R``."""
        return len(self.regions)

    @property
    def level(self) -> float | None:
        """Height of the ground if all regions lie in one level plane, else None."""
        same = np.abs(self.planes - self.planes[0]).max() < _SAME and np.abs(self.planes[0, :2]).max() < _SAME
        return float(self.planes[0, 2]) if same else None

    @property
    def rolls_over_edges(self) -> bool:
        """Whether a wheel may leave one region for another without a swing."""
        return any(len(group) > 1 for group in self.groups)

    @property
    def steepest(self) -> float:
        """Largest rise per metre along x of any region."""
        return float(np.abs(self.planes[:, 0]).max())

    def heights(self, region: int, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the range of a region's plane over boxes.

        Args:
            region: index.
            low: ``(2, ...)`` lower corner of each box, x and y.
            high: upper corner.
        """
        (a, b, c), (x0, y0), (x1, y1) = self.planes[region], low, high
        ends = (a * x0, a * x1), (b * y0, b * y1)
        return (
            c + sum(np.minimum(*pair) for pair in ends),
            c + sum(np.maximum(*pair) for pair in ends),
        )


def _plane(region: Region) -> tuple[float, float, float]:
    n, origin = region.normal, region.vertices.mean(axis=0)
    # Rounding errors as coefficients would look like slopes to a solver's presolve.
    a, b = (0.0 if abs(part) < _SAME else -part / n[2] for part in n[:2])
    return a, b, float(origin[2] - a * origin[0] - b * origin[1])


def _surface(regions: tuple[Region, ...], members: tuple[int, ...]) -> Surface:
    region = regions[members[0]]
    friction = {
        "foot": (region.mu_foot, region.mu_foot),
        "wheel": (region.mu_wheel, region.mu_wheel_lateral),
    }
    basis = np.array([region.normal, region.tangent, region.binormal])
    basis[np.abs(basis) < _SAME] = 0.0
    return Surface(members, basis, friction, region.rolling_resistance)


@dataclass(frozen=True)
class Places:
    """Where each leg can be when each slot ends, as boxes that speed, reach and regions allow.

    Attributes:
        ground: the terrain.
        low: ``(2, L, J)`` lower corner of what speed and reach allow. Boxes grow with time, so that a
            slot's holds for all of its knots.
        high: upper corner.
        within: ``(R, 2, L, J)`` lower corners of the same, cut by each region's bounding box.
        upto: ``(R, 2, L, J)`` upper corners; below ``within`` where a region can't be reached.
        reachable: ``(R, L, J)`` whether leg l may be on region r when slot j ends.
        started: regions under the legs at time 0.
    """

    ground: GroundMap
    low: np.ndarray
    high: np.ndarray
    within: np.ndarray
    upto: np.ndarray
    reachable: np.ndarray
    started: frozenset[int]

    @classmethod
    def of(cls, problem: Any, bounds: MotionBounds) -> "Places":
        """Work the boxes out.

        Args:
            problem: what is asked.
            bounds: of the centre of mass.
        """
        ground, robot = problem.ground, problem.body
        low = bounds.place[0][:, None] + robot.reach_lower[:, :2].T[..., None]
        high = bounds.place[1][:, None] + robot.reach_upper[:, :2].T[..., None]
        corners = [region.vertices[:, :2] for region in ground.regions]
        within = np.stack([np.maximum(low, c.min(axis=0)[:, None, None]) for c in corners])
        upto = np.stack([np.minimum(high, c.max(axis=0)[:, None, None]) for c in corners])
        reachable = (within <= upto).all(axis=1)
        for r, region in enumerate(ground.regions):
            for a, b in zip(*region.halfspaces, strict=True):
                least = sum(np.minimum(a[i] * within[r, i], a[i] * upto[r, i]) for i in range(2))
                reachable[r] &= least <= b + _SAME
        return cls(ground, low, high, within, upto, reachable, frozenset(problem.start_regions.tolist()))

    def edges(self, region: int) -> list[tuple[np.ndarray, float]]:
        """Return the half-spaces ``a · p ≤ b`` of a region that its boxes do not imply already."""
        kept = []
        for a, b in zip(*self.ground.regions[region].halfspaces, strict=True):
            within, upto = self.within[region], self.upto[region]
            most = sum(np.maximum(a[i] * within[i], a[i] * upto[i]) for i in range(2))
            if (most > b + _SAME)[self.reachable[region]].any():
                kept.append((np.where(np.abs(a) < _SAME, 0.0, a), float(b)))
        return kept

    @cached_property
    def used(self) -> tuple[int, ...]:
        """The regions that some leg may be on at some time."""
        return tuple(r for r in range(self.ground.count) if self.reachable[r].any() or r in self.started)

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """The axes, of x and y, along which it matters to a contact which region it is in."""
        free = (self.within <= self.low + _SAME) & (self.upto >= self.high - _SAME)
        used = list(self.used)
        edges = [a for r in used for a, _ in self.edges(r)]
        slopes = self.ground.planes[used, :2]
        return tuple(
            i for i in range(2) if slopes[:, i].any() or not free[used, i].all() or any(a[i] for a in edges)
        )

    @cached_property
    def lowest(self) -> np.ndarray:
        """``(L, J)`` lowest ground in reach."""
        return self._extreme(0, np.min)

    @cached_property
    def highest(self) -> np.ndarray:
        """``(L, J)`` highest ground in reach."""
        return self._extreme(1, np.max)

    def _extreme(self, side: int, pick: Callable[..., np.ndarray]) -> np.ndarray:
        at = [self.ground.heights(r, self.within[r], self.upto[r])[side] for r in range(self.ground.count)]
        known = np.ma.masked_array(np.stack(at), ~self.reachable)
        # Where nothing can be reached there is no plan, and any number will do.
        return pick(known, axis=0).filled(0.0)
