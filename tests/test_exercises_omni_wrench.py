"""Chapter 10's exercises: right answers pass, plausible wrong ones are told what is wrong."""

import numpy as np
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import omni_wrench as check
from wfbook.omni.wrench import decoupled

WEIGHT = 38.0 * 9.81


def test_the_push():
    assert "174 N" in check.tips(WEIGHT * 0.21 / 0.45)


@pytest.mark.parametrize(
    ("push", "message"),
    [
        (WEIGHT * 0.19 / 0.45, "touches in a point"),
        (WEIGHT * 0.38 / 0.45, "half of the track"),
        (WEIGHT * 0.8, "slide"),
        (38.0 * 0.21 / 0.45, "in newtons"),
        (120.0, "all wheels still press"),
        (250.0, "wheels have lifted before"),
        ("far", "not an array of numbers"),
    ],
)
def test_wrong_pushes(push, message):
    with pytest.raises(WrongAnswer, match=message):
        check.tips(push)


def inside(wrench, mu, width, forget=""):
    fx, fy, fz, tx, ty, tz = wrench
    a = width / 2 if forget != "half" else width
    press = np.array([fz + tx / a, fz - tx / a]) / 2
    side = -1.0 if forget == "sign" else 1.0
    along = np.array([fx - side * tz / a, fx + side * tz / a]) / 2
    good = [
        (np.abs(along) <= mu * np.abs(press) + 1e-9).all(),
        forget == "across" or abs(fy) <= mu * fz + 1e-9,
        forget == "lift" or (press >= -1e-9).all(),
        forget == "axle" or abs(ty) < 1e-9,
    ]
    return bool(all(good))


def test_inside():
    assert "400 wrenches" in check.admits(inside)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda f, m, w: inside(f, m, w, "half"), "refused|admitted"),
        (lambda f, m, w: inside(f, m, w, "sign"), "refused, but both ends|admitted, but it breaks"),
        (lambda f, m, w: inside(f, m, w, "across"), "admitted, but it breaks −?fy ≤ μ fz"),
        (lambda f, m, w: inside(f, m, w, "axle"), "admitted, but it breaks τy ≤ 0"),
        (
            lambda f, m, w: bool(decoupled(m, (w / 2, 0.0, m * w / 2)).admits(f)),
            "admitted, but it breaks .* end: .*not together with the forces",
        ),
        (lambda f, m, w: False, "refused, but both ends press"),
        (lambda f, m, w: 1.0, "not True or False"),
    ],
)
def test_wrong_insides(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.admits(wrong)


def alpha(A, b, f):
    over = np.maximum(A @ f - b, 0.0)
    return 0.5 * over @ over, A.T @ over


def test_the_penalty():
    assert "a gradient to go back by" in check.charges(alpha)


def whole(A, b, f):
    r = A @ f - b
    return (0.5 * r @ r, A.T @ r) if (r > 0).any() else (0.0, np.zeros(6))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (whole, "rows that hold are charged, too"),
        (lambda A, b, f: (2 * alpha(A, b, f)[0], alpha(A, b, f)[1]), "half of the sum of their squares"),
        (lambda A, b, f: (alpha(A, b, f)[0], np.maximum(A @ f - b, 0.0)[:6]), "slope along component"),
        (lambda A, b, f: (alpha(A, b, f)[0], -alpha(A, b, f)[1]), "slope along component"),
        (lambda A, b, f: (0.5 * np.sum((A @ f - b) ** 2), A.T @ (A @ f - b)), "inside of the cone costs"),
        (lambda A, b, f: alpha(A, b, f)[0], "two things"),
    ],
)
def test_wrong_penalties(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.charges(wrong)


def point(forces, places):
    total, moment = forces.sum(axis=0), np.cross(places, forces).sum(axis=0)
    return np.array([-moment[1], moment[0]]) / total[2]


def test_the_point():
    assert "no horizontal moment" in check.finds(point)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda f, p: f[:, 2] @ p[:, :2] / f[:, 2].sum(), "weighted by the normal forces"),
        (lambda f, p: -point(f, p), "about your point the moment is"),
        (lambda f, p: p[:, :2].mean(axis=0), "about your point the moment is"),
        (lambda f, p: np.append(point(f, p), 0.0), "shape"),
    ],
)
def test_wrong_points(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.finds(wrong)


def lowest():
    return next(height for height in np.arange(0.05, 1.2, 0.005) if check._held(height))


def test_the_hand():
    assert "Right: from" in check.leans(lowest())


@pytest.mark.parametrize(
    ("shift", "message"),
    [(-0.1, "no forces in the cones balance"), (0.1, "a little lower"), (5.0, "not where the arm reaches")],
)
def test_wrong_hands(shift, message):
    with pytest.raises(WrongAnswer, match=message):
        check.leans(lowest() + shift)
