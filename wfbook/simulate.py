"""Chapter 8: execute a plan in MuJoCo through the whole-body controller.

Physics runs at 1 kHz, the controller at 500 Hz, and a torque acts one delay after it was computed
(paper A: 9 ms).
"""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import numpy as np

from wfbook.estimator import TOUCH, Estimator
from wfbook.go1 import RADII, Go1
from wfbook.go1_dynamics import MOTORS, WHEELS, Go1Dynamics, dot, roll_pitch_yaw
from wfbook.modes import END_EFFECTORS, LEGS
from wfbook.reference import TICK, Gains, Ground, Reference
from wfbook.runs import Run, metrics_of
from wfbook.sensors import SensorNoise, Sensors
from wfbook.tracking import Habits, Tracker
from wfbook.wbc import WholeBodyController, contact_basis, weight_share

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan
    from wfbook.terrain import Terrain

__all__ = ["Run", "run"]

Continuation = Callable[[float, Tracker, Go1Dynamics], tuple["Plan", int] | None]
"""From time, tracker and what the robot knows of itself: a plan to go on with, and the first slot in which it
differs from the present one; None to go on as before."""

SETTLE = 0.5
"""Time in which the robot comes to rest in the plan's first posture."""

_FALLEN_TILT = np.cos(np.radians(60.0))


def run(
    plan: "Plan",
    delay: float = 0.009,
    state: str = "true",
    hold: float = 1.0,
    seed: int = 0,
    progress: Callable[[float, float], None] | None = None,
    push: tuple[np.ndarray, float, float] | None = None,
    joint_friction: float = 0.0,
    trunk_mass_scale: float = 1.0,
    gains: Gains | None = None,
    habits: Habits | None = None,
    wheel_model: str = "encoder",
    noise: SensorNoise | None = None,
    real_terrain: "Terrain | None" = None,
    continuation: Continuation | None = None,
) -> Run:
    """Execute a plan: settle in its first posture, follow it, stand still at its end.

    A fall ends the run; it is reported in the metrics, not raised.

    Args:
        plan: what to do; a polished one if it is to succeed.
        delay: after which a torque acts, a whole number of milliseconds.
        state: what the controller knows: ``"true"``, MuJoCo's state, or ``"estimated"``, what noisy sensors
            and :mod:`wfbook.estimator` make of it.
        hold: time to stand at the end.
        seed: of the small random error in the start posture (2 mrad in each joint) and of the sensors.
        progress: called with simulated and total time, ten times a simulated second.
        push: force ``(3,)`` on the trunk in the world, its start after the plan's, and its duration.
        joint_friction: dry friction in the simulated joints, N m, which the controller does not know.
        trunk_mass_scale: of the simulated trunk, likewise.
        gains: of the controller.
        habits: of the tracker, if not all of them.
        wheel_model: of the estimator, one of :data:`wfbook.estimator.WHEEL_MODELS`.
        noise: of the simulated sensors, which the estimator does not know: it trusts the usual ones.
        real_terrain: on which the robot walks, if not on the one of the plan, which is all that the
            controller and the estimator know.
        continuation: asked after every tick for a plan to go on with (see :mod:`wfbook.receding`).

    Raises:
        ValueError: an argument is out of range, or the plan's first posture is out of reach.
    """
    if state not in ("true", "estimated"):
        raise ValueError(f"state: {state!r} is neither 'true' nor 'estimated'")
    for name, value in (("delay", delay), ("hold", hold)):
        if not 0.0 <= value < 100.0:
            raise ValueError(f"{name}: {value!r} is not between 0 and 100 s")
    estimator = Estimator(wheel_model)
    if state == "true":
        estimator = None
    robot = Go1(real_terrain or plan.terrain, joint_friction, trunk_mass_scale)
    execution = _Execution(plan, delay, robot, Sensors(seed, noise), seed, push, gains, habits, estimator)
    execution.meta |= {"joint_friction": joint_friction, "trunk_mass_scale": trunk_mass_scale}
    return execution.run(hold, progress, continuation)


class _Execution:
    """One run in progress: the simulated robot, its controller and the log."""

    def __init__(
        self,
        plan: "Plan",
        delay: float,
        robot: Go1,
        sensors: Sensors,
        seed: int,
        push: tuple[np.ndarray, float, float] | None,
        gains: Gains | None,
        habits: Habits | None,
        estimator: Estimator | None,
    ) -> None:
        self.plan, self.delay, self.push = plan, delay, push
        self.robot = robot
        self.dynamics = Go1Dynamics()
        self.truth = self.dynamics if estimator is None else Go1Dynamics()
        self.controller = WholeBodyController(self.dynamics, gains)
        self.tracker = Tracker(plan, delay, habits)
        self.step_time = float(self.robot.model.opt.timestep)
        self.steps_a_tick = round(TICK / self.step_time)
        kinds = np.array([END_EFFECTORS.index(name) for name in plan.meta["start_end_effectors"]])
        qpos = self.dynamics.posture(plan.x[0], self.tracker.lean.at(-SETTLE)[0], self.tracker.start_ends())
        qpos[1 + MOTORS] += 0.002 * np.random.default_rng(seed).standard_normal(12)
        self.robot.reset(qpos, kinds)
        self.estimator, self.sensors = estimator, sensors
        if estimator is not None:
            self.truth.update(qpos, np.zeros(22))
            estimator.start(qpos[:3], self.sensors.tilted(self.truth.R_wb))
        self.normals = self.tracker.footing.normals
        self.log: dict[str, list] = {name: [] for name in Run.LOGGED}
        self.times: dict[str, list] = {"tick": [], "estimator": []}
        self.work = np.zeros(2)
        self.asked = np.zeros((4, 3))
        self.slip, self.slip_max, self.standing = np.zeros((4, 2)), 0.0, np.zeros(4, int)
        self.astray = 0.0
        self.meta = {
            "delay": delay,
            "seed": seed,
            "state": "true" if estimator is None else "estimated",
            "wheel_model": None if estimator is None else estimator.wheel_model,
            "sensor_noise": None if estimator is None else asdict(sensors.noise),
            "settle": SETTLE,
            "plan": {
                key: plan.meta.get(key) for key in ("stage", "objective", "bound", "gap", "status", "nodes")
            },
        }

    def run(
        self,
        hold: float,
        progress: Callable[[float, float], None] | None,
        continuation: Continuation | None,
    ) -> Run:
        """Simulate to the end or to the fall, and return the log."""
        waiting: deque[np.ndarray] = deque()
        fall_time, began, step = None, time.perf_counter(), -1
        while step < (steps := self._steps(hold)):
            step += 1
            t = step * self.step_time - SETTLE
            if step % self.steps_a_tick == 0:
                command = self._tick(t)
                if continuation is not None:
                    began += self._go_on(t, continuation)
                if not waiting:
                    waiting.extend([command] * round(self.delay / self.step_time))
            waiting.append(command)
            torque = waiting.popleft()
            if step % self.steps_a_tick == 0:
                self.log["tau"].append(torque)
            self._push(t)
            self._physics(torque, t)
            if progress is not None and step % 100 == 0:
                progress(t + SETTLE, steps * self.step_time)
            if self._fallen():
                fall_time = t
                break
        wall = time.perf_counter() - began
        data = {name: np.array(values) for name, values in self.log.items()}
        times = {name: 1e3 * np.array(values) for name, values in self.times.items()}
        metrics = metrics_of(
            data,
            self.plan,
            self.tracker.flights,
            self.dynamics.mass,
            self.work,
            self.slip_max,
            self.astray,
            fall_time,
            self.controller.rescues,
            times | {"wall": wall},
            self.meta,
        )
        return Run(
            **data,
            metrics=metrics,
            meta=self.meta,
            terrain=self.robot.terrain,
            joint_names=self.robot.joint_names,
            times=times,
        )

    def _steps(self, hold: float) -> int:
        """Return how many milliseconds there are to simulate, as far as is known."""
        return round((SETTLE + float(self.plan.t[-1] - self.plan.t[0]) + hold) / self.step_time)

    def _go_on(self, t: float, continuation: Continuation) -> float:
        """Follow another plan if there is one, and return the wall time that it took to ask."""
        asked = time.perf_counter()
        found = continuation(t, self.tracker, self.dynamics)
        if found is not None:
            self.plan, slot = found
            self.tracker.follow(self.plan, slot)
        return time.perf_counter() - asked

    def _tick(self, t: float) -> np.ndarray:
        """Run the controller once, log, and return the torques it commands."""
        robot, dynamics, tracker, truth = self.robot, self.dynamics, self.tracker, self.truth
        forces = robot.contact_forces()
        loads = np.sqrt(dot(forces, forces))
        touching = loads > TOUCH
        qpos, qvel, estimator_time = self._known(touching)
        if truth is not dynamics:
            truth.update(robot.data.qpos, robot.data.qvel)
        began = time.perf_counter()
        dynamics.update(qpos, qvel)
        ref, ground = tracker.update(t, dynamics, touching, self.asked)
        for leg, kind in tracker.switches(t, dynamics.centres, robot.end_effectors):
            if loads[LEGS.index(leg)] < TOUCH / 3:
                robot.set_end_effector(leg, kind)
        present = robot.end_effectors.astype(bool)
        share = weight_share(dynamics, ref.com_acceleration, ref.stance)
        ref = replace(ref, wheels=present, forces=share)
        command = self.controller.tick(ref, ground)
        self.asked, self.normals = command.forces, ground.normals
        elapsed = time.perf_counter() - began
        offsets = truth.contact_offsets(ground.normals, present)
        self._slip(ground, ref, offsets, forces)
        sample = {
            "t": t,
            "qpos": robot.data.qpos.copy(),
            "qvel": robot.data.qvel.copy(),
            "tau_command": command.torques,
            "com": truth.com,
            "com_velocity": truth.com_velocity,
            "rpy": roll_pitch_yaw(truth.R_wb),
            "rpy_ref": roll_pitch_yaw(ref.R_wb),
            "p": truth.centres + offsets,
            "contact_force": forces,
            "in_contact": loads > 1.0,
            "end_effector": robot.end_effectors,
            "stance": ref.stance,
            "com_ref": ref.com - tracker.drift.offset,
            "com_velocity_ref": ref.com_velocity,
            "p_ref": ref.ends + dynamics.contact_offsets(ground.normals, present),
            "solved": command.solved,
            "base_estimate": qpos[:7].copy(),
            "base_velocity_estimate": qvel[:6].copy(),
            "com_estimate": dynamics.com,
        }
        for name, value in sample.items():
            self.log[name].append(value)
        self.times["tick"].append(elapsed)
        self.times["estimator"].append(estimator_time)
        return command.torques

    def _known(self, touching: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the configuration and velocity the controller works with, and the time to estimate them."""
        qpos, qvel = self.robot.data.qpos, self.robot.data.qvel
        if self.estimator is None:
            return qpos, qvel, 0.0
        reading = self.sensors.read(qpos, qvel)
        began = time.perf_counter()
        self.estimator.update(reading, touching, self.robot.end_effectors.astype(bool), self.normals)
        base, velocity = self.estimator.base()
        elapsed = time.perf_counter() - began
        known, known_velocity = np.zeros(23), np.zeros(22)
        known[:7], known_velocity[:6] = base, velocity
        known[1 + MOTORS], known_velocity[MOTORS] = reading.joint_angles.ravel(), reading.joint_rates.ravel()
        known_velocity[WHEELS] = reading.wheel_rates
        return known, known_velocity, elapsed

    def _slip(self, ground: Ground, ref: Reference, offsets: np.ndarray, forces: np.ndarray) -> None:
        """Add up how far standing feet slide, and wheels sideways; a foot's rolling is no slip.

        Also note how far their contacts are beside their regions. ``offsets`` ``(4, 3)`` are those of the
        contacts from the legs' ends.
        """
        standing = ref.stance & (forces[:, 2] > TOUCH)
        self.standing = standing * (self.standing + 1)
        basis = contact_basis(self.truth, ground, ref.wheels)
        velocity = (basis @ self.truth.contact_velocity(offsets)[:, :, None])[:, :2, 0]
        velocity[:, 0] *= ~ref.wheels
        self.slip = (self.standing > 10)[:, None] * (self.slip + TICK * velocity)
        self.slip_max = max(self.slip_max, *np.hypot(*self.slip.T).tolist())
        for leg in np.flatnonzero(standing):
            radius, rolls = RADII[int(ref.wheels[leg])], bool(ref.wheels[leg])
            aside = self.tracker.footing.astray(leg, self.truth.centres[leg], radius, rolls)
            self.astray = max(self.astray, aside)

    def _push(self, t: float) -> None:
        """Apply the push while it lasts."""
        if self.push is not None:
            force, start, duration = self.push
            self.robot.push(np.asarray(force, float) * (start <= t < start + duration))

    def _physics(self, torque: np.ndarray, t: float) -> None:
        """Simulate a millisecond and account for the motors' work once the plan has begun."""
        before = self.robot.data.qvel.take(MOTORS)
        self.robot.step(torque)
        if t >= 0.0:
            power = torque * 0.5 * (before + self.robot.data.qvel.take(MOTORS))
            positive, total = np.maximum(power, 0.0).sum(), power.sum()
            self.work += self.step_time * np.array([2.0 * positive - total, positive])

    def _fallen(self) -> bool:
        """Whether the trunk is tipped over or anything but the legs' ends lies on the ground."""
        _w, x, y, _z = self.robot.data.qpos[3:7]
        upright = 1.0 - 2.0 * (x * x + y * y) > _FALLEN_TILT
        return not upright or self.robot.touches_with_hull()
