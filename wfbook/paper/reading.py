"""What a gait diagram says, in numbers: stances on feet and on wheels, when, and where."""

from dataclasses import dataclass

import numpy as np

from wfbook.modes import END_EFFECTORS, LEGS
from wfbook.planner import Plan

_FOOT, _WHEEL = (END_EFFECTORS.index(kind) for kind in ("foot", "wheel"))


@dataclass(frozen=True)
class Reading:
    """A plan's gait.

    Attributes:
        slot_s: duration of a slot.
        feet: ``(L, J)`` bool: the leg stands on its foot.
        wheels: ``(L, J)`` bool: it stands or rolls on its wheel.
        landing: ``(L, J)`` bool: it swings, and lands on its foot.
        regions: ``(L, J)`` index of the region it is in when the slot ends, or will land in.
        before: ``(L,)`` index of the region it starts on.
        step_m: the longest displacement along x in a swing.
    """

    slot_s: float
    feet: np.ndarray
    wheels: np.ndarray
    landing: np.ndarray
    regions: np.ndarray
    before: np.ndarray
    step_m: float

    @classmethod
    def of(cls, plan: Plan) -> "Reading":
        """Read a plan."""
        stands, kind = plan.S == 0, plan.end_effector
        rho = plan.knots // plan.slots
        moved = np.abs(np.diff(plan.p[::rho, :, 0], axis=0)).T * ~stands
        return cls(
            plan.slot_duration,
            stands & (kind == _FOOT),
            stands & (kind == _WHEEL),
            ~stands & (kind == _FOOT),
            np.array(plan.meta["regions"]),
            np.array([_region_under(plan, *place) for place in plan.p[0, :, :2]]),
            float(moved.max(initial=0.0)),
        )

    @property
    def swings(self) -> int:
        """Number of swings."""
        return int((~self.feet & ~self.wheels).sum())

    def share_on_wheels(self, where: np.ndarray | bool = True) -> float | None:
        """Return the share of stance that is on wheels.

        Args:
            where: ``(L, J)`` bool, the slots of each leg that count.

        Returns:
            None if no leg stands there.
        """
        wheels, feet = (self.wheels & where).sum(), (self.feet & where).sum()
        return float(wheels / (wheels + feet)) if wheels + feet else None

    @property
    def first_wheel_s(self) -> float | None:
        """Time from which a leg stands on a wheel; None if none ever does."""
        return self._first(self.wheels.any(axis=0))

    @property
    def all_on_wheels_s(self) -> float | None:
        """Time from which all legs stand on wheels; None if they never do."""
        return self._first(self.wheels.all(axis=0))

    @property
    def foot_contacts(self) -> int:
        """Number of stances on a foot, those at the start among them."""
        begins = self.feet & ~np.pad(self.feet, ((0, 0), (1, 0)))[:, :-1]
        return int(begins.sum())

    @property
    def ending(self) -> tuple[int, int]:
        """Number of legs on feet and on wheels in the last slot."""
        return int(self.feet[:, -1].sum()), int(self.wheels[:, -1].sum())

    @property
    def rolled_over_edges(self) -> int:
        """How often a wheel came into another region without a swing."""
        earlier = np.column_stack((self.before, self.regions[:, :-1]))
        return int((self.wheels & (self.regions != earlier)).sum())

    @property
    def switched_back(self) -> int:
        """Number of legs that stand on a foot at the end, and on a wheel some time before."""
        return int((self.feet[:, -1] & self.wheels.any(axis=1)).sum())

    @property
    def feet_only_from_s(self) -> float | None:
        """Time from which no leg is on a wheel any more; None if one is to the end."""
        rolling = np.flatnonzero(self.wheels.any(axis=0))
        last = rolling[-1] + 1 if len(rolling) else 0
        return last * self.slot_s if last < self.wheels.shape[1] else None

    @property
    def lines(self) -> list[str]:
        """A line for each leg: ``.`` on its foot, ``o`` on its wheel, ``^`` swings; and its regions."""
        letters = np.where(self.feet, ".", np.where(self.wheels, "o", "^"))
        return [
            f"{name} {''.join(row)}  regions {''.join(map(str, regions))}"
            for name, row, regions in zip(LEGS, letters, self.regions, strict=True)
        ]

    def _first(self, slots: np.ndarray) -> float | None:
        found = np.flatnonzero(slots)
        return float(found[0] * self.slot_s) if len(found) else None


def _region_under(plan: Plan, x: float, y: float) -> int:
    found = plan.terrain.region_at(x, y, 1e-6)
    return -1 if found is None else found
