"""One simulation of a study: what is asked, and the row that it gives. This is what workers run."""

import functools
import hashlib
import json
import os
import platform
import tempfile
import time
import traceback
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import wfbook
from wfbook.report import plain
from wfbook.study.axes import AXES

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan

TIMES = ("wall_time_s", "worker", "estimator_ms_median", "tick_ms_median", "tick_ms_p99", "real_time_factor")
"""Columns that differ when a case is run again; all others are the same on the same machine."""

_PACKAGES = ("daqp", "mujoco", "numpy", "osqp", "pin", "scipy")
_NOT_SIMULATION = ("__main__", "arguments", "quoted", "report", "results")
_OF_STUDY = ("axes", "case", "ground")


@dataclass(frozen=True)
class Case:
    """A simulation that is asked for.

    Attributes:
        plan: digest of the plan file's content.
        seed: of everything random.
        state: what the controller sees, "estimated" or "true".
        wheel_model: of the estimator.
        values: of each axis, by name, in the units of :data:`wfbook.study.axes.AXES`; None is drawn.
    """

    plan: str
    seed: int
    state: str
    wheel_model: str
    values: dict[str, float | None]

    def row(self, **drawn: float) -> dict[str, Any]:
        """Return the case as columns of a row.

        Args:
            drawn: values of axes that were drawn.
        """
        values = self.values | drawn
        row = {"plan_digest": self.plan, "seed": self.seed, "state": self.state}
        row |= {"wheel_model": self.wheel_model if self.state == "estimated" else None}
        return row | {axis.column: values[name] for name, axis in AXES.items()} | {"versions": versions()}

    def key(self, versions: dict[str, str]) -> str:
        """Return what names the run's result: a digest of the case and of what it is run with."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        text = json.dumps([fields, versions], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:20]


def execute(case: Case, plan_file: bytes) -> dict[str, Any]:
    """Run a case.

    Args:
        case: to run.
        plan_file: the content of the plan file.

    Returns:
        A row: the case's parameters, with what was drawn, under the columns of the axes; the metrics of
        :func:`wfbook.runs.metrics_of`; versions, and what it took. If the run raised an exception, ``error``
        is its line, ``traceback`` all of it, and there are no metrics.
    """
    began = time.perf_counter()
    drawn: dict[str, float] = {}
    try:
        from wfbook import simulate

        plan = _plan(plan_file)
        rng = np.random.default_rng([case.seed, 46])
        drawn = _drawn(case, float(plan.t[-1] - plan.t[0]), rng)
        told = _arguments(plan, case.values | drawn, rng)
        run = simulate.run(plan, seed=case.seed, state=case.state, wheel_model=case.wheel_model, **told)
        outcome = {"error": None, "traceback": None, **plain(run.metrics)}
    except Exception as error:
        line = "".join(traceback.format_exception_only(error)).strip().splitlines()[-1]
        outcome = {"error": line, "traceback": traceback.format_exc()}
    cost = {"wall_time_s": time.perf_counter() - began, "worker": f"{platform.node()}:{os.getpid()}"}
    return case.row(**drawn) | cost | outcome


def _drawn(case: Case, duration: float, rng: np.random.Generator) -> dict[str, float]:
    """Draw what the case leaves open of its push, if there is one.

    All is drawn in any case, so that runs of one seed differ in nothing but what is asked.
    """
    values = {"push_angle": rng.uniform(0.0, 360.0), "push_start": rng.uniform(0.0, duration)}
    return {name: v for name, v in values.items() if case.values["push"] and case.values[name] is None}


def _arguments(plan: "Plan", values: dict[str, float | None], rng: np.random.Generator) -> dict[str, Any]:
    """Return what :func:`wfbook.simulate.run` is told of the disturbances."""
    from wfbook.sensors import SensorNoise
    from wfbook.study.ground import real_terrain

    push = None
    if values["push"]:
        angle = np.radians(values["push_angle"])
        force = values["push"] * np.array([np.cos(angle), np.sin(angle), 0.0])
        push = (force, values["push_start"], values["push_duration"])
    return {
        "push": push,
        "delay": values["delay"] / 1000.0,
        "joint_friction": values["joint_friction"],
        "trunk_mass_scale": values["trunk_mass"],
        "noise": SensorNoise().scaled(values["sensor_noise"]),
        "real_terrain": real_terrain(plan, values["ground_friction"], 1e-3 * values["terrain_error"], rng),
    }


@functools.lru_cache(maxsize=8)
def _plan(content: bytes) -> "Plan":
    from wfbook.planner.plan import Plan

    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        file.write(content)
        file.flush()
        return Plan.load(file.name)


@functools.cache
def versions() -> dict[str, str]:
    """Return what a result depends on besides its case: versions, and a digest of the simulation's code."""
    root = Path(wfbook.__file__).parent
    files = [path for path in sorted(root.glob("*.py")) if path.stem not in _NOT_SIMULATION]
    files += [root / "study" / f"{name}.py" for name in _OF_STUDY]
    files += [path for path in sorted((root.parent / "assets" / "go1").iterdir()) if path.suffix != ".npz"]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in files if path.is_file()))
    found = {name: metadata.version(name) for name in _PACKAGES}
    return {"wfbook": wfbook.__version__, "code": digest.hexdigest()[:12]} | found
