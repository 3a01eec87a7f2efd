"""Eqs 16 and 17 in Crocoddyl: derivatives, contacts, costs, warm start."""

import itertools
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from wfbook.modes import LEGS
from wfbook.omni import costs
from wfbook.omni.costs import TERMS, Weights
from wfbook.omni.dynamics import LOCKED, forward_dynamics
from wfbook.omni.locked import (
    MOTORS,
    accompanying,
    held_rows,
    holding_effort,
    locked_state,
    mujoco_state,
    nominal_state,
    nominal_target,
)
from wfbook.omni.problem import _ROLLING, OptimalControl
from wfbook.omni.robot import NV, WHEEL_RADIUS, Omni, OmniDynamics, posture
from wfbook.omni.wrench import point_contact
from wfbook.terrain import flat

STANCES = [s for s in itertools.product([True, False], repeat=4) if any(s)]


def standing(nodes: int = 20, **options) -> OptimalControl:
    """A problem whose nominal state is its own optimum."""
    ocp = OptimalControl(nodes, **options)
    ocp.refer([replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))] * (nodes + 1))
    return ocp


def disturbed(ocp: OptimalControl, rng: np.random.Generator, size: float) -> np.ndarray:
    return ocp.state.integrate(nominal_state(), size * rng.standard_normal(40))


def check_derivatives(ocp: OptimalControl, action, x: np.ndarray, u: np.ndarray) -> None:
    """Fx, Fu, Lx and Lu of one node against central differences."""
    state, data, step = ocp.state, ocp.problem.runningDatas[0], 1e-6
    action.calc(data, x, u)
    action.calcDiff(data, x, u)
    found = [np.array(m) for m in (data.Fx, data.Fu, data.Lx, data.Lu)]
    probe = action.createData()

    def after(x, u):
        action.calc(probe, x, u)
        return np.array(probe.xnext), probe.cost

    base = after(x, u)[0]

    def slope(plus, minus):
        ahead, back = state.diff(base, plus[0]), state.diff(base, minus[0])
        return (ahead - back) / (2 * step), (plus[1] - minus[1]) / (2 * step)

    columns = []
    for e in step * np.eye(40):
        columns.append(slope(after(state.integrate(x, e), u), after(state.integrate(x, -e), u)))
    for e in step * np.eye(14):
        columns.append(slope(after(x, u + e), after(x, u - e)))
    F = np.array([c[0] for c in columns]).T
    L = np.array([c[1] for c in columns])
    for exact, numeric in zip(found, (F[:, :40], F[:, 40:], L[:40], L[40:]), strict=True):
        np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-5 * max(1.0, np.abs(numeric).max()))


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_rolling_on_slopes_with_steered_wheels(seed):
    rng = np.random.default_rng(seed)
    ocp = standing(1)
    x = disturbed(ocp, rng, 0.1)
    normals = np.array([0.0, 0.0, 1.0]) + 0.2 * rng.standard_normal((4, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    ocp.place_contacts(x, rng.uniform(-1.5, 1.5, 4), normals)
    check_derivatives(ocp, ocp.actions[0], x, holding_effort(ocp.model, x) + 5 * rng.standard_normal(14))


@pytest.mark.parametrize("seed", range(3))
def test_rolling_contacts_go_as_they_are_told(seed):
    rng = np.random.default_rng(seed)
    ocp = standing(1)
    x = disturbed(ocp, rng, 0.1)
    normals = np.array([0.0, 0.0, 1.0]) + 0.2 * rng.standard_normal((4, 3))
    ocp.place_contacts(x, rng.uniform(-1.5, 1.5, 4), normals / np.linalg.norm(normals, axis=1)[:, None])
    ocp.hold(x)
    velocities = 0.3 * rng.standard_normal((2, 4, 3))
    ocp.roll(velocities)
    u = holding_effort(ocp.model, x) + 5 * rng.standard_normal(14)
    check_derivatives(ocp, ocp.actions[0], x, u)
    gained, data = ocp.acceleration(x, u), ocp.model.createData()
    pin.forwardKinematics(ocp.model, data, x[:21], x[21:], gained)
    for i, (leg, rows) in enumerate(held_rows((True,) * 4).items()):
        args = ocp.model, data, ocp.model.getFrameId(f"{leg}_{rows}")
        pin.updateFramePlacement(*args)
        R = data.oMf[args[2]].rotation
        speed = pin.getFrameVelocity(*args, pin.LOCAL).linear
        found = pin.getFrameClassicalAcceleration(*args, pin.LOCAL).linear
        told = (velocities[1, i] - velocities[0, i]) / ocp.dt + _ROLLING * velocities[0, i]
        keep = ["xyz".index(row) for row in rows]
        np.testing.assert_allclose(found[keep], (told @ R - _ROLLING * speed)[keep], atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_legs_and_arm_go_along_with_the_ground(seed):
    rng = np.random.default_rng(seed)
    ocp = standing(1)
    x = disturbed(ocp, rng, 0.1)
    velocities = 0.3 * rng.standard_normal((1, 4, 3))
    v = accompanying(ocp.model, [x], velocities)[0]
    data = ocp.model.createData()
    pin.forwardKinematics(ocp.model, data, x[:21], v)
    hand = pin.getFrameVelocity(ocp.model, data, ocp.model.getFrameId("hand"), pin.LOCAL)
    np.testing.assert_allclose(hand.vector, 0.0, atol=0.02)
    for leg, wanted in zip(LEGS, velocities[0], strict=True):
        frame = ocp.model.getFrameId(f"{leg}_xyz")
        found = pin.getFrameVelocity(ocp.model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
        np.testing.assert_allclose(found[[0, 2]], wanted[[0, 2]], atol=0.05)
    assert accompanying(ocp.model, [x], np.zeros((1, 4, 3))) == pytest.approx(0.0)


@pytest.mark.parametrize("stance", [(True,) * 4, (False, True, True, True), (False, False, True, True)])
def test_derivatives_of_standing_and_swinging(stance):
    rng = np.random.default_rng(1)
    ocp = standing(1, mode="legged")
    ocp.stand([stance] * 2)
    x = disturbed(ocp, rng, 0.1)
    ocp.place_contacts(x)
    check_derivatives(ocp, ocp.actions[0], x, holding_effort(ocp.model, x) + 5 * rng.standard_normal(14))


@pytest.mark.parametrize("term", [*TERMS, "contact"])
def test_every_term_alone_has_its_derivatives(term):
    """Eq. 17, term by term."""
    rng = np.random.default_rng(2)
    ocp = standing(1, without={*TERMS, "contact"} - {term})
    x = disturbed(ocp, rng, 0.4)
    x[[8, 17]] = 0.3, 0.2  # a knee and a joint of the arm beyond their range
    ocp.place_contacts(x)
    u = 40 * rng.standard_normal(14)
    data = ocp.actions[0].createData()
    ocp.actions[0].calc(data, x, u)
    assert data.cost > 0.0
    check_derivatives(ocp, ocp.actions[0], x, u)


@pytest.mark.parametrize("steered", [0.0, 0.7, np.pi / 2])
@pytest.mark.parametrize("stance", STANCES)
def test_contacts_are_never_redundant(stance, steered):
    ocp, x = OptimalControl(1, mode="legged"), nominal_state()
    ocp.place_contacts(x, np.full(4, steered))
    data = ocp.model.createData()
    pin.computeJointJacobians(ocp.model, data, x[:21])
    pin.updateFramePlacements(ocp.model, data)
    rows = []
    for leg, directions in held_rows(stance).items():
        J = pin.getFrameJacobian(ocp.model, data, ocp.model.getFrameId(f"{leg}_{directions}"), pin.LOCAL)
        rows.append(J[["xyz".index(d) for d in directions]])
    rows = np.vstack(rows)
    assert np.linalg.matrix_rank(rows, tol=1e-6) == len(rows)
    assert len(rows) == (10 if all(stance) else len(rows))


@pytest.mark.parametrize("seed", range(3))
def test_accelerations_and_forces_are_those_of_eq_4(seed):
    rng = np.random.default_rng(seed)
    ocp = OptimalControl(1)
    x = disturbed(ocp, rng, 0.1)
    x[21:] = 0.0  # the frames of chapter 10 follow the tyre, those here the fork; at rest they are the same
    x[3:7] = [0.0, 0.0, 0.0, 1.0]
    ocp.place_contacts(x)
    u = holding_effort(ocp.model, x) + rng.standard_normal(14)
    data = ocp.actions[0].createData()
    ocp.actions[0].calc(data, x, u)
    torques = np.zeros(23)
    torques[MOTORS] = u
    expected = forward_dynamics(OmniDynamics(), *mujoco_state(x, posture()), torques, locked=LOCKED)
    keep = [*range(6), *(6 + MOTORS)]
    np.testing.assert_allclose(data.differential.xout, expected.acceleration[keep], atol=1e-8)
    ocp.xs, ocp.us = [x, x], [u]
    ocp.problem.calc([x, x], [u])
    rows = zip(ocp.forces(0), ([0, 1, 2], [0, 2], [0, 2], [0, 1, 2]), strict=True)
    found = np.concatenate([force[keep] for force, keep in rows])
    np.testing.assert_allclose(found, expected.force[:10], atol=1e-6)


def test_the_contacts_stand_where_the_wheels_touch():
    robot, ocp = Omni(flat()), OptimalControl(1)
    qpos = posture()
    qpos[3:7] = pin.Quaternion(pin.utils.rotate("y", 0.2)).coeffs()[[3, 0, 1, 2]]
    qpos[[9, 13, 17, 21]] = angles = np.array([0.4, -1.0, 1.5, 0.1])
    robot.reset(qpos)
    x = locked_state(qpos, np.zeros(NV))
    ocp.place_contacts(x, angles)
    data = ocp.model.createData()
    pin.framesForwardKinematics(ocp.model, data, x[:21])
    for i, leg in enumerate(LEGS):
        frame = data.oMf[ocp.model.getFrameId(f"{leg}_xyz")]
        np.testing.assert_allclose(frame.rotation[:, 1], robot.axles[i], atol=1e-12)
        np.testing.assert_allclose(frame.rotation.T @ frame.rotation, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(
            np.linalg.norm(frame.translation - robot.centres[i]), WHEEL_RADIUS, atol=1e-12
        )
        # No point of the wheel is lower.
        turn = np.linspace(-np.pi, np.pi, 721)
        ahead = np.cross(robot.axles[i], [0.0, 0.0, 1.0])
        ahead /= np.linalg.norm(ahead)
        up = np.cross(ahead, robot.axles[i])
        rim = robot.centres[i] + WHEEL_RADIUS * (np.outer(np.cos(turn), ahead) + np.outer(np.sin(turn), up))
        assert frame.translation[2] <= rim[:, 2].min() + 1e-12


def test_states_go_to_mujoco_and_back():
    rng = np.random.default_rng(0)
    x = OptimalControl(1).state.rand()
    x[3:7] /= np.linalg.norm(x[3:7])
    qpos, qvel = mujoco_state(x, posture())
    np.testing.assert_allclose(locked_state(qpos, qvel), x, atol=1e-12)
    qpos[7 + MOTORS] = rng.standard_normal(14)
    assert locked_state(qpos, qvel).shape == (41,)


def test_the_pyramid_is_that_of_chapter_10():
    cone, mu = costs.pyramid(0.7), 0.7
    A, b = point_contact(mu).cut(("fx", "fy", "fz"))
    rng = np.random.default_rng(0)
    for force in rng.normal([0, 0, 50], 50, (500, 3)):
        rows = np.array(cone.A) @ force
        inside = np.all(rows <= np.array(cone.ub) + 1e-9) and np.all(rows >= np.array(cone.lb) - 1e-9)
        assert inside == bool(np.all(A @ force <= b + 1e-9))


def test_the_penalty_sees_each_force_in_its_contacts_axes():
    """Eqs 8 and 9 in Crocoddyl."""
    rng = np.random.default_rng(3)
    ocp = standing(1)
    x = disturbed(ocp, rng, 0.2)
    normals = np.array([0.0, 0.0, 1.0]) + 0.2 * rng.standard_normal((4, 3))
    ocp.place_contacts(x, rng.uniform(-1.5, 1.5, 4), normals / np.linalg.norm(normals, axis=1)[:, None])
    ocp.problem.calc([x, x], [holding_effort(ocp.model, x) + 20 * rng.standard_normal(14)])
    terms = ocp.problem.runningDatas[0].differential.costs.costs.todict()
    for leg, force in zip(LEGS, ocp.forces(0), strict=True):
        rows = held_rows((True,) * 4)[leg]
        expected = np.array(costs.pyramid(ocp.mu).A) @ force
        np.testing.assert_allclose(terms[f"{leg}_{rows}_force"].residual.r, expected, atol=1e-9)


def test_standing_is_an_optimum_and_forces_carry_the_robot():
    ocp = standing(20)
    x = nominal_state()
    ocp.hold(x)
    assert ocp.solve(x)
    assert ocp.solver.iter <= 1
    weight = 9.81 * pin.computeTotalMass(ocp.model)
    assert ocp.forces(0)[:, 2].sum() == pytest.approx(weight, rel=1e-3)
    assert np.abs(ocp.xs[-1][:21] - x[:21]).max() < 5e-3


def test_the_hand_gets_where_it_is_asked_to():
    ocp = OptimalControl(50)
    target = replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))
    wanted = target.hand + np.array([0.05, 0.05, 0.08])
    ocp.refer([replace(target, hand=wanted)] * 51)
    ocp.hold(nominal_state())
    assert ocp.solve(nominal_state())
    data = ocp.model.createData()
    pin.framesForwardKinematics(ocp.model, data, ocp.xs[-1][:21])
    hand = data.oMf[ocp.model.getFrameId("hand")]
    assert abs(hand.translation[2] - wanted[2]) < 3e-3
    assert np.linalg.norm(hand.translation - wanted) < 2e-2
    assert np.linalg.norm(pin.log3(target.hand_rotation.T @ hand.rotation)) < 2e-2


def test_a_solution_keeps_to_the_dynamics():
    """Eq. 16."""
    ocp = standing(20)
    x = disturbed(ocp, np.random.default_rng(0), 0.01)
    ocp.place_contacts(x)
    ocp.solve(x)
    for action, before, u, after in zip(ocp.actions[:-1], ocp.xs[:-1], ocp.us, ocp.xs[1:], strict=True):
        data = action.createData()
        action.calc(data, before, u)
        np.testing.assert_allclose(ocp.state.diff(np.array(data.xnext), after), 0.0, atol=1e-6)


def test_feedback_is_how_the_torque_changes_with_the_state():
    """Eq. 21."""
    ocp = standing(10)
    x = nominal_state()
    ocp.solve(x)
    torque, K = ocp.us[0].copy(), ocp.feedback(0)
    step = np.zeros(40)
    step[[3, 6, 15, 25]] = 1e-5
    xs, us = list(ocp.xs), list(ocp.us)
    near = ocp.state.integrate(x, step)
    predicted = ocp.follow(0.0, near)[1] - torque
    np.testing.assert_allclose(predicted, K @ step, atol=1e-6)
    ocp.xs, ocp.us = xs, us
    ocp.solve(near)
    np.testing.assert_allclose(ocp.us[0] - torque, predicted, atol=2e-2 * np.abs(predicted).max())


def test_a_shifted_solution_saves_iterations():
    ocp = OptimalControl(30)
    target = replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))
    ocp.refer([replace(target, hand=target.hand + 0.05)] * 31)
    ocp.hold(nominal_state())
    ocp.solve(nominal_state())
    x = ocp.xs[1].copy()
    ocp.shift()
    assert len(ocp.xs) == 31
    assert len(ocp.us) == 30
    ocp.solve(x)
    warm, cost = ocp.solver.iter, ocp.solver.cost
    ocp.hold(x)
    ocp.solve(x)
    assert warm < ocp.solver.iter
    assert cost == pytest.approx(ocp.solver.cost, rel=1e-2)


def test_a_box_keeps_torques_within_the_motors_limits():
    ocp = OptimalControl(15, solver="BoxFDDP")
    target = replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))
    ocp.refer([replace(target, hand=target.hand + 0.15)] * 16)
    ocp.hold(nominal_state())
    ocp.solve(nominal_state(), 30)
    assert np.all(np.abs(ocp.us) <= ocp.model.effortLimit[6:] + 1e-9)


def test_a_swinging_wheel_follows_its_path():
    ocp = OptimalControl(30, mode="legged", weights=Weights(posture=0.1))
    lifted = (False, True, True, True)
    ocp.stand([lifted] * 31)
    target = replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))
    feet = target.feet.copy()
    feet[0] += [0.05, 0.0, 0.08]
    ocp.refer([replace(target, feet=feet)] * 31)
    ocp.solve(nominal_state())
    data = ocp.model.createData()
    pin.framesForwardKinematics(ocp.model, data, ocp.xs[-1][:21])
    swung = data.oMf[ocp.model.getFrameId("FL_axle")].translation
    assert np.linalg.norm(swung - feet[0]) < 0.01
    touched = [data.oMf[ocp.model.getFrameId(f"{leg}_xyz")].translation for leg in LEGS[1:]]
    np.testing.assert_allclose(touched, target.feet[1:] - [0.0, 0.0, WHEEL_RADIUS], atol=3e-3)
    assert np.all(ocp.forces(5)[0] == 0.0)


def test_what_is_wrong_is_said():
    with pytest.raises(ValueError, match="mode: 'flying'"):
        OptimalControl(1, mode="flying")
    with pytest.raises(ValueError, match="solver: 'DDQ'"):
        OptimalControl(1, solver="DDQ")
    with pytest.raises(ValueError, match="without: magic"):
        OptimalControl(1, without=["magic"])
    with pytest.raises(ValueError, match=r"stances\[0\]"):
        OptimalControl(1).stand([(False, True, True, True)] * 2)
    with pytest.raises(ValueError, match="roll: wheels are locked"):
        OptimalControl(1, mode="legged").roll(np.zeros((2, 4, 3)))


def test_a_solution_that_is_not_finite_is_refused_and_the_last_one_kept():
    ocp = standing(5)
    ocp.solve(nominal_state())
    before = [u.copy() for u in ocp.us]
    x = nominal_state()
    x[30] = np.nan
    with pytest.raises((FloatingPointError, ValueError)):
        ocp.solve(x)
    np.testing.assert_array_equal(ocp.us, before)
