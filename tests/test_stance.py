"""Chapter 6's library: constraints left out, late feedback, what the cost leaves open, and rehearsals."""

from dataclasses import replace

import numpy as np
import pytest

from wfbook import wbc
from wfbook.go1_dynamics import GRAVITY
from wfbook.qp import directions_left
from wfbook.reference import Constraints, Gains, delay_margin, delayed_error
from wfbook.stance import limits_reached, rehearse, rolling, squeezes, stand

SIDEWAYS = np.array([0.0, 9.0, 0.0])


def answer(stance, asked=(0.0, 0.0, 0.0), **kept):
    """One program's answer, exactly solved."""
    ref = replace(stance.ref, com_acceleration=np.array(asked, float))
    gains = Gains(constraints=Constraints(**kept))
    return wbc.WholeBodyController(stance.robot, gains, "daqp").tick(ref, stance.ground)


def local(stance, command):
    """Forces along t, b, n."""
    return np.einsum("lij,lj->li", stance.contact.basis, command.forces)


def test_a_stance_is_at_rest_and_asks_for_nothing():
    stance = stand((0, 1, 1, 0))
    np.testing.assert_allclose(stance.robot.com, stance.ref.com, atol=1e-9)
    np.testing.assert_allclose(stance.contact.velocity, 0.0)
    assert limits_reached(stance, answer(stance), 3.0) == []
    with pytest.raises(ValueError, match="standing"):
        stand(standing=(0, 0, 0, 0))


def test_without_friction_a_foot_holds_more_than_it_can():
    stance = stand(mu=0.3)
    held = local(stance, answer(stance, SIDEWAYS))
    assert np.all(np.abs(held[:, 1]) <= 0.3 * held[:, 2] + 1e-6)
    believed = answer(stance, SIDEWAYS, friction=False)
    assert np.any(np.abs(local(stance, believed)[:, 1]) > 0.5 * local(stance, believed)[:, 2])
    assert any("more friction than there is" in line for line in limits_reached(stance, believed, 3.0))


def test_without_friction_wheels_push():
    """Asked to turn on the spot: the wheels of one side forward, those of the other back."""
    stance = stand((1, 1, 1, 1))
    ref = replace(stance.ref, angular_acceleration=np.array([0.0, 0.0, 20.0]))
    for friction in (True, False):
        gains = Gains(constraints=Constraints(friction=friction))
        command = wbc.WholeBodyController(stance.robot, gains, "daqp").tick(ref, stance.ground)
        pushing = np.abs(local(stance, command)[:, 0]).max()
        assert pushing < 1e-6 if friction else pushing > 1.0


def test_the_ground_pulls_only_when_both_of_its_rows_are_left_out():
    stance = stand()
    down = (0.0, 0.0, -15.0)
    for kept in ({}, {"friction": False}, {"pushing": False}):
        assert local(stance, answer(stance, down, **kept))[:, 2].min() > -1e-6
    assert local(stance, answer(stance, down, friction=False, pushing=False))[:, 2].max() < -1.0


def test_without_motor_limits_the_program_asks_for_more_than_they_give():
    stance = stand()
    stance.robot.effort = 0.3 * stance.robot.effort
    for limited in (True, False):
        ref = replace(stance.ref, com_acceleration=np.array([0.0, 0.0, 30.0]))
        gains = Gains(constraints=Constraints(torques=limited))
        controller = wbc.WholeBodyController(stance.robot, gains, "daqp")
        *program, _ = controller.problem(ref, stance.ground)
        u = controller._program.solve(*program)
        torques = program[2][-12:] @ u + stance.robot.h[6:]
        assert bool(np.all(np.abs(torques) <= stance.robot.effort + 1e-6)) == limited


@pytest.mark.parametrize(("name", "rows"), [("feet", [0, 3]), ("wheels", [1, 2])])
def test_contacts_that_are_left_out_are_free_and_the_others_held(name, rows):
    stance = stand((0, 1, 1, 0))
    controller = wbc.WholeBodyController(stance.robot, Gains(constraints=Constraints(**{name: False})))
    _, _, _, lower, upper, _ = controller.problem(stance.ref, stance.ground)
    held = (lower[6:18] == upper[6:18]).reshape(4, 3).any(axis=1)
    assert [leg for leg in range(4) if not held[leg]] == rows


def test_a_leg_in_the_air_presses_on_nothing_whatever_is_left_out():
    stance = stand(standing=(1, 1, 0, 1))
    forces = answer(stance, SIDEWAYS, friction=False, pushing=False, feet=False, torques=False).forces
    np.testing.assert_allclose(forces[2], 0.0, atol=1e-9)


@pytest.mark.parametrize("gains", [(640, 50, 0), (640, 50, 6000), (200, 28, 0), (900, 20, 0)])
def test_an_error_fades_below_the_delay_margin_and_grows_above(gains):
    margin = delay_margin(*gains)
    for share, grows in ((0.85, False), (1.15, True)):
        _, error = delayed_error(*gains, share * margin, 4.0, step=margin / 100)
        last = np.abs(error[-len(error) // 4 :]).max()
        assert last > 10.0 if grows else last < 0.1


def test_delay_margins_at_the_ends():
    assert delay_margin(0.0, 40.0) == pytest.approx(np.pi / 80.0), "a first-order loop: a quarter turn"
    assert delay_margin(100.0, 0.0) == 0.0, "a spring without a damper never comes to rest"
    assert delay_margin(0.0, 0.0) == np.inf
    assert delay_margin(10.0, 1.0, 20.0) == 0.0
    with pytest.raises(ValueError, match="kd"):
        delay_margin(1.0, -1.0)


@pytest.mark.parametrize("feet", [(0, 0, 0, 0), (0, 0, 0, 1), (1, 1, 0, 0)])
def test_the_printed_cost_leaves_open_what_the_trunk_does_not_feel(feet):
    """Forces: three a leg. The trunk feels six sums of them, of four points in a plane: all six."""
    stance = stand(feet)
    printed = Gains(force_weight=0.0, acceleration_weight=0.0)
    for gains, open_ones in ((printed, True), (Gains(), False)):
        P, _, A, lower, upper, _ = wbc.WholeBodyController(stance.robot, gains).problem(
            stance.ref, stance.ground
        )
        curvatures, directions = directions_left(P, A, lower, upper)
        np.testing.assert_allclose(directions.T @ directions, np.eye(len(curvatures)), atol=1e-9)
        np.testing.assert_allclose(A[lower == upper] @ directions, 0.0, atol=1e-9)
        assert (np.sum(curvatures < 1e-9) == 6) == open_ones


def test_squeezes_are_no_force_and_no_torque():
    points = stand().robot.centres
    forces = squeezes(points)
    np.testing.assert_allclose(forces.sum(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.cross(points, forces).sum(axis=1), 0.0, atol=1e-3)
    assert np.linalg.matrix_rank(forces.reshape(7, 12)) == 6


def test_limits_are_named():
    stance = stand()
    assert all(line.startswith("F") for line in limits_reached(stance, answer(stance, (6, 0, 0)), 3.0))
    stance.robot.effort = 0.3 * stance.robot.effort
    assert any("torque limit" in line for line in limits_reached(stance, answer(stance, (0, 0, 30)), 3.0))


def test_a_rolling_velocity_rolls():
    cart = stand((1, 1, 1, 1))
    cart.robot.update(cart.qpos, rolling(cart, 0.5, 0.8))
    np.testing.assert_allclose(cart.contact.velocity, [[0.5, 0.0, 0.0]] * 4, atol=1e-12)
    np.testing.assert_allclose(cart.robot.R_wb @ cart.robot.velocity[3:6], [0.0, 0.0, 0.8], atol=1e-12)


def rehearsal(turning_axle, damping=0.0, duration=0.2):
    cart = stand((1, 1, 1, 1))
    gains = Gains(contact_damping=damping, constraints=Constraints(turning_axle=turning_axle))
    controller = wbc.WholeBodyController(cart.robot, gains, "daqp")
    return rehearse(cart, controller, rolling(cart, 0.5, 0.8), duration, 0.8)


def test_eq_41_as_printed_scrubs_by_the_term_it_lacks():
    printed, ours = rehearsal(False), rehearsal(True)
    sideways = [np.abs(r.contact_velocity[-1, :, 1]) for r in (printed, ours)]
    np.testing.assert_allclose(sideways[0], 0.5 * 0.8 * printed.t[-1], rtol=0.06)
    assert sideways[1].max() < 0.05 * sideways[0].min()


def test_a_rehearsal_follows_its_reference():
    ours = rehearsal(True, 40.0)
    np.testing.assert_allclose(ours.com[-1] - ours.com[0], [0.5 * ours.t[-1], 0.0, 0.0], atol=1e-3)
    weight = ours.forces[:, :, 2].sum(axis=1)
    np.testing.assert_allclose(weight, -stand().robot.mass * GRAVITY[2], rtol=0.01)
