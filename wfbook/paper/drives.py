"""What is kept of a run of part II, and how what is measured of several seeds becomes records."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wfbook import archive
from wfbook.paper.record import Record, compared
from wfbook.quoted import value
from wfbook.report import plain

if TYPE_CHECKING:
    from wfbook.omni.simulate import OmniRun

_EVERY = 2  # samples of a run between two that are kept: 50 Hz
_FORMAT = 1

HEIGHT = value("omni.height")
SHIFT = value("omni.pitch_shift")
"""The paper's target, and what it adds to the pitch."""


@dataclass(frozen=True)
class Drive:
    """What is kept of a run: every second sample, ``N`` of them, and all figures of merit.

    Attributes:
        t: ``(N,)`` time.
        hand: ``(N, 3)`` position.
        hand_ref: ``(N, 3)`` where it was to be.
        rpy: ``(N, 3)`` the hand's roll, pitch, yaw in axes that turn with its target.
        base_rpy: ``(N, 3)`` likewise in the trunk's axes.
        base_rpy_ref: ``(N, 3)`` as they were to be over the commanded base.
        trunk: ``(N, 3)`` position.
        yaw: ``(N,)`` of the trunk.
        legs: ``(N, 8)`` hip and knee of each leg.
        legs_ref: ``(N, 8)`` what their motors were told to hold.
        wheels: ``(N, 4)`` how far each wheel's contact is ahead of where it was.
        arm_margin: ``(N,)`` from the arm's angles to the nearest limit of any.
        metrics: of the run.
        meta: seed, controller and other conditions.
    """

    ARRAYS: ClassVar[tuple[str, ...]] = (
        *("t", "hand", "hand_ref", "rpy", "base_rpy", "base_rpy_ref", "trunk", "yaw", "legs", "legs_ref"),
        *("wheels", "arm_margin"),
    )

    t: np.ndarray
    hand: np.ndarray
    hand_ref: np.ndarray
    rpy: np.ndarray
    base_rpy: np.ndarray
    base_rpy_ref: np.ndarray
    trunk: np.ndarray
    yaw: np.ndarray
    legs: np.ndarray
    legs_ref: np.ndarray
    wheels: np.ndarray
    arm_margin: np.ndarray
    metrics: dict[str, Any]
    meta: dict[str, Any]

    @classmethod
    def of(cls, run: "OmniRun") -> "Drive":
        """Return what is kept of a run."""
        import pinocchio as pin

        from wfbook.omni.merits import hand_rpy
        from wfbook.omni.robot import ARM_V, LEGS_V, locked_model

        trunks = [pin.Quaternion(*q) for q in run.qpos[:, 3:7]]
        bases = [pin.utils.rotate("z", yaw) for yaw in run.pose[:, 2]]
        model, arm = locked_model(), run.qpos[:, 1 + ARM_V]
        low, high = model.lowerPositionLimit[15:], model.upperPositionLimit[15:]
        arrays = {
            "t": run.t,
            "hand": run.hand,
            "hand_ref": run.hand_ref,
            "rpy": hand_rpy(run),
            "base_rpy": _rpy([q.toRotationMatrix() for q in trunks], run.hand_rotation),
            "base_rpy_ref": _rpy(bases, run.hand_rotation_ref),
            "trunk": run.qpos[:, :3],
            "yaw": run.yaw,
            "legs": run.qpos[:, 1 + LEGS_V],
            "legs_ref": run.angles[:, LEGS_V - 6],
            "wheels": (run.p - run.p[0])[:, :, 0],
            "arm_margin": np.minimum(arm - low, high - arm).min(axis=1),
        }
        kept = {name: array[::_EVERY] for name, array in arrays.items()}
        return cls(**kept, metrics=plain(run.metrics), meta=plain(run.meta))

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        texts = {"metrics": self.metrics, "meta": self.meta}
        archive.save(path, {name: getattr(self, name) for name in self.ARRAYS}, texts, _FORMAT)

    @classmethod
    def load(cls, path: Path) -> "Drive":
        """Read the file."""
        return cls(**archive.load(path, "drive", cls.ARRAYS, ("metrics", "meta"), _FORMAT))


def _rpy(axes: Sequence[np.ndarray], rotations: np.ndarray) -> np.ndarray:
    """Return roll, pitch and yaw ``(N, 3)`` of rotations, each in its own axes, without jumps."""
    import pinocchio as pin

    pairs = zip(axes, rotations, strict=True)
    return np.unwrap([pin.rpy.matrixToRpy(R.T @ rotation) for R, rotation in pairs], axis=0)


def proof(runs: Sequence[Drive]) -> str:
    """Return what a value over runs rests on."""
    seeds = ", ".join(str(run.meta["seed"]) for run in runs)
    noise = "measured with noise" if runs[0].meta["noise"] else "true state"
    ended = sum(not run.metrics["finished"] for run in runs)
    head = f"{runs[0].meta['controller']}, {'seed' if len(runs) == 1 else 'seeds'} {seeds}, {noise}"
    return head + (f"; {ended} ended early" if ended else "")


def over(runs: Sequence[Drive], measure: Callable[[Drive], float]) -> tuple[float, list[float]]:
    """Return the median over runs of what is measured of each, and all of them."""
    values = [float(measure(run)) for run in runs]
    return float(np.median(values)), values


def height_records(keys: dict[str, str], runs: Sequence[Drive]) -> list[Record]:
    """Return mean, deviation and largest error of the hand's height beside the paper's.

    Args:
        keys: the paper's, by the end of our metrics' names.
        runs: over the seeds.
    """
    records = []
    for metric, key in keys.items():
        middle, values = over(runs, lambda run, name=metric: run.metrics[f"hand_height_{name}"])
        records.append(compared(key, middle, proof(runs), values))
    return records


def hand_records(key: str, runs: Sequence[Drive]) -> list[Record]:
    """Return all of a simulation's figures of the hand beside the paper's; pitch has the paper's shift."""
    records = height_records(
        {"mean_m": f"{key}.mean", "std_m": f"{key}.std", "max_error_m": f"{key}.max"}, runs
    )
    for name in ("roll", "pitch", "yaw"):
        for part, end in (("mean", ""), ("std", "_std")):
            shift = SHIFT if (name, part) == ("pitch", "mean") else 0.0
            metric = f"hand_{name}_{part}_rad"
            middle, values = over(runs, lambda run, m=metric, shift=shift: run.metrics[m] + shift)
            records.append(compared(f"{key}.{name}{end}", middle, proof(runs), values))
    return records
