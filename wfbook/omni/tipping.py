"""Chapter 10: the robot is pushed at its trunk, harder and harder, until wheels lift: MuJoCo decides when.

Nobody balances: motors hold their joints, brakes the wheels. The simulated wheel touches the ground with two
thin rims, so that the contact wrenches in the log are those of a line.
"""

from dataclasses import dataclass

import numpy as np

from wfbook.omni.dynamics import contact_axes
from wfbook.omni.robot import STEERS_V, WHEEL_HALF_WIDTH, WHEELS_V, Omni, contact_offsets, posture
from wfbook.omni.support import Contact, balance, gravity_wrench, zmp
from wfbook.omni.wrench import line_contact
from wfbook.standing import plane
from wfbook.terrain import Terrain

WIDTH = 2.0 * WHEEL_HALF_WIDTH
"""Of the line in which a wheel touches the ground."""

_BRAKE, _BRAKE_DAMPING = 150.0, 3.0
_STEPS = 10
_SETTLE = 0.6
_LIFTED = 1.0
_FALLEN = 0.06


@dataclass(frozen=True)
class Tipping:
    """How it went, ``N`` samples 10 ms apart; the push begins at time 0.

    Attributes:
        t: ``(N,)``.
        qpos: ``(N, 30)`` MuJoCo's configuration.
        push: ``(N, 3)`` force at the trunk's centre of mass, world frame.
        at: ``(N, 3)`` where it acts.
        com: ``(N, 3)`` centre of mass of the robot.
        contact: ``(N, 4, 3)`` lowest point of each wheel.
        R_wc: ``(N, 4, 3, 3)`` axes of the contacts, as in :mod:`.wrench`.
        wrench: ``(N, 4, 6)`` of the ground on each wheel, in these axes, at the contact.
        mu: friction coefficient.
        mass: of the robot.
        terrain: on which it stands.
    """

    t: np.ndarray
    qpos: np.ndarray
    push: np.ndarray
    at: np.ndarray
    com: np.ndarray
    contact: np.ndarray
    R_wc: np.ndarray
    wrench: np.ndarray
    mu: float
    mass: float
    terrain: Terrain

    @property
    def contact_force(self) -> np.ndarray:
        """``(N, 4, 3)`` force of the ground on each wheel, world frame."""
        return np.einsum("nlij,nlj->nli", self.R_wc, self.wrench[..., :3])

    @property
    def zmp(self) -> np.ndarray:
        """``(N, 2)`` zero-moment point of all contacts on the ground; not a number while nothing presses."""
        force = self.contact_force
        moment = np.einsum("nlij,nlj->nli", self.R_wc, self.wrench[..., 3:]) + np.cross(self.contact, force)
        total = np.concatenate([force, moment], axis=-1).sum(axis=1)
        total[total[:, 2] < _LIFTED] = np.nan
        return zmp(total)

    @property
    def lifted(self) -> np.ndarray:
        """``(N, 4)`` whether a wheel carries nothing."""
        return self.wrench[..., 2] < _LIFTED

    def first_lift(self) -> int | None:
        """Return the sample from which on some wheel stays off the ground, or None."""
        held = ~self.lifted.any(axis=1)
        after = int(len(held) - np.argmax(held[::-1])) if held.any() else 0
        return after if after < len(held) else None

    def contacts(self, sample: int = 0) -> list[Contact]:
        """Return the four wheels as contacts for :mod:`.support`, at one sample."""
        cone = line_contact(self.mu, WIDTH)
        return [Contact(p, R, cone) for p, R in zip(self.contact[sample], self.R_wc[sample], strict=True)]


def tip(
    heading: float = np.pi / 2,
    steer: float = 0.0,
    mu: float = 0.8,
    rate: float = 60.0,
    duration: float = 4.0,
) -> Tipping:
    """Push the robot with a force that grows from nothing.

    Args:
        heading: of the push, from ahead to the left, rad.
        steer: angle of all wheels, rad.
        mu: friction coefficient.
        rate: by which the force grows, N/s.
        duration: of the push; it ends early when the robot falls over.
    """
    terrain = plane(mu)
    robot, qpos = Omni(terrain), posture()
    qpos[1 + STEERS_V] = steer
    robot.reset(qpos)
    angles, wheels = qpos[7:].copy(), WHEELS_V - 6
    trunk = robot.model.body("trunk").id
    direction = np.array([np.cos(heading), np.sin(heading), 0.0])
    samples = []
    for tick in range(round((_SETTLE + duration) / (_STEPS * robot.model.opt.timestep)) + 1):
        t = tick * _STEPS * robot.model.opt.timestep - _SETTLE
        push = rate * max(t, 0.0) * direction
        robot.push(push)
        lowest = robot.centres + contact_offsets(robot.axles, np.tile([0.0, 0.0, 1.0], (4, 1)))
        R_wc = np.array([contact_axes(axle) for axle in robot.axles])
        wrench = np.einsum("lji,lkj->lki", R_wc, robot.contact_wrenches().reshape(4, 2, 3)).reshape(4, 6)
        data = robot.data
        places = (data.xipos[trunk].copy(), data.subtree_com[1].copy(), lowest, R_wc)
        samples.append((t, data.qpos.copy(), push, *places, wrench))
        if lowest[:, 2].max() > _FALLEN:
            break
        for _ in range(_STEPS):
            brake = np.zeros(len(angles))
            brake[wheels] = _BRAKE * (angles - data.qpos[7:])[wheels] - _BRAKE_DAMPING * data.qvel[WHEELS_V]
            robot.step(robot.servo(angles, np.zeros(len(angles)), brake))
    return Tipping(
        *(np.array(values) for values in zip(*samples, strict=True)),
        mu=mu,
        mass=float(robot.model.body_subtreemass[1]),
        terrain=terrain,
    )


def strongest_push(
    contacts: list[Contact], com: np.ndarray, at: np.ndarray, weight: float, heading: float
) -> float:
    """Return the strongest push that contacts can balance at rest (Paper B, eqs 10 and 11), in N.

    Args:
        contacts: of the robot.
        com: ``(3,)`` its centre of mass.
        at: ``(3,)`` where the push acts.
        weight: of the robot.
        heading: of the push, from the world's x towards y, rad.
    """
    direction = np.array([np.cos(heading), np.sin(heading), 0.0])
    push = np.concatenate([direction, np.cross(at, direction)])
    rest, low, high = gravity_wrench(com, weight=weight), 0.0, 4.0 * weight
    while high - low > 1e-3 * weight:
        middle = 0.5 * (low + high)
        if balance(contacts, rest + middle * push) is None:
            high = middle
        else:
            low = middle
    return low
