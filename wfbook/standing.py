"""Chapter 4: a Go1 that only stands: its joints are springs, and nobody controls it.

What it does is physics alone: no planner that believes in a friction cone and no controller that obeys
one. It stands on a slope, or on a table that tilts, until its feet slide or its wheels roll.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from wfbook.go1 import RADII, Go1, nominal
from wfbook.go1_dynamics import GRAVITY, MOTORS, Go1Dynamics, roll_pitch_yaw
from wfbook.modes import END_EFFECTORS
from wfbook.terrain import Region, Terrain

STIFFNESS = 600.0
"""Of a joint's spring, N m/rad; a motor's controller would be as stiff."""

_DAMPING = 8.0
_STEPS = 10
_SETTLE = 0.4
_SHORT = 0.03


@dataclass(frozen=True)
class Standing:
    """How a standing robot fared, ``N`` samples 10 ms apart, in the world frame.

    Attributes:
        t: ``(N,)`` time; negative while it settles on level ground, if a table tilts.
        slope: ``(N,)`` angle between the ground's normal and the vertical, rad.
        qpos: ``(N, 23)`` MuJoCo's configuration.
        com: ``(N, 3)`` centre of mass.
        com_velocity: ``(N, 3)``.
        p: ``(N, 4, 3)`` lowest point of each end effector.
        contact_force: ``(N, 4, 3)`` on the robot.
        end_effector: ``(N, 4)`` int8, 0 foot and 1 wheel.
        stance: ``(N, 4)`` bool, all true.
        normal: ``(3,)`` of the ground.
        terrain: on what it stands.
    """

    t: np.ndarray
    slope: np.ndarray
    qpos: np.ndarray
    com: np.ndarray
    com_velocity: np.ndarray
    p: np.ndarray
    contact_force: np.ndarray
    end_effector: np.ndarray
    stance: np.ndarray
    normal: np.ndarray
    terrain: Terrain

    @property
    def grip(self) -> np.ndarray:
        """``(N,)`` the force along the ground over the force normal to it, of all legs together."""
        total = self.contact_force.sum(axis=1)
        normal = total @ self.normal
        along = np.linalg.norm(total - normal[:, None] * self.normal, axis=1)
        return np.where(normal > 1.0, along / np.maximum(normal, 1.0), 0.0)

    @property
    def distance(self) -> np.ndarray:
        """``(N,)`` how far the centre of mass has moved since time 0."""
        return np.linalg.norm(self.com - self.com[np.searchsorted(self.t, -1e-9)], axis=1)

    @property
    def slip_angle(self) -> float | None:
        """The slope, rad, from which on the grip falls short of what holding needs; None if never."""
        window = np.ones(10) / 10  # a tenth of a second: the springs swing a little
        grip, needed = (np.convolve(x, window, "valid") for x in (self.grip, np.tan(self.slope)))
        slope = np.convolve(self.slope, window, "valid")
        short = (grip < (1.0 - _SHORT) * needed) & (slope > np.radians(0.2)) & (self.t[9:] > 0.0)
        # For good, not for a swing of the springs.
        lasting = np.flatnonzero(np.logical_and.accumulate(short[::-1])[::-1])
        return float(slope[lasting[0]]) if len(lasting) else None


def plane(mu: float, rolling_resistance: float = 0.0, slope: float = 0.0) -> Terrain:
    """Return one large plane to stand on.

    Args:
        mu: friction coefficient of feet, and of wheels across. Wheels have no traction.
        rolling_resistance: of wheels.
        slope: angle by which it falls along x, rad.
    """
    x, y = 30.0, 10.0
    fall = float(np.tan(slope)) * x
    corners = [[-x, -y, fall], [x, -y, -fall], [x, y, -fall], [-x, y, fall]]
    return Terrain("plane", (Region(corners, mu, 0.0, mu, rolling_resistance, "plane"),))


def stand(
    terrain: Terrain,
    end_effectors: Sequence[str] = ("foot",) * 4,
    duration: float = 2.0,
    place: tuple[float, float] = (0.0, 0.0),
    yaw: float = 0.0,
    speed: float = 0.0,
    tilt: Callable[[float], float] | None = None,
    heading: float = 0.0,
) -> Standing:
    """Put the robot on its legs and let go.

    Args:
        terrain: on what; the robot stands on one region, its trunk parallel to it.
        end_effectors: what each leg stands on, ``"foot"`` or ``"wheel"``.
        duration: to simulate.
        place: x and y of the centre of mass's foot point on the region.
        yaw: by how much the robot is turned about the region's normal, rad.
        speed: forward, at the start.
        tilt: the slope of a tilting table, rad, over time. It is gravity that is turned: whoever stands on
            the table can't tell.
        heading: of the way down a tilted table, from the world's x towards y, rad.

    Raises:
        ValueError: an unknown end effector, or there is no ground at the place.
    """
    for name in end_effectors:
        if name not in END_EFFECTORS:
            raise ValueError(f"end_effectors: {name!r} is none of {', '.join(END_EFFECTORS)}")
    kinds = np.array([END_EFFECTORS.index(name) for name in end_effectors])
    region = terrain.region_at(*place)
    if region is None:
        raise ValueError(f"place: there is no ground at {place!r}")
    ground = terrain.regions[region]
    robot, dynamics = Go1(terrain), Go1Dynamics()
    model, data = robot.model, robot.data
    R_wb = np.column_stack([ground.tangent, ground.binormal, ground.normal]) @ _about_z(yaw)
    qpos = _posture(dynamics, np.array([*place, ground.height(*place)]), R_wb, kinds)
    _hold(model, qpos)
    robot.reset(qpos, kinds)
    data.qvel[:3] = speed * R_wb[:, 0]
    data.qvel[9::4] = np.where(kinds == 1, speed / RADII[1], 0.0)
    log: dict[str, list] = {name: [] for name in ("t", "slope", "qpos", "com", "velocity", "p", "force")}
    settle = _SETTLE if tilt else 0.0
    level = np.arccos(np.clip(ground.normal[2], -1.0, 1.0))
    for tick in range(round((settle + duration) / (_STEPS * model.opt.timestep)) + 1):
        t = tick * _STEPS * model.opt.timestep - settle
        angle = tilt(max(t, 0.0)) if tilt else 0.0
        down = np.array([np.sin(angle) * np.cos(heading), np.sin(angle) * np.sin(heading), -np.cos(angle)])
        model.opt.gravity[:] = -GRAVITY[2] * down
        dynamics.update(data.qpos, data.qvel)
        offsets = dynamics.contact_offsets(np.tile(ground.normal, (4, 1)), kinds == 1)
        sample = (t, level + angle, data.qpos.copy(), dynamics.com, dynamics.com_velocity)
        sample += (dynamics.centres + offsets, robot.contact_forces())
        for values, value in zip(log.values(), sample, strict=True):
            values.append(value)
        mujoco.mj_step(model, data, _STEPS)
    t, slope, qpos, com, velocity, p, force = map(np.array, log.values())
    count = len(t)
    return Standing(
        *(t, slope, qpos, com, velocity, p, force),
        np.tile(kinds.astype(np.int8), (count, 1)),
        np.ones((count, 4), bool),
        ground.normal,
        terrain,
    )


def load_shares(slope: float, heading: float = 0.0) -> np.ndarray:
    """Return the normal force on each leg of a robot at rest on a slope, over its weight, ``(4,)``.

    The weight acts at the height of the centre of mass, so the legs down the slope carry more. Four legs on
    equal springs share what is left open evenly (the solution of least norm). A negative share: it topples.

    Args:
        slope: angle of the slope, rad.
        heading: of the way down, from the robot's forward direction to its left, rad.
    """
    body = nominal()
    x, y = body["hip_offsets"][:, :2].T
    lever = body["com_height"] * np.sin(slope)
    sums = np.array([np.cos(slope), lever * np.cos(heading), lever * np.sin(heading)])
    return np.linalg.pinv(np.vstack([np.ones(4), x, y])) @ sums


def _about_z(angle: float) -> np.ndarray:
    """Return the rotation by an angle about z, ``(3, 3)``."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _posture(
    dynamics: Go1Dynamics, foot_point: np.ndarray, R_wb: np.ndarray, kinds: np.ndarray
) -> np.ndarray:
    """Return the nominal stance over a point of a plane, ``(23,)``; wheels are higher than feet."""
    body = nominal()
    com = foot_point + body["com_height"] * R_wb[:, 2]
    centres = com + (body["hip_offsets"] + RADII[kinds][:, None] * [0.0, 0.0, 1.0]) @ R_wb.T
    return dynamics.posture(com, roll_pitch_yaw(R_wb), centres)


def _hold(model: mujoco.MjModel, qpos: np.ndarray) -> None:
    """Put springs in the motors' joints, at rest where they are."""
    joints = model.dof_jntid[MOTORS]
    model.jnt_stiffness[joints] = STIFFNESS
    model.dof_damping[MOTORS] = _DAMPING
    model.qpos_spring[:] = qpos
