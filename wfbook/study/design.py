"""Which cases a study has: sweeps of one factor and grids of two, for every plan and every seed."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from wfbook.study.axes import AXES, ONLY_PUSHED, Levels
from wfbook.study.case import Case, versions

STANDARD_SWEEPS = (
    *("push", "delay", "joint_friction", "ground_friction", "trunk_mass", "sensor_noise", "terrain_error"),
)
STANDARD_GRIDS = (("push", "delay"), ("trunk_mass", "ground_friction"))
"""What a study does that is not told; ``sensor_noise`` only if the state is estimated."""


@dataclass(frozen=True)
class Study:
    """What is asked.

    Attributes:
        plans: content of the plan files, by name.
        sweeps: an axis and its levels each.
        grids: two axes and their levels each.
        base: values of axes in all cases, instead of the usual ones.
        seeds: number of seeds, from 0.
        state: what the controller sees, "estimated" or "true".
        wheel_model: of the estimator.
    """

    plans: dict[str, bytes]
    sweeps: tuple[Levels, ...] = ()
    grids: tuple[tuple[Levels, Levels], ...] = ()
    base: dict[str, float] = field(default_factory=dict)
    seeds: int = 5
    state: str = "estimated"
    wheel_model: str = "encoder"

    @cached_property
    def digests(self) -> dict[str, str]:
        """Digest of each plan, by its name."""
        return {name: digest(content) for name, content in self.plans.items()}

    def case(self, plan: str, seed: int, **changed: float) -> Case:
        """Return the case of a plan's name and a seed in which some axes are not as in the base.

        Values that have no effect are as usual, so that equal runs are one case.
        """
        values = {name: axis.usual for name, axis in AXES.items()} | self.base | changed
        if not values["push"]:
            values |= {name: AXES[name].usual for name in ONLY_PUSHED}
        return Case(self.digests[plan], seed, self.state, self.wheel_model, values)

    def key(self, plan: str, seed: int, **changed: float) -> str:
        """Return what names the result of :meth:`case`."""
        return self.case(plan, seed, **changed).key(versions())

    def points(self) -> Iterator[tuple[str, dict[str, float]]]:
        """Yield the name of a sweep or grid, and the values that it asks for, one after the other."""
        for sweep in self.sweeps:
            for values in points((sweep,)):
                yield name_of(sweep), values
        for grid in self.grids:
            for values in points(grid):
                yield name_of(*grid), values

    @cached_property
    def cases(self) -> dict[str, tuple[str, Case, list[str]]]:
        """The study's cases by their keys: name of the plan, the case, and the sweeps and grids it is in.

        Seeds come one after the other, so that a study that is stopped has seen all levels equally often.
        """
        found: dict[str, tuple[str, Case, list[str]]] = {}
        for seed in range(self.seeds):
            for plan in self.plans:
                for experiment, values in self.points():
                    case = self.case(plan, seed, **values)
                    _, _, experiments = found.setdefault(case.key(versions()), (plan, case, []))
                    if experiment not in experiments:
                        experiments.append(experiment)
        return found

    def description(self) -> dict[str, Any]:
        """Return what is asked in JSON's types."""

        def told(levels: Levels) -> dict[str, Any]:
            axis, values = levels
            return {"axis": axis.name, "unit": axis.unit, "column": axis.column, "levels": list(values)}

        return {
            "plans": self.digests,
            "sweeps": [told(sweep) for sweep in self.sweeps],
            "grids": [[told(levels) for levels in grid] for grid in self.grids],
            "base": {name: axis.usual for name, axis in AXES.items()} | self.base,
            "seeds": self.seeds,
            "state": self.state,
            "wheel_model": self.wheel_model if self.state == "estimated" else None,
            "versions": versions(),
        }


def name_of(*factors: Levels) -> str:
    """Return the name of a sweep or a grid."""
    return " x ".join(axis.name for axis, _ in factors)


def points(factors: tuple[Levels, ...]) -> Iterator[dict[str, float]]:
    """Yield every combination of the factors' levels; the last changes first."""
    if not factors:
        yield {}
        return
    (axis, values), *rest = factors
    for value in values:
        for others in points(tuple(rest)):
            yield {axis.name: value, **others}


def digest(content: bytes) -> str:
    """Return a digest of a plan file's content."""
    return hashlib.sha256(content).hexdigest()[:16]
