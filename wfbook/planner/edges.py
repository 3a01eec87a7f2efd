"""How far contacts keep from the edges of their regions.

A plan may put a foothold on the very edge of a stone, which is inside it (eq. 22). A robot may not: its foot
rolls forward by a centimetre while it stands, and lands where the controller can put it. The same holds
for a wheel at an edge beyond which its group does not go on.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wfbook.planner.gait import Gait
from wfbook.planner.problem import Problem

MARGIN = 0.015
"""How far inside, where there is room."""

_BEYOND = 2e-3


class Edge(NamedTuple):
    """A half-plane ``a · (p_x, p_y) ≤ b`` in which a contact should be when a slot ends.

    Attributes:
        leg: index.
        slot: index.
        a: ``(2,)``.
        b: already less the margin.
    """

    leg: int
    slot: int
    a: np.ndarray
    b: float


def kept_off(problem: Problem, gait: Gait) -> Iterator[Edge]:
    """Yield the half-planes of all contacts that a gait can still move: landings, and wheels that roll."""
    for leg, slot in np.argwhere((gait.S == 1) | (gait.wheel == 1)):
        region, wheel = int(gait.region[leg, slot]), bool(gait.wheel[leg, slot])
        for i, (a, b) in enumerate(zip(*problem.terrain.regions[region].halfspaces, strict=True)):
            if not (wheel and _goes_on(problem, region, i)):
                yield Edge(int(leg), int(slot), a, float(b) - MARGIN)


def _goes_on(problem: Problem, region: int, edge: int) -> bool:
    """Whether another region of the group lies beyond the middle of an edge."""
    regions = problem.terrain.regions
    corners = regions[region].vertices[:, :2]
    middle = 0.5 * (corners[edge] + corners[(edge + 1) % len(corners)])
    x, y = middle + _BEYOND * regions[region].halfspaces[0][edge]
    group = problem.ground.groups[problem.ground.group_of[region]]
    return any(regions[other].contains(x, y) for other in group if other != region)
