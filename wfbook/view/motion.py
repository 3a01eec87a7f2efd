"""What a replay shows of a run or of a plan: everything sampled at the frames of the animation."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PchipInterpolator

from wfbook import go1
from wfbook.go1 import RADII, WHEEL_RADIUS
from wfbook.modes import LEGS
from wfbook.omni import robot as omni
from wfbook.omni.driving import Driving
from wfbook.omni.tipping import Tipping
from wfbook.standing import Standing
from wfbook.terrain import Terrain
from wfbook.view.balance import Balance, balance_of
from wfbook.view.spans import SWINGING, plan_modes
from wfbook.view.tracks import FPS

if TYPE_CHECKING:
    from wfbook.omni.tasks import Planned
    from wfbook.planner import Plan
    from wfbook.simulate import Run


@dataclass(frozen=True)
class Motion:
    """N frames of a robot that moves.

    Attributes:
        start: time of the first frame.
        qpos: (N, 23) MuJoCo configurations; (N, 30) of the robot of part II.
        end_effector: (N, 4), 0 foot or 1 wheel.
        modes: (N, 4), 0 stands on its foot, 1 on its wheel, 2 swings.
        contact: (N, 4, 3) lowest point of each leg.
        force: (N, 4, 3) contact force on the robot, world frame.
        planned_com: (N, 3); the measured one itself where nobody planned.
        measured_com: (N, 3), or None for a plan that nobody has executed.
        terrain: the ground.
        believed: (N, 7) where the robot thinks its trunk is, as in ``qpos``; None if it knows.
        hand: (N, 3) where the hand is; None for a robot without an arm.
        model: MJCF of the robot.
        size: of the robot, the Go1's being 1: so much further away stands the camera.
        balance: zero-moment point and push of a robot that is pushed, or None.
    """

    start: float
    qpos: np.ndarray
    end_effector: np.ndarray
    modes: np.ndarray
    contact: np.ndarray
    force: np.ndarray
    planned_com: np.ndarray
    measured_com: np.ndarray | None
    terrain: Terrain
    believed: np.ndarray | None = None
    hand: np.ndarray | None = None
    model: Path = go1.ASSETS / "go1.xml"
    size: float = 1.0
    balance: Balance | None = None


def motion_of_run(run: "Run") -> Motion:
    """Sample a run: poses at each frame, forces as their mean over the frame.

    A single sample of a contact force at 500 Hz is mostly the contact's own noise.
    """
    times = np.arange(run.t[0], run.t[-1] + 1e-9, 1.0 / FPS)
    at = np.clip(np.searchsorted(run.t, times - 1e-9), 0, len(run.t) - 1)
    edges = np.clip(np.searchsorted(run.t, times[:, None] + np.array([-0.5, 0.5]) / FPS), 0, len(run.t))
    total = np.concatenate([np.zeros((1, len(LEGS), 3)), np.cumsum(run.contact_force, axis=0)])
    first, last = edges.T
    force = (total[last] - total[first]) / (last - first)[:, None, None]
    knows = np.array_equal(run.base_estimate, run.qpos[:, :7])
    return Motion(
        start=float(times[0]),
        qpos=run.qpos[at],
        end_effector=run.end_effector[at],
        modes=np.where(run.stance, run.end_effector, SWINGING)[at],
        contact=run.p[at],
        force=force,
        planned_com=run.com_ref[at],
        measured_com=run.com[at],
        terrain=run.terrain,
        believed=None if knows else run.base_estimate[at],
    )


def motion_of_standing(standing: Standing) -> Motion:
    """Sample a robot that only stands, as a run; it has no plan."""
    times = np.arange(standing.t[0], standing.t[-1] + 1e-9, 1.0 / FPS)
    at = np.clip(np.searchsorted(standing.t, times - 1e-9), 0, len(standing.t) - 1)
    com = standing.com[at]
    return Motion(
        start=float(times[0]),
        qpos=standing.qpos[at],
        end_effector=standing.end_effector[at],
        modes=standing.end_effector[at],
        contact=standing.p[at],
        force=standing.contact_force[at],
        planned_com=com,
        measured_com=com,
        terrain=standing.terrain,
    )


def motion_of_driving(driving: Driving) -> Motion:
    """Sample the robot of part II as it drives; what was planned is the way of the undisturbed base.

    Wheels that a controller lifts (:class:`wfbook.omni.simulate.OmniRun`) leave no prints.
    """
    times = np.arange(driving.t[0], driving.t[-1] + 1e-9, 1.0 / FPS)
    at = np.clip(np.searchsorted(driving.t, times - 1e-9), 0, len(driving.t) - 1)
    com = driving.com[at]
    wheel = np.ones((len(at), len(LEGS)), int)
    stance = getattr(driving, "stance", None)
    return Motion(
        start=float(times[0]),
        qpos=driving.qpos[at],
        end_effector=wheel,
        modes=wheel if stance is None else np.where(stance[at], wheel, SWINGING),
        contact=driving.p[at],
        force=driving.contact_force[at],
        planned_com=np.column_stack([driving.pose[at, :2], com[:, 2]]),
        measured_com=com,
        terrain=driving.terrain,
        hand=driving.hand[at],
        model=omni.ASSETS / "omni.xml",
        size=1.8,
    )


def motion_of_tipping(tipping: Tipping) -> Motion:
    """Sample the robot of part II that is pushed over."""
    times = np.arange(tipping.t[0], tipping.t[-1] + 1e-9, 1.0 / FPS)
    at = np.clip(np.searchsorted(tipping.t, times - 1e-9), 0, len(tipping.t) - 1)
    com, wheel = tipping.com[at], np.ones((len(at), len(LEGS)), int)
    return Motion(
        start=float(times[0]),
        qpos=tipping.qpos[at],
        end_effector=wheel,
        modes=np.where(tipping.lifted[at], SWINGING, wheel),
        contact=tipping.contact[at],
        force=tipping.contact_force[at],
        planned_com=com,
        measured_com=com,
        terrain=tipping.terrain,
        model=omni.ASSETS / "omni.xml",
        size=1.8,
        balance=balance_of(tipping, at),
    )


def motion_of_planned(planned: "Planned") -> Motion:
    """Pose the robot of part II as an optimal control problem's solution has it, between nodes in proportion.

    Forces are those of the node before; a wheel swings from the node on in which it no longer stands.
    """
    times = np.arange(planned.t[0], planned.t[-1] + 1e-9, 1.0 / FPS)

    def between(values: np.ndarray) -> np.ndarray:
        flat = values.reshape(len(values), -1)
        columns = [np.interp(times, planned.t, column) for column in flat.T]
        return np.stack(columns, axis=1).reshape(len(times), *values.shape[1:])

    at = np.clip(np.searchsorted(planned.t, times + 1e-9, side="right") - 1, 0, len(planned.t) - 1)
    qpos, wheel = between(planned.qpos), np.ones((len(times), len(LEGS)), int)
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    return Motion(
        start=float(times[0]),
        qpos=qpos,
        end_effector=wheel,
        modes=np.where(planned.stance[at], wheel, SWINGING),
        contact=between(planned.p),
        force=planned.contact_force[at],
        planned_com=between(planned.com),
        measured_com=None,
        terrain=planned.terrain,
        hand=between(planned.hand),
        model=omni.ASSETS / "omni.xml",
        size=1.8,
    )


def motion_of_plan(plan: "Plan", leans: str = "hips") -> Motion:
    """Pose the robot as a plan wants it, whether or not any controller could do it.

    Between knots the motion is interpolated so that a foot which stands stays where it is. The trunk leans
    with the ground as the controller lets it.

    Args:
        plan: what is wanted.
        leans: by what the trunk leans, one of :data:`wfbook.lean.BY`.

    Raises:
        ValueError: the plan puts a leg where the Go1's can't reach.
    """
    from wfbook.go1_dynamics import Go1Dynamics
    from wfbook.lean import Lean

    times = np.arange(plan.t[0], plan.t[-1] + 1e-9, 1.0 / FPS)
    com, theta, contact = (
        PchipInterpolator(plan.t, values)(times) for values in (plan.x, plan.theta, plan.p)
    )
    slot = np.clip(((times - plan.t[0] + 1e-9) / plan.slot_duration).astype(int), 0, plan.slots - 1)
    knot = np.clip(np.searchsorted(plan.t, times + 1e-9, side="right") - 1, 0, plan.knots - 1)
    wheel = plan.end_effector.T[slot]
    phase = (times - plan.t[0]) / plan.slot_duration - slot
    centres = contact + RADII[wheel][..., None] * _normals(plan, slot, phase)
    robot, lean = Go1Dynamics(), Lean(plan, leans)
    qpos = []
    for frame, time in enumerate(times - plan.t[0]):
        qpos.append(robot.posture(com[frame], theta[frame] + lean.at(time)[0], centres[frame]))
    qpos = np.array(qpos)
    forward = np.diff(contact[:, :, [0, 2]], axis=0)
    rolled = np.vstack([np.zeros(len(LEGS)), np.sign(forward[..., 0]) * np.linalg.norm(forward, axis=2)])
    rolled *= wheel == 1
    qpos[:, 10::4] = np.cumsum(rolled, axis=0) / WHEEL_RADIUS
    return Motion(
        start=float(times[0]),
        qpos=qpos,
        end_effector=wheel,
        modes=plan_modes(plan.S, plan.end_effector).T[slot],
        contact=contact,
        force=(plan.lam + plan.f)[knot],
        planned_com=com,
        measured_com=None,
        terrain=plan.terrain,
    )


def _normals(plan: "Plan", slot: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """Return the ground's normal under each leg, (N, 4, 3); in the air it turns from lift-off to landing."""
    ground = np.array([region.normal for region in plan.terrain.regions])
    regions = np.array(plan.meta.get("regions", plan.D.sum(axis=3).argmax(axis=2)))
    first = [plan.terrain.region_at(x, y) for x, y in plan.p[0, :, :2]]
    start = [own if under is None else under for own, under in zip(regions[:, 0], first, strict=True)]
    normals = ground[np.column_stack([start, regions])]
    blend = normals[:, slot] + phase[:, None] * (normals[:, slot + 1] - normals[:, slot])
    blend /= np.linalg.norm(blend, axis=2, keepdims=True)
    return np.swapaxes(blend, 0, 1)
