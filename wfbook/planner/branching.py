"""Where to split a box of gaits: on the variable that lifts the bounds of both parts most.

Pseudo-costs remember by how much each variable lifted a bound before; a few candidates are tried out.
"""

import numpy as np

from wfbook.planner.conic import Solution
from wfbook.planner.kernel import INTEGRAL, Kernel

_STRONG = 5  # candidates whose children are solved before one is chosen
_RELIABLE = 1  # after so many observations a pseudo-cost is believed


class Branching:
    """Splits the boxes of one search, and learns from it."""

    def __init__(self, kernel: Kernel):
        """Begin without experience.

        Args:
            kernel: bounds the parts.
        """
        self.kernel = kernel
        # Sum of relative gains, and how many were seen, for each variable down and up.
        self._gain = np.zeros((2, kernel.boxes.layout.size))
        self._seen = np.zeros((2, kernel.boxes.layout.size))

    def split(
        self, lower: np.ndarray, upper: np.ndarray, solution: Solution, cutoff: float
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Split a box in two (or in fewer, where a part is empty), on the variable that lifts the bound most.

        Args:
            lower: lower vector of the box, propagated and not a single point.
            upper: its upper vector.
            solution: of its relaxation.
            cutoff: value above which nothing is of interest.

        Returns:
            Propagated boxes that together hold every gait of the box that is of interest.
        """
        z = solution.y if solution.status == "solved" else 0.5 * (lower + upper)
        open_ = np.flatnonzero(lower < upper)
        fraction = np.abs(z[open_] - np.rint(z[open_]))
        fractional = open_[fraction > INTEGRAL]
        candidates = fractional if len(fractional) else open_
        # What a leg carries in the end decides more than what it carries on the way.
        on_the_way = np.isin(candidates, self.kernel.boxes.layout.wheel[:, :-1])
        if not on_the_way.all():
            candidates = candidates[~on_the_way]
        score = self._score(candidates, z)
        order = candidates[np.argsort(-score, kind="stable")]
        best_children, best_gain = [], -1.0
        for tried, index in enumerate(order[: 3 * _STRONG]):
            reliable = self._seen[:, index].min() >= _RELIABLE
            if tried >= _STRONG or (reliable and tried >= 2):
                break
            children = self._children(lower, upper, index, z[index])
            self.kernel.bound_both(children, cutoff)
            gains = [
                self._observe(child, index, side, solution, cutoff) for side, child in enumerate(children)
            ]
            alive = [child for child, gain in zip(children, gains, strict=True) if np.isfinite(gain)]
            if len(alive) < 2:
                return alive
            gain = max(gains[0], 1e-6) * max(gains[1], 1e-6)
            if gain > best_gain:
                best_children, best_gain = alive, gain
        return best_children

    def _score(self, candidates: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Rank candidates by pseudo-costs, unseen ones by the mean, then by fractionality."""
        seen = np.maximum(self._seen, 1)
        rate = self._gain / seen
        mean = self._gain.sum() / max(self._seen.sum(), 1)
        rate = np.where(self._seen > 0, rate, mean if mean > 0 else 1.0)[:, candidates]
        down = z[candidates] - np.floor(z[candidates] - INTEGRAL)
        down = np.clip(down, 0.05, 1.0)
        up = np.clip(1.0 - down, 0.05, 1.0)
        return np.maximum(rate[0] * down, 1e-9) * np.maximum(rate[1] * up, 1e-9)

    def _children(self, lower: np.ndarray, upper: np.ndarray, index: int, value: float) -> list:
        """Return the two parts of a box below and above a value, propagated; None where empty."""
        floor = int(np.floor(value + INTEGRAL))
        if abs(value - np.rint(value)) <= INTEGRAL:
            # An integral value: keep it in the part that leaves the other as large as possible.
            floor = int(np.rint(value)) - (1 if np.rint(value) > lower[index] else 0)
        floor = min(max(floor, lower[index]), upper[index] - 1)
        below, above = upper.copy(), lower.copy()
        below[index], above[index] = floor, floor + 1
        return [self.kernel.boxes.propagate(lower, below), self.kernel.boxes.propagate(above, upper)]

    def _observe(self, child, index: int, side: int, solution: Solution, cutoff: float) -> float:
        """Bound a child and learn from it; infinite where nothing of interest is left."""
        if child is None:
            return np.inf
        found = self.kernel.bound(*child, cutoff)
        if found.bound >= cutoff:
            self.kernel.pruned = min(self.kernel.pruned, found.bound)
            return np.inf
        if found.status != "solved":
            return 0.0
        value = solution.y[index]
        distance = value - np.floor(value) if side == 0 else np.ceil(value) - value
        gain = max(found.bound - solution.bound, 0.0)
        if distance > INTEGRAL:
            self._gain[side, index] += gain / distance
            self._seen[side, index] += 1
        return gain
