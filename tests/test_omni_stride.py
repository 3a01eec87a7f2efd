"""Steps and jumps as they are asked for, and as they are planned."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from wfbook.omni.jump import GRAVITY, Leap, leap_schedule
from wfbook.omni.locked import NQ_LOCKED, nominal_state, nominal_target
from wfbook.omni.motion import CAREFUL, Body, Motion, plan_stride, pursue
from wfbook.omni.robot import WHEEL_RADIUS
from wfbook.omni.stride import TOUCHING, Gait, clearance, com_goal, margin, schedule, swing_path
from wfbook.omni.two_modes import check

NEAR, WIDTH, HEIGHT = 0.40, 0.05, 0.08
LANDING = np.array([NEAR + WIDTH + WHEEL_RADIUS + 0.03, 0.19, WHEEL_RADIUS])


def heights(points: np.ndarray) -> np.ndarray:
    return np.where((points[:, 0] > NEAR) & (points[:, 0] < NEAR + WIDTH), HEIGHT, 0.0)


@pytest.fixture(scope="module")
def plan():
    return plan_stride(
        nominal_state(),
        nominal_target(),
        [(0, LANDING)],
        np.array([0.05, 0.0]),
        heights,
        gait=Gait(shift=0.7),
    )


def test_a_swing_begins_and_ends_at_rest_and_clears_what_is_below():
    start, end = np.array([0.28, 0.19, WHEEL_RADIUS]), LANDING
    share = np.linspace(0.0, 1.0, 400)
    path = swing_path(start, end, HEIGHT + WHEEL_RADIUS + 0.04, share)
    np.testing.assert_allclose(path[[0, -1]], [start, end], atol=1e-12)
    speed = np.diff(path, axis=0) / np.diff(share)[:, None]
    assert np.abs(speed[[0, -1]]).max() < 1e-2
    assert clearance(path, heights) > -1e-9
    over = (path[:, 0] > NEAR) & (path[:, 0] < NEAR + WIDTH)
    assert path[over, 2].min() - WHEEL_RADIUS - HEIGHT > 0.035
    # What the rim says is what the distance from the disc's middle to the bar's corner says.
    corner = np.hypot(path[:, 0] - NEAR, path[:, 2] - HEIGHT)[path[:, 2] > HEIGHT]
    assert corner.min() > WHEEL_RADIUS


def test_a_path_through_the_bar_is_seen():
    low = swing_path(np.array([0.28, 0.19, WHEEL_RADIUS]), LANDING, 0.12, np.linspace(0.0, 1.0, 50))
    assert clearance(low, heights) < -0.03


def test_margins_are_distances_to_edges():
    feet = nominal_target().feet
    assert margin(np.zeros(2), feet, (True,) * 4) == pytest.approx(0.19)
    # The diagonal goes through the middle: no margin; each centimetre back is less than one from it.
    stance = (False, True, True, True)
    assert margin(np.zeros(2), feet, stance) == pytest.approx(0.0, abs=1e-12)
    back = margin(np.array([-0.07, 0.0]), feet, stance)
    assert back == pytest.approx(0.07 * 0.38 / np.hypot(0.56, 0.38))
    assert margin(np.array([0.07, 0.0]), feet, stance) == pytest.approx(-back)
    assert margin(np.zeros(2), feet, (True, False, False, True)) == -np.inf


@pytest.mark.parametrize("leg", range(4))
def test_the_robot_leans_away_from_what_it_lifts(leg):
    feet, gait = nominal_target().feet, Gait()
    goal = com_goal(np.zeros(2), feet, leg, gait)
    assert margin(goal, feet, [i != leg for i in range(4)]) >= gait.margin
    assert goal[0] * feet[leg, 0] < 0.0 and goal[1] * feet[leg, 1] < 0.0
    mirrored = com_goal(np.zeros(2), feet, leg ^ 1, gait)
    np.testing.assert_allclose(mirrored, goal * [1.0, -1.0], atol=1e-12)
    with pytest.raises(ValueError, match="can't be lifted"):
        com_goal(np.zeros(2), feet, leg, replace(gait, margin=0.3))


def test_a_schedule_lifts_one_wheel_at_a_time_and_ends_as_it_began():
    target, feet = nominal_target(), nominal_target().feet
    ends = [feet[i] + [0.3, 0.0, 0.0] for i in range(4)]
    asked = schedule(
        target, feet, target.com, list(enumerate(ends)), np.array([0.3, 0.0]), lambda p: 0.0 * p[:, 0], 0.04
    )
    stances = np.array(asked.stances)
    assert stances.sum(axis=1).min() == 3
    assert stances[0].all() and stances[-1].all()
    assert len(asked.swings) == 4
    last = asked.targets[-1]
    np.testing.assert_allclose(last.feet, ends)
    ahead = np.array([0.3, 0.0, 0.0])
    np.testing.assert_allclose(last.com, target.com + ahead, atol=1e-9)
    np.testing.assert_allclose(last.hand, target.hand + ahead, atol=1e-9)
    for swing in asked.swings:
        com = asked.targets[swing.first].com
        standing = asked.targets[swing.first].feet
        assert margin(com, standing, stances[swing.first]) >= Gait().margin - 1e-9


def test_forces_of_a_plan_are_in_the_cone_and_torques_within_limits(plan):
    forces, limits = plan.forces, Body().model.effortLimit[6:]
    assert forces[..., 2].min() > -1.0
    sideways = np.abs(forces[..., :2]).max(axis=-1)
    assert np.max(sideways - CAREFUL * forces[..., 2]) < 3.0  # a penalty, not a bound
    assert np.max(sideways - 0.7 * forces[..., 2]) < 1.0
    assert np.all(np.abs(plan.us) <= limits + 1e-9)
    weight = 9.81 * pin.computeTotalMass(Body().model)
    assert forces[..., 2].sum(axis=1).mean() == pytest.approx(weight, rel=0.02)


def test_a_planned_wheel_gets_over_the_bar_and_the_robot_stays_inside(plan):
    swing = plan.schedule.swings[0]
    path = plan.feet[swing.first : swing.last + 1, 0]
    assert clearance(path, heights) > -TOUCHING - 0.003
    assert np.linalg.norm(plan.feet[-1, 0, :2] - LANDING[:2]) < 0.03
    assert plan.margins.min() > 0.015
    assert np.abs(plan.hand[:, 2] - nominal_target().hand[2]).max() < 0.005
    check(plan)
    astray = replace(plan, feet=plan.feet + 0.05)
    with pytest.raises(ValueError, match="FL misses its path"):
        check(astray)


def test_a_plan_begins_and_ends_at_rest(plan):
    assert np.abs(plan.xs[0][NQ_LOCKED:]).max() == 0.0
    assert np.abs(plan.xs[-1][NQ_LOCKED:]).max() < 0.2


def test_a_leap_is_ballistic_in_the_air_and_continuous():
    leap = Leap(0.1, 0.2)
    t = np.linspace(0.0, leap.squat + 2 * leap.push + leap.flight + leap.rise, 4001)
    way = np.array([leap.way(x) for x in t])
    dt = t[1] - t[0]
    velocity = np.diff(way, axis=0) / dt
    assert np.abs(np.diff(velocity, axis=0)).max() < 20.0 * dt
    flies = (t > leap.squat + leap.push + 2 * dt) & (t < leap.squat + leap.push + leap.flight - 2 * dt)
    bends = np.gradient(np.gradient(way, dt, axis=0), dt, axis=0)[flies]
    np.testing.assert_allclose(bends, np.tile([0.0, -GRAVITY], (len(bends), 1)), atol=1e-2)
    assert way[flies, 1].max() - leap.stretch == pytest.approx(0.1, abs=1e-4)
    np.testing.assert_allclose(way[-1], [0.2, 0.0], atol=1e-9)
    with pytest.raises(ValueError, match="leap: height"):
        target = nominal_target()
        leap_schedule(target, target.feet, target.com, Leap(0.0), 0.02)


def test_in_flight_nothing_carries_the_robot_and_its_momentum_is_gravitys():
    target, x = nominal_target(), nominal_state()
    leap = Leap(0.05, squat=0.3, rise=0.3, rest=0.1)
    asked = leap_schedule(target, target.feet, target.com, leap, 0.02)
    motion = Motion(len(asked.targets) - 1, 0.02)
    motion.hold(x)
    pursue(motion, asked, x, np.zeros(14), 25)
    flight = np.flatnonzero(~np.array(asked.stances).any(axis=1))
    model, data = Body().model, Body().model.createData()
    for k in flight[1:-1]:
        assert np.all(motion.forces(k) == 0.0)
        state, after = motion.xs[k], motion.xs[k + 1]
        before = pin.computeCentroidalMomentum(
            model, data, state[:NQ_LOCKED], state[NQ_LOCKED:]
        ).vector.copy()
        later = pin.computeCentroidalMomentum(model, data, after[:NQ_LOCKED], after[NQ_LOCKED:]).vector.copy()
        gained = np.array([0.0, 0.0, -GRAVITY * pin.computeTotalMass(model) * 0.02])
        np.testing.assert_allclose((later - before)[:3], gained, atol=1.0)


def test_each_node_has_its_contacts_where_its_wheels_touch(plan):
    motion = Motion(2, 0.04)
    motion.xs = [plan.xs[0], plan.xs[len(plan.us) // 2], plan.xs[-1]]
    motion.roll()
    for model, x in zip(motion._models, motion.xs, strict=True):
        data = model.createData()
        pin.framesForwardKinematics(model, data, x[:NQ_LOCKED])
        for leg in ("FL", "RR"):
            axle = data.oMf[model.getFrameId(f"{leg}_axle")].translation
            contact = data.oMf[model.getFrameId(f"{leg}_xyz")]
            assert np.linalg.norm(contact.translation - axle) == pytest.approx(WHEEL_RADIUS)
            assert contact.translation[2] == pytest.approx(axle[2] - WHEEL_RADIUS, abs=2e-3)
