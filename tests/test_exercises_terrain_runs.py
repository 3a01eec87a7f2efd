"""The checks of chapter 8: right answers pass, wrong ones hear what is wrong."""

import copy

import numpy as np
import pytest

from wfbook import planner
from wfbook.exercises import WrongAnswer
from wfbook.exercises import terrain_runs as check
from wfbook.flights import interpolate
from wfbook.terrain import ramp
from wfbook.view.widgets.terrain_runs import Journey, travelled


def refused(match, function, *answer):
    with pytest.raises(WrongAnswer, match=match):
        function(*answer)


@pytest.fixture(scope="module")
def walk():
    return travelled(Journey(feet_only=True))


class Descent:
    """What the check of the first prediction needs of a run that went a metre and came down by a tenth."""

    t = np.array([-0.1, 0.0, 3.0])
    com = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3], [1.0, 0.0, 0.2]])
    metrics = {"cot_abs": 0.6, "cot_positive": 0.25, "distance_m": 1.0}  # noqa: RUF012


def test_downhill():
    assert "0.100 m for each metre" in check.downhill(0.1, Descent)
    refused("the sign is not", check.downhill, -0.1, Descent)
    refused("as if the motors had put in as much", check.downhill, 0.0, Descent)
    refused("height lost over the way", check.downhill, 0.5, Descent)
    refused("not a finite number", check.downhill, None, Descent)


def costs(t, tau, rates, mass, distance, since=0.0):
    power = (tau * rates)[t >= since] * (t[1] - t[0]) / (mass * 9.81 * distance)
    return np.abs(power).sum(), np.maximum(power, 0.0).sum()


def test_cost_of_transport(walk):
    assert "Right" in check.cost_of_transport(costs, walk)

    def net(t, tau, rates, mass, distance):
        return (tau * rates).sum() * 0.002 / (mass * 9.81 * distance), 1.0

    refused("absolute work .* net work", check.cost_of_transport, net, walk)

    def no_weight(t, tau, rates, mass, distance):
        return tuple(cost * mass * 9.81 for cost in costs(t, tau, rates, mass, distance))

    refused("is the weight in it", check.cost_of_transport, no_weight, walk)

    def twice(*a):
        return costs(*a)[0], costs(*a)[0]

    refused("by positive work", check.cost_of_transport, twice, walk)
    refused("shape", check.cost_of_transport, lambda *a: costs(*a)[0], walk)
    refused("raised TypeError", check.cost_of_transport, lambda t: 1.0, walk)


def test_settling_does_not_count(walk):
    """While it settles this robot hardly works; let it work hard there."""
    restless = copy.copy(walk)
    object.__setattr__(restless, "tau", np.where(walk.t[:, None] < 0.0, 20.0, walk.tau))
    object.__setattr__(restless, "qvel", np.where(walk.t[:, None] < 0.0, 1.0, walk.qvel))
    assert "Right" in check.cost_of_transport(costs, restless)
    refused("only settles", check.cost_of_transport, lambda *a: costs(*a, since=-9.0), restless)


def between(x, v, a, dt, t):
    k = int(np.clip(t / dt + 1e-9, 0, len(a)))
    if t < 0.0 or k == len(a):
        return x[k], np.zeros(3)
    s = t - k * dt
    return x[k] + s * v[k] + 0.5 * s * s * a[k], v[k] + s * a[k]


def test_between_knots():
    assert "parabola" in check.between_knots(between)
    refused("constant acceleration", check.between_knots, lambda x, v, a, dt, t: held(x, v, dt, t))
    refused("grows by a", check.between_knots, lambda *q: (between(*q)[0], held(*q[:2], *q[3:])[1]))
    refused("Before the plan", check.between_knots, lambda *q: tuple(b + (q[4] < 0.0) for b in between(*q)))
    refused("After the plan", check.between_knots, lambda *q: tuple(b + (q[4] > 3.2) for b in between(*q)))
    refused("two things", check.between_knots, lambda *q: between(*q)[0])
    plan = planner.stored("flat-feet")
    np.testing.assert_allclose(interpolate(plan, 1.23)[0], between(plan.x, plan.v, plan.a, plan.dt, 1.23)[0])


def held(x, v, dt, t):
    k = int(np.clip(t / dt + 1e-9, 0, len(x) - 1))
    return x[k], v[k]


def test_pushes(monkeypatch):
    cells = [{"values": [40.0, angle], "upright": int(angle < 180)} for angle in (0.0, 90.0, 180.0)]
    monkeypatch.setattr(check.here, "run", lambda study, finished: {"grids": [{"cells": cells}]})
    right = {0: True, 90: True, 180: False}
    assert "sits down" in check.pushes(right, b"", {})
    refused("backwards the robot falls", check.pushes, right | {180: True}, b"", {})
    refused("ahead the robot stays upright", check.pushes, right | {0: False}, b"", {})
    refused("entry for each", check.pushes, {0: True}, b"", {})
    refused("neither True nor False", check.pushes, right | {90: "yes"}, b"", {})


def strips(*spans):
    surface = {"mu_foot": 0.7, "mu_wheel": 0.0, "mu_wheel_lateral": 0.7, "rolling_resistance": 0.0}
    regions = []
    for index, (first, last, z) in enumerate(spans):
        corners = [[first, -0.5, z], [last, -0.5, z], [last, 0.5, z], [first, 0.5, z]]
        regions.append({"vertices": corners, **surface, "group": f"{index}"})
    return {"name": "mine", "regions": regions}


def test_own_ground_is_crossed():
    assert "on region 1" in check.own_ground(strips((-1.0, 0.25, 0.0), (0.25, 3.0, 0.04)))


def test_own_ground_is_refused():
    step = strips((-1.0, 0.25, 0.0), (0.25, 3.0, 0.04))
    del step["regions"][1]["mu_foot"]
    refused("region 1: mu_foot: missing", check.own_ground, step)
    refused("the first metre is 10 mm", check.own_ground, strips((-1, 0.3, 0), (0.3, 3, 0.01)))
    refused("the first metre is . mm", check.own_ground, ramp(start=0.3).to_dict())
    refused("no ground under FL", check.own_ground, strips((-1, 0.1, 0), (0.5, 3, 0)))
    refused("there is no plan|stays on region 0", check.own_ground, strips((-1, 0.25, 0), (0.8, 3, 0)))
    refused("must be an object", check.own_ground, None)
