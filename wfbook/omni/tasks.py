"""Chapter 11: problems to solve, and what is to be seen of a solution: the hand moves, a wheel is lifted.

Each task returns an :class:`.OptimalControl` that is ready to be solved from :func:`.nominal_state`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import crocoddyl
import numpy as np
import pinocchio as pin

from wfbook.modes import LEGS
from wfbook.omni.costs import Weights
from wfbook.omni.locked import (
    NQ_LOCKED,
    Target,
    held_rows,
    holding_effort,
    mujoco_state,
    nominal_state,
    nominal_target,
)
from wfbook.omni.problem import OptimalControl
from wfbook.omni.robot import contact_offsets, posture
from wfbook.standing import plane
from wfbook.terrain import Terrain

_UP = np.tile([0.0, 0.0, 1.0], (4, 1))

STARTS = ("standing", "no torque", "fall")
"""What a search may begin with when nothing is known: the robot stands and its torques hold it; it stands
without torques, which nothing that obeys eq. 4 does; it does without torques what it does then."""

HAND_STEP = (0.0, 0.2, 0.1)
"""By how much the hand is to move, unless something else is said: to the left and up."""


_DOWN = 0.85
"""Share of a swing after which the wheel is asked to be down: a cost is followed with some delay."""

_SWINGING = Weights(leg=1e5, posture=0.1)

LIFT = 0.08
"""How much higher a wheel is asked to be that stands nowhere in the horizon."""


@dataclass(frozen=True)
class Planned:
    """A solution as a motion: N steps.

    Attributes:
        t: ``(N + 1,)`` time.
        x: ``(N + 1, 41)`` states.
        torques: ``(N, 14)``.
        qpos: ``(N + 1, 30)`` MuJoCo's configurations; steering, wheels and gripper do not move.
        com: ``(N + 1, 3)`` centre of mass.
        hand: ``(N + 1, 3)`` position.
        asked: ``(N + 1, 3)`` where the hand was to be.
        p: ``(N + 1, 4, 3)`` lowest points of the wheels.
        contact_force: ``(N + 1, 4, 3)`` on the robot, world frame; the last row repeats the one before.
        stance: ``(N + 1, 4)`` bool: which wheels stand.
        load: ``(N, 14)`` torque, as a share of each motor's limit.
        mu: friction coefficient.
        terrain: the ground.
    """

    t: np.ndarray
    x: np.ndarray
    torques: np.ndarray
    qpos: np.ndarray
    com: np.ndarray
    hand: np.ndarray
    asked: np.ndarray
    p: np.ndarray
    contact_force: np.ndarray
    stance: np.ndarray
    load: np.ndarray
    mu: float
    terrain: Terrain

    @property
    def hand_error(self) -> float:
        """Distance of the hand from where it was to be, at the end."""
        return float(np.linalg.norm(self.hand[-1] - self.asked[-1]))

    @property
    def lightest(self) -> float:
        """Smallest normal force of a wheel that stands, N; negative where the ground would have to pull."""
        return float(self.contact_force[self.stance, 2].min())

    @property
    def tilt(self) -> float:
        """Largest angle between the trunk's axis up and the world's."""
        _, x, y, _ = self.qpos[:, 3:7].T
        return float(np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)).max())

    @property
    def grip(self) -> float:
        """Largest force along the ground over μ times the normal force, of wheels that press with 1 N."""
        force = self.contact_force[self.stance & (self.contact_force[..., 2] > 1.0)]
        return float((np.abs(force[:, :2]).max(axis=1) / (self.mu * force[:, 2])).max(initial=0.0))


@dataclass(frozen=True)
class Attempt:
    """One solve, iteration by iteration.

    Attributes:
        costs: ``(I + 1,)`` before the first iteration and after each.
        gaps: ``(I + 1,)`` largest infeasibility: how far a node's state is from where the one before leads.
        converged: whether the solver said so.
        seconds: that it took.
        error: why there is no solution, or nothing.
    """

    costs: np.ndarray
    gaps: np.ndarray
    converged: bool
    seconds: float
    error: str = ""

    @property
    def iterations(self) -> int:
        """How many there were."""
        return len(self.costs) - 1


def reaching(
    by: Sequence[float] = HAND_STEP,
    nodes: int = 40,
    dt: float = 0.02,
    path: Callable[[float], float] | None = None,
    **options: Any,
) -> OptimalControl:
    """Return the problem of moving the hand, wheels standing.

    Args:
        by: ``(3,)`` how far.
        nodes: N.
        dt: time step.
        path: from the share of the time that has passed, 0 to 1, to the share of the way at which the hand is
            asked to be; without it, all of the way from the first node on.
        options: further ones of :class:`.OptimalControl`.
    """
    ocp = OptimalControl(nodes, dt, **options)
    ask(ocp, by, path)
    return ocp


def ask(
    ocp: OptimalControl,
    by: Sequence[float],
    path: Callable[[float], float] | None = None,
    stance: Sequence[bool] = (True,) * 4,
) -> None:
    """Ask for the hand elsewhere, and perhaps for wheels in the air, by :data:`LIFT`, all the time.

    Args:
        ocp: whose references and contacts are set.
        by: as for :func:`reaching`.
        path: likewise.
        stance: ``(4,)`` which wheels stand; in wheeled mode all.
    """
    target = rest(ocp)
    feet = target.feet + np.outer(~np.array(stance, dtype=bool), [0.0, 0.0, LIFT])
    shares = [1.0 if path is None else path(node / ocp.nodes) for node in range(ocp.nodes + 1)]
    hands = [target.hand + share * np.asarray(by, dtype=float) for share in shares]
    ocp.stand([stance] * (ocp.nodes + 1))
    ocp.refer([replace(target, hand=hand, feet=feet) for hand in hands])


def rest(ocp: OptimalControl) -> Target:
    """Return what the robot is asked for where it stands already."""
    return replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))


def lifting(
    leg: str = "FL",
    height: float = 0.12,
    forward: float = 0.05,
    shift: float = 0.8,
    swing: float = 0.6,
    settle: float = 0.3,
    dt: float = 0.02,
    **options: Any,
) -> OptimalControl:
    """Return the problem of lifting a wheel and setting it down again, wheels locked (legged mode).

    Args:
        leg: which one.
        height: of the wheel in the middle of the swing.
        forward: how much further ahead it comes down.
        shift: time before, to move the weight over the other wheels.
        swing: time in the air.
        settle: time afterwards.
        dt: time step.
        options: further ones of :class:`.OptimalControl`.

    Raises:
        ValueError: there is no such leg.
    """
    if leg not in LEGS:
        raise ValueError(f"leg: {leg!r} is none of {', '.join(LEGS)}")
    index = LEGS.index(leg)
    counts = [round(time / dt) for time in (shift, swing, settle)]
    nodes, begin, end = sum(counts), counts[0], counts[0] + counts[1]
    ocp = OptimalControl(nodes, dt, mode="legged", **{"weights": _SWINGING, **options})
    stances, targets, base = [], [], rest(ocp)
    for node in range(nodes + 1):
        share = np.clip((node - begin) / (_DOWN * (end - begin)), 0.0, 1.0)
        stances.append([not (begin <= node < end and i == index) for i in range(4)])
        feet = base.feet.copy()
        feet[index] += [forward * share**2 * (3.0 - 2.0 * share), 0.0, height * np.sin(np.pi * share) ** 2]
        targets.append(replace(base, feet=feet))
    ocp.stand(stances)
    ocp.refer(targets)
    return ocp


def begin(ocp: OptimalControl, x: np.ndarray, start: str = "standing") -> None:
    """Take one of :data:`STARTS` from a state ``(41,)`` as the last solution.

    Raises:
        ValueError: an unknown start.
    """
    if start not in STARTS:
        raise ValueError(f"start: {start!r} is none of {', '.join(STARTS)}")
    ocp.hold(x)
    if start != "standing":
        ocp.us = [np.zeros_like(u) for u in ocp.us]
    if start == "fall":
        ocp.xs = ocp.problem.rollout(ocp.us).tolist()


def attempt(ocp: OptimalControl, x: np.ndarray, iterations: int = 100) -> Attempt:
    """Solve from a state ``(41,)``, beginning with the last solution, and keep what happened on the way."""
    ocp.xs[0], ocp.problem.x0 = np.array(x), np.array(x)
    first = ocp.problem.calc(ocp.xs, ocp.us), gap(ocp)
    log = crocoddyl.CallbackLogger()
    ocp.solver.setCallbacks([log])
    start, converged, error = perf_counter(), False, ""
    try:
        converged = ocp.solve(x, iterations)
    except FloatingPointError as unsolved:
        error = str(unsolved)
    seconds = perf_counter() - start
    ocp.solver.setCallbacks([])
    ocp.problem.calc(ocp.xs, ocp.us)
    # Crocoddyl logs an iteration's cost after its step, and the gaps before.
    costs, gaps = np.array([first[0], *log.costs]), np.array([first[1], *list(log.ffeass)[1:], gap(ocp)])
    return Attempt(costs, gaps[: len(costs)], converged, seconds, error)


def gap(ocp: OptimalControl) -> float:
    """Return how far a node's state is at most from where the one before leads; the problem is evaluated."""
    ends = zip(ocp.problem.runningDatas, ocp.xs[1:], strict=True)
    return max(float(np.abs(ocp.state.diff(np.array(data.xnext), x)).max()) for data, x in ends)


def planned(ocp: OptimalControl) -> Planned:
    """Return the last solution as a motion."""
    ocp.problem.calc(ocp.xs, ocp.us)  # the data may be those of a step that was refused
    model, data, still = ocp.model, ocp.model.createData(), posture()
    hand_frame = model.getFrameId("hand")
    qpos, com, hand, places, forces = [], [], [], [], []
    for node, x in enumerate(ocp.xs):
        pin.framesForwardKinematics(model, data, x[:NQ_LOCKED])
        frames = [data.oMf[model.getFrameId(f"{leg}_xyz")] for leg in LEGS]
        expected = ocp.forces(min(node, ocp.nodes - 1))
        forces.append([frame.rotation @ force for frame, force in zip(frames, expected, strict=True)])
        axles = [data.oMf[model.getFrameId(f"{leg}_axle")] for leg in LEGS]
        below = contact_offsets(np.array([axle.rotation[:, 1] for axle in axles]), _UP)
        places.append([axle.translation + offset for axle, offset in zip(axles, below, strict=True)])
        hand.append(data.oMf[hand_frame].translation.copy())
        com.append(np.array(pin.centerOfMass(model, data, x[:NQ_LOCKED])))
        qpos.append(mujoco_state(x, still)[0])
    torques = np.array(ocp.us)
    return Planned(
        t=ocp.dt * np.arange(ocp.nodes + 1),
        x=np.array(ocp.xs),
        torques=torques,
        qpos=np.array(qpos),
        com=np.array(com),
        hand=np.array(hand),
        asked=np.array(ocp.asked),
        p=np.array(places),
        contact_force=np.array(forces),
        stance=np.array(ocp.stances),
        load=np.abs(torques) / model.effortLimit[6:],
        mu=ocp.mu,
        terrain=plane(ocp.mu),
    )


def ride(ocp: OptimalControl, x: np.ndarray, feedback: bool = True, period: float = 0.002) -> np.ndarray:
    """Let the robot go from a state with the last solution's torques, and with or without its gains (eq. 21).

    The motion is eq. 4's, contacts and all, in short steps: what the linear feedback controller does at
    500 Hz until the next solution comes.

    Args:
        ocp: solved.
        x: ``(41,)`` where it begins.
        feedback: whether torques follow the state.
        period: of the feedback.

    Returns:
        ``(M + 1, 41)`` states, ``period`` apart, over the whole horizon. They end early when they run away.
    """
    states, steps = [np.array(x)], round(ocp.dt / period)
    for node in range(ocp.nodes):
        way = ocp.state.diff(ocp.xs[node], ocp.xs[node + 1])
        for step in range(steps):
            torque = np.array(ocp.us[node])
            if feedback:
                wanted = ocp.state.integrate(ocp.xs[node], step / steps * way)
                torque += ocp.feedback(node) @ ocp.state.diff(wanted, states[-1])
            after = ocp.predict(states[-1], torque, period)
            if not np.isfinite(after).all() or np.abs(after).max() > 1e3:
                return np.array(states)
            states.append(after)
    return np.array(states)


def hand_path(ocp: OptimalControl, states: np.ndarray) -> np.ndarray:
    """Return where the hand is ``(M, 3)`` in states ``(M, 41)``."""
    data, frame, found = ocp.model.createData(), ocp.model.getFrameId("hand"), []
    for x in states:
        pin.framesForwardKinematics(ocp.model, data, x[:NQ_LOCKED])
        found.append(data.oMf[frame].translation.copy())
    return np.array(found)


def twelve_rows(ocp: OptimalControl) -> None:
    """Hold every standing wheel in all three directions, as one would who did not count (chapter 10)."""
    for action in ocp.actions:
        for leg in held_rows((True,) * 4):
            action.differential.contacts.changeContactStatus(f"{leg}_xz", False)
            action.differential.contacts.changeContactStatus(f"{leg}_xyz", True)
