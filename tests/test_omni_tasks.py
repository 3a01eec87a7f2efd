"""Chapter 11's tasks: a hand that moves, a wheel that is lifted, contacts that there should not be."""

import numpy as np
import pinocchio as pin
import pytest
from test_omni_problem import check_derivatives, disturbed

from wfbook.omni.locked import holding_effort, nominal_state
from wfbook.omni.problem import OptimalControl
from wfbook.omni.robot import WHEEL_RADIUS
from wfbook.omni.tasks import (
    HAND_STEP,
    STARTS,
    ask,
    attempt,
    begin,
    gap,
    hand_path,
    lifting,
    planned,
    reaching,
    ride,
    twelve_rows,
)
from wfbook.omni.touching import WALL

REST = nominal_state()


@pytest.fixture(scope="module")
def reached():
    ocp = reaching(nodes=30)
    return ocp, attempt(ocp, REST), planned(ocp)


@pytest.fixture(scope="module")
def lifted():
    ocp = lifting("FL", height=0.12, forward=0.05, shift=0.5)
    return ocp, attempt(ocp, REST), planned(ocp)


def test_the_hand_goes_where_it_is_asked(reached):
    _, solved, plan = reached
    assert solved.converged and plan.hand_error < 0.01
    np.testing.assert_allclose(plan.asked - plan.hand[0], np.tile(HAND_STEP, (31, 1)), atol=1e-9)
    assert plan.tilt < 0.2 and plan.grip < 1.3


def test_a_motions_forces_move_its_centre_of_mass(reached, lifted):
    for ocp, _, plan in (reached, lifted):
        ocp.problem.calc(ocp.xs, ocp.us)
        data = ocp.model.createData()
        for x, force, node in zip(plan.x, plan.contact_force, ocp.problem.runningDatas, strict=False):
            pin.centerOfMass(ocp.model, data, x[:21], x[21:], np.array(node.differential.xout))
            pushed = force.sum(axis=0) / pin.computeTotalMass(ocp.model) - [0.0, 0.0, 9.81]
            np.testing.assert_allclose(data.acom[0], pushed, atol=1e-6)


def test_costs_and_gaps_are_logged_from_the_first_guess_on():
    ocp = reaching(nodes=20)
    begin(ocp, REST, "no torque")
    first = ocp.problem.calc(ocp.xs, ocp.us)
    open_gap = gap(ocp)
    solved = attempt(ocp, REST)
    assert solved.costs[0] == pytest.approx(first) and solved.gaps[0] == pytest.approx(open_gap)
    assert open_gap > 0.1 and solved.gaps[-1] < 1e-6 and len(solved.gaps) == len(solved.costs)
    assert solved.iterations == len(solved.costs) - 1 == ocp.solver.iter + 1
    assert solved.costs[-1] == pytest.approx(ocp.solver.cost)


def test_what_a_search_may_begin_with():
    ocp = reaching(nodes=10)
    gaps = {}
    for start in STARTS:
        begin(ocp, REST, start)
        ocp.problem.calc(ocp.xs, ocp.us)
        gaps[start] = gap(ocp)
    assert gaps["standing"] < 1e-9 and gaps["fall"] < 1e-9 < gaps["no torque"]
    begin(ocp, REST, "fall")
    assert ocp.xs[-1][2] < REST[2] - 0.01 and not np.any(ocp.us)
    with pytest.raises(ValueError, match="start: 'lying'"):
        begin(ocp, REST, "lying")


def test_a_guess_that_lies_is_better_than_a_fall():
    costs = {}
    for start in ("no torque", "fall"):
        ocp = reaching(nodes=40)
        begin(ocp, REST, start)
        costs[start] = attempt(ocp, REST, 15).costs[-1]
    assert costs["no torque"] < 10.0 and costs["fall"] > 100.0 * costs["no torque"]


def test_a_path_spares_the_motors(reached):
    ocp = reaching(nodes=30, path=lambda share: min(1.3 * share, 1.0))
    attempt(ocp, REST)
    gentle = planned(ocp)
    assert gentle.load.max() < 0.3 * reached[2].load.max()
    assert gentle.asked[0] == pytest.approx(gentle.hand[0]) and gentle.hand_error < 0.015


def test_a_wheel_is_lifted_and_set_down(lifted):
    _, solved, plan = lifted
    air = ~plan.stance
    assert solved.converged
    assert not air[:, 1:].any() and air[:, 0].sum() == 30
    assert np.all(plan.contact_force[:-1][air[:-1]] == 0.0)
    assert 0.11 < plan.p[:, 0, 2].max() < 0.13 and abs(plan.p[-1, 0, 2]) < 4e-3
    assert plan.p[-1, 0, 0] - plan.p[0, 0, 0] == pytest.approx(0.05, abs=6e-3)
    others = plan.p[:, 1:] - plan.p[0, 1:]
    assert np.abs(others).max() < 6e-3, "the others stand, and lean"
    assert plan.lightest > -2.0 and plan.load.max() < 1.0
    assert np.linalg.norm(plan.hand - plan.hand[0], axis=1).max() < 0.02
    assert plan.p[0, :, 2] == pytest.approx(np.zeros(4), abs=1e-9)
    with pytest.raises(ValueError, match="leg: 'tail'"):
        lifting("tail")


def test_wheels_that_stand_nowhere_are_held_up():
    ocp = OptimalControl(20, mode="legged")
    ask(ocp, (0.0, 0.0, 0.0), stance=(False, True, True, True))
    attempt(ocp, REST)
    plan = planned(ocp)
    assert plan.p[-1, 0, 2] > 0.05 and np.all(plan.contact_force[:, 0] == 0.0)


def test_feedback_brings_the_robot_back_and_torques_alone_do_not():
    ocp = reaching((0.0, 0.0, 0.0), nodes=20)
    attempt(ocp, REST)
    near = ocp.state.integrate(REST, 5e-3 * np.random.default_rng(0).standard_normal(40))
    home = hand_path(ocp, [REST])[0]
    off = [
        np.linalg.norm(hand_path(ocp, ride(ocp, near, feedback)) - home, axis=1) for feedback in (True, False)
    ]
    assert len(off[0]) == 201 and off[0][0] == pytest.approx(off[1][0])
    assert off[0][-1] < 0.1 * off[0][0] < 0.5 * off[1][-1]
    np.testing.assert_allclose(hand_path(ocp, ride(ocp, REST))[-1], home, atol=1e-3)


def test_a_ride_that_runs_away_ends():
    ocp = reaching((0.0, 0.0, 0.0), nodes=40)
    attempt(ocp, REST)
    ocp.us = [np.full(14, 2000.0) for _ in ocp.us]
    assert len(ride(ocp, REST, feedback=False)) < 401


def test_twelve_rows_have_no_answer():
    ocp = reaching(nodes=10)
    twelve_rows(ocp)
    solved = attempt(ocp, REST, 40)
    assert not solved.converged


@pytest.mark.parametrize("also", ["hand", "axle"])
@pytest.mark.parametrize("seed", range(2))
def test_derivatives_with_other_contacts(also, seed):
    rng = np.random.default_rng(seed)
    ocp = OptimalControl(1, mode="legged", also=[also])
    x = disturbed(ocp, rng, 0.1)
    ocp.place_contacts(x)
    check_derivatives(ocp, ocp.actions[0], x, holding_effort(ocp.model, x) + 5 * rng.standard_normal(14))


def test_a_glued_wheel_does_not_tilt_and_takes_the_moment_for_it():
    rng = np.random.default_rng(0)
    ocp = OptimalControl(1, also=["axle"])
    x = disturbed(ocp, rng, 0.05)
    x[21:] = 0.0
    ocp.place_contacts(x)
    u = holding_effort(ocp.model, x) + 5 * rng.standard_normal(14)
    a, data = ocp.acceleration(x, u), ocp.model.createData()
    pin.forwardKinematics(ocp.model, data, x[:21], x[21:], a)
    turning = []
    for leg in ("FL", "FR", "RL", "RR"):
        frame = ocp.model.getFrameId(f"{leg}_axle")
        turning.append(pin.getFrameAcceleration(ocp.model, data, frame, pin.LOCAL).angular[1])
    assert turning[0] == pytest.approx(0.0, abs=1e-8) and turning[3] == pytest.approx(0.0, abs=1e-8)
    assert abs(turning[1]) > 1e-3
    ocp.xs, ocp.us = [x, x], [u]
    ocp.problem.calc(ocp.xs, ocp.us)
    # Eq. 2: what motors, contacts and gravity do adds up to M a.
    forces = np.zeros(20)
    pin.computeJointJacobians(ocp.model, data, x[:21])
    pin.updateFramePlacements(ocp.model, data)
    for name in ("FL", "FR", "RL", "RR"):
        J = pin.getFrameJacobian(ocp.model, data, ocp.model.getFrameId(f"{name}_xyz"), pin.LOCAL)
        forces += J[:3].T @ ocp.forces(0)[("FL", "FR", "RL", "RR").index(name)]
    for name, wrench in ocp.others(0).items():
        J = pin.getFrameJacobian(ocp.model, data, ocp.model.getFrameId(name), pin.LOCAL)
        assert np.all(wrench[[0, 1, 2, 3, 5]] == 0.0)
        forces += J.T @ wrench
    M, h = pin.crba(ocp.model, data, x[:21]), pin.nonLinearEffects(ocp.model, data, x[:21], x[21:])
    M = np.triu(M) + np.triu(M, 1).T
    np.testing.assert_allclose(M @ a + h, np.concatenate([np.zeros(6), u]) + forces, atol=1e-7)


def test_a_hand_on_the_wall_stays_there():
    ocp = OptimalControl(20, mode="legged", also=["hand"])
    ask(ocp, (0.05, 0.0, 0.0))  # through the wall
    attempt(ocp, REST)
    plan = planned(ocp)
    assert np.linalg.norm(plan.hand[-1] - plan.hand[0]) < 2e-3 and plan.hand_error > 0.04
    with pytest.raises(ValueError, match="also: 'tail'"):
        OptimalControl(1, also=["tail"])


def test_an_arm_that_pushes_feels_the_wall():
    ocp = OptimalControl(1, mode="legged", also=["hand"])
    data = ocp.model.createData()
    hand = ocp.model.getFrameId("hand")
    J = pin.computeFrameJacobian(ocp.model, data, REST[:21], hand, pin.LOCAL_WORLD_ALIGNED)[:3]
    torques, pushes = [], []
    for push in (0.0, 20.0):
        # What the arm's motors give to press ahead; the rest of the robot braces itself as it may.
        torques.append(holding_effort(ocp.model, REST) + push * J[0, 6:])
        ocp.problem.calc([REST, REST], [torques[-1]])
        pushes.append(ocp.others(0)["hand"][:3])
    gained = pushes[1] - pushes[0]
    assert gained[0] < -5.0, "the wall pushes back"
    assert WALL[:, 2] @ gained > 0.0
    np.testing.assert_allclose(WALL @ WALL.T, np.eye(3))
    assert np.linalg.det(WALL) == pytest.approx(1.0)


def test_the_lowest_points_are_below_the_axles(reached):
    ocp, _, plan = reached
    data = ocp.model.createData()
    pin.framesForwardKinematics(ocp.model, data, plan.x[-1][:21])
    for leg, point in zip(("FL", "FR", "RL", "RR"), plan.p[-1], strict=True):
        axle = data.oMf[ocp.model.getFrameId(f"{leg}_axle")].translation
        assert np.linalg.norm(point - axle) == pytest.approx(WHEEL_RADIUS)
        assert point[2] == pytest.approx(axle[2] - WHEEL_RADIUS, abs=1e-3)
