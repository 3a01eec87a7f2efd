"""Chapter 12: paper B's experiments, by name: what the robot drives on, what is asked of it and disturbs it.

The paper gives neither speeds nor the number of waves, nor how hard the wheels are disturbed, nor how deep
the robot squats: those are options, or chosen here. The hand's target is 0.92 m and (-1.57, 0, -1.57) rad
everywhere. Its hardware turn asks for (1.57, 0, 0) instead, in axes that it does not give.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from wfbook.omni import legged, simulate
from wfbook.omni.base import Base
from wfbook.omni.controller import FEEDBACK
from wfbook.omni.locked import NQ_LOCKED, Target, locked_model, locked_state, nominal_target
from wfbook.omni.robot import ARM_BASE, NOMINAL_HEIGHT, NV, WHEEL_RADIUS, posture
from wfbook.omni.simulate import OmniRun, Targets
from wfbook.standing import plane

FRICTION = 0.7
WAY = 2.0
"""Of a robot that goes straight or sideways, m, less what starting and steering take of it."""

SPIN = 0.8
"""Of a robot that rotates, rad/s."""

RADIUS = 0.5
"""Of the circle on which it pivots, m."""

TURN, TURN_RATE, TURN_WAIT = 1.8, 0.25, 2.0
"""How far it turns and turns back, rad, which is the paper's; how fast, and for how long it waits between."""

DISTURBED = ((1.0, 0.2), (1.0, 0.0), (1.0, -0.2), (1.0, 0.0))
"""Seconds and m/s that are added to what the wheels are told, one after the other."""
_BEFORE = 0.5
"""Seconds before that."""

SQUAT, SQUAT_DOWN, SQUAT_WAIT = 0.18, 2.0, 1.0
"""How far the trunk goes down, m; seconds that this takes, and standing up; seconds before each."""

_ARM_YAW, _WRIST_YAW = 8, 12
"""The arm's joints about the vertical, in a posture ``(14,)``."""


@dataclass(frozen=True)
class Scenario:
    """An experiment of paper B.

    Attributes:
        name: on the command line, behind ``omni-``.
        title: what happens.
        where: in the paper.
        run: simulates it; takes ``options`` and those of :func:`wfbook.omni.simulate.run` that say who
            controls, what he knows and what is different from what he believes.
        options: of the scenario's own.
        legs: whether it takes legs, which only the paper's controller has a mode for.
    """

    name: str
    title: str
    where: str
    run: Callable[..., OmniRun]
    options: tuple[str, ...] = ()
    legs: bool = False


class Poses:
    """Makes targets of other postures than the nominal one; the hand stays where paper B wants it."""

    def __init__(self) -> None:
        self.nominal = nominal_target()
        self._model = locked_model()
        self._data = self._model.createData()

    def target(self, height: float, joints: np.ndarray) -> Target:
        """Return the target of a trunk at a height, over joints ``(14,)`` of legs and arm."""
        x = locked_state(posture(), np.zeros(NV))
        x[2], x[7:NQ_LOCKED] = height, joints
        com = np.array(pin.centerOfMass(self._model, self._data, x[:NQ_LOCKED]))
        return replace(self.nominal, com=com, posture=np.array(joints), height=height)


def squatting(depth: float = SQUAT, down: float = SQUAT_DOWN, wait: float = SQUAT_WAIT) -> Targets:
    """Return targets of a robot that squats, waits, and stands up again, its hand where it is.

    Args:
        depth: of the squat.
        down: seconds that the way down takes, and the way up.
        wait: seconds before each.
    """
    poses = Poses()

    def targets(t: float, _pose: np.ndarray) -> Target:
        share = _smooth((t - wait) / down) - _smooth((t - 2.0 * wait - down) / down)
        height = NOMINAL_HEIGHT - depth * share
        return poses.target(height, locked_state(posture(height), np.zeros(NV))[7:NQ_LOCKED])

    return targets


def held_in_the_world() -> Targets:
    """Return targets of a hand that keeps its place and its direction in the world while the base turns.

    The arm's first joint turns against the base. It is not in the middle of the base; the wrist makes up for
    what that changes.
    """
    poses = Poses()
    nominal = poses.nominal

    def targets(_t: float, pose: np.ndarray) -> Target:
        back = pin.utils.rotate("z", -pose[2])
        hand = back @ (nominal.hand - [pose[0], pose[1], 0.0])
        joints = nominal.posture.copy()
        joints[_ARM_YAW] = np.arctan2(hand[1] - ARM_BASE[1], hand[0] - ARM_BASE[0])
        joints[_WRIST_YAW] = -pose[2] - joints[_ARM_YAW]
        target = poses.target(NOMINAL_HEIGHT, joints)
        return replace(target, hand=hand, hand_rotation=back @ nominal.hand_rotation)

    return targets


def wheel_disturbance(parts: Sequence[tuple[float, float]] = DISTURBED) -> Callable[[float], np.ndarray]:
    """Return what is added to the wheels' rates ``(4,)`` over time.

    Args:
        parts: seconds and speeds in m/s, one after the other.
    """
    ends = _BEFORE + np.cumsum([duration for duration, _ in parts])
    speeds = [speed for _, speed in parts]

    def disturbance(t: float) -> np.ndarray:
        part = int(np.searchsorted(ends, t, side="right"))
        now = speeds[part] if _BEFORE <= t < ends[-1] else 0.0
        return np.full(4, now / WHEEL_RADIUS)

    return disturbance


def on_the_floor(course: Sequence[tuple[float, Sequence[float]]], **options: Any) -> OmniRun:
    """Drive a course on level ground; see :func:`wfbook.omni.simulate.run`."""
    return simulate.run(plane(FRICTION), course, **options)


def fixed(parts: Sequence[tuple[float, float]] = DISTURBED, **options: Any) -> OmniRun:
    """Keep the body where it is while the wheels are driven forward and backward.

    Args:
        parts: of :func:`wheel_disturbance`.
        options: of :func:`wfbook.omni.simulate.run`.
    """
    still = [(_BEFORE + sum(duration for duration, _ in parts), [0.0, 0.0, 0.0])]
    return on_the_floor(still, wheel_disturbance=wheel_disturbance(parts), **options)


def straight(speed: float = 0.5, way: float = WAY, **options: Any) -> OmniRun:
    """Drive straight ahead."""
    return on_the_floor([(way / speed, [speed, 0.0, 0.0])], **options)


def crab(speed: float = 0.5, way: float = WAY, **options: Any) -> OmniRun:
    """Drive sideways."""
    return on_the_floor([(way / speed, [0.0, speed, 0.0])], **options)


def rotate(angle: float = 2.0 * np.pi, **options: Any) -> OmniRun:
    """Rotate on the spot."""
    return on_the_floor([(angle / SPIN, [0.0, 0.0, SPIN])], **options)


def pivot(speed: float = 0.25, angle: float = np.pi, **options: Any) -> OmniRun:
    """Drive along an arc, front wheels steered against rear wheels."""
    return on_the_floor([(angle * RADIUS / speed, [speed, 0.0, speed / RADIUS])], **options)


def combined(each: float = 3.0, **options: Any) -> OmniRun:
    """Drive straight, rotate on the spot, and go sideways, so many seconds each."""
    return on_the_floor([(each, twist) for twist in ([0.5, 0, 0], [0, 0, SPIN], [0, 0.5, 0])], **options)


def turn(angle: float = TURN, rate: float = TURN_RATE, wait: float = TURN_WAIT, **options: Any) -> OmniRun:
    """Turn on the spot and back, the hand held where it is in the world; wait between."""
    lasts, there, back = angle / rate, np.array([0.0, 0.0, rate]), np.array([0.0, 0.0, -rate])
    course = [(_steering_time(there) + lasts, there), (wait, np.zeros(3)), (lasts, back)]
    return on_the_floor(course, target=held_in_the_world(), **options)


def squat(
    depth: float = SQUAT, down: float = SQUAT_DOWN, wait: float = SQUAT_WAIT, **options: Any
) -> OmniRun:
    """Squat and stand up, the hand held where it is; see :func:`squatting`."""
    course = [(2.0 * (down + wait), [0.0, 0.0, 0.0])]
    return on_the_floor(course, target=squatting(depth, down, wait), **options)


def _steering_time(twist: np.ndarray, dt: float = FEEDBACK) -> float:
    """Return for how long the base steers before it moves, from nominal."""
    base, steps = Base(), 0
    while not base.twist.any():
        base.advance(twist, dt)
        steps += 1
    return steps * dt


def _smooth(share: float) -> float:
    """Return a way from 0 to 1 that begins and ends at rest, without a jump of the acceleration."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario("waves", "over 11.5 m of waves", "Fig. 6", simulate.run_waves, ("count", "speed")),
        Scenario("fixed", "the body in its place while the wheels are disturbed", "Fig. 7a", fixed),
        Scenario("straight", "straight ahead", "Fig. 7b", straight, ("speed",)),
        Scenario("crab", "sideways", "Fig. 7b", crab, ("speed",)),
        Scenario("rotate", "once round on the spot", "Fig. 7b", rotate),
        Scenario("pivot", "along half a circle", "Fig. 4d", pivot, ("speed",)),
        Scenario("combined", "straight, round on the spot, sideways", "Fig. 7b", combined),
        Scenario("turn", "1.8 rad on the spot and back", "Figs. 8a, 9, 10", turn),
        Scenario("squat", "squat and stand up", "Fig. 8b", squat),
        Scenario("obstacle", "on legs over a bar across the way", "Fig. 5", legged.run_obstacle, legs=True),
        Scenario("jump", "roll up, jump, roll on", "Fig. 5", legged.run_jump, legs=True),
    )
}
"""By name, in the paper's order; then those that need legged mode, which the paper has and does not show."""
