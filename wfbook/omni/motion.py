"""Chapter 12: a whole motion as one optimal control problem, wheels locked, by eqs 4, 5 and 16.

A locked wheel still rolls a little: with its shank. Over a stride the shank turns by half a radian and the
place where it touches goes on by some centimetres, so each node has contact frames of its own. They are
placed where the wheels touch in the last solution, and the problem is solved again.
"""

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import crocoddyl
import numpy as np
import pinocchio as pin

from wfbook.modes import LEGS
from wfbook.omni import costs
from wfbook.omni.costs import Model, Weights
from wfbook.omni.jump import JUMP_WEIGHTS, Leap, leap_schedule
from wfbook.omni.locked import NQ_LOCKED, Target, contact_model, held_rows, holding_effort
from wfbook.omni.problem import OptimalControl
from wfbook.omni.robot import contact_offsets
from wfbook.omni.stride import Gait, Heights, Schedule, margin, schedule

STRIDE_WEIGHTS = Weights(
    leg=1e5, com=(2e4, 2e4, 5e3), trunk=(200.0, 200.0, 200.0), posture=0.05, contact=1.0, least_force=25.0
)
"""Of a stride: posture leads less, for legs have to stretch; wheels keep to their paths."""

CAREFUL = 0.4
"""Friction coefficient that steps reckon with: less than there is, for a wheel that slips is lost."""

LANDING = 0.1
"""How long a wheel is still asked to be where it has landed, s."""

_ITERATIONS, _LEAP_ITERATIONS = (20, 10, 8), (60, 20, 10)
"""Of the solver, before contact frames and lift-offs are placed anew, and after."""

_UP = np.tile([0.0, 0.0, 1.0], (4, 1))


def keep_landed(ocp: OptimalControl, stances: Sequence[Sequence[bool]], count: int) -> None:
    """Ask wheels that have just landed to be where they should have landed.

    Args:
        ocp: a problem in legged mode that has been told these stances.
        stances: of its nodes.
        count: nodes after touchdown for which it is asked.
    """
    for node, stance in enumerate(stances):
        before = stances[max(0, node - count) : node]
        for i, leg in enumerate(LEGS):
            asked = not stance[i] or not all(earlier[i] for earlier in before)
            ocp.actions[node].differential.costs.changeCostStatus(f"{leg}_swing", asked)


class Motion(OptimalControl):
    """Eq. 16 over a whole motion in legged mode, with contact frames for each node.

    Args:
        nodes: time steps.
        dt: time step.
        weights: of eq. 17.
        mu: friction coefficient.
        solver: ``"FDDP"`` or ``"BoxFDDP"``.
        payload: mass in the hand that it reckons with.
    """

    def __init__(
        self,
        nodes: int,
        dt: float = 0.02,
        weights: Weights = STRIDE_WEIGHTS,
        mu: float = CAREFUL,
        solver: str = "BoxFDDP",
        payload: float = 0.0,
        without: Iterable[str] = (),
    ) -> None:
        self._models: list[pin.Model] = []
        self._carried = payload
        super().__init__(nodes, dt, "legged", weights, mu, without, solver)

    def _action(self, dt: float, scale: float, without: set[str]) -> crocoddyl.ActionModelAbstract:
        """Return a node with a model, and therefore contact frames, of its own."""
        self.load(self._carried)
        shared = self.state, self.actuation, self._terms, self.model
        self.model = self.model.copy()
        self._models.append(self.model)
        self.state = crocoddyl.StateMultibody(self.model)
        self.actuation = crocoddyl.ActuationModelFloatingBase(self.state)
        self._terms = Model(self.state, self.actuation.nu)
        action = super()._action(dt, scale, without)
        self.state, self.actuation, self._terms, self.model = shared
        return action

    def stand(self, stances: Sequence[Sequence[bool]]) -> None:
        """Say which wheels stand in each node; see :meth:`OptimalControl.stand`.

        A wheel that has landed is asked to stay where it is for a moment. Without that the optimiser slams it
        down: nothing else would charge it for speed at touchdown.
        """
        super().stand(stances)
        keep_landed(self, stances, round(LANDING / self.dt))

    def roll(self, normals: np.ndarray = _UP) -> None:
        """Place every node's contact frames where the wheels touch in the last solution."""
        for node, x in enumerate(self.xs):
            pin.forwardKinematics(self.model, self._data, x[:NQ_LOCKED])
            forks = [self._data.oMi[joint] * fork for joint, fork in self._forks]
            axles = np.array([fork.rotation[:, 1] for fork in forks])
            for i, offset in enumerate(contact_offsets(axles, normals)):
                z = -offset / np.linalg.norm(offset)
                turned = np.column_stack([np.cross(axles[i], z), axles[i], z])
                joint = self._data.oMi[self._forks[i][0]]
                placement = joint.actInv(pin.SE3(turned, forks[i].translation + offset))
                plane = pin.SE3(np.eye(3), placement.translation)
                self._put(node, f"{LEGS[i]}_xyz", placement)
                self._put(node, f"{LEGS[i]}_xz", plane)
                name, terms = f"{LEGS[i]}_xz_force", self._costs[node]
                if name in terms:
                    terms[name].cost.residual.reference = costs.pyramid(self.mu, placement.rotation)

    def _put(self, node: int, contact: str, placement: pin.SE3) -> None:
        model, data = self._models[node], self._contacts[contact][node]
        model.frames[model.getFrameId(contact)].placement = placement
        data.jMf, data.fXj = placement, placement.inverse().action

    def forces(self, node: int) -> np.ndarray:
        """Return the forces ``(4, 3)`` expected at a node, in the contacts' axes at that node."""
        forces, model = np.zeros((4, 3)), self._models[node]
        for leg, rows in held_rows(self.stances[node]).items():
            placement = model.frames[model.getFrameId(f"{leg}_xyz")].placement
            forces[LEGS.index(leg)] = placement.rotation.T @ self._contacts[f"{leg}_{rows}"][node].fext.linear
        return forces


@dataclass(frozen=True)
class Plan:
    """A motion that was planned: N nodes, in the coordinates that it was planned in.

    Attributes:
        schedule: what was asked for.
        xs: ``(N+1, 41)`` states.
        us: ``(N, 14)`` torques.
        K: ``(N, 14, 40)`` of eq. 21.
        com: ``(N+1, 3)`` centre of mass.
        feet: ``(N+1, 4, 3)`` axles.
        hand: ``(N+1, 3)``.
        forces: ``(N, 4, 3)`` in the contacts' axes: rolling, axle, normal.
        margins: ``(N+1,)`` of the centre of mass to the edge of the polygon of support.
        iterations: of the solver.
        solve_time: s.
    """

    schedule: Schedule
    xs: np.ndarray
    us: np.ndarray
    K: np.ndarray
    com: np.ndarray
    feet: np.ndarray
    hand: np.ndarray
    forces: np.ndarray
    margins: np.ndarray
    iterations: int
    solve_time: float


def plan_stride(
    x: np.ndarray,
    target: Target,
    landings: Sequence[tuple[int, np.ndarray]],
    advance: np.ndarray,
    heights: Heights,
    payload: float = 0.0,
    gait: Gait | None = None,
    dt: float = 0.04,
) -> Plan:
    """Plan a stride from rest.

    Args:
        x: ``(41,)`` state in the axes of the commanded base.
        target: of hand and body.
        landings: legs and where their axles go ``(3,)``, in order.
        advance: ``(2,)`` of the base.
        heights: of the ground in these axes.
        payload: in the hand.
        gait: how.
        dt: from node to node.

    Raises:
        ValueError: a leg can't be lifted, or its wheel would touch what it swings over.
        FloatingPointError: the solution is not finite.
    """
    began = time.perf_counter()
    x = np.array(x)
    x[21:] = 0.0
    body = Body(payload)
    feet, com, _ = body.at(x)
    asked = schedule(target, feet, com, landings, advance, heights, dt, gait)
    motion = Motion(len(asked.targets) - 1, dt, payload=payload)
    effort = holding_effort(motion.model, x)
    motion.hold(x)
    iterations = 0
    for round_, count in enumerate(_ITERATIONS):
        if round_ > 0:
            lifted_from = [body.at(motion.xs[swing.first])[0] for swing in asked.swings]
            asked = schedule(target, feet, com, landings, advance, heights, dt, gait, lifted_from)
        iterations += pursue(motion, asked, x, effort, count)
    return written(motion, asked, body, iterations, time.perf_counter() - began)


def plan_leap(x: np.ndarray, target: Target, leap: Leap, payload: float = 0.0, dt: float = 0.02) -> Plan:
    """Plan a jump from rest.

    Args:
        x: ``(41,)`` state in the axes of the commanded base.
        target: of hand and body.
        leap: how.
        payload: in the hand.
        dt: from node to node.

    Raises:
        ValueError: a height that is not positive.
        FloatingPointError: the solution is not finite.
    """
    began = time.perf_counter()
    x = np.array(x)
    x[21:] = 0.0
    body = Body(payload)
    feet, com, _ = body.at(x)
    asked = leap_schedule(target, feet, com, leap, dt)
    motion = Motion(len(asked.targets) - 1, dt, JUMP_WEIGHTS, payload=payload)
    effort = holding_effort(motion.model, x)
    motion.hold(x)
    iterations = sum(pursue(motion, asked, x, effort, count) for count in _LEAP_ITERATIONS)
    return written(motion, asked, body, iterations, time.perf_counter() - began)


def pursue(motion: Motion, asked: Schedule, x: np.ndarray, effort: np.ndarray, count: int) -> int:
    """Solve a motion on for a schedule, contact frames where the last solution touches; return iterations.

    Args:
        motion: the problem.
        asked: of it.
        x: ``(41,)`` first state.
        effort: ``(14,)`` torques that torques are compared with.
        count: most iterations.
    """
    motion.stand(asked.stances)
    motion.refer([replace(wanted, effort=effort) for wanted in asked.targets])
    motion.roll()
    motion.solve(x, count)
    return motion.solver.iter


def written(motion: Motion, asked: Schedule, body: "Body", iterations: int, solve_time: float) -> Plan:
    """Return the last solution of a motion as a plan."""
    found = [body.at(x) for x in motion.xs]
    feet, com, hand = (np.array(column) for column in zip(*found, strict=True))
    places = zip(com, feet, asked.stances, strict=True)
    return Plan(
        schedule=asked,
        xs=np.array(motion.xs),
        us=np.array(motion.us),
        K=np.array([motion.feedback(node) for node in range(motion.nodes)]),
        com=com,
        feet=feet,
        hand=hand,
        forces=np.array([motion.forces(node) for node in range(motion.nodes)]),
        margins=np.array([margin(*place) for place in places]),
        iterations=iterations,
        solve_time=solve_time,
    )


class Body:
    """Where axles, centre of mass and hand are in a state.

    Args:
        payload: mass in the hand.
    """

    def __init__(self, payload: float = 0.0) -> None:
        self.model = contact_model()
        hand = self.model.frames[self.model.getFrameId("hand")]
        self.model.inertias[hand.parentJoint] += pin.Inertia(
            payload, hand.placement.translation, np.zeros((3, 3))
        )
        self._data = self.model.createData()
        self._axles = [self.model.getFrameId(f"{leg}_axle") for leg in LEGS]
        self._hand = self.model.getFrameId("hand")

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return axles ``(4, 3)``, centre of mass ``(3,)`` and hand ``(3,)`` in a state ``(41,)``."""
        data = self._data
        pin.framesForwardKinematics(self.model, data, x[:NQ_LOCKED])
        com = np.array(pin.centerOfMass(self.model, data, x[:NQ_LOCKED]))
        axles = np.array([data.oMf[i].translation for i in self._axles])
        return axles, com, np.array(data.oMf[self._hand].translation)
