"""Chapter 3's checks: right answers pass, plausible wrong ones are told what they break."""

import numpy as np
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import modes as check


def test_the_right_count_passes():
    assert "125 rows" in check.count_of_rows(125)
    assert check.count_of_rows((1 + 2) ** 4, slots=4, regions=1)


@pytest.mark.parametrize(
    "answer, words",
    [
        (2**15, "neither eq. 16 nor eq. 17"),
        (8**3, r"eq. 17 alone"),
        (8, "S alone"),
        (64, "D alone"),
        (100, "in one slot"),
        ("many", "not an array of numbers"),
    ],
)
def test_a_wrong_count_is_told_what_it_counts(answer, words):
    with pytest.raises(WrongAnswer, match=words):
        check.count_of_rows(answer)


def written(S, landings, start):
    D, before, to_come = [], start, iter(landings)
    for swings in S:
        if swings:
            before = np.zeros_like(start)
            before[next(to_come)] = 1
        D.append(before)
    return np.array(D)


def one_slot_late(S, landings, start):
    return np.concatenate([start[None], written(S, landings, start)[:-1]])


def empty_in_the_air(S, landings, start):
    D = written(S, landings, start)
    D[S == 1] = 0
    return D


def starts_on_a_foot(S, landings, start):
    other = np.zeros_like(start)
    other[0, 0] = 1
    return written(S, landings, other)


def always_lands_on_the_wheel(S, landings, start):
    return written(S, [(r, 1) for r, _ in landings], start)


def test_rows_that_are_written_right_pass():
    assert "legal" in check.dynamics_rows(written)


@pytest.mark.parametrize(
    "write, words",
    [
        (one_slot_late, "slot 0: the leg swings, and D does not say|eq. 16"),
        (empty_in_the_air, r"eq. 17: FL, slot \d: D has no entries"),
        (starts_on_a_foot, "eq. 16: FL, slot 0"),
        (always_lands_on_the_wheel, "D does not say foot on region"),
        (lambda S, landings, start: start, "shape"),
    ],
)
def test_rows_that_are_written_wrong_are_told_the_slot(write, words):
    with pytest.raises(WrongAnswer, match=words):
        check.dynamics_rows(write)


def least(a, b, low, high):
    return max(0.0, np.maximum(a * low, a * high).sum() - b)


def test_the_least_m_passes():
    assert "no smaller M" in check.least_m(least)


@pytest.mark.parametrize(
    "find, words",
    [
        (lambda a, b, low, high: 10.0, "more than any corner needs"),
        (lambda a, b, low, high: max(0.0, a @ high - b), r"forbids p = \[.*\], a real place"),
        (lambda a, b, low, high: np.maximum(a * low, a * high).sum() - b, "below 0"),
        (lambda a, b, low, high: max(0.0, np.abs(a) @ np.maximum(abs(low), abs(high)) - b), "more than any"),
        (lambda a, b, low, high: 0.0, "forbids p"),
    ],
)
def test_another_m_is_told_which_corner_it_forbids_or_wastes(find, words):
    with pytest.raises(WrongAnswer, match=words):
        check.least_m(find)


def test_the_mean_of_those_that_stand_passes():
    assert check.centroid(lambda p, S: ((1 - S)[:, None] * p).sum(axis=0) / (4 - S.sum()))


@pytest.mark.parametrize(
    "find, words",
    [
        (lambda p, S: p.mean(axis=0), "moves when a leg in the air moves"),
        (lambda p, S: ((1 - S)[:, None] * p).sum(axis=0) / 4, "divide by 4"),
        (lambda p, S: (S[:, None] * p).sum(axis=0), "moves when a leg in the air|not the mean"),
        (lambda p, S: ((1 - S)[:, None] * p).sum(axis=0) / max(S.sum(), 1), "not the mean"),
    ],
)
def test_another_mean_is_told_which_legs_swing(find, words):
    with pytest.raises(WrongAnswer, match=rf"while .* swings.*({words})"):
        check.centroid(find)


def rows(swings: str, modes: str):
    D = np.zeros((6, 3, 2), int)
    for j, mode in enumerate(modes.split()):
        D[j, int(mode[1]), "fw".index(mode[0])] = 1
    return [int(s) for s in swings], D


@pytest.mark.parametrize("answer", [("010010", "f0 w1 w1 w1 f2 f2"), ("100010", "w1 w1 w1 w1 f2 f2")])
def test_a_crossing_passes(answer):
    assert "2 swings" in check.crossing(*rows(*answer))


@pytest.mark.parametrize(
    "answer, words",
    [
        (("010000", "f0 w1 w1 w1 f2 f2"), "eq. 16: FL, slot 4"),
        (("010010", "f0 w1 w1 w1 w2 w2"), "slot 5: the leg stands on something else"),
        (("010001", "f0 w1 w1 w1 w1 f2"), "slot 5: the leg swings"),
        (("010101", "f0 f1 f1 f1 f1 f2"), "3 swings, in slots"),
        (("010010", "f0 f1 f1 f1 f2 f2"), r"step limit: FL, slot 1"),
        (("100010", "w0 w0 w0 w0 f2 f2"), "eq. 23: FL, slot"),
    ],
)
def test_another_crossing_is_told_the_slot(answer, words):
    with pytest.raises(WrongAnswer, match=words):
        check.crossing(*rows(*answer))


def test_halves_are_refused():
    S, D = rows("010010", "f0 w1 w1 w1 f2 f2")
    D = D.astype(float)
    D[2, 1, 1] = 0.5
    with pytest.raises(WrongAnswer, match=r"D\[2, 1, 1\] is 0.5, neither 0 nor 1"):
        check.crossing(S, D)
