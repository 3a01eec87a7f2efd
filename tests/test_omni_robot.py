"""Paper B's robot: one model in two libraries, its nominal posture, wheels that roll and touch in a line."""

import importlib.util
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from wfbook.modes import LEGS
from wfbook.omni import robot
from wfbook.omni.driving import holding_torques
from wfbook.omni.robot import ASSETS, NQ, NU, NV, Omni, OmniDynamics
from wfbook.terrain import flat

FRAMES = [*(f"{leg}_{place}" for leg in LEGS for place in ("axle", "contact")), "hand", "imu"]


@pytest.fixture(scope="module")
def omni() -> Omni:
    return Omni(flat())


@pytest.fixture(scope="module")
def dynamics() -> OmniDynamics:
    return OmniDynamics()


def random_states(count: int):
    rng = np.random.default_rng(7)
    for _ in range(count):
        qpos, qvel = rng.uniform(-1.0, 1.0, NQ), 2.0 * rng.standard_normal(NV)
        qpos[3:7] = rng.standard_normal(4)
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        qpos[1 + robot.STEERS_V] *= 9.0
        qpos[1 + robot.WHEELS_V] *= 9.0
        yield qpos, qvel


def to_pinocchio(qpos, qvel):
    """T and c of q̈_pin = T q̈_mj + c, written out independently of the library."""
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, qpos[3:7])
    T, c = np.eye(NV), np.zeros(NV)
    T[:3, :3] = R.reshape(3, 3).T
    c[:3] = -np.cross(qvel[3:6], T[:3, :3] @ qvel[:3])
    return T, c


def test_sizes_names_and_limits(omni, dynamics):
    model = omni.model
    assert (model.nq, model.nv, model.nu) == (NQ, NV, NU) == (30, 29, 23)
    assert tuple(model.joint(i).name for i in range(1, model.njnt)) == robot.JOINTS
    assert tuple(model.joint(model.actuator_trnid[i, 0]).name for i in range(NU)) == robot.JOINTS
    for part, indices in zip(
        robot.PARTS, (robot.HIPS_V, robot.KNEES_V, robot.STEERS_V, robot.WHEELS_V), strict=True
    ):
        for leg, index in zip(LEGS, indices, strict=True):
            assert model.joint(f"{leg}_{part}_joint").dofadr[0] == index
            assert model.joint(f"{leg}_{part}_joint").qposadr[0] == index + 1
    parts = [range(6), robot.LEGS_V, robot.STEERS_V, robot.WHEELS_V, robot.ARM_V, [robot.GRIPPER_V]]
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(NV))
    assert not model.jnt_limited[1 + robot.STEERS_V - 6].any()  # 360 degrees, and on
    assert np.array_equal(dynamics.efforts, omni.efforts)
    assert dynamics.mass == pytest.approx(model.body_mass.sum(), abs=1e-9)


def test_locking_steering_wheels_and_gripper_leaves_the_papers_41_states():
    locked = robot.locked_model()
    assert (locked.nq, locked.nv) == (21, 20)
    assert locked.nq + locked.nv == 41
    assert locked.nv - 6 == 14
    assert locked.names[1] == "root_joint"
    assert list(locked.names)[2:] == [
        name for name in robot.JOINTS if not any(part in name for part in ("steer", "wheel", "gripper"))
    ]


def test_mujoco_and_pinocchio_agree_on_the_dynamics(omni, dynamics):
    model, data = omni.model, omni.data
    for qpos, qvel in random_states(10):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(model, data)
        dynamics.update(qpos, qvel)
        T, c = to_pinocchio(qpos, qvel)
        M = np.zeros((NV, NV))
        mujoco.mj_fullM(model, data, M)
        np.testing.assert_allclose(T.T @ dynamics.M @ T, M, atol=1e-9)
        np.testing.assert_allclose(T.T @ (dynamics.h + dynamics.M @ c), data.qfrc_bias, atol=1e-9)
        np.testing.assert_allclose(dynamics.com, data.subtree_com[1], atol=1e-9)
        np.testing.assert_allclose(dynamics.velocity, T @ qvel, atol=1e-12)
        np.testing.assert_allclose(dynamics.acceleration(qpos, qvel, qvel), T @ qvel + c, atol=1e-12)


@pytest.mark.parametrize("frame", FRAMES)
def test_mujoco_and_pinocchio_agree_on_the_frames(omni, dynamics, frame):
    model, data = omni.model, omni.data
    for qpos, qvel in random_states(3):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(model, data)
        dynamics.update(qpos, qvel)
        site, (T, c) = data.site(frame), to_pinocchio(qpos, qvel)
        J, rates = np.zeros((6, NV)), np.zeros((6, NV))
        mujoco.mj_jacSite(model, data, J[:3], J[3:], site.id)
        body = int(model.site_bodyid[site.id])
        mujoco.mj_jacDot(model, data, rates[:3], rates[3:], site.xpos, body)
        position, orientation = dynamics.placement(frame)
        np.testing.assert_allclose(position, site.xpos, atol=1e-9)
        np.testing.assert_allclose(orientation, site.xmat.reshape(3, 3), atol=1e-9)
        np.testing.assert_allclose(dynamics.jacobian(frame) @ T, J, atol=1e-9)
        np.testing.assert_allclose(
            dynamics.drift(frame) + dynamics.jacobian(frame) @ c, rates @ qvel, atol=1e-9
        )


def test_states_are_translated_there_and_back(dynamics):
    for qpos, qvel in random_states(5):
        back = dynamics.mujoco_state(*dynamics.state(qpos, qvel))
        np.testing.assert_allclose(back[0], qpos, atol=1e-14)
        np.testing.assert_allclose(back[1], qvel, atol=1e-14)


def test_the_nominal_posture_is_the_papers_target(omni):
    omni.reset(robot.posture())
    np.testing.assert_allclose(omni.model.key("nominal").qpos, robot.posture(), atol=1e-11)
    position, orientation = omni.hand
    assert position[2] == pytest.approx(0.92, abs=1e-9)
    np.testing.assert_allclose(
        Rotation.from_matrix(orientation).as_euler("xyz"), [-np.pi / 2, 0.0, -np.pi / 2], atol=1e-6
    )
    np.testing.assert_allclose(omni.centres[:, 2], robot.WHEEL_RADIUS, atol=1e-12)
    np.testing.assert_allclose(omni.centres[:, :2], robot.WHEEL_POSITIONS, atol=1e-12)
    np.testing.assert_allclose(robot.WHEEL_POSITIONS.sum(axis=0), 0.0, atol=1e-15)
    for leg in LEGS:  # the steering axis is vertical
        np.testing.assert_allclose(omni.data.body(f"{leg}_fork").xmat[6:], [0, 0, 1], atol=1e-12)
    lower, upper = omni.model.jnt_range[1:].T
    inside = (omni.data.qpos[7:] >= lower) & (omni.data.qpos[7:] <= upper)
    assert inside[omni.model.jnt_limited[1:].astype(bool)].all()


def test_steering_does_not_move_the_wheels_middle(omni):
    qpos = robot.posture()
    qpos[1 + robot.STEERS_V] = [0.3, -1.2, 2.5, 7.0]
    omni.reset(qpos)
    np.testing.assert_allclose(omni.centres[:, :2], robot.WHEEL_POSITIONS, atol=1e-12)
    angle = qpos[1 + robot.STEERS_V]
    expected = np.column_stack([-np.sin(angle), np.cos(angle), np.zeros(4)])
    np.testing.assert_allclose(omni.axles, expected, atol=1e-12)


@pytest.mark.parametrize("x, z", [(0.0, -0.345), (0.1, -0.3), (-0.12, -0.5), (0.05, -0.25)])
def test_leg_angles_reach(omni, x, z):
    qpos = robot.posture()
    qpos[:7] = 0, 0, 0, 1, 0, 0, 0
    qpos[1 + robot.LEGS_V] = np.tile(robot.leg_angles(np.array([x, z])), 4)
    omni.reset(qpos)
    np.testing.assert_allclose(omni.centres - robot.HIPS, np.tile([x, 0.0, z], (4, 1)), atol=1e-9)
    assert (qpos[1 + robot.KNEES_V] < 0).all()


@pytest.mark.parametrize("ahead, up, pitch", [(0.45, 0.2165, 0.0), (0.5, 0.1, 0.4), (0.6, 0.4, -0.7)])
def test_arm_angles_reach(omni, ahead, up, pitch):
    qpos = robot.posture()
    qpos[:7] = 0, 0, 0, 1, 0, 0, 0
    qpos[1 + robot.ARM_V] = robot.arm_angles(ahead, up, pitch)
    omni.reset(qpos)
    position, orientation = omni.hand
    np.testing.assert_allclose(position, robot.SHOULDER + np.array([ahead, 0.0, up]), atol=1e-9)
    np.testing.assert_allclose(orientation[:, 2], [np.cos(pitch), 0.0, -np.sin(pitch)], atol=1e-9)


def test_out_of_reach_is_said():
    with pytest.raises(ValueError, match="no leg can reach"):
        robot.leg_angles(np.array([0.0, -0.7]))
    with pytest.raises(ValueError, match="arm can't reach"):
        robot.arm_angles(1.5, 0.0)


def hold(omni: Omni, seconds: float, wheel_speed: float = 0.0, steer: float = 0.0):
    """Hold posture and steering by the motors' PD loops, turn the wheels at a speed."""
    angles, rates = robot.posture()[7:], np.zeros(NU)
    angles[robot.STEERS_V - 6] = steer
    rates[robot.WHEELS_V - 6] = wheel_speed
    for _ in range(round(1000 * seconds)):
        omni.step(omni.servo(angles, rates))


@pytest.mark.parametrize("steer", [0.0, np.pi / 2, 0.7])
def test_it_stands_and_rolls_where_the_wheels_point(steer):
    omni = Omni(flat())
    qpos = robot.posture()
    qpos[1 + robot.STEERS_V] = steer
    omni.reset(qpos)
    hold(omni, 0.5, steer=steer)
    assert np.abs(omni.data.qvel[:6]).max() < 0.03  # it sinks into its springs
    weight = omni.model.body_subtreemass[1] * 9.81
    assert omni.contact_wrenches()[:, 2].sum() == pytest.approx(weight, rel=0.01)
    hold(omni, 0.5, wheel_speed=4.0, steer=steer)
    start = omni.data.qpos[:3].copy()
    angle = omni.data.qpos[1 + robot.WHEELS_V].copy()
    hold(omni, 0.5, wheel_speed=4.0, steer=steer)
    rolled = robot.WHEEL_RADIUS * (omni.data.qpos[1 + robot.WHEELS_V] - angle).mean()
    moved = omni.data.qpos[:2] - start[:2]
    np.testing.assert_allclose(moved, rolled * np.array([np.cos(steer), np.sin(steer)]), atol=2e-3)
    assert rolled == pytest.approx(0.5 * 4.0 * robot.WHEEL_RADIUS, rel=0.05)
    assert not omni.touches_with_hull()


def test_a_wheel_touches_in_a_line_that_carries_a_moment():
    """Push sideways: each wheel's moment about its rolling direction is within half the line times load."""
    omni = Omni(flat())
    hold(omni, 0.4)
    omni.push(np.array([0.0, 60.0, 0.0]))
    hold(omni, 0.6)
    wrenches = omni.contact_wrenches()
    np.testing.assert_allclose(wrenches[:, 1].sum(), -60.0, atol=1.5)
    most = robot.WHEEL_HALF_WIDTH * wrenches[:, 2]
    assert (np.abs(wrenches[:, 3]) <= 1.1 * most).all()
    assert np.abs(wrenches[:, 3]).max() > 0.1 * most.mean()
    assert np.abs(wrenches[:, 4]).max() < 0.02 * 0.085 * wrenches[:, 2].max()  # none about the axle


def test_payload_and_trunk_mass(omni):
    heavy = Omni(flat(), trunk_mass_scale=1.1, payload=1.0)
    assert (heavy.model.nq, heavy.model.nv) == (NQ, NV)
    trunk = omni.model.body("trunk").mass[0]
    assert heavy.model.body_mass.sum() - omni.model.body_mass.sum() == pytest.approx(1.0 + 0.1 * trunk)
    heavy.reset(robot.posture())
    np.testing.assert_allclose(heavy.data.body("payload").xpos, heavy.hand[0], atol=1e-12)


def test_the_lowest_point_of_a_wheel_is_on_its_rim():
    axle = np.array([[0.0, 1.0, 0.0], [0.0, np.cos(0.3), np.sin(0.3)]])
    offsets = robot.contact_offsets(axle, np.tile([0.0, 0.0, 1.0], (2, 1)))
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), robot.WHEEL_RADIUS)
    np.testing.assert_allclose(np.sum(offsets * axle, axis=1), 0.0, atol=1e-15)
    assert offsets[1, 2] == pytest.approx(-robot.WHEEL_RADIUS * np.cos(0.3))


def test_contact_constraints_of_the_nominal_stance_are_rank_deficient(dynamics):
    """No abduction: four wheels held in three directions are 12 rows of rank 10 (10 rows do as well)."""
    dynamics.update(robot.posture(), np.zeros(NV))
    fixed = np.ones(NV, bool)
    fixed[[*robot.STEERS_V, *robot.WHEELS_V, robot.GRIPPER_V]] = False
    rows = np.vstack([dynamics.jacobian(f"{leg}_contact")[:3, fixed] for leg in LEGS])
    fewer = np.vstack(
        [
            dynamics.jacobian(f"{leg}_contact")[[0, 1, 2] if leg in ("FL", "RR") else [0, 2]][:, fixed]
            for leg in LEGS
        ]
    )
    assert np.linalg.matrix_rank(rows) == np.linalg.matrix_rank(fewer) == len(fewer) == 10


def test_building_the_assets_again_gives_the_same_bytes(tmp_path):
    spec = importlib.util.spec_from_file_location("build_omni", ASSETS / "build.py")
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    build.build(tmp_path)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == sorted(path.name for path in Path(ASSETS).iterdir() if path.suffix in (".xml", ".obj"))
    for name in names:
        assert (tmp_path / name).read_bytes() == (ASSETS / name).read_bytes(), name
    assert sum((tmp_path / name).stat().st_size for name in names) < 200_000


def test_pinocchio_reads_the_sites_as_frames(dynamics):
    for frame in FRAMES:
        assert dynamics.model.existFrame(frame, pin.FrameType.OP_FRAME), frame


def test_it_stands_without_jitter_and_coasts_without_resistance():
    omni = Omni(flat())
    posture, torques = robot.posture(), holding_torques(robot.posture())
    forces = []
    for step in range(1200):
        omni.step(omni.servo(posture[7:], np.zeros(NU), torques))
        if step >= 1000:
            forces.append(omni.contact_wrenches()[:, 2])
    assert np.std(forces, axis=0).max() < 0.01
    qvel = np.zeros(NV)
    qvel[0], qvel[robot.WHEELS_V] = 1.0, 1.0 / robot.WHEEL_RADIUS
    omni.reset(omni.data.qpos.copy(), qvel)
    for _ in range(2000):
        motors = omni.servo(posture[7:], np.zeros(NU), torques)
        motors[robot.WHEELS_V - 6] = 0.0
        omni.step(motors)
    assert omni.data.qvel[0] == pytest.approx(1.0, abs=2e-3)
