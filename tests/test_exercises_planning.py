"""Chapter 5's checks: right answers pass, wrong ones are told what is wrong with them."""

from dataclasses import replace

import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import planning as check
from wfbook.planner import Weights


def left(bounds, incumbent, gap):
    return bounds < incumbent * (1 - gap), min(incumbent, bounds.min())


def test_who_is_to_blame():
    assert "gap 0.35 m exceeds the 0.30 m step" in check.conflict({"goal", "regions", "step"})


@pytest.mark.parametrize(
    ("blamed", "message"),
    [
        ({"regions", "step"}, "1 of the 3 are missing: a robot that may stay where it is has a plan"),
        ({"goal", "regions", "step", "friction"}, "friction: without it there would still be no plan"),
        (["speed"], "speed: without it"),
        ({"wheels"}, "wheels: none of force, friction"),
        ("step", "not a set of names"),
    ],
)
def test_wrong_blame(blamed, message):
    with pytest.raises(WrongAnswer, match=message):
        check.conflict(blamed)


def test_what_is_left():
    assert check.what_is_left(left).startswith("Right")


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda b, i, g: (b < i, min(i, b.min())), "node .* would narrow the gap further; drop it"),
        (lambda b, i, g: (b < 0.8 * i, min(i, b.min())), "node .* may be in it; keep it"),
        (lambda b, i, g: (b < i * (1 - g), b.max()), "is not proven"),
        (lambda b, i, g: (b < i * (1 - g), 0.0), "more than 0.0000 is proven"),
        (lambda b, i, g: (b < i * (1 - g), i), "what is proven is inf"),
        (lambda b, i, g: b < i * (1 - g), "returns two things"),
        (lambda b, i, g: (True, 0.0), "which nodes are left has the shape"),
    ],
)
def test_wrong_bookkeeping(function, message):
    with pytest.raises(WrongAnswer, match=message):
        check.what_is_left(function)


def test_swings_that_cost_more_leave_the_wheels_in_the_air():
    assert "makes 0 swings" in check.without_wheels("swing")


@pytest.mark.parametrize("weight", ["goal", "height", "angle"])
def test_a_weight_that_leaves_the_wheels_names_leg_and_slot(weight):
    with pytest.raises(WrongAnswer, match=rf"with {weight} × 30 leg \w\w is on its wheel in slot \d"):
        check.without_wheels(weight)


def test_a_weight_that_is_none():
    with pytest.raises(WrongAnswer, match="'wheels' is no weight; there are goal"):
        check.without_wheels("wheels")


def test_weights_that_lie_less():
    weights = replace(Weights(), centroid=30.0, bounds=0.05)
    assert check.honest_weights(weights).startswith("Right")


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (Weights(), r"N m rms are missing in pitch, more than 2.5; most of it at knot \d+, in slot \d"),
        (replace(Weights(), acceleration=1.0), r"the robot gets 0\.\d+ m far, less than 0.25 m"),
        (replace(Weights(), centroid=-1.0), "centroid is -1.0; a weight is zero or more"),
        ({"centroid": 3}, "weights is dict"),
    ],
)
def test_weights_that_do_not(weights, message):
    with pytest.raises(WrongAnswer, match=message):
        check.honest_weights(weights)
