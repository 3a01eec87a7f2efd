"""The estimator: its Jacobians, its honesty about its errors, and how well it knows where the robot is."""

from dataclasses import replace

import estimation_cases
import handmade
import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wfbook import estimator as filters
from wfbook.estimator import WHEEL_MODELS, Estimator, Tuning
from wfbook.go1 import IMU_POSITION, Go1, leg_angles, leg_kinematics, nominal
from wfbook.go1_dynamics import GRAVITY
from wfbook.ideal import coast as coast_on
from wfbook.ideal import sway
from wfbook.kalman import nees, nees_bounds
from wfbook.leg_odometry import STATES, BaseState, Rolling, expected_ends, propagate
from wfbook.recording import estimate, record
from wfbook.sensors import Reading, SensorNoise, Sensors
from wfbook.simulate import run
from wfbook.terrain import flat

SEEDS = (0, 1, 2)
DT = 0.002
UP = np.tile([0.0, 0.0, 1.0], (4, 1))


@pytest.fixture
def walk():
    return estimation_cases.walk()


@pytest.fixture
def coast():
    return estimation_cases.coast()


def quality(result, wheel_model: str, seed: int) -> tuple[float, float]:
    """Drift in per cent of the way and RMS of the velocity's error, from the plan's start on."""
    estimated = estimate(record(result, seed), wheel_model)
    going = result.t >= 0.0
    error = (estimated.base[:, :3] - result.qpos[:, :3])[going]
    slow = (estimated.base_velocity[:, :3] - result.qvel[:, :3])[going]
    drift = 100 * np.linalg.norm(error[-1] - error[0]) / result.metrics["distance_m"]
    return drift, np.sqrt(np.mean(np.sum(slow**2, axis=1)))


def random_state(random: np.random.Generator) -> BaseState:
    some = random.standard_normal
    return BaseState(some(3), some(3), pin.exp3(some(3)), 0.1 * some(3), 0.1 * some(3), some((4, 3)))


def finite_differences(f, size: int, step: float = 1e-6) -> np.ndarray:
    return np.stack([(f(step * e) - f(-step * e)) / (2 * step) for e in np.eye(size)], axis=-1)


def test_plus_and_minus_undo_each_other():
    random = np.random.default_rng(0)
    state, error = random_state(random), 0.3 * random.standard_normal(STATES)
    np.testing.assert_allclose(state.plus(error).minus(state), error, atol=1e-12)


@pytest.mark.parametrize("wheels", [(0, 0, 0, 0), (1, 1, 1, 1), (1, 0, 0, 1)])
def test_the_prediction_s_jacobian(wheels):
    random = np.random.default_rng(1)
    some = random.standard_normal
    state = random_state(random)
    reading = Reading(10 * some(3), 2 * some(3), some((4, 3)), some((4, 3)), some(4))
    axles, normals = some((4, 3)), some((4, 3))
    axles /= np.linalg.norm(axles, axis=1, keepdims=True)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rolling = Rolling(5 * some((4, 3)), axles, normals, np.array(wheels, bool), np.array([1, 1, 0, 1], bool))
    later, F = propagate(state, reading, rolling, DT)
    numerical = finite_differences(
        lambda e: propagate(state.plus(e), reading, rolling, DT)[0].minus(later), STATES
    )
    np.testing.assert_allclose(F, numerical, atol=3e-7)  # second order in the tick's turning


@pytest.mark.parametrize("printed", [(0, 0, 0, 0), (1, 0, 1, 1)])
def test_the_measurement_s_jacobian(printed):
    state, printed = random_state(np.random.default_rng(2)), np.array(printed, bool)
    _, H = expected_ends(state, printed)
    numerical = finite_differences(lambda e: expected_ends(state.plus(e), printed)[0], STATES)
    np.testing.assert_allclose(H, numerical, atol=1e-8)


def test_a_leg_s_kinematics_are_mujoco_s_and_undo_the_inverse():
    random = np.random.default_rng(3)
    angles = np.array([0.0, 0.9, -1.8]) + 0.3 * random.standard_normal((4, 3))
    ends, jacobian, turning = leg_kinematics(angles)
    robot = Go1(flat())
    qpos = np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, *np.column_stack([angles, np.zeros(4)]).ravel()])
    robot.reset(qpos, np.zeros(4, int))
    np.testing.assert_allclose(ends + np.array([0.0, 0.0, 1.0]), robot.centres, atol=1e-12)
    np.testing.assert_allclose(robot.model.site("imu").pos, IMU_POSITION)
    for leg, name in enumerate(("FL", "FR", "RL", "RR")):
        np.testing.assert_allclose(leg_angles(leg, ends[leg]), angles[leg], atol=1e-9)
        spin = np.zeros((3, robot.model.nv))
        mujoco.mj_jacBody(robot.model, robot.data, None, spin, robot.model.body(f"{name}_calf").id)
        np.testing.assert_allclose(turning[leg], spin[:, 6 + 4 * leg : 9 + 4 * leg], atol=1e-12)
    numerical = finite_differences(lambda e: leg_kinematics(angles + e.reshape(4, 3))[0], 12)
    for leg in range(4):
        np.testing.assert_allclose(jacobian[leg], numerical[leg][:, 3 * leg : 3 * leg + 3], atol=1e-9)


def test_sensors_without_noise_tell_the_truth(walk):
    silent = SensorNoise(**dict.fromkeys(SensorNoise.__dataclass_fields__, 0.0))
    sensors = Sensors(0, silent)
    R_wb = pin.Quaternion(*walk.qpos[0, 3:7]).toRotationMatrix()
    velocity = np.zeros(3)
    for qpos, qvel in zip(walk.qpos, walk.qvel, strict=True):
        reading = sensors.read(qpos, qvel)
        R = R_wb @ pin.exp3(0.5 * DT * reading.gyro)
        velocity = velocity + DT * (R @ reading.accelerometer + GRAVITY)
        R_wb = R_wb @ pin.exp3(DT * reading.gyro)
    true = pin.Quaternion(*walk.qpos[-1, 3:7]).toRotationMatrix()
    np.testing.assert_allclose(R_wb, true, atol=1e-9)
    imu = walk.qvel[-1, :3] + true @ np.cross(walk.qvel[-1, 3:6], IMU_POSITION)
    np.testing.assert_allclose(velocity, imu, atol=1e-8)


def test_the_same_seed_gives_the_same_readings(walk):
    first, again, other = (Sensors(seed).read(walk.qpos[9], walk.qvel[9]) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.accelerometer, again.accelerometer)
    np.testing.assert_array_equal(first.joint_angles, again.joint_angles)
    assert not np.array_equal(first.joint_angles, other.joint_angles)


def test_the_filter_is_as_good_as_it_says():
    """Mean NEES of 20 runs: chi-squared with 300 degrees of freedom over 20, 95 % of it in 12.7 to 17.5."""
    runs = [sway(seed) for seed in range(20)]
    low, high = nees_bounds(15, 20)
    assert low < np.mean([nees(error[-1], covariance[-1]) for error, covariance in runs]) < high


@pytest.mark.parametrize("seed", SEEDS)
def test_walking_drifts_less_than_a_hundredth(walk, seed):
    drift, velocity = quality(walk, "encoder", seed)
    assert drift < 1.0 and velocity < 0.01


@pytest.mark.parametrize("seed", SEEDS)
def test_rolling_with_an_encoder(coast, seed):
    drift, velocity = quality(coast, "encoder", seed)
    assert drift < 1.5 and velocity < 0.01


@pytest.mark.parametrize("seed", SEEDS)
def test_rolling_with_slack(coast, seed):
    drift, velocity = quality(coast, "slack", seed)
    assert drift < 3.0 and velocity < 0.1


def test_eq_44_as_printed_loses_the_robot(coast):
    """Metres a second added to metres: the speed that the wheels have is corrected away."""
    drift, velocity = quality(coast, "printed", 0)
    assert drift > 30.0 and velocity > 0.1


def test_eq_44_as_printed_makes_any_speed_decay():
    """A robot rolls at 0.4 m/s, legs still, nothing accelerates: in a second the estimate stands."""
    speeds = {model: coast_on(0.4, model)[1][-1] for model in WHEEL_MODELS}
    assert speeds["encoder"] == pytest.approx(0.4, abs=0.01)
    assert speeds["slack"] == pytest.approx(0.4, abs=0.1)
    assert abs(speeds["printed"]) < 0.1


def test_wheels_on_a_ramp_roll_along_it():
    """With the ramp's normal the height is known; with a vertical one the climb would be lost."""
    home = np.array(nominal()["joint_angles"]).reshape(4, 3)
    slope, speed = np.radians(10.0), 0.4
    along = np.array([np.cos(slope), 0.0, np.sin(slope)])
    still = Reading(-GRAVITY, np.zeros(3), home, np.zeros((4, 3)), np.full(4, speed / 0.04))
    for normals, climbs in ((np.tile([-np.sin(slope), 0.0, np.cos(slope)], (4, 1)), True), (UP, False)):
        estimator = Estimator()
        estimator.start(np.array([0.0, 0.0, 0.3]), np.eye(3))
        estimator.state = replace(estimator.state, v=speed * along)
        for _ in range(1000):
            estimator.update(still, np.ones(4, bool), np.ones(4, bool), normals)
        moved = estimator.base()[0][:3] - [0.0, 0.0, 0.3]
        error = np.linalg.norm(moved - 2.0 * speed * along)
        assert (error < 0.01) == climbs


def test_who_forgets_that_feet_roll_drifts(walk, monkeypatch):
    def resting(state, reading, rolling, dt):
        return propagate(state, reading, replace(rolling, rolls=np.zeros(4, bool)), dt)

    good = quality(walk, "encoder", 0)[0]
    monkeypatch.setattr(filters, "propagate", resting)
    assert quality(walk, "encoder", 0)[0] > max(2.0, 4 * good)


def test_a_wrong_measurement_is_refused_and_a_slipped_foot_placed_anew():
    home = np.array(nominal()["joint_angles"]).reshape(4, 3)
    estimator = Estimator()
    estimator.start(np.array([0.0, 0.0, 0.3]), np.eye(3))
    still = Reading(-GRAVITY, np.zeros(3), home, np.zeros((4, 3)), np.zeros(4))

    def update(reading, times=1):
        for _ in range(times):
            estimator.update(reading, np.ones(4, bool), np.zeros(4, bool), UP)

    update(still, 200)
    assert estimator.outliers == 0
    before = estimator.state
    jump = replace(still, joint_angles=home + np.outer([0.0, 0.0, 1.0, 0.0], [0.0, 0.1, 0.0]))
    update(jump)
    assert estimator.outliers == 1
    assert np.abs(estimator.state.r - before.r).max() < 1e-4
    update(jump, 30)
    assert estimator.outliers == Tuning().patience + 1
    assert np.linalg.norm(estimator.state.p[2] - before.p[2]) > 0.01
    assert np.abs(estimator.state.r - before.r).max() < 1e-3


@pytest.mark.parametrize("seed", SEEDS)
def test_walking_in_closed_loop(seed):
    plan = handmade.trot(0.2, 5)
    metrics = run(plan, state="estimated", seed=seed, hold=0.3).metrics
    assert metrics["upright"] and metrics["distance_m"] == pytest.approx(plan.distance, abs=0.01)
    assert metrics["estimate_drift_percent"] < 1.5 and metrics["estimate_velocity_rms_m_s"] < 0.01


@pytest.mark.parametrize("wheel_model", ["encoder", "slack"])
def test_rolling_in_closed_loop(wheel_model):
    plan = handmade.coast()
    result = run(plan, state="estimated", wheel_model=wheel_model, hold=0.3)
    metrics, limit = result.metrics, {"encoder": 1.5, "slack": 3.0}[wheel_model]
    assert metrics["upright"] and result.meta["wheel_model"] == wheel_model
    assert metrics["estimate_drift_percent"] < limit
    assert metrics["distance_m"] == pytest.approx(plan.distance, rel=0.05)
    error = np.abs(result.com_estimate - result.com).max()
    assert 0.0 < error < 0.05


def test_a_true_state_run_has_no_estimate_to_judge(walk):
    assert walk.metrics["estimate_drift_percent"] is None
    assert walk.metrics["estimate_velocity_rms_m_s"] is None
    np.testing.assert_array_equal(walk.base_estimate, walk.qpos[:, :7])


def test_an_unknown_wheel_model_is_named():
    with pytest.raises(ValueError, match="wheel_model: 'square'"):
        Estimator("square")
