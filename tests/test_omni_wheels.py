"""Chapter 9's mathematics: the ten properties of steered wheels, modes, a base that steers first."""

import mujoco
import numpy as np
import pytest

from wfbook.modes import LEGS
from wfbook.omni import robot
from wfbook.omni.base import Base, Limits
from wfbook.omni.robot import WHEEL_POSITIONS, WHEEL_RADIUS, Omni
from wfbook.omni.wheels import (
    HYSTERESIS,
    J,
    accelerated,
    ackermann,
    body_twist,
    connection,
    constraint_matrix,
    crab,
    free_twists,
    instantaneous_centre,
    moved,
    pivot,
    rotation,
    shorter_turns,
    steering_directions,
    twist_about,
    wheel_command,
    wheel_velocities,
    wrap,
)
from wfbook.terrain import flat

MODES = {
    "straight": crab(0.8, 0.0),
    "crab": crab(0.8, 1.1),
    "ackermann": ackermann(0.8, 1.3, WHEEL_POSITIONS[2, 0]),
    "rotation": rotation(1.2),
    "pivot": pivot(0.5, 0.7),
}


def cases(count: int = 200, seed: int = 0):
    """Random twists, wheel places (not only four, not only a rectangle) and present steering angles."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        n = int(rng.integers(3, 7))
        yield rng.normal(size=3), rng.normal(size=(n, 2)), rng.uniform(-20.0, 20.0, n), rng.random(n) < 0.5


def unit(angles: np.ndarray) -> np.ndarray:
    return np.column_stack([np.cos(angles), np.sin(angles)])


# The ten properties.


def test_1_every_wheel_gets_the_velocity_of_its_place():
    """Eqs 12 to 15 together."""
    for twist, positions, steering, backward in cases():
        for memory in (None, backward):
            command = wheel_command(twist, positions, steering, memory)
            # from mechanics, not from the library: v + omega z × r
            three = np.column_stack([positions, np.zeros(len(positions))])
            expected = (np.array([*twist[:2], 0.0]) + np.cross([0.0, 0.0, twist[2]], three))[:, :2]
            np.testing.assert_allclose(command.speed[:, None] * unit(command.steering), expected, atol=1e-12)
            np.testing.assert_allclose(WHEEL_RADIUS * command.spin(WHEEL_RADIUS), command.speed)


def test_2_the_twist_comes_back_from_the_wheels():
    for twist, positions, steering, backward in cases():
        command = wheel_command(twist, positions, steering, backward)
        found, _ = body_twist(command.steering, command.speed, positions)
        np.testing.assert_allclose(found, twist, atol=1e-11)


def test_3_no_wheel_turns_by_more_than_a_quarter():
    """Eq. 14."""
    for twist, positions, steering, backward in cases(1000):
        free = wheel_command(twist, positions, steering)
        assert np.abs(free.steering - steering).max() <= np.pi / 2 + 1e-12
        kept = wheel_command(twist, positions, steering, backward)
        assert np.abs(kept.steering - steering).max() <= np.pi / 2 + HYSTERESIS + 1e-12


def test_4_steering_is_continuous_across_pi():
    """The direction goes round three times and back: the angle follows without a jump."""
    angles = np.concatenate([np.linspace(0.0, 6 * np.pi, 1500), np.linspace(6 * np.pi, -np.pi, 1500)])
    steering, backward = np.zeros(4), np.zeros(4, bool)
    for angle in angles:
        command = wheel_command(crab(1.0, angle), WHEEL_POSITIONS, steering, backward)
        assert np.abs(command.steering - steering).max() < 0.03
        assert (command.speed > 0).all()
        steering, backward = command.steering, command.backward
        np.testing.assert_allclose(steering, angle, atol=1e-9)


def test_5_the_opposite_twist_reverses_and_does_not_steer():
    for twist, positions, steering, _ in cases():
        there = wheel_command(twist, positions, steering)
        back = wheel_command(-twist, positions, there.steering, there.backward)
        np.testing.assert_allclose(back.steering, there.steering, atol=1e-12)
        np.testing.assert_allclose(back.speed, -there.speed, atol=1e-12)
        assert (back.backward != there.backward).all()


def test_6_a_wheel_that_stands_holds_its_angle():
    for _, positions, steering, backward in cases():
        command = wheel_command(np.zeros(3), positions, steering, backward)
        assert np.array_equal(command.steering, steering)
        assert not command.speed.any()
        assert np.array_equal(command.backward, backward)
        about_first = wheel_command(twist_about(positions[0], 1.0), positions, steering, backward)
        assert about_first.steering[0] == steering[0] and about_first.speed[0] == 0.0
        assert np.abs(about_first.speed[1:]).min() > 0.0


def test_7_turning_the_axes_turns_the_angles():
    for twist, positions, steering, backward in cases():
        angle = float(twist[0])
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        plain = wheel_command(twist, positions, steering, backward)
        turned = wheel_command(
            np.array([*(R @ twist[:2]), twist[2]]), positions @ R.T, steering + angle, backward
        )
        np.testing.assert_allclose(turned.steering, plain.steering + angle, atol=1e-9)
        np.testing.assert_allclose(turned.speed, plain.speed, atol=1e-12)


def test_8_ranks():
    rng = np.random.default_rng(1)
    for _ in range(50):
        steering = rng.uniform(-np.pi, np.pi, 4)
        S = constraint_matrix(steering, WHEEL_POSITIONS)
        R2 = np.sum(WHEEL_POSITIONS**2)
        np.testing.assert_allclose(S.T @ S, np.diag([4.0, 4.0, R2]), atol=1e-12)
        assert np.linalg.matrix_rank(S) == 3
        A = connection(steering, WHEEL_POSITIONS, WHEEL_RADIUS)
        assert A.shape == (3, 8) and not A[:, :4].any()
        assert np.linalg.matrix_rank(A) == 3
        assert len(free_twists(steering, WHEEL_POSITIONS)) == 0  # rank three, and it can't move
        parallel = np.full(4, steering[0]) + np.pi * rng.integers(-1, 2, 4)
        A = connection(parallel, WHEEL_POSITIONS, WHEEL_RADIUS)
        assert np.linalg.matrix_rank(A, tol=1e-12) == 2  # the paper says three
        twists = free_twists(parallel, WHEEL_POSITIONS)
        assert len(twists) == 1 and abs(twists[0, 2]) < 1e-12
    for name, twist in MODES.items():
        steering = wheel_command(twist, WHEEL_POSITIONS, np.zeros(4)).steering
        rank = np.linalg.matrix_rank(connection(steering, WHEEL_POSITIONS, WHEEL_RADIUS), tol=1e-12)
        assert rank == (2 if name in ("straight", "crab") else 3), name
        (free,) = free_twists(steering, WHEEL_POSITIONS)
        np.testing.assert_allclose(abs(free @ twist), np.linalg.norm(twist), rtol=1e-12)


def test_9_nothing_skids():
    """Eq. 22: the sideways rows are zero."""
    for twist, positions, steering, backward in cases():
        command = wheel_command(twist, positions, steering, backward)
        sideways = constraint_matrix(command.steering, positions)[: len(positions)] @ twist
        np.testing.assert_allclose(sideways, 0.0, atol=1e-12)
        _, skid = body_twist(command.steering, command.speed, positions)
        np.testing.assert_allclose(skid, 0.0, atol=1e-11)


def test_10_noise_at_a_quarter_turn_does_not_change_the_mind():
    rng = np.random.default_rng(2)
    noise = 0.5 * HYSTERESIS * rng.uniform(-1.0, 1.0, (500, 4))

    def changes(hysteresis: float) -> int:
        backward, count = np.zeros(4, bool), 0
        for row in noise:
            _, now = shorter_turns(np.pi / 2 + row, np.zeros(4), backward, hysteresis)
            count += int(np.sum(now != backward))
            backward = now
        return count

    assert changes(0.0) > 500
    assert changes(HYSTERESIS) == 0
    # and beyond the band it does change
    _, now = shorter_turns(np.array([np.pi / 2 + 1.01 * HYSTERESIS]), np.zeros(1), np.zeros(1, bool))
    assert now.all()


# Modes are twists.


def test_the_classical_modes_are_special_cases():
    steering = {
        name: wrap(wheel_command(twist, WHEEL_POSITIONS, np.zeros(4)).steering)
        for name, twist in MODES.items()
    }
    np.testing.assert_allclose(steering["straight"], 0.0, atol=1e-15)
    np.testing.assert_allclose(steering["crab"], 1.1, atol=1e-12)
    car = steering["ackermann"]
    np.testing.assert_allclose(car[2:], 0.0, atol=1e-12)  # rear wheels straight
    length, track = 0.56, 0.38
    np.testing.assert_allclose(1 / np.tan(car[1]) - 1 / np.tan(car[0]), track / length, atol=1e-9)
    front, rear = steering["pivot"][:2], steering["pivot"][2:]
    np.testing.assert_allclose(front, -rear, atol=1e-12)  # against each other
    across = np.sum(unit(steering["rotation"]) * WHEEL_POSITIONS, axis=1)
    np.testing.assert_allclose(across, 0.0, atol=1e-12)
    np.testing.assert_allclose(pivot(1e-9, 1e-9), rotation(1.0), atol=1e-8)


def test_the_centre_does_not_move():
    for twist, _, _, _ in cases(50):
        centre = instantaneous_centre(twist)
        np.testing.assert_allclose(wheel_velocities(twist, centre[None]), 0.0, atol=1e-12)
        np.testing.assert_allclose(twist_about(centre, twist[2]), twist, atol=1e-12)
    assert instantaneous_centre(crab(1.0, 0.3)) is None


def test_printed_literally_eq_14_turns_wheels_too_far():
    rng = np.random.default_rng(3)
    desired, current = rng.uniform(-np.pi, np.pi, (2, 100_000))
    printed = np.where(np.abs(desired - current) <= np.pi / 2, desired, desired + np.pi)
    far = np.abs(wrap(printed - current)) > np.pi / 2 + 1e-12
    assert np.mean(far) == pytest.approx(1 / 16, abs=0.003)
    turns, _ = shorter_turns(desired, current)
    assert np.abs(turns).max() <= np.pi / 2


def test_directions_and_wrapping():
    """Eq. 13."""
    np.testing.assert_allclose(
        steering_directions(np.array([[1.0, 0.0], [0.0, 2.0], [-1.0, 0.0]])), [0.0, np.pi / 2, np.pi]
    )
    angles = np.linspace(-20, 20, 801)
    np.testing.assert_allclose(np.exp(1j * wrap(angles)), np.exp(1j * angles), atol=1e-12)
    assert (wrap(angles) >= -np.pi).all() and (wrap(angles) < np.pi).all()


def test_least_squares_with_wheels_that_contradict_each_other():
    speed = np.array([1.0, 1.0, 1.0, 2.0])
    twist, skid = body_twist(np.zeros(4), speed, WHEEL_POSITIONS)
    assert twist[0] == pytest.approx(1.25)
    assert np.abs(skid[:, 1]).max() > 0.3
    S = constraint_matrix(np.zeros(4), WHEEL_POSITIONS)
    np.testing.assert_allclose(S.T @ np.concatenate(skid.T), 0.0, atol=1e-12)


# Moving on.


def test_moved_is_what_many_small_steps_are():
    for twist, _, _, _ in cases(20):
        pose = np.array([0.3, -0.2, 0.7])
        for _ in range(20_000):
            cos, sin = np.cos(pose[2]), np.sin(pose[2])
            pose = pose + 0.5e-4 * np.array(
                [cos * twist[0] - sin * twist[1], sin * twist[0] + cos * twist[1], twist[2]]
            )
        np.testing.assert_allclose(moved(np.array([0.3, -0.2, 0.7]), twist, 1.0), pose, atol=5e-4)
        centre = instantaneous_centre(twist)
        later = moved(np.zeros(3), twist, 0.8)
        cos, sin = np.cos(later[2]), np.sin(later[2])
        there = later[:2] + np.array([[cos, -sin], [sin, cos]]) @ centre
        np.testing.assert_allclose(there, centre, atol=1e-12)


def test_accelerations_are_inputs():
    state = accelerated(np.zeros(6), np.array([1.0, -0.5, 0.0]), 2.0)
    np.testing.assert_allclose(state, [2.0, -1.0, 0.0, 2.0, -1.0, 0.0])


# A base that steers first.


def random_pairs(count: int):
    rng = np.random.default_rng(4)
    size = np.array([1.5, 1.5, 2.0])
    for k in range(count):
        first, second = rng.uniform(-size, size), rng.uniform(-size, size)
        yield first, (0.02 * rng.standard_normal(3) - first if k % 3 == 0 else second)


def test_it_gets_there_without_skidding():
    limits = Limits()
    for first, second in random_pairs(12):
        base = Base(limits=limits)
        base.drive(first, 3.0)
        np.testing.assert_allclose(base.twist, first, atol=1e-9)
        drive = base.drive(second, 5.0)
        np.testing.assert_allclose(drive.twist[-1], second, atol=1e-9)
        assert np.abs(drive.skid).max() < 0.01
        rates = np.abs(np.diff(drive.steering, axis=0)) / 0.01
        assert rates.max() <= limits.steering_rate + 1e-6
        acceleration = np.abs(np.diff(drive.twist, axis=0)) / 0.01
        assert (acceleration <= limits.acceleration + 1e-6).all()


def test_from_rest_the_wheels_steer_and_then_stay():
    drive = Base().drive(np.array([0.3, 0.8, -0.9]), 3.0)
    moves = np.abs(drive.twist).max(axis=1) > 1e-9
    start = int(np.argmax(moves))
    assert start > 5
    assert np.abs(np.diff(drive.steering[start + 1 :], axis=0)).max() < 1e-9
    assert np.abs(drive.pose[:start]).max() == 0.0


def test_a_base_that_does_not_wait_skids():
    wanted = crab(0.8, np.pi / 2)
    patient, hasty = Base().drive(wanted, 2.0), Base(steer_first=False).drive(wanted, 2.0)
    assert np.abs(patient.skid).max() < 0.01
    assert np.abs(hasty.skid).max() > 0.05


def test_it_holds_when_nothing_is_wanted():
    base = Base()
    base.drive(crab(0.5, 1.0), 2.0)
    steering = base.steering.copy()
    base.drive(np.zeros(3), 2.0)
    np.testing.assert_allclose(base.steering, steering, atol=1e-9)
    assert not base.twist.any()


def test_a_gentle_way_through_rest_does_not_steer():
    base = Base()
    base.drive(crab(0.8, 0.4), 2.0)
    drive = base.drive(crab(-0.8, 0.4), 3.0)
    np.testing.assert_allclose(drive.steering, 0.4, atol=1e-9)
    np.testing.assert_allclose(drive.twist[-1], crab(-0.8, 0.4), atol=1e-9)


def test_the_wheels_of_the_robot_are_where_the_map_has_them():
    """MuJoCo's own velocity of each wheel's middle, with the body moving by a twist, is eq. 12's."""
    omni, twist = Omni(flat()), np.array([0.4, -0.3, 0.8])
    qvel = np.zeros(robot.NV)
    qvel[:2], qvel[5] = twist[:2], twist[2]
    omni.reset(robot.posture(), qvel)
    velocity = np.zeros((4, 6))
    for row, leg in zip(velocity, LEGS, strict=True):
        site = omni.model.site(f"{leg}_axle").id
        mujoco.mj_objectVelocity(omni.model, omni.data, mujoco.mjtObj.mjOBJ_SITE, site, row, 0)
    np.testing.assert_allclose(velocity[:, 3:5], wheel_velocities(twist, WHEEL_POSITIONS), atol=1e-12)
    assert np.array_equal(J @ [1.0, 0.0], [0.0, 1.0])
