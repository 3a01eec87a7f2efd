"""The torques of a swinging leg against its energy, MuJoCo's inverse dynamics, and its limits."""

import mujoco
import numpy as np
import pytest

from wfbook.go1 import ASSETS, nominal
from wfbook.go1_dynamics import MOTORS, WHEELS, leg_motion
from wfbook.swing import swing_position

LEG, T, N = 2, 0.25, 201


@pytest.fixture(scope="module")
def path():
    """A swing of RL, forward, sideways and up: position, velocity, acceleration, relative to the trunk."""
    body = nominal()
    start = body["hip_offsets"][LEG] - body["trunk"] + [-0.06, 0.0, 0.02]
    phase = np.linspace(0.0, 1.0, N)
    end = body["hip_offsets"][LEG] - body["trunk"] + [0.08, 0.03, 0.04]
    return [swing_position(phase, T, start, end, 0.07, derivative=d) for d in range(3)]


def test_rates_are_the_angles_derivatives_and_power_is_the_energys(path):
    angles, rates, torques = leg_motion(LEG, *path)
    dt = T / (N - 1)
    assert np.gradient(angles, dt, axis=0)[2:-2] == pytest.approx(rates[2:-2], abs=2e-2)
    power = (torques * rates).sum(axis=1)
    still = leg_motion(LEG, path[0], 0 * path[0], 0 * path[0])[2]
    work, lifted = np.trapezoid(power, dx=dt), np.trapezoid((still * rates).sum(axis=1), dx=dt)
    assert work == pytest.approx(lifted, abs=1e-3), "from rest to rest all work lifts the leg"


def test_mujoco_finds_the_same_torques(path):
    model = mujoco.MjModel.from_xml_path(str(ASSETS / "go1.xml"))
    data = mujoco.MjData(model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    angles, rates, torques = leg_motion(LEG, *path)
    dt, own = T / (N - 1), MOTORS[3 * LEG : 3 * LEG + 3]
    bends = np.gradient(rates, dt, axis=0)
    for i in range(10, N - 10, 20):
        data.qpos[:], data.qvel[:], data.qacc[:] = 0.0, 0.0, 0.0
        data.qpos[3] = 1.0
        data.qpos[1 + MOTORS] = np.tile([0.0, 0.9, -1.8], 4)
        data.qpos[1 + own], data.qvel[own], data.qacc[own] = angles[i], rates[i], bends[i]
        # No torque acts on a wheel: it takes whatever acceleration leaves it alone.
        mujoco.mj_inverse(model, data)
        inertia = 4e-5
        data.qacc[WHEELS[LEG]] -= data.qfrc_inverse[WHEELS[LEG]] / inertia
        mujoco.mj_inverse(model, data)
        assert data.qfrc_inverse[WHEELS[LEG]] == pytest.approx(0.0, abs=1e-6)
        assert data.qfrc_inverse[own] == pytest.approx(torques[i], abs=5e-3)


def test_out_of_reach_is_refused(path):
    with pytest.raises(ValueError, match="RL can't reach"):
        leg_motion(LEG, path[0] - [0.0, 0.0, 0.5], path[1], path[2])
