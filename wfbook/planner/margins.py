"""How far a plan that is to be executed keeps from its limits.

**Edges.** A plan may put a foothold on the very edge of a stone, which is inside it (eq. 22). A robot may
not: its foot rolls forward by a centimetre while it stands, and lands where the controller can put it. The
same holds for a wheel at an edge beyond which its group does not go on. Beside a step up there must be room
for the foot itself, and in front of one for the calf, which slants back.

**Grip.** A plan may use all friction there is (eqs 26 and 27), and in the corners of the pyramid more. Then
nothing is left to correct an error with, and the foot slides. At rest there is no choice of when to push:
there a share of the friction must suffice, whatever it costs.

**Load.** Three legs that stand carry the robot on any point of their triangle, and the cheapest plan takes
its edge: the third leg stands there and carries nothing. Then the smallest error tips the robot over that
edge, and nothing that the controller could shift is left. So every leg of three or four keeps some load.

**Knees.** The reach box is drawn along the world's axes. On a slope downwards a foot far ahead of its hip is
farther ahead still along the ground, and the ground rises towards the knee, which is behind the foot: the
calf lies down on it. So the body keeps the higher above the ground, the farther ahead a leg stands.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wfbook.planner.gait import Gait
from wfbook.planner.problem import Problem

MARGINS = ("edges", "grip", "load", "knees")
"""What a plan keeps in hand; a lesson may leave some out."""

MARGIN = 0.015
"""How far inside, where there is room."""

STEP_MARGIN = 0.03
"""How far from a step up to a neighbour."""

CALF = 2.0
"""How much farther from one behind, over the step's height."""

GRIP = 0.65
"""Share of the friction coefficients that forces keep to; the corners of this pyramid are in the cone."""

HOLD = 0.85
"""Share of the friction coefficients that must be enough to stay at rest."""

LOAD = 0.06
"""Share of the weight with which each of three legs or more presses on the ground."""

KNEE_RISE = 0.4
KNEE_HEIGHT = 0.174
"""How high above a contact's plane the CoM is to be: so much, and a share of the leg's way ahead of its hip.

Where the Go1's knee is 45 mm above the ground less half its calf's thickness, within 5 mm up to
0.2 m ahead; a wheel lifts the leg's end, and with it the knee, by as much as it takes away below the hip.
"""

_BEYOND = 2e-3
_STEP = 5e-3
_ALONG = (0.1, 0.3, 0.5, 0.7, 0.9)


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
                yield Edge(int(leg), int(slot), a, float(b) - _margin(problem, region, i, a))


def kept_in_grip(
    problem: Problem, gait: Gait, grip: bool = True, load: bool = True
) -> Iterator[tuple[int, int, np.ndarray, float]]:
    """Yield smaller friction pyramids, cut off below: an interval, leg, and ``c · λ ≤ most`` in body weights.

    Interval K is the rest after the plan, where that ends at rest.

    A wheel that rolls over an edge within a slot is taken to be on the region on which it ends.

    Args:
        problem: whose terrain it is.
        gait: contacts.
        grip: whether pyramids are smaller.
        load: whether they are cut off below.
    """
    many = (gait.S == 0).sum(axis=0) >= 3
    for leg, slot in np.argwhere(gait.S == 0):
        intervals = list(range(problem.knots_per_slot * slot, problem.knots_per_slot * (slot + 1)))
        if slot == problem.slots - 1 and problem.final_stance:
            intervals.append(problem.knots)
        sides = [(side, 0.0) for side in _sides(problem, gait, leg, slot, GRIP)] if grip else []
        if load and many[slot]:
            sides.append((-problem.terrain.regions[int(gait.region[leg, slot])].normal, -LOAD))
        for side, most in sides:
            for k in intervals:
                yield k, int(leg), side, most


def kept_off_knees(problem: Problem, gait: Gait) -> Iterator[tuple[int, int, np.ndarray, float]]:
    """Yield how far ahead legs may stand: an interval, leg, and ``c · (p − x) ≤ most`` in metres."""
    for leg, slot in np.argwhere(gait.S == 0):
        region = problem.terrain.regions[int(gait.region[leg, slot])]
        most = KNEE_RISE * float(problem.robot.stance[leg, 0]) - KNEE_HEIGHT
        for k in range(problem.knots_per_slot * slot, problem.knots_per_slot * (slot + 1)):
            yield k, int(leg), KNEE_RISE * region.tangent + region.normal, most


def held_at_rest(problem: Problem, gait: Gait) -> Iterator[tuple[int, np.ndarray, float]]:
    """Yield what must hold of the forces at rest: leg, and ``c · F ≤ most`` in body weights.

    Nothing for a plan that does not end at rest.
    """
    for leg in range(problem.legs) if problem.final_stance else ():
        region = problem.terrain.regions[int(gait.region[leg, -1])]
        yield leg, -region.normal, 0.0
        yield leg, region.normal, problem.limits.force
        for side in _sides(problem, gait, leg, -1, HOLD):
            yield leg, side, 0.0
        if gait.wheel[leg, -1]:  # a free wheel holds nothing along t
            yield leg, region.tangent, 0.0
            yield leg, -region.tangent, 0.0


def _sides(problem: Problem, gait: Gait, leg: int, slot: int, share: float) -> Iterator[np.ndarray]:
    """Yield the sides ``c`` of a pyramid of a share of the friction: ``c · λ ≤ 0``."""
    region = problem.terrain.regions[int(gait.region[leg, slot])]
    if gait.wheel[leg, slot]:
        sides = [(region.binormal, region.mu_wheel_lateral)]
    else:
        sides = [(region.tangent, region.mu_foot), (region.binormal, region.mu_foot)]
    for direction, mu in sides:
        for sign in (1.0, -1.0):
            yield sign * direction - share * mu * region.normal


def _goes_on(problem: Problem, region: int, edge: int) -> bool:
    """Whether another region of the group lies beyond the middle of an edge."""
    (x, y), regions = _beyond(problem, region, edge, 0.5), problem.terrain.regions
    group = problem.ground.groups[problem.ground.group_of[region]]
    return any(regions[other].contains(x, y) for other in group if other != region)


def _margin(problem: Problem, region: int, edge: int, outward: np.ndarray) -> float:
    """Return how far from an edge a contact should be, by the highest ground just beyond the edge."""
    terrain, rise = problem.terrain, 0.0
    for share in _ALONG:
        x, y = _beyond(problem, region, edge, share)
        height = terrain.height(x, y)
        if height is not None:
            rise = max(rise, height - terrain.regions[region].height(x, y))
    if rise < _STEP:
        return MARGIN
    return STEP_MARGIN + CALF * rise * max(-outward[0], 0.0)


def _beyond(problem: Problem, region: int, edge: int, share: float) -> np.ndarray:
    """Return a point ``(2,)`` just beyond an edge of a region, a share of the way along it."""
    region = problem.terrain.regions[region]
    here, there = region.vertices[edge, :2], region.vertices[(edge + 1) % len(region.vertices), :2]
    return here + share * (there - here) + _BEYOND * region.halfspaces[0][edge]
