"""The checks of chapter 12: right answers pass, wrong ones hear what is wrong."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from wfbook.exercises import WrongAnswer
from wfbook.exercises import omni_runs as check
from wfbook.omni.simulate import run
from wfbook.terrain import flat
from wfbook.view.widgets.omni_runs import Trip, travelled


def refused(match, function, *answer):
    with pytest.raises(WrongAnswer, match=match):
        function(*answer)


class Ended:
    """What the check of the first prediction needs of a run."""

    def __init__(self, finished):
        self.metrics = {"finished": finished}
        self.events = [] if finished else [(0.9, "fallen: the trunk is tipped over")]


LOADED = "12 ms and 1.5 kg, predicted"
RIGHT = {"20 ms": False, "20 ms, predicted": True, LOADED: True}


def test_late():
    known = {trip: Ended(RIGHT[name]) for name, trip in check.LATE.items()}
    assert "Right" in check.late(RIGHT, known)
    refused("1.5 kg, predicted the robot gets over", check.late, RIGHT | {LOADED: False}, known)
    refused("with 20 ms the robot does not: fallen", check.late, RIGHT | {"20 ms": True}, known)
    refused(
        "with 20 ms, predicted the robot gets over", check.late, RIGHT | {"20 ms, predicted": False}, known
    )
    refused("an entry for each", check.late, {"20 ms": False}, known)
    refused("neither True nor False", check.late, RIGHT | {"20 ms": "no"}, known)


def test_late_simulates_what_is_not_known(monkeypatch):
    asked, known = [], {}

    def simulated(trip):
        asked.append(trip)
        return Ended(trip.habits.predicts or trip.delay_ms < 8.0)

    monkeypatch.setattr(check, "travelled", simulated)
    check.late(RIGHT, known)
    check.late(RIGHT, known)
    assert asked == list(check.LATE.values()) == list(known)


@pytest.fixture(scope="module")
def level():
    return travelled(Trip("ik-level", low=True, speed=1.5))


def right_lever(pitch, ahead, up):
    return -ahead * np.sin(pitch) + up * (np.cos(pitch) - 1.0)


def test_lever(level):
    assert "Right" in check.lever(right_lever, level)
    refused("the sign is not", check.lever, lambda *q: -right_lever(*q), level)
    refused("height's own share", check.lever, lambda p, a, u: -a * np.sin(p), level)
    refused("height's own share", check.lever, lambda p, a, u: -a * p, level)
    refused("turn .* by the pitch", check.lever, lambda p, a, u: u * np.sin(p), level)
    refused("turn .* by the pitch", check.lever, lambda p, a, u: 0.0, level)
    refused("not a finite number|shape", check.lever, lambda p, a, u: None, level)


def missing(measured, expected, heavier):
    slope = (heavier - expected) / 1e-3
    return (measured - expected) @ slope / (slope @ slope)


def test_weighs():
    assert "0.33, 0.85" in check.weighs(missing)
    refused("sign", check.weighs, lambda *a: -missing(*a))
    refused("a gram more", check.weighs, lambda *a: 1e3 * missing(*a))
    refused("least squares", check.weighs, lambda m, e, h: 1e-3 * (m - e)[1] / (h - e)[1])
    refused("not the mass", check.weighs, lambda m, e, h: 0.1)
    refused("still to be written", check.weighs, unwritten)
    refused(
        "finds",
        check.weighs,
        lambda m, e, h: missing(m, e, h) if np.allclose(m, e) else 0.5 * missing(m, e, h),
    )


def unwritten(*_):
    raise NotImplementedError


def test_weighing_is_tried_on_the_arm():
    """Rounded to a hundred grams the numbers of the first part are right; what lies in the hand is not."""
    refused("in the robot's hand are 0.33 kg", check.weighs, lambda *a: round(missing(*a), 1))


def test_spread():
    most = np.sqrt((0.927 - 0.924) * (0.924 - 0.913))
    assert "5.7 mm" in check.spread(most, 0.924, 0.007)
    refused("half of the time at each end", check.spread, 0.007, 0.924, 0.007)
    refused("variance", check.spread, most**2, 0.924, 0.007)
    refused("more than there can be", check.spread, 0.008, 0.924, 0.007)
    refused("not the most", check.spread, 0.003, 0.924, 0.007)
    random = np.random.default_rng(0)
    for share in random.random(20):  # no heights with this mean spread more
        inner = random.uniform(0.913, 0.927, 500)
        ends = np.where(random.random(500) < share, 0.913, 0.927)
        for heights in (inner, ends):
            low, high, mean = heights.min(), heights.max(), heights.mean()
            assert heights.std() <= np.sqrt((high - mean) * (mean - low)) + 1e-12


def smooth(top=0.6, ramp=1.5, step=0.05, waits=True):
    way = np.array([*check.PLACE, 0.0])
    length = np.linalg.norm(way)
    shares = np.arange(1, round(ramp / step) + 1) / round(ramp / step)
    legs = [(step, share * top * way / length) for share in shares]
    cruise = [(length / top - ramp, top * way / length)]
    return [(0.4, 0.02 * way / length)] * waits + legs + cruise + legs[::-1]


@pytest.fixture(scope="module")
def served():
    """What happens on a smooth course."""
    return run(flat(), smooth(), payload=0.4)


def test_glass_is_served(served, monkeypatch):
    monkeypatch.setattr(check.simulate, "run", lambda *a, **k: served)
    assert "Served" in check.glass(smooth())
    refused("guests wait 8 s", check.glass, [(9.0, [0.1, 0.1, 0.0])])
    refused("a list of pairs", check.glass, [])
    refused("no pair", check.glass, [1.0])
    refused(r"course\[0\]\[1\] has the shape", check.glass, [(1.0, [0.1, 0.2])])
    refused("lasts", check.glass, [(0.0, [0.1, 0.2, 0.0])])
    astray = replace(served, qpos=served.qpos + np.outer(np.linspace(0, 0.2, len(served.t)), np.eye(30)[1]))
    monkeypatch.setattr(check.simulate, "run", lambda *a, **k: astray)
    refused("to the left of the table", check.glass, smooth())
    fallen = replace(served, events=[(1.0, "fallen: the trunk is tipped over")])
    monkeypatch.setattr(check.simulate, "run", lambda *a, **k: fallen)
    refused("fallen", check.glass, smooth())
    spilt = replace(
        served, hand=served.hand + 0.5 * np.outer(np.maximum(served.t - 3.0, 0.0) ** 2, [1, 0, 0])
    )
    monkeypatch.setattr(check.simulate, "run", lambda *a, **k: spilt)
    refused("it spilt", check.glass, smooth())


def test_an_abrupt_start_spills():
    refused("it spilt", check.glass, [(1.0, [0.8, 0.4, 0.0])])


def test_water_stands_as_it_feels(served):
    n = len(served.t)
    at_rest = replace(
        served, hand=np.tile(served.hand[0], (n, 1)), hand_rotation=np.tile(_upright(), (n, 1, 1))
    )
    np.testing.assert_allclose(check.surface_slope(at_rest), 0.0, atol=1e-5)
    a = 1.7
    faster = replace(at_rest, hand=at_rest.hand + 0.5 * a * np.outer(served.t**2, [0.6, 0.8, 0.0]))
    inner = slice(20, -20)
    np.testing.assert_allclose(check.surface_slope(faster)[inner], np.degrees(np.arctan(a / 9.81)), atol=1e-3)
    leaning = replace(at_rest, hand_rotation=pin.utils.rotate("y", 0.1) @ at_rest.hand_rotation)
    np.testing.assert_allclose(check.surface_slope(leaning), np.degrees(0.1), atol=1e-5)


def _upright():
    return pin.rpy.rpyToMatrix(-np.pi / 2, 0.0, -np.pi / 2)
