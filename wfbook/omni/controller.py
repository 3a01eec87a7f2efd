"""Chapter 12: the whole-body controller: receding horizon, linear feedback, motors, wheels (Paper B, Fig. 5).

Three rates. Every :data:`PLAN` the optimal control problem is solved on from its last solution, one
iteration. Every :data:`FEEDBACK` the torques follow the gains of that solution (eq. 21). In every step of the
simulation motors add a weak PD loop of their own on the planned joint motion, from their own encoders.

The problem is stated in the axes of the commanded base (:mod:`.rolling`), and the wheels follow that base.
It knows the ground ahead: how high each wheel will ride in every node, and how fast it rises. Without that a
horizon of 0.4 s takes the slope of now for the ground of then, and on seven waves at 1 m/s the robot falls.
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from wfbook.modes import LEGS
from wfbook.omni.base import Base
from wfbook.omni.costs import ARM_JOINTS, Weights
from wfbook.omni.habits import Habits
from wfbook.omni.locked import (
    MOTORS,
    NQ_LOCKED,
    Target,
    contact_model,
    holding_effort,
    locked_state,
    nominal_target,
)
from wfbook.omni.problem import OptimalControl
from wfbook.omni.robot import (
    DAMPING,
    NU,
    STEERS_V,
    STIFFNESS,
    WHEEL_RADIUS,
    WHEELS_V,
)
from wfbook.omni.rolling import Axes, Wheels
from wfbook.omni.waves import Ground

PLAN, FEEDBACK = 0.02, 0.002
"""Periods of the optimal control problem and of the linear feedback (500 Hz), in seconds."""

_SHARE = 0.05
"""Of the motors' own loops that is left where the feedback gains already stiffen the joints."""
_HAND_SPEED, _LEAD = 0.3, 0.03
"""How fast the hand is asked to go where it should be, and how far ahead of where it is the asking may be: a
jump, or a place out of reach, asks for more than motors and ground can do."""
_INTEGRAL = 1.0
"""Rate, 1/s, at which the hand's lasting error is taken away."""
_TRIAL, _WEIGHING, _HEAVIEST = 0.01, 0.05, 3.0
"""Of the payload: step of the derivative, kg; share of the error taken away each time; largest mass."""
_STEPS, _DAMPED, _LARGEST_STEP, _LARGEST_SAG = 2, 1e-4, 0.02, 0.3


@dataclass(frozen=True)
class Command:
    """What the motors are told until the next command.

    Attributes:
        torques: ``(23,)`` fed forward.
        angles: ``(23,)`` to hold.
        rates: ``(23,)``.
        stiffness: ``(23,)`` of the motors' own loops.
        damping: ``(23,)``.
    """

    torques: np.ndarray
    angles: np.ndarray
    rates: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray


class OnWheels:
    """What every controller here shares: a commanded base, its axes, wheels, and what was measured late.

    Args:
        ground: that the wheels are on.
        target: of the hand and the body, over level ground; by default Paper B's.
        base: that is commanded.
        delay: age of what is measured, in seconds.

    Attributes:
        wheels: with the commanded base.
        solved: whether the last command came from a finite solution.
    """

    def __init__(self, ground: Ground, target: Target | None, base: Base | None, delay: float) -> None:
        self.ground = ground
        self.target = nominal_target() if target is None else target
        self.wheels = Wheels(Base() if base is None else base)
        self.solved = True
        self.delay = delay
        self.model = contact_model()
        self._data = self.model.createData()
        self._axles = [self.model.getFrameId(f"{leg}_axle") for leg in LEGS]
        self._hand = self.model.getFrameId("hand")
        self._past = deque([self.wheels.base.state.copy()], maxlen=1 + round(delay / FEEDBACK))
        self._rates = np.zeros(4)

    def _seen(self, qpos: np.ndarray, qvel: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, Axes]:
        """Move the base on; return the state in the axes of when it was measured, and these axes."""
        self.wheels.advance(wanted, FEEDBACK)
        self._past.append(self.wheels.base.state.copy())
        axes = Axes(self._past[0])
        return axes.state(locked_state(qpos, qvel)), axes

    def _roll(self, x: np.ndarray, steering: np.ndarray, axes: Axes) -> tuple[np.ndarray, np.ndarray]:
        """Set the wheels' rates; return their middles and the ground's normals, ``(4, 3)``, in the axes."""
        pin.framesForwardKinematics(self.model, self._data, x[:NQ_LOCKED])
        middles = np.array([self._data.oMf[i].translation for i in self._axles])
        turns = zip(self._axles, steering, strict=True)
        along = np.array([self._data.oMf[i].rotation[:2] @ [np.cos(a), np.sin(a), 0.0] for i, a in turns])
        along = along / np.linalg.norm(along, axis=1, keepdims=True) @ axes.R[:2, :2].T
        _, normals = self.ground.ride((middles @ axes.R.T + axes.origin)[:, :2], along)
        normals = normals @ axes.R
        self._rates = self.wheels.command(middles, normals)
        return middles, normals

    def _command(
        self, angles: np.ndarray, rates: np.ndarray, torques: np.ndarray, share: float, push: np.ndarray
    ) -> Command:
        """Return a command.

        Args:
            angles: ``(14,)`` of legs and arm.
            rates: ``(14,)`` likewise.
            torques: ``(14,)`` likewise, fed forward.
            share: of the motors' own loops there.
            push: ``(4,)`` torques fed forward to the wheels.
        """
        command = Command(np.zeros(NU), np.zeros(NU), np.zeros(NU), STIFFNESS.copy(), DAMPING.copy())
        command.angles[MOTORS], command.rates[MOTORS], command.torques[MOTORS] = angles, rates, torques
        command.stiffness[MOTORS] *= share
        command.damping[MOTORS] *= share
        command.angles[STEERS_V - 6] = self.wheels.steering
        command.rates[WHEELS_V - 6], command.torques[WHEELS_V - 6] = self._rates, push
        return command


class WholeBody(OnWheels):
    """The paper's controller in wheeled mode.

    Args:
        ground: that the wheels are on.
        target: of the hand and the body, over level ground; by default Paper B's.
        base: that is commanded.
        delay: age of what is measured; the state is predicted that much ahead.
        weights: of eq. 17.
        nodes: of the horizon.
        dt: time step of a node.
        habits: what it does besides; everything without it.

    Attributes:
        ocp: the problem.
    """

    def __init__(
        self,
        ground: Ground,
        target: Target | None = None,
        base: Base | None = None,
        delay: float = 0.0,
        weights: Weights | None = None,
        nodes: int = 20,
        dt: float = 0.02,
        habits: Habits | None = None,
    ) -> None:
        super().__init__(ground, target, base, delay)
        self.habits = Habits() if habits is None else habits
        self.wheels.keep_places = self.habits.keeps_places
        self.ocp = OptimalControl(nodes, dt, weights=weights)
        self._since = np.inf
        self._push, self._offset, self._turn = np.zeros(4), np.zeros(3), np.zeros(3)
        # Torques that acted since the state before the last one was measured, the oldest first.
        self._sent: deque[np.ndarray] = deque(maxlen=round((delay + PLAN) / FEEDBACK))
        self._goal: np.ndarray | None = None
        self._before: np.ndarray | None = None

    def tick(self, qpos: np.ndarray, qvel: np.ndarray, wanted: np.ndarray) -> Command:
        """Return the command for the next :data:`FEEDBACK` seconds.

        Args:
            qpos: ``(30,)`` measured.
            qvel: ``(29,)`` measured.
            wanted: ``(3,)`` twist.
        """
        x, axes = self._seen(qpos, qvel, wanted)
        self._since += FEEDBACK
        due = self._since >= PLAN - 1e-9
        if due and self.habits.weighs:
            self._weigh(x)
        late = round(self.delay / FEEDBACK)
        if self.habits.predicts and late and len(self._sent) >= late:
            x = self.ocp.predict(x, np.mean(list(self._sent)[-late:], axis=0), self.delay)
            axes = Axes(self.wheels.base.state)  # they have gone along meanwhile
        if due:
            self._plan(x, qpos[1 + STEERS_V], axes)
            self._since = 0.0
        planned, torques = self.ocp.follow(self._since / self.ocp.dt, x)
        if not self.habits.feeds_back:
            torques = np.array(self.ocp.us[0])
        self._sent.append(torques)
        return self._command(planned[7:NQ_LOCKED], planned[27:], torques, _SHARE, self._push)

    def resume(self, x: np.ndarray, other: "WholeBody | None" = None) -> None:
        """Begin anew from rest, with the base where it is.

        Args:
            x: ``(41,)`` state in the base's axes.
            other: a controller whose estimate of the payload and of lasting errors is taken over.
        """
        if other is not None:
            self.ocp.load(other.ocp.payload)
            self._offset, self._turn = other._offset.copy(), other._turn.copy()
            self._sent.extend(other._sent)
        self._past.extend([self.wheels.base.state.copy()] * self._past.maxlen)
        self._goal = self._before = None
        self._since = np.inf
        self.ocp.hold(x)

    def _weigh(self, x: np.ndarray) -> None:
        """Correct the payload by how the arm accelerated since the last time, and how it should have.

        A mass in the hand that nobody reckons with makes the arm sag, and what is worse, gains that are right
        for a light wrist make a heavy one swing.
        """
        before, self._before = self._before, x
        if before is None or len(self._sent) < self._sent.maxlen:
            return
        u = np.mean(list(self._sent)[: round(PLAN / FEEDBACK)], axis=0)
        mass, ocp = self.ocp.payload, self.ocp
        expected = ocp.acceleration(before, u)[ARM_JOINTS]
        ocp.load(mass + _TRIAL)
        heavier = (ocp.acceleration(before, u)[ARM_JOINTS] - expected) / _TRIAL
        missing = (x[NQ_LOCKED:] - before[NQ_LOCKED:])[ARM_JOINTS] / PLAN - expected
        step = _WEIGHING * float(missing @ heavier) / (float(heavier @ heavier) + 1.0)
        ocp.load(float(np.clip(mass + step, 0.0, _HEAVIEST)))

    def _plan(self, x: np.ndarray, steering: np.ndarray, axes: Axes) -> None:
        """Solve the problem on from its last solution, one iteration."""
        ocp = self.ocp
        middles, normals = self._roll(x, steering, axes)
        ocp.place_contacts(x, steering, normals)
        heights = self._heights(middles)
        if self.habits.starts_warm:
            ocp.shift()
        else:
            ocp.hold(x)
        ocp.roll(self.wheels.velocities(middles, heights, ocp.dt))
        target = replace(self._corrected(), effort=holding_effort(ocp.model, x))
        rises = middles[:, 2].mean() - WHEEL_RADIUS + (heights[1:-1] - heights[1]).mean(axis=1)
        coms = self.target.com + rises[:, None] * np.array([0.0, 0.0, 1.0])
        ocp.refer([replace(target, com=com) for com in coms])
        try:
            ocp.solve(x, 1)
            self.solved = True
        except FloatingPointError:
            self.solved = False
        self._push = WHEEL_RADIUS * ocp.forces(0)[:, 0]

    def _heights(self, middles: np.ndarray) -> np.ndarray:
        """Return how high the wheels' middles will be over the ground ahead, ``(nodes + 3, 4)``.

        The first row is a time step ago.
        """
        times = self.ocp.dt * np.arange(-1, self.ocp.nodes + 2)
        places, along = self.wheels.ahead(middles, times)
        heights = self.ground.ride(places.reshape(-1, 2), along.reshape(-1, 2))[0].reshape(-1, 4)
        if not self.habits.looks_ahead:
            heights = heights[1] + np.arange(-1, len(heights) - 1)[:, None] * (heights[1] - heights[0])
        return heights

    def _corrected(self) -> Target:
        """Return the target, approached at no more than a given speed, with the hand's lasting error counted.

        A payload that the model does not know of leaves the hand where its weight and the costs' pull are in
        balance. The integral of the error moves the reference until it is where it should be.
        """
        hand = self._data.oMf[self._hand]
        rate = PLAN * _INTEGRAL * self.habits.integrates
        if self._goal is None:
            self._goal = hand.translation.copy()
        way = self.target.hand - self._goal
        self._goal += way * min(1.0, PLAN * _HAND_SPEED / (np.linalg.norm(way) + 1e-9))
        lead = self._goal - hand.translation
        self._goal = hand.translation + lead * min(1.0, _LEAD / (np.linalg.norm(lead) + 1e-9))
        self._offset = np.clip(self._offset + rate * (self._goal - hand.translation), -0.05, 0.05)
        turn = pin.log3(hand.rotation.T @ self.target.hand_rotation)
        self._turn = np.clip(self._turn + rate * turn, -0.5, 0.5)
        return replace(
            self.target,
            hand=self._goal + self._offset,
            hand_rotation=self.target.hand_rotation @ pin.exp3(self._turn),
        )


class ArmAlone(OnWheels):
    """Inverse kinematics of the arm on legs that hold their posture: what paper B compares itself with.

    The arm puts the hand where it should be over the trunk as the controller takes it to be. What its joints
    lack on the way there, under a payload that nobody knows of, is integrated and asked for as well: the
    comparison is with an arm whose motors hold what they are told.

    Args:
        ground: that the wheels are on.
        target: of the hand and the legs; by default Paper B's.
        base: that is commanded.
        delay: age of what is measured.
        level: whether the trunk is taken to be level, where it is; otherwise its true pose is known.
    """

    def __init__(
        self,
        ground: Ground,
        target: Target | None = None,
        base: Base | None = None,
        delay: float = 0.0,
        level: bool = True,
    ) -> None:
        super().__init__(ground, target, base, delay)
        self.level = level
        self._arm = self.target.posture[8:].copy()
        self._sag = np.zeros(6)
        self._since = np.inf

    def tick(self, qpos: np.ndarray, qvel: np.ndarray, wanted: np.ndarray) -> Command:
        """Return the command for the next :data:`FEEDBACK` seconds; see :meth:`WholeBody.tick`."""
        x, axes = self._seen(qpos, qvel, wanted)
        self._since += FEEDBACK
        if self._since >= PLAN - 1e-9:
            self._roll(x, qpos[1 + STEERS_V], axes)
            self._since = 0.0
        before = self._arm
        lag = FEEDBACK * _INTEGRAL * (before - x[15:NQ_LOCKED])
        self._sag = np.clip(self._sag + lag, -_LARGEST_SAG, _LARGEST_SAG)
        self._arm = self._reach(x)
        angles = np.concatenate([self.target.posture[:8], self._arm + self._sag])
        rates = np.concatenate([np.zeros(8), (self._arm - before) / FEEDBACK])
        return self._command(angles, rates, holding_effort(self.model, x), 1.0, np.zeros(4))

    def _reach(self, x: np.ndarray) -> np.ndarray:
        """Return the arm's angles ``(6,)`` for the hand's target: damped steps from the last ones."""
        q = np.array(x[:NQ_LOCKED])
        if self.level:
            yaw = pin.rpy.matrixToRpy(pin.Quaternion(q[3:7]).toRotationMatrix())[2]
            q[3:7] = pin.Quaternion(pin.utils.rotate("z", yaw)).coeffs()
        wanted = pin.SE3(self.target.hand_rotation, self.target.hand)
        low, high = self.model.lowerPositionLimit[15:], self.model.upperPositionLimit[15:]
        arm = self._arm
        for _ in range(_STEPS):
            q[15:] = arm
            pin.framesForwardKinematics(self.model, self._data, q)
            error = pin.log6(self._data.oMf[self._hand].actInv(wanted)).vector
            J = pin.computeFrameJacobian(self.model, self._data, q, self._hand, pin.LOCAL)[:, 14:]
            step = J.T @ np.linalg.solve(J @ J.T + _DAMPED * np.eye(6), error)
            arm = np.clip(arm + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP), low, high)
        return arm
