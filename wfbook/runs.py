"""What a simulation leaves behind: the log of a run, its file, and its figures of merit."""

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from scipy.spatial.transform import Rotation

from wfbook import archive
from wfbook.centroidal import Robot, RollOut, roll_out
from wfbook.flights import Swing
from wfbook.go1 import momenta
from wfbook.go1_dynamics import GRAVITY
from wfbook.modes import END_EFFECTORS, LEGS
from wfbook.terrain import Terrain

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan

FORMAT = 4
"""Version of the run file; a file of another version is refused."""

TIMINGS = ("solve_time_s", "estimator_ms_median", "tick_ms_median", "tick_ms_p99", "real_time_factor")
TIMINGS += ("replanning",)
"""Metrics that differ from run to run of one seed; they are not in the run file, which does not."""


@dataclass(frozen=True)
class Run:
    """A simulated run, logged at the controller's rate, ``N`` samples.

    World frame; ``t`` is 0 when the plan begins and negative while the robot settles. Legs are in the order
    of :data:`wfbook.modes.LEGS`.

    Attributes:
        t: ``(N,)`` time.
        qpos: ``(N, 23)`` MuJoCo's configuration.
        qvel: ``(N, 22)`` MuJoCo's velocity.
        tau: ``(N, 12)`` torques that acted.
        tau_command: ``(N, 12)`` torques that were computed, to act one delay later.
        com: ``(N, 3)`` centre of mass.
        com_velocity: ``(N, 3)``.
        rpy: ``(N, 3)`` roll, pitch, yaw of the trunk.
        p: ``(N, 4, 3)`` lowest point of each end effector.
        contact_force: ``(N, 4, 3)`` on the robot.
        in_contact: ``(N, 4)`` bool, whether a leg touches the ground.
        end_effector: ``(N, 4)`` int8, 0 foot and 1 wheel.
        stance: ``(N, 4)`` bool, whether a leg was commanded to carry load.
        rpy_ref: ``(N, 3)`` roll, pitch, yaw it was to have.
        com_ref: ``(N, 3)`` planned centre of mass.
        com_velocity_ref: ``(N, 3)``.
        p_ref: ``(N, 4, 3)`` where the lowest points were to be.
        base_estimate: ``(N, 7)`` estimate of ``qpos[:, :7]``; the truth if the controller saw it.
        base_velocity_estimate: ``(N, 6)`` estimate of ``qvel[:, :6]``.
        com_estimate: ``(N, 3)`` estimate of ``com``.
        solved: ``(N,)`` bool, whether the controller's program was solved. If not, the robot holds its last
            torques for a while, and then sits down.
        metrics: figures of merit, see :func:`metrics_of`.
        meta: how it was run.
        terrain: on what.
        joint_names: of ``qpos[:, 7:]``.
        times: computing times in milliseconds, ``(N,)`` each: ``tick`` of the controller, ``estimator``.
            Not in the run file, so that two runs of one seed give the same file; empty when read from one.
    """

    LOGGED: ClassVar[tuple[str, ...]] = (
        *("t", "qpos", "qvel", "tau", "tau_command", "com", "com_velocity", "rpy", "p", "contact_force"),
        *(
            "in_contact",
            "end_effector",
            "stance",
            "rpy_ref",
            "com_ref",
            "com_velocity_ref",
            "p_ref",
            "solved",
        ),
        *("base_estimate", "base_velocity_estimate", "com_estimate"),
    )

    t: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    tau: np.ndarray
    tau_command: np.ndarray
    com: np.ndarray
    com_velocity: np.ndarray
    rpy: np.ndarray
    p: np.ndarray
    contact_force: np.ndarray
    in_contact: np.ndarray
    end_effector: np.ndarray
    stance: np.ndarray
    rpy_ref: np.ndarray
    com_ref: np.ndarray
    com_velocity_ref: np.ndarray
    p_ref: np.ndarray
    solved: np.ndarray
    base_estimate: np.ndarray
    base_velocity_estimate: np.ndarray
    com_estimate: np.ndarray
    metrics: dict[str, Any]
    meta: dict[str, Any]
    terrain: Terrain
    joint_names: list[str]
    times: dict[str, np.ndarray] = field(default_factory=dict)

    def save(self, path: str | os.PathLike) -> None:
        """Write the run file (``numpy.savez``), whole or not at all.

        Raises:
            OSError: the file can't be written.
        """
        arrays = {name: getattr(self, name) for name in self.LOGGED}
        metrics = {name: value for name, value in self.metrics.items() if name not in TIMINGS}
        texts = {"metrics": metrics, "meta": self.meta, "joint_names": self.joint_names}
        archive.save(path, arrays, texts | {"terrain": self.terrain.to_dict()}, FORMAT)

    @classmethod
    def load(cls, path: str | os.PathLike) -> Self:
        """Read a run file.

        Raises:
            ValueError: the file is no run, is truncated, or is of another version; the message names it.
            OSError: the file can't be read.
        """
        data = archive.load(path, "run", cls.LOGGED, ("metrics", "meta", "joint_names", "terrain"), FORMAT)
        data["metrics"] = dict.fromkeys(TIMINGS) | data["metrics"]
        data["terrain"] = Terrain.from_dict(data["terrain"], source=f"{path}: terrain")
        return cls(**data)


@dataclass(frozen=True)
class Momentum:
    """What a run's contact forces should have done to the robot, and what they did.

    Attributes:
        t: ``(N,)`` time, from the plan's start on.
        predicted: eqs 1 and 8 with the measured forces, contacts and path, from the first sample on.
        velocity: ``(N, 3)`` of the centre of mass, as MuJoCo has it.
        angular: ``(N, 3)`` angular momentum of all bodies about the centre of mass, as MuJoCo has it.
        trunk: ``(N, 3)`` what a rigid robot with the trunk's rate would have: the left side of eq. 8.
    """

    t: np.ndarray
    predicted: RollOut
    velocity: np.ndarray
    angular: np.ndarray
    trunk: np.ndarray


def momentum_of(run: Run) -> Momentum:
    """Check Newton's and Euler's laws on a run (Paper A, eqs 1 and 8).

    A run keeps the force of every second millisecond of the simulation; between two samples, their mean acts.
    """
    robot, going = Robot.go1(), run.t >= 0.0
    t, qpos, qvel = run.t[going], run.qpos[going], run.qvel[going]
    linear, angular = momenta(qpos, qvel)
    velocity = linear / robot.mass
    force = run.contact_force[going]
    force = 0.5 * (force[:-1] + force[1:])
    dt = float(t[-1] - t[0]) / (len(t) - 1)
    predicted = roll_out(robot.mass, dt, run.p[going], force, run.com[going], velocity[0], angular[0])
    trunk = Rotation.from_quat(qpos[:, [4, 5, 6, 3]])
    return Momentum(t, predicted, velocity, angular, trunk.apply(qvel[:, 3:6] @ robot.inertia.T))


def metrics_of(
    log: dict[str, np.ndarray],
    plan: "Plan",
    flights: list[list[Swing]],
    mass: float,
    work: np.ndarray,
    slip: float,
    astray: float,
    fall_time: float | None,
    rescues: int,
    times: dict[str, Any],
    meta: dict[str, Any],
) -> dict[str, Any]:
    """Return the figures of merit of a run, all of them JSON values.

    Cost of transport is work over ``m g d`` from rest to rest, once with all work counted as cost
    (``cot_abs``) and once with only the work the motors put in (``cot_positive``). ``base_rms_m`` and
    ``base_rms_rad`` are root mean squares of the error's length from the plan's start on. ``slip_max_m`` is
    how far a standing foot, or a wheel sideways, slid; ``region_violation_max_m`` how far a standing foot was
    beside its region, or a wheel beside all of its group. ``lift_off_m`` is the largest clearance of each
    swing.

    Args:
        log: arrays of :class:`Run`.
        plan: that was executed.
        flights: the swings of each leg.
        mass: of the robot.
        work: ``(2,)`` absolute and positive work of the motors.
        slip: the largest slip of a standing leg.
        astray: the largest distance of a standing leg's contact from its regions.
        fall_time: when the robot fell, since the plan's start, or None.
        rescues: programs that OSQP left to DAQP.
        times: of :class:`Run`, and ``wall``, that of the whole simulation in seconds.
        meta: of the run.
    """
    t, going = log["t"], log["t"] >= 0.0
    fell = fall_time is not None
    duration = float(plan.t[-1] - plan.t[0])
    error = (log["com"] - log["com_ref"])[going]
    angles = (log["rpy"] - log["rpy_ref"])[going]
    settled = log["com"][np.searchsorted(t, 0.0)] if going.any() else log["com"][-1]
    distance = float(np.linalg.norm((log["com"][-1] - settled)[:2]))
    weight_distance = mass * -GRAVITY[2] * max(distance, 1e-9)
    rms = float(np.sqrt(np.mean(np.sum(error**2, axis=1)))) if going.any() else None
    tilt = float(np.sqrt(np.mean(np.sum(angles**2, axis=1)))) if going.any() else None
    simulated = float(t[-1] - t[0])
    source = {name: plan.meta.get(name) for name in ("status", "objective", "bound", "gap", "nodes")}
    return {
        "terrain": plan.terrain.name,
        "end_effectors": sorted({END_EFFECTORS[kind] for kind in np.unique(plan.end_effector)}),
        **source,
        "solve_time_s": plan.meta.get("solve_time"),
        "planned_distance_m": plan.distance,
        "plan_duration_s": duration,
        "distance_m": distance,
        "duration_s": float(t[-1]),
        "speed_m_s": distance / duration,
        "final_speed_m_s": float(np.linalg.norm(log["com_velocity"][-1])),
        "swings": sum(len(legs) for legs in flights),
        "lift_off_m": _lift_off(log, plan.terrain, flights),
        "cot_abs": float(work[0] / weight_distance) if distance > 0.01 else None,
        "cot_positive": float(work[1] / weight_distance) if distance > 0.01 else None,
        "base_rms_m": rms,
        "base_rms_rad": tilt,
        "base_rms_xyz_m": np.sqrt(np.mean(error**2, axis=0)).tolist() if going.any() else None,
        "base_rms_rpy_rad": np.sqrt(np.mean(angles**2, axis=0)).tolist() if going.any() else None,
        **_estimation(log, distance, times, meta),
        "slip_max_m": slip,
        "region_violation_max_m": astray,
        "tick_ms_median": float(np.median(times["tick"])),
        "tick_ms_p99": float(np.percentile(times["tick"], 99)),
        "real_time_factor": simulated / times["wall"],
        "qp_failures": int(np.sum(~log["solved"])),
        "qp_rescues": rescues,
        "upright": not fell,
        "fell": fell,
        "fall_time_s": fall_time,
    }


def _estimation(
    log: dict[str, np.ndarray], distance: float, times: dict[str, Any], meta: dict[str, Any]
) -> dict[str, Any]:
    """Return how good the estimate was from the plan's start on; None if there was none.

    The drift is by how much the estimated displacement of the trunk differs from the true one, in per cent
    of the distance travelled.
    """
    names = ("estimate_drift_percent", "estimate_velocity_rms_m_s", "estimator_ms_median")
    going = log["t"] >= 0.0
    if meta["state"] == "true" or not going.any():
        return dict.fromkeys(names)
    error = (log["base_estimate"][:, :3] - log["qpos"][:, :3])[going]
    slow = (log["base_velocity_estimate"][:, :3] - log["qvel"][:, :3])[going]
    drift = 100.0 * float(np.linalg.norm(error[-1] - error[0])) / distance if distance > 0.01 else None
    speed_error = float(np.sqrt(np.mean(np.sum(slow**2, axis=1))))
    return dict(zip(names, (drift, speed_error, float(np.median(times["estimator"]))), strict=True))


def _lift_off(
    log: dict[str, np.ndarray], terrain: Terrain, flights: list[list[Swing]]
) -> dict[str, list[float]]:
    """Return the largest clearance of each leg's each swing."""
    clearances: dict[str, list[float]] = {}
    for index, leg in enumerate(LEGS):
        clearances[leg] = []
        for flight in flights[index]:
            during = (log["t"] >= flight.start) & (log["t"] < flight.end)
            heights = [p[2] - (terrain.height(p[0], p[1]) or 0.0) for p in log["p"][during, index]]
            clearances[leg].append(float(max(heights, default=0.0)))
    return clearances
