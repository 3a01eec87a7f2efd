"""Chapter 4's exercises: right answers pass, plausible wrong ones are told what is wrong."""

import numpy as np
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import friction as check


def test_the_angles():
    assert "19.3°" in check.holds(19.3, 0, 19.29)


@pytest.mark.parametrize(
    ("angles", "message"),
    [
        ((20.5, 0, 20.5), "feet: 20.5.*tangent"),
        ((0.337, 0, 19.3), "degrees, not radians"),
        ((19.3, 19.3, 19.3), "wheels_down: .*no force along t"),
        ((19.3, 0, 0), "wheels_across: .*grips like a foot"),
    ],
)
def test_wrong_angles(angles, message):
    with pytest.raises(WrongAnswer, match=message):
        check.holds(*angles)


def inside(
    force, region, kind, axes=("normal", "tangent", "binormal"), swap=False, foot_only=False, pulls=False
):
    n, t, b = (getattr(region, axis) @ force for axis in axes)
    mu_t, mu_b = region.mu_foot, region.mu_foot
    if kind == "wheel" and not foot_only:
        mu_t, mu_b = region.mu_wheel, region.mu_wheel_lateral
    if swap:
        mu_t, mu_b = mu_b, mu_t
    n = abs(n) if pulls else n
    return bool(n >= 0 and abs(t) <= mu_t * n and abs(b) <= mu_b * n)


def test_inside():
    assert "400 random forces" in check.admits(inside)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda f, r, k: inside(f, r, k, swap=True), "a wheel on a slope .*"),
        (
            lambda f, r, k: inside(f, r, k, foot_only=True),
            "a wheel on a slope of .* admitted, but .t. is more than 0.1",
        ),
        (lambda f, r, k: inside(f, r, k, pulls=True), "it pulls at the ground"),
        (
            lambda f, r, k: bool(f[2] >= 0 and np.hypot(f[0], f[1]) <= r.mu_foot * f[2]),
            "a (foot|wheel) on a slope",
        ),
        (lambda f, r, k: inside(f, r, k) * 1.0, "not True or False"),
        (lambda f, r, k: True, "admitted, but"),
        (lambda f, r, k: False, "refused, but it breaks no side"),
    ],
)
def test_wrong_insides(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.admits(wrong)


def test_resistance():
    assert "opposes rolling" in check.resists(lambda n, c, v: -c * n * np.sign(v))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda n, c, v: c * n, "drives the wheel"),
        (lambda n, c, v: -c * n, "-1 m/s: the force .* drives the wheel"),
        (lambda n, c, v: -c * n * v, "however fast it rolls"),
        (lambda n, c, v: -c * np.sign(v), "n = 0 N.*0 N"),
        (lambda n, c, v: -c * n * (1 if v >= 0 else -1), "at rest on level ground"),
    ],
)
def test_wrong_resistances(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.resists(wrong)


def test_the_front_feet_are_the_brake():
    assert "FL and FR" in check.brakes(["FR", "FL"]) or "FR and FL" in check.brakes(["FR", "FL"])


@pytest.mark.parametrize(
    ("legs", "message"),
    [
        (["RL", "RR"], "with RL and RR on foot the robot moves"),
        (["FL"], "with FL on foot the robot moves"),
        (["FL", "FR", "RL"], "would without RL"),
        ([], "with no leg on foot"),
        ("FL", "not a list of different legs"),
        (["FL", "FL"], "not a list of different legs"),
    ],
)
def test_wrong_brakes(legs, message):
    with pytest.raises(WrongAnswer, match=message):
        check.brakes(legs)


def pyramid(mu, sides, reach=None, turned=0.0):
    angle = 2 * np.pi * np.arange(sides) / sides + turned
    reach = np.cos(np.pi / sides) * mu if reach is None else reach(mu)
    return np.column_stack([np.full(sides, -reach), np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("turned", [0.0, 0.3])
def test_a_safe_pyramid(turned):
    assert "never promises" in check.safe(lambda mu, sides: pyramid(mu, sides, turned=turned))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda mu, sides: pyramid(mu, sides, lambda m: m), "it admits t = .* 1.41 times"),
        (lambda mu, sides: pyramid(mu, sides, lambda m: m / np.sqrt(2)), "8 sides: at .* it ends at"),
        (lambda mu, sides: -pyramid(mu, sides), "refuses a force straight along n"),
        (lambda mu, sides: pyramid(mu, sides)[: sides // 2], "shape"),
        (lambda mu, sides: np.vstack([pyramid(mu, sides)[:-1], [[-1.0, 0.0, 0.0]]]), "it admits"),
    ],
)
def test_wrong_pyramids(wrong, message):
    with pytest.raises(WrongAnswer, match=message):
        check.safe(wrong)
