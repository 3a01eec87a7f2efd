"""Where the centre of mass can be in any plan worth finding: bounds tightened by an incumbent.

Once a plan of some cost is known, only cheaper ones matter, and those keep near their way: the goal's
term alone says where they end. The node QP is asked how far each quantity may go before its bound
exceeds the incumbent. Narrower boxes make McCormick's inequalities and the hulls of regions tighter, and
put regions out of reach.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

_TOLERANCE = 5e-5
"""Of the cost: what the node QP's rough solver may be wrong by; divided by the multiplier, in metres."""

PROBES = 2
"""How many multipliers are tried for each bound."""


@dataclass(frozen=True)
class MotionBounds:
    """Ranges of the centre of mass; first index 0 for the lower end, 1 for the upper.

    Attributes:
        place: ``(2, 2, J)`` of x and y (second index) when each slot ends.
        travel: ``(2, J)`` of the way along x within each slot.
        drift: ``(2, J)`` of the mean over a slot's knots of x, from where the slot begins.
    """

    place: np.ndarray
    travel: np.ndarray
    drift: np.ndarray

    @classmethod
    def of(cls, problem: Any) -> "MotionBounds":
        """Return what the speed limits allow."""
        limits, rho, J = problem.limits, problem.knots_per_slot, problem.slots
        forward, backward = limits.speed
        speeds = np.array([[-backward, -limits.lateral_speed], [forward, limits.lateral_speed]])
        t = problem.slot_duration * np.arange(1, J + 1)
        place = np.asarray(problem.start, float)[None, :, None] + speeds[:, :, None] * t
        age = problem.dt * np.arange(1, rho + 1).mean()
        travel = np.repeat(speeds[:, :1] * problem.slot_duration, J, axis=1)
        return cls(place, travel, np.repeat(speeds[:, :1] * age, J, axis=1))


def tightened(
    bounds: MotionBounds,
    quantities: dict[str, np.ndarray],
    least_of: Callable[[list[np.ndarray]], list[float]],
    stop: Callable[[], bool],
) -> MotionBounds:
    """Narrow ranges to what plans cheaper than a cutoff can have.

    Args:
        bounds: to begin with.
        quantities: by name of a field, rows ``(J, n)`` of linear functions of the QP's variables (for
            ``place`` those of x).
        least_of: lower bounds of such functions over all those plans, as :func:`least` finds them.
        stop: asked now and then; once true, the rest stays as it is.
    """
    changed = {}
    for name, rows in quantities.items():
        ranges = getattr(bounds, name).copy()
        view = ranges[:, 0] if name == "place" else ranges
        for j, row in enumerate(rows):
            if stop():
                break
            low, high = least_of([row, -row])
            view[0, j], view[1, j] = max(view[0, j], low), min(view[1, j], -high)
        changed[name] = ranges
    return replace(bounds, **changed)


def least(
    row: np.ndarray, minimise: Callable[[np.ndarray], tuple[float, float]], base: float, cutoff: float
) -> float:
    """Return a lower bound of a linear function over all points of cost below a cutoff.

    For any multiplier μ > 0 and a linear quantity ℓ, ``min (cost + μ ℓ) = q`` implies ``ℓ ≥ (q − U)/μ`` on
    every plan that costs at most U. The best μ is where the minimiser costs just U.

    Args:
        row: coefficients of the function.
        minimise: adds a linear cost to the QP; returns a lower bound of its optimum and the minimiser's
            value of that linear cost.
        base: lower bound of the QP's optimum.
        cutoff: U.
    """
    best, multiplier = -np.inf, max(cutoff - base, 1e-6) / 0.1
    for _ in range(PROBES):
        value, part = minimise(multiplier * row)
        if not np.isfinite(value):
            break
        best = max(best, (value - _TOLERANCE * (1.0 + abs(value)) - cutoff) / multiplier)
        spent = value - part - base  # what the minimiser pays for going there
        if spent <= 1e-9:
            multiplier *= 4.0
        else:
            multiplier *= float(np.clip(np.sqrt((cutoff - base) / spent), 0.1, 10.0))
    return best
