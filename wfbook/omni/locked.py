"""Chapter 11: the paper's 41 states, steering, wheels and gripper locked, and what the robot is asked for.

States ``(41,)`` are in Pinocchio's terms: position and quaternion x y z w of the trunk, eight joints of the
legs and six of the arm; then the trunk's velocity in its own axes, and the joints'. Torques are ``(14,)``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wfbook.modes import LEGS
from wfbook.omni.robot import ARM_V, HAND_HEIGHT, HAND_REACH, LEGS_V, NOMINAL_HEIGHT, NV, locked_model
from wfbook.omni.robot import posture as robot_posture

NQ_LOCKED, NV_LOCKED, NU_LOCKED = 21, 20, 14
MOTORS = np.sort(np.concatenate([LEGS_V, ARM_V])) - 6
"""Which of the robot's 23 motors the 14 torques are."""

_DAMPED = 1e-3
"""Square of the leverage, m², below which a joint is not asked to do much for a contact or the hand."""

ROWS = ("xyz", "xz")
"""Kinds of contact: held in space, in the contact's axes; or in the leg's plane, in the shank's axes."""


def contact_model() -> pin.Model:
    """Return the locked model with a frame for each kind of contact of each wheel, ``FL_xyz``, ``FL_xz``.

    Crocoddyl's residuals find a contact by its frame, and would take the first of two that share one, be it
    active or not. And its contact in a plane has its force in the axes of the joint, whatever the frame's
    are: frame and joint have the same axes here, and the friction pyramid is turned instead.
    """
    model = locked_model()
    for leg in LEGS:
        site = model.frames[model.getFrameId(f"{leg}_contact")]
        for rows in ROWS:
            model.addFrame(
                pin.Frame(f"{leg}_{rows}", site.parentJoint, site.placement, pin.FrameType.OP_FRAME)
            )
    return model


def locked_state(qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    """Translate a MuJoCo state, ``(30,)`` and ``(29,)``, to the paper's, ``(41,)``, in Pinocchio's terms."""
    rotation = pin.Quaternion(*qpos[3:7]).toRotationMatrix()
    joints = MOTORS + 6
    return np.concatenate(
        [qpos[:3], qpos[[4, 5, 6, 3]], qpos[1 + joints], rotation.T @ qvel[:3], qvel[3:6], qvel[joints]]
    )


def mujoco_state(x: np.ndarray, qpos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Translate a state ``(41,)`` to MuJoCo's, ``(30,)`` and ``(29,)``.

    Args:
        x: of the locked model.
        qpos: ``(30,)`` where steering, wheels and gripper are taken from; they are at rest.
    """
    rotation = pin.Quaternion(x[3:7]).toRotationMatrix()
    full, velocity = np.array(qpos, dtype=float), np.zeros(NV)
    full[:3], full[3:7], full[7 + MOTORS] = x[:3], x[[6, 3, 4, 5]], x[7:NQ_LOCKED]
    velocity[:3], velocity[3:6] = rotation @ x[21:24], x[24:27]
    velocity[6 + MOTORS] = x[27:]
    return full, velocity


def held_rows(stance: Sequence[bool]) -> dict[str, str]:
    """Return the directions in which the contact of each standing wheel is held, ``"xyz"`` or ``"xz"``.

    ``xz`` are those of the leg's plane, however the wheel is steered: across it eq. 4 would be singular.
    Two diagonal wheels that both stand are held across as well. Of two wheels side by side only one is: their
    distance is the trunk's width anyway.

    Args:
        stance: ``(4,)`` bool.
    """
    standing = [name for name, stands in zip(LEGS, stance, strict=True) if stands]
    for pair in (("FL", "RR"), ("FR", "RL")):
        if set(pair) <= set(standing):
            return {name: "xyz" if name in pair else "xz" for name in standing}
    return {name: "xyz" if name == standing[0] else "xz" for name in standing}


@dataclass(frozen=True)
class Target:
    """What a node is asked for, in the problem's axes.

    Attributes:
        hand: ``(3,)`` position.
        hand_rotation: ``(3, 3)``.
        com: ``(3,)`` centre of mass.
        trunk: ``(3, 3)`` orientation.
        posture: ``(14,)`` angles of legs and arm.
        effort: ``(14,)`` torques that hold the robot.
        feet: ``(4, 3)`` where wheels that swing should be; unused for others.
        height: of the trunk above the ground in this posture.
    """

    hand: np.ndarray
    hand_rotation: np.ndarray
    com: np.ndarray
    trunk: np.ndarray
    posture: np.ndarray
    effort: np.ndarray
    feet: np.ndarray
    height: float


def holding_effort(model: pin.Model, x: np.ndarray) -> np.ndarray:
    """Return the torques ``(14,)`` that hold the robot at rest in a state ``(41,)``, all wheels standing.

    Args:
        model: of :func:`contact_model`.
        x: the state.
    """
    data, q = model.createData(), x[:NQ_LOCKED]
    gravity = pin.computeGeneralizedGravity(model, data, q)
    pin.computeJointJacobians(model, data, q)
    rows = np.vstack(
        [
            pin.computeFrameJacobian(model, data, q, model.getFrameId(f"{leg}_xyz"), pin.LOCAL)[:3]
            for leg in LEGS
        ]
    )
    forces = np.linalg.lstsq(rows[:, :6].T, gravity[:6], rcond=None)[0]
    return (gravity - rows.T @ forces)[6:]


def accompanying(model: pin.Model, xs: Sequence[np.ndarray], velocities: np.ndarray) -> np.ndarray:
    """Return velocities ``(n, 20)`` of a robot that goes along with its wheels and whose hand rests.

    The trunk rises as the wheels do on average and does not turn. Legs let each wheel have its own velocity
    in the leg's plane, the arm takes the trunk's from the hand.

    Args:
        model: of :func:`contact_model`.
        xs: ``n`` states ``(41,)``.
        velocities: ``(n, 4, 3)`` of the contacts.
    """
    data, n = model.createData(), len(xs)
    frames = [model.getFrameId(name) for name in (*(f"{leg}_xyz" for leg in LEGS), "hand")]
    rows, trunk = np.zeros((n, 5, 6, NV_LOCKED)), np.zeros((n, 3, 3))
    for i, x in enumerate(xs):
        pin.computeJointJacobians(model, data, x[:NQ_LOCKED])
        trunk[i] = data.oMi[1].rotation
        for row, frame in zip(rows[i], frames, strict=True):
            row[:] = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
    up = velocities[..., 2].mean(axis=1)
    found = np.zeros((n, NV_LOCKED))
    found[:, :3] = up[:, None] * trunk[:, 2]
    relative = velocities[..., [0, 2]] - np.array([0.0, 1.0]) * up[:, None, None]
    for leg in range(4):
        joints = slice(6 + 2 * leg, 8 + 2 * leg)
        found[:, joints] = _damped(rows[:, leg, [0, 2], joints], relative[:, leg])
    away = np.zeros((n, 6))
    away[:, 2] = -up
    found[:, 14:] = _damped(rows[:, 4, :, 14:], away)
    return found


def _damped(J: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return rates ``(n, k)`` for velocities ``(n, m)``, less where J ``(n, m, k)`` all but loses rank."""
    square = J @ J.transpose(0, 2, 1) + _DAMPED * np.eye(J.shape[1])
    return (J.transpose(0, 2, 1) @ np.linalg.solve(square, wanted[..., None]))[..., 0]


def nominal_state(height: float = NOMINAL_HEIGHT) -> np.ndarray:
    """Return the state ``(41,)`` of standing at the origin with the trunk at a height."""
    return locked_state(robot_posture(height=height), np.zeros(NV))


def nominal_target(
    height: float = NOMINAL_HEIGHT, hand_height: float = HAND_HEIGHT, hand_reach: float = HAND_REACH
) -> Target:
    """Return what holds the hand where Paper B holds it, over a robot at the origin.

    Args:
        height: of the trunk above the ground.
        hand_height: likewise.
        hand_reach: of the hand ahead of the shoulder.
    """
    model = locked_model()
    data, x = model.createData(), locked_state(robot_posture(height, hand_height, hand_reach), np.zeros(NV))
    pin.framesForwardKinematics(model, data, x[:NQ_LOCKED])
    hand = data.oMf[model.getFrameId("hand")]
    feet = [data.oMf[model.getFrameId(f"{leg}_axle")].translation for leg in LEGS]
    return Target(
        hand=np.array(hand.translation),
        hand_rotation=np.array(hand.rotation),
        com=np.array(pin.centerOfMass(model, data, x[:NQ_LOCKED])),
        trunk=np.eye(3),
        posture=x[7:NQ_LOCKED],
        effort=np.zeros(NU_LOCKED),
        feet=np.array(feet),
        height=height,
    )
