"""Chapter 12: steps of legged mode: where the centre of mass must be, how a wheel swings (Paper B, Fig. 5).

The legs have no abduction: the centre of mass can be shifted along the robot, and across only as far as the
trunk rolls. A wheel is lifted when the centre of mass is inside the triangle of the other three, away from
its edges. With the wheels below the hips the diagonal is the edge that matters, so the robot leans back
before a front wheel steps, and ahead before a rear one does.

Coordinates are those of the commanded base: x ahead, the origin on the ground.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from wfbook.modes import LEGS
from wfbook.omni.locked import Target
from wfbook.omni.robot import WHEEL_RADIUS

Heights = Callable[[np.ndarray], np.ndarray]
"""From points ``(n, 3)`` to the ground's heights there ``(n,)``."""

_RISE, _CROSS, _DONE = 0.35, (0.2, 0.8), 0.92
"""Share of a swing in which a wheel rises and, at its end, sinks; in which it crosses; when it arrives."""

_SINK = 0.15
"""Share of a stride in which the trunk sinks, and rises again."""
TOUCHING = 0.005
"""How far a planned wheel may be inside of the ground, m: less than tyre and contact yield."""


@dataclass(frozen=True)
class Gait:
    """How steps are made.

    Attributes:
        margin: of the centre of mass to the edges of the triangle, m.
        lean: largest distance that rolling the trunk moves the centre of mass across, m.
        clearance: of the wheel over what is below, m.
        crouch: how much lower the trunk is carried, m.
        shift, swing, pause: durations of moving the centre of mass, of a swing, and between them, s.
    """

    margin: float = 0.05
    lean: float = 0.015
    clearance: float = 0.04
    crouch: float = 0.03
    shift: float = 0.9
    swing: float = 1.2
    pause: float = 0.2


@dataclass(frozen=True)
class Swing:
    """A wheel's step.

    Attributes:
        leg: which, an index into :data:`wfbook.modes.LEGS`.
        first, last: nodes in which the wheel is in the air: ``first <= k < last``.
        start, end: ``(3,)`` of the axle.
    """

    leg: int
    first: int
    last: int
    start: np.ndarray
    end: np.ndarray


@dataclass(frozen=True)
class Schedule:
    """What each of N + 1 nodes is asked for.

    Attributes:
        dt: from node to node, s.
        targets: ``N + 1``.
        stances: ``N + 1`` of ``(4,)`` bool.
        swings: in their order.
        advance: ``(2,)`` by which the base has moved on at the end.
    """

    dt: float
    targets: list[Target]
    stances: list[tuple[bool, ...]]
    swings: list[Swing]
    advance: np.ndarray


def ease(share: np.ndarray | float) -> np.ndarray:
    """Return the way done, 0 to 1, with velocity and acceleration zero at both ends, for a share of time."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def swing_path(start: np.ndarray, end: np.ndarray, apex: float, share: np.ndarray) -> np.ndarray:
    """Return where an axle is ``(n, 3)``: up, across, down, and at rest before the time is over.

    Args:
        start: ``(3,)``.
        end: ``(3,)``.
        apex: height of the axle while it crosses.
        share: ``(n,)`` of the time, 0 to 1.
    """
    s = np.asarray(share, dtype=float) / _DONE
    crossed = ease((s - _CROSS[0]) / (_CROSS[1] - _CROSS[0]))
    path = start + crossed[:, None] * (end - start)
    rising, sinking = ease(s / _RISE), ease((s - 1.0 + _RISE) / _RISE)
    path[:, 2] = start[2] + rising * (apex - start[2]) + sinking * (end[2] - apex)
    return path


def clearance(path: np.ndarray, heights: Heights) -> float:
    """Return the smallest vertical distance of a wheel's rim from the ground.

    Args:
        path: ``(n, 3)`` of the axle, the wheel rolling along x.
        heights: of the ground.
    """
    ahead = WHEEL_RADIUS * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 41))
    rim = path[:, None, :] + np.stack([ahead, 0.0 * ahead, -np.sqrt(WHEEL_RADIUS**2 - ahead**2)], axis=1)
    points = rim.reshape(-1, 3)
    return float((points[:, 2] - heights(points)).min())


def margin(com: np.ndarray, feet: np.ndarray, stance: Sequence[bool]) -> float:
    """Return the distance from a centre of mass to the nearest edge of the polygon of support.

    Negative outside; minus infinity with fewer than three wheels standing.

    Args:
        com: ``(2,)`` or ``(3,)``.
        feet: ``(4, 2)`` or ``(4, 3)``.
        stance: ``(4,)`` bool.
    """
    around = [i for i in (0, 2, 3, 1) if stance[i]]  # counter-clockwise seen from above
    if len(around) < 3:
        return -np.inf
    corners = np.asarray(feet)[around, :2]
    edges = np.roll(corners, -1, axis=0) - corners
    inward = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
    return float(((np.asarray(com)[:2] - corners) * inward).sum(axis=1).min())


def com_goal(wanted: np.ndarray, feet: np.ndarray, leg: int, gait: Gait) -> np.ndarray:
    """Return where the centre of mass should be ``(2,)`` before a wheel is lifted.

    It is as near as can be to where it is wanted, a little across to the side that stands, and along the
    robot as far as the margin asks for.

    Args:
        wanted: ``(2,)``.
        feet: ``(4, 3)``.
        leg: that is lifted.
        gait: margins.

    Raises:
        ValueError: there is no such place.
    """
    stance = [i != leg for i in range(4)]
    y = wanted[1] + (-gait.lean if leg in (0, 2) else gait.lean)
    xs = wanted[0] + np.linspace(-0.4, 0.4, 801)
    good = [x for x in xs if margin(np.array([x, y]), feet, stance) >= gait.margin]
    if not good:
        raise ValueError(f"stride: {LEGS[leg]} can't be lifted with a margin of {gait.margin} m")
    return np.array([min(good, key=lambda x: abs(x - wanted[0])), y])


def schedule(
    target: Target,
    feet: np.ndarray,
    com: np.ndarray,
    landings: Sequence[tuple[int, np.ndarray]],
    advance: np.ndarray,
    heights: Heights,
    dt: float,
    gait: Gait | None = None,
    lifted_from: Sequence[np.ndarray] | None = None,
) -> Schedule:
    """Return the references of a stride: wheels step one after the other, the centre of mass beforehand.

    Args:
        target: of hand and body now, and at the end relative to the base that has moved on.
        feet: ``(4, 3)`` axles now.
        com: ``(3,)`` centre of mass now.
        landings: legs and where their axles go ``(3,)``, in order.
        advance: ``(2,)`` of the base.
        heights: of the ground.
        dt: from node to node.
        gait: how.
        lifted_from: for each landing the axles ``(4, 3)`` when that wheel is lifted. A locked wheel rolls a
            little with its shank while the trunk moves; without it they are taken to stand still.

    Raises:
        ValueError: a leg can't be lifted, or its wheel would touch what it swings over.
    """
    gait = Gait() if gait is None else gait
    begin, feet = np.array(feet, dtype=float), np.array(feet, dtype=float)
    goal = target.com[:2] + advance
    phases: list[tuple[float, np.ndarray, Swing | None]] = []
    swings: list[Swing] = []
    for i, (leg, end) in enumerate(landings):
        if lifted_from is not None:
            feet = np.array(lifted_from[i])
            feet[:, 2] = heights(feet) + WHEEL_RADIUS  # in a solution that is under way wheels sink a little
        place = com_goal(goal, feet, leg, gait)
        phases.append((gait.shift + (gait.pause if swings else 0.0), place, None))
        k = sum(round(duration / dt) for duration, _, _ in phases)
        swing = Swing(leg, k, k + round(gait.swing / dt), feet[leg].copy(), np.array(end, dtype=float))
        phases.append((gait.swing, place, swing))
        swings.append(swing)
        feet[leg] = end
    phases += [(gait.pause + gait.shift, goal, None), (2.0 * gait.pause, goal, None)]
    nodes = sum(round(duration / dt) for duration, _, _ in phases)
    targets, stances, place, now = [], [], np.array(com[:2], dtype=float), begin.copy()
    for duration, goal, swing in phases:
        count = round(duration / dt)
        path = np.zeros((0, 3)) if swing is None else _path(swing, heights, dt, gait)
        for k in range(count):
            axles, stance = now.copy(), [True] * 4
            if swing is not None:
                axles[swing.leg], stance[swing.leg] = path[k], False
            at = place + ease(k / count) * (goal - place)
            targets.append(_asked(target, at, axles, now, len(targets) / nodes, advance, gait))
            stances.append(tuple(stance))
        place = goal
        if swing is not None:
            now[swing.leg] = swing.end
    targets.append(_asked(target, place, now, now, 1.0, advance, gait))
    stances.append((True,) * 4)
    return Schedule(dt, targets, stances, swings, np.asarray(advance, dtype=float))


def _path(swing: Swing, heights: Heights, dt: float, gait: Gait) -> np.ndarray:
    """Return the axle's path ``(n, 3)`` of a swing over what is below.

    Raises:
        ValueError: the wheel would touch it.
    """
    between = np.linspace(swing.start, swing.end, 101)
    apex = float(heights(between).max()) + WHEEL_RADIUS + gait.clearance
    apex = max(apex, max(swing.start[2], swing.end[2]) + gait.clearance)
    path = swing_path(swing.start, swing.end, apex, np.arange(swing.last - swing.first) * dt / gait.swing)
    if clearance(path, heights) < -TOUCHING:
        raise ValueError(f"stride: {LEGS[swing.leg]} would touch what it steps over")
    return path


def _asked(
    target: Target,
    com: np.ndarray,
    axles: np.ndarray,
    standing: np.ndarray,
    share: float,
    advance: np.ndarray,
    gait: Gait,
) -> Target:
    """Return what a node is asked for, a share of the stride having passed."""
    ahead = ease(share) * np.array([*advance, 0.0])
    level = standing[:, 2].mean() - WHEEL_RADIUS
    low = gait.crouch * min(ease(share / _SINK), ease((1.0 - share) / _SINK))
    height = target.com[2] + level - low
    roll = -np.arctan2(com[1] - target.com[1], height)
    return replace(
        target,
        hand=target.hand + ahead,
        com=np.array([com[0], com[1], height]),
        trunk=pin.utils.rotate("x", roll),
        feet=axles,
    )
