"""Chapter 6: one standing robot, for one program of the controller at a time.

A simulation shows what a controller does in the end, not why. Here is the robot at one instant: choose what
it stands on and what it is asked, solve the program once, and see which of its limits are reached. And with
:func:`rehearse` follow the program's own accelerations: motion as the program believes in it, without a
simulator that knows better.
"""

import itertools
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from wfbook.go1 import ASSETS, RADII, nominal
from wfbook.go1_dynamics import MOTORS, Go1Dynamics, cross
from wfbook.modes import LEGS
from wfbook.reference import TICK, Ground, Reference
from wfbook.terrain import flat
from wfbook.wbc import Command, Contacts, WholeBodyController, contacts, friction_pyramids, weight_share

JOINTS = ("hip", "thigh", "calf")
"""The motors of a leg: abduction, thigh, and the one that moves the calf."""

_REACHED = 1e-3
"""A limit is reached within this many newtons or newton metres."""


@dataclass(frozen=True)
class Stance:
    """A robot that stands, with all that a controller needs for one tick.

    Attributes:
        robot: dynamics, updated to the state.
        ref: what is asked; as made by :func:`stand`, to stay as it is.
        ground: flat.
        qpos, qvel: ``(23,)``, ``(22,)`` the state, in MuJoCo's convention.
    """

    robot: Go1Dynamics
    ref: Reference
    ground: Ground
    qpos: np.ndarray
    qvel: np.ndarray

    @property
    def contact(self) -> Contacts:
        """The four contacts."""
        return contacts(self.robot, self.ground, self.ref.wheels)


def stand(
    wheels: tuple[int, ...] = (0, 0, 0, 0),
    standing: tuple[int, ...] = (1, 1, 1, 1),
    mu: float | None = None,
    rolling_resistance: float = 0.0,
    robot: Go1Dynamics | None = None,
) -> Stance:
    """Return the robot in its nominal stance on flat ground, at rest.

    Args:
        wheels: of each leg, whether it is on its wheel (1) or on its foot (0).
        standing: of each leg, whether it carries load. A leg that does not is at its place all the same.
        mu: friction coefficient of feet, and of wheels sideways; by default the terrain's.
        rolling_resistance: of the wheels.
        robot: to be put there; by default a new one.

    Raises:
        ValueError: no leg stands.
    """
    if not any(standing):
        raise ValueError(f"standing: {standing} leaves no leg on the ground")
    on_wheels, carrying = np.array(wheels, bool), np.array(standing, bool)
    robot = robot or Go1Dynamics()
    height = np.array([0.0, 0.0, nominal()["com_height"]])
    ends = nominal()["hip_offsets"] + height
    ends[:, 2] += RADII[on_wheels.astype(int)]
    qpos, qvel = robot.posture(height, np.zeros(3), ends), np.zeros(22)
    robot.update(qpos, qvel)
    ground = Ground.under(flat(rolling_resistance), np.zeros(4, int))
    if mu is not None:
        ground = Ground(
            ground.normals, ground.tangents, np.full(4, mu), np.full(4, mu), ground.rolling_resistance
        )
    share, still = weight_share(robot, np.zeros(3), carrying), np.zeros((4, 3))
    ref = Reference(height, still[0], still[0], np.eye(3), ends, still, still, carrying, on_wheels, share)
    return Stance(robot, ref, ground, qpos, qvel)


def limits_reached(stance: Stance, command: Command, least_force: float) -> list[str]:
    """Return which limits a command is at, in words; each begins with the leg's name.

    Args:
        stance: in which the command was computed.
        command: the controller's.
        least_force: of its gains: with what a standing leg presses at least.
    """
    local = np.einsum("lij,lj->li", stance.contact.basis, command.forces)
    pyramids = friction_pyramids(stance.ground, stance.contact, stance.ref.wheels)
    slack = -np.einsum("lij,lj->li", pyramids, local)
    torque = np.abs(command.torques).reshape(4, 3) - stance.robot.effort.reshape(4, 3)
    found = []
    for leg in np.flatnonzero(stance.ref.stance):
        sides = slack[leg, 2:4] if stance.ref.wheels[leg] else slack[leg, :-1]  # a wheel has no sides along t
        if sides.min() < -_REACHED:
            found.append(f"{LEGS[leg]} needs more friction than there is")
        elif local[leg, 2] <= least_force + _REACHED:
            found.append(f"{LEGS[leg]} carries nothing more")
        elif sides.min() <= _REACHED:
            found.append(f"{LEGS[leg]} uses all its friction")
    for leg in range(4):
        for joint, name in enumerate(JOINTS):
            if torque[leg, joint] >= -_REACHED:
                found.append(f"{LEGS[leg]} {name} is at its torque limit")
    return found


def squeezes(points: np.ndarray) -> np.ndarray:
    """Return forces on four points of a plane that add up to nothing: no force, no torque.

    Two points that pull at each other along the line between them, for every pair; and one diagonal that is
    lifted while the other is pressed. They are seven, and six of them are independent.

    Args:
        points: ``(4, 3)``, in the order of the legs, on a rectangle in a horizontal plane.

    Returns:
        ``(7, 4, 3)``, each force of length one.
    """
    forces = np.zeros((7, 4, 3))
    for i, (first, second) in enumerate(itertools.combinations(range(4), 2)):
        towards = points[second] - points[first]
        forces[i, first] = towards / np.linalg.norm(towards)
        forces[i, second] = -forces[i, first]
    forces[6, :, 2] = 1.0, -1.0, -1.0, 1.0
    return forces


@dataclass(frozen=True)
class Rehearsal:
    """Motion as the program has it.

    Attributes:
        t: ``(N,)`` time.
        com: ``(N, 3)`` centre of mass.
        contact_velocity: ``(N, 4, 3)`` of the points that touch the ground, along t, b and n.
        forces: ``(N, 4, 3)`` that the program counts on, along t, b and n.
    """

    t: np.ndarray
    com: np.ndarray
    contact_velocity: np.ndarray
    forces: np.ndarray


def rolling(stance: Stance, speed: float, yaw_rate: float) -> np.ndarray:
    """Return MuJoCo's velocity ``(22,)`` of a robot that goes ahead and turns about its CoM.

    Its contacts move along their rolling directions only, with the speed, and its joints give way as needed.

    Args:
        stance: all legs on wheels.
        speed: of trunk and contacts along x.
        yaw_rate: of the trunk.
    """
    robot = stance.robot
    qvel = np.zeros(22)
    arm = stance.qpos[:3] - robot.com
    qvel[:3] = np.array([speed, 0.0, 0.0]) + cross(np.array([0.0, 0.0, yaw_rate]), arm)
    qvel[5] = yaw_rate
    base = np.concatenate([robot.R_wb.T @ qvel[:3], qvel[3:6]])
    jacobian = stance.contact.jacobian
    for leg in range(4):
        columns = slice(6 + 3 * leg, 9 + 3 * leg)
        missing = np.array([speed, 0.0, 0.0]) - jacobian[leg, :, :6] @ base
        qvel[MOTORS[3 * leg : 3 * leg + 3]] = np.linalg.solve(jacobian[leg, :, columns], missing)
    return qvel


def rehearse(
    stance: Stance, controller: WholeBodyController, qvel: np.ndarray, duration: float, yaw_rate: float = 0.0
) -> Rehearsal:
    """Follow the program's own accelerations from a stance.

    The reference moves on as the robot begins: with the CoM's velocity, on a line, turning steadily.

    Args:
        stance: where it begins; its ``robot`` must be the controller's.
        controller: whose program is solved at every tick.
        qvel: ``(22,)`` velocity at the beginning.
        duration: to go on for.
        yaw_rate: at which the reference turns.
    """
    robot, model = stance.robot, mujoco.MjModel.from_xml_path(str(ASSETS / "go1.xml"))
    qpos, qvel = stance.qpos.copy(), np.array(qvel, float)
    robot.update(qpos, qvel)
    start, velocity = robot.com.copy(), robot.com_velocity.copy()
    samples: list[tuple[np.ndarray, ...]] = []
    times = TICK * np.arange(round(duration / TICK))
    for t in times:
        robot.update(qpos, qvel)
        contact = contacts(robot, stance.ground, stance.ref.wheels)
        ref = _turning(stance.ref, start + t * velocity, velocity, t * yaw_rate, yaw_rate, robot)
        command = controller.tick(ref, stance.ground)
        samples.append((robot.com, contact.velocity, np.einsum("lij,lj->li", contact.basis, command.forces)))
        # The base's acceleration is Pinocchio's, in the turning frame of the trunk; the wheels spin freely.
        linear = robot.velocity[:3] + TICK * command.acceleration[:3]
        qvel[3:6] += TICK * command.acceleration[3:6]
        qvel[MOTORS] += TICK * command.acceleration[6:]
        mujoco.mj_integratePos(model, qpos, np.concatenate([robot.R_wb @ linear, qvel[3:]]), TICK)
        turned = np.empty(9)
        mujoco.mju_quat2Mat(turned, qpos[3:7])
        qvel[:3] = turned.reshape(3, 3) @ linear
    com, contact_velocity, forces = (np.array(values) for values in zip(*samples, strict=True))
    return Rehearsal(times, com, contact_velocity, forces)


def _turning(
    ref: Reference, com: np.ndarray, velocity: np.ndarray, yaw: float, rate: float, robot: Go1Dynamics
) -> Reference:
    """Return a reference with another CoM and heading; the wheels are to stay under the robot."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    ends = robot.centres - robot.com + com
    return replace(
        ref, com=com, com_velocity=velocity, R_wb=turn, ends=ends, omega=np.array([0.0, 0.0, rate])
    )
