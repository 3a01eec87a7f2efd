"""What every leg stands on, slot by slot: the dynamics matrix as a flow (Paper A, eqs 13, 14, 16, 17, 23–25).

A foot belongs to a region, a wheel to a group of regions, for it may roll from one to the next. Where a
leg stands and on what is a path through a small graph: only a swing changes it. The flow constraints of
that graph have integral corners, which implications in big-M format do not.

While a leg rolls, it is in one region of its group at each knot, and within a slot it passes from the
first to the last in one direction.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.planner.gait import UNKNOWN, Gait
from wfbook.planner.ground import Places
from wfbook.planner.problem import Problem


@dataclass
class Contacts:
    """The discrete variables of a program, relaxed to ``[0, 1]``, and the rows among them.

    Attributes:
        problem: what is asked.
        regions: those that can be reached; the others have no variables.
        groups: by index, the regions of each group that can be reached.
        foot_stance: by region, ``(L, J)``: the leg stands on its foot there.
        foot_landing: by region, ``(L, J)``: the leg swings and will land on its foot there.
        wheel_stance: by group, ``(L, J)``: the leg rolls on its wheel there.
        wheel_landing: by region, ``(L, J)``: the leg swings and will land on its wheel there.
        zone: by region, ``(L, J)``: the leg rolls, and is in that region when the slot ends.
        passing: for each inner knot of a slot likewise; empty if the program does not know inner knots.
        pattern: ``(patterns, J)``: the set of legs that swing.
        S: swing matrix, ``(L, J)``.
        rolling: legs that stand on a wheel, ``(L, J)``; zeros where no wheel is allowed.
        wheel: the wheel's dynamics matrix over all regions, ``(L, J)``; likewise.
        rows: constraints.
    """

    problem: Problem
    regions: tuple[int, ...]
    groups: dict[int, tuple[int, ...]]
    foot_stance: dict[int, Any]
    foot_landing: dict[int, Any]
    wheel_stance: dict[int, Any]
    wheel_landing: dict[int, Any]
    zone: dict[int, Any]
    passing: list[dict[int, Any]]
    pattern: Any
    S: Any
    rolling: Any
    wheel: Any
    rows: list[Any] = field(default_factory=list)

    @classmethod
    def of(cls, problem: Problem, places: Places, inner_knots: bool) -> "Contacts":
        """State the flow.

        Args:
            problem: what is asked.
            places: says which regions can be reached.
            inner_knots: whether to say where a rolling wheel is at the knots within a slot.
        """
        shape, ground = (problem.legs, problem.slots), problem.ground

        def each(name: str, keys: Iterable[int], wanted: bool = True) -> dict[int, Any]:
            return {i: cp.Variable(shape, name=f"{name}{i}") for i in (keys if wanted else ())}

        regions = places.used
        groups = {g: tuple(r for r in m if r in regions) for g, m in enumerate(ground.groups)}
        groups = {g: members for g, members in groups.items() if members}
        wheel_stance = each("wheel_stance", groups, problem.wheels)
        shared = [r for r in regions if len(groups[ground.group_of[r]]) > 1]
        # Alone in its group, a region is where the wheel is all the time: no variable of its own.
        alone = {r: wheel_stance[ground.group_of[r]] for r in regions if r not in shared and problem.wheels}
        inner = range(problem.knots_per_slot - 1 if inner_knots else 0)
        foot_landing = each("foot_landing", regions)
        wheel_landing = each("wheel_landing", regions, problem.wheels)
        rows: list[Any] = []

        def total(name: str, parts: Iterable[Any]) -> Any:
            """Return the sum of parts, as a variable of its own if there are many: that keeps rows short."""
            parts = list(parts)
            if len(parts) < 2:
                return parts[0] if parts else np.zeros(shape)
            variable = cp.Variable(shape, name=name)
            rows.append(variable == sum(parts))
            return variable

        rolling = total("rolling", wheel_stance.values())
        contacts = cls(
            problem,
            regions,
            groups,
            foot_stance=each("foot_stance", regions),
            foot_landing=foot_landing,
            wheel_stance=wheel_stance,
            wheel_landing=wheel_landing,
            zone=each("zone", shared, problem.wheels) | alone,
            passing=[each(f"passing{i}_", shared, problem.wheels) | alone for i in inner],
            pattern=cp.Variable((len(problem.patterns), problem.slots), name="pattern"),
            S=total("S", [*foot_landing.values(), *wheel_landing.values()]),
            rolling=rolling,
            wheel=total("wheel", [rolling, *wheel_landing.values()]) if problem.wheels else rolling,
            rows=rows,
        )
        contacts._flow()
        contacts._pass()
        contacts._patterns()
        return contacts

    @property
    def feet(self) -> Any:
        """Legs that stand on a foot, ``(L, J)``."""
        return sum(self.foot_stance.values())

    @property
    def shape(self) -> tuple[int, int]:
        """Legs and slots."""
        return self.problem.legs, self.problem.slots

    def occupancy(self, region: int) -> Any:
        """Return which contacts are in a region when a slot ends, ``(L, J)``."""
        total = self.foot_stance[region] + self.foot_landing[region]
        return total + self.zone[region] + self.wheel_landing[region] if self.problem.wheels else total

    def before(self, region: int) -> Any:
        """Return which contacts are in a region when a slot begins, ``(L, J)``."""
        start = (self.problem.start_regions == region).astype(float)[:, None]
        return cp.hstack([start, self.occupancy(region)[:, :-1]])

    def landing_wheel(self) -> Any:
        """Return the legs that swing and will land on their wheel, ``(L, J)``."""
        return sum(self.wheel_landing.values()) if self.problem.wheels else np.zeros(self.shape)

    def carried(self) -> Any:
        """Return the legs that carry a wheel when a slot begins, ``(L, J)``."""
        start = np.array([[float(e == "wheel")] for e in self.problem.start_end_effectors])
        return cp.hstack([start, self.wheel[:, :-1]]) if self.problem.wheels else np.zeros(self.shape)

    def discrete(self) -> dict[Any, Any]:
        """Return the variables that must be integers, by name."""
        parts = {
            "foot stance": self.foot_stance,
            "foot landing": self.foot_landing,
            "wheel stance": self.wheel_stance,
            "wheel landing": self.wheel_landing,
            "zone": self.zone,
        }
        parts |= {f"passing {i}": at for i, at in enumerate(self.passing)}
        named = {(name, key): v for name, part in parts.items() for key, v in part.items()}
        own = {("wheel stance", key) for key in self.wheel_stance}
        stances = {v.id for v in self.wheel_stance.values()}
        return {"pattern": self.pattern} | {k: v for k, v in named.items() if k in own or v.id not in stances}

    def _flow(self) -> None:
        """State Paper A, eqs 16 and 17: a leg stands where and on what it stood or landed before."""
        problem = self.problem
        self.rows.append(self.feet + self.rolling + self.S == 1)
        own = {v.id: v for v in self.discrete().values() if v is not self.pattern}
        self.rows += [v >= 0 for v in own.values()]
        kinds, regions = np.array(problem.start_end_effectors), problem.start_regions
        for r, stance in self.foot_stance.items():
            begin = ((kinds == "foot") & (regions == r)).astype(float)[:, None]
            self.rows.append(stance[:, :1] <= begin)
            self.rows.append(stance[:, 1:] <= stance[:, :-1] + self.foot_landing[r][:, :-1])
        for g, stance in self.wheel_stance.items():
            begin = ((kinds == "wheel") & np.isin(regions, self.groups[g])).astype(float)[:, None]
            landed = sum(self.wheel_landing[r] for r in self.groups[g])
            self.rows.append(stance[:, :1] <= begin)
            self.rows.append(stance[:, 1:] <= stance[:, :-1] + landed[:, :-1])
        if problem.stance_between_swings and problem.slots > 1:
            self.rows.append(self.S[:, 1:] + self.S[:, :-1] <= 1)
        if problem.final_stance and problem.wheels:
            self.rows.append(cp.sum(self.feet[:, -1]) >= 1)

    def _pass(self) -> None:
        """State Paper A, eqs 23–25: a rolling wheel is in one region of its group, and does not turn back."""
        ground = self.problem.ground
        for g, members in self.groups.items():
            if len(members) == 1 or not self.problem.wheels:
                continue
            stance = self.wheel_stance[g]
            ordered = [r for r in ground.order if r in members]
            self.rows += [sum(at[r] for r in members) == stance for at in (self.zone, *self.passing)]
            for i in range(1, len(ordered)):
                for part in (ordered[:i], ordered[i:]):
                    ends = sum(self.before(r) + self.occupancy(r) for r in part)
                    self.rows += [sum(at[r] for r in part) <= ends for at in self.passing]

    def _patterns(self) -> None:
        """Keep ``S[:, j]`` in the convex hull of the admissible patterns."""
        patterns, legs = self.problem.patterns, range(self.problem.legs)
        members = np.array([[float(leg in p) for p in patterns] for leg in legs])
        chosen = self.pattern
        self.rows += [chosen >= 0, members @ chosen == self.S, cp.sum(chosen, axis=0) == 1]

    @property
    def sizes(self) -> Any:
        """``(N, J)`` expression whose row n is 1 where n legs swing (Paper A, eqs 13 and 14).

        The paper's auxiliary s, with the s₀ that it lacks.
        """
        sizes = np.array([len(p) for p in self.problem.patterns])
        return np.array([sizes == n for n in range(sizes.max() + 1)], float) @ self.pattern


def assignment(problem: Problem, gait: Gait, keys: Iterable[Any]) -> dict[Any, np.ndarray]:
    """Return the values of the discrete variables that a gait implies.

    Args:
        problem: what is asked.
        gait: its regions may be :data:`~.gait.UNKNOWN`.
        keys: of :meth:`Contacts.discrete`.

    Returns:
        Values by key; NaN where the gait leaves them open, as it does where a wheel crosses an edge.

    Raises:
        KeyError: a slot's set of swinging legs is not an admissible pattern.
    """
    S, wheel, region = gait
    ground = problem.ground
    stands, index = 1 - S, {frozenset(p): i for i, p in enumerate(problem.patterns)}
    before = np.hstack([problem.start_regions[:, None], region[:, :-1]])

    def within(places: np.ndarray, wanted: Iterable[int]) -> np.ndarray:
        return np.where(places == UNKNOWN, np.nan, np.isin(places, wanted))

    def where(mode: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        return np.where(mode == 1, chosen, 0.0)

    values: dict[Any, np.ndarray] = {}
    for key in keys:
        if key == "pattern":
            rows = [index[frozenset(np.flatnonzero(S[:, j]).tolist())] for j in range(problem.slots)]
            values[key] = np.eye(len(problem.patterns))[:, rows]
            continue
        name, i = key
        if name == "wheel stance":
            values[key] = where(stands * wheel, within(region, ground.groups[i]))
        elif name.startswith("passing"):
            here = within(region, [i])
            crosses = (region != before) & (region != UNKNOWN) & (before != UNKNOWN)
            here[crosses | (before == UNKNOWN)] = np.nan
            values[key] = where(stands * wheel, here)
        else:
            modes = {
                "foot stance": stands * (1 - wheel),
                "foot landing": S * (1 - wheel),
                "wheel landing": S * wheel,
                "zone": stands * wheel,
            }
            values[key] = where(modes[name], within(region, [i]))
    return values
