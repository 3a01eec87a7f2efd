"""The controller's program: its answer obeys the physics, and OSQP finds the answer an exact solver finds."""

from dataclasses import replace

import handmade
import numpy as np
import pytest

from wfbook import simulate, wbc
from wfbook.go1 import FOOT_RADIUS, WHEEL_RADIUS, nominal
from wfbook.go1_dynamics import GRAVITY, Go1Dynamics
from wfbook.qp import QuadraticProgram
from wfbook.reference import Gains, Ground, Reference
from wfbook.terrain import flat

MODES = {
    "four feet": ([1, 1, 1, 1], [0, 0, 0, 0]),
    "three feet": ([1, 1, 0, 1], [0, 0, 0, 0]),
    "diagonal": ([1, 0, 0, 1], [0, 0, 0, 0]),
    "one foot, three wheels": ([1, 1, 1, 1], [0, 1, 1, 1]),
    "a foot and a wheel": ([1, 0, 0, 1], [0, 1, 0, 1]),
    "four wheels": ([1, 1, 1, 1], [1, 1, 1, 1]),
}


@pytest.fixture(scope="module")
def robot() -> Go1Dynamics:
    return Go1Dynamics()


@pytest.fixture(scope="module")
def ground() -> Ground:
    return Ground.under(flat(rolling_resistance=0.01), np.zeros(4, int))


def situation(robot: Go1Dynamics, stance, wheels, seed: int, wild: float = 1.0) -> Reference:
    """Put the robot in a disturbed stance and ask it for something."""
    rng = np.random.default_rng(seed)
    wheels, stance = np.array(wheels, bool), np.array(stance, bool)
    radii = np.where(wheels, WHEEL_RADIUS, FOOT_RADIUS)[:, None]
    com = np.array([0.0, 0.0, 0.265]) + 0.01 * wild * rng.standard_normal(3)
    ends = nominal()["hip_offsets"] + [0.0, 0.0, 0.265] + radii * [0.0, 0.0, 1.0]
    ends = ends + 0.02 * wild * rng.standard_normal((4, 3))
    qpos = robot.posture(com, 0.05 * wild * rng.standard_normal(3), ends)
    robot.update(qpos, 0.2 * wild * rng.standard_normal(22))
    return Reference(
        com=com + 0.02 * wild * rng.standard_normal(3),
        com_velocity=0.1 * wild * rng.standard_normal(3),
        com_acceleration=0.3 * wild * rng.standard_normal(3),
        R_wb=np.eye(3),
        ends=ends + 0.02 * wild * rng.standard_normal((4, 3)),
        end_velocity=0.1 * wild * rng.standard_normal((4, 3)),
        end_acceleration=wild * rng.standard_normal((4, 3)),
        stance=stance,
        wheels=wheels,
        forces=wbc.weight_share(robot, np.zeros(3), stance),
    )


def following(robot: Go1Dynamics, ref: Reference) -> Reference:
    """A reference that the robot is on, with the same accelerations."""
    omega = robot.R_wb @ robot.velocity[3:6]
    motion = {"com": robot.com, "com_velocity": robot.com_velocity, "R_wb": robot.R_wb, "omega": omega}
    return replace(ref, ends=robot.centres, end_velocity=robot.centre_velocity, **motion)


def turned(R_wb: np.ndarray, axis: int, angle: float) -> np.ndarray:
    """An orientation after a small turn about an axis of the world."""
    cross = np.cross(np.eye(3)[axis], np.eye(3))
    return (np.eye(3) - angle * cross) @ R_wb


def test_a_trunk_on_its_reference_goes_on_and_off_it_is_pulled_back(robot):
    """Eq. 34: a spring and a damper for each direction, and nothing else."""
    gains = Gains()
    on = following(robot, situation(robot, *MODES["four feet"], 3))
    linear, angular = wbc.base_acceleration(robot, on, gains)
    np.testing.assert_allclose(linear, on.com_acceleration, atol=1e-12)
    np.testing.assert_allclose(angular, on.angular_acceleration, atol=1e-9)
    for axis, step in enumerate(1e-6 * np.eye(3)):
        off = {
            "com": (0, replace(on, com=on.com + step), gains.com_kp),
            "com_velocity": (0, replace(on, com_velocity=on.com_velocity + step), gains.com_kd),
            "R_wb": (1, replace(on, R_wb=turned(on.R_wb, axis, 1e-6)), gains.attitude_kp),
            "omega": (1, replace(on, omega=on.omega + step), gains.attitude_kd),
        }
        for name, (which, ref, gain) in off.items():
            change = (wbc.base_acceleration(robot, ref, gains)[which] - (linear, angular)[which]) / 1e-6
            expected = np.broadcast_to(gain, 3) * np.eye(3)[axis]
            np.testing.assert_allclose(change, expected, rtol=1e-4, atol=1e-3, err_msg=name)


def test_a_wheel_is_placed_relative_to_the_robot_and_a_swing_in_the_world(robot, ground):
    """Eqs 35 and 36: a plan that is elsewhere moves the robot's swings, but not the wheels below it."""
    gains, shift = Gains(), np.array([0.03, -0.02, 0.01])
    ref = situation(robot, *MODES["four wheels"], 4)
    along = wbc.contacts(robot, ground, ref.wheels).basis[:, 0]
    wheel, swing = wbc.wheel_acceleration(robot, ref, along, gains), wbc.swing_acceleration(robot, ref, gains)
    elsewhere = replace(ref, com=ref.com + shift, ends=ref.ends + shift)
    moved = wbc.swing_acceleration(robot, elsewhere, gains)
    np.testing.assert_allclose(wbc.wheel_acceleration(robot, elsewhere, along, gains), wheel, atol=1e-9)
    np.testing.assert_allclose(moved - swing, np.tile(gains.swing_kp * shift, (4, 1)), atol=1e-9)
    ahead = replace(ref, ends=ref.ends + 0.01 * along)
    pulled = wbc.wheel_acceleration(robot, ahead, along, gains) - wheel
    np.testing.assert_allclose(pulled, 0.01 * gains.wheel_kp, rtol=1e-9)
    on = following(robot, ref)
    np.testing.assert_allclose(wbc.swing_acceleration(robot, on, gains), ref.end_acceleration, atol=1e-12)


def test_contact_forces_do_the_work_of_their_points_in_the_equations_of_motion(robot, ground):
    """Eqs 37 and 39: what is beside M q̈ + h is power of the forces at what they act on."""
    rng = np.random.default_rng(0)
    for mode in MODES.values():
        contact = wbc.contacts(robot, ground, situation(robot, *mode, 2).wheels)
        E, h = wbc.equations_of_motion(robot, contact)
        acceleration, forces = rng.standard_normal(18), 50.0 * rng.standard_normal((4, 3))
        inertial = robot.M @ acceleration + robot.h
        rest = E @ np.append(acceleration, forces) + h - inertial
        np.testing.assert_allclose(robot.velocity @ rest, -np.sum(forces * contact.velocity), rtol=1e-9)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("seed", range(3))
def test_the_answer_obeys_the_physics(robot, ground, mode, seed):
    """Eqs 39 to 43, stated again with the contacts' own Jacobians."""
    ref = situation(robot, *MODES[mode], seed)
    command = wbc.WholeBodyController(robot).tick(ref, ground)
    assert command.solved
    contact = wbc.contacts(robot, ground, ref.wheels)
    forces = np.einsum("lij,lj->li", contact.basis, command.forces)
    jacobian, drift, _ = robot.contacts(robot.contact_offsets(ground.normals, ref.wheels))
    generalised = np.einsum("lij,li->j", jacobian, command.forces)
    generalised[6:] += command.torques
    residual = robot.M @ command.acceleration + robot.h - generalised
    np.testing.assert_allclose(residual, 0.0, atol=1e-3)
    assert np.all(np.abs(command.torques) <= robot.effort + 1e-9)
    np.testing.assert_allclose(forces[~ref.stance], 0.0, atol=1e-3)

    t, b, n = forces.T
    least = Gains().least_force
    assert np.all(n[ref.stance] >= least - 1e-3)
    mu_b = np.where(ref.wheels, ground.mu_wheel_lateral, ground.mu_foot)
    assert np.all(np.abs(b) <= mu_b * n + 1e-3)
    assert np.all(np.hypot(t, b)[~ref.wheels] <= (ground.mu_foot * n)[~ref.wheels] + 1e-3)
    rolling = ref.wheels & ref.stance
    resisting = -ground.rolling_resistance * n * np.tanh(contact.velocity[:, 0] / wbc.ROLLING_SPEED)
    np.testing.assert_allclose(t[rolling], resisting[rolling], atol=1e-3)

    damped = np.einsum("lij,lj->li", contact.basis, jacobian @ command.acceleration + drift)
    damped += Gains().contact_damping * contact.velocity
    damped[:, 1] -= np.where(ref.wheels, contact.yaw_rate * contact.velocity[:, 0], 0.0)
    held = np.repeat(ref.stance[:, None], 3, axis=1)
    held[:, 0] &= ~ref.wheels
    np.testing.assert_allclose(damped[held], 0.0, atol=2e-4)


def test_osqp_and_an_exact_solver_agree_in_closed_loop(monkeypatch):
    """The program of eqs 38 to 43."""
    seen = []
    solve = QuadraticProgram.solve

    def recording(self, *program):
        u = solve(self, *program)
        seen.append((program, u))
        return u

    monkeypatch.setattr(QuadraticProgram, "solve", recording)
    errors = []
    for plan in (handmade.trot(0.3, 5), handmade.coast(10)):
        seen.clear()
        simulate.run(plan, hold=0.2)
        P_pattern, A_pattern = wbc.pattern()
        exact = QuadraticProgram(P_pattern, A_pattern, "daqp")
        for program, u in seen[::3]:
            errors.append(np.abs(program[2][-12:] @ (u - solve(exact, *program))).max())
    assert np.percentile(errors, 99) <= 0.02
    assert len(errors) > 400


@pytest.mark.parametrize("mode", MODES)
def test_the_sparsity_pattern_misses_nothing(robot, ground, mode):
    P, _, A, *_ = wbc.WholeBodyController(robot).problem(situation(robot, *MODES[mode], 5), ground)
    P_pattern, A_pattern = wbc.pattern()
    assert not np.any(P[~P_pattern]) and not np.any(np.abs(A[~A_pattern]) > 1e-12)


def test_standing_still_needs_the_weight_and_nothing_else(robot, ground):
    ref = situation(robot, [1, 1, 1, 1], [0, 0, 0, 0], 0, wild=0.0)
    command = wbc.WholeBodyController(robot).tick(ref, ground)
    np.testing.assert_allclose(command.forces.sum(axis=0), -robot.mass * GRAVITY, atol=0.05)
    np.testing.assert_allclose(command.forces[:, 2], command.forces[:, 2].mean(), rtol=0.02)
    np.testing.assert_allclose(command.acceleration, 0.0, atol=0.05)


def test_mirrored_situations_have_mirrored_answers(robot, ground):
    """A push to the left and one to the right: the model is symmetric to a millimetre."""
    ref = situation(robot, [1, 1, 1, 1], [0, 0, 0, 0], 0, wild=0.0)
    answers = []
    for side in (1.0, -1.0):
        asked = replace(ref, com_acceleration=np.array([0.0, side, 0.0]))
        answers.append(wbc.WholeBodyController(robot).tick(asked, ground).forces)
    mirrored = answers[1][[1, 0, 3, 2]] * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(answers[0], mirrored, atol=1.0)


def test_without_a_foot_nothing_is_asked_along_the_rolling_direction(robot, ground):
    ref = situation(robot, [1, 1, 1, 1], [1, 1, 1, 1], 0, wild=0.0)
    controller = wbc.WholeBodyController(robot)
    still = controller.tick(ref, ground)
    step = np.array([0.1, 0.0, 0.0])
    ahead = controller.tick(replace(ref, com=ref.com + step, ends=ref.ends + step), ground)
    np.testing.assert_allclose(still.torques, ahead.torques, atol=1e-3)
    one_foot = replace(ref, wheels=np.array([False, True, True, True]))
    pulled = controller.tick(replace(one_foot, com=ref.com + 0.1 * step), ground)
    assert pulled.forces[:, 0].sum() > 5.0


def test_a_rolling_wheel_may_yaw_without_being_asked_to_slide(robot, ground):
    """Eq. 41 is the derivative of a wheel's lateral velocity, here of a robot that rolls ahead and turns."""
    ref = situation(robot, [1, 1, 1, 1], [1, 1, 1, 1], 0, wild=0.0)
    level = robot.posture(robot.com, np.zeros(3), ref.ends)
    level[7::4] = 0.0  # legs upright: the axles are level
    velocity = np.zeros(22)
    velocity[0], velocity[5] = 0.5, 0.8

    def lateral(time: float) -> np.ndarray:
        """The wheels' lateral velocity after coasting with velocities constant in the trunk's frame."""
        angle = velocity[5] * time
        qpos, qvel = level.copy(), velocity.copy()
        turned = np.array([np.cos(angle), np.sin(angle), 0.0])
        qpos[:3] += 0.5 * time * turned
        qpos[3:7] = np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)
        qvel[:3] = 0.5 * turned
        robot.update(qpos, qvel)
        return wbc.contacts(robot, ground, ref.wheels).velocity[:, 1]

    slope = (lateral(1e-5) - lateral(-1e-5)) / 2e-5
    robot.update(level, velocity)
    required = wbc.fixed_wheels(wbc.contacts(robot, ground, ref.wheels), 0.0)[:, 1]
    np.testing.assert_allclose(slope, -required, atol=1e-4)


def test_a_failed_program_holds_then_sits_and_is_counted(robot, ground):
    controller = wbc.WholeBodyController(robot, patience=2)
    ref = situation(robot, *MODES["four feet"], 0)
    good = controller.tick(ref, ground)
    broken = replace(ref, com=np.full(3, np.nan))
    for _ in range(2):
        command = controller.tick(broken, ground)
        assert not command.solved
        np.testing.assert_array_equal(command.torques, good.torques)
    damping = controller.tick(broken, ground).torques
    assert damping @ robot.velocity[6:] < 0.0
    assert controller.failures == 3
    assert controller.tick(ref, ground).solved and np.isfinite(damping).all()


def test_an_unknown_solver_is_refused(robot):
    with pytest.raises(ValueError, match="solver"):
        wbc.WholeBodyController(robot, solver="abacus")
