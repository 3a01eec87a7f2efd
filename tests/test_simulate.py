"""Plans become motion: hand-made ones, so that these tests say nothing about the planner."""

import json

import handmade
import numpy as np
import pytest

from wfbook.flights import interpolate, swings_of
from wfbook.go1 import nominal
from wfbook.modes import LEGS
from wfbook.reference import Gains
from wfbook.runs import TIMINGS
from wfbook.sensors import SensorNoise
from wfbook.simulate import Run, run
from wfbook.terrain import Region, Terrain, flat
from wfbook.tracking import Tracker


@pytest.fixture(scope="module")
def coast() -> tuple:
    plan = handmade.coast()
    return plan, run(plan)


@pytest.fixture(scope="module")
def trot() -> tuple:
    plan = handmade.trot(0.4, 7)
    return plan, run(plan)


def check(run: Run, plan, rms: float) -> None:
    metrics = run.metrics
    assert metrics["upright"] and not metrics["fell"] and metrics["fall_time_s"] is None
    assert metrics["distance_m"] == pytest.approx(plan.distance, abs=0.005)
    assert metrics["final_speed_m_s"] < 0.005
    assert metrics["base_rms_m"] < rms
    assert metrics["base_rms_rad"] < np.radians(2.0)
    assert metrics["slip_max_m"] < 0.005
    assert metrics["qp_failures"] == 0


def test_standing_still_and_a_push():
    result = run(handmade.stand(4), push=(np.array([0.0, 50.0, 0.0]), 0.2, 0.2))
    check(result, handmade.stand(4), 0.015)
    assert np.abs(result.com - result.com_ref)[:, 1].max() > 0.005


def test_standing_on_wheels_and_one_foot():
    plan = handmade.stand(2, (1, 1, 1, 0))
    check(run(plan), plan, 0.002)


def test_crawling():
    plan = handmade.crawl()
    check(run(plan, hold=0.5), plan, 0.004)


def test_trotting_lifts_every_swinging_leg(trot):
    plan, result = trot
    check(result, plan, 0.01)
    for leg, heights in result.metrics["lift_off_m"].items():
        assert len(heights) == len(swings_of(plan)[LEGS.index(leg)])
        assert all(0.04 < height < 0.09 for height in heights)


def test_pushing_off_coasting_and_braking(coast):
    plan, result = coast
    check(result, plan, 0.01)
    rolling = result.end_effector[:, 0] == 1
    assert result.com_velocity[rolling, 0].max() > 0.25


def test_end_effectors_switch_in_the_air_only_and_as_planned(coast):
    plan, result = coast
    changed = np.diff(result.end_effector.astype(int), axis=0) != 0
    assert changed.sum() == 4
    assert not np.any(changed & (result.in_contact[1:] | result.in_contact[:-1]))
    middle = result.t.searchsorted((np.arange(plan.slots) + 0.97) * plan.slot_duration)
    np.testing.assert_array_equal(result.end_effector[middle].T, plan.end_effector)


def test_the_wheels_roll_and_push_nothing(coast):
    _, result = coast
    on_wheels = (result.end_effector == 1) & result.in_contact & result.stance
    steady = on_wheels & np.roll(on_wheels, 40, axis=0) & np.roll(on_wheels, -40, axis=0)
    along = result.contact_force[..., 0][steady]
    assert np.abs(np.mean(along)) < 0.3 and np.percentile(np.abs(along), 95) < 2.0


def test_a_torque_acts_one_delay_after_it_was_computed():
    """9 ms and ticks of 2 ms: at a tick acts what was computed five ticks before."""
    result = run(handmade.trot(0.1, 3), hold=0.0)
    np.testing.assert_array_equal(result.tau[5:], result.tau_command[:-5])
    without = run(handmade.stand(1), delay=0.0, hold=0.0)
    np.testing.assert_array_equal(without.tau, without.tau_command)


def test_forces_carry_the_weight_and_work_is_accounted_for(trot):
    _, result = trot
    mass = nominal()["mass"]
    going = result.t > 0
    mean = result.contact_force[going].sum(axis=1).mean(axis=0)
    np.testing.assert_allclose(mean, [0.0, 0.0, mass * 9.81], atol=1.5)
    assert 0.0 < result.metrics["cot_positive"] < result.metrics["cot_abs"]
    speed = result.qvel[:, [6 + 4 * leg + part for leg in range(4) for part in range(3)]]
    work = np.abs(result.tau * speed)[going].sum() * 0.002
    assert result.metrics["cot_abs"] * mass * 9.81 * result.metrics["distance_m"] == pytest.approx(
        work, rel=0.05
    )


@pytest.mark.parametrize("state", ["true", "estimated"])
def test_the_same_seed_gives_the_same_file_bit_for_bit_and_another_another(state, tmp_path):
    plan = handmade.trot(0.1, 3)
    results = [run(plan, hold=0.0, seed=seed, state=state) for seed in (1, 1, 2)]
    files = [tmp_path / f"{i}.npz" for i in range(3)]
    for result, file in zip(results, files, strict=True):
        result.save(file)
    first, again, other = (file.read_bytes() for file in files)
    assert first == again
    assert first != other
    assert np.abs(results[0].qpos - results[2].qpos).max() > 1e-5


def test_a_fall_is_reported_with_its_time():
    result = run(handmade.stand(6), push=(np.array([0.0, 300.0, 0.0]), 0.1, 0.3))
    assert result.metrics["fell"] and not result.metrics["upright"]
    assert 0.1 < result.metrics["fall_time_s"] < 1.8
    assert result.t[-1] == pytest.approx(result.metrics["fall_time_s"], abs=0.003)


@pytest.mark.parametrize("state", ["true", "estimated"])
def test_joint_friction_and_a_heavier_trunk_are_survived(state):
    plan = handmade.trot(0.2, 5)
    result = run(plan, joint_friction=0.2, trunk_mass_scale=1.2, state=state)
    assert result.metrics["upright"]
    x, y, z = result.metrics["base_rms_xyz_m"]
    assert max(x, y) < 0.02 and z < 0.01
    assert max(result.metrics["base_rms_rpy_rad"]) < np.radians(1.0)


def test_dry_friction_does_not_hold_a_tilt():
    """Pushed aside on four feet, the trunk stays tilted by friction until the error's integral frees it."""
    push = np.array([0.0, 60.0, 0.0]), 0.1, 0.2
    tilts = []
    for gain in (np.zeros(3), Gains().attitude_ki):
        gains = Gains(attitude_ki=gain)
        result = run(handmade.stand(7), push=push, joint_friction=0.2, gains=gains, hold=0.0)
        assert result.metrics["upright"]
        tilts.append(np.abs(result.rpy[-1] - result.rpy_ref[-1])[:2].max())
    assert tilts[1] < 0.5 * tilts[0]


def test_the_robot_walks_on_the_real_ground_and_knows_only_the_plans():
    square = flat().regions[0].vertices
    dropped = Terrain("dropped", (Region(square - [0.0, 0.0, 0.02], 0.5, 0.0, 0.5, 0.0, "deck"),))
    result = run(handmade.stand(1), real_terrain=dropped)
    assert result.metrics["upright"] and result.terrain == dropped
    np.testing.assert_allclose(result.p[-1, :, 2], -0.02, atol=0.002)
    np.testing.assert_allclose(result.com_ref[-1], handmade.stand(1).x[-1], atol=1e-3)


def test_worse_sensors_make_a_worse_estimate():
    plan, noise = handmade.stand(1), SensorNoise()
    usual, same, worse = (
        run(plan, state="estimated", hold=0.0, noise=chosen) for chosen in (None, noise, noise.scaled(5.0))
    )
    np.testing.assert_array_equal(usual.base_estimate, same.base_estimate)
    speed_errors = [r.metrics["estimate_velocity_rms_m_s"] for r in (usual, worse)]
    assert speed_errors[1] > 2.0 * speed_errors[0]
    assert worse.meta["sensor_noise"]["gyro"] == 5.0 * noise.gyro


def test_a_run_survives_its_file(tmp_path, trot):
    _, result = trot
    result.save(tmp_path / "run.npz")
    loaded = Run.load(tmp_path / "run.npz")
    for name in Run.LOGGED:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(result, name))
    assert loaded.metrics == json.loads(json.dumps(result.metrics)) | dict.fromkeys(TIMINGS)
    assert loaded.terrain == result.terrain and loaded.joint_names == result.joint_names
    assert list(tmp_path.iterdir()) == [tmp_path / "run.npz"]
    data = (tmp_path / "run.npz").read_bytes()
    (tmp_path / "half.npz").write_bytes(data[: len(data) // 2])
    with pytest.raises(ValueError, match=r"half\.npz"):
        Run.load(tmp_path / "half.npz")
    np.savez(tmp_path / "other.npz", t=np.zeros(3))
    with pytest.raises(ValueError, match="not a run file"):
        Run.load(tmp_path / "other.npz")


def test_wrong_arguments_are_named():
    plan = handmade.stand(1)
    with pytest.raises(ValueError, match="wheel_model"):
        run(plan, state="estimated", wheel_model="guess")
    with pytest.raises(ValueError, match="state"):
        run(plan, state="guessed")
    for wrong in ({"delay": -0.001}, {"hold": float("nan")}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            run(plan, **wrong)


def test_progress_is_told():
    calls = []
    run(handmade.stand(1), hold=0.2, progress=lambda t, total: calls.append((t, total)))
    assert calls[0][0] == 0.0 and calls[-1][0] == pytest.approx(calls[-1][1])
    assert np.all(np.diff([t for t, _ in calls]) > 0)


def test_interpolation_meets_the_knots_and_is_smooth():
    plan = handmade.trot(0.3, 5)
    for k in range(plan.knots):
        x, v, _ = interpolate(plan, k * plan.dt)
        np.testing.assert_allclose(x, plan.x[k], atol=1e-12)
        np.testing.assert_allclose(v, plan.v[k], atol=1e-12)
        before = interpolate(plan, (k + 1) * plan.dt - 1e-7)
        np.testing.assert_allclose(before[0], plan.x[k + 1], atol=1e-6)
        np.testing.assert_allclose(before[1], plan.v[k + 1], atol=1e-6)


def test_consecutive_swing_slots_are_one_flight():
    plan = handmade.stand(5)
    S = plan.S.copy()
    S[2, 1:3] = S[2, 4] = 1
    flights = swings_of(type(plan)(**{**plan.__dict__, "S": S}))[2]
    assert [(round(f.start, 9), round(f.end, 9)) for f in flights] == [(0.3, 0.9), (1.2, 1.5)]
    assert Tracker(plan, 0.009).stance.all()
