"""Boxes of gaits: which integers there are, and what follows from what.

A *box* is a pair of integer vectors, lower and upper, over all branching variables: ``S[l, j]``,
``wheel[l, j]`` and two kinds of sums that cut far deeper than single binaries: ``C[l, j]``, the swings of
leg ``l`` up to slot ``j``, and ``T[j] = Σ_l C[l, j]``.
"""

from dataclasses import dataclass

import numpy as np

from wfbook.planner.problem import Problem


@dataclass(frozen=True)
class Layout:
    """Where the branching variables stand in a box's vectors.

    Attributes:
        S, wheel, C: index arrays of shape ``(L, J)``; ``wheel`` is empty without wheels.
        T: ``(J,)`` index array.
        size: length of the vectors.
    """

    S: np.ndarray
    wheel: np.ndarray
    C: np.ndarray
    T: np.ndarray
    size: int

    @classmethod
    def of(cls, problem: Problem) -> "Layout":
        """Return the layout for a problem."""
        L, J = problem.legs, problem.slots
        n = L * J
        S = np.arange(n).reshape(L, J)
        wheel = n + S if problem.wheels else np.zeros((0, J), int)
        start = 2 * n if problem.wheels else n
        return cls(S, wheel, start + S, start + n + np.arange(J), start + n + J)


class Boxes:
    """Boxes of one problem."""

    def __init__(self, problem: Problem):
        """Lay the branching variables out.

        Args:
            problem: what is asked.
        """
        self.problem, self.layout = problem, Layout.of(problem)
        self._members = np.array([[leg in p for p in problem.patterns] for leg in range(problem.legs)])

    def root(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the box of everything that is possible, propagated; None if nothing is."""
        J, L, layout = self.problem.slots, self.problem.legs, self.layout
        lower, upper = np.zeros(layout.size, int), np.ones(layout.size, int)
        upper[layout.C] = np.arange(1, J + 1)
        upper[layout.T] = L * np.arange(1, J + 1)
        if self.problem.final_stance:
            upper[layout.S[:, -1]] = 0
        if self.problem.stance_between_swings:
            upper[layout.S[self.problem.start_state.swung, 0]] = 0
        return self.propagate(lower, upper)

    def propagate(self, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Tighten a box by what S, C, T, the patterns and the wheels imply of each other.

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
        for j in range(self.problem.slots):
            keeps = S_up[:, j] == 0
            for at, other in ((j + 1, j), (j, j + 1)):
                low[keeps, at] = np.maximum(low[keeps, at], low[keeps, other])
                up[keeps, at] = np.minimum(up[keeps, at], up[keeps, other])
            changes = (low[:, j] > up[:, j + 1]) | (up[:, j] < low[:, j + 1])
            S_low[changes, j] = 1
        if (low > up).any() or (self.problem.final_stance and low[:, -1].all()):
            return False
        lower[layout.wheel], upper[layout.wheel] = low[:, 1:], up[:, 1:]
        return True

    def gait(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return swing matrix and wheel's dynamics matrix, ``(L, J)`` integers, of a vector."""
        S = np.rint(z[self.layout.S]).astype(int)
        return S, np.rint(z[self.layout.wheel]).astype(int) if self.problem.wheels else np.zeros_like(S)

    def vector(self, S: np.ndarray, wheel: np.ndarray) -> np.ndarray:
        """Return the branching variables' values for a gait."""
        z = np.zeros(self.layout.size, int)
        z[self.layout.S] = S
        if self.problem.wheels:
            z[self.layout.wheel] = wheel
        z[self.layout.C] = np.cumsum(S, axis=1)
        z[self.layout.T] = np.cumsum(S.sum(axis=0))
        return z

    def admissible(self, S: np.ndarray, wheel: np.ndarray) -> bool:
        """Tell whether a gait satisfies all that concerns integers alone."""
        root = self.root()
        z = self.vector(S, wheel)
        return (
            root is not None
            and bool((root[0] <= z).all() and (z <= root[1]).all())
            and self.propagate(z, z) is not None
        )


def _narrow_sums(S_low: np.ndarray, S_up: np.ndarray, C_low: np.ndarray, C_up: np.ndarray) -> None:
    """Propagate ``C[:, j] = C[:, j−1] + S[:, j]`` forward, backward and into S, in place."""
    J = S_low.shape[1]
    zero = np.zeros(len(S_low), int)
    for j in range(J):
        low, up = (C_low[:, j - 1], C_up[:, j - 1]) if j else (zero, zero)
        np.maximum(C_low[:, j], low + S_low[:, j], out=C_low[:, j])
        np.minimum(C_up[:, j], up + S_up[:, j], out=C_up[:, j])
    for j in range(J - 1, -1, -1):
        low, up = (C_low[:, j - 1], C_up[:, j - 1]) if j else (zero, zero)
        np.maximum(S_low[:, j], C_low[:, j] - up, out=S_low[:, j])
        np.minimum(S_up[:, j], C_up[:, j] - low, out=S_up[:, j])
        if j:
            np.maximum(C_low[:, j - 1], C_low[:, j] - S_up[:, j], out=C_low[:, j - 1])
            np.minimum(C_up[:, j - 1], C_up[:, j] - S_low[:, j], out=C_up[:, j - 1])


def gait_key(S: np.ndarray, wheel: np.ndarray) -> bytes:
    """Return a key for a gait."""
    return np.concatenate([np.ravel(S), np.ravel(wheel)]).astype(np.int8).tobytes()
