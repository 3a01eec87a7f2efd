"""Chapter 10: contact-constrained dynamics against MuJoCo's, differences, and what physics demands."""

import mujoco
import numpy as np
import pytest

from wfbook.modes import LEGS
from wfbook.omni.dynamics import LOCKED, ROWS, constrained, contact_rows, forward_dynamics, touch
from wfbook.omni.robot import NU, NV, STEERS_V, WHEEL_RADIUS, WHEELS_V, Omni, OmniDynamics, posture
from wfbook.terrain import flat

ALL = dict.fromkeys(LEGS, "xyz")


@pytest.fixture(scope="module")
def dynamics():
    return OmniDynamics()


@pytest.fixture(scope="module")
def robot():
    """The robot on its wheels, steered and rolling."""
    robot = Omni(flat())
    qpos = posture()
    qpos[1 + STEERS_V] = [0.3, -0.2, 0.1, 0.5]
    robot.reset(qpos)
    angles, rates = qpos[7:].copy(), np.zeros(NU)
    for tick in range(600):
        rates[WHEELS_V - 6] = 2.0 if tick > 300 else 0.0
        robot.push(np.array([20.0, -10.0, 0.0]) if tick > 300 else np.zeros(3))
        robot.step(robot.servo(angles, rates))
    return robot


def rolling(qpos, speed=0.7):
    """A velocity with which all wheels roll straight ahead."""
    qvel = np.zeros(NV)
    qvel[0], qvel[WHEELS_V] = speed, speed / WHEEL_RADIUS
    return qvel


def test_ten_rows_have_rank_ten_and_twelve_have_no_more(dynamics):
    dynamics.update(posture(), np.zeros(NV))
    kept = np.setdiff1d(np.arange(NV), LOCKED)
    rank = {name: np.linalg.matrix_rank(contact_rows(dynamics, rows)[0][:, kept], 1e-6) for name, rows in
            (("ten", ROWS), ("twelve", ALL))}  # fmt: skip
    assert rank == {"ten": 10, "twelve": 10} and len(contact_rows(dynamics)[0]) == 10
    with pytest.raises(np.linalg.LinAlgError, match="depend on each other"):
        forward_dynamics(dynamics, posture(), np.zeros(NV), np.zeros(NU), ALL, locked=LOCKED)
    answer = forward_dynamics(dynamics, posture(), np.zeros(NV), np.zeros(NU), ALL, 1e-6, LOCKED)
    exact = forward_dynamics(dynamics, posture(), np.zeros(NV), np.zeros(NU), ROWS, locked=LOCKED)
    assert answer.acceleration == pytest.approx(exact.acceleration, abs=1e-2)


def test_wheels_that_roll_do_not_slip(dynamics):
    qpos = posture()
    dynamics.update(qpos, rolling(qpos))
    J, _ = contact_rows(dynamics, ALL)
    assert J @ dynamics.velocity == pytest.approx(np.zeros(12), abs=1e-12)


def test_the_drift_is_the_change_of_the_jacobian(dynamics):
    """Eq. 3, by finite differences."""
    random = np.random.default_rng(0)
    model, h = Omni(flat()).model, 1e-6
    for _ in range(3):
        qpos, qvel = posture(), random.normal(size=NV)
        qpos[3:7] += 0.1 * random.normal(size=4)
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        qpos[1 + STEERS_V] = random.uniform(-1, 1, 4)

        def slip(duration, qpos=qpos, qvel=qvel):
            moved = qpos.copy()
            mujoco.mj_integratePos(model, moved, qvel, duration)
            dynamics.update(moved, qvel)
            return contact_rows(dynamics, ALL)[0] @ dynamics.velocity

        rate = (slip(h) - slip(-h)) / (2 * h)
        dynamics.update(qpos, qvel)
        J, drift = contact_rows(dynamics, ALL)
        # A constant velocity of MuJoCo's is none of Pinocchio's: the trunk's axes turn.
        assert drift + J @ dynamics.acceleration(qpos, qvel, np.zeros(NV)) == pytest.approx(rate, abs=1e-6)


def test_mujocos_contact_wrenches_give_mujocos_acceleration(robot, dynamics):
    """Paper B, eq. 2, with the wrenches that MuJoCo has found, at the contacts that we have."""
    data = robot.data
    robot.model.opt.tolerance, robot.model.opt.iterations = 1e-15, 500  # its solver stops early else
    mujoco.mj_forward(robot.model, data)
    dynamics.update(data.qpos, data.qvel)
    wrenches = robot.contact_wrenches()
    assert (wrenches[:, 2] > 20.0).all() and np.abs(wrenches[:, 5]).max() > 0.01, "in contact, and twisted"
    generalised = np.concatenate([np.zeros(6), data.actuator_force])
    for leg, wrench in zip(LEGS, wrenches, strict=True):
        generalised += touch(dynamics, leg).J.T @ wrench
    trunk = robot.model.body("trunk").id
    jacobian = np.zeros((3, NV))
    mujoco.mj_jacBodyCom(robot.model, data, jacobian, None, trunk)
    push = jacobian.T @ data.xfrc_applied[trunk, :3]
    push[:3] = dynamics.R_wb.T @ push[:3]
    acceleration = dynamics.acceleration(data.qpos, data.qvel, data.qacc)
    ours = dynamics.M @ acceleration + dynamics.h
    ours[-1] = generalised[-1]  # the gripper is at its stop, whose force is no contact's
    assert ours == pytest.approx(generalised + push, abs=1e-9)


def test_at_rest_eq_4_finds_mujocos_forces(dynamics):
    robot = Omni(flat())
    angles = posture()[7:]
    for _ in range(2500):
        robot.step(robot.servo(angles, np.zeros(NU)))
    data = robot.data
    answer = forward_dynamics(
        dynamics, data.qpos, data.qvel, data.actuator_force, {**ROWS, "FR": "z", "RL": "z"}
    )
    measured = robot.contact_wrenches()
    assert answer.force[[2, 3, 4, 7]] == pytest.approx(measured[:, 2], rel=0.02)
    assert np.abs(answer.acceleration[:22]).max() < 0.05, "trunk and legs: the gripper is at its stop"


def test_the_answer_obeys_both_rows_of_eq_4(dynamics):
    random = np.random.default_rng(1)
    qpos = posture(0.5)
    qvel = rolling(qpos) + 0.1 * random.normal(size=NV)
    torques = 5.0 * random.normal(size=NU)
    answer = forward_dynamics(dynamics, qpos, qvel, torques)
    J, drift = contact_rows(dynamics)
    assert J @ answer.acceleration + drift == pytest.approx(np.zeros(10), abs=1e-8)
    balance = dynamics.M @ answer.acceleration + dynamics.h - J.T @ answer.force
    assert balance == pytest.approx(np.concatenate([np.zeros(6), torques]), abs=1e-8)


def test_in_the_air_it_falls(dynamics):
    """Eq. 5."""
    answer = forward_dynamics(dynamics, posture(), np.zeros(NV), np.zeros(NU), {})
    assert answer.force.shape == (0,)
    assert answer.acceleration[:6] == pytest.approx([0, 0, -9.81, 0, 0, 0], abs=1e-9)


def test_damping_only_gives_way(dynamics):
    dynamics.update(posture(), np.zeros(NV))
    J, drift = contact_rows(dynamics)
    torques = np.zeros(NV)
    exact = constrained(dynamics.M, dynamics.h, torques, J, drift)
    soft = constrained(dynamics.M, dynamics.h, torques, J, drift, 1e-6)
    assert soft.force == pytest.approx(exact.force, rel=1e-2, abs=0.1)
    assert J @ soft.acceleration == pytest.approx(-1e-6 * soft.force, abs=1e-9)


@pytest.mark.parametrize("rows", [{"XX": "z"}, {"FL": "w"}, {"FL": ""}])
def test_rows_that_make_no_sense(dynamics, rows):
    with pytest.raises(ValueError, match="is no leg, or no directions"):
        contact_rows(dynamics, rows)
