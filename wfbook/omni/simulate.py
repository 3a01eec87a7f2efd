"""Chapter 12: the robot of paper B in MuJoCo under a controller, and what it measures late and wrongly.

Falls, hands that do not get where they should and solutions that are not finite end a run early: they are
noted in its events, the wheels are braked, and legs and arm hold where they are, until the robot is at rest.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from wfbook.omni.base import Base
from wfbook.omni.controller import FEEDBACK, ArmAlone, Command, OnWheels, WholeBody
from wfbook.omni.costs import Weights
from wfbook.omni.driving import holding_torques
from wfbook.omni.habits import Habits
from wfbook.omni.locked import MOTORS, Target, nominal_target
from wfbook.omni.machine import ON_LEGS, Mode
from wfbook.omni.merits import driving_of, hand_of
from wfbook.omni.noise import Noise
from wfbook.omni.on_legs import BRAKE, BRAKE_DAMPING
from wfbook.omni.robot import (
    DAMPING,
    HAND_REACH,
    NOMINAL_HEIGHT,
    NU,
    STIFFNESS,
    WHEELS_V,
    Omni,
    contact_offsets,
    posture,
)
from wfbook.omni.runs import TIMINGS, OmniRun
from wfbook.omni.two_modes import Drive, Task, TwoModes, describe
from wfbook.omni.waves import LENGTH, PEAK, RUN_UP, Ground, waves
from wfbook.terrain import Terrain

__all__ = ["CONTROLLERS", "TIMINGS", "Noise", "OmniRun", "Targets", "baseline_target", "run", "run_waves"]

Targets = Callable[[float, np.ndarray], Target]
"""From the time and the commanded base's pose ``(3,)`` to what the robot is asked for."""

CONTROLLERS = ("ddp", "ik-level", "ik-true")
"""The paper's; and inverse kinematics of the arm that takes the trunk to be level, or knows its true pose."""

_SETTLE = 0.5
_REST, _LONGEST_REST = 2.0, 6.0
_STILL, _STAYS_STILL = 0.02, 0.3
"""Speed of a trunk that is at rest, and for how long it must have been: one that rocks turns round, too."""
_TILT, _CROUCH = 0.6, 0.25
_LOST, _PROGRESS, _PATIENCE = 0.15, 0.01, 0.5
"""A hand that is further off than the first and has not come nearer by the second for the third is lost."""
_FAILURES = 5
_FELT = 15.0
"""Force of the ground on a wheel that a sensor in its fork feels, N."""


def baseline_target() -> Target:
    """Return the target of the arm alone on the waves: a hand as high, over a trunk that is carried lower.

    Legs that hold their posture lift the trunk by the waves' 0.2 m and pitch it by 0.35 rad on seven waves.
    From the nominal height the arm would run into its joints' limits on every crest; and with the hand where
    Paper B's robot has it here it would on seven waves when the trunk pitches forward. Shoulder and hand are
    then 0.34 m apart, elbow and fourth joint at their limits, the arm finds another way to fold and does not
    come back: 60 mm (standard deviation) where with the hand 0.1 m further ahead it is 1 mm. What is compared
    would be these limits.
    """
    return nominal_target(height=NOMINAL_HEIGHT - 0.5 * PEAK, hand_reach=HAND_REACH + 0.1)


def run_waves(speed: float = 0.5, count: int = 5, **options: Any) -> OmniRun:
    """Drive over the waves of Paper B's Fig. 6, from level ground to level ground.

    Args:
        speed: ahead.
        count: of waves.
        options: of :func:`run`; inverse kinematics gets :func:`baseline_target` if no target is given.
    """
    if options.get("controller", "ddp") != "ddp":
        options = {"target": baseline_target()} | options
    start = -RUN_UP + 0.7
    duration = (LENGTH - 2 * start) / speed
    return run(waves(count), [(duration, [speed, 0.0, 0.0])], start=start, **options)


def run(
    terrain: Terrain,
    course: Sequence[tuple[float, Sequence[float]] | Task],
    controller: str = "ddp",
    start: float = 0.0,
    delay: float = 0.0,
    noise: Noise | None = None,
    seed: int = 0,
    payload: float = 0.0,
    trunk_mass_scale: float = 1.0,
    push: tuple[Sequence[float], float, float] | None = None,
    target: Target | Targets | None = None,
    weights: Weights | None = None,
    habits: Habits | None = None,
    wheel_disturbance: Callable[[float], np.ndarray] | None = None,
    progress: Callable[[float, float], None] | None = None,
    rest: float = _REST,
) -> OmniRun:
    """Simulate a run.

    Args:
        terrain: to drive on; it must be level at height 0 around the start.
        course: wanted twists one after the other: seconds and ``(3,)``. Or tasks of :mod:`.two_modes`, among
            which such pairs may be: then the mode state machine is in the loop.
        controller: one of :data:`CONTROLLERS`.
        start: x of the robot at first; it faces along x.
        delay: age of what the controller measures, s; it knows it.
        noise: of what it measures; none without it.
        seed: of the noise.
        payload: mass in the hand that the controller does not know of, kg.
        trunk_mass_scale: of the trunk's true mass; the controller believes in 1.
        push: force ``(3,)`` at the trunk, when it begins, how long it lasts.
        target: of hand and body, or a function of the time and the commanded base's pose; by default
            Paper B's.
        weights: of eq. 17.
        habits: of the whole-body controller.
        wheel_disturbance: from time to what is added to the wheels' commanded rates ``(4,)``; no controller
            knows of it.
        progress: called ten times a simulated second with the time and the end of the course.
        rest: seconds after the course.

    Raises:
        ValueError: an unknown controller, no course, or an option out of its range or without effect.
    """
    if controller not in CONTROLLERS:
        raise ValueError(f"controller: {controller!r} is none of {', '.join(CONTROLLERS)}")
    tasks = [Drive(*item) if isinstance(item, tuple | list) else item for item in course]
    if not tasks or not all(task.duration > 0.0 for task in tasks if isinstance(task, Drive)):
        raise ValueError("course: needs twists that last")
    timed = all(isinstance(task, Drive) for task in tasks)
    if not timed and controller != "ddp":
        raise ValueError(f"controller: {controller!r} can't step")
    if not timed and (callable(target) or habits is not None):
        raise ValueError("course: with tasks besides twists there is one target, and habits stay as they are")
    for name, value, least in (("delay", delay, 0.0), ("payload", payload, 0.0), ("rest", rest, 0.0)):
        if not least <= value < np.inf:
            raise ValueError(f"{name}: {value!r} must be at least {least:g} and finite")
    if not 0.0 < trunk_mass_scale < np.inf:
        raise ValueError(f"trunk_mass_scale: {trunk_mass_scale!r} must be positive and finite")
    began = time.perf_counter()
    target = nominal_target() if target is None else target
    robot = Omni(terrain, trunk_mass_scale, payload)
    base, ground = Base(), Ground(terrain)
    base.state[0] = start
    targets, target = (target, target(0.0, base.state[:3])) if callable(target) else (None, target)
    qpos = posture()
    qpos[0], qpos[2], qpos[7 + MOTORS] = start, target.height, target.posture
    robot.reset(qpos)
    known = delay, noise, np.random.default_rng(seed)
    driver: OnWheels | TwoModes
    if not timed:
        driver = TwoModes(tasks, ground, target, base, delay, weights)
    elif controller == "ddp":
        driver = WholeBody(ground, target, base, delay, weights, habits=habits)
    else:
        driver = ArmAlone(ground, target, base, delay, level=controller == "ik-level")
    loop = _Loop(robot, driver, known, push)
    loop.targets, loop.wheel_disturbance, loop.progress = targets, wheel_disturbance, progress
    loop.rest = rest
    if timed:
        loop.drive([(task.duration, task.twist) for task in tasks])
    else:
        loop.perform()
    columns = {name: np.array([sample[name] for sample in loop.samples]) for name in loop.samples[0]}
    meta = {
        "controller": controller,
        "delay": delay,
        "noise": noise is not None,
        "seed": seed,
        "payload": payload,
        "payload_estimate": None if isinstance(driver, ArmAlone) else driver.ocp.payload,
        "trunk_mass_scale": trunk_mass_scale,
        "mass": float(robot.model.body_subtreemass[0]),
        "course": [
            [float(task.duration), [float(v) for v in task.twist]] if timed else describe(task)
            for task in tasks
        ],
    }
    result = OmniRun(**columns, terrain=terrain, events=loop.events, meta=meta)
    elapsed = time.perf_counter() - began
    result.metrics.update(metrics_of(result) | loop.timings(elapsed))
    return result


class _Loop:
    """The simulation's loop: physics at 1 kHz, the controller at 500 Hz, samples at 100 Hz."""

    def __init__(
        self,
        robot: Omni,
        driver: OnWheels | TwoModes,
        known: tuple[float, Noise | None, np.random.Generator],
        push: tuple[Sequence[float], float, float] | None,
    ) -> None:
        self.robot, self.driver, self.push = robot, driver, push
        self.targets: Targets | None = None
        self.wheel_disturbance: Callable[[float], np.ndarray] | None = None
        self.progress: Callable[[float, float], None] | None = None
        self.rest = _REST
        self.delay, self.noise, self.rng = known
        self.past = deque(maxlen=1 + round(1000 * self.delay))
        self.samples: list[dict[str, Any]] = []
        self.events: list[tuple[float, str]] = []
        self.times: list[float] = []
        self.command: Command | None = None
        self.tau = np.zeros(NU)
        self._astray = self._failures = 0
        self._nearest = np.inf
        self._tasks = driver if isinstance(driver, TwoModes) else None

    def drive(self, course: Sequence[tuple[float, Sequence[float]]]) -> None:
        """Settle, follow the course, and stop; or stop when something goes wrong."""
        ends = np.cumsum([duration for duration, _ in course])
        twists = np.array([twist for _, twist in course], dtype=float)

        def wanted(t: float) -> np.ndarray:
            leg = int(np.searchsorted(ends, t, side="right")) if t >= 0.0 else len(twists)
            return twists[leg] if leg < len(twists) else np.zeros(3)

        self._run(wanted, float(ends[-1]))

    def perform(self) -> None:
        """Settle, and let the driver carry out its tasks; or stop when something goes wrong."""
        self._run(lambda t: np.zeros(3), np.inf)

    def _run(self, wanted: Callable[[float], np.ndarray], stop: float) -> None:
        """Simulate until a time, or until the driver is done or something goes wrong, and then the rest."""
        step, data, moved = -round(1000 * _SETTLE), self.robot.data, -np.inf
        while True:
            t = step / 1000
            if self.events or (self._tasks is not None and self._tasks.done):
                stop = min(stop, t)
            if np.abs(data.qvel[:6]).max() > _STILL:
                moved = t
            moving = bool(self.events) and t < moved + _STAYS_STILL
            if t >= stop + (_LONGEST_REST if moving else self.rest):
                return
            if self.progress is not None and step % 100 == 0:
                self.progress(t, stop + self.rest if np.isfinite(stop) else t)
            self._step(step, wanted(t))
            step += 1

    def _step(self, step: int, wanted: np.ndarray) -> None:
        """Simulate a millisecond."""
        robot, t = self.robot, step / 1000
        felt = None if self._tasks is None else robot.contact_wrenches()[:, 2] > _FELT
        self.past.append((robot.data.qpos.copy(), robot.data.qvel.copy(), felt))
        if step % round(1000 * FEEDBACK) == 0 and not self.events:
            qpos, qvel, felt = self.past[0]
            if self.noise is not None:
                qpos, qvel = self.noise.disturb(qpos, qvel, self.rng)
            if self.targets is not None:
                self.driver.target = self.targets(t, self.driver.wheels.base.state[:3])
            if self._tasks is not None:
                self._tasks.felt, self._tasks.waiting = felt, t < 0.0
            began = time.perf_counter()
            self.command = self.driver.tick(qpos, qvel, wanted)
            self.times.append(time.perf_counter() - began)
            trouble = self._trouble()
            if trouble is not None:
                self.events.append((t, trouble))
                self.command = self._halt()
        if self.push is not None:
            force, begin, duration = self.push
            robot.push(np.asarray(force, float) * (begin <= t < begin + duration))
        command, data = self.command, robot.data
        rates = command.rates.copy()
        if self.wheel_disturbance is not None and not self.events:
            rates[WHEELS_V - 6] += self.wheel_disturbance(t)
        self.tau = command.torques + command.stiffness * (command.angles - data.qpos[7:])
        self.tau = self.tau + command.damping * (rates - data.qvel[6:])
        robot.step(self.tau)
        if step >= 0 and step % 10 == 0:
            self.samples.append(self._sample(t))

    def _trouble(self) -> str | None:
        """Return what is wrong, if anything."""
        data, driver = self.robot.data, self.driver
        _w, x, y, _z = data.qpos[3:7]
        level = self.robot.centres[:, 2].mean() - 0.085
        if np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)) > _TILT:
            return "fallen: the trunk is tipped over"
        if data.qpos[2] - level < _CROUCH or self.robot.touches_with_hull():
            return "fallen: the trunk is on the ground"
        self._failures = 0 if driver.solved else self._failures + 1
        if self._failures > _FAILURES or not np.isfinite(self.command.torques).all():
            return "the optimal control problem has no finite solution"
        off = np.linalg.norm(self._hand_ref() - self.robot.hand[0])
        self._astray += 1
        if off < max(_LOST, self._nearest - _PROGRESS):
            self._nearest, self._astray = off, 0
        if self._tasks is not None and self._tasks.trouble is not None:
            return self._tasks.trouble
        if not isinstance(driver, ArmAlone) and self._astray > _PATIENCE / FEEDBACK:
            return f"the hand is {off:.2f} m from where it should be: out of reach"
        return None

    def _halt(self) -> Command:
        """Return the command that brings the robot to rest: brakes, and joints that hold where they are.

        A robot that has fallen holds on weakly and carries nothing.
        """
        angles, fallen = np.array(self.robot.data.qpos[7:]), "fallen" in self.events[-1][1]
        torques = np.zeros(NU) if fallen else holding_torques(self.robot.data.qpos)
        stiffness, damping = (0.3 if fallen else 1.0) * STIFFNESS, DAMPING.copy()
        if self._tasks is not None:
            if self._tasks.machine.mode in ON_LEGS:
                stiffness[WHEELS_V - 6], damping[WHEELS_V - 6] = BRAKE, BRAKE_DAMPING
            self._tasks.halt()
        return Command(torques, angles, np.zeros(NU), stiffness, damping)

    def _hand_ref(self) -> np.ndarray:
        """Return where the hand should be in the world, ``(3,)``."""
        x, y, yaw = self.driver.wheels.base.state[:3]
        ahead, left, up = self.driver.target.hand
        cos, sin = np.cos(yaw), np.sin(yaw)
        return np.array([x + cos * ahead - sin * left, y + sin * ahead + cos * left, up])

    def _sample(self, t: float) -> dict[str, Any]:
        """Return one sample of each array of :class:`OmniRun`."""
        robot, data, base = self.robot, self.robot.data, self.driver.wheels.base
        normals = self.driver.ground.below(robot.centres)[1]
        hand, rotation = robot.hand
        yaw = pin.utils.rotate("z", base.state[2])
        return {
            "t": t,
            "qpos": data.qpos.copy(),
            "qvel": data.qvel.copy(),
            "com": data.subtree_com[1].copy(),
            "hand": hand,
            "p": robot.centres + contact_offsets(robot.axles, normals),
            "contact_force": robot.contact_wrenches()[:, :3],
            "pose": base.state[:3].copy(),
            "twist": base.twist,
            "steering": self.driver.wheels.steering.copy(),
            "tau": np.clip(self.tau, -robot.efforts, robot.efforts),
            "angles": self.command.angles.copy(),
            "hand_rotation": rotation,
            "hand_ref": self._hand_ref(),
            "hand_rotation_ref": yaw @ self.driver.target.hand_rotation,
            "mode": np.int8(Mode.WHEELED if self._tasks is None else self._tasks.machine.mode),
            "stance": np.ones(4, bool) if self._tasks is None else self._tasks.standing.copy(),
        }

    def timings(self, elapsed: float) -> dict[str, float]:
        """Return computing times: of ticks, of those that solve, of whole motions; and robot's over ours."""
        ticks, every = 1e3 * np.array(self.times), 10
        motions = [] if self._tasks is None else self._tasks.plans
        plans = ticks[::every]
        return {
            "tick_ms_median": float(np.median(ticks)),
            "tick_ms_p95": float(np.percentile(ticks, 95)),
            "tick_ms_p99": float(np.percentile(ticks, 99)),
            "plan_ms_p5": float(np.percentile(plans, 5)),
            "plan_ms_median": float(np.median(plans)),
            "plan_ms_p95": float(np.percentile(plans, 95)),
            "real_time_factor": float(len(self.times) * FEEDBACK / elapsed),
            "motion_s_max": max((plan.solve_time for plan in motions), default=0.0),
        }


def metrics_of(run: OmniRun) -> dict[str, Any]:
    """Return a run's figures of merit: those of :mod:`.merits`, and how the run went.

    ``finished`` is a run in which nothing went wrong; ``rest_speed_m_s`` the fastest that the trunk moved in
    the last tenth of a second.
    """
    return (
        hand_of(run)
        | driving_of(run, run.meta["mass"])
        | {
            "upright": not any("fallen" in what for _, what in run.events),
            "finished": not run.events,
            "rest_speed_m_s": float(np.abs(run.qvel[-10:, :3]).max()),
            "events": [f"{when:.2f} s: {what}" for when, what in run.events],
        }
    )
