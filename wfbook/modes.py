"""Chapter 3: which leg swings when, and what touches the ground where (Paper A, eqs 10–17, 22, 23).

Two binary arrays say everything a plan decides. The *swing matrix* ``S[l, j]`` is 1 when leg ``l``
is in the air during slot ``j``. The *dynamics matrix* ``D[l, j, r, e]`` is 1 when leg ``l`` belongs
to region ``r`` with end effector ``e`` in slot ``j``; in a swing slot it already says how the leg
will land. A leg of a plan is legal when both of its rows obey eqs 16 and 17; what the rows then mean for
its motion is in :mod:`wfbook.leg_path`.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

LEGS = ("FL", "FR", "RL", "RR")
"""The order of legs in every array."""

END_EFFECTORS = ("foot", "wheel")
"""The order of end effectors in ``D[..., e]``."""

DIAGONAL_PATTERNS = ((), (0,), (1,), (2,), (3,), (0, 3), (1, 2))
"""Sets of legs that may swing together: none, one, or a diagonal pair.

Paper A does not say which sets it allows. Two legs of one side or one end leave no support line
under the centre of mass: such plans solve the relaxed program and fall (measured: a rear-pair swing
needs 4.5 N m that no force can give).
"""


def swing_patterns(most: int) -> tuple[tuple[int, ...], ...]:
    """Return all sets of legs that may swing together if no more than ``most`` do, the empty one first.

    Raises:
        ValueError: all legs would be in the air; no centroid is left then (Paper A, eq. 15).
    """
    if not 0 <= most < len(LEGS):
        raise ValueError(f"most: {most!r} is not a number of legs from 0 to {len(LEGS) - 1}")
    return tuple(legs for n in range(most + 1) for legs in combinations(range(len(LEGS)), n))


def end_effector_types(D: np.ndarray) -> np.ndarray:
    """Return which end effector each leg carries in each slot.

    Args:
        D: dynamics matrix, shape ``(L, J, R, E)``.

    Returns:
        ``(L, J)`` int8: 0 foot, 1 wheel. In a swing slot, the one the leg lands with.
    """
    return D.sum(axis=2).argmax(axis=2).astype(np.int8)


def lift_off_types(D: np.ndarray, start: Iterable[str]) -> np.ndarray:
    """Return which end effector each leg carried at the end of the slot before, ``(L, J)`` int8.

    Args:
        D: dynamics matrix, shape ``(L, J, R, E)``.
        start: the end effector of each leg before slot 0, names of :data:`END_EFFECTORS`.
    """
    first = np.array([[END_EFFECTORS.index(name)] for name in start], dtype=np.int8)
    return np.hstack([first, end_effector_types(D)[:, :-1]])


def dynamics_matrix(
    S: np.ndarray, wheel: np.ndarray, region: np.ndarray, start_regions: Iterable[int], regions: int
) -> np.ndarray:
    """Write D from what each leg carries and where it is (Paper A, eqs 16, 17).

    A wheel that rolls on to another region keeps the D of where it touched down: eq. 16 allows no change
    without a swing, and eq. 23 lets it roll on all the same.

    Args:
        S: swing matrix, ``(L, J)``.
        wheel: ``(L, J)`` 1 where a leg carries, or will land on, its wheel.
        region: ``(L, J)`` index of the region under the contact when the slot ends.
        start_regions: ``(L,)`` index of the region under each contact before slot 0.
        regions: how many regions there are.

    Returns:
        ``(L, J, R, E)`` int8.
    """
    D = np.zeros((*S.shape, regions, len(END_EFFECTORS)), np.int8)
    for leg, here in enumerate(start_regions):
        for j in range(S.shape[1]):
            if S[leg, j] or not wheel[leg, j]:
                here = region[leg, j]
            D[leg, j, here, int(wheel[leg, j])] = 1
    return D


def start_dynamics(start_regions: Iterable[int], start: Iterable[str], regions: int) -> np.ndarray:
    """Return D of the slot before slot 0, ``(L, R, E)`` int8: what eq. 16 compares the first slot with.

    Args:
        start_regions: ``(L,)`` index of the region under each contact.
        start: ``(L,)`` names of :data:`END_EFFECTORS`.
        regions: how many regions there are.
    """
    kinds = [END_EFFECTORS.index(name) for name in start]
    D = np.zeros((len(kinds), regions, len(END_EFFECTORS)), np.int8)
    D[np.arange(len(kinds)), list(start_regions), kinds] = 1
    return D


def swing_count(S: np.ndarray) -> np.ndarray:
    """Return which number of legs swings in each slot (Paper A, eqs 13, 14).

    Not as printed: the paper counts from one leg on, so that no s says that no leg swings. And that all do
    must be excluded, see :func:`contact_centroid`.

    Args:
        S: swing matrix, ``(L, J)``.

    Returns:
        ``(L + 1, J)`` int8, the paper's ``s`` with the row ``s_0`` that it lacks: row n is 1 where n legs
        swing, so that ``n · s = Σ_l S`` and each column sums to 1.

    Example:
        >>> from wfbook.modes import swing_count
        >>> swing_count(np.array([[1, 0], [0, 0], [0, 0], [1, 0]])).argmax(axis=0).tolist()
        [2, 0]
    """
    S = np.asarray(S)
    return (np.arange(len(S) + 1)[:, None] == S.sum(axis=0)).astype(np.int8)


def contact_centroid(p: np.ndarray, S: np.ndarray) -> np.ndarray:
    """Return the centroid of the contacts that stand (Paper A, eqs 10–12 and 15).

    Equations 10 and 11 are a product, ``v_l = (1 − S_l) p_l``; eq. 15 divides their sum by how many stand.

    Not as printed, eq. 15: ``n = N_l`` is excluded, for it divides by zero: no feet have no middle.

    Args:
        p: ``(K, L, 3)`` contact points at the knots after each interval, in the world.
        S: swing matrix, ``(L, J)``; K is a multiple of J.

    Returns:
        ``(K, 3)``.

    Raises:
        ValueError: in some slot all legs swing, n = N_l: eq. 15 would divide by zero.

    Example:
        >>> from wfbook.modes import contact_centroid
        >>> p = np.array([[[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]]])
        >>> contact_centroid(p, np.array([[1], [0], [0], [1]])).tolist()
        [[0.0, 0.0, 0.0]]
    """
    S = np.asarray(S)
    stands = np.repeat(1 - S.T, len(p) // S.shape[1], axis=0)
    count = stands.sum(axis=1)
    if not count.all():
        slot = int(np.flatnonzero(S.all(axis=0))[0])
        raise ValueError(f"S: all legs swing in slot {slot}, no contact has a centroid")
    return (stands[..., None] * p).sum(axis=1) / count[:, None]


def regions_allowed(D: np.ndarray, groups: Iterable[Iterable[int]]) -> np.ndarray:
    """Return which regions a standing leg may touch (Paper A, eqs 22, 23).

    Not as printed, eq. 22: the paper asks it at all times, but a leg in the air is over a gap. Here it holds
    where a leg stands and where it lands.

    Args:
        D: dynamics matrix, ``(L, J, R, E)``.
        groups: the paper's ζ: indices of the regions between which a wheel may roll.

    Returns:
        ``(L, J, R)`` bool: for a foot the region that D names, for a wheel all of that region's group.
    """
    foot, wheel = D[..., 0].astype(bool), D[..., 1].astype(bool)
    allowed = foot.copy()
    for group in groups:
        members = list(group)
        allowed[..., members] |= wheel[..., members].any(axis=-1, keepdims=True)
    return allowed


@dataclass(frozen=True)
class Broken:
    """A rule that S and D break.

    Attributes:
        rule: its name, as "eq. 16".
        leg: index, or None where the rule concerns all legs.
        slot: index.
        reason: in words.
    """

    rule: str
    leg: int | None
    slot: int
    reason: str

    def __str__(self) -> str:
        who = "" if self.leg is None else f"{LEGS[self.leg]}, "
        return f"{self.rule}: {who}slot {self.slot}: {self.reason}"


def broken_rules(S: np.ndarray, D: np.ndarray, start: np.ndarray) -> list[Broken]:
    """Check what S and D owe each other, whatever the motion (Paper A, eqs 16, 17; a mean for eq. 12).

    Not as printed, eq. 16: it holds in the first slot, too, against what the robot stands on when it starts,
    or a leg could begin with a wheel that it never put on.

    Not as printed, eq. 17: the second sum runs over an index that is not there; it is e.

    Args:
        S: swing matrix, ``(L, J)``, of 0 and 1.
        D: dynamics matrix, ``(L, J, R, E)``, likewise; L may be fewer legs than the robot has.
        start: D of the slot before slot 0, ``(L, R, E)`` (:func:`start_dynamics`).

    Returns:
        What is broken, slot by slot; empty if nothing is.
    """
    S, D, start = np.asarray(S), np.asarray(D), np.asarray(start)
    found = []
    for j in range(S.shape[1]):
        before = start if j == 0 else D[:, j - 1]
        for leg in range(len(S)):
            chosen = int(D[leg, j].sum())
            if chosen != 1:
                found.append(
                    Broken("eq. 17", leg, j, f"D has {chosen or 'no'} entries of 1, it must have exactly one")
                )
            if not S[leg, j] and not np.array_equal(D[leg, j], before[leg]):
                was, now = _entries(before[leg]), _entries(D[leg, j])
                found.append(Broken("eq. 16", leg, j, f"the leg stands, but D changes from {was} to {now}"))
        if len(S) == len(LEGS) and S[:, j].all():
            found.append(
                Broken("eq. 12", None, j, "all legs swing, the centroid has no contact to be the mean of")
            )
    return found


def legal_rows(slots: int, start: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield every pair of rows of S and D that one leg may have (Paper A, eqs 16, 17).

    Args:
        slots: J.
        start: ``(R, E)`` D of the leg before slot 0.

    Yields:
        S ``(J,)`` and D ``(J, R, E)``, int8.
    """
    if slots == 0:
        yield np.zeros(0, np.int8), np.zeros((0, *start.shape), np.int8)
        return
    for S, D in legal_rows(slots - 1, start):
        last = D[-1] if len(D) else start
        yield np.append(S, 0).astype(np.int8), np.concatenate([D, last[None]]).astype(np.int8)
        for r, e in np.ndindex(start.shape):
            landing = np.zeros_like(start)
            landing[r, e] = 1
            yield np.append(S, 1).astype(np.int8), np.concatenate([D, landing[None]]).astype(np.int8)


def _entries(D: np.ndarray) -> str:
    """Name the entries of 1 in a leg's D of one slot."""
    return " and ".join(f"{END_EFFECTORS[e]} on region {r}" for r, e in np.argwhere(D)) or "nothing"
