"""The whole-body controller in MuJoCo: waves, baselines, faults, run files."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from wfbook.omni import simulate
from wfbook.omni.base import Base
from wfbook.omni.controller import FEEDBACK, WholeBody
from wfbook.omni.habits import Habits
from wfbook.omni.locked import locked_state, nominal_target
from wfbook.omni.robot import HAND_RPY, NV, WHEEL_POSITIONS, Omni, posture
from wfbook.omni.rolling import Axes, Wheels
from wfbook.omni.simulate import CONTROLLERS, TIMINGS, Noise, OmniRun, run
from wfbook.omni.two_modes import RollTo
from wfbook.omni.waves import Ground, waves
from wfbook.terrain import flat
from wfbook.view import replay

ON_THE_WAVES = [(3.2, [1.0, 0.0, 0.0])]
UP = np.tile([0.0, 0.0, 1.0], (4, 1))


@pytest.fixture(scope="module")
def terrain():
    return waves()


@pytest.fixture(scope="module")
def ddp(terrain):
    return run(terrain, ON_THE_WAVES, start=-0.8)


def test_the_hand_stays_up_over_waves(ddp):
    assert ddp.metrics["finished"]
    assert ddp.metrics["hand_height_std_m"] < 0.002
    assert ddp.metrics["hand_height_max_error_m"] < 0.006
    assert ddp.metrics["hand_turn_max_rad"] < 0.05
    assert ddp.metrics["rest_speed_m_s"] < 0.02
    assert ddp.p[:, :, 2].max() > 0.19  # it was up there
    assert ddp.metrics["distance_m"] == pytest.approx(ddp.pose[-1, 0] - ddp.pose[0, 0], abs=0.02)


def test_noise_delay_payload_and_a_heavy_trunk_do_little_harm():
    """On seven waves, further than a robot gets whose horizon does not know the ground ahead."""
    hard = {"delay": 0.012, "noise": Noise(), "payload": 1.0, "trunk_mass_scale": 1.1}
    disturbed = run(waves(7), [(4.0, [1.0, 0.0, 0.0])], start=-0.8, **hard)
    assert disturbed.metrics["finished"]
    assert disturbed.metrics["hand_height_std_m"] < 0.004
    assert disturbed.metrics["hand_height_max_error_m"] < 0.012
    assert disturbed.meta["payload_estimate"] == pytest.approx(1.0, abs=0.3)


def test_the_baseline_decides_the_headline(terrain, ddp):
    target = simulate.baseline_target()
    level, true = (
        run(terrain, ON_THE_WAVES, f"ik-{k}", start=-0.8, target=target) for k in ("level", "true")
    )
    assert level.metrics["hand_height_std_m"] > 20 * true.metrics["hand_height_std_m"]
    assert level.metrics["hand_height_std_m"] > 0.05
    assert true.metrics["hand_height_std_m"] < 0.002


def test_roll_pitch_and_yaw_are_those_of_the_paper(ddp):
    spread = 0.0
    for name, wanted in zip(("roll", "pitch", "yaw"), HAND_RPY, strict=True):
        assert ddp.metrics[f"hand_{name}_mean_rad"] == pytest.approx(wanted, abs=0.02)
        spread += ddp.metrics[f"hand_{name}_std_rad"] ** 2
    assert 0.0 < spread < ddp.metrics["hand_turn_max_rad"] ** 2


def test_the_horizon_knows_the_ground_ahead():
    """What is planned for the wheels is where they would ride on the waves, slope by slope."""
    speed, ground = 1.0, Ground(waves(7))
    driver = WholeBody(ground)
    driver.wheels.base.state[:4] = 2.0, 0.0, 0.0, speed
    middles = np.column_stack([WHEEL_POSITIONS, np.zeros(4)])
    driver.wheels.command(middles, UP)
    heights = driver._heights(middles)
    ways = driver.wheels.velocities(middles, heights, driver.ocp.dt)
    np.testing.assert_allclose(ways[..., :2], 0.0, atol=1e-12)
    x = 2.0 + WHEEL_POSITIONS[:, 0] + speed * driver.ocp.dt * np.arange(driver.ocp.nodes + 1)[:, None]
    exact = ground.ride(np.column_stack([x.ravel(), 0 * x.ravel()]), np.tile([1.0, 0.0], (x.size, 1)))
    np.testing.assert_allclose(heights[1:-1], exact[0].reshape(x.shape), atol=1e-9)
    normals = exact[1].reshape(*x.shape, 3)
    np.testing.assert_allclose(ways[..., 2], -speed * normals[..., 0] / normals[..., 2], atol=0.06)
    climbed = driver.ocp.dt * (ways[:-1, :, 2] + ways[1:, :, 2]).sum(axis=0) / 2
    np.testing.assert_allclose(climbed, heights[-2] - heights[1], atol=0.002)


def test_wheels_that_turn_with_the_base_are_foreseen_on_their_circles():
    wheels = Wheels(Base())
    wheels.base.state[:] = 1.0, -2.0, 0.3, 0.0, 0.0, 0.8
    places, times = np.column_stack([WHEEL_POSITIONS, np.zeros(4)]), np.array([0.0, 0.5, 2.0])
    found, _ = wheels.ahead(places, times)
    for t, row in zip(times, found, strict=True):
        turned = pin.utils.rotate("z", 0.3 + 0.8 * t)[:2, :2]
        np.testing.assert_allclose(row, [1.0, -2.0] + WHEEL_POSITIONS @ turned.T, atol=1e-12)
    assert np.abs(found[2] - found[0]).max() > 0.3


@pytest.mark.parametrize("twist", [[0.3, 0.3, 0.0], [0.0, 0.0, 0.8], [0.25, 0.0, 0.5]])
def test_any_way_of_driving_leaves_the_hand_where_it_is(twist):
    driven = run(flat(), [(1.5, twist)])
    assert driven.metrics["hand_height_max_error_m"] < 0.002
    assert driven.metrics["hand_turn_max_rad"] < 0.01
    assert np.abs(driven.pose[-1]).max() > 0.2
    assert np.linalg.norm(driven.qpos[:, :2] - driven.pose[:, :2], axis=1).max() < 0.02
    assert np.abs(driven.yaw - driven.pose[:, 2]).max() < 0.04


def test_the_payload_is_weighed():
    loaded = run(flat(), [(0.5, [0.0, 0.0, 0.0])], payload=0.7)
    assert loaded.meta["payload_estimate"] == pytest.approx(0.7, abs=0.02)
    assert run(flat(), [(0.2, [0.0, 0.0, 0.0])]).meta["payload_estimate"] < 0.01


def test_a_payload_hangs_in_the_hand():
    with_, without = Omni(flat(), payload=1.0), Omni(flat())
    for robot in (with_, without):
        robot.reset(posture())
    arm = slice(22, 28)
    more = (with_.data.qfrc_bias - without.data.qfrc_bias)[arm]
    lever = with_.hand[0] - with_.data.xanchor[with_.model.joint("arm2_joint").id]
    assert more[1] == pytest.approx(-9.81 * lever[0], rel=1e-6)


def test_a_fall_is_noted_and_the_robot_comes_to_rest():
    fallen = run(flat(), [(1.5, [0.3, 0.0, 0.0])], push=([0.0, 500.0, 0.0], 0.3, 0.2))
    assert not fallen.metrics["upright"] and not fallen.metrics["finished"]
    assert len(fallen.events) == 1 and "fallen" in fallen.events[0][1]
    assert 0.3 < fallen.events[0][0] < 1.5
    assert fallen.metrics["rest_speed_m_s"] < 0.1


def test_a_target_out_of_reach_is_noted_and_the_robot_stays_up():
    target = nominal_target()
    away = np.add(target.hand, [0.5, 0.0, 0.5])
    far = run(flat(), [(3.0, [0.0, 0.0, 0.0])], target=replace(target, hand=away))
    assert far.metrics["upright"]
    assert any("out of reach" in what for _, what in far.events)
    assert far.metrics["rest_speed_m_s"] < 0.1


def test_solutions_that_are_not_finite_end_the_run(monkeypatch):
    def fails(self, x, iterations=100):
        raise FloatingPointError

    monkeypatch.setattr(simulate.WholeBody, "_weigh", lambda self, x: None)
    monkeypatch.setattr("wfbook.omni.problem.OptimalControl.solve", fails)
    stopped = run(flat(), [(1.0, [0.2, 0.0, 0.0])])
    assert "no finite solution" in stopped.events[0][1]
    assert stopped.metrics["upright"]
    assert stopped.metrics["rest_speed_m_s"] < 0.05


def test_the_same_seed_is_the_same_run_and_its_file_comes_back(tmp_path):
    once, again = (run(flat(), [(0.2, [0.2, 0.0, 0.0])], noise=Noise(), seed=3) for _ in range(2))
    once.save(tmp_path / "a.npz")
    again.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    back = OmniRun.load(tmp_path / "a.npz")
    for name in OmniRun.LOGGED:
        np.testing.assert_array_equal(getattr(back, name), getattr(once, name))
    assert back.metrics == {k: None if k in TIMINGS else v for k, v in once.metrics.items()}
    assert back.terrain == once.terrain and back.meta == once.meta
    (tmp_path / "a.npz").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="not a run of part II"):
        OmniRun.load(tmp_path / "a.npz")


def test_a_run_can_be_replayed(ddp):
    assert "omni" in replay.html(ddp).lower() or len(replay.html(ddp)) > 1e5


def test_what_is_wrong_is_said():
    with pytest.raises(ValueError, match="controller: 'magic' is none of"):
        run(flat(), [(1.0, [0, 0, 0])], controller="magic")
    with pytest.raises(ValueError, match="course"):
        run(flat(), [])
    still = [(1.0, [0, 0, 0])]
    for name, value in (("delay", -0.01), ("payload", np.nan), ("trunk_mass_scale", 0.0), ("rest", np.inf)):
        with pytest.raises(ValueError, match=f"{name}: {value} must be"):
            run(flat(), still, **{name: value})
    with pytest.raises(ValueError, match="course: with tasks besides twists"):
        run(flat(), [RollTo(0.5)], habits=Habits())
    assert set(CONTROLLERS) == {"ddp", "ik-level", "ik-true"}


def test_a_robot_that_drives_as_commanded_stands_still_in_the_bases_axes():
    rng = np.random.default_rng(0)
    state = rng.standard_normal(6)
    qpos, qvel = posture(), np.zeros(NV)
    yaw = pin.utils.rotate("z", state[2])
    at_rest = locked_state(qpos, qvel)
    qpos[:3] = yaw @ qpos[:3] + [state[0], state[1], 0.0]
    qpos[3:7] = pin.Quaternion(yaw).coeffs()[[3, 0, 1, 2]]
    qvel[:2], qvel[5] = (yaw @ [state[3], state[4], 0.0])[:2], state[5]
    np.testing.assert_allclose(Axes(state).state(locked_state(qpos, qvel)), at_rest, atol=1e-12)


def test_wheels_that_are_behind_catch_up():
    wheels = Wheels(Base())
    places = np.column_stack([WHEEL_POSITIONS, np.zeros(4)])
    assert np.all(wheels.command(places, UP) == 0.0)
    behind = places.copy()
    behind[0, 0] -= 0.05
    rates = wheels.command(behind, UP)
    assert rates[0] > 0.0 and np.all(rates[1:] == 0.0)
    for _ in range(600):
        wheels.advance(np.array([0.5, 0.0, 0.0]), FEEDBACK)
    level, left = wheels.command(places, UP), places.copy()
    left[:, 1] += 0.05
    wheels.command(left, UP)
    assert np.all(wheels.steering < -0.01)
    slope = np.tile([-np.sin(0.2), 0.0, np.cos(0.2)], (4, 1))
    np.testing.assert_allclose(wheels.command(places, slope), level / np.cos(0.2))


def test_a_controller_keeps_up_with_what_it_has_not_seen_yet():
    robot = Omni(flat())
    driver = WholeBody(Ground(flat()), delay=0.01)
    for _ in range(30):
        command = driver.tick(robot.data.qpos.copy(), robot.data.qvel.copy(), np.zeros(3))
    assert np.all(np.isfinite(command.torques))
    assert np.abs(command.torques).max() < 60.0
