"""A problem that forbids nothing, and outlines of regions some of whose edges are left out.

Why there is no plan is asked by leaving out limits. The tight formulation can't simply do so: its bounds on
products and places hold *because* of speed, reach and regions. So it is built for a wide problem, of which
no limit implies another, and the true limits are stated on top (:mod:`.elastic`).
"""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from wfbook.modes import swing_patterns
from wfbook.planner.ground import GroundMap
from wfbook.planner.problem import Problem
from wfbook.terrain import Region, Terrain

MARGIN = 2.0
"""Metres that anything may be off beyond where a plan could get, and friction that is added."""

_STRONGEST = 4.0  # body weights on one leg


@dataclass(frozen=True)
class Wide(Problem):
    """A generous problem that begins where the true one does.

    Attributes:
        true: the true problem.
    """

    true: Problem | None = None

    @cached_property
    def start_regions(self) -> np.ndarray:
        """As the true problem has it: here all regions overlap."""
        return self.true.start_regions

    @cached_property
    def ground(self) -> GroundMap:
        """As the terrain has it, but for the order of the regions, which the true outlines tell."""
        return replace(super().ground, order=self.true.ground.order)

    @property
    def square(self) -> np.ndarray:
        """``(4, 2)`` corners of the square that every region fills, counter-clockwise."""
        return self.terrain.regions[0].vertices[:, :2]


def widened(problem: Problem) -> Wide:
    """Return a problem that forbids nothing that a reasonable plan would do.

    Args:
        problem: the true one.

    Returns:
        A problem with the same planes, groups, resistance and start, on which every region is a large
        square, feet grip, and legs reach, step and push as far, fast and together as they like.
    """
    limits, (x, y) = problem.limits, problem.start
    fastest = max(*limits.speed, limits.lateral_speed)
    away = float(np.abs(np.subtract(problem.goal, problem.start)).max())
    far = MARGIN + max(fastest * problem.duration, away)
    corners = [(x - far, y - far), (x + far, y - far), (x + far, y + far), (x - far, y + far)]
    regions = tuple(
        Region(
            [(*corner, region.height(*corner)) for corner in corners],
            *(mu + MARGIN for mu in (region.mu_foot, region.mu_wheel, region.mu_wheel_lateral)),
            region.rolling_resistance,
            region.group,
        )
        for region in problem.terrain.regions
    )
    fast = 2 * fastest + 4 * far / problem.duration
    changes = {
        "terrain": Terrain(problem.terrain.name, regions),
        "limits": replace(limits, speed=(fast, fast), lateral_speed=fast, step=(far, far), force=_STRONGEST),
        "robot": replace(problem.robot, reach=(far, far, far)),
        "without": tuple(name for name in problem.without if name != "reach"),
        # With all legs in the air there is no centroid.
        "patterns": swing_patterns(problem.legs - 1),
        "stance_between_swings": False,
        "final_stance": False,
        "beyond_reach": True,
        "goal_tolerance": None,
        "true": problem,
    }
    return Wide(**{f.name: getattr(problem, f.name) for f in fields(Problem)} | changes)


def clipped(polygon: np.ndarray, halfspaces: Iterable[tuple[np.ndarray, float]]) -> np.ndarray:
    """Cut a convex polygon.

    Args:
        polygon: ``(n, 2)`` corners in order.
        halfspaces: ``a`` and ``b`` of ``a · p ≤ b``; what is outside is cut off.

    Returns:
        The corners of what is left, ``(m, 2)``, none if nothing is.
    """
    for a, b in halfspaces:
        out = polygon @ a - b
        corners = []
        for i in range(len(polygon)):
            here, there = out[i - 1], out[i]
            if here * there < 0:
                corners.append(polygon[i - 1] + here / (here - there) * (polygon[i] - polygon[i - 1]))
            if there <= 0:
                corners.append(polygon[i])
        polygon = np.array(corners).reshape(-1, 2)
    return polygon
