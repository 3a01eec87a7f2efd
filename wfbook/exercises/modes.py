"""Chapter 3's checks: counting rows, writing D, the least M, the centroid, and a leg over a gap."""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.leg_path import Ride, bank_and_deck, leg_path
from wfbook.modes import END_EFFECTORS, LEGS, broken_rules, contact_centroid, legal_rows

_EXACT = 1e-9


def count_of_rows(answer: Any, slots: int = 3, regions: int = 2) -> str:
    """Check how many pairs of rows of S and D one leg may have (Paper A, eqs 16, 17).

    Raises:
        WrongAnswer: another number; with what it would be the number of.
    """
    guess, kinds = number(answer, "the number of rows"), regions * len(END_EFFECTORS)
    start = np.zeros((regions, len(END_EFFECTORS)), int)
    start[0, 0] = 1
    truth = sum(1 for _ in legal_rows(slots, start))
    forgotten = {
        2 ** (slots * (1 + kinds)): "all zeros and ones, with neither eq. 16 nor eq. 17",
        (2 * kinds) ** slots: "eq. 17 alone: a leg that stands would change its end effector (eq. 16)",
        2**slots: "S alone: every swing also chooses where and on what it lands",
        kinds**slots: "D alone: a leg that swings may land as it stood, so S does not follow from D",
    }
    if guess != truth:
        hint = forgotten.get(guess)
        hint = f"{guess:g} counts {hint}" if hint else "count what a leg can do in one slot, from any state"
        raise WrongAnswer(f"{guess:g} rows: {hint}")
    return f"{truth} rows: in each slot stand on as before, or swing to one of {kinds}: (1 + {kinds})^{slots}"


def dynamics_rows(write: Callable[[np.ndarray, list[tuple[int, int]], np.ndarray], Any]) -> str:
    """Check a function that writes one leg's rows of D (Paper A, eqs 16, 17).

    Args:
        write: called with S ``(J,)``, one pair of region and end effector for each swing, and D before slot
            0, ``(R, E)``; returns D, ``(J, R, E)``.

    Raises:
        WrongAnswer: a slot breaks an equation, or the leg lands elsewhere.
    """
    rng = draws(3)
    for swings in ("0", "1", "01", "0100", "10010", "001101", "111", "000000"):
        S, regions = np.array([int(s) for s in swings]), int(rng.integers(1, 4))
        landings = [(int(rng.integers(regions)), int(rng.integers(2))) for _ in range(S.sum())]
        start = np.zeros((regions, len(END_EFFECTORS)), int)
        start[rng.integers(regions), rng.integers(2)] = 1
        D = array(called(write, S, landings, start, name="your function"), (len(S), *start.shape), "D")
        case = f"with S = {S.tolist()} and landings {landings}"
        broken = broken_rules(S[None], D[None], start[None])
        if broken:
            raise WrongAnswer(f"{case}, {broken[0]}")
        for j, (region, e) in zip(np.flatnonzero(S), landings, strict=True):
            if D[j, region, e] != 1:
                wanted = f"{END_EFFECTORS[e]} on region {region}"
                raise WrongAnswer(f"{case}, slot {j}: the leg swings, and D does not say {wanted}")
    return "D is legal, and the leg lands where it was told: eqs 16 and 17 left nothing else to write"


def least_m(find: Callable[[np.ndarray, float, np.ndarray, np.ndarray], Any]) -> str:
    """Check a function that finds the least M of ``D = 1 ⟹ a · p ≤ b`` (Paper A, eqs 18, 22).

    Args:
        find: called with a ``(n,)``, b, and the corners low and high ``(n,)`` of the box in which p is
            anyway; returns M of ``a · p ≤ b + M (1 − D)``.

    Raises:
        WrongAnswer: M cuts off a corner of the box at D = 0, or is larger than it must be.
    """
    rng = draws(1)
    for case in range(40):
        n = 1 + case % 3
        a, low = rng.normal(size=n), rng.normal(size=n)
        high = low + rng.uniform(0.1, 2.0, n)
        b = float(a @ rng.uniform(low - 1.0, high + 1.0))
        big = number(called(find, a, b, low, high, name="your function"), "M")
        corners = np.array(list(product(*zip(low, high, strict=True))))
        over = corners @ a - b
        worst = int(over.argmax())
        data = (
            f"a = {a.round(2).tolist()}, b = {b:.2f}, box {low.round(2).tolist()} to {high.round(2).tolist()}"
        )
        if big < over[worst] - _EXACT:
            at = corners[worst].round(2).tolist()
            raise WrongAnswer(
                f"{data}: at D = 0 your M = {big:.3f} forbids p = {at}, a real place for the leg"
            )
        if big > max(over[worst], 0.0) + _EXACT:
            raise WrongAnswer(
                f"{data}: M = {big:.3f} is {big - max(over[worst], 0.0):.3f} more than any corner needs"
            )
        if big < 0:
            raise WrongAnswer(
                f"{data}: M = {big:.3f}; below 0 it makes the row at D = ½ stricter than at D = 1"
            )
    return "nothing is cut off, and some corner of each box touches its row: no smaller M would do"


def centroid(find: Callable[[np.ndarray, np.ndarray], Any]) -> str:
    """Check a function that finds the centroid of the standing legs at one knot (Paper A, eqs 10–15).

    Args:
        find: called with p ``(L, 3)`` and one column of S, ``(L,)``; returns ``(3,)``.

    Raises:
        WrongAnswer: with the legs that swing.
    """
    rng = draws(2)
    for S in product((0, 1), repeat=len(LEGS)):
        column = np.array(S)
        if column.all():
            continue
        p = rng.normal(size=(len(LEGS), 3))
        case = f"while {' and '.join(np.array(LEGS)[column == 1]) or 'no leg'} swings"
        c = array(called(find, p.copy(), column.copy(), name="your function"), (3,), "c")
        moved = p + column[:, None] * np.array([0.3, -0.2, 0.1])
        again = array(called(find, moved, column.copy(), name="your function"), (3,), "c")
        if np.abs(again - c).max() > _EXACT:
            raise WrongAnswer(f"{case}, c moves when a leg in the air moves: eq. 11 says v = 0 for that one")
        if np.abs(c - p[column == 0].sum(axis=0) / len(LEGS)).max() < _EXACT and column.any():
            raise WrongAnswer(f"{case}, you divide by {len(LEGS)}; eq. 15 divides by how many legs stand")
        if np.abs(c - contact_centroid(p[None], column[:, None])[0]).max() > _EXACT:
            raise WrongAnswer(
                f"{case}, c = {c.round(3).tolist()} is not the mean of the standing legs' contacts"
            )
    return "the mean of those that stand, for every set of legs but all four, which has none"


def crossing(S: Any, D: Any) -> str:
    """Check rows that bring a leg from the bank over the gap, down the deck on its wheel, to stand on a foot.

    Args:
        S: ``(6,)``.
        D: ``(6, 3, 2)``.

    Raises:
        WrongAnswer: an equation is broken, or the task is not done; with the slot.
    """
    ride = Ride(bank_and_deck())
    S = array(S, (ride.slots,), "S")
    D = array(D, (ride.slots, *ride.start_dynamics.shape), "D")
    for name, values in (("S", S), ("D", D)):
        if not np.isin(values, (0, 1)).all():
            place = np.argwhere(~np.isin(values, (0, 1)))[0].tolist()
            raise WrongAnswer(f"{name}{place} is {values[tuple(place)]:g}, neither 0 nor 1")
    broken = broken_rules(S[None], D[None], ride.start_dynamics[None])
    broken = broken or leg_path(ride, S, D).broken
    if broken:
        raise WrongAnswer(str(broken[0]))
    rolls = int(((S == 0) & (D[:, :, 1].sum(axis=1) == 1)).sum())
    if S.sum() > 2:
        raise WrongAnswer(f"{int(S.sum())} swings, in slots {np.flatnonzero(S).tolist()}; two are enough")
    if rolls < 2:
        raise WrongAnswer(f"the leg rolls for {rolls} of 6 slots, not for two or more")
    if S[-1] or not D[-1, 2, 0]:
        now = "swings" if S[-1] else "stands on something else"
        raise WrongAnswer(
            f"slot {ride.slots - 1}: the leg {now}; at the end it stands on its foot on region 2"
        )
    return f"over the gap, {rolls} slots on the wheel, and to a stand, with {int(S.sum())} swings"
