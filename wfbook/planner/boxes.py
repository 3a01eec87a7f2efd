"""Boxes of gaits: which integers there are, and what follows from what.

A *box* is a pair of integer vectors, lower and upper, over all branching variables: ``S[l, j]``,
``wheel[l, j]``, two kinds of sums that cut far deeper than single binaries, ``C[l, j]``, the swings of
leg ``l`` up to slot ``j``, and ``T[j] = Σ_l C[l, j]``; and for regions the steps of a ladder,
``G[m, l, j]``, 1 if the contact is in a region behind step m when slot j ends. Regions are ordered from
back to front, so that one step of the ladder cuts the terrain in two.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wfbook.planner.gait import Gait
from wfbook.planner.problem import Problem


@dataclass(frozen=True)
class Layout:
    """Where the branching variables stand in a box's vectors.

    Attributes:
        S, wheel, C: index arrays of shape ``(L, J)``; ``wheel`` is empty without wheels.
        T: ``(J,)`` index array.
        G: ``(R−1, L, J)`` index array, empty on a single region.
        size: length of the vectors.
    """

    S: np.ndarray
    wheel: np.ndarray
    C: np.ndarray
    T: np.ndarray
    G: np.ndarray
    size: int

    @classmethod
    def of(cls, problem: Problem) -> "Layout":
        """Return the layout for a problem."""
        L, J, steps = problem.legs, problem.slots, problem.ground.count - 1
        n = L * J
        S = np.arange(n).reshape(L, J)
        wheel = n + S if problem.wheels else np.zeros((0, J), int)
        start = 2 * n if problem.wheels else n
        T = start + n + np.arange(J)
        G = start + n + J + np.arange(steps * n).reshape(steps, L, J)
        return cls(S, wheel, start + S, T, G, start + n + J + steps * n)


class Boxes:
    """Boxes of one problem."""

    def __init__(self, problem: Problem, reachable: np.ndarray):
        """Lay the branching variables out.

        Args:
            problem: what is asked.
            reachable: ``(R, L, J)`` whether a leg may be on a region when a slot ends.
        """
        self.problem, self.layout = problem, Layout.of(problem)
        self._members = np.array([[leg in p for p in problem.patterns] for leg in range(problem.legs)])
        ground = problem.ground
        self._reachable = reachable[ground.order]
        self._group = ground.group_of[ground.order]
        self._rank = np.argsort(ground.order)

    @cached_property
    def _root(self) -> tuple[np.ndarray, np.ndarray] | None:
        J, L, layout = self.problem.slots, self.problem.legs, self.layout
        lower, upper = np.zeros(layout.size, int), np.ones(layout.size, int)
        upper[layout.C] = np.arange(1, J + 1)
        upper[layout.T] = L * np.arange(1, J + 1)
        if self.problem.final_stance:
            upper[layout.S[:, -1]] = 0
        if self.problem.stance_between_swings:
            upper[layout.S[self.problem.start_state.swung, 0]] = 0
        if not self._reachable.any(axis=0).all() or not self.problem.start_in_reach:
            return None
        first = self._reachable.argmax(axis=0)
        last = len(self._reachable) - 1 - self._reachable[::-1].argmax(axis=0)
        steps = np.arange(1, len(self._reachable))[:, None, None]
        lower[layout.G] = steps <= first
        upper[layout.G] = steps <= last
        return self.propagate(lower, upper)

    def root(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the box of everything that is possible, propagated; None if nothing is."""
        return self._root and (self._root[0].copy(), self._root[1].copy())

    def propagate(self, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Tighten a box by what S, C, T, the patterns, the wheels and the regions imply of each other.

        Returns:
            The tightened box, or None if it is empty.
        """
        lower, upper = lower.copy(), upper.copy()
        layout = self.layout
        while True:
            before = lower.sum(), upper.sum()
            S_low, S_up = lower[layout.S], upper[layout.S]
            if not self._patterns(S_low, S_up):
                return None
            if self.problem.stance_between_swings:
                S_up[:, 1:] &= 1 - S_low[:, :-1]
                S_up[:, :-1] &= 1 - S_low[:, 1:]
            C_low, C_up = lower[layout.C], upper[layout.C]
            T_low, T_up = lower[layout.T], upper[layout.T]
            _narrow_sums(S_low, S_up, C_low, C_up)
            np.maximum(T_low, C_low.sum(axis=0), out=T_low)
            np.minimum(T_up, C_up.sum(axis=0), out=T_up)
            np.maximum(C_low, T_low - (C_up.sum(axis=0) - C_up), out=C_low)
            np.minimum(C_up, T_up - (C_low.sum(axis=0) - C_low), out=C_up)
            if self.problem.wheels and not self._wheels(lower, upper, S_low, S_up):
                return None
            if layout.G.size and not self._regions(lower, upper, S_low, S_up):
                return None
            lower[layout.S], upper[layout.S] = S_low, S_up
            lower[layout.C], upper[layout.C] = C_low, C_up
            lower[layout.T], upper[layout.T] = T_low, T_up
            if (lower > upper).any():
                return None
            if (lower.sum(), upper.sum()) == before:
                return lower, upper

    def _patterns(self, S_low: np.ndarray, S_up: np.ndarray) -> bool:
        """Keep each slot's legs within the admissible patterns; False if none fits."""
        members = self._members[:, None, :]
        fits = ((members >= S_low[..., None]) & (members <= S_up[..., None])).all(axis=0)
        if not fits.any(axis=1).all():
            return False
        S_low |= (members | ~fits).all(axis=2)
        S_up &= (members & fits).any(axis=2)
        return True

    def _wheels(self, lower: np.ndarray, upper: np.ndarray, S_low: np.ndarray, S_up: np.ndarray) -> bool:
        """Propagate eq. 16: without a swing a leg keeps its end effector."""
        layout = self.layout
        start = np.array([[int(e == "wheel")] for e in self.problem.start_end_effectors])
        low = np.hstack([start, lower[layout.wheel]])
        up = np.hstack([start, upper[layout.wheel]])
        low, up = _kept(low, up, S_up == 0)
        S_low |= (low[:, :-1] > up[:, 1:]) | (up[:, :-1] < low[:, 1:])
        if (low > up).any() or (self.problem.final_stance and low[:, -1].all()):
            return False
        lower[layout.wheel], upper[layout.wheel] = low[:, 1:], up[:, 1:]
        return True

    def _regions(self, lower: np.ndarray, upper: np.ndarray, S_low: np.ndarray, S_up: np.ndarray) -> bool:
        """Propagate the ladder: its steps fall; without a swing a foot stays and a wheel keeps its group."""
        layout, problem = self.layout, self.problem
        low, up = lower[layout.G], upper[layout.G]
        low[:] = np.maximum.accumulate(low[::-1], axis=0)[::-1]
        up[:] = np.minimum.accumulate(up, axis=0)
        start = self.ladder(problem.start_regions)[:, :, None]
        low, up = np.concatenate([start, low], axis=2), np.concatenate([start, up], axis=2)
        fixed = np.ones_like(S_up, bool)
        if problem.wheels and problem.ground.rolls_over_edges:
            fixed = upper[layout.wheel] == 0
        low, up = _kept(low, up, (S_up == 0) & fixed)
        moved = (low[..., :-1] > up[..., 1:]) | (up[..., :-1] < low[..., 1:])
        S_low |= moved.any(axis=0) & fixed
        if (low > up).any():
            return False
        # What is left of each ladder must hold a region in reach, and a rolling wheel's must share a group.
        first, last = low.sum(axis=0), up.sum(axis=0)
        known = first == last
        legs, slots = np.ogrid[: S_up.shape[0], : S_up.shape[1]]
        here, before = first[:, 1:], first[:, :-1]
        unreachable = ~self._reachable[here, legs, slots]
        torn = (S_up == 0) & known[:, :-1] & (self._group[here] != self._group[before])
        if (known[:, 1:] & (unreachable | torn)).any():
            return False
        lower[layout.G], upper[layout.G] = low[:, :, 1:], up[:, :, 1:]
        return True

    def nearest(self, lower: np.ndarray, upper: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the regions of a box that contacts are on, or nearest to.

        Args:
            lower: lower vector of the box.
            upper: its upper vector.
            points: ``(L, J, 2)`` contacts when slots end.

        Returns:
            ``(L, J)`` indices.
        """
        ground, G = self.problem.ground, self.layout.G
        first, last = lower[G].sum(axis=0), upper[G].sum(axis=0)
        outside = np.full((ground.count, *points.shape[:2]), np.inf)
        for m, r in enumerate(ground.order):
            A, b = ground.regions[r].halfspaces
            allowed = self._reachable[m] & (first <= m) & (m <= last)
            outside[m] = np.where(allowed, np.maximum((points @ A.T - b).max(axis=-1), 0.0), np.inf)
        return ground.order[outside.argmin(axis=0)]

    def ladder(self, region: np.ndarray) -> np.ndarray:
        """Return the steps of the ladder for region indices, ``(R−1, …)``."""
        steps = np.arange(1, len(self._rank)).reshape(-1, *[1] * np.ndim(region))
        return (steps <= self._rank[region]).astype(int)

    def gait(self, z: np.ndarray) -> Gait:
        """Return the gait of a vector."""
        z = np.rint(z).astype(int)
        S = z[self.layout.S]
        wheel = z[self.layout.wheel] if self.problem.wheels else np.zeros_like(S)
        return Gait(S, wheel, self.problem.ground.order[z[self.layout.G].sum(axis=0)])

    def vector(self, gait: Gait) -> np.ndarray:
        """Return the branching variables' values for a gait."""
        z = np.zeros(self.layout.size, int)
        z[self.layout.S] = gait.S
        if self.problem.wheels:
            z[self.layout.wheel] = gait.wheel
        z[self.layout.C] = np.cumsum(gait.S, axis=1)
        z[self.layout.T] = np.cumsum(gait.S.sum(axis=0))
        z[self.layout.G] = self.ladder(gait.region)
        return z

    def of_modes(self, gait: Gait) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the box of all gaits with the swings and wheels of one, propagated; None if it is empty."""
        root = self.root()
        if root is None:
            return None
        z = self.vector(gait._replace(region=np.zeros_like(gait.S)))
        modes = np.setdiff1d(np.arange(self.layout.size), self.layout.G.ravel())
        lower, upper = root
        if (z[modes] < lower[modes]).any() or (z[modes] > upper[modes]).any():
            return None
        lower[modes] = upper[modes] = z[modes]
        return self.propagate(lower, upper)

    def admissible(self, gait: Gait) -> bool:
        """Tell whether a gait satisfies all that concerns integers alone."""
        root, z = self.root(), self.vector(gait)
        return (
            root is not None
            and bool((root[0] <= z).all() and (z <= root[1]).all())
            and self.propagate(z, z) is not None
        )


def _kept(low: np.ndarray, up: np.ndarray, keeps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Narrow binaries that don't change over some slots, to what all entries of such a stretch allow.

    Args:
        low: ``(…, L, J+1)`` lower bounds, 0 or 1, before the first slot and after each.
        up: upper bounds, likewise.
        keeps: ``(L, J)`` whether nothing changes during a slot.
    """
    stretch = np.zeros((len(keeps), keeps.shape[1] + 1), int)
    np.cumsum(~keeps, axis=1, out=stretch[:, 1:])

    def most(values: np.ndarray) -> np.ndarray:
        # Twice the number of the stretch keeps a running maximum from leaving its stretch.
        ahead = np.maximum.accumulate(values + 2 * stretch, axis=-1) - 2 * stretch
        back = (ahead - 2 * stretch)[..., ::-1]
        return np.maximum.accumulate(back, axis=-1)[..., ::-1] + 2 * stretch

    return most(low), 1 - most(1 - up)


def _narrow_sums(S_low: np.ndarray, S_up: np.ndarray, C_low: np.ndarray, C_up: np.ndarray) -> None:
    """Propagate ``C[:, j] = C[:, j−1] + S[:, j]`` forward, backward and into S, in place."""
    least, most = np.cumsum(S_low, axis=1), np.cumsum(S_up, axis=1)
    # What the sum is above its least, and below its most, can only grow; both begin at zero.
    above = np.maximum.accumulate(np.maximum(C_low - least, 0), axis=1)
    below = np.maximum.accumulate(np.maximum(most - C_up, 0), axis=1)
    np.maximum(C_low, least + above, out=C_low)
    np.minimum(C_up, most - below, out=C_up)
    # Backward: a later sum less all swings that may come until then.
    np.maximum(C_low, most + np.maximum.accumulate((C_low - most)[:, ::-1], axis=1)[:, ::-1], out=C_low)
    np.minimum(C_up, least + np.minimum.accumulate((C_up - least)[:, ::-1], axis=1)[:, ::-1], out=C_up)
    before_low, before_up = np.zeros_like(C_low), np.zeros_like(C_up)
    before_low[:, 1:], before_up[:, 1:] = C_low[:, :-1], C_up[:, :-1]
    np.maximum(S_low, C_low - before_up, out=S_low)
    np.minimum(S_up, C_up - before_low, out=S_up)
