"""The robot of paper B, four legs on steered and driven wheels and a Z1 arm, in MuJoCo and in Pinocchio.

A leg has a hip and a knee that pitch, a steering joint that turns without end, and a wheel: no abduction. The
steering axis is bolted to the shank so that it is vertical in the nominal posture, straight through the
wheel's middle. The wheel touches the ground along a line as wide as its tread. The paper gives neither
lengths nor masses: what it gives is that the hand is carried 0.92 m above the ground with roll, pitch and yaw
of (-1.57, 0, -1.57), and how many joints there are. Everything else is chosen; ``assets/README.md`` says how.

MuJoCo's configuration ``qpos`` ``(30,)`` and velocity ``qvel`` ``(29,)`` are: the trunk's position and
quaternion (its velocity), then hip, knee, steer and wheel of each leg in the order of
:data:`wfbook.modes.LEGS`, six joints of the arm, and the gripper. The paper counts 41 states: 21 + 20, with
steering, wheels and gripper locked (:func:`locked_model`).

Between the two libraries conventions differ as for the Go1 (:mod:`wfbook.go1_dynamics`): the quaternion is
w x y z here and x y z w in Pinocchio, and the trunk's linear velocity is in the world here and in the trunk's
frame there.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import pinocchio as pin

from wfbook.go1 import add_ground
from wfbook.go1_dynamics import FloatingBase, cross
from wfbook.modes import LEGS

if TYPE_CHECKING:
    from wfbook.terrain import Terrain

ASSETS = Path(__file__).resolve().parent.parent.parent / "assets" / "omni"
NQ, NV, NU = 30, 29, 23
PARTS = ("hip", "knee", "steer", "wheel")
JOINTS = (
    *(f"{leg}_{part}_joint" for leg in LEGS for part in PARTS),
    *(f"arm{i}_joint" for i in range(1, 7)),
    "gripper_joint",
)
"""The motors' joints, in MuJoCo's order; a motor's torque has the same index."""

HIPS_V, KNEES_V, STEERS_V, WHEELS_V = 6 + np.arange(4)[:, None] + 4 * np.arange(4)
"""Indices ``(4,)`` of a part of each leg in ``qvel``; in ``qpos`` one more, in the torques six less."""

LEGS_V = np.sort(np.concatenate([HIPS_V, KNEES_V]))
"""Indices ``(8,)`` of hips and knees in ``qvel``, leg by leg."""

ARM_V, GRIPPER_V = np.arange(22, 28), 28
HIPS = np.array([[0.28, 0.19, 0.0], [0.28, -0.19, 0.0], [-0.28, 0.19, 0.0], [-0.28, -0.19, 0.0]])
"""Where the thighs turn, in the trunk's frame, whose origin is the middle between them."""

WHEEL_POSITIONS = HIPS[:, :2]
"""Nominal places ``(4, 2)`` of the wheels in the trunk's frame: below the hips, however they are steered."""

THIGH, SHANK, FORK = 0.25, 0.25, 0.10
"""Lengths: hip to knee, knee to steering joint, and from there down to the axle."""

WHEEL_RADIUS = 0.085
WHEEL_HALF_WIDTH = 0.02
"""Half of the line in which a wheel touches the ground."""

NOMINAL_HEIGHT = 0.53
"""Of the trunk's origin above the ground."""

SHANK_PITCH = -float(np.arccos((NOMINAL_HEIGHT - WHEEL_RADIUS - FORK) / (THIGH + SHANK)))
"""In the nominal posture, about y; the thigh's is the opposite."""

ARM_BASE = np.array([0.05, 0.0, 0.07])
"""The arm's foot in the trunk's frame."""

SHOULDER = ARM_BASE + np.array([0.0, 0.0, 0.0585 + 0.045])
"""Where the arm's second joint turns, likewise."""

HAND_HEIGHT = 0.92
HAND_RPY = np.array([-np.pi / 2, 0.0, -np.pi / 2])
"""Paper B's target: the hand's z axis points ahead, its y axis down."""

HAND_REACH = 0.45
"""Of the hand ahead of the shoulder, in the nominal posture."""

STIFFNESS = np.array(4 * [800.0, 800.0, 80.0, 0.0] + [300.0, 300.0, 200.0, 60.0, 30.0, 10.0, 4.0])
DAMPING = np.array(4 * [20.0, 20.0, 1.0, 2.5] + [10.0, 10.0, 6.0, 1.5, 0.6, 0.2, 0.06])
"""``(23,)`` of the motors' own PD loops: steering holds an angle, wheels a speed. No stiffer than a loop at
1 kHz can be on joints as light as the wrist, which has no rotors' inertia here."""

_UPPER_ARM, _FOREARM, _WRIST = 0.35, np.array([0.218, 0.057]), 0.07 + 0.0492 + 0.171
_LOWER = np.array([0.0, -SHANK]) + FORK * np.array([np.sin(SHANK_PITCH), -np.cos(SHANK_PITCH)])


def leg_angles(axle_h: np.ndarray) -> np.ndarray:
    """Return hip and knee angles that put a wheel's axle at a point (knee pointing back).

    Args:
        axle_h: ``(2,)`` x and z of the axle from the hip, in the trunk's frame.

    Raises:
        ValueError: when the point is out of reach.
    """
    reach, lower = np.hypot(*axle_h), np.hypot(*_LOWER)
    bend = (THIGH**2 + lower**2 - reach**2) / (2 * THIGH * lower)
    if not abs(bend) <= 1.0:
        raise ValueError(f"no leg can reach {np.round(axle_h, 3).tolist()} (x and z from the hip)")
    # About y, from straight down: positive turns backward. The knee points back, the shank ahead of it.
    turned = np.arctan2(-_LOWER[0], -_LOWER[1])
    knee = -(np.pi - np.arccos(bend)) - turned
    foot = THIGH * np.array([0.0, -1.0]) + lower * np.array([-np.sin(knee + turned), -np.cos(knee + turned)])
    return np.array([np.arctan2(-axle_h[0], -axle_h[1]) - np.arctan2(-foot[0], -foot[1]), knee])


def arm_angles(ahead: float, up: float, pitch: float = 0.0) -> np.ndarray:
    """Return the arm's six angles that put the hand in the trunk's x-z plane, elbow up.

    Args:
        ahead: of the hand from the shoulder, in the trunk's frame.
        up: likewise.
        pitch: of the hand about y, 0 when it points ahead.

    Raises:
        ValueError: when the point is out of reach.
    """
    x, z = ahead - _WRIST * np.cos(pitch), up + _WRIST * np.sin(pitch)
    forearm, reach = np.hypot(*_FOREARM), np.hypot(x, z)
    opening = (_UPPER_ARM**2 + reach**2 - forearm**2) / (2 * _UPPER_ARM * max(reach, 1e-9))
    if not abs(opening) <= 1.0:
        raise ValueError(f"the arm can't reach {ahead:.3f} m ahead and {up:.3f} m up of its shoulder")
    rise = np.arctan2(z, x) + np.arccos(opening)  # elevation of the upper arm; the Z1's zero points back
    elbow = _UPPER_ARM * np.array([np.cos(rise), np.sin(rise)])
    tilt = np.arctan2(_FOREARM[1], _FOREARM[0]) - np.arctan2(z - elbow[1], x - elbow[0])
    shoulder = np.pi - rise
    return np.array([0.0, shoulder, tilt - shoulder, pitch - tilt, 0.0, 0.0])


def posture(
    height: float = NOMINAL_HEIGHT, hand_height: float = HAND_HEIGHT, hand_reach: float = HAND_REACH
) -> np.ndarray:
    """Return a configuration ``(30,)`` on level ground at the world's origin, wheels straight below the hips.

    Args:
        height: of the trunk.
        hand_height: above the ground; the hand is level.
        hand_reach: of the hand ahead of the shoulder.

    Raises:
        ValueError: when legs or arm can't reach.
    """
    qpos = np.zeros(NQ)
    qpos[2:4] = height, 1.0
    qpos[1 + LEGS_V] = np.tile(leg_angles(np.array([0.0, WHEEL_RADIUS - height])), 4)
    qpos[1 + ARM_V] = arm_angles(hand_reach, hand_height - height - SHOULDER[2])
    return qpos


class Omni:
    """The robot on a terrain: MuJoCo's model and data, and what a controller and a log need of them.

    Args:
        terrain: to stand on.
        trunk_mass_scale: multiplies the trunk's mass and inertia.
        payload: mass in the hand, a point.

    Attributes:
        model, data: MuJoCo's.
        terrain: as given.
    """

    def __init__(self, terrain: "Terrain", trunk_mass_scale: float = 1.0, payload: float = 0.0) -> None:
        spec = mujoco.MjSpec.from_file(str(ASSETS / "omni.xml"))
        add_ground(spec, terrain, WHEEL_RADIUS)
        if payload > 0.0:
            place, inertia = spec.site("hand").pos, [1e-6, 1e-6, 1e-6]
            # Without an ipos of its own the mass would hang twice as far out.
            spec.body("link06").add_body(
                name="payload",
                pos=place,
                ipos=[0.0] * 3,
                mass=payload,
                inertia=inertia,
                explicitinertial=True,
            )
        self.terrain = terrain
        self.model = model = spec.compile()
        self.data = mujoco.MjData(model)
        trunk = model.body("trunk").id
        model.body_mass[trunk] *= trunk_mass_scale
        model.body_inertia[trunk] *= trunk_mass_scale
        mujoco.mj_setConst(model, self.data)
        self.efforts = model.actuator_ctrlrange[:, 1].copy()
        self._trunk = trunk
        self._axles = np.array([model.site(f"{leg}_axle").id for leg in LEGS])
        self._wheels = np.array([model.body(f"{leg}_wheel").id for leg in LEGS])
        self._leg_of_geom = {
            model.geom(f"{leg}_rim_{side}").id: i for i, leg in enumerate(LEGS) for side in ("left", "right")
        }
        self._hand = model.site("hand").id
        self.reset(posture())

    def reset(self, qpos: np.ndarray, qvel: np.ndarray | None = None) -> None:
        """Put the robot in a configuration ``(30,)``, at rest or with velocity ``(29,)``."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = qpos
        if qvel is not None:
            self.data.qvel[:] = qvel
        mujoco.mj_forward(self.model, self.data)

    def step(self, torques: np.ndarray) -> None:
        """Simulate one time step (1 ms) with ``(23,)`` motor torques, cut at the motors' limits."""
        self.data.ctrl[:] = torques
        mujoco.mj_step(self.model, self.data)

    def servo(self, angles: np.ndarray, rates: np.ndarray, torques: np.ndarray | float = 0.0) -> np.ndarray:
        """Return what the motors' own PD loops ask for, ``(23,)``.

        Args:
            angles: ``(23,)`` wanted of the joints; those of the wheels do not matter.
            rates: ``(23,)`` wanted.
            torques: ``(23,)`` fed forward.
        """
        data = self.data
        return torques + STIFFNESS * (angles - data.qpos[7:]) + DAMPING * (rates - data.qvel[6:])

    def push(self, force: np.ndarray) -> None:
        """Pull at the trunk's centre of mass with a force ``(3,)`` in the world until told otherwise."""
        self.data.xfrc_applied[self._trunk, :3] = force

    @property
    def hand(self) -> tuple[np.ndarray, np.ndarray]:
        """Position ``(3,)`` and orientation ``(3, 3)`` of the hand in the world."""
        return self.data.site_xpos[self._hand].copy(), self.data.site_xmat[self._hand].reshape(3, 3).copy()

    @property
    def centres(self) -> np.ndarray:
        """``(4, 3)`` middles of the wheels."""
        return self.data.site_xpos[self._axles].copy()

    @property
    def axles(self) -> np.ndarray:
        """``(4, 3)`` unit vectors along the axles, to the left of the rolling directions."""
        return self.data.xmat[self._wheels].reshape(4, 3, 3)[:, :, 1].copy()

    def contact_wrenches(self) -> np.ndarray:
        """Return what the ground does to each wheel: ``(4, 6)`` force and moment, world frame.

        The moment is about the wheel's lowest point, the middle of the line it touches level ground in.
        """
        data, wrenches = self.data, np.zeros((4, 6))
        lowest = self.centres + contact_offsets(self.axles, np.tile([0.0, 0.0, 1.0], (4, 1)))
        for i in range(data.ncon):
            contact = data.contact[i]
            first, second = (self._leg_of_geom.get(int(geom)) for geom in contact.geom)
            leg = second if second is not None else first
            if leg is None or contact.efc_address < 0:
                continue
            local = np.zeros(6)
            mujoco.mj_contactForce(self.model, data, i, local)
            sign = 1.0 if second is not None else -1.0  # the contact's frame points to the second geom
            frame = contact.frame.reshape(3, 3)
            force, moment = sign * local[:3] @ frame, sign * local[3:] @ frame
            wrenches[leg, :3] += force
            wrenches[leg, 3:] += moment + cross(contact.pos - lowest[leg], force)
        return wrenches

    def touches_with_hull(self) -> bool:
        """Whether anything but wheels touches the ground."""
        geoms = self.data.contact.geom.tolist()
        return any(a not in self._leg_of_geom and b not in self._leg_of_geom for a, b in geoms)


def contact_offsets(axles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the vectors ``(4, 3)`` from the wheels' middles to where they touch a plane.

    Args:
        axles: ``(4, 3)`` unit vectors along the axles.
        normals: ``(4, 3)`` unit normals of the ground, in the same frame.
    """
    down = normals - np.sum(normals * axles, axis=1, keepdims=True) * axles
    return -WHEEL_RADIUS * down / np.linalg.norm(down, axis=1, keepdims=True)


def pinocchio_model() -> pin.Model:
    """Return Pinocchio's model of the robot, nq 30 and nv 29; sites of the MJCF are its frames.

    Of each leg there are ``FL_axle``, the wheel's middle, and ``FL_contact``, below it by a radius; both turn
    with the steering and not with the wheel. ``hand`` is between the fingers, ``imu`` at the trunk's origin.
    """
    return pin.buildModelFromMJCF(str(ASSETS / "omni.xml"))


def locked_model(qpos: np.ndarray | None = None) -> pin.Model:
    """Return the model with steering, wheels and gripper locked, nq 21 and nv 20: the paper's 41 states.

    Args:
        qpos: ``(30,)`` MuJoCo configuration in which they are locked; the nominal one without it.
    """
    full = OmniDynamics()
    q, _ = full.state(posture() if qpos is None else qpos, np.zeros(NV))
    indices = [*STEERS_V, *WHEELS_V, GRIPPER_V]
    joints = sorted(full.model.getJointId(JOINTS[i - 6]) for i in indices)
    return pin.buildReducedModel(full.model, joints, q)


class OmniDynamics(FloatingBase):
    """Mass matrix, bias forces and kinematics at one state, from Pinocchio (Paper B, eqs 1 and 2).

    Call :meth:`update`, then read the attributes and ask for frames. Joints are in MuJoCo's order, the
    trunk's velocity (linear, then angular) is in its own frame, as Pinocchio has it.

    Not as printed, eq. 1: the paper calls ``r_WB`` the centre of mass. In a configuration it can only be the
    origin of the trunk's frame.

    Attributes:
        model, data: Pinocchio's.
        mass: of the whole robot.
        velocity: ``(29,)`` generalised velocity.
        M: ``(29, 29)`` mass matrix.
        h: ``(29,)`` Coriolis, centrifugal and gravity forces.
        com: ``(3,)`` centre of mass.
        R_wb: ``(3, 3)`` the trunk's orientation.
    """

    def __init__(self) -> None:
        super().__init__(pinocchio_model(), JOINTS)
        self.efforts = np.array(self.model.effortLimit)[self._v_index[6:]]

    def update(self, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Compute everything at a MuJoCo state, ``(30,)`` and ``(29,)``."""
        model, data = self.model, self.data
        q, v = self.state(qpos, qvel)
        pin.crba(model, data, q, pin.Convention.WORLD)
        pin.nonLinearEffects(model, data, q, v)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        pin.updateFramePlacements(model, data)
        order = np.ix_(self._v_index, self._v_index)
        upper = np.triu(data.M)
        self.M = (upper + np.triu(upper, 1).T)[order]
        self.h = data.nle[self._v_index]
        self.velocity = v[self._v_index]
        self.com = np.array(pin.centerOfMass(model, data, q, False))
        self.R_wb = np.array(data.oMi[1].rotation)

    def placement(self, frame: str) -> tuple[np.ndarray, np.ndarray]:
        """Return position ``(3,)`` and orientation ``(3, 3)`` of a frame in the world."""
        placement = self.data.oMf[self.model.getFrameId(frame)]
        return np.array(placement.translation), np.array(placement.rotation)

    def jacobian(self, frame: str) -> np.ndarray:
        """Return the Jacobian ``(6, 29)`` of a frame's linear and angular velocity, in the world's axes."""
        index = self.model.getFrameId(frame)
        return pin.getFrameJacobian(self.model, self.data, index, pin.LOCAL_WORLD_ALIGNED)[:, self._v_index]

    def drift(self, frame: str) -> np.ndarray:
        """Return a frame's linear and angular acceleration ``(6,)`` when the generalised one is zero, J̇v."""
        index = self.model.getFrameId(frame)
        return (
            pin.getFrameJacobianTimeVariation(self.model, self.data, index, pin.LOCAL_WORLD_ALIGNED)[
                :, self._v_index
            ]
            @ self.velocity
        )
