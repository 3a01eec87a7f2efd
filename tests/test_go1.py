"""The robot: one model in two libraries, end effectors that switch, wheels that roll."""

import importlib.util
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wfbook.go1 import ASSETS, FOOT_RADIUS, WHEEL_RADIUS, Go1, LoadedLegError, leg_angles, nominal
from wfbook.go1_dynamics import GRAVITY, MOTORS, Go1Dynamics
from wfbook.modes import LEGS
from wfbook.terrain import Region, Terrain, flat

UP = np.tile([0.0, 0.0, 1.0], (4, 1))


@pytest.fixture(scope="module")
def dynamics() -> Go1Dynamics:
    return Go1Dynamics()


@pytest.fixture(scope="module")
def robot() -> Go1:
    return Go1(flat())


def standing(dynamics: Go1Dynamics, wheels, height: float = 0.265) -> np.ndarray:
    radii = np.where(np.asarray(wheels, bool), WHEEL_RADIUS, FOOT_RADIUS)
    ends = nominal()["hip_offsets"] + np.array([0.0, 0.0, height]) + radii[:, None] * UP
    return dynamics.posture(np.array([0.0, 0.0, height]), np.zeros(3), ends)


def random_states(count: int):
    rng = np.random.default_rng(7)
    for _ in range(count):
        qpos, qvel = rng.uniform(-1.0, 1.0, 23), 2.0 * rng.standard_normal(22)
        qpos[3:7] = rng.standard_normal(4)
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        qpos[7::4], qpos[9::4], qpos[10::4] = 0.5 * qpos[7::4], qpos[9::4] - 1.8, 9.0 * qpos[10::4]
        normals = rng.standard_normal((4, 3)) * [0.2, 0.2, 0.0] + [0.0, 0.0, 1.0]
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        yield qpos, qvel, normals, rng.integers(0, 2, 4).astype(bool)


def to_pinocchio(qpos, qvel):
    """T and c of q̈_pin = T q̈_mj + c, written out independently of the library."""
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, qpos[3:7])
    T, c = np.eye(22), np.zeros(22)
    T[:3, :3] = R.reshape(3, 3).T
    c[:3] = -np.cross(qvel[3:6], T[:3, :3] @ qvel[:3])
    return T, c


def test_masses(dynamics, robot):
    assert dynamics.mass == pytest.approx(13.3, abs=0.01)
    assert robot.model.body_mass.sum() == pytest.approx(dynamics.mass, abs=1e-12)
    wheels = sum(robot.model.body(f"{leg}_wheel").mass[0] for leg in LEGS)
    assert dynamics.mass - wheels == pytest.approx(13.1, abs=0.01)
    assert (robot.model.nq, robot.model.nv, robot.model.nu) == (23, 22, 12)
    assert np.array_equal(dynamics.effort, robot.model.actuator_ctrlrange[:, 1])


def test_mujoco_and_pinocchio_agree_on_the_dynamics(dynamics, robot):
    model, data = robot.model, robot.data
    for qpos, qvel, _, _ in random_states(10):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(model, data)
        dynamics.update(qpos, qvel)
        T, c = to_pinocchio(qpos, qvel)
        M = np.zeros((22, 22))
        mujoco.mj_fullM(model, data, M)
        np.testing.assert_allclose(T.T @ dynamics.M_full @ T, M, atol=1e-9)
        np.testing.assert_allclose(T.T @ (dynamics.h_full + dynamics.M_full @ c), data.qfrc_bias, atol=1e-9)
        np.testing.assert_allclose(dynamics.com, data.subtree_com[1], atol=1e-9)
        np.testing.assert_allclose(
            dynamics.acceleration(qpos, qvel, qpos[:22]), T @ qpos[:22] + c, atol=1e-12
        )


def test_mujoco_and_pinocchio_agree_on_the_contacts(dynamics, robot):
    model, data = robot.model, robot.data
    for qpos, qvel, normals, wheels in random_states(10):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(model, data)
        dynamics.update(qpos, qvel)
        T, c = to_pinocchio(qpos, qvel)
        offsets = dynamics.contact_offsets(normals, wheels)
        jacobian, drift, velocity = dynamics.contacts(offsets)
        kept = np.r_[0:6, MOTORS]
        for leg, name in enumerate(LEGS):
            point = data.site(f"{name}_end").xpos + offsets[leg]
            body = model.body(f"{name}_calf").id
            J, J_dot = np.zeros((3, 22)), np.zeros((3, 22))
            mujoco.mj_jac(model, data, J, None, point, body)
            mujoco.mj_jacDot(model, data, J_dot, None, point, body)
            np.testing.assert_allclose(jacobian[leg] @ T[np.ix_(kept, kept)], J[:, kept], atol=1e-9)
            np.testing.assert_allclose(velocity[leg], J @ qvel, atol=1e-9)
            # MuJoCo's point is painted on the calf; the library's rolls, without the centripetal part
            omega = dynamics.calf_omega[leg]
            painted = drift[leg] + np.cross(omega, np.cross(omega, offsets[leg])) + jacobian[leg] @ c[kept]
            np.testing.assert_allclose(painted, J_dot @ qvel, atol=1e-9)


def test_eliminated_wheels_move_as_the_full_dynamics_say(dynamics):
    """Forces on trunk and motors, none on the wheels: the same accelerations with 18 and 22 unknowns."""
    rng = np.random.default_rng(3)
    for qpos, qvel, _, _ in random_states(3):
        dynamics.update(qpos, qvel)
        kept, force = np.r_[0:6, MOTORS], np.zeros(22)
        force[kept] = rng.standard_normal(18)
        full = np.linalg.solve(dynamics.M_full, force - dynamics.h_full)
        reduced = np.linalg.solve(dynamics.M, force[kept] - dynamics.h)
        np.testing.assert_allclose(reduced, full[kept], atol=1e-7)


def test_drifts_and_jacobians_are_derivatives(dynamics):
    step = 1e-6
    for qpos, qvel, normals, _ in random_states(3):
        feet = np.zeros(4, bool)
        q, v = dynamics.state(qpos, qvel)

        def at(time, q=q, v=v, qpos=qpos, qvel=qvel, normals=normals, feet=feet):
            """Centres, velocities of contacts, CoM and its velocity after coasting with q̈ = 0."""
            later = pin.integrate(dynamics.model, q, v * time)
            moved_qpos, moved_qvel = qpos.copy(), qvel.copy()
            moved_qpos[:3], moved_qpos[3:7] = later[:3], later[[6, 3, 4, 5]]
            moved_qpos[7:] += time * qvel[6:]
            moved_qvel[:3] = pin.Quaternion(later[3:7]).toRotationMatrix() @ v[:3]
            dynamics.update(moved_qpos, moved_qvel)
            velocity = dynamics.contacts(dynamics.contact_offsets(normals, feet))[2]
            return dynamics.centres, velocity, dynamics.com, dynamics.com_velocity

        before, after = at(-step), at(step)
        slopes = [(b - a) / (2 * step) for a, b in zip(before, after, strict=True)]
        dynamics.update(qpos, qvel)
        drift = dynamics.contacts(dynamics.contact_offsets(normals, feet))[1]
        np.testing.assert_allclose(slopes[0], dynamics.centre_velocity, atol=1e-6)
        np.testing.assert_allclose(slopes[1], drift, atol=1e-5)
        np.testing.assert_allclose(slopes[2], dynamics.com_velocity, atol=1e-6)
        np.testing.assert_allclose(slopes[3], dynamics.com_drift, atol=1e-5)


def test_the_contact_offset_is_the_lowest_point_of_the_end_effector(dynamics):
    rng = np.random.default_rng(1)
    directions = rng.standard_normal((200_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    qpos, qvel, normals, _ = next(random_states(1))
    dynamics.update(qpos, qvel)
    offsets = dynamics.contact_offsets(normals, np.ones(4, bool))
    for leg in range(4):
        R = np.array(dynamics.data.oMi[dynamics.model.getJointId(f"{LEGS[leg]}_calf_joint")].rotation)
        surface = directions * [0.04, 0.012, 0.04] @ R.T
        assert offsets[leg] @ normals[leg] == pytest.approx((surface @ normals[leg]).min(), abs=1e-5)


def test_leg_angles_and_posture_reach_what_they_are_asked(dynamics):
    com, rpy = np.array([0.3, -0.2, 0.27]), np.array([0.05, -0.08, 0.3])
    ends = com + nominal()["hip_offsets"] + np.array([[0.02, 0.01, 0.03]])
    qpos = dynamics.posture(com, rpy, ends)
    dynamics.update(qpos, np.zeros(22))
    np.testing.assert_allclose(dynamics.com, com, atol=1e-10)
    np.testing.assert_allclose(dynamics.centres, ends, atol=1e-10)
    with pytest.raises(ValueError, match="RL can't reach"):
        leg_angles(2, np.array([-0.19, 0.13, -0.6]))


def test_nominal_stance_is_level_symmetric_and_evenly_loaded(dynamics):
    values = nominal()
    offsets = values["hip_offsets"]
    np.testing.assert_allclose(offsets.sum(axis=0)[:2], 0.0, atol=1e-12)
    np.testing.assert_allclose(offsets[[1, 0, 3, 2]] * [1, -1, 1], offsets)
    assert np.all(offsets[:, 2] == -values["com_height"])
    np.testing.assert_allclose(offsets[:, :2], values["hips"][:, :2], atol=0.005)
    inside = (dynamics.lower < values["joint_angles"]) & (values["joint_angles"] < dynamics.upper)
    assert inside.all()
    qpos = standing(dynamics, np.zeros(4))
    dynamics.update(qpos, np.zeros(22))
    np.testing.assert_allclose(dynamics.composite_inertia(), values["inertia"], atol=1e-5)
    assert dynamics.mass == pytest.approx(values["mass"], abs=1e-5)


def hold(robot: Go1, qpos: np.ndarray, steps: int) -> None:
    """Hold a posture with stiff joints; enough for tests of contact."""
    for _ in range(steps):
        joints = MOTORS + 1
        robot.step(300.0 * (qpos[joints] - robot.data.qpos[joints]) - 8.0 * robot.data.qvel[MOTORS])


@pytest.mark.parametrize("kinds", [[0, 0, 0, 0], [1, 1, 1, 1], [1, 0, 0, 1]])
def test_end_effectors_carry_the_robot_at_their_own_height(robot, dynamics, kinds):
    qpos = standing(dynamics, kinds)
    robot.reset(qpos, np.array(kinds))
    hold(robot, qpos, 600)
    forces = robot.contact_forces()
    assert forces[:, 2].sum() == pytest.approx(-dynamics.mass * GRAVITY[2], rel=0.02)
    radii = np.where(np.array(kinds) == 1, WHEEL_RADIUS, FOOT_RADIUS)
    np.testing.assert_allclose(robot.centres[:, 2], radii, atol=0.0015)
    assert [robot.end_effector(leg) for leg in LEGS] == [("foot", "wheel")[kind] for kind in kinds]
    assert not robot.touches_with_hull()


def test_a_loaded_leg_refuses_to_switch_and_a_lifted_one_switches(robot, dynamics):
    qpos = standing(dynamics, np.zeros(4))
    robot.reset(qpos, np.zeros(4))
    hold(robot, qpos, 300)
    with pytest.raises(LoadedLegError, match="FL carries"):
        robot.set_end_effector("FL", "wheel")
    assert robot.end_effector("FL") == "foot"
    robot.set_end_effector("FL", "foot")
    qpos[2] += 0.1
    robot.reset(qpos, np.zeros(4))
    robot.set_end_effector("FL", "wheel")
    assert robot.end_effector("FL") == "wheel"
    assert robot.end_effectors.tolist() == [1, 0, 0, 0]
    for wrong in (("XX", "foot"), ("FL", "ski")):
        with pytest.raises(ValueError, match="is none of"):
            robot.set_end_effector(*wrong)


@pytest.mark.parametrize("resistance", [0.0, 0.02])
def test_a_pushed_robot_rolls_without_slipping_and_resistance_slows_it(dynamics, resistance):
    robot = Go1(flat(rolling_resistance=resistance))
    qpos = standing(dynamics, np.ones(4))
    robot.reset(qpos, np.ones(4))
    hold(robot, qpos, 200)
    robot.push(np.array([30.0, 0.0, 0.0]))
    hold(robot, qpos, 200)
    robot.push(np.zeros(3))
    hold(robot, qpos, 200)
    start = robot.data.qvel[0]
    hold(robot, qpos, 400)
    lost = start - robot.data.qvel[0]
    assert start > 0.3
    spin = robot.data.qvel[9::4]
    np.testing.assert_allclose(spin * robot.centres[:, 2], robot.data.qvel[0], rtol=0.01)
    assert lost == pytest.approx(resistance * 9.81 * 0.4, abs=0.003, rel=0.02)
    assert abs(robot.data.qvel[1]) < 0.002


def test_friction_is_the_terrains_and_the_end_effectors_own(dynamics):
    """Pushed sideways with a sixth of its weight: rubber stays, ice slides; feet and wheels differ."""
    square = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]]
    for kind, mu_foot, mu_wheel, slides in [
        (0, 0.8, 0.1, False),
        (0, 0.1, 0.8, True),
        (1, 0.1, 0.8, False),
        (1, 0.8, 0.1, True),
    ]:
        robot = Go1(Terrain("ice", (Region(np.array(square), mu_foot, 0.02, mu_wheel, 0.0, "deck"),)))
        kinds = np.full(4, kind)
        qpos = standing(dynamics, kinds, 0.2)
        robot.reset(qpos, kinds)
        hold(robot, qpos, 200)
        before = robot.centres[:, 1].mean()
        robot.push(np.array([0.0, 20.0, 0.0]))
        hold(robot, qpos, 300)
        assert (robot.centres[:, 1].mean() - before > 0.025) == slides


def test_a_sloped_triangle_is_as_high_as_its_region_says(dynamics):
    corners = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.2], [0.0, 1.0, 0.1]])
    terrain = Terrain("slope", (Region(corners, 0.9, 0.02, 0.9, 0.0, "deck"),))
    robot = Go1(terrain)
    top = terrain.height(0.1, -0.2)
    down = np.array([0.1, -0.2, 1.0]), np.array([0.0, 0.0, -1.0])
    hit = mujoco.mj_ray(
        robot.model, robot.data, *down, np.array([1, 0, 0, 0, 0, 0], np.uint8), 1, -1, np.zeros(1, np.int32)
    )
    assert 1.0 - hit == pytest.approx(top, abs=1e-6)


def test_building_the_assets_again_gives_the_same_bytes(tmp_path):
    spec = importlib.util.spec_from_file_location("build", ASSETS / "build.py")
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    build.build(tmp_path)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == sorted(
        path.name for path in Path(ASSETS).iterdir() if path.suffix in (".xml", ".obj", ".json")
    )
    for name in names:
        assert (tmp_path / name).read_bytes() == (ASSETS / name).read_bytes(), name
    assert sum((tmp_path / name).stat().st_size for name in names) < 200_000
