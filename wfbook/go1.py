"""The Unitree Go1 whose legs end in a foot *and* a passive wheel, simulated by MuJoCo.

Both end effectors sit on the calf's end, concentric. Only one of them collides at a time: paper A's
mechanism switches "nearly instantly during the swing phase", and so does :meth:`Go1.set_end_effector`.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from wfbook.modes import END_EFFECTORS, LEGS

if TYPE_CHECKING:
    from wfbook.terrain import Region, Terrain

ASSETS = Path(__file__).resolve().parent.parent / "assets" / "go1"
FOOT_RADIUS = 0.02
WHEEL_RADIUS = 0.04
WHEEL_HALF_WIDTH = 0.012
RADII = np.array([FOOT_RADIUS, WHEEL_RADIUS])
"""Height of the leg's end above its contact point, by end effector (0 foot, 1 wheel)."""

IMU_POSITION = np.array([-0.01592, -0.06659, -0.00617])
"""Of the inertial measurement unit, in the trunk's frame; it is not turned."""

_LINK = 0.213
_HIP = np.array([0.1881, 0.04675, 0.0])
_ABDUCTION = 0.08
_SIDES = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]])
_YZX, _ZXY = np.array([1, 2, 0]), np.array([2, 0, 1])
_THICKNESS = 0.5
_LOADED = 1.0
_SEAM = 1e-4


class LoadedLegError(ValueError):
    """The end effector of a leg that carries load cannot be switched."""


def nominal() -> dict[str, np.ndarray | float]:
    """Return what a planner needs to know of the robot, from ``assets/go1/nominal.json``.

    Returns:
        ``mass``; ``com_height`` above the ground; ``inertia`` ``(3, 3)`` about the CoM in the nominal
        stance; and, relative to the CoM: ``hip_offsets`` ``(4, 3)`` the nominal contact points, ``hips``
        ``(4, 3)`` where the thighs turn, ``trunk`` ``(3,)`` the trunk's origin. ``joint_angles`` ``(12,)``.
    """
    values = json.loads((ASSETS / "nominal.json").read_text())
    return {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}


def leg_angles(leg: int, end_b: np.ndarray) -> np.ndarray:
    """Return hip, thigh and calf angles that put a leg's end at a point (knee pointing back).

    Args:
        leg: index in :data:`wfbook.modes.LEGS`.
        end_b: ``(3,)`` the end in the trunk's frame.

    Raises:
        ValueError: when the point is out of reach.
    """
    front, left = (1, -1)[leg // 2], (1, -1)[leg % 2]
    x, y, z = end_b - _HIP * [front, left, 1.0]
    depth = np.sqrt(max(y * y + z * z - _ABDUCTION**2, 0.0))
    reach = np.hypot(x, depth)
    if not abs(reach / (2 * _LINK)) <= 1.0 or y * y + z * z < _ABDUCTION**2:
        raise ValueError(f"{LEGS[leg]} can't reach {np.round(end_b, 3).tolist()} (trunk frame)")
    hip = np.arctan2(z, y) - np.arctan2(-depth, left * _ABDUCTION)
    hip = (hip + np.pi) % (2 * np.pi) - np.pi
    calf = -2 * np.arccos(reach / (2 * _LINK))
    return np.array([hip, np.arctan2(-x, depth) - calf / 2, calf])


def calf_pitch(leg_w: np.ndarray) -> float:
    """Return by how much a calf is turned about the y axis, zero where it hangs straight down.

    Args:
        leg_w: ``(3,)`` from where the thigh turns to the leg's end, in the world; the leg is not splayed.
    """
    reach = min(np.hypot(leg_w[0], leg_w[2]) / (2 * _LINK), 1.0)
    return float(np.arctan2(-leg_w[0], -leg_w[2]) - np.arccos(reach))


def leg_kinematics(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where the legs' ends are in the trunk's frame, and how they and the calves move.

    Args:
        angles: ``(4, 3)`` hip, thigh and calf of each leg.

    Returns:
        ``(4, 3)`` ends (centres of foot and wheel), ``(4, 3, 3)`` their Jacobians, and ``(4, 3, 3)`` the
        Jacobians of the calves' angular velocities, whose last columns are the wheels' axles.
    """
    hip, thigh, calf = angles.T
    cos, sin = np.cos(hip), np.sin(hip)
    slopes = np.array([thigh, thigh + calf])
    x, depth = -_LINK * np.sin(slopes), -_LINK * np.cos(slopes)  # of thigh and calf, before the hip turns
    links = np.array([x, -sin * depth, cos * depth]).transpose(1, 2, 0)
    axles = np.array([0.0 * cos, cos, sin]).T
    from_knee, from_thigh = links[1], links[0] + links[1]
    from_hip = from_thigh + _ABDUCTION * _SIDES[:, 1:2] * axles
    turning, levers = np.zeros((4, 3, 3)), np.empty((4, 3, 3))
    turning[:, 0, 0] = 1.0
    turning[:, :, 1] = turning[:, :, 2] = axles
    levers[:, :, 0], levers[:, :, 1], levers[:, :, 2] = from_hip, from_thigh, from_knee
    jacobian = turning.take(_YZX, 1) * levers.take(_ZXY, 1) - turning.take(_ZXY, 1) * levers.take(_YZX, 1)
    return _HIP * _SIDES + from_hip, jacobian, turning


class Go1:
    """A Go1 on a terrain: MuJoCo's model and data, and what a controller and a log need of them.

    The terrain brings friction and rolling resistance. Each convex body of regions becomes two geoms of the
    same shape, one for feet and hulls, one for wheels, because one MuJoCo geom has one friction for all it
    meets.

    Args:
        terrain: to stand on.
        joint_friction: dry friction of every motor's joint, N m. The URDF says 0.2.
        trunk_mass_scale: multiplies the trunk's mass and inertia.

    Attributes:
        model, data: MuJoCo's.
        terrain: as given.
        joint_names: of ``qpos[7:]``, in order.
    """

    def __init__(
        self, terrain: "Terrain", joint_friction: float = 0.0, trunk_mass_scale: float = 1.0
    ) -> None:
        spec = mujoco.MjSpec.from_file(str(ASSETS / "go1.xml"))
        add_ground(spec, terrain, WHEEL_RADIUS)
        self.terrain = terrain
        self.model = model = spec.compile()
        self.data = mujoco.MjData(model)
        self.joint_names = [model.joint(i).name for i in range(1, model.njnt)]
        motors = [
            model.joint(f"{leg}_{part}_joint").dofadr[0] for leg in LEGS for part in ("hip", "thigh", "calf")
        ]
        model.dof_frictionloss[motors] = joint_friction
        trunk = model.body("trunk").id
        model.body_mass[trunk] *= trunk_mass_scale
        model.body_inertia[trunk] *= trunk_mass_scale
        mujoco.mj_setConst(model, self.data)
        names = [[f"{leg}_{kind}" for kind in END_EFFECTORS] for leg in LEGS]
        self._geoms = np.array([[model.geom(name).id for name in pair] for pair in names])
        self._leg_of_geom = [-1] * model.ngeom
        for leg, pair in enumerate(self._geoms):
            for geom in pair:
                self._leg_of_geom[geom] = leg
        self._bits = model.geom_contype[self._geoms].copy()
        self._robot_geom = (model.geom_bodyid != 0).tolist()
        self._trunk = trunk
        self._sites = np.array([model.site(f"{leg}_end").id for leg in LEGS])

    def reset(self, qpos: np.ndarray, end_effectors: np.ndarray) -> None:
        """Put the robot at rest.

        Args:
            qpos: ``(23,)``.
            end_effectors: ``(4,)`` 0 foot, 1 wheel.
        """
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = qpos
        self.model.geom_contype[self._geoms] = 0
        for leg, kind in enumerate(end_effectors):
            self._switch(leg, int(kind))
        mujoco.mj_forward(self.model, self.data)

    def step(self, torques: np.ndarray) -> None:
        """Simulate one time step (1 ms) with ``(12,)`` motor torques, cut at the motors' limits."""
        self.data.ctrl[:] = torques
        mujoco.mj_step(self.model, self.data)

    def push(self, force: np.ndarray) -> None:
        """Pull at the trunk's centre of mass with a force ``(3,)`` in the world until told otherwise."""
        self.data.xfrc_applied[self._trunk, :3] = force

    def end_effector(self, leg: str) -> str:
        """Return what a leg stands on: ``"foot"`` or ``"wheel"``."""
        return END_EFFECTORS[self.end_effectors[LEGS.index(leg)]]

    @property
    def end_effectors(self) -> np.ndarray:
        """``(4,)`` int8: 0 foot, 1 wheel."""
        return (self.model.geom_contype.take(self._geoms[:, 1]) != 0).astype(np.int8)

    def set_end_effector(self, leg: str, kind: str) -> None:
        """Make a leg stand on its foot or on its wheel from now on.

        Args:
            leg: one of :data:`wfbook.modes.LEGS`.
            kind: ``"foot"`` or ``"wheel"``.

        Raises:
            LoadedLegError: the leg carries more than 1 N.
            ValueError: unknown leg or end effector.
        """
        if leg not in LEGS:
            raise ValueError(f"leg: {leg!r} is none of {', '.join(LEGS)}")
        if kind not in END_EFFECTORS:
            raise ValueError(f"kind: {kind!r} is none of {', '.join(END_EFFECTORS)}")
        index = LEGS.index(leg)
        load = np.linalg.norm(self.contact_forces()[index])
        if kind != self.end_effector(leg) and load > _LOADED:
            raise LoadedLegError(f"{leg} carries {load:.0f} N: lift it before you switch to the {kind}")
        self._switch(index, END_EFFECTORS.index(kind))

    def _switch(self, leg: int, kind: int) -> None:
        """Let one geom of a leg collide and the other not (both are compiled as colliding)."""
        self.model.geom_contype[self._geoms[leg, kind]] = self._bits[leg, kind]
        self.model.geom_contype[self._geoms[leg, 1 - kind]] = 0

    @property
    def centres(self) -> np.ndarray:
        """``(4, 3)`` centres of the feet and wheels."""
        return self.data.site_xpos[self._sites].copy()

    def contact_forces(self) -> np.ndarray:
        """Return the force of the ground on each leg's end effector, world frame, ``(4, 3)``."""
        data, forces = self.data, np.zeros((4, 3))
        contact = data.contact
        frames, acting = contact.frame.reshape(-1, 3, 3), data.efc_force
        pairs = zip(contact.geom.tolist(), contact.efc_address.tolist(), frames, strict=True)
        for (first, second), start, frame in pairs:
            on_second = self._robot_geom[second]
            leg = self._leg_of_geom[second if on_second else first]
            if leg >= 0 and start >= 0:
                force = acting[start : start + 3] @ frame
                forces[leg] += force if on_second else -force  # the frame points to the second geom
        return forces

    def touches_with_hull(self) -> bool:
        """Whether anything but feet and wheels touches the ground."""
        leg_of = self._leg_of_geom
        return any(max(leg_of[a], leg_of[b]) < 0 for a, b in self.data.contact.geom.tolist())


def momenta(qpos: np.ndarray, qvel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the momentum of all bodies together, as MuJoCo adds it up.

    Args:
        qpos: ``(N, 23)`` configurations.
        qvel: ``(N, 22)`` velocities.

    Returns:
        ``(N, 3)`` linear momentum, and ``(N, 3)`` angular momentum about the centre of mass, world frame.
    """
    model = mujoco.MjModel.from_xml_path(str(ASSETS / "go1.xml"))
    data = mujoco.MjData(model)
    trunk = model.body("trunk").id
    linear, angular = np.empty((len(qpos), 3)), np.empty((len(qpos), 3))
    for k, (data.qpos, data.qvel) in enumerate(zip(qpos, qvel, strict=True)):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        linear[k] = model.body_subtreemass[trunk] * data.subtree_linvel[trunk]
        angular[k] = data.subtree_angmom[trunk]
    return linear, angular


def knees(qpos: np.ndarray) -> np.ndarray:
    """Return where the knees are in the world, ``(N, 4, 3)``, of MuJoCo configurations ``(N, 23)``."""
    model = mujoco.MjModel.from_xml_path(str(ASSETS / "go1.xml"))
    data = mujoco.MjData(model)
    calves = [model.body(f"{leg}_calf").id for leg in LEGS]
    places = np.empty((len(qpos), len(LEGS), 3))
    for k, data.qpos in enumerate(qpos):
        mujoco.mj_kinematics(model, data)
        places[k] = data.xpos[calves]
    return places


def convex_bodies(terrain: "Terrain") -> list[list[int]]:
    """Return the indices of the regions that make one convex body each, so that it has no seams.

    Where two geoms meet, a wheel that sinks half a millimetre into one runs against the edge of the other
    and is slowed. Over a crest, regions of the same friction are one convex body, and the crest is its edge.
    In a hollow they can't be, and need not: there a wheel leaves the one as it touches the other.
    """
    regions = terrain.regions
    bodies = [[i] for i in range(len(regions))]
    # In two dimensions scipy calls the area volume.
    areas = [ConvexHull(r.vertices[:, :2]).volume for r in regions]
    low = np.array([r.vertices[:, :2].min(axis=0) for r in regions]) - _SEAM
    high = np.array([r.vertices[:, :2].max(axis=0) for r in regions])
    joined = True
    while joined:
        joined = False
        first = 0
        while first < len(bodies):
            apart = (low[first] > high) | (low > high[first])
            for other in np.flatnonzero(~apart.any(axis=1)):
                if other > first and _convex(terrain, bodies[first] + bodies[other], areas):
                    bodies[first] += bodies.pop(other)
                    low[first] = np.minimum(low[first], low[other])
                    high[first] = np.maximum(high[first], high[other])
                    low, high = np.delete(low, other, axis=0), np.delete(high, other, axis=0)
                    joined = True
                    break
            else:
                first += 1
    return bodies


def _convex(terrain: "Terrain", indices: list[int], areas: list[float]) -> bool:
    """Whether the union of regions is the upper side of a convex body of one friction; ``areas`` are all."""
    regions = [terrain.regions[i] for i in indices]
    if len({(r.mu_foot, r.mu_wheel_lateral, r.rolling_resistance) for r in regions}) > 1:
        return False
    corners = np.vstack([r.vertices for r in regions])
    if max(((corners - r.vertices[0]) @ r.normal).max() for r in regions) >= _SEAM:
        return False
    area = sum(areas[i] for i in indices)
    return abs(ConvexHull(corners[:, :2]).volume - area) < _SEAM * area


def add_ground(spec: mujoco.MjSpec, terrain: "Terrain", wheel_radius: float) -> None:
    """Add a terrain to a robot's model: what feet and hulls touch (bit 1) and what wheels touch (bit 2).

    Args:
        spec: of the robot.
        terrain: to stand on.
        wheel_radius: of the robot's wheels; the rolling resistance is over it.
    """
    for index, body in enumerate(convex_bodies(terrain)):
        _add_body(spec, [terrain.regions[i] for i in body], index, wheel_radius)


def _add_body(spec: mujoco.MjSpec, regions: "list[Region]", index: int, wheel_radius: float) -> None:
    """Add regions to a model as the top of one convex body, once for feet and once for wheels."""
    corners = np.vstack([region.vertices for region in regions])
    centre, region = corners.mean(axis=0), regions[0]
    top = corners - centre
    prism = np.vstack([top, top - [0.0, 0.0, _THICKNESS]])
    spec.add_mesh(name=f"ground_{index}", uservert=prism.ravel())
    for kind, bit, mu in (("foot", 1, region.mu_foot), ("wheel", 2, region.mu_wheel_lateral)):
        rolling = region.rolling_resistance * wheel_radius if kind == "wheel" else 0.0
        spec.worldbody.add_geom(
            name=f"ground_{index}_{kind}",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=f"ground_{index}",
            pos=centre,
            contype=0,
            conaffinity=bit,
            condim=6 if rolling > 0 else 3,
            friction=[mu, 0.0, rolling],
        )
