"""What of the limits that exclude each other is to blame: which leg, regions and slots, and by how much."""

import time
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np

from wfbook.modes import LEGS
from wfbook.planner.elastic import Elastic, Part
from wfbook.planner.feasibility import possible
from wfbook.planner.neighbours import Neighbours, neighbours

_TELLING = 5e-3  # metres, metres per second or body weights; less is not worth a word
_FINE = 8.0  # seconds for telling parts apart
_LENGTHS = ("regions", "reach", "step", "end")
_MUCH = 5.0  # times what another length lacks: no remedy that anyone would take
_ALONG = {"x": "along x", "y": "along y", "z": "up and down"}


@dataclass(frozen=True)
class Reason:
    """A part of why there is no plan.

    Attributes:
        group: name of the constraint group it belongs to; "slots" if more of them would do.
        text: for a person.
        legs: names of the legs it is about; empty if it is no matter of single legs.
        regions: indices of the regions.
        slots: first and last slot in which the conflict shows already; None if it takes all.
        limit: what is allowed, in the limit's own unit.
        missing: by how much more, at least, would have to be allowed.
    """

    group: str
    text: str
    legs: tuple[str, ...] = ()
    regions: tuple[int, ...] = ()
    slots: tuple[int, int] | None = None
    limit: float | None = None
    missing: float | None = None


def words(items: Iterable[object], last: str = " and ") -> str:
    """Join items by commas and a last word."""
    items = [str(item) for item in items]
    return last.join([", ".join(items[:-1]), items[-1]]) if len(items) > 1 else "".join(items)


def reasons(elastic: Elastic, groups: Collection[str]) -> tuple[Reason, ...]:
    """Tell what is to blame, in the order in which it is best said.

    Args:
        elastic: the problem.
        groups: that exclude each other, and none of which can be left out.
    """
    return tuple(_Inquiry(elastic, groups).answer())


class _Inquiry:
    """Questions about the parts of a contradiction."""

    def __init__(self, elastic: Elastic, groups: Collection[str]):
        self.elastic, self.problem, self.groups = elastic, elastic.problem, groups
        self.core = [part for part in elastic.parts if part.group in groups]
        self.window: tuple[int, int] | None = None

    def answer(self) -> list[Reason]:
        """Return the reasons: the most telling kind that there is."""
        last = self.problem.slots - 1
        # If there is room at the end, what is missing is a way there.
        way = "regions" in self.groups and self.elastic.feasible(self.core, (last, last)) is not False
        found = self._crossings(heights=False) if way else []
        if found:
            return found
        self._refine()
        self._narrow()
        slopes = self._slopes()
        if any(slope.missing for slope in slopes):
            found = [*slopes, *self._rules()]
        else:
            climbed = way and any(part.group == "reach" and part.kind == "z" for part in self.core)
            crossings = self._crossings(heights=True) if climbed else []
            sizes = [] if crossings else self._sizes()
            limits = self._limits()
            found = [*self._starts(), *slopes, *sizes, *self._rules(), *limits, *self._goals()]
            found += self._ends(rest=not found)
            if crossings:
                found = [*crossings, *(limit for limit in limits if limit.text.count(_ALONG["z"]))]
            elif not sizes:
                found = [*self._slots(), *found]
        return [replace(reason, slots=self.window) for reason in _nearest(found)]

    def _crossings(self, heights: bool) -> list[Reason]:
        """Name gaps, and with ``heights`` steps up and down, that can't be crossed.

        Each is closed by moving edges of one region out until it touches, or covers, the next. The least
        set of gaps is named that must be closed for the contradiction to go away.
        """
        pairs = neighbours(self.problem)
        closing = {n: n.bridge for n in pairs if n.gap > _TELLING}
        if heights:
            closing |= {n: n.cover for n in pairs if abs(n.rise) > _TELLING}

        def opens(chosen: Collection[Neighbours]) -> bool | None:
            """Tell whether the contradiction is gone if these are closed."""
            given: dict[Part, float] = {}
            for n in chosen:
                for edge, way in closing[n].items():
                    part = Part("regions", str(edge), n.near)
                    given[part] = max(way, given.get(part, 0.0))
            return self.elastic.feasible(self.core, given=given)

        # What is widest is most likely to blame; of equals, what comes first.
        order = sorted(closing, key=lambda n: (-n.gap, -abs(n.rise)))
        for count in range(1, len(order) + 1):
            chosen = order[:count]
            if opens(chosen):
                break
        else:
            return []
        doubtful = []
        for n in chosen[-2::-1]:
            rest = [other for other in chosen if other is not n]
            needless = opens(rest)
            doubtful += [n] if needless is None else []
            chosen = rest if needless else chosen
        found = {n: self._crossing(n) for n in sorted(chosen, key=pairs.index)}
        for n in set(doubtful) & set(chosen):
            found[n] = replace(found[n], text=f"{found[n].text} (perhaps without need)")
        return list(found.values())

    def _crossing(self, n: Neighbours) -> Reason:
        """Describe a gap, or a step up or down, that can't be crossed."""
        where, regions = f"regions {n.near}–{n.far}:", (n.near, n.far)
        if n.gap <= _TELLING:
            text = f"{where} {_number(abs(n.rise))} m {'up' if n.rise > 0 else 'down'} can't be climbed"
            return Reason("regions", text, regions=regions)
        text = f"{where} gap {_number(n.gap)} m"
        ((edge, way), *others) = n.bridge.items()
        normal = np.abs(self.problem.terrain.regions[n.near].halfspaces[0][edge])
        if others or normal.max() < 1 - 1e-6:
            return Reason("regions", f"{text} can't be crossed", regions=regions)
        axis = int(normal.argmax())
        step = self.problem.limits.step[axis]
        if "step" in self.groups and step < way:
            text += f" exceeds the {_number(step)} m step"
            return Reason("regions", text, regions=regions, limit=step, missing=way - step)
        # The contradiction alone decides here: what the other limits allow may be less.
        missing = self._missing([Part("regions", str(edge), n.near)])
        if missing is None:
            return Reason("regions", f"{text} can't be crossed", regions=regions)
        text += f", at most {_number(way - missing)} m can be crossed"
        return Reason("regions", text, regions=regions, limit=way - missing, missing=missing)

    def _refine(self) -> None:
        """Leave out all parts of the contradiction that it doesn't need: kinds first, then legs."""
        ends = time.perf_counter() + _FINE
        # Legs that start too far from the body say more than legs that start too far from each other.
        body = [part for part in self.core if part == Part("start", "body")]
        kinds: dict[tuple, list[Part]] = {}
        for part in sorted(self.core, key=lambda part: part.group in ("reach", "regions")):
            if part not in body:
                key = part.group, "" if part.group == "regions" else part.kind, part.region
                kinds.setdefault(key, []).append(part)
        units = self._least_set(list(kinds.values()), body, ends)
        legs = [[part] for unit in units for part in unit if part.leg is not None]
        whole = [part for unit in units for part in unit if part.leg is None]
        legs = self._least_set(legs, body + whole, ends)
        whole += [part for unit in legs for part in unit]
        self.core = whole if not body or self._least_set([body], whole, ends) == [] else body + whole

    def _least_set(self, units: list[list[Part]], needed: list[Part], ends: float) -> list[list[Part]]:
        """Return a least set of units that together with needed parts is a contradiction."""
        if not units or time.perf_counter() > ends:
            return units
        if self.elastic.feasible(needed) is False:
            return []
        if len(units) == 1:
            return units
        first, second = units[: len(units) // 2], units[len(units) // 2 :]
        second = self._least_set(second, needed + [part for unit in first for part in unit], ends)
        return self._least_set(first, needed + [part for unit in second for part in unit], ends) + second

    def _narrow(self) -> None:
        """Find how early the contradiction shows, if it does not need the end."""
        last = self.problem.slots - 1
        if {"end", "goal"} & set(self.groups):
            return
        low, high = 0, last
        while low < high:
            middle = (low + high) // 2
            if self.elastic.feasible(self.core, (0, middle)) is False:
                high = middle
            else:
                low = middle + 1
        self.window = (0, high) if high < last else None

    def _legs(self, group: str, kind: str) -> tuple[int, ...]:
        """Return which legs a kind of limit of the contradiction is about; none if it is about any leg."""
        legs = {part.leg for part in self.core if part.leg is not None}
        found = tuple(sorted(p.leg for p in self.core if (p.group, p.kind) == (group, kind)))
        if len(found) == self.problem.legs or (len(legs) == 1 and self._any_leg()):
            return ()
        return found

    def _any_leg(self) -> bool:
        """Tell whether the same contradiction holds for every single leg."""
        for leg in range(self.problem.legs):
            held = [part if part.leg is None else replace(part, leg=leg) for part in self.core]
            if self.elastic.feasible(held) is not False:
                return False
        return True

    def _missing(self, parts: list[Part]) -> float | None:
        """Return by how much parts of the contradiction must give way, if it is worth a word."""
        least = self.elastic.least(parts, self.core)
        return None if least is None or least < _TELLING else least

    def _kinds(self, group: str) -> dict[str, list[Part]]:
        """Return the contradiction's parts of a group by kind."""
        found: dict[str, list[Part]] = {}
        for part in self.core:
            if part.group == group:
                found.setdefault(part.kind, []).append(part)
        return found

    def _starts(self) -> list[Reason]:
        """Say where legs start, if it matters which."""
        kinds, found = self._kinds("start"), []
        up = any(part.group == "reach" and part.kind == "z" for part in self.core)
        places = np.column_stack([self.problem.start_contacts, self.problem.start_heights])
        if "leg" in kinds:
            for leg in self._legs("start", "leg"):
                place = ", ".join(f"{c:.2f}" for c in places[leg][: 3 if up else 2])
                found.append(Reason("start", f"leg {LEGS[leg]} starts at ({place})", (LEGS[leg],)))
        return found

    def _slopes(self) -> list[Reason]:
        """Describe the friction that is too little: of a slope, against its angle."""
        found = []
        for kind, parts in self._kinds("friction").items():
            for part in parts:
                surface = self.problem.ground.surfaces[part.region]
                n, *along = surface.basis
                rises, holds = np.abs([d[2] / n[2] for d in along]), np.array(surface.friction[kind])
                worst = int((rises - holds).argmax())
                slope, mu = np.degrees(np.arccos(min(n[2], 1.0))), holds[worst]
                text = f"region{'s' * (len(surface.regions) > 1)} {words(surface.regions)}: "
                missing = float(rises[worst] - mu)
                if missing > 0:
                    most = np.degrees(np.arctan(mu))
                    text += f"the slope of {slope:.1f}° exceeds the {most:.1f}° on which a {kind} holds"
                else:
                    missing = None
                    text += f"a {kind} holds too little"
                text += f" (mu {mu:.2f})"
                found.append(Reason("friction", text, (), surface.regions, None, float(mu), missing))
        return found

    def _sizes(self) -> list[Reason]:
        """Say which regions are too small."""
        found = []
        for region in sorted({part.region for part in self.core if part.group == "regions"}):
            parts = [part for part in self.core if (part.group, part.region) == ("regions", region)]
            missing = self._missing(parts)
            text = f"the edges of region {region}"
            text = f"region {region} is at least {_number(missing)} m too small" if missing else text
            found.append(Reason("regions", text, (), (region,), missing=missing))
        return sorted(found, key=lambda reason: reason.missing or np.inf)

    def _rules(self) -> list[Reason]:
        """Say which rules of swinging matter."""
        found = []
        if self._kinds("patterns"):
            sets = ["+".join(LEGS[leg] for leg in p) for p in self.problem.patterns if p]
            text = f"only {words(sets, ' or ')} may swing at a time" if sets else "no leg may swing"
            found.append(Reason("patterns", text))
        if self._kinds("pause"):
            found.append(Reason("pause", "a leg that has swung stands for a slot"))
        return found

    def _limits(self) -> list[Reason]:
        """Say which limits are too tight, and by how much at least."""
        problem, limits, found = self.problem, self.problem.limits, []

        def add(
            group: str, kind: str, text: str, limit: float, lack: str, legs: tuple[int, ...] = ()
        ) -> None:
            missing = self._missing(self._kinds(group)[kind])
            text += f", at least {_number(missing)} {lack}" if missing else ""
            found.append(
                Reason(group, text, tuple(LEGS[leg] for leg in legs), (), None, float(limit), missing)
            )

        for kind in self._kinds("force"):
            text = f"a leg carries up to {_number(limits.force)} of the weight"
            add("force", kind, text, limits.force, "too little")
        for axis in self._kinds("reach"):
            reach, legs = problem.robot.reach["xyz".index(axis)], self._legs("reach", axis)
            text = f"{_named(legs)} {'reach' + 'es' * (len(legs) == 1)} {_number(reach)} m {_ALONG[axis]}"
            add("reach", axis, text, reach, "m too little", legs)
        for axis in self._kinds("step"):
            step = limits.step["xy".index(axis)]
            add("step", axis, f"steps are up to {_number(step)} m {_ALONG[axis]}", step, "m too short")
        speeds = {"forward": limits.speed[0], "backward": limits.speed[1]}
        for kind in self._kinds("speed"):
            speed = speeds.get(kind, limits.lateral_speed)
            add("speed", kind, f"{kind} speed is up to {_number(speed)} m/s", speed, "m/s too slow")
        return found

    def _goals(self) -> list[Reason]:
        """Say where the goal is and how exactly it must be met, if that matters."""
        axes = self._kinds("goal")
        if not axes:
            return []
        x, y = self.problem.goal
        tolerance = {axis: self.problem.goal_tolerance["xy".index(axis)] for axis in axes}
        within = words(f"{_number(tolerance[axis])} m {_ALONG[axis]}" for axis in axes)
        return [Reason("goal", f"the goal ({x:.2f}, {y:.2f}) must be met within {within}")]

    def _ends(self, rest: bool) -> list[Reason]:
        """Say what of the end matters; that the robot rests and stands only if it is asked for."""
        found = []
        for kind, parts in self._kinds("end").items():
            legs = self._legs("end", kind) if parts[0].leg is not None else ()
            names = tuple(LEGS[leg] for leg in legs)
            if kind in ("x", "y"):
                limit, missing = self.problem.limits.rest_offset["xy".index(kind)], self._missing(parts)
                text = f"{_named(legs)} must end within {_number(limit)} m of nominal {_ALONG[kind]}"
                text += f", at least {_number(missing)} m too tight" if missing else ""
                found.append(Reason("end", text, names, (), None, limit, missing))
            elif kind == "foot":
                found.append(Reason("end", "one leg must end on a foot"))
            elif rest:
                what = "the robot must end at rest" if kind == "rest" else f"{_named(legs)} must end standing"
                found.append(Reason("end", what, names))
        return found

    def _slots(self) -> list[Reason]:
        """Say how many slots are enough, if the end matters and time is what is missing."""
        problem, elastic = self.problem, self.elastic
        if not {"end", "goal"} & set(self.groups):
            return []
        ends = time.perf_counter() + min(elastic.left, _FINE)

        def enough(slots: int) -> bool | None:
            left = ends - time.perf_counter()
            return possible(replace(problem, slots=slots), left) if left > 0 else None

        few, many, more = problem.slots, problem.slots, 1
        while enough(many := problem.slots + more) is not True:
            few, more = many, 2 * more
            if problem.slots + more > 2 * problem.slots + 8 or time.perf_counter() > ends:
                return []
        while many - few > 1:
            middle = (few + many) // 2
            few, many = (few, middle) if enough(middle) else (middle, many)
        have = f"{problem.slots} slot{'s' * (problem.slots > 1)} of {problem.slot_duration:g} s"
        are = "are" if problem.slots > 1 else "is"
        text = f"{have} {are} too few, {many} are enough"
        return [Reason("slots", text, limit=problem.slots, missing=many - problem.slots)]


def _nearest(found: list[Reason]) -> list[Reason]:
    """Leave out what would have to give way much farther than something else."""
    least = min((r.missing for r in found if r.missing and r.group in _LENGTHS), default=np.inf)
    return [r for r in found if r.group not in _LENGTHS or not r.missing or r.missing <= _MUCH * least]


def _named(legs: Collection[int]) -> str:
    if not legs:
        return "legs"
    return f"leg{'s' * (len(legs) > 1)} {words(LEGS[leg] for leg in legs)}"


def _number(value: float) -> str:
    return f"{value:.2f}" if value > 0.0195 else f"{value:.3f}"
