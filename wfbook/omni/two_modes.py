"""Chapter 12: tasks, and the two controllers that carry them out, one at a time (Paper B, Fig. 5).

A course is a list of tasks. Each says which mode it needs; the state machine (:mod:`.machine`) gets the robot
there, and only then the task begins. While modes change, the controller that stands on its wheels holds the
robot. What one controller has learnt, the payload and the hand's lasting errors, the other takes over.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wfbook.modes import LEGS
from wfbook.omni.base import Base
from wfbook.omni.controller import FEEDBACK, Command, WholeBody
from wfbook.omni.costs import Weights
from wfbook.omni.jump import Leap
from wfbook.omni.locked import Target, locked_state
from wfbook.omni.machine import ON_LEGS, Mode, Observed, State, advance
from wfbook.omni.motion import Body, Plan, plan_leap, plan_stride
from wfbook.omni.on_legs import OnLegs
from wfbook.omni.problem import OptimalControl
from wfbook.omni.robot import STEERS_V, WHEEL_RADIUS, WHEELS_V
from wfbook.omni.rolling import Axes
from wfbook.omni.stride import Gait
from wfbook.omni.waves import Ground
from wfbook.omni.wheels import wheel_velocities


@dataclass(frozen=True)
class Drive:
    """Drive with a twist for a time.

    Attributes:
        duration: s.
        twist: ``(3,)``.
    """

    duration: float
    twist: Sequence[float]


@dataclass(frozen=True)
class RollTo:
    """Roll straight ahead or back until the middle of two wheels is somewhere, and stop.

    Attributes:
        x: where, in the world.
        legs: whose wheels' middles; all four for the base itself.
        speed: on the way.
    """

    x: float
    legs: tuple[str, ...] = LEGS
    speed: float = 0.4


@dataclass(frozen=True)
class StepTo:
    """Put wheels somewhere, one after the other, in legged mode.

    Attributes:
        x: of the axles afterwards, in the world, by the names of their legs, in their order.
        gait: how.
    """

    x: dict[str, float]
    gait: Gait = field(default_factory=Gait)


@dataclass(frozen=True)
class Jump:
    """Jump, in legged mode.

    Attributes:
        leap: how.
    """

    leap: Leap = field(default_factory=Leap)


Task = Drive | RollTo | StepTo | Jump
ON_FEET = StepTo | Jump
"""Tasks for which the wheels are locked."""

_NEAR, _DECELERATION = 0.004, 0.6
"""How near a place is reached, m; and how the robot slows down before it, m/s²."""
_PATIENCE = 60.0
_DEVIATION, _FORCE = 0.03, 5.0
"""What a plan may miss: of a wheel's path, m; of a contact's force, N."""


class TwoModes:
    """Both controllers under the state machine.

    Args:
        tasks: one after the other.
        ground: that the robot is on.
        target: of the hand and the body.
        base: that is commanded.
        delay: age of what is measured.
        weights: of eq. 17 in wheeled mode.

    Attributes:
        machine: its state.
        felt: ``(4,)`` bool, which wheels were felt to touch when the state was measured.
        waiting: whether the robot still settles, and no task begins.
        plans: motions that were planned.
        trouble: what went wrong, if anything.
    """

    def __init__(
        self,
        tasks: Sequence[Task],
        ground: Ground,
        target: Target | None = None,
        base: Base | None = None,
        delay: float = 0.0,
        weights: Weights | None = None,
    ) -> None:
        self.rolling = WholeBody(ground, target, base, delay, weights)
        self.legs = OnLegs(ground, target, self.rolling.wheels.base, delay)
        self.legs.wheels = self.wheels = self.rolling.wheels
        self.ground, self.delay = ground, delay
        self.machine = State()
        self.felt = np.ones(4, bool)
        self.waiting = False
        self.plans: list[Plan] = []
        self.trouble: str | None = None
        self._tasks = list(tasks)
        self._for = 0.0
        self._begun = False

    @property
    def driver(self) -> WholeBody:
        """The controller whose commands the motors get now."""
        return self.legs if self.machine.mode in ON_LEGS else self.rolling

    @property
    def target(self) -> Target:
        """What hand and body are to do now."""
        return self.driver.target

    @property
    def solved(self) -> bool:
        """Whether the last command came from a finite solution."""
        return self.driver.solved

    @property
    def standing(self) -> np.ndarray:
        """``(4,)`` bool, which wheels are taken to stand."""
        return self.legs.standing if self.machine.mode in ON_LEGS else np.ones(4, bool)

    @property
    def ocp(self) -> OptimalControl:
        """The problem that is solved now."""
        return self.driver.ocp

    @property
    def done(self) -> bool:
        """Whether all tasks are done, the robot on its wheels again."""
        return not self._tasks and self.machine.mode == Mode.WHEELED

    def halt(self) -> None:
        """Take notice that something went wrong."""
        self.machine = advance(self.machine, False, Observed(fault=True), FEEDBACK)

    def tick(self, qpos: np.ndarray, qvel: np.ndarray, _wanted: np.ndarray) -> Command:
        """Return the command for the next :data:`wfbook.omni.controller.FEEDBACK` seconds.

        Args:
            qpos: ``(30,)`` measured.
            qvel: ``(29,)`` measured.
        """
        twist = self._perform(qpos, qvel)
        before = self.machine.mode
        self.machine = advance(self.machine, self._wants_legs, self._observed(qpos, qvel), FEEDBACK)
        mode = self.machine.mode
        if (before in ON_LEGS) != (mode in ON_LEGS):
            self._change(qpos, qvel)
        if mode == Mode.ALIGNING:
            self._align()
        self.legs.felt = self.felt
        return self.driver.tick(qpos, qvel, twist if mode == Mode.WHEELED else np.zeros(3))

    @property
    def _wants_legs(self) -> bool:
        return bool(self._tasks) and not self.waiting and isinstance(self._tasks[0], ON_FEET)

    def _observed(self, qpos: np.ndarray, qvel: np.ndarray) -> Observed:
        base = self.wheels.base
        rolling = np.linalg.norm(wheel_velocities(base.twist, base.positions), axis=1)
        off = qpos[1 + STEERS_V] - np.pi * np.round(qpos[1 + STEERS_V] / np.pi)
        return Observed(
            base_speed=float(rolling.max()),
            wheel_speed=float(np.abs(qvel[WHEELS_V]).max()),
            steering_error=float(np.abs(off).max()),
            trunk_speed=float(np.linalg.norm(qvel[:3])),
            standing=bool(self.standing.all() and self.felt.all()),
        )

    def _perform(self, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """Go on with the present task, and from one to the next; return the twist that it wants."""
        if not self._tasks or self.waiting:
            return np.zeros(3)
        task = self._tasks[0]
        self._for += FEEDBACK
        if self._for > _PATIENCE:
            self.trouble = f"a task takes longer than {_PATIENCE:.0f} s: {type(task).__name__}"
        if isinstance(task, Drive) and self.machine.mode == Mode.WHEELED:
            if not self._begun:  # the time in which modes changed does not count
                self._begun, self._for = True, 0.0
            if self._for > task.duration - 1e-9:
                self._next()
            return np.asarray(task.twist, dtype=float)
        if isinstance(task, RollTo) and self.machine.mode == Mode.WHEELED:
            return self._roll_to(task)
        if isinstance(task, ON_FEET) and self.machine.mode == Mode.LEGGED:
            self._on_feet(task, qpos, qvel)
        return np.zeros(3)

    def _next(self) -> None:
        self._tasks.pop(0)
        self._for, self._begun = 0.0, False

    def _roll_to(self, task: RollTo) -> np.ndarray:
        """Return the twist that rolls to a place, slower the nearer it is."""
        base = self.wheels.base
        chosen = [LEGS.index(leg) for leg in task.legs]
        cos = np.cos(base.state[2])
        missing = (task.x - base.state[0]) / cos - base.positions[chosen, 0].mean()
        if abs(missing) < _NEAR and np.abs(base.twist).max() < 1e-3:
            self._next()
            return np.zeros(3)
        speed = min(task.speed, np.sqrt(2.0 * _DECELERATION * abs(missing)), 4.0 * abs(missing))
        return np.array([np.sign(missing) * speed, 0.0, 0.0])

    def _on_feet(self, task: StepTo | Jump, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Plan a motion once the robot is in legged mode, and see it through."""
        if self._begun and self.legs.finished:
            self._arrive(qpos, qvel)
            self._next()
        elif not self._begun:
            self._begun = True
            try:
                plan = self._planned(task, qpos, qvel)
            except (ValueError, FloatingPointError) as error:
                self.trouble = f"no plan: {error}"
                return
            self.plans.append(plan)
            self.legs.begin(plan)
        self.trouble = self.trouble or self.legs.trouble

    def _planned(self, task: StepTo | Jump, qpos: np.ndarray, qvel: np.ndarray) -> Plan:
        """Return the plan of a motion from where the robot stands.

        Raises:
            ValueError: there is none that the robot can follow.
            FloatingPointError: it is not finite.
        """
        axes = Axes(self.wheels.base.state)
        x = axes.state(locked_state(qpos, qvel))
        if isinstance(task, Jump):
            plan = plan_leap(x, self.rolling.target, task.leap, self.ocp.payload)
            check(plan)
            return plan
        feet = Body().at(x)[0]

        def heights(points: np.ndarray) -> np.ndarray:
            return self.ground.below(points @ axes.R.T + axes.origin)[0]

        landings, moved = [], np.zeros(4)
        for leg, ahead in task.x.items():
            i = LEGS.index(leg)
            end = np.array(feet[i])
            end[0] = (ahead - axes.origin[0]) / axes.R[0, 0] - feet[i, 1] * axes.R[0, 1] / axes.R[0, 0]
            end[2] = heights(end[None])[0] + WHEEL_RADIUS
            moved[i] = end[0] - feet[i, 0]
            landings.append((i, end))
        forward = np.array([moved.mean(), 0.0])
        plan = plan_stride(x, self.rolling.target, landings, forward, heights, self.ocp.payload, task.gait)
        check(plan)
        return plan

    def _arrive(self, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Move the commanded base on by what the stride has moved the robot."""
        base = self.wheels.base
        axes = Axes(base.state)
        plan = self.plans[-1]
        base.state[:2] += (axes.R @ [*plan.schedule.advance, 0.0])[:2]
        x = Axes(base.state).state(locked_state(qpos, qvel))
        # Wheels that skidded go back to their places beside each other once they may roll.
        front, rear = Body().at(x)[0].reshape(2, 2, 3)[:, :, 0].mean(axis=1)
        base.positions = np.column_stack([[front, front, rear, rear], base.positions[:, 1]])
        self.legs.stay(self.rolling.target)
        self.legs.resume(x)

    def _change(self, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Hand over from one controller to the other."""
        x = Axes(self.wheels.base.state).state(locked_state(qpos, qvel))
        if self.driver is self.legs:
            self.legs.lock(qpos, self.wheels.steering)
            self.legs.stay(self.rolling.target)
            self.legs.resume(x, self.rolling)
        else:
            self.rolling.resume(x, self.legs)

    def _align(self) -> None:
        """Steer the wheels straight ahead, no faster than they can."""
        base = self.wheels.base
        most = base.limits.steering_rate * FEEDBACK
        base.steering = base.steering + np.clip(
            np.pi * np.round(base.steering / np.pi) - base.steering, -most, most
        )


def check(plan: Plan) -> None:
    """Refuse a plan that the robot could not follow.

    Raises:
        ValueError: it does not keep to its wheels' paths, or pulls at the ground.
    """
    for swing in plan.schedule.swings:
        nodes = range(swing.first, swing.last)
        asked = np.array([plan.schedule.targets[k].feet[swing.leg] for k in nodes])
        off = np.linalg.norm(plan.feet[swing.first : swing.last, swing.leg] - asked, axis=1).max()
        if off > _DEVIATION:
            raise ValueError(f"{LEGS[swing.leg]} misses its path by {off:.3f} m")
    if plan.forces[..., 2].min() < -_FORCE:
        raise ValueError(f"a wheel pulls at the ground with {-plan.forces[..., 2].min():.1f} N")


def describe(task: Task) -> dict[str, Any]:
    """Return a task as JSON can hold it."""
    match task:
        case Drive():
            return {"drive": [float(task.duration), [float(v) for v in task.twist]]}
        case RollTo():
            return {"roll_to": float(task.x), "legs": list(task.legs), "speed": float(task.speed)}
        case StepTo():
            return {"step_to": {leg: float(x) for leg, x in task.x.items()}}
        case Jump():
            return {"jump": float(task.leap.height), "distance": float(task.leap.distance)}
