"""What one leg's rows of S and D leave of its path (Paper A, eqs 6, 18–25, 30).

Chapter 3 looks at one leg below a body whose way is given. Where the rows say *swing*, the leg follows its
spline to a foothold that may be chosen; where they say *foot*, it stays; where they say *wheel*, it goes with
the body. What is left to choose are the landings and a rolling wheel's regions: a mixed-integer linear
program of a few variables. Its rules may be broken at a price, so that rows which ask for too much still
have a path, together with a list of what it breaks.

The leg moves in the vertical plane of its hip: y is constant.
"""

from dataclasses import dataclass
from functools import cached_property

import cvxpy as cp
import numpy as np

from wfbook.modes import END_EFFECTORS, Broken, regions_allowed
from wfbook.swing import quintic_basis, septic_basis
from wfbook.terrain import Region, Terrain

_PRICE = {"place": 10.0, "reach": 100.0, "step": 100.0}
"""Of a metre by which a rule is broken; a metre between hip and contact at the end of a slot costs 1."""

_BROKEN = 1e-4
_SAMPLES = 8  # points of a drawn path between two knots


def bank_and_deck(gap: float = 0.15) -> Terrain:
    """Return a bank, a gap, and a deck of two regions in one group, of which the second slopes down.

    Args:
        gap: between bank and deck, along x.
    """
    profile = [
        (-0.5, 0.12, 0.0, 0.0, "bank"),
        (0.12, 0.47, 0.0, 0.0, "deck"),
        (0.47, 1.4, 0.0, -0.08, "deck"),
    ]
    regions = []
    for begin, end, low, high, group in profile:
        shift = 0.0 if group == "bank" else gap
        edges = [
            (begin + shift, -1, low),
            (end + shift, -1, high),
            (end + shift, 1, high),
            (begin + shift, 1, low),
        ]
        regions.append(Region(edges, 0.7, 0.0, 0.7, 0.0, group))
    return Terrain("bank and deck", tuple(regions))


@dataclass(frozen=True)
class Ride:
    """A body that glides at constant speed, and what the leg below it can do.

    Attributes:
        terrain: its regions; wheels roll between those of one group.
        slots: J.
        speed: of the body along x.
        start: x of hip and contact at time 0.
        y: of the contact.
        end_effector: carried before slot 0.
        leg: index, for messages.
        slot_duration: of one slot.
        knots_per_slot: ρ.
        reach: how far ahead of or behind the hip the contact may be (eq. 30).
        step: longest displacement in one swing.
        swing_height: apex of a swing above the mean of its ends.

    Raises:
        ValueError: there is no region below the leg.
    """

    terrain: Terrain
    slots: int = 6
    speed: float = 0.5
    start: float = 0.0
    y: float = 0.0
    end_effector: str = "foot"
    leg: int = 0
    slot_duration: float = 0.3
    knots_per_slot: int = 3
    reach: float = 0.17
    step: float = 0.30
    swing_height: float = 0.06

    def __post_init__(self):
        if self.terrain.region_at(self.start, self.y) is None:
            raise ValueError(f"start: no region at x = {self.start} m, y = {self.y} m")

    @property
    def time(self) -> np.ndarray:
        """``(K+1,)`` of the knots."""
        rho = self.knots_per_slot
        return self.slot_duration / rho * np.arange(self.slots * rho + 1)

    @property
    def hip(self) -> np.ndarray:
        """``(K+1,)`` x of the hip at the knots."""
        return self.start + self.speed * self.time

    @cached_property
    def groups(self) -> list[list[int]]:
        """The paper's ζ: indices of the regions of each group."""
        names = [region.group for region in self.terrain.regions]
        return [[i for i, name in enumerate(names) if name == group] for group in dict.fromkeys(names)]

    @cached_property
    def intervals(self) -> np.ndarray:
        """``(R, 2)`` where each region begins and ends along x, at the leg's y (eq. 22)."""
        found = []
        for region in self.terrain.regions:
            A, b = region.halfspaces
            ahead, behind = A[:, 0] > 1e-9, A[:, 0] < -1e-9
            cut = (b - A[:, 1] * self.y) / np.where(ahead | behind, A[:, 0], 1.0)
            found.append([cut[behind].max(), cut[ahead].min()])
        return np.array(found)

    @cached_property
    def start_dynamics(self) -> np.ndarray:
        """``(R, E)`` D of the leg before slot 0."""
        D = np.zeros((len(self.terrain.regions), len(END_EFFECTORS)), np.int8)
        D[self.terrain.region_at(self.start, self.y), END_EFFECTORS.index(self.end_effector)] = 1
        return D


@dataclass(frozen=True)
class LegPath:
    """The path that comes nearest to what S and D ask.

    Attributes:
        ride: body and ground.
        S: ``(J,)`` swing row.
        wheel: ``(J+1,)`` whether the leg carries its wheel before slot 0 and in each slot; in a swing the
            end effector it lands with.
        ends: ``(J+1,)`` x of the contact at time 0 and when each slot ends.
        region: ``(K+1,)`` index of the region that the contact is on at each knot, of those that D allows;
            -1 in the air or where it is on none of them.
        broken: what the path breaks, slot by slot. Empty if nothing.
    """

    ride: Ride
    S: np.ndarray
    wheel: np.ndarray
    ends: np.ndarray
    region: np.ndarray
    broken: list[Broken]

    @property
    def x(self) -> np.ndarray:
        """``(K+1,)`` x of the contact at the knots."""
        phase = np.arange(1, self.ride.knots_per_slot + 1) / self.ride.knots_per_slot
        return np.concatenate([self.ends[:1], *(self.along(j, phase) for j in range(self.ride.slots))])

    def along(self, slot: int, phase: np.ndarray) -> np.ndarray:
        """Return x of the contact at phases of a slot, 0 where it begins and 1 where it ends."""
        now, end, shift = _weights(self.ride, self.S, self.wheel, slot, np.asarray(phase, float))
        return now * self.ends[slot] + end * self.ends[slot + 1] + shift

    def heights(self, slot: int, phase: np.ndarray) -> np.ndarray:
        """Return z of the contact at phases of a slot; off every region it keeps the height it had."""
        phase = np.asarray(phase, float)
        x = self.along(slot, phase)
        if not self.S[slot]:
            return np.array([self._ground(place, slot) for place in x])
        ends = self._ground(self.ends[slot], slot), self._ground(self.ends[slot + 1], slot + 1)
        return septic_basis(phase) @ np.array([*ends, np.mean(ends) + self.ride.swing_height])

    def _ground(self, x: float, slot: int) -> float:
        """Return the height under x, or where there is none that of the nearest region's edge."""
        low, high = self.ride.intervals.T
        nearest = int(np.argmin(np.maximum(low - x, 0.0) + np.maximum(x - high, 0.0)))
        return self.ride.terrain.regions[nearest].height(np.clip(x, low[nearest], high[nearest]), self.ride.y)


def leg_path(ride: Ride, S: np.ndarray, D: np.ndarray) -> LegPath:
    """Return the path that one leg's rows of S and D ask for (Paper A, eqs 6, 18–25 and 30).

    Landings are as near below the hip as the rules allow: the sum of ``|x − x_hip|`` over slots is least.

    Args:
        ride: body and ground.
        S: ``(J,)`` swing row of the leg.
        D: ``(J, R, E)`` dynamics rows, legal (:func:`wfbook.modes.broken_rules`).

    Raises:
        ValueError: S or D has the wrong shape, or D not one entry of 1 in each slot.
    """
    S, D = np.asarray(S, int), np.asarray(D, int)
    shape = (ride.slots, len(ride.terrain.regions), len(END_EFFECTORS))
    if S.shape != shape[:1] or D.shape != shape:
        raise ValueError(f"S, D: shapes {S.shape}, {D.shape} instead of {shape[:1]}, {shape}")
    if (D.sum(axis=(1, 2)) != 1).any():
        raise ValueError("D: not exactly one entry of 1 in each slot (eq. 17)")
    rho, knots = ride.knots_per_slot, np.arange(1, ride.slots * ride.knots_per_slot + 1)
    slot, last = (knots - 1) // rho, knots % rho == 0
    wheel = np.append(END_EFFECTORS.index(ride.end_effector), D.sum(axis=1).argmax(axis=1))
    rolls = (S[slot] == 0) & (wheel[slot + 1] == 1)

    q = cp.Variable(ride.slots + 1)
    parts = [_weights(ride, S, wheel, j, np.arange(1, rho + 1) / rho) for j in range(ride.slots)]
    now, end, shift = (np.concatenate(part) for part in zip(*parts, strict=True))
    p = cp.multiply(now, q[slot]) + cp.multiply(end, q[slot + 1]) + shift
    late = {name: cp.Variable(n, nonneg=True) for name, n in (("reach", len(knots)), ("step", ride.slots))}
    lever = p - ride.hip[1:]
    rows = [q[0] == ride.start, p[last] == q[1:], cp.abs(lever) <= ride.reach + late["reach"]]
    rows.append(cp.multiply(S, cp.abs(q[1:] - q[:-1])) <= ride.step + late["step"])

    # Equations 22 and 23 hold where a leg stands or comes down: for a foot its own region, for a landing
    # wheel too; a wheel that rolls may be on any of its group, at every knot.
    allowed = regions_allowed(D[None], ride.groups)[0]
    allowed = np.where(rolls[:, None], allowed[slot], D.sum(axis=2)[slot] == 1)
    which, region = np.nonzero(allowed & (last | rolls)[:, None])
    late["place"] = cp.Variable(len(knots), nonneg=True)
    z = cp.Variable(len(which), boolean=True)
    low, high = ride.intervals.T
    far = high.max() - low.min()
    # Equations 24 and 25.
    rows.append(p[which] <= high[region] + far * z + late["place"][which])
    rows.append(p[which] >= low[region] - far * z - late["place"][which])
    member = which == np.unique(which)[:, None]
    rows.append(member.astype(float) @ z <= member.sum(axis=1) - 1)

    broken = sum(_PRICE[name] * cp.sum(amount) for name, amount in late.items())
    problem = cp.Problem(cp.Minimize(cp.sum(cp.abs(lever[last])) + broken), rows)
    problem.solve(solver=cp.HIGHS)
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise RuntimeError(f"leg path: {problem.status}")

    x = p.value
    here = np.full(len(knots) + 1, -1)
    here[0] = ride.terrain.region_at(ride.start, ride.y)
    inside = (x[which] >= low[region] - _BROKEN) & (x[which] <= high[region] + _BROKEN)
    here[1 + which[inside]] = region[inside]
    amounts = {name: variable.value for name, variable in late.items()}
    return LegPath(ride, S, wheel, q.value, here, _read(ride, S, D, wheel, amounts))


def _weights(
    ride: Ride, S: np.ndarray, wheel: np.ndarray, slot: int, phase: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how x at phases of a slot follows from x where the slot begins and ends: ``now, end, shift``.

    A swing is eq. 6, with the body's velocity at an end where the leg is on its wheel; a foot stays
    (eq. 19); a wheel goes with the body (eq. 20).
    """
    T = ride.slot_duration
    if S[slot]:
        now, lift, end, land = quintic_basis(phase).T
        return now, end, T * ride.speed * (lift * wheel[slot] + land * wheel[slot + 1])
    return np.ones_like(phase), np.zeros_like(phase), ride.speed * T * phase * wheel[slot + 1]


def _read(
    ride: Ride, S: np.ndarray, D: np.ndarray, wheel: np.ndarray, late: dict[str, np.ndarray]
) -> list[Broken]:
    """Say which rules are broken, each once a slot, by the worst of its knots."""
    found = []
    for j in range(ride.slots):
        region = int(D[j].any(axis=1).argmax())
        knots = slice(j * ride.knots_per_slot, (j + 1) * ride.knots_per_slot)
        place, reach = 100 * late["place"][knots].max(), 100 * late["reach"][knots].max()
        rolls = wheel[j + 1] and not S[j]
        if place > 100 * _BROKEN:
            what = "lands" if S[j] else "rolls" if rolls else "stands"
            group = "all regions of the group of " if rolls else ""
            reason = f"the {END_EFFECTORS[wheel[j + 1]]} {what} {place:.0f} cm outside {group}region {region}"
            found.append(Broken("eq. 23" if wheel[j + 1] else "eq. 22", ride.leg, j, reason))
        if reach > 100 * _BROKEN:
            reason = f"{reach:.0f} cm beyond the {100 * ride.reach:.0f} cm that the leg reaches from its hip"
            found.append(Broken("eq. 30", ride.leg, j, reason))
        if (step := 100 * late["step"][j]) > 100 * _BROKEN:
            reason = f"{step:.0f} cm more than the longest step, {100 * ride.step:.0f} cm"
            found.append(Broken("step limit", ride.leg, j, reason))
    return found
