"""The robot of part II drives as its wheels tell it, and the replay shows it."""

import itertools

import mujoco
import numpy as np
import pytest
from test_view_replay import tracks_of

from wfbook.modes import LEGS
from wfbook.omni import robot
from wfbook.omni.driving import drive, holding_torques
from wfbook.omni.robot import Omni
from wfbook.omni.wheels import crab, rotation
from wfbook.terrain import flat
from wfbook.view import replay
from wfbook.view.motion import motion_of_driving
from wfbook.view.replay import _bends
from wfbook.view.scene import _upright
from wfbook.view.tracks import FPS


@pytest.fixture(scope="module")
def driving():
    return drive([crab(0.6, 0.8), rotation(1.0), np.zeros(3)], 5.4)


def test_the_robot_goes_where_the_wheels_say(driving):
    way = np.linalg.norm(np.diff(driving.pose[:, :2], axis=0), axis=1).sum()
    assert way > 0.8 and driving.pose[-1, 2] > 1.0
    off = np.linalg.norm(driving.qpos[:, :2] - driving.pose[:, :2], axis=1)
    assert off.max() < 0.05 * way
    assert np.abs(driving.yaw - driving.pose[:, 2]).max() < 0.1
    assert np.abs(driving.twist[-1]).max() == 0.0
    assert np.abs(driving.qvel[-1, :6]).max() < 0.03


def test_the_hand_stays_up_on_level_ground(driving):
    assert np.abs(driving.hand[:, 2] - robot.HAND_HEIGHT).max() < 0.01


def test_the_ground_carries_the_robot(driving):
    weight = Omni(flat()).model.body_subtreemass[1] * 9.81
    assert driving.contact_force[:, :, 2].sum(axis=1).mean() == pytest.approx(weight, rel=0.01)
    assert np.abs(driving.p[:, :, 2]).max() < 0.005


def test_straight_across_the_ground_while_it_turns():
    def wanted(t, pose):
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        return np.array([0.5 * cos, -0.5 * sin, 1.0])  # 0.5 m/s along the world's x

    spun = drive(wanted, 5.0)
    assert spun.yaw[-1] > 4.0
    assert spun.qpos[-1, 0] > 1.9
    assert np.abs(spun.qpos[:, 1]).max() < 0.25


def test_holding_torques_hold():
    omni, torques = Omni(flat()), holding_torques(robot.posture())
    angles = robot.posture()[7:]
    for _ in range(400):
        omni.step(omni.servo(angles, np.zeros(robot.NU), torques))
    assert np.abs(omni.data.qpos[7:] - angles)[robot.ARM_V - 6].max() < 2e-3
    assert np.abs(omni.data.qpos[7:] - angles)[robot.LEGS_V - 6].max() < 5e-3
    without = Omni(flat())
    for _ in range(400):
        without.step(without.servo(angles, np.zeros(robot.NU)))
    assert omni.hand[0][2] > without.hand[0][2] + 0.005


def test_the_ground_goes_on(driving):
    far = drive(crab(1.2, np.pi / 2), 4.0)
    assert far.qpos[-1, 1] > 2.5 and abs(far.qpos[-1, 2] - robot.NOMINAL_HEIGHT) < 0.01


def test_the_replay_moves_every_body_as_the_simulation_did(driving):
    page = replay.html(driving)
    assert len(page.encode()) < 1_000_000
    assert '"foot"' not in page and ">foot<" not in page and ">hand<" in page
    moving = tracks_of(page)
    model = mujoco.MjModel.from_xml_path(str(robot.ASSETS / "omni.xml"))
    data = mujoco.MjData(model)
    motion = motion_of_driving(driving)
    trunk = moving["/meshcat/robot/trunk"]
    times, values = trunk["position"]
    for frame in (0, 30, 100):
        data.qpos = motion.qpos[frame]
        mujoco.mj_kinematics(model, data)
        at = [np.interp(frame / FPS, times, values[:, i]) for i in range(3)]
        np.testing.assert_allclose(at, data.body("trunk").xpos, atol=1e-3)
    for leg in LEGS:
        path = f"/meshcat/robot/trunk/{leg}_thigh/{leg}_shank/{leg}_fork"
        assert "quaternion" in moving[path] and "quaternion" in moving[f"{path}/{leg}_wheel"]


def test_bends_follow_a_circle():
    angle = np.linspace(0.0, np.pi, 200)
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    kept = _bends(circle)
    assert len(kept) < 30 and kept[0] == 0 and kept[-1] == 199 and (np.diff(kept) > 0).all()
    for a, b in itertools.pairwise(kept):
        middle = circle[(a + b) // 2]
        assert np.linalg.norm(middle - (circle[a] + circle[b]) / 2) < 0.011
    assert list(_bends(np.zeros((5, 3)))) == [0, 4]


def test_wheels_are_drawn_along_their_axles():
    """A cylinder stands along y in Meshcat and along z in MuJoCo."""
    model = mujoco.MjModel.from_xml_path(str(robot.ASSETS / "omni.xml"))
    geom = model.geom("FL_wheel")
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, geom.quat)
    axle = turn.reshape(3, 3) @ _upright(model, geom.id) @ [0.0, 1.0, 0.0]
    np.testing.assert_allclose(np.abs(axle), [0.0, 1.0, 0.0], atol=1e-12)
