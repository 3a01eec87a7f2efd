"""Chapter 12: the controller of legged mode: a planned stride, and a receding horizon (Paper B, Fig. 5).

Steering and wheels are locked: brakes hold the angles in which they were locked. The whole stride is planned
while the robot stands (:mod:`.motion`). Then the problem of a short horizon is solved again and again as in
wheeled mode (:mod:`.controller`), with the plan for a reference, and the torques follow its gains. Each
solution begins with the plan: in one iteration the last solution would not find which wheels carry next.

A wheel that swings is one that stands as soon as it is felt to touch late in its swing. If it is not felt
when it should, the stride waits for it and the wheel is lowered.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from wfbook.modes import LEGS
from wfbook.omni.base import Base
from wfbook.omni.controller import FEEDBACK, PLAN, Command, WholeBody
from wfbook.omni.costs import Weights
from wfbook.omni.locked import NQ_LOCKED, Target, holding_effort
from wfbook.omni.motion import CAREFUL, LANDING, Plan, keep_landed
from wfbook.omni.problem import OptimalControl
from wfbook.omni.robot import STEERS_V, WHEEL_RADIUS, WHEELS_V
from wfbook.omni.rolling import Axes
from wfbook.omni.waves import Ground

BRAKE, BRAKE_DAMPING = 150.0, 3.0
"""Of a locked wheel, N m/rad and N m s."""

LEGGED_WEIGHTS = Weights(leg=1e5, com=(1e4, 1e4, 5e3), posture=1.0, contact=0.1, least_force=15.0)
"""Of the short horizon; the posture is the plan's."""

_EXPECTED = 0.6
"""Share of a swing after which touching the ground means that the wheel has landed."""
_LOWERING, _SEARCH = 0.15, 0.8
"""Speed at which a wheel that has not found the ground is lowered, m/s; and for how long, s."""
_SHARE, _LANDED_SHARE = 0.05, 0.5
"""Of the motors' own loops: beside the gains of a plan, and without them after a jump's landing."""
_INTEGRAL = 1.0
"""Rate, 1/s, at which the hand's lasting error is taken away."""
_AWAITED = 4
"""Nodes after which a wheel that is late is expected on the ground."""


@dataclass(frozen=True)
class Path:
    """A plan's references, one for each time step of the controller.

    Attributes:
        targets: what is asked for.
        stances: ``(4,)`` bool each.
        xs: states ``(41,)``.
        us: torques ``(14,)``.
        K: gains ``(14, 40)`` of the plan.
        flies: whether there are steps in which no wheel stands.
        swings: leg, first step in the air, first step on the ground.
    """

    targets: list[Target]
    stances: list[tuple[bool, ...]]
    xs: list[np.ndarray]
    us: list[np.ndarray]
    K: list[np.ndarray]
    flies: bool
    swings: list[tuple[int, int, int]]


def path_of(plan: Plan, model: pin.Model, step: float = PLAN) -> Path:
    """Return a plan's references at a controller's time steps."""
    asked = plan.schedule
    fine = round(asked.dt / step)
    targets, stances, xs, us, K = [], [], [], [], []
    last = len(asked.targets) - 1
    for k in range(last * fine + 1):
        node, share = divmod(k, fine)
        node, share = (last - 1, 1.0) if node == last else (node, share / fine)
        after = min(node + 1, last)
        q = pin.interpolate(model, plan.xs[node][:NQ_LOCKED], plan.xs[after][:NQ_LOCKED], share)
        here, there = asked.targets[node], asked.targets[after]
        effort = min(node, last - 1)
        targets.append(
            replace(
                here,
                hand=here.hand + share * (there.hand - here.hand),
                com=plan.com[node] + share * (plan.com[after] - plan.com[node]),
                trunk=pin.Quaternion(q[3:7]).toRotationMatrix(),
                posture=q[7:],
                effort=plan.us[effort],
                feet=here.feet + share * (there.feet - here.feet),
            )
        )
        stances.append(asked.stances[min(k // fine, last)])
        velocity = plan.xs[node][NQ_LOCKED:]
        velocity = velocity + share * (plan.xs[after][NQ_LOCKED:] - velocity)
        xs.append(np.concatenate([q, velocity]))
        us.append(plan.us[effort])
        K.append(plan.K[effort])
    swings = [(swing.leg, swing.first * fine, swing.last * fine) for swing in asked.swings]
    flies = not all(any(stance) for stance in stances)
    return Path(targets, stances, xs, us, K, flies, swings)


class OnLegs(WholeBody):
    """The paper's controller in legged mode.

    Args:
        ground: that the wheels are on.
        target: of the hand and the body, over level ground.
        base: that is commanded; at rest.
        delay: age of what is measured.
        weights: of eq. 17.
        nodes: of the horizon.

    Attributes:
        standing: ``(4,)`` bool, which wheels are taken to stand.
        felt: ``(4,)`` bool, which wheels were felt to touch when the state was measured.
        finished: whether there is nothing left to do.
        trouble: what went wrong, if anything.
    """

    def __init__(
        self,
        ground: Ground,
        target: Target | None = None,
        base: Base | None = None,
        delay: float = 0.0,
        weights: Weights | None = None,
        nodes: int = 20,
    ) -> None:
        super().__init__(ground, target, base, delay, nodes=1)
        weights = LEGGED_WEIGHTS if weights is None else weights
        self.ocp = OptimalControl(nodes, PLAN, "legged", weights, mu=CAREFUL)
        self.standing = self.felt = np.ones(4, bool)
        self.trouble: str | None = None
        self.finished = True
        self._rest = self.target
        self._path: Path | None = None
        self._k, self._at, self._late = 0, 0, 0.0
        self._landed: set[int] = set()
        self._locked = np.zeros(4), np.zeros(4)

    def lock(self, qpos: np.ndarray, steering: np.ndarray) -> None:
        """Close the brakes where the wheels ``qpos (30,)`` are, and hold the steering ``(4,)``."""
        self._locked = np.array(steering), np.array(qpos[1 + WHEELS_V])

    def begin(self, plan: Plan) -> None:
        """Follow a plan from now on."""
        self._path, self._k, self._late = path_of(plan, self.model), 0, 0.0
        self._landed = set()
        self.finished = False

    def stay(self, target: Target) -> None:
        """Stand on all wheels."""
        self._path, self._rest, self.target, self.finished = None, target, target, True
        self.standing = np.ones(4, bool)

    def tick(self, qpos: np.ndarray, qvel: np.ndarray, wanted: np.ndarray) -> Command:
        """Return the command for the next 2 ms; see :meth:`WholeBody.tick`.

        A jump is over before a receding horizon has found its way from push to flight: its plan is followed
        by its own gains, those of the whole motion (Paper B, eq. 21). They hold until the wheels are felt, or
        should be; then motors hold the planned joint motion. For gains that take four wheels to stand ask
        for forces from wheels that hop.
        """
        if self._path is None or not self._path.flies:
            return super().tick(qpos, qvel, wanted)
        x, axes = self._seen(qpos, qvel, wanted)
        self._since += FEEDBACK
        if self._since >= PLAN - 1e-9:
            self._since = 0.0
            middles, normals = self._roll(x, qpos[1 + STEERS_V], axes)
            self.ocp.place_contacts(x, qpos[1 + STEERS_V], normals)
            stances, targets = self._asked(x, middles)
            self.ocp.stand(stances)
            self.target = targets[0]
        late = round(self.delay / FEEDBACK)
        if late and len(self._sent) >= late:
            x = self.ocp.predict(x, np.mean(list(self._sent)[-late:], axis=0), self.delay)
        path, state = self._path, self.ocp.state
        k = self._at
        share, after = self._since / PLAN, min(k + 1, len(path.xs) - 1)
        planned = state.integrate(path.xs[k], share * state.diff(path.xs[k], path.xs[after]))
        landed = k >= path.swings[0][2]
        torques = path.us[k] if landed else path.us[k] + path.K[k] @ state.diff(planned, x)
        self._sent.append(torques)
        share = _LANDED_SHARE if landed else _SHARE
        return self._command(planned[7:NQ_LOCKED], planned[27:], torques, share, np.zeros(4))

    def _weigh(self, x: np.ndarray) -> None:
        """Correct the payload at rest only: steps shake the arm for other reasons."""
        if self._path is None:
            super()._weigh(x)
        else:
            self._before = None

    def _plan(self, x: np.ndarray, steering: np.ndarray, axes: Axes) -> None:
        """Solve the problem on from its last solution, one iteration."""
        ocp = self.ocp
        middles, normals = self._roll(x, steering, axes)
        ocp.place_contacts(x, steering, normals)
        stances, targets = self._asked(x, middles)
        ocp.stand(stances)
        keep_landed(ocp, stances, round(LANDING / ocp.dt))
        self.target = targets[0]
        off, rotation = self._lasting()
        ocp.refer([replace(target, hand=target.hand + off, hand_rotation=rotation) for target in targets])
        self._warm(x)
        try:
            ocp.solve(x, 1)
            self.solved = True
        except FloatingPointError:
            self.solved = False

    def _command(
        self, angles: np.ndarray, rates: np.ndarray, torques: np.ndarray, share: float, push: np.ndarray
    ) -> Command:
        """Return a command with steering and wheels locked."""
        command = super()._command(angles, rates, torques, share, push)
        command.angles[STEERS_V - 6], command.angles[WHEELS_V - 6] = self._locked
        command.rates[WHEELS_V - 6] = 0.0
        command.stiffness[WHEELS_V - 6], command.damping[WHEELS_V - 6] = BRAKE, BRAKE_DAMPING
        return command

    def _landed_from_flight(self, k: int) -> int:
        """Return the step of a jump's plan that is due: a landing that comes early takes it there at once.

        One that is late is not waited for. In the plan's gains the wheels keep to places in the world, and a
        robot that falls lower than planned would draw its legs up.
        """
        _, first, landing = self._path.swings[0]
        expected = first + _EXPECTED * (landing - first)
        return landing if expected < k < landing and self.felt.sum() >= 2 else k

    def _lasting(self) -> tuple[np.ndarray, np.ndarray]:
        """Return by how much the hand is asked elsewhere ``(3,)``, and how it is to be turned ``(3, 3)``.

        On a plan's way nothing approaches slowly: the plan's hand is where it can be. Errors that last are
        counted as in wheeled mode, but not in flight.
        """
        if self._path is None:
            corrected = self._corrected()
            return corrected.hand - self.target.hand, corrected.hand_rotation
        self._goal, hand = None, self._data.oMf[self._hand]
        if self.standing.any():
            off = self._offset + PLAN * _INTEGRAL * (self.target.hand - hand.translation)
            turn = self._turn + PLAN * _INTEGRAL * pin.log3(hand.rotation.T @ self.target.hand_rotation)
            self._offset, self._turn = np.clip(off, -0.05, 0.05), np.clip(turn, -0.5, 0.5)
        return self._offset, self.target.hand_rotation @ pin.exp3(self._turn)

    def _warm(self, x: np.ndarray) -> None:
        """Begin with the plan, or with the last solution where there is none."""
        ocp, path = self.ocp, self._path
        if path is None:
            ocp.shift()
            return
        last, k = len(path.xs) - 1, max(self._k - 1, 0)
        ocp.xs = [path.xs[min(k + j, last)].copy() for j in range(ocp.nodes + 1)]
        ocp.us = [path.us[min(k + j, last - 1)].copy() for j in range(ocp.nodes)]

    def _asked(self, x: np.ndarray, middles: np.ndarray) -> tuple[list[tuple[bool, ...]], list[Target]]:
        """Return stances and targets of the horizon's nodes, and move on along the plan."""
        count, path = self.ocp.nodes + 1, self._path
        if path is None:
            up = np.array([0.0, 0.0, middles[:, 2].mean() - WHEEL_RADIUS])
            rest = replace(self._rest, com=self._rest.com + up, effort=holding_effort(self.ocp.model, x))
            return [(True,) * 4] * count, [rest] * count
        k, last = self._k, len(path.targets) - 1
        if path.flies:
            k = self._landed_from_flight(k)
        self._at = k
        stances = np.array([path.stances[min(k + j, last)] for j in range(count)])
        targets = [path.targets[min(k + j, last)] for j in range(count)]
        waiting = False
        for leg, first, landing in path.swings:
            if path.flies or not first <= k < landing:
                continue
            if k == first:
                self._landed.discard(leg)
            elif self.felt[leg] and k - first > _EXPECTED * (landing - first):
                self._landed.add(leg)
            if leg in self._landed:
                stances[: landing - k, leg] = True
            elif k == landing - 1:
                waiting = True
                self._late += PLAN
                stances[:_AWAITED, leg] = False
                targets = [lowered(target, leg, _LOWERING * self._late) for target in targets]
                if self._late > _SEARCH:
                    self.trouble = f"the wheel {LEGS[leg]} does not find the ground"
        self.standing = stances[0].copy()
        if not waiting:
            self._late, self._k, self.finished = 0.0, min(k + 1, last), k == last
        return [tuple(row) for row in stances.tolist()], targets


def lowered(target: Target, leg: int, depth: float) -> Target:
    """Return a target with one wheel lower."""
    feet = target.feet.copy()
    feet[leg, 2] -= depth
    return replace(target, feet=feet)
