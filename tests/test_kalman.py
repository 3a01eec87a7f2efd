"""The Kalman filter on a line, recordings, and what the legs alone measure."""

from dataclasses import replace

import estimation_cases
import numpy as np
import pinocchio as pin
import pytest

from wfbook import kalman
from wfbook.estimator import Tuning
from wfbook.go1 import FOOT_RADIUS, IMU_POSITION, leg_kinematics, nominal
from wfbook.go1_dynamics import GRAVITY
from wfbook.ideal import coast, sway
from wfbook.leg_odometry import POSITION, VELOCITY, BaseState, Rolling, expected_ends, leg_velocities
from wfbook.recording import BASE, estimate, odometry, record
from wfbook.sensors import Reading, SensorNoise

UP = np.tile([0.0, 0.0, 1.0], (4, 1))


@pytest.fixture
def walk():
    return estimation_cases.walk()


@pytest.fixture(scope="module")
def silent():
    """The walk as perfect sensors record it."""
    return record(estimation_cases.walk(), noise=SensorNoise().scaled(1e-9))


def test_the_filter_on_a_line_is_as_good_as_it_says():
    cart = kalman.drive(seed=5, runs=400)
    v, P, refused = kalman.follow(cart)
    nees = kalman.nees((cart.v - v)[..., None], P[..., None, None]).mean(axis=0)
    low, high = kalman.nees_bounds(1, 400)
    assert np.mean((nees > low) & (nees < high)) > 0.9 and not refused.any()
    assert np.std(cart.v - v) < 0.5 * np.std(cart.v - cart.measured)


def test_a_gate_keeps_nonsense_out():
    cart = kalman.drive(seed=5, runs=100, wrong=0.06)
    errors = {gate: np.std(cart.v - kalman.follow(cart, gate=gate)[0]) for gate in (9.0, np.inf)}
    assert errors[9.0] < 0.5 * errors[np.inf]
    refused = kalman.follow(cart, gate=9.0)[2]
    assert 0.03 < refused.mean() < 0.07


def test_nees_does_not_care_about_units_and_its_bounds_hold():
    random = np.random.default_rng(1)
    A = random.standard_normal((3, 3))
    covariance, error = A @ A.T, A @ random.standard_normal((500, 3, 1))
    values = kalman.nees(error[..., 0], np.tile(covariance, (500, 1, 1)))
    scale = np.diag([1.0, 1e3, 1e-3])
    scaled = kalman.nees(error[..., 0] @ scale, np.tile(scale @ covariance @ scale, (500, 1, 1)))
    np.testing.assert_allclose(values, scaled, rtol=1e-6)
    low, high = kalman.nees_bounds(3, 500)
    assert low < values.mean() < high and low < 3.0 < high
    means = random.chisquare(3, (4000, 20)).mean(axis=1)
    low, high = kalman.nees_bounds(3, 20)
    assert np.mean((means > low) & (means < high)) == pytest.approx(0.95, abs=0.015)


def test_a_standing_leg_measures_the_trunk():
    """A trunk that moves and turns above an end at rest: the encoders of that leg give its velocity."""
    random = np.random.default_rng(2)
    R_wb, v, omega = pin.exp3(0.3 * random.standard_normal(3)), random.standard_normal(3), 0.5 * np.ones(3)
    angles = np.array(nominal()["joint_angles"]).reshape(4, 3)
    ends, jacobians, turning = leg_kinematics(angles)
    stick = ends - IMU_POSITION
    resting = np.zeros(4, bool)
    for rolls in (resting, ~resting):
        # Solve for the rates that keep the end at rest, or the contact of a foot that rolls.
        rates = np.empty((4, 3))
        for leg in range(4):
            lever = rolls[leg] * FOOT_RADIUS * R_wb.T @ UP[leg]
            A = jacobians[leg] - np.cross(turning[leg].T, lever).T
            rates[leg] = np.linalg.solve(A, np.cross(omega, lever) - R_wb.T @ v - np.cross(omega, stick[leg]))
        reading = Reading(-GRAVITY, omega, angles, rates, np.zeros(4))
        spin = np.einsum("lij,lj->li", turning, rates)
        model = Rolling(spin, turning[:, :, 2], UP, resting, rolls)
        np.testing.assert_allclose(leg_velocities(reading, R_wb, model), np.tile(v, (4, 1)), atol=1e-9)


def test_legs_that_know_that_feet_roll_count_the_whole_way(silent):
    start, true = int(np.searchsorted(silent.t, 0.0)), silent.path

    def way(path):
        return (path[-1] - path[start])[0] / (true[-1] - true[start])[0]

    assert way(odometry(silent)[0]) == pytest.approx(1.0, abs=0.01)
    assert way(odometry(silent, rolling=False)[0]) < 0.97


def test_a_recording_of_perfect_sensors_tells_what_happened(silent, walk):
    gyro = np.array([reading.gyro for reading in silent.readings])
    np.testing.assert_allclose(gyro[1:], walk.qvel[1:, 3:6], atol=0.6)
    np.testing.assert_allclose(silent.path[0], walk.qpos[0, :3] + silent.truth[0].R_wb @ IMU_POSITION)
    assert silent.distance == pytest.approx(walk.metrics["distance_m"], abs=0.01)
    np.testing.assert_array_equal(silent.wheels, walk.end_effector == 1)


def test_an_estimate_s_error_is_truth_less_belief(walk):
    recording = record(walk, seed=3)
    found = estimate(recording)
    np.testing.assert_allclose(found.error[:, POSITION], recording.path - found.path, atol=1e-12)
    assert found.covariance.shape == (len(walk.t), BASE, BASE)
    np.testing.assert_allclose(found.deviations**2, np.diagonal(found.covariance, axis1=1, axis2=2))
    assert found.drift_percent < 1.0 and found.velocity_rms < 0.01 and found.outliers[-1] == 0
    part = found.nees(VELOCITY)
    by_hand = found.error[9, 3:6] @ np.linalg.inv(found.covariance[9, 3:6, 3:6]) @ found.error[9, 3:6]
    assert part[9] == pytest.approx(by_hand)


def test_without_legs_the_error_is_large_and_known(walk):
    alone = estimate(record(walk, seed=1).without_legs())
    assert alone.drift_percent > 10.0
    assert np.all(np.abs(alone.error[-1, :6]) < 3.5 * alone.deviations[-1, :6])
    assert np.all(np.diff(alone.deviations[:, POSITION], axis=0) > 0.0)


def test_a_wrong_encoder_is_refused_or_believed(walk):
    recording = record(walk, seed=1)
    k = int(np.searchsorted(recording.t, 0.8))
    leg = int(np.flatnonzero(recording.touching[k - 10 : k + 20].all(axis=0))[0])
    kicked = recording.kicked(leg, recording.t[k], 0.016, 0.1)
    clean, gated = estimate(recording), estimate(kicked)
    believed = estimate(kicked, tuning=Tuning(gate=np.inf))
    assert gated.outliers[-1] == 8 and believed.outliers[-1] == 0
    jump = [np.abs(e.error - clean.error)[:, POSITION].max() for e in (gated, believed)]
    assert jump[0] < 1e-3 < 5e-3 < jump[1]


def test_a_robot_elsewhere_measures_the_same():
    random = np.random.default_rng(4)
    some, none = random.standard_normal, np.zeros(4, bool)
    state = BaseState(some(3), some(3), pin.exp3(some(3)), some(3), some(3), some((4, 3)))
    moved = state.moved(some(3), some(3))
    np.testing.assert_allclose(expected_ends(moved, none)[0], expected_ends(state, none)[0], atol=1e-12)
    np.testing.assert_allclose(moved.R_wb.T @ moved.v, state.R_wb.T @ state.v, atol=1e-12)
    back = state.moved(np.zeros(3), [0.0, 0.0, 0.7]).moved(np.zeros(3), [0.0, 0.0, -0.7])
    np.testing.assert_allclose(back.minus(state), 0.0, atol=1e-12)


def test_more_slip_than_assumed_shows_in_nees():
    bounds = kalman.nees_bounds(15, 5)
    for assumed, honest in ((0.01, True), (0.002, False)):
        runs = [sway(seed, 150, foot_slip=0.01, tuning=Tuning(foot_slip=assumed)) for seed in range(5)]
        mean = np.mean([kalman.nees(error[-1], covariance[-1]) for error, covariance in runs])
        assert (mean < bounds[1]) == honest


def test_eq_44_decays_as_an_exponential():
    t, believed = coast(0.5, "printed", 1.5)
    np.testing.assert_allclose(believed, 0.5 * np.exp(-t), atol=0.04)


def test_a_filter_that_knows_that_sensors_are_worse_has_wider_bands(walk):
    recording = record(walk, seed=1, noise=SensorNoise().scaled(4.0))
    told, deaf = estimate(recording), estimate(recording, noise=SensorNoise())
    assert np.all(told.deviations[-1, :9] > deaf.deviations[-1, :9])
    assert told.nees()[-300:].mean() < deaf.nees()[-300:].mean()
    assert replace(recording, noise=SensorNoise()).noise != recording.noise
