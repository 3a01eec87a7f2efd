"""Chapter 12: a run's figures of merit: how still the hand was, how well the robot drove, what it cost.

The hand's roll, pitch and yaw are Paper B's: (-1.57, 0, -1.57) where it should be. They are those in axes
that turn with the hand's target: with the commanded base if the hand goes along, and not at all if it is to
keep its direction in the world.
"""

from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import pinocchio as pin

from wfbook.go1_dynamics import GRAVITY
from wfbook.modes import LEGS
from wfbook.omni.machine import Mode
from wfbook.omni.robot import Omni
from wfbook.terrain import flat

if TYPE_CHECKING:
    from wfbook.omni.runs import OmniRun

ANGLES = ("roll", "pitch", "yaw")

_TOUCH = 5.0
"""Force of a wheel that touches, N."""
_AWAY = 10
"""Samples without a touch that make a swing."""
_STRIDE = 10
"""Samples between points of the way."""
_STAYS = 0.2
"""A trunk that is never further from where it began, m, has gone nowhere."""


def hand_rpy(run: "OmniRun") -> np.ndarray:
    """Return the hand's roll, pitch and yaw, ``(N, 3)``, as if its target had not turned since the start."""
    first = pin.rpy.rpyToMatrix(hand_rpy_ref(run))
    pairs = zip(run.hand_rotation_ref, run.hand_rotation, strict=True)
    return np.unwrap([pin.rpy.matrixToRpy(first @ wanted.T @ turned) for wanted, turned in pairs], axis=0)


def hand_rpy_ref(run: "OmniRun") -> np.ndarray:
    """Return the roll, pitch and yaw, ``(3,)``, that the hand should have had at the start."""
    return pin.rpy.matrixToRpy(pin.utils.rotate("z", -run.pose[0, 2]) @ run.hand_rotation_ref[0])


def hand_of(run: "OmniRun") -> dict[str, Any]:
    """Return how still the hand was.

    ``hand_height_*`` are of the hand above the level ground at the start, in metres, its error that from the
    target; ``hand_level_max_error_m`` is the largest horizontal distance from where it should be;
    ``hand_turn_max_rad`` the largest angle from how it should be turned. ``hand_roll_*``, ``hand_pitch_*``
    and ``hand_yaw_*`` are mean, standard deviation and largest error of each.
    """
    height, error, rpy = run.hand[:, 2], run.hand - run.hand_ref, hand_rpy(run)
    pairs = zip(run.hand_rotation_ref, run.hand_rotation, strict=True)
    turns = [np.linalg.norm(pin.log3(wanted.T @ turned)) for wanted, turned in pairs]
    return {
        "hand_height_mean_m": float(height.mean()),
        "hand_height_std_m": float(height.std()),
        "hand_height_max_error_m": float(np.abs(error[:, 2]).max()),
        "hand_level_max_error_m": float(np.linalg.norm(error[:, :2], axis=1).max()),
        "hand_turn_max_rad": float(max(turns)),
    } | {
        f"hand_{name}_{what}_rad": float(value)
        for what, values in (
            ("mean", rpy.mean(axis=0)),
            ("std", rpy.std(axis=0)),
            ("max_error", np.abs(rpy - hand_rpy_ref(run)).max(axis=0)),
        )
        for name, value in zip(ANGLES, values, strict=True)
    }


def driving_of(run: "OmniRun", mass: float) -> dict[str, Any]:
    """Return how the robot drove, and at what cost.

    ``way_m`` is the length of the trunk's way seen from above, ``distance_m`` from its first point to its
    last, and ``planned_distance_m`` that of the commanded base; ``swings`` is how often the controller
    lifted a wheel. ``base_rms_*`` are root mean squares of the trunk's distance from the commanded base, seen
    from above, and of the angle between them, while the robot is on its wheels: on legs the base waits.
    ``slip_max_m`` is how far a wheel slid along its axle while it touched the ground. Cost of transport is
    the motors' work over ``m g way``, with all work counted (``cot_abs``) and only with what they put in
    (``cot_positive``); None if the robot goes nowhere.

    Args:
        run: to measure.
        mass: of the robot.
    """
    place = run.qpos[:, :2]
    points = np.vstack([place[::_STRIDE], place[-1]])
    way = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    gone = np.linalg.norm(place - place[0], axis=1).max()
    power = run.tau * run.qvel[:, 6:]
    work = [float(np.trapezoid(p.sum(axis=1), run.t)) for p in (np.abs(power), np.maximum(power, 0.0))]
    costs = [float(w / (mass * -GRAVITY[2] * way)) if gone > _STAYS else None for w in work]
    rolling = run.mode == Mode.WHEELED
    off = np.linalg.norm(place - run.pose[:, :2], axis=1)[rolling]
    duration, distance = float(run.t[-1]), float(np.linalg.norm(place[-1] - place[0]))
    return {
        "planned_distance_m": float(np.linalg.norm(run.pose[-1, :2] - run.pose[0, :2])),
        "distance_m": distance,
        "way_m": way,
        "duration_s": duration,
        "speed_m_s": way / duration,
        "cot_abs": costs[0],
        "cot_positive": costs[1],
        "base_rms_m": float(np.sqrt(np.mean(off**2))),
        "base_rms_rad": float(np.sqrt(np.mean(_tilts(run)[rolling] ** 2))),
        "swings": int(np.sum(np.diff(run.stance.astype(int), axis=0) < 0)),
        "slip_max_m": float(np.abs(slips(run)).max()),
    }


def slips(run: "OmniRun") -> np.ndarray:
    """Return how far each wheel has slid along its axle since it landed, ``(N, 4)``.

    A wheel that is steered a little wrong slides all along its way, though it stays in its track.
    """
    robot = Omni(flat())  # whatever it stands on; MuJoCo would move hundreds of strips of ground along
    axles = np.empty_like(run.p)
    for axle, qpos in zip(axles, run.qpos, strict=True):
        robot.data.qpos[:] = qpos
        mujoco.mj_kinematics(robot.model, robot.data)
        axle[:] = robot.axles
    steps = np.diff(run.p, axis=0, prepend=run.p[:1])
    sideways = (steps * axles).sum(axis=2)
    touches, up = _touches(run), lifted(run)
    slid = np.zeros(sideways.shape)
    for k in range(1, len(slid)):
        slid[k] = ~up[k] * (slid[k - 1] + touches[k] * sideways[k])
    return slid


def lifted(run: "OmniRun") -> np.ndarray:
    """Return which wheels are in the air, ``(N, 4)`` bool; less than a tenth of a second does not count."""
    touches, up = _touches(run), np.zeros((len(run.t), len(LEGS)), bool)
    for wheel, touching in enumerate(touches.T):
        edges = np.flatnonzero(np.diff(touching, prepend=True, append=True))
        for begin, end in edges.reshape(-1, 2):
            up[begin:end, wheel] = end - begin >= _AWAY
    return up


def _touches(run: "OmniRun") -> np.ndarray:
    return np.linalg.norm(run.contact_force, axis=2) > _TOUCH


def _tilts(run: "OmniRun") -> np.ndarray:
    """Return the angle between the trunk and the commanded base, ``(N,)``."""
    return np.array(
        [
            np.linalg.norm(pin.log3(pin.utils.rotate("z", -yaw) @ pin.Quaternion(*q).toRotationMatrix()))
            for q, yaw in zip(run.qpos[:, 3:7], run.pose[:, 2], strict=True)
        ]
    )
