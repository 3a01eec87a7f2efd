"""Chapter 0's checks: a right answer passes, and wrong ones hear what is wrong with them."""

from dataclasses import replace

import numpy as np
import pytest

from wfbook import simulate
from wfbook.centroidal import Robot
from wfbook.exercises import WrongAnswer, start
from wfbook.go1_dynamics import MOTORS
from wfbook.planner import Problem, stored
from wfbook.terrain import flat

RIGHT = {0.1: False, 0.2: True, 0.3: True}


def test_which_short_ways_are_worth_a_wheel():
    assert "0.1 m: no leg is lifted at all" in start.shorter_way(RIGHT)


@pytest.mark.parametrize(
    ("prediction", "message"),
    [
        (RIGHT | {0.1: True}, "for 0.1 m no leg is lifted at all: the body leans 0.0"),
        (RIGHT | {0.2: False}, r"for 0.2 m .* (FL|FR|RL|RR) lands on a wheel in slot \d"),
        ({0.1: False}, "expected a dict with the keys 0.1, 0.2, 0.3"),
        (RIGHT | {0.3: "yes"}, "for 0.3 m there is 'yes'"),
    ],
)
def test_wrong_predictions_hear_what_the_plan_does(prediction, message):
    with pytest.raises(WrongAnswer, match=message):
        start.shorter_way(prediction)


def share(S, D):
    on_wheel = D[..., 1].sum(axis=2)
    return (on_wheel * (1 - S)).sum() / (1 - S).sum()


def test_the_share_of_standing_on_wheels():
    assert "% on flat ground" in start.rolling_share(share)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda S, D: D[..., 1].sum() / D.sum(), r"leg (FL|FR|RL|RR) swings in slot \d"),
        (lambda S, D: share(S, D) * (1 - S).mean(), "'flat': you divided by all slots"),
        (lambda S, D: 100.0 * share(S, D), "'flat': .*per cent"),
        (lambda S, D: 1.0 - share(S, D), "'flat-feet': this is the share on feet"),
        (lambda S, D: share(S, D) * (1 - S).sum(), "'flat': this is the number of slots"),
        (lambda S, D: 0.3, "'flat-feet' you find 0.300; its legs stand on wheels in {'FL': 0"),
        (lambda S, D: S, "has the shape"),
        (lambda S, D: D[9], "rolling_share raised IndexError"),
    ],
)
def test_wrong_shares_hear_what_they_count(answer, message):
    with pytest.raises(WrongAnswer, match=message):
        start.rolling_share(answer)


def cost(t, torque, velocity, weight, distance):
    return np.trapezoid(np.abs(torque * velocity).sum(axis=1), t) / (weight * distance)


def test_the_cost_of_transport():
    assert "Right" in start.cost_of_transport(cost)


def test_the_right_cost_is_that_of_the_metrics():
    run, robot = simulate.run(stored("flat"), hold=0.0), Robot.go1()
    going = run.t >= 0.0
    logged = run.t[going], run.tau[going], run.qvel[going][:, MOTORS]
    mine = cost(*logged, robot.weight, run.metrics["distance_m"])
    assert mine == pytest.approx(run.metrics["cot_abs"], rel=0.02)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda t, u, q, w, d: np.trapezoid((u * q).sum(axis=1), t) / (w * d), "braking counts"),
        (lambda t, u, q, w, d: np.trapezoid(np.abs((u * q).sum(axis=1)), t) / (w * d), "against each other"),
        (lambda t, u, q, w, d: np.abs(u * q).sum() * (t[1] - t[0]) / (w * d), "steps are not even"),
        (lambda t, u, q, w, d: cost(t, u, q, w, 1.0), "twice as heavy and twice as far"),
        (lambda t, u, q, w, d: cost(t, u, q, 9.81 * w, d), "one joint pushes .* costs 0.1, you find 0.01"),
        (lambda t, u, q, w, d: np.abs(u * q).sum(axis=1), "has the shape"),
    ],
)
def test_wrong_costs_hear_on_which_trip(answer, message):
    with pytest.raises(WrongAnswer, match=message):
        start.cost_of_transport(answer)


def test_how_late_torques_may_be():
    assert "with 20 ms it is" in start.late_torques(30)


@pytest.mark.parametrize(
    ("guess", "message"),
    [
        (10, "with 10 ms it stays upright, on average"),
        (40, "with 40 ms it falls after .* but with 30 ms it falls too, after"),
        (25, "25 ms is none of 10, 20, 30, 40"),
        ("thirty", "first_fall_ms is 'thirty'"),
    ],
)
def test_wrong_delays_hear_what_happens(guess, message):
    with pytest.raises(WrongAnswer, match=message):
        start.late_torques(guess)


PROBLEM = Problem(flat(), goal=(1.0, 0.0), slots=10)


def table(letters):
    """A trot: in each slot one diagonal swings, the other, or none."""
    diagonals = {"A": (1, 0, 0, 1), "B": (0, 1, 1, 0), ".": (0, 0, 0, 0)}
    return np.array([diagonals[letter] for letter in letters]).T


def changed(letters, *places):
    S = table(letters)
    for leg, slot in places:
        S[leg, slot] = 1
    return S


@pytest.mark.parametrize("letters", ["AB.AB.AB..", "ABABAB...."])
def test_a_gait_made_by_hand(letters):
    assert "Right: your gait costs" in start.gait_by_hand(table(letters), PROBLEM, stored("flat-feet"))


@pytest.mark.parametrize(
    ("S", "message"),
    [
        (table("........."), r"S has the shape \(4, 9\), not \(4, 10\)"),
        (0.5 * table("A........."), r"S\[FL, slot 0\] is 0.5"),
        (changed("A.........", (1, 0)), "in slot 0 FL and FR and RR swing together"),
        (changed("..........", (0, 2), (2, 2)), "in slot 2 FL and RL swing together"),
        (changed("..A.......", (3, 3)), "RR swings in slots 2 and 3 without standing"),
        (table(".........B"), "FR still swings in the last slot"),
        (table(".........."), "it lifts legs 0 times and ends 0.88 m short"),
        (table("ABABABABA."), "costs 2.77., the planner's 1.894; it lifts legs 18 times"),
    ],
)
def test_wrong_gaits_hear_which_leg_breaks_which_rule(S, message):
    with pytest.raises(WrongAnswer, match=message):
        start.gait_by_hand(S, PROBLEM, stored("flat-feet"))


def test_a_gait_that_no_force_can_hold_has_no_motion():
    weak = replace(PROBLEM, limits=replace(PROBLEM.limits, force=0.3))
    with pytest.raises(WrongAnswer, match="no motion goes with this gait"):
        start.gait_by_hand(table("AB.AB.AB.."), weak, stored("flat-feet"))
