"""A program whose every limit can give way: what is possible without it, and how much is missing.

The tight formulation of a wide problem (:mod:`.wide`) forbids nothing. The true limits come on top, each
with a slack of its own. A slack that is held at zero is the limit; one that is free is the limit left out;
the least that is enough tells what is missing. Torque and rotation have slack of their own and take no
part (:mod:`.feasibility`).
"""

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import cvxpy as cp
import numpy as np
from scipy import sparse

from wfbook.friction import friction_pyramid
from wfbook.planner import tight
from wfbook.planner.feasibility import SOFT, compiled, exists, region_columns, solve
from wfbook.planner.problem import Problem
from wfbook.planner.program import bound, levers, within
from wfbook.planner.wide import clipped, widened

LAWS = ("modes", "dynamics", "motion")
"""Groups of the program that say what a robot is, each a single part."""

ALWAYS = -1
"""In place of a slot: what holds in all of them, whichever are asked about."""

_SAME = 1e-6


@dataclass(frozen=True)
class Part:
    """A limit that can be left out by itself.

    Attributes:
        group: name of the constraint group.
        kind: which of its kind: an axis, a direction, an end effector, the number of an edge.
        region: index of the region that it is about; for friction, of the surface.
        leg: index of the leg that it limits, if it is one leg.
    """

    group: str
    kind: str = ""
    region: int | None = None
    leg: int | None = None


class Elastic:
    """Questions to the elastic program of a problem.

    Attributes:
        problem: what was asked of the planner.
        parts: all limits.
        patience: seconds for one question.
        deadline: of :func:`time.perf_counter`, after which no question is answered.
    """

    def __init__(self, problem: Problem, patience: float, total: float):
        """State the program.

        Args:
            problem: its legs must start over regions.
            patience: seconds for one question.
            total: seconds for all of them.
        """
        self.problem, self.patience = problem, patience
        self.deadline = time.perf_counter() + total
        self._wide = widened(problem)
        self._program = tight.build(self._wide)
        for name in list(self._program.constraints):
            if name.split()[0] in ("start", "reach", "speed"):
                del self._program.constraints[name]
        self._named = {v.name(): v for row in self._program.rows() for v in row.variables()}
        self._slacks: list[tuple[Part, Any, int | None, np.ndarray]] = []
        self._rows: list[Any] = []
        self._limit_body()
        self._limit_legs()
        self._limit_regions()
        self._limit_force()
        for law in LAWS:
            for row in self._program.constraints[law]:
                self._give(Part(law), [row], None, ALWAYS)
        rest = self._program.rows(without=(*SOFT, *LAWS))
        self._conic, self._integer = compiled(self._program, rest + self._rows)
        self._occupied, self._landing = region_columns(self._conic, self._program.contacts)
        self._columns, self._slots = self._by_part()
        self.parts = list(self._columns)

    @property
    def left(self) -> float:
        """Seconds until the deadline."""
        return self.deadline - time.perf_counter()

    def feasible(
        self,
        held: Collection[Part],
        slots: tuple[int, int] | None = None,
        given: Mapping[Part, float] | None = None,
    ) -> bool | None:
        """Tell whether there is a motion within some limits.

        Args:
            held: these limits; the others are left out.
            slots: first and last slot in which the limits hold; default all.
            given: how far some of the limits give way, in their own unit.

        Returns:
            None if there was not enough time to tell.
        """
        if self.left <= 0:
            return None
        lower, upper = self._bounds(held, slots, given or {})
        cuts = self._cuts(held, given or {}) if slots is None else None
        time_limit = min(self.patience, self.left)
        contacts = self._program.contacts
        return exists(self._conic, self._integer, lower, upper, time_limit, contacts, cuts)

    def least(self, parts: Collection[Part], held: Collection[Part]) -> float | None:
        """Return how far some limits must give way: a lower bound, and exact if there is time.

        Args:
            parts: these limits, all by the same.
            held: limits that hold.

        Returns:
            In the limits' own unit; None if that does not help, or there was not enough time to tell.
        """
        if self.left <= 0:
            return None
        lower, upper = self._bounds([p for p in held if p not in parts], None, {})
        columns = np.concatenate([self._columns[part] for part in parts])
        n, m = len(upper), len(columns)
        entries = np.r_[np.ones(m), -np.ones(m)], (np.tile(np.arange(m), 2), np.r_[columns, np.full(m, n)])
        below = sparse.csc_array(entries, shape=(m, n + 1)), np.zeros(m)
        bounds = np.r_[lower, 0.0], np.r_[upper, np.inf]
        time_limit = min(self.patience, self.left)
        found = solve(self._conic, self._integer, *bounds, time_limit, n, below, gap=1e-3)
        return None if found.possible is False else found.least

    def _bounds(
        self, held: Collection[Part], slots: tuple[int, int] | None, given: Mapping[Part, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the columns' bounds."""
        upper = np.full(len(self._integer), np.inf)
        lower = -upper
        first, last = slots or (0, self.problem.slots - 1)
        for part in held:
            slot = self._slots[part]
            inside = ((slot >= first) & (slot <= last)) | (slot == ALWAYS)
            lower[self._columns[part][inside]] = 0.0
            upper[self._columns[part][inside]] = given.get(part, 0.0)
        return lower, upper

    def _cuts(self, held: Collection[Part], given: Mapping[Part, float]) -> tuple[Any, np.ndarray] | None:
        """Say in integers alone what regions and steps imply: no swing leads to a region too far away.

        A proof that a gap can't be crossed needs thousands of nodes without this.
        """
        if not {Part("motion"), Part("modes")} <= set(held):
            return None
        boxes = [self._box(r, held, given) for r in range(self.problem.ground.count)]
        apart = np.array([[np.maximum(low - up, down - high) for down, up in boxes] for low, high in boxes])
        rows, right = [], []
        for leg in range(self.problem.legs):
            far = np.zeros(apart.shape[:2], bool)
            for i, axis in enumerate("xy"):
                if Part("step", axis, leg=leg) in held and Part("step", axis, leg=leg) not in given:
                    far |= apart[..., i] > self.problem.limits.step[i] + _SAME
            for r in np.flatnonzero(far.any(axis=1)):
                for j in range(self.problem.slots):
                    before = self._occupied[r, :, leg, j - 1] if j else []
                    rows.append(np.r_[before, self._landing[far[r], :, leg, j].ravel()].astype(int))
                    right.append(1.0 - (j == 0 and self.problem.start_regions[leg] == r))
        if not rows:
            return None
        place = np.repeat(np.arange(len(rows)), [len(row) for row in rows]), np.concatenate(rows)
        shape = len(rows), len(self._integer)
        return sparse.csc_array((np.ones(len(place[0])), place), shape=shape), np.array(right)

    def _box(
        self, region: int, held: Collection[Part], given: Mapping[Part, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the box around what the edges that hold leave of a region's plane.

        Around nothing, the lower one is above the upper one, infinitely far from everything.
        """
        edges = [(a, b + given.get(part, 0.0)) for part, a, b in self._edges(region) if part in held]
        outline = clipped(self._wide.square, edges)
        return (
            (outline.min(axis=0), outline.max(axis=0))
            if len(outline)
            else (np.full(2, np.inf), np.full(2, -np.inf))
        )

    def _edges(self, region: int) -> list[tuple[Part, np.ndarray, float]]:
        """Return a region's half-spaces ``a · p ≤ b``, each with its part."""
        sides = zip(*self.problem.terrain.regions[region].halfspaces, strict=True)
        return [(Part("regions", str(i), region), a, float(b)) for i, (a, b) in enumerate(sides)]

    def _by_part(self) -> tuple[dict[Part, np.ndarray], dict[Part, np.ndarray]]:
        """Return the columns of each part's slacks, and the slot of each of these."""
        columns: dict[Part, list] = {}
        slots: dict[Part, list] = {}
        for part, variable, axis, when in self._slacks:
            at = self._conic.columns(variable)
            when = np.broadcast_to(when, at.shape)
            for leg in [None] if axis is None else range(self.problem.legs):
                one = part if leg is None else replace(part, leg=leg)
                pair = (at, when) if leg is None else (at.take(leg, axis), when.take(leg, axis))
                columns.setdefault(one, []).append(np.ravel(pair[0]))
                slots.setdefault(one, []).append(np.ravel(pair[1]))
        return tuple({part: np.concatenate(v) for part, v in found.items()} for found in (columns, slots))

    def _give(self, part: Part, rows: Sequence[Any], legs: int | None, slots: Any) -> None:
        """Add rows of one shape that a common slack lets give way.

        Args:
            part: what the rows say.
            rows: CVXPY constraints.
            legs: the axis along which legs stand; each leg is a part of its own then.
            slots: of the entries, broadcast to their shape.
        """
        if not rows[0].size:
            return
        slack = cp.Variable(rows[0].shape)
        self._slacks.append((part, slack, legs, np.asarray(slots)))
        for row in rows:
            equal = isinstance(row, cp.constraints.Equality)
            self._rows.append(row.expr == slack if equal else row.expr <= slack)

    def _limit_body(self) -> None:
        """State start, end, goal, reach and speed."""
        problem, true = self.problem, replace(self._program, constraints={})
        bound(true, problem)
        last, intervals = problem.slots - 1, np.arange(problem.knots) // problem.knots_per_slot
        for name, rows in true.constraints.items():
            group, _, kind = name.partition(" ")
            if group == "reach":
                self._give(Part(group, kind), rows, 1, intervals[:, None])
            elif group == "speed":
                self._give(Part(group, kind), rows, None, np.r_[0, intervals])
            elif group == "pause":
                self._give(Part(group), rows, None, 0)
            elif group in ("start", "end", "goal"):
                # Rows of angles and their rates are among these, and hold whatever happens.
                for row in rows:
                    legs = row.shape == (problem.legs,)
                    part = Part(group, kind or ("leg" if legs else "body"))
                    self._give(part, [row], 0 if legs else None, 0 if group == "start" else last)
        robot = problem.body
        for i, (axis, lever) in enumerate(zip("xyz", levers(self._program), strict=True)):
            # The program takes the start as it is; the search asks first whether it is in reach.
            rows = [lever[0] >= robot.reach_lower[:, i] - _SAME, lever[0] <= robot.reach_upper[:, i] + _SAME]
            self._give(Part("reach", axis), rows, 0, 0)
        if problem.final_stance and problem.wheels:
            self._give(Part("end", "foot"), [cp.sum(self._program.contacts.feet[:, -1]) >= 1], None, last)

    def _limit_legs(self) -> None:
        """State steps, patterns and the pause between swings."""
        problem, program = self.problem, self._program
        slots = np.arange(problem.slots)
        for i, axis in enumerate("xy"):
            self._give(
                Part("step", axis),
                within(self._named[f"step{i}"], problem.limits.step[i] * program.S),
                0,
                slots,
            )
        admissible = {frozenset(p) for p in problem.patterns}
        others = [i for i, p in enumerate(self._wide.patterns) if frozenset(p) not in admissible]
        if others:
            self._give(Part("patterns"), [program.contacts.pattern[others] <= 0], None, slots)
        if problem.stance_between_swings and problem.slots > 1:
            self._give(Part("pause"), [program.S[:, 1:] + program.S[:, :-1] <= 1], None, slots[1:])

    def _limit_regions(self) -> None:
        """State the edges of the regions, where slots end and for rolling wheels also within slots."""
        ground, program, contacts = self.problem.ground, self._program, self._program.contacts
        slots, rho = np.arange(self.problem.slots), self.problem.knots_per_slot
        for r in range(ground.count):
            # A wheel alone in its group rolls along a straight line between two points of a convex region.
            crossed = self.problem.wheels and len(ground.groups[ground.group_of[r]]) > 1
            for part, a, b in self._edges(r):
                shared = sum(a[i] * self._named[f"share{r}_{i}"] for i in range(2))
                self._give(part, [shared <= b * contacts.occupancy(r)], None, slots)
                most = max(float((self._wide.square @ a).max() - b), 0.0)
                for at, here in enumerate(contacts.passing if crossed else (), start=1):
                    place = sum(a[i] * program.p[i][at::rho].T for i in range(2))
                    self._give(part, [place <= b + most * (1 - here[r])], None, slots)

    def _limit_force(self) -> None:
        """State friction, and the largest force of a leg."""
        problem = self.problem
        slots = (np.arange(problem.knots) // problem.knots_per_slot)[:, None]
        for s, surface in enumerate(problem.ground.surfaces):
            for e in problem.end_effectors:
                n, t, b = (self._named[f"{axis}{s}_{e}"] for axis in "ntb")
                sides = friction_pyramid(n, t, b, *surface.friction[e])[1:]
                self._give(Part("friction", e, s), [side <= 0 for side in sides], None, slots)
                self._give(Part("force"), [n <= problem.limits.force], None, slots)
