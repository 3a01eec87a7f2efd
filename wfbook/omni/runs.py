"""Chapter 12: what a run of part II leaves: its samples, its figures of merit, and the file they are in."""

import os
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from wfbook import archive
from wfbook.omni.driving import Driving
from wfbook.terrain import Terrain

FORMAT = 2
TIMINGS = ("tick_ms_median", "tick_ms_p95", "tick_ms_p99", "plan_ms_p5", "plan_ms_median", "plan_ms_p95")
TIMINGS += ("real_time_factor", "motion_s_max")
"""Metrics that differ from run to run of one seed; they are not in the run file."""


@dataclass(frozen=True)
class OmniRun(Driving):
    """A run; besides what :class:`wfbook.omni.driving.Driving` has, samples ``N`` every 10 ms.

    Attributes:
        tau: ``(N, 23)`` torques that acted.
        angles: ``(N, 23)`` joint angles that the motors were told to hold; those of wheels mean nothing.
        hand_rotation: ``(N, 3, 3)``.
        hand_ref: ``(N, 3)`` where the hand was to be.
        hand_rotation_ref: ``(N, 3, 3)`` how it was to be turned.
        mode: ``(N,)`` of :class:`wfbook.omni.machine.Mode`, the state machine's.
        stance: ``(N, 4)`` bool, which wheels the controller takes to stand.
        events: what went wrong: time and text.
        metrics: figures of merit, see :mod:`.merits`.
        meta: how it was run.
    """

    LOGGED: ClassVar[tuple[str, ...]] = (
        *("t", "qpos", "qvel", "com", "hand", "p", "contact_force", "pose", "twist", "steering"),
        *("tau", "angles", "hand_rotation", "hand_ref", "hand_rotation_ref", "mode", "stance"),
    )

    tau: np.ndarray
    angles: np.ndarray
    hand_rotation: np.ndarray
    hand_ref: np.ndarray
    hand_rotation_ref: np.ndarray
    mode: np.ndarray
    stance: np.ndarray
    events: list[tuple[float, str]] = field(default_factory=list)
    metrics: dict[str, Any] = field(default_factory=dict)
    meta: dict[str, Any] = field(default_factory=dict)

    def save(self, path: str | os.PathLike) -> None:
        """Write the run file, whole or not at all.

        Raises:
            OSError: the file can't be written.
        """
        metrics = {name: value for name, value in self.metrics.items() if name not in TIMINGS}
        texts = {"metrics": metrics, "meta": self.meta, "events": self.events}
        arrays = {name: getattr(self, name) for name in self.LOGGED}
        archive.save(path, arrays, texts | {"terrain": self.terrain.to_dict()}, FORMAT)

    @classmethod
    def load(cls, path: str | os.PathLike) -> Self:
        """Read a run file.

        Raises:
            ValueError: the file is no such run, is truncated, or is of another version.
            OSError: the file can't be read.
        """
        texts = ("metrics", "meta", "events", "terrain")
        data = archive.load(path, "run of part II", cls.LOGGED, texts, FORMAT)
        data["metrics"] = dict.fromkeys(TIMINGS) | data["metrics"]
        data["events"] = [(when, what) for when, what in data["events"]]
        data["terrain"] = Terrain.from_dict(data["terrain"], source=f"{path}: terrain")
        return cls(**data)
