"""Chapter 11: the plain DDP against Riccati, finite differences, another optimiser and Crocoddyl."""

import itertools

import crocoddyl
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.optimize import minimize

from wfbook.omni.bellman import tabulate
from wfbook.omni.ddp import (
    Expansion,
    backward,
    expansion,
    forward,
    gains,
    iterations,
    parabolas,
    rollout,
    solve,
    total_cost,
    value,
)
from wfbook.omni.systems import Honey, LinearQuadratic, Pendulum, Unicycle

N = 30


def definite(random, size, least=0.1):
    root = random.normal(size=(size, size))
    return root @ root.T + least * np.eye(size)


def linear(seed=0, n=4, m=2):
    random = np.random.default_rng(seed)
    weights = definite(random, n + m)
    return LinearQuadratic(
        F=np.eye(n) + 0.2 * random.normal(size=(n, n)),
        G=random.normal(size=(n, m)),
        c=0.1 * random.normal(size=n),
        Q=weights[:n, :n],
        R=weights[n:, n:],
        N=weights[:n, n:],
        P=definite(random, n),
    )


class Known(crocoddyl.ActionModelAbstract):
    """One of our systems for Crocoddyl."""

    def __init__(self, system, n, m, final=False):
        super().__init__(crocoddyl.StateVector(n), m, 1)
        self.system, self.final = system, final

    def calc(self, data, x, u=None):
        if self.final or u is None:
            data.cost, data.xnext = self.system.final_cost(x), x
        else:
            data.cost, data.xnext = self.system.cost(x, u), self.system.step(x, u)

    def calcDiff(self, data, x, u=None):
        if self.final or u is None:
            data.Lx, data.Lxx = self.system.final_derivatives(x)
        else:
            data.Fx, data.Fu = self.system.step_derivatives(x, u)
            data.Lx, data.Lu, data.Lxx, data.Lxu, data.Luu = self.system.cost_derivatives(x, u)


def by_crocoddyl(system, start, controls, solver=crocoddyl.SolverFDDP, most=200):
    n, m = len(start), controls.shape[1]
    running, final = Known(system, n, m), Known(system, n, m, final=True)
    found = solver(crocoddyl.ShootingProblem(np.asarray(start, float), [running] * len(controls), final))
    found.th_stop = 1e-16
    found.solve(list(rollout(system, start, controls)), list(controls), most, True, 0.0)
    return found


CASES = [
    (Pendulum(), np.zeros(2), np.full((60, 1), 0.1)),
    (Unicycle(), np.zeros(3), np.tile([0.1, 0.1], (40, 1))),
    (linear(), np.array([1.0, -1.0, 0.5, 2.0]), np.zeros((N, 2))),
]
NAMES = ["pendulum", "unicycle", "linear"]
# Crocoddyl never comes back from Honey: where Q_uu is not positive it raises its damping without end.
BENT = (Honey(), np.array([0.5]), np.full((40, 1), 2.0))


@pytest.mark.parametrize(("system", "start", "controls"), [*CASES, BENT], ids=[*NAMES, "honey"])
def test_derivatives_against_differences(system, start, controls):
    random = np.random.default_rng(1)
    n, m, h = len(start), controls.shape[1], 1e-6
    for _ in range(5):
        point = random.normal(size=n + m)

        def at(function, point, n=n):
            return np.asarray(function(point[:n], point[n:]))

        def slope(function, point, size=n + m):
            steps = h * np.eye(size)
            return np.array([(at(function, point + d) - at(function, point - d)) / (2 * h) for d in steps]).T

        s, u = point[:n], point[n:]
        assert np.hstack(system.step_derivatives(s, u)) == pytest.approx(
            slope(system.step, point), abs=1e-7, rel=1e-7
        )
        l_s, l_u, l_ss, l_su, l_uu = system.cost_derivatives(s, u)
        assert np.concatenate([l_s, l_u]) == pytest.approx(slope(system.cost, point), rel=1e-6, abs=1e-7)
        hessian = slope(lambda s, u: np.concatenate(system.cost_derivatives(s, u)[:2]), point)
        assert np.block([[l_ss, l_su], [l_su.T, l_uu]]) == pytest.approx(hessian, rel=1e-6, abs=1e-7)
        steps = h * np.eye(n)
        gradient, hessian = system.final_derivatives(s)
        assert gradient == pytest.approx(
            [(system.final_cost(s + d) - system.final_cost(s - d)) / (2 * h) for d in steps],
            rel=1e-6,
            abs=1e-6,
        )
        assert hessian == pytest.approx(
            np.array(
                [
                    (system.final_derivatives(s + d)[0] - system.final_derivatives(s - d)[0]) / (2 * h)
                    for d in steps
                ]
            ),
            rel=1e-6,
            abs=1e-6,
        )


def test_one_iteration_solves_a_linear_quadratic_problem():
    """Eqs 18 to 21 are exact there."""
    for seed in range(5):
        system, start = linear(seed), np.random.default_rng(seed).normal(size=4)
        first, second, third = itertools.islice(iterations(system, start, np.zeros((N, 2))), 3)
        assert second.step == 1.0 and second.cost < first.cost
        assert second.cost - first.cost == pytest.approx(second.expected), "the parabola is the truth"
        assert third.cost == pytest.approx(second.cost, rel=1e-10)
        assert third.slope < 1e-8 * (1 + abs(third.cost))


def test_its_gains_are_riccatis():
    """Eqs 18 to 21, for a linear system and a quadratic cost."""
    system = linear(3)
    P = system.P
    states, controls = np.zeros((N + 1, 4)), np.zeros((N, 2))
    K = backward(system, states, controls)[1]
    for k in reversed(range(N)):
        riccati = np.linalg.solve(
            system.R + system.G.T @ P @ system.G, system.N.T + system.G.T @ P @ system.F
        )
        assert K[k] == pytest.approx(-riccati)
        P = system.Q + system.F.T @ P @ system.F - (system.N + system.F.T @ P @ system.G) @ riccati
    far = backward(system, np.zeros((301, 4)), np.zeros((300, 2)))[1][0]
    P = solve_discrete_are(system.F, system.G, system.Q, system.R, s=system.N)
    forever = np.linalg.solve(system.R + system.G.T @ P @ system.G, system.N.T + system.G.T @ P @ system.F)
    assert far == pytest.approx(-forever, rel=1e-6), "far from the end: the algebraic Riccati equation"


@pytest.mark.parametrize(("system", "start", "controls"), CASES, ids=NAMES)
@pytest.mark.parametrize("solver", [crocoddyl.SolverFDDP, crocoddyl.SolverDDP])
def test_crocoddyl_finds_the_same(system, start, controls, solver):
    ours, theirs = solve(system, start, controls), by_crocoddyl(system, start, controls, solver)
    assert ours.converged
    assert ours.last.cost == pytest.approx(theirs.cost, rel=1e-7)
    assert ours.last.controls == pytest.approx(np.array(theirs.us.tolist()), abs=1e-4)
    K = backward(system, ours.last.states, ours.last.controls)[1]
    assert np.allclose(K, -np.reshape(theirs.K.tolist(), K.shape), atol=1e-3), "with the opposite sign"


def test_the_first_direction_is_crocoddyls():
    """Eqs 20 and 21, as another program has them."""
    system, start, controls = CASES[0]
    states = rollout(system, start, controls)
    k, K, *_ = backward(system, states, controls)
    running, final = Known(system, 2, 1), Known(system, 2, 1, final=True)
    theirs = crocoddyl.SolverDDP(crocoddyl.ShootingProblem(start, [running] * len(controls), final))
    theirs.setCandidate(list(states), list(controls), True)
    theirs.preg = theirs.dreg = 0.0
    theirs.computeDirection(True)
    assert k == pytest.approx(-np.array(theirs.k.tolist()))
    assert np.allclose(K, -np.reshape(theirs.K.tolist(), K.shape))


def test_another_optimiser_finds_nothing_better():
    """Eq. 16, by an optimiser that knows no value function."""
    system, start, controls = CASES[1]
    ours = solve(system, start, controls)

    def cost(flat):
        u = flat.reshape(controls.shape)
        return total_cost(system, rollout(system, start, u), u)

    better = minimize(cost, ours.last.controls.ravel() + 0.01, method="BFGS", options={"maxiter": 60})
    assert better.fun >= ours.last.cost - 1e-6


def test_the_cost_falls_and_the_trajectory_obeys_the_system():
    system, start, controls = CASES[0]
    found = solve(system, start, controls)
    costs = [iterate.cost for iterate in found.iterates]
    assert (np.diff(costs) <= 0.0).all() and found.converged
    assert found.last.states == pytest.approx(rollout(system, start, found.last.controls), abs=1e-12)
    assert found.last.states[-1] == pytest.approx(system.goal, abs=0.05), "swung up"


def test_a_warm_start_is_quicker():
    system, start, controls = CASES[1]
    known = solve(system, start, controls).last.controls
    shifted = start + np.array([0.02, -0.03, 0.05])
    *_, near = itertools.islice(iterations(system, shifted, known), 3)
    *_, far = itertools.islice(iterations(system, shifted, controls), 3)
    best = solve(system, shifted, known).last.cost
    assert near.cost < 1.001 * best < 1.01 * best < far.cost


def test_the_gradient_is_that_of_the_cost():
    """Without steps, a backward pass with huge damping is gradient descent: k goes along −dJ/du."""
    system, start, controls = CASES[1]
    states = rollout(system, start, controls)
    k = backward(system, states, controls, 1e9)[0]
    h, place = 1e-6, (7, 1)
    change = np.zeros_like(controls)
    change[place] = h
    slope = (
        total_cost(system, rollout(system, start, controls + change), controls + change)
        - total_cost(system, rollout(system, start, controls - change), controls - change)
    ) / (2 * h)
    assert k[place] == pytest.approx(-slope / 1e9, rel=1e-4)


def test_the_value_after_damped_gains_is_the_cost_that_these_gains_have():
    system = linear(4)
    random = np.random.default_rng(2)
    states, controls = rollout(system, random.normal(size=4), np.zeros((1, 2))), np.zeros((1, 2))
    Q = expansion(system, states[0], controls[0], *system.final_derivatives(states[1]))
    k, K = gains(Q, 3.0)
    V_s, V_ss = value(Q, k, K)

    def cost(change):
        u = controls[0] + k + K @ change
        s = states[0] + change
        return system.cost(s, u) + system.final_cost(system.step(s, u))

    change = random.normal(size=4)
    assert cost(change) - cost(0.0 * change) == pytest.approx(V_s @ change + 0.5 * change @ V_ss @ change)
    undamped = gains(Q)
    assert value(Q, *undamped)[0] == pytest.approx(Q.s - undamped[1].T @ Q.uu @ undamped[0])
    assert value(Q, *undamped)[1] == pytest.approx(Q.ss - undamped[1].T @ Q.uu @ undamped[1])


def test_without_a_lowest_point_there_are_no_gains_until_damped():
    Q = Expansion(np.zeros(1), np.ones(1), np.eye(1), np.zeros((1, 1)), -np.eye(1))
    with pytest.raises(np.linalg.LinAlgError):
        gains(Q)
    assert gains(Q, 2.0)[0] == pytest.approx([-1.0])


def test_a_concave_cost_is_damped_and_a_hopeless_one_given_up():
    system = linear(5)
    bent = LinearQuadratic(
        system.F, system.G, system.c, system.Q, system.R - 30.0 * np.eye(2), system.N, system.P
    )
    *_, damped = itertools.islice(iterations(bent, np.ones(4), np.zeros((3, 2))), 3)
    assert damped.damping > 0.0

    class Wall(Pendulum):
        """Whatever one does costs the same, but the derivatives promise otherwise."""

        def final_cost(self, s):
            return 0.0

        def cost(self, s, u):
            return 0.0

    found = solve(Wall(), np.zeros(2), np.zeros((5, 1)))
    assert not found.converged and found.last.step == 0.0 and found.last.cost == 0.0


def test_a_run_away_trajectory_is_refused():
    system, start, controls = CASES[0]
    states = rollout(system, start, controls)
    far = forward(system, states, controls, np.full_like(controls, 1e3), np.zeros((60, 1, 2)))
    assert total_cost(system, *far) > total_cost(system, states, controls)
    assert total_cost(system, *forward(system, states, controls, 0 * controls, np.zeros((60, 1, 2)))) == (
        pytest.approx(total_cost(system, states, controls))
    )


def test_the_value_function_near_a_trajectory_is_the_cost_of_the_best_from_there():
    system, start, _ = CASES[2]
    best = solve(system, start, np.zeros((N, 2))).last
    V, V_s, V_ss = parabolas(system, best.states, best.controls)
    assert V[0] == pytest.approx(best.cost) and V[-1] == pytest.approx(system.final_cost(best.states[-1]))
    random = np.random.default_rng(5)
    for step in (0, 11, N - 1):
        off = 0.3 * random.normal(size=4)
        from_there = solve(system, best.states[step] + off, np.zeros((N - step, 2))).last.cost
        assert from_there == pytest.approx(V[step] + V_s[step] @ off + 0.5 * off @ V_ss[step] @ off)


HONEY, GRID = Honey(), np.linspace(-4.6, 4.6, 161)


@pytest.fixture(scope="module")
def table():
    return tabulate(HONEY, GRID, np.linspace(-10.0, 10.0, 121), 40)


def test_a_table_of_one_step_is_the_best_of_all_controls():
    controls = np.linspace(-3.0, 3.0, 7)
    one = tabulate(HONEY, np.linspace(-1.0, 1.0, 4001), controls, 1)
    s = np.array([0.4])
    tried = [HONEY.cost(s, np.array([u])) + HONEY.final_cost(HONEY.step(s, np.array([u]))) for u in controls]
    assert one.at(0, 0.4) == pytest.approx(min(tried), abs=1e-5)
    assert one.best[0, np.abs(one.grid - 0.4).argmin()] == controls[np.argmin(tried)]
    with pytest.raises(ValueError, match="does not ascend"):
        tabulate(HONEY, np.array([0.0, 0.0, 1.0]), controls, 1)


def test_ddp_finds_what_the_table_has(table):
    for degrees in (30.0, 90.0, -120.0):
        start = np.radians([degrees])
        found = solve(HONEY, start, np.full((40, 1), np.sign(degrees) * 2.0))
        assert found.last.cost == pytest.approx(table.at(0, start[0]), rel=0.01, abs=0.03)
        assert found.last.states[:, 0] == pytest.approx(table.follow(HONEY, start[0]), abs=0.06)


def test_the_table_is_symmetric_with_a_ridge_that_ddp_does_not_see(table):
    np.testing.assert_allclose(table.value, table.value[:, ::-1], atol=1e-9)
    left, right = table.at(0, -0.05), table.at(0, 0.05)
    assert table.at(0, 0.0) > left == pytest.approx(right)
    still = solve(HONEY, np.zeros(1), np.zeros((40, 1)))
    assert still.converged and still.last.cost > 4.0 * table.at(0, 0.0), "stationary is not the least"
    wrong = solve(HONEY, np.radians([-30.0]), np.full((40, 1), 3.0))
    assert wrong.last.states[-1] == pytest.approx([np.pi], abs=0.05)
    assert wrong.last.cost > 1.2 * table.at(0, np.radians(-30.0))


def test_the_table_after_some_steps_is_that_of_a_shorter_horizon(table):
    short = tabulate(HONEY, GRID, np.linspace(-10.0, 10.0, 121), 10)
    np.testing.assert_allclose(short.value, table.value[-11:])
