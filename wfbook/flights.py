"""Chapter 8: a plan between its knots: where the body is at any time, and which legs fly when and whither."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan

LANDING_PHASE = 0.88
"""Fraction of its slots after which a swing lands."""


@dataclass(frozen=True)
class Swing:
    """One flight of one leg; consecutive swing slots are one flight.

    Attributes:
        start, end: times of the plan's slots.
        target: ``(3,)`` contact point to land on.
        kind: end effector to land with, 0 foot, 1 wheel.
        region: to land on.
        landing_phase: fraction of the slots after which it is to land.
    """

    start: float
    end: float
    target: np.ndarray
    kind: int
    region: int
    landing_phase: float = LANDING_PHASE

    @property
    def duration(self) -> float:
        """Time from lift-off to the planned landing, which is before ``end``."""
        return self.landing_phase * (self.end - self.start)


def swings_of(plan: "Plan", landing_phase: float = LANDING_PHASE) -> list[list[Swing]]:
    """Return the flights of each leg, in order; each lands after that fraction of its slots."""
    rho = plan.knots // plan.slots
    kinds, regions = plan.end_effector, plan.D.sum(axis=3).argmax(axis=2)
    flights: list[list[Swing]] = []
    for leg in range(4):
        padded = np.diff(np.concatenate([[0], plan.S[leg], [0]]))
        flights.append([])
        for first, after in zip(np.flatnonzero(padded == 1), np.flatnonzero(padded == -1), strict=True):
            flights[leg].append(
                Swing(
                    float(plan.t[first * rho] - plan.t[0]),
                    float(plan.t[after * rho] - plan.t[0]),
                    plan.p[after * rho, leg],
                    int(kinds[leg, after - 1]),
                    int(regions[leg, after - 1]),
                    landing_phase,
                )
            )
    return flights


def interpolate(plan: "Plan", t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the planned CoM, its velocity and acceleration at a time since the plan's start, each ``(3,)``.

    Before and after the plan, its first and last position at rest.
    """
    dt = plan.dt
    if t < 0.0:
        return plan.x[0], np.zeros(3), np.zeros(3)
    k = int(t / dt + 1e-9)
    if k >= plan.knots:
        return plan.x[-1], np.zeros(3), np.zeros(3)
    s = t - k * dt
    return plan.x[k] + s * plan.v[k] + 0.5 * s * s * plan.a[k], plan.v[k] + s * plan.a[k], plan.a[k]
