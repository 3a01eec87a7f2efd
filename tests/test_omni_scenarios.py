"""Paper B's experiments in short: what hand, trunk and wheels do, and a run's figures of merit."""

import inspect
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from wfbook.omni import scenarios, simulate
from wfbook.omni.merits import ANGLES, driving_of, hand_of, hand_rpy, lifted, slips
from wfbook.omni.robot import HAND_HEIGHT, HAND_RPY, NOMINAL_HEIGHT, STEERS_V, WHEEL_RADIUS
from wfbook.omni.scenarios import SCENARIOS

COMMON = {"controller", "delay", "noise", "seed", "payload", "trunk_mass_scale", "progress"}


@pytest.fixture(scope="module")
def disturbed():
    return scenarios.fixed(parts=((0.6, 0.2), (0.4, 0.0), (0.6, -0.2)))


@pytest.fixture(scope="module")
def turned():
    return scenarios.turn(angle=0.4)


@pytest.fixture(scope="module")
def squatted():
    return scenarios.squat(down=1.0, wait=0.8)


@pytest.fixture(scope="module")
def mixed():
    return scenarios.combined(each=1.2)


def holds_its_hand(run):
    """What every flat scenario has to do."""
    assert run.metrics["finished"] and run.metrics["upright"]
    assert run.metrics["hand_height_max_error_m"] < 0.002
    assert run.metrics["hand_turn_max_rad"] < 0.01
    assert run.metrics["hand_height_mean_m"] == pytest.approx(HAND_HEIGHT, abs=5e-4)
    for name, wanted in zip(ANGLES, HAND_RPY, strict=True):
        assert run.metrics[f"hand_{name}_mean_rad"] == pytest.approx(wanted, abs=0.003)
    assert run.metrics["rest_speed_m_s"] < 0.01


def test_disturbed_wheels_go_and_the_body_stays(disturbed):
    holds_its_hand(disturbed)
    wheels = disturbed.p[:, :, 0] - disturbed.p[0, :, 0]
    assert np.all(wheels.max(axis=0) > 0.04) and np.all(wheels.min(axis=0) < -0.04)
    trunk = disturbed.qpos[:, 0] - disturbed.qpos[0, 0]
    assert np.abs(trunk).max() < 0.5 * np.abs(wheels).max()
    assert np.ptp(disturbed.qpos[:, 7], axis=0) > 0.1  # the hips are what gives
    assert np.abs(wheels[-1]).max() < 0.01


def test_what_the_wheels_are_disturbed_by_adds_up():
    disturbance = scenarios.wheel_disturbance(((1.0, 0.3), (0.5, -0.2)))
    went = sum(disturbance(0.001 * k) for k in range(3000)) * 0.001 * WHEEL_RADIUS
    np.testing.assert_allclose(went, np.full(4, 0.3 - 0.1), atol=1e-3)


def test_a_turning_base_leaves_the_hand_where_it_is_in_the_world(turned):
    holds_its_hand(turned)
    assert turned.yaw.max() == pytest.approx(0.4, abs=0.02)
    assert abs(turned.yaw[-1]) < 0.01
    moved = np.linalg.norm(turned.hand - turned.hand[0], axis=1)
    along = np.linalg.norm(turned.hand[0, :2]) * np.ptp(turned.yaw)
    assert moved.max() < 0.05 * along  # a hand that went along would have gone this far
    assert np.ptp(turned.qpos[:, 23]) == pytest.approx(np.ptp(turned.yaw), abs=0.12)  # the arm turned back


def test_targets_held_in_the_world_are_the_same_wherever_the_base_is():
    targets = scenarios.held_in_the_world()
    first = targets(0.0, np.zeros(3))
    for pose in np.random.default_rng(0).uniform(-0.2, 0.2, (5, 3)):
        target = targets(1.0, pose)
        back = pin.utils.rotate("z", pose[2])
        np.testing.assert_allclose(back @ target.hand + [*pose[:2], 0.0], first.hand, atol=1e-12)
        np.testing.assert_allclose(back @ target.hand_rotation, first.hand_rotation, atol=1e-12)


def test_the_hand_stays_up_while_the_trunk_goes_down_and_up(squatted):
    holds_its_hand(squatted)
    height = squatted.qpos[:, 2]
    assert height.min() == pytest.approx(NOMINAL_HEIGHT - scenarios.SQUAT, abs=0.02)
    assert height[[0, -1]] == pytest.approx(np.full(2, NOMINAL_HEIGHT), abs=0.01)


def test_all_ways_of_driving_one_after_another(mixed):
    holds_its_hand(mixed)
    twist = mixed.twist
    for axis in range(3):
        alone = np.all(np.abs(np.delete(twist, axis, axis=1)) < 1e-3, axis=1)
        assert np.abs(twist[alone, axis]).max() > 0.4
    assert np.ptp(mixed.qpos[:, 1 + STEERS_V], axis=0).min() > 0.5


def test_more_scenarios_drive_as_they_say():
    across = scenarios.crab(way=0.6)
    holds_its_hand(across)
    assert across.qpos[-1, 1] - across.qpos[0, 1] > 0.4
    assert abs(across.qpos[-1, 0] - across.qpos[0, 0]) < 0.02
    arc = scenarios.pivot(angle=0.6)
    holds_its_hand(arc)
    assert arc.yaw[-1] == pytest.approx(arc.pose[-1, 2], abs=0.04)
    front, rear = arc.steering[len(arc.t) // 4, :2], arc.steering[len(arc.t) // 4, 2:]
    assert np.all(np.sin(2 * front) * np.sin(2 * rear) < 0.0)


def test_the_baseline_can_do_them_too():
    run = scenarios.straight(way=0.5, controller="ik-true", delay=0.004)
    assert run.metrics["finished"] and run.metrics["hand_height_max_error_m"] < 0.01


def test_every_scenario_takes_the_common_options_and_its_own():
    passed_on = set(inspect.signature(simulate.run).parameters)
    assert passed_on >= COMMON
    for name, scenario in SCENARIOS.items():
        taken = inspect.signature(scenario.run).parameters
        assert set(scenario.options) <= set(taken)
        assert any(p.kind is p.VAR_KEYWORD for p in taken.values()), name
        assert scenario.name == name and scenario.title and scenario.where


def test_progress_is_told():
    told = []
    scenarios.straight(way=0.1, progress=lambda now, end: told.append((now, end)))
    assert [end for _, end in told] == [told[0][1]] * len(told)
    times = [now for now, _ in told]
    assert times == sorted(times) and times[-1] <= told[0][1]


def test_the_hands_figures_are_those_of_its_samples(turned):
    tilt = pin.exp3(np.array([0.0, 0.0, 0.02]))
    lifted = replace(
        turned,
        hand=turned.hand_ref + np.array([0.003, 0.004, 0.01]),
        hand_rotation=turned.hand_rotation_ref @ tilt,
    )
    found = hand_of(lifted)
    assert found["hand_height_max_error_m"] == pytest.approx(0.01)
    assert found["hand_level_max_error_m"] == pytest.approx(0.005)
    assert found["hand_turn_max_rad"] == pytest.approx(0.02)
    # The hand's own z axis points ahead: turning about it is a roll of the whole hand about x.
    rpy = hand_rpy(lifted)
    np.testing.assert_allclose(rpy, np.tile(rpy[0], (len(rpy), 1)), atol=1e-9)
    turned_by = pin.rpy.rpyToMatrix(rpy[0]) @ pin.rpy.rpyToMatrix(HAND_RPY).T
    np.testing.assert_allclose(pin.log3(turned_by), [0.02, 0.0, 0.0], atol=1e-6)
    most = [found[f"hand_{name}_max_error_rad"] for name in ANGLES]
    np.testing.assert_allclose(most, np.abs(rpy[0] - HAND_RPY), atol=1e-6)


def test_work_from_rest_to_rest_is_never_gained(mixed):
    metrics = mixed.metrics
    net = 2.0 * metrics["cot_positive"] - metrics["cot_abs"]
    assert 0.0 < net < metrics["cot_positive"]
    assert metrics["way_m"] > metrics["distance_m"] > 0.3
    assert driving_of(mixed, 2.0 * mixed.meta["mass"])["cot_abs"] == pytest.approx(0.5 * metrics["cot_abs"])


def test_slip_is_along_the_axle_and_only_on_the_ground(mixed):
    still = np.zeros_like(mixed.p) + mixed.p[0]
    ahead, aside = (np.linspace(0.0, 0.1, len(still))[:, None, None] * way for way in ([1, 0, 0], [0, 1, 0]))
    pushed = np.full_like(mixed.p, 50.0)
    quiet = replace(
        mixed, qpos=np.tile(mixed.qpos[0], (len(still), 1)), p=still + ahead, contact_force=pushed
    )
    np.testing.assert_allclose(slips(quiet), 0.0, atol=2e-3)
    assert slips(replace(quiet, p=still + aside))[-1] == pytest.approx(np.full(4, 0.1), abs=3e-3)
    lifted = pushed.copy()
    lifted[100:200, 0] = 0.0
    slid = slips(replace(quiet, p=still + aside, contact_force=lifted))[:, 0]
    assert slid[95] > 0.01 and np.all(slid[100:200] == 0.0) and slid[-1] < 0.08


def test_a_swing_is_a_wheel_in_the_air_for_longer_than_a_bump(mixed):
    assert mixed.metrics["swings"] == 0 and not lifted(mixed).any()
    force = np.full_like(mixed.p, 50.0)
    force[20:25, 0] = force[100:160, 1] = force[-30:, 3] = 0.0
    hopping = replace(mixed, contact_force=force)
    expected = np.zeros((len(mixed.t), 4), bool)
    expected[100:160, 1] = expected[-30:, 3] = True
    np.testing.assert_array_equal(lifted(hopping), expected)
    assert driving_of(hopping, 40.0)["swings"] == 2


def test_a_robot_that_goes_nowhere_has_no_cost_of_transport(squatted):
    assert squatted.metrics["cot_abs"] is None and squatted.metrics["cot_positive"] is None
