"""Chapter 11's exercises: right answers pass, plausible wrong ones are told what is wrong."""

import numpy as np
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import whole_body_ddp as check

LAST, BEFORE = -0.75, -0.75 / 1.75


def test_the_gains_of_a_cart():
    assert "-0.750 and -0.429" in check.foresees(LAST, BEFORE)


@pytest.mark.parametrize(
    ("last", "before", "message"),
    [
        (0.75, BEFORE, "drives the cart away"),
        (-3.0, BEFORE, "torque itself costs"),
        (LAST, LAST, "the last step's again"),
        (LAST, -0.79, "pays more"),
        (LAST, -(3 + 0.75**2) / (4 + 0.75**2), "is subtracted"),
        (-0.5, BEFORE, "last: .* pays more"),
        ("much", BEFORE, "not an array of numbers"),
    ],
)
def test_wrong_gains_of_a_cart(last, before, message):
    with pytest.raises(WrongAnswer, match=message):
        check.foresees(last, before)


def solve(Qu, Qsu, Quu):
    return -np.linalg.solve(Quu, Qu), -np.linalg.solve(Quu, Qsu.T)


def test_gains():
    assert "20 parabolas" in check.turns(solve)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda u, su, uu: (-u @ np.linalg.inv(uu), -su @ np.linalg.inv(uu)), "the printed order"),
        (lambda u, su, uu: (solve(u, su, uu)[0], -solve(u, su, uu)[1]), "Crocoddyl's"),
        (lambda u, su, uu: (-solve(u, su, uu)[0], solve(u, su, uu)[1]), "it climbs"),
        (lambda u, su, uu: (-u, -su.T), "the slope is still"),
        (lambda u, su, uu: (solve(u, su, uu)[0], -su.T), r"Q_uu K \+ Q_us is not zero"),
        (lambda u, su, uu: solve(u, su, uu)[0], "two things"),
        (lambda u, su, uu: (solve(u, su, uu)[1], solve(u, su, uu)[1]), "k has the shape"),
    ],
)
def test_wrong_gains(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.turns(wrong)


def before(Qs, Qu, Qss, Qsu, Quu, k, K):
    V_s = Qs + K.T @ Quu @ k + K.T @ Qu + Qsu @ k
    return V_s, Qss + K.T @ Quu @ K + Qsu @ K + K.T @ Qsu.T


def test_the_value_before():
    assert "with damping and without" in check.backs(before)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            lambda s, u, ss, su, uu, k, K: (s - K.T @ uu @ k, ss - K.T @ uu @ K),
            "V_s with damped gains: the printed formula",
        ),
        (
            lambda s, u, ss, su, uu, k, K: (before(s, u, ss, su, uu, k, K)[0], ss - K.T @ uu @ K),
            "V_ss with damped gains: the printed formula",
        ),
        (
            lambda s, u, ss, su, uu, k, K: (s + K.T @ uu @ k, ss + K.T @ uu @ K),
            "V_s with the gains of eq. 21",
        ),
        (lambda s, u, ss, su, uu, k, K: s, "two things"),
    ],
)
def test_wrong_values(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.backs(wrong)


def search(cost, tried, slope, curvature, share=0.1, steps=None):
    for step in 0.5 ** np.arange(11) if steps is None else steps:
        if tried(step) - cost <= share * (step * slope + 0.5 * curvature * step**2):
            return step
    return 0.0


def greedy(cost, tried, slope, curvature):
    return min(0.5 ** np.arange(11), key=lambda step: np.nan_to_num(tried(step), nan=np.inf))


def careless(cost, tried, slope, curvature):
    for step in 0.5 ** np.arange(11):
        if not tried(step) >= cost:
            return step
    return 0.0


def test_the_search():
    assert "wild, and hopeless" in check.searches(search)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda *a: search(*a, share=0.0), "less than a tenth"),
        (lambda *a: search(*a, share=0.9), "longest first|none was taken"),
        (lambda *a: search(*a, steps=[1.0]), "none was taken"),
        (lambda *a: search(*a, steps=[0.3, 0.1]), "none of 1, 1/2"),
        (lambda *a: 2.0**-10, "longest first"),
        (lambda *a: 1.0, "less than a tenth|no number"),
        (greedy, "longest first|less than a tenth"),
        (careless, "no number|less than a tenth"),
    ],
)
def test_wrong_searches(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.searches(wrong)


def smooth(share, within=0.7):
    t = min(share / within, 1.0)
    return 10 * t**3 - 15 * t**4 + 6 * t**5


def test_the_path():
    assert "no motor above" in check.reaches(smooth)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda t: 1.0, "motor .* at 0.00 s is asked for .* ask for less of a jump"),
        (lambda t: min(t / 0.5, 1.0), "is asked for"),
        (lambda t: smooth(t, 1.0), "mm from its goal, more than 6: be there earlier"),
        (lambda t: 0.9 * t, r"path\(1\) is 0.9"),
        (lambda t: 3.0 * t, "far off its way"),
        (lambda t: "there", "not an array"),
    ],
)
def test_wrong_paths(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.reaches(wrong)
