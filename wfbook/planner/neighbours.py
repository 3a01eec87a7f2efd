"""Which regions are next to which, how far apart, and what would join them."""

from dataclasses import dataclass

import numpy as np

from wfbook.planner.problem import Problem
from wfbook.planner.wide import clipped
from wfbook.terrain import Region


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Two regions, one after the other on the way from the start.

    Attributes:
        near: index of the one nearer to the start.
        far: of the other.
        gap: horizontal distance between them, 0 where they touch or overlap.
        rise: how much higher the far one is where they are closest.
        bridge: by edge of the near region, how far it must move out for the region to touch the other.
        cover: likewise for the region to cover the other.
    """

    near: int
    far: int
    gap: float
    rise: float
    bridge: dict[int, float]
    cover: dict[int, float]


def neighbours(problem: Problem) -> list[Neighbours]:
    """Return the pairs of regions with the narrowest gaps that connect everything to the start.

    They are a minimum spanning tree: the widest gap between two regions in it is as narrow as that of any
    other way, so what can't be crossed here can't be passed by.

    Args:
        problem: its legs must start over regions.

    Returns:
        Pairs in the order in which the tree grows from the start.
    """
    regions = problem.terrain.regions
    reached, found = sorted(set(problem.start_regions.tolist())), []
    rest = [r for r in range(len(regions)) if r not in reached]
    links = {(i, j): _link(regions, i, j) for i in range(len(regions)) for j in rest if i != j}
    while rest:
        options = [links[i, j] for i in reached for j in rest]
        found.append(min(options, key=lambda n: (n.gap, abs(n.rise))))
        reached.append(found[-1].far)
        rest.remove(found[-1].far)
    return found


def nearest_points(first: Region, second: Region) -> tuple[np.ndarray, np.ndarray]:
    """Return where two regions are closest, seen from above: a point of each, the same if they overlap."""
    a, b = first.vertices[:, :2], second.vertices[:, :2]
    shared = clipped(a, zip(*second.halfspaces, strict=True))
    if len(shared):
        return shared.mean(axis=0), shared.mean(axis=0)
    pairs = [(corner, _nearest_on(b, corner)) for corner in a]
    pairs += [(_nearest_on(a, corner), corner) for corner in b]
    return min(pairs, key=lambda pair: float(np.linalg.norm(pair[0] - pair[1])))


def _nearest_on(outline: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the point of a polygon's edges nearest to a point."""
    along = np.roll(outline, -1, axis=0) - outline
    share = np.einsum("ni,ni->n", point - outline, along) / np.einsum("ni,ni->n", along, along)
    feet = outline + np.clip(share, 0.0, 1.0)[:, None] * along
    return feet[np.linalg.norm(feet - point, axis=1).argmin()]


def _link(regions: tuple[Region, ...], near: int, far: int) -> Neighbours:
    first, second = regions[near], regions[far]
    here, there = nearest_points(first, second)
    A, b = first.halfspaces
    # Only edges that look towards the other region move: the others don't separate the two.
    facing = A @ second.vertices[:, :2].mean(axis=0) > b
    touch, cover = A @ there - b, (A @ second.vertices[:, :2].T - b[:, None]).max(axis=1)
    return Neighbours(
        near,
        far,
        float(np.linalg.norm(there - here)),
        second.height(*there) - first.height(*here),
        {int(e): float(touch[e]) for e in np.flatnonzero(touch > 1e-9)},
        {int(e): float(max(cover[e], 0.0)) for e in np.flatnonzero(facing)},
    )


def distance(region: Region, place: np.ndarray) -> float:
    """Return how far a place is from a region it is not over."""
    return float(np.linalg.norm(_nearest_on(region.vertices[:, :2], np.asarray(place, float)) - place))
