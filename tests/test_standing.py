"""A robot that only stands obeys Coulomb, Newton and nobody else."""

import numpy as np
import pytest

from wfbook.friction import steepest_slope
from wfbook.go1 import nominal
from wfbook.standing import load_shares, plane, stand
from wfbook.view import replay
from wfbook.view.motion import motion_of_standing

MU, G = 0.35, 9.81
FEET, WHEELS = ("foot",) * 4, ("wheel",) * 4


def tilted(kinds, heading=0.0):
    rate = np.radians(10.0)
    return stand(plane(MU), kinds, 1.3 * np.arctan(MU) / rate, tilt=lambda t: rate * t, heading=heading)


@pytest.mark.parametrize("heading", [0.0, np.pi / 4, np.pi])
def test_feet_slide_where_the_cone_says_in_every_direction(heading):
    cone = np.degrees(steepest_slope(MU, MU, heading, cone=True))
    assert np.degrees(tilted(FEET, heading).slip_angle) == pytest.approx(cone, abs=1.5)


def test_wheels_slide_across_as_feet_do_and_roll_at_once_ahead():
    assert np.degrees(tilted(WHEELS, np.pi / 2).slip_angle) == pytest.approx(
        np.degrees(np.arctan(MU)), abs=1.5
    )
    rolling = tilted(WHEELS)
    assert np.degrees(rolling.slip_angle) < 0.5 and rolling.distance[-1] > 0.5


def test_on_a_slope_the_ground_carries_the_weight_of_who_stands():
    standing = stand(plane(MU, slope=np.radians(12.0)), FEET, 1.0)
    weight = nominal()["mass"] * G
    assert standing.contact_force[-30:].sum(axis=1).mean(axis=0) == pytest.approx([0, 0, weight], abs=1.0)
    assert standing.distance[-1] < 0.01 and standing.slope[0] == pytest.approx(np.radians(12.0))
    assert standing.slip_angle is None


@pytest.mark.parametrize("resistance", [0.0, 0.02])
def test_wheels_roll_down_with_newtons_acceleration(resistance):
    slope = np.radians(10.0)
    rolling = stand(plane(MU, resistance, slope), WHEELS, 1.0)
    late = rolling.t > 0.3
    speed = np.linalg.norm(rolling.com_velocity[late], axis=1)
    acceleration = np.polyfit(rolling.t[late], speed, 1)[0]
    # The wheels' own inertia is one per cent of the robot's.
    assert acceleration == pytest.approx(G * (np.sin(slope) - resistance * np.cos(slope)), rel=0.02)


def test_turned_across_the_slope_wheels_hold():
    assert stand(plane(MU, slope=np.radians(10.0)), WHEELS, 1.0, yaw=np.pi / 2).distance[-1] < 0.01


def test_coasting_is_slowed_by_resistance_alone():
    coasting = stand(plane(MU, 0.02), WHEELS, 1.5, speed=0.6)
    late = coasting.t > 0.3
    assert np.polyfit(coasting.t[late], coasting.com_velocity[late, 0], 1)[0] == pytest.approx(
        -0.02 * G, rel=0.03
    )
    assert coasting.com[-1, 0] - coasting.com[0, 0] == pytest.approx(0.6 * 1.5 - 0.01 * G * 1.5**2, abs=0.03)


def test_shares_carry_the_weight_and_balance_it():
    body = nominal()
    x, y = body["hip_offsets"][:, :2].T
    for slope, heading in ((0.2, 0.0), (0.3, 1.0)):
        shares = load_shares(slope, heading)
        assert shares.sum() == pytest.approx(np.cos(slope))
        lever = body["com_height"] * np.sin(slope)
        assert [shares @ x, shares @ y] == pytest.approx([lever * np.cos(heading), lever * np.sin(heading)])
    assert load_shares(0.0) == pytest.approx(0.25 * np.ones(4), abs=0.01)


def test_simulated_loads_are_the_shares():
    slope = np.radians(12.0)
    standing = stand(plane(0.6, slope=slope), FEET, 1.0)
    loads = standing.contact_force[-20:].mean(axis=0) @ standing.normal / (nominal()["mass"] * G)
    assert loads == pytest.approx(load_shares(slope), abs=0.03)


def test_what_can_not_stand_is_refused():
    with pytest.raises(ValueError, match="end_effectors: 'skate'"):
        stand(plane(MU), ("skate",) * 4)
    with pytest.raises(ValueError, match="no ground"):
        stand(plane(MU), FEET, place=(100.0, 0.0))


def test_a_replay_follows_the_robot_and_shows_no_plan():
    rolling = stand(plane(MU, slope=np.radians(10.0)), WHEELS, 1.0)
    motion = motion_of_standing(rolling)
    assert motion.planned_com is motion.measured_com and len(motion.qpos) == 31
    assert motion.planned_com[-1] == pytest.approx(rolling.com[-1]) and (motion.modes == 1).all()
    page = replay.html(rolling)
    assert "CoM measured" in page and "CoM planned" not in page
