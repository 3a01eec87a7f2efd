"""Chapter 11: the terms of the cost, each one function that makes one of Crocoddyl's (Paper B, eq. 17).

A term is a residual (what should be zero), an activation (how it is weighed, row by row) and a weight. The
state is the paper's, steering, wheels and gripper locked: trunk, eight joints of the legs, six of the arm.
The paper gives no weight; those of :class:`Weights` were found by trying.

Its seven names stand here with what they are in this robot's 41 states. ``leg`` follows a swinging wheel.
``com`` leads the centre of mass. ``contact`` is eqs 8 and 9: force outside the cone. ``effort`` (l_reg) keeps
torques near those that hold the robot. ``trunk`` (l_pos) is its orientation. ``posture`` (l_sigma) would be
the steering's, which is locked here: it is the legs' joints, and all velocities. ``arm`` is the hand's pose
and, lightly, the arm's joints. ``limits`` is beside eq. 17: it keeps joints within their range.
"""

from collections.abc import Callable
from dataclasses import dataclass

import crocoddyl
import numpy as np
import pinocchio as pin

LEG_JOINTS, ARM_JOINTS = slice(6, 14), slice(14, 20)
"""Of the legs and the arm in a velocity ``(20,)`` of the locked model."""


@dataclass(frozen=True)
class Weights:
    """Weights of Paper B, eq. 17; rates are per second, so that they do not depend on the time step.

    Attributes:
        leg: of a swinging wheel's position.
        com: ``(3,)`` of the centre of mass, x, y, z.
        contact: of force outside the friction pyramid.
        least_force: smallest normal force of a wheel that stands, N; with more than 0 the zero-moment point
            keeps away from the edges of the area of support.
        effort: of torque.
        trunk: ``(3,)`` of roll, pitch, yaw.
        posture: of the legs' joints.
        arm_posture: of the arm's joints.
        velocity: of all generalised velocities, less those that go along with the ground.
        hand: ``(3,)`` of the hand's position.
        hand_rotation: of its orientation.
        limits: of joints outside their range.
        terminal: multiplies every term but the effort in the last node, where nothing is integrated.
    """

    leg: float = 1e4
    com: tuple[float, float, float] = (300.0, 300.0, 1000.0)
    contact: float = 1e-2
    least_force: float = 0.0
    effort: float = 1e-4
    trunk: tuple[float, float, float] = (60.0, 60.0, 200.0)
    posture: float = 1.0
    arm_posture: float = 0.3
    velocity: float = 0.5
    hand: tuple[float, float, float] = (1000.0, 1000.0, 20000.0)
    hand_rotation: float = 1000.0
    limits: float = 1e3
    terminal: float = 0.1


@dataclass(frozen=True)
class Model:
    """What every term needs of the robot: the state's manifold and the number of torques."""

    state: crocoddyl.StateMultibody
    nu: int

    def frame(self, name: str) -> int:
        """Return the index of a frame of Pinocchio's model."""
        return self.state.pinocchio.getFrameId(name)


def _cost(
    model: Model,
    residual: crocoddyl.ResidualModelAbstract,
    weights: np.ndarray | None = None,
) -> crocoddyl.CostModelAbstract:
    """Return half a sum of squares, weighed row by row."""
    if weights is None:
        return crocoddyl.CostModelResidual(model.state, residual)
    activation = crocoddyl.ActivationModelWeightedQuad(np.asarray(weights, dtype=float))
    return crocoddyl.CostModelResidual(model.state, activation, residual)


def leg(model: Model, frame: str, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the cost of a swinging wheel's distance from where it should be, l_leg of Paper B, eq. 17."""
    residual = crocoddyl.ResidualModelFrameTranslation(model.state, model.frame(frame), np.zeros(3), model.nu)
    return _cost(model, residual, np.full(3, weights.leg))


def com(model: Model, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the cost of the centre of mass's distance from its reference, l_CoM of Paper B, eq. 17."""
    residual = crocoddyl.ResidualModelCoMPosition(model.state, np.zeros(3), model.nu)
    return _cost(model, residual, np.array(weights.com))


def pyramid(mu: float, R_fc: np.ndarray | None = None) -> crocoddyl.FrictionCone:
    """Return the friction pyramid of :mod:`.wrench` as Crocoddyl has it.

    Crocoddyl's default is a pyramid inside of the round cone, which has mu / √2: eq. 7 has mu itself.

    Args:
        mu: friction coefficient.
        R_fc: ``(3, 3)`` the contact's axes in those that the force comes in; the same without it.
    """
    return crocoddyl.FrictionCone(np.eye(3) if R_fc is None else R_fc, mu, 4, False)


def contact(model: Model, frame: str, mu: float, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the penalty on force outside the pyramid, l_fc (Paper B, eqs 8, 9 and 17).

    A contact has forces only here, no moments: moments about the axle no free wheel can have, and the line's
    others would make eq. 4 singular, for what two wheels could do by twisting four do by pushing.
    """
    cone = pyramid(mu)
    residual = crocoddyl.ResidualModelContactFrictionCone(model.state, model.frame(frame), cone, model.nu)
    low = np.array(cone.lb)
    low[-1] = weights.least_force  # the last row is the normal force
    activation = crocoddyl.ActivationModelQuadraticBarrier(crocoddyl.ActivationBounds(low, cone.ub))
    return crocoddyl.CostModelResidual(model.state, activation, residual)


def effort(model: Model, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the cost of torques other than those that hold the robot, l_reg of Paper B, eq. 17."""
    return _cost(model, crocoddyl.ResidualModelControl(model.state, np.zeros(model.nu)))


def trunk(model: Model, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the cost of the trunk's orientation, l_pos of Paper B, eq. 17."""
    frame = model.frame("trunk")
    residual = crocoddyl.ResidualModelFrameRotation(model.state, frame, np.eye(3), model.nu)
    return _cost(model, residual, np.array(weights.trunk))


def posture(model: Model, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the cost of the joints' angles and of all velocities, l_sigma of Paper B, eq. 17.

    Not as printed: l_sigma is the steering's, which is locked in the 41 states. Here it is the legs' joints
    and all velocities, with the arm's joints, a part of l_arm.
    """
    nv = model.state.nv
    rows = np.zeros(2 * nv)
    rows[LEG_JOINTS], rows[ARM_JOINTS], rows[nv:] = weights.posture, weights.arm_posture, weights.velocity
    residual = crocoddyl.ResidualModelState(model.state, model.state.zero(), model.nu)
    return _cost(model, residual, rows)


def hand(model: Model, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the cost of the hand's position, l_arm of Paper B, eq. 17; rows are the world's axes."""
    frame = model.frame("hand")
    residual = crocoddyl.ResidualModelFrameTranslation(model.state, frame, np.zeros(3), model.nu)
    return _cost(model, residual, np.array(weights.hand))


def hand_rotation(model: Model, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the cost of the hand's orientation, l_arm of Paper B, eq. 17."""
    frame = model.frame("hand")
    residual = crocoddyl.ResidualModelFrameRotation(model.state, frame, np.eye(3), model.nu)
    return _cost(model, residual, np.full(3, weights.hand_rotation))


def limits(model: Model, weights: Weights) -> crocoddyl.CostModelAbstract:
    """Return the penalty on joints beyond their range."""
    nv, robot = model.state.nv, model.state.pinocchio
    low, high = np.full(2 * nv, -np.inf), np.full(2 * nv, np.inf)
    reference = np.concatenate([pin.neutral(robot), np.zeros(nv)])
    low[6:nv], high[6:nv] = robot.lowerPositionLimit[7:], robot.upperPositionLimit[7:]
    activation = crocoddyl.ActivationModelQuadraticBarrier(crocoddyl.ActivationBounds(low, high))
    residual = crocoddyl.ResidualModelState(model.state, reference, model.nu)
    return crocoddyl.CostModelResidual(model.state, activation, residual)


TERMS: dict[str, tuple[Callable[[Model, Weights], crocoddyl.CostModelAbstract], str | None]] = {
    "com": (com, None),
    "effort": (effort, "effort"),
    "trunk": (trunk, None),
    "posture": (posture, None),
    "hand": (hand, None),
    "hand_rotation": (hand_rotation, None),
    "limits": (limits, "limits"),
}
"""Terms that every node has, and the weight that multiplies each; None where its rows are weighed already."""
