"""The Go1's equations of motion in Pinocchio, from the MJCF that MuJoCo simulates.

The whole-body controller works with 18 of the robot's 22 velocities: the trunk's six (linear, then angular,
both in the trunk's frame, as Pinocchio has them) and three joints a leg in the order of
:data:`wfbook.modes.LEGS`. The four wheels spin freely, no motor turns them, so they are eliminated.

MuJoCo and Pinocchio agree on these dynamics to rounding, once their conventions are translated:

=====================  ==========================  =======================
what                   MuJoCo                      Pinocchio
=====================  ==========================  =======================
quaternion             w x y z                     x y z w
linear velocity        trunk's origin, in world    the same, in the trunk's frame
angular velocity       in the trunk's frame        the same
linear acceleration    derivative of the above     derivative of the above
order of joints        of the file                 found by name
=====================  ==========================  =======================
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin

from wfbook.go1 import ASSETS, FOOT_RADIUS, WHEEL_HALF_WIDTH, WHEEL_RADIUS, leg_angles, leg_kinematics
from wfbook.modes import LEGS

GRAVITY = np.array([0.0, 0.0, -9.81])
MOTORS = np.array([6 + 4 * leg + part for leg in range(4) for part in range(3)])
"""Indices of the twelve motors' joints in MuJoCo's velocity (the fourth joint of a leg is its wheel)."""

WHEELS = np.array([9 + 4 * leg for leg in range(4)])
"""Indices of the wheels' joints, likewise."""

WHEEL_FLATNESS = WHEEL_RADIUS**2 - WHEEL_HALF_WIDTH**2
"""Difference of the squared semi-axes of the wheel's ellipsoid: how much its camber matters."""

_SKEW = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0.0]])
_CYCLIC, _REVERSED = np.array([1, 2, 0, 2, 0, 1]), np.array([2, 0, 1, 1, 2, 0])
_ONES = np.ones(3)
_MINUS = np.vstack([np.eye(3), -np.eye(3)])
_KEPT = np.concatenate([np.arange(6), MOTORS])
_KEPT_KEPT, _KEPT_WHEELS = 22 * _KEPT[:, None] + _KEPT, 22 * _KEPT[:, None] + WHEELS
"""Where parts of a (22, 22) matrix stand when its rows stand one after the other; `take` is quick."""


def skew(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices ``[v]×`` with ``[v]× u = v × u``, shape ``(..., 3, 3)`` of ``(..., 3)``."""
    return (vectors @ _SKEW).reshape((*vectors.shape, 3))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return ``a × b`` of ``(..., 3)`` arrays; for a handful of vectors six times quicker than NumPy's."""
    return (a.take(_CYCLIC, -1) * b.take(_REVERSED, -1)) @ _MINUS


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the inner products ``(n,)`` of the rows of ``(n, 3)`` arrays."""
    return (a * b) @ _ONES


def rotation(rpy: np.ndarray) -> np.ndarray:
    """Return the rotation matrix ``(3, 3)`` with these roll, pitch and yaw: about x, then y, then z."""
    return pin.rpy.rpyToMatrix(*np.asarray(rpy, float))


def roll_pitch_yaw(R: np.ndarray) -> np.ndarray:
    """Return roll, pitch and yaw of a rotation matrix, ``(3,)``."""
    return np.array(
        [np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(np.clip(R[2, 0], -1, 1)), np.arctan2(R[1, 0], R[0, 0])]
    )


def contact_offsets(axles: np.ndarray, normals: np.ndarray, wheels: np.ndarray) -> np.ndarray:
    """Return the vectors from the legs' ends to the points that touch a plane.

    The foot is a sphere; the wheel is an ellipsoid of revolution about its axle, whose lowest
    point does not depend on its spin but moves with its camber.

    Args:
        axles: ``(4, 3)`` unit vectors along the wheels' axles.
        normals: ``(4, 3)`` unit normals of the ground, in the same frame.
        wheels: ``(4,)`` bool, whether the leg stands on its wheel.

    Returns:
        ``(4, 3)``, in that frame.
    """
    foot = -FOOT_RADIUS * normals
    if not wheels.any():
        return foot
    camber = dot(normals, axles)[:, None]
    wheel = -(WHEEL_RADIUS**2 * normals - WHEEL_FLATNESS * camber * axles) / np.sqrt(
        WHEEL_RADIUS**2 - WHEEL_FLATNESS * camber**2
    )
    return np.where(wheels[:, None], wheel, foot)


class FloatingBase:
    """A robot with a floating base in Pinocchio, and what has to be translated to and from MuJoCo.

    Args:
        model: Pinocchio's.
        joints: their names in MuJoCo's order, one degree of freedom each.

    Attributes:
        model, data: Pinocchio's.
        mass: of the whole robot.
    """

    def __init__(self, model: pin.Model, joints: Sequence[str]) -> None:
        self.model, self.data = model, model.createData()
        ids = [model.getJointId(name) for name in joints]
        self._v_index = np.array([*range(6), *(model.idx_vs[j] for j in ids)])
        self._q_index = np.array([*range(7), *(model.idx_qs[j] for j in ids)])
        self.mass = pin.computeTotalMass(model)

    def state(self, qpos: np.ndarray, qvel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Translate a MuJoCo state, configuration ``(nq,)`` and velocity ``(nv,)``, to Pinocchio's."""
        q, v = np.empty(len(qpos)), np.empty(len(qvel))
        q[self._q_index] = qpos
        q[3:7] = qpos[[4, 5, 6, 3]]
        v[self._v_index] = qvel
        v[:3] = pin.Quaternion(q[3:7]).toRotationMatrix().T @ qvel[:3]
        return q, v

    def mujoco_state(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Translate a Pinocchio state, ``(nq,)`` and ``(nv,)``, to MuJoCo's."""
        qpos, qvel = q[self._q_index], v[self._v_index]
        qpos[3:7] = q[[6, 3, 4, 5]]
        qvel[:3] = pin.Quaternion(q[3:7]).toRotationMatrix() @ v[:3]
        return qpos, qvel

    def acceleration(self, qpos: np.ndarray, qvel: np.ndarray, qacc: np.ndarray) -> np.ndarray:
        """Translate a MuJoCo acceleration ``(nv,)`` to Pinocchio's base, joints in MuJoCo's order."""
        q, v = self.state(qpos, qvel)
        a = np.array(qacc, dtype=float)
        a[:3] = pin.Quaternion(q[3:7]).toRotationMatrix().T @ qacc[:3] - cross(v[3:6], v[:3])
        return a


class Go1Dynamics(FloatingBase):
    """Mass matrix, bias forces and contact kinematics at one state.

    Call :meth:`update`, then read the attributes. ``w`` in a name is the world frame, ``b`` the trunk's;
    vectors without a frame are in the world's.

    Attributes:
        mass: of the robot with its wheels.
        R_wb: ``(3, 3)`` the trunk's orientation.
        trunk_position: ``(3,)``.
        joint_angles: ``(12,)`` of the motors.
        velocity: ``(18,)`` generalised velocity.
        M: ``(18, 18)`` mass matrix, wheels eliminated.
        h: ``(18,)`` Coriolis, centrifugal and gravity forces, wheels eliminated.
        M_full: ``(22, 22)`` mass matrix in MuJoCo's order of joints, Pinocchio's base velocity.
        h_full: ``(22,)`` bias likewise.
        com: ``(3,)`` centre of mass; ``com_velocity``, ``com_drift``: its velocity, and its acceleration when
            the generalised acceleration is zero.
        com_jacobian: ``(3, 18)``.
        centres: ``(4, 3)`` centre of foot and wheel; ``centre_velocity``, ``centre_drift`` likewise.
        centre_jacobian: ``(4, 3, 18)``.
        calf_omega: ``(4, 3)`` angular velocity of the calves; ``calf_alpha_drift`` likewise.
        calf_jacobian: ``(4, 3, 18)`` of the calves' angular velocity.
        axles: ``(4, 3)`` unit vectors along the wheels' axles, to the robot's left.
    """

    def __init__(self, path: Path = ASSETS / "go1.xml") -> None:
        names = [f"{leg}_{part}_joint" for leg in LEGS for part in ("hip", "thigh", "calf", "wheel")]
        super().__init__(pin.buildModelFromMJCF(str(path)), names)
        joints = [self.model.getJointId(name) for name in names]
        self._calves, self._wheels = joints[2::4], joints[3::4]
        self._columns = self._v_index[_KEPT]
        # CRBA fills in the upper triangle alone; stored by columns, it is the lower one of the transpose.
        self._upper = 22 * np.maximum.outer(self._v_index, self._v_index)
        self._upper += np.minimum.outer(self._v_index, self._v_index)
        self._mask = np.zeros((4, 1, 18))
        self._mask[:, :, :6] = 1.0
        for leg in range(4):
            self._mask[leg, :, 6 + 3 * leg : 9 + 3 * leg] = 1.0
        self.effort = np.array([self.model.effortLimit[i] for i in self._v_index[MOTORS]])
        self.lower = self.model.lowerPositionLimit[self._q_index[MOTORS + 1]]
        self.upper = self.model.upperPositionLimit[self._q_index[MOTORS + 1]]

    def update(self, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Compute everything at a MuJoCo state.

        Args:
            qpos: ``(23,)`` position, quaternion (w x y z), joints.
            qvel: ``(22,)`` linear velocity in the world, angular in the trunk's frame, joints.
        """
        model, data = self.model, self.data
        q, v = self.state(qpos, qvel)
        pin.crba(model, data, q, pin.Convention.WORLD)
        pin.nonLinearEffects(model, data, q, v)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        self.M_full = data.M.T.take(self._upper)
        self.h_full = data.nle.take(self._v_index)
        self.velocity = v.take(self._columns)
        self.joint_angles = qpos.take(MOTORS + 1)
        self.trunk_position = np.array(qpos[:3], dtype=float)
        self.R_wb = np.array(data.oMi[1].rotation)
        self._eliminate_wheels()
        self._centre_of_mass()
        self._legs(data.J.take(self._columns, 1), data.dJ.take(self._columns, 1))

    def _eliminate_wheels(self) -> None:
        """Solve the wheels' own rows, in which no torque acts, for their spin and insert it in the others."""
        shared = self.M_full.take(_KEPT_WHEELS)
        coupling = shared / self.M_full.diagonal()[WHEELS]
        self.M = self.M_full.take(_KEPT_KEPT) - coupling @ shared.T
        self.h = self.h_full.take(_KEPT) - coupling @ self.h_full.take(WHEELS)

    def _centre_of_mass(self) -> None:
        """Read the centre of mass off the trunk's rows: they are Newton's law of the whole robot."""
        M, m = self.M_full, self.mass
        c_b = np.array([M[1, 5], M[2, 3], M[0, 4]]) / m  # M[:3, 3:6] = -m [c]×
        R = self.R_wb / m
        self.com = self.trunk_position + self.R_wb @ c_b
        self.com_jacobian = R @ M[:3].take(_KEPT, 1)
        self.com_velocity = self.com_jacobian @ self.velocity
        self.com_drift = R @ self.h_full[:3] + GRAVITY
        self._c_b = c_b

    def _legs(self, J: np.ndarray, dJ: np.ndarray) -> None:
        """Fill in the kinematics of the legs' ends from Jacobians at the world's origin, ``(6, 18)``."""
        self.centres = np.array([self.data.oMi[j].translation for j in self._wheels])
        self.axles = np.array([self.data.oMi[j].rotation[:, 1] for j in self._calves])
        self.calf_jacobian = angular = J[3:] * self._mask
        self.centre_jacobian = J[:3] * self._mask - skew(self.centres) @ angular
        moving = self._mask[:, 0] * self.velocity
        twist, drift = moving @ J.T, moving @ dJ.T  # linear and angular, of the calf's matter at the origin
        self.calf_omega, self.calf_alpha_drift = twist[:, 3:], drift[:, 3:]
        self.centre_velocity = twist[:, :3] + cross(self.calf_omega, self.centres)
        self.centre_drift = drift[:, :3] + cross(self.calf_alpha_drift, self.centres)
        self.centre_drift += cross(self.calf_omega, self.centre_velocity)

    def contact_offsets(self, normals: np.ndarray, wheels: np.ndarray) -> np.ndarray:
        """Return :func:`contact_offsets` in the world, with the axles at this state, ``(4, 3)``."""
        return contact_offsets(self.axles, normals, wheels)

    def contacts(self, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return Jacobians, drifts and velocities of the points at ``offsets`` from the legs' ends.

        The point is the calf's matter that touches the ground *now*. A foot rolls over its own
        roundness: it is the next matter that touches next, so the offset stays put in the world while
        the calf turns, and the drift has no centripetal part. A wheel's matter moves with the spin too,
        but only along the rolling direction, which no stance constraint uses.

        Args:
            offsets: ``(4, 3)``.

        Returns:
            ``(4, 3, 18)``, ``(4, 3)``, ``(4, 3)``.
        """
        jacobian = self.centre_jacobian - skew(offsets) @ self.calf_jacobian
        drift = self.centre_drift + cross(self.calf_alpha_drift, offsets)
        return jacobian, drift, self.contact_velocity(offsets)

    def contact_velocity(self, offsets: np.ndarray) -> np.ndarray:
        """Return the velocities ``(4, 3)`` of the points at ``offsets`` ``(4, 3)`` from the legs' ends."""
        return self.centre_velocity + cross(self.calf_omega, offsets)

    def composite_inertia(self) -> np.ndarray:
        """Return the whole robot's inertia about its centre of mass, ``(3, 3)``, in the trunk's frame."""
        c = self._c_b
        return self.M_full[3:6, 3:6] - self.mass * (np.dot(c, c) * np.eye(3) - np.outer(c, c))

    def hips(self) -> np.ndarray:
        """Return where the thighs turn when abduction is zero, ``(4, 3)`` in the trunk's frame."""
        place = self.model.jointPlacements
        ids = [[self.model.getJointId(f"{leg}_{part}_joint") for part in ("hip", "thigh")] for leg in LEGS]
        return np.array([place[hip].translation + place[thigh].translation for hip, thigh in ids])

    def posture(self, com: np.ndarray, rpy: np.ndarray, centres: np.ndarray) -> np.ndarray:
        """Return the configuration with this CoM, trunk orientation and leg ends.

        The CoM moves a little as the legs fold, so the trunk is shifted until it fits.

        Args:
            com: ``(3,)``.
            rpy: ``(3,)`` roll, pitch, yaw of the trunk.
            centres: ``(4, 3)`` centres of the feet or wheels.

        Returns:
            ``(23,)`` MuJoCo configuration, wheels at zero.

        Raises:
            ValueError: when a leg cannot reach.
        """
        R_wb = rotation(rpy)
        x, y, z, w = pin.Quaternion(R_wb).coeffs()
        qpos = np.zeros(23)
        qpos[:3] = com
        qpos[3:7] = w, x, y, z
        for _ in range(30):
            for leg in range(4):
                qpos[7 + 4 * leg : 10 + 4 * leg] = leg_angles(leg, R_wb.T @ (centres[leg] - qpos[:3]))
            self.update(qpos, np.zeros(22))
            qpos[:3] += com - self.com
            if np.abs(com - self.com).max() < 1e-12:
                break
        return qpos


def leg_motion(
    leg: int, ends_b: np.ndarray, velocities_b: np.ndarray, accelerations_b: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how a leg's joints move, and the torques that make them, while its end goes along a path.

    The trunk is level and does not accelerate, nothing touches the leg, the wheel spins freely: the leg's own
    rows of the equations of motion (Paper A, eq. 37) without contact forces.

    Args:
        leg: index in :data:`wfbook.modes.LEGS`.
        ends_b: ``(n, 3)`` centre of foot and wheel in the trunk's frame.
        velocities_b: ``(n, 3)`` of it, relative to the trunk.
        accelerations_b: ``(n, 3)``.

    Returns:
        Angles, rates and torques of hip, thigh and calf, ``(n, 3)`` each.

    Raises:
        ValueError: when a point is out of reach.
    """
    robot, own = Go1Dynamics(), slice(6 + 3 * leg, 9 + 3 * leg)
    qpos, posture = np.zeros(23), np.tile([0.0, 0.9, -1.8], (4, 1))
    qpos[3] = 1.0
    samples = []
    for end, velocity, acceleration in zip(ends_b, velocities_b, accelerations_b, strict=True):
        posture[leg] = leg_angles(leg, end)
        rate = np.linalg.solve(leg_kinematics(posture)[1][leg], velocity)
        qvel = np.zeros(22)
        qpos[1 + MOTORS], qvel[MOTORS[3 * leg : 3 * leg + 3]] = posture.ravel(), rate
        robot.update(qpos, qvel)
        bend = np.linalg.solve(robot.centre_jacobian[leg][:, own], acceleration - robot.centre_drift[leg])
        samples.append((posture[leg].copy(), rate, robot.M[own, own] @ bend + robot.h[own]))
    angles, rates, torques = np.array(samples).transpose(1, 0, 2)
    return angles, rates, torques
