"""Chapter 8: how the trunk leans with the ground.

The planner knows a body with four reach boxes and keeps it level. A level trunk above a slope has its uphill
legs folded and its downhill legs stretched: on 12 degrees the uphill knees touch the ground. The
controller therefore turns the trunk until all hips are alike in height above the planned footholds. The
centre of mass and the contacts stay where the plan has them.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from wfbook.go1 import knees, nominal

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan
    from wfbook.terrain import Terrain

CALF_HALF_THICKNESS = 0.012
"""Of the box around the calf that collides, across its diagonal."""

_HIPS = nominal()["hip_offsets"][:, :2] - nominal()["hip_offsets"][:, :2].mean(axis=0)
_SPLINE = (
    np.array([[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]]) / 6
)
"""Row i holds the factors of s^i for the four control values of a uniform cubic B-spline."""


BY = ("hips", "contacts", "nothing")
"""By what the trunk leans: the ground's height under the hips, the plane through the contacts, or not."""


class Lean:
    """The trunk's orientation over time: smooth, and at rest where the ground's slope does not change.

    The control values of a cubic B-spline are the angles that even out the hips where slots begin and end.
    Such a curve has a continuous acceleration and foresees the next slope by a slot.

    Args:
        plan: whose footholds are followed.
        by: one of :data:`BY`; the other two are for a lesson.

    Raises:
        ValueError: ``by`` is none of them.
    """

    def __init__(self, plan: "Plan", by: str = "hips") -> None:
        if by not in BY:
            raise ValueError(f"leans: {by!r} is none of {', '.join(BY)}")
        places = plan.p[:: plan.knots // plan.slots]
        self._slot, self._by = plan.slot_duration, by
        self._angles = np.array([_angles(contacts, by) for contacts in places])

    def follow(self, plan: "Plan", slot: int) -> None:
        """Go on with another plan from a slot on.

        The next slope is foreseen by a slot: there it stays as it was, so that the trunk does not jump.

        Args:
            plan: as for the class; up to the slot as the one before.
            slot: the first in which it differs.
        """
        kept = self._angles[: slot + 2]
        self._angles = np.vstack([kept, Lean(plan, self._by)._angles[len(kept) :]])

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the trunk's orientation and angular velocity at a time since the plan's start.

        Returns:
            Roll, pitch and yaw, ``(3,)``; angular velocity ``(3,)`` in the world.
        """
        j, last = math.floor(t / self._slot), len(self._angles) - 1
        s = t / self._slot - j
        control = self._angles[[min(max(i, 0), last) for i in range(j - 1, j + 3)]]
        powers = np.array([(1.0, s, s * s, s**3), (0.0, 1.0, 2 * s, 3 * s * s)])
        (roll, pitch), rates = (powers @ (_SPLINE @ control)).tolist()
        roll_rate, pitch_rate = (rate / self._slot for rate in rates)
        omega = np.array([roll_rate * math.cos(pitch), pitch_rate, -roll_rate * math.sin(pitch)])
        return np.array([roll, pitch, 0.0]), omega


def knee_room(qpos: np.ndarray, terrain: "Terrain") -> np.ndarray:
    """Return how far each knee is from the ground, less half a calf's thickness, ``(N, 4)``.

    Args:
        qpos: ``(N, 23)`` MuJoCo configurations.
        terrain: on which the robot stands.
    """
    places = knees(qpos)
    away = [[min(np.linalg.norm(k - r.nearest(k)) for r in terrain.regions) for k in four] for four in places]
    return np.array(away) - CALF_HALF_THICKNESS


def _angles(contacts: np.ndarray, by: str) -> tuple[float, float]:
    """Return roll and pitch at which the hips' heights above contacts ``(4, 3)`` are most alike.

    What counts is where the hips are, not where the contacts: with the legs drawn together at the foot of a
    ramp, the plane through the contacts is steeper than any ground under them.
    """
    if by == "nothing":
        return 0.0, 0.0
    places = _HIPS if by == "hips" else contacts[:, :2] - contacts[:, :2].mean(axis=0)
    (rise_x, rise_y), *_ = np.linalg.lstsq(places, contacts[:, 2] - contacts[:, 2].mean())
    return np.arcsin(rise_y / np.sqrt(1.0 + rise_x**2 + rise_y**2)), -np.arctan(rise_x)
