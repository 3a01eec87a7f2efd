"""Chapter 9: the robot drives in MuJoCo. Legs and arm hold their posture, the wheels do as a base says.

No controller knows of contact forces here, and nobody corrects the course: what the robot does differently
from the base's arithmetic is what friction, inertia and the springs of the legs do to it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wfbook.modes import LEGS
from wfbook.omni.base import Base
from wfbook.omni.robot import NU, NV, STEERS_V, WHEEL_RADIUS, WHEELS_V, Omni, OmniDynamics, contact_offsets
from wfbook.omni.robot import posture as nominal_posture
from wfbook.standing import plane

if TYPE_CHECKING:
    from wfbook.terrain import Terrain

Wanted = np.ndarray | Callable[[float, np.ndarray], np.ndarray]

_TICK = 5
"""Milliseconds from one command to the wheels to the next."""
_SAMPLE = 10
_SETTLE = 300
_FRICTION = 0.7
_UP = np.tile([0.0, 0.0, 1.0], (4, 1))


@dataclass(frozen=True)
class Driving:
    """What the robot did, N samples 10 ms apart, in the world; the samples of a run that a replay shows.

    Attributes:
        t: ``(N,)`` time; 0 when it begins to drive.
        qpos: ``(N, 30)`` MuJoCo's configurations.
        qvel: ``(N, 29)``.
        com: ``(N, 3)`` centre of mass.
        hand: ``(N, 3)`` position.
        p: ``(N, 4, 3)`` lowest points of the wheels.
        contact_force: ``(N, 4, 3)`` on the robot.
        pose: ``(N, 3)`` x, y, yaw of the base that nothing disturbs.
        twist: ``(N, 3)`` of that base, in its own axes.
        steering: ``(N, 4)`` angles commanded.
        terrain: the ground.
    """

    t: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    com: np.ndarray
    hand: np.ndarray
    p: np.ndarray
    contact_force: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    steering: np.ndarray
    terrain: "Terrain"

    @property
    def yaw(self) -> np.ndarray:
        """``(N,)`` of the trunk, without jumps."""
        w, x, y, z = self.qpos[:, 3:7].T
        return np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def holding_torques(qpos: np.ndarray) -> np.ndarray:
    """Return the motor torques ``(23,)`` that hold a configuration ``(30,)`` at rest on four wheels.

    The ground's forces are the smallest that carry the robot: the trunk's six rows of Paper B, eq. 2, say
    what they have to do together.
    """
    dynamics = OmniDynamics()
    dynamics.update(qpos, np.zeros(NV))
    rows = np.vstack([dynamics.jacobian(f"{leg}_contact")[:3] for leg in LEGS])
    forces = np.linalg.lstsq(rows[:, :6].T, dynamics.h[:6], rcond=None)[0]
    return (dynamics.h - rows.T @ forces)[6:]


def drive(
    wanted: Wanted, duration: float, base: Base | None = None, terrain: "Terrain | None" = None
) -> Driving:
    """Let the robot follow wanted twists, from rest.

    Args:
        wanted: twists ``(k, 3)`` one after the other, each for the same time; or one, ``(3,)``; or a function
            from the time and the base's pose ``(3,)`` to a twist.
        duration: of all together.
        base: that turns what is wanted into commands; its state is changed. A new one without it.
        terrain: without it a large level plane with a friction of 0.7.
    """
    steps = round(1000 * duration)
    if not callable(wanted):
        twists = np.atleast_2d(np.asarray(wanted, dtype=float))

        def wanted(t: float, _pose: np.ndarray) -> np.ndarray:
            return twists[min(int(t / duration * len(twists) + 1e-9), len(twists) - 1)]

    base = Base() if base is None else base
    robot = Omni(plane(_FRICTION) if terrain is None else terrain)
    qpos = nominal_posture()
    qpos[1 + STEERS_V] = base.steering
    robot.reset(qpos)
    angles, rates, torques = qpos[7:].copy(), np.zeros(NU), holding_torques(qpos)
    samples = []
    for step in range(-_SETTLE, steps):
        if step >= 0 and step % _TICK == 0:
            speed = base.advance(wanted(step / 1000, base.state[:3].copy()), _TICK / 1000)
            rates[STEERS_V - 6] = 1000 / _TICK * (base.steering - angles[STEERS_V - 6])
            angles[STEERS_V - 6] = base.steering
            rates[WHEELS_V - 6] = speed / WHEEL_RADIUS
        robot.step(robot.servo(angles, rates, torques))
        if step >= 0 and step % _SAMPLE == 0:
            samples.append(_sample(step / 1000, robot, base))
    columns = {name: np.array([sample[name] for sample in samples]) for name in samples[0]}
    return Driving(**columns, terrain=robot.terrain)


def _sample(t: float, robot: Omni, base: Base) -> dict[str, np.ndarray | float]:
    """Return one sample of each array of :class:`Driving`."""
    data = robot.data
    return {
        "t": t,
        "qpos": data.qpos.copy(),
        "qvel": data.qvel.copy(),
        "com": data.subtree_com[1].copy(),
        "hand": robot.hand[0],
        "p": robot.centres + contact_offsets(robot.axles, _UP),
        "contact_force": robot.contact_wrenches()[:, :3],
        "pose": base.state[:3].copy(),
        "twist": base.twist,
        "steering": base.steering.copy(),
    }
