"""What formulations know before the search, and the smallest program with a binary."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog

from wfbook.planner import Problem, root, solve
from wfbook.planner.one_step import OneStep, corners, least_m_interval, shares_interval
from wfbook.terrain import flat


@pytest.fixture(scope="module")
def problem():
    return Problem(flat(), goal=(0.3, 0.0), slots=3, end_effectors=("foot", "wheel"))


def test_both_roots_bound_the_plan_and_the_tight_one_from_nearer(problem):
    paper, tight, plan = root(problem, "paper"), root(problem, "tight"), solve(problem)
    assert 0 < paper.bound < tight.bound < plan.meta["objective"]
    for found in (paper, tight):
        assert found.S.shape == (4, 3) and found.p.shape == (10, 4, 3) and found.force.shape == (9, 4)
        assert (found.S > -1e-6).all() and (found.wheel < 1 + 1e-6).all()
        assert (found.S > 0.01).any() and (found.S < 0.99).all(), "nothing is decided"


def test_feet_have_no_wheel_and_other_names_are_refused(problem):
    feet = root(Problem(flat(), goal=(0.2, 0.0), slots=2, end_effectors=("foot",)), "tight")
    assert not feet.wheel.any()
    with pytest.raises(ValueError, match="'loose'"):
        root(problem, "loose")


@pytest.mark.parametrize("big", [0.3, 0.7, 2.0])
def test_big_m_cuts_no_decision_off_and_allows_more_the_larger_it_is(big):
    step = OneStep()
    allowed = corners(*step.big_m(big))
    hull = corners(*step.tight())
    for point in hull:
        assert inside(point, allowed), "the hull is the smallest"
    assert step.bound(*step.big_m(big))[0] <= step.bound(*step.tight())[0] + 1e-7
    if big > step.limit:
        assert area(allowed) > area(hull) + 1e-3


def test_at_the_least_m_big_m_is_the_hull_and_below_it_cuts_steps_off():
    step = OneStep()
    assert np.allclose(corners(*step.big_m(step.limit)), corners(*step.tight()), atol=1e-9)
    assert not inside(np.array([1.0, step.limit]), corners(*step.big_m(0.2)))
    assert step.bound(*step.big_m(0.1))[0] > step.optimum


@pytest.mark.parametrize("goal, price", list(product((0.0, 0.1, 0.25, 0.5), (0.0, 0.2, 0.6))))
def test_the_perspective_leaves_no_gap_and_the_hull_no_lie(goal, price):
    step = OneStep(goal=goal, price=price)
    best = min(step.cost(0.0, 0.0), *(step.cost(1.0, s) for s in np.linspace(-0.3, 0.3, 601)))
    assert step.optimum == pytest.approx(best, abs=1e-9)
    assert step.perspective_bound() == pytest.approx(best, abs=1e-5)
    assert step.bound(*step.tight())[0] <= best + 1e-7


def test_the_hull_of_stones_is_what_mixtures_reach_and_big_m_allows_more():
    rng = np.random.default_rng(0)
    for _ in range(30):
        low = np.sort(rng.uniform(-1, 1, 3))
        high = low + rng.uniform(0.05, 0.4, 3)
        D = rng.dirichlet(np.ones(3))
        hull, big = shares_interval(low, high, D), least_m_interval(low, high, D)
        assert big[0] <= hull[0] + 1e-12 and big[1] >= hull[1] - 1e-12
        for sign, end in ((1, hull[0]), (-1, hull[1])):
            # Shares p_r with D_r low_r ≤ p_r ≤ D_r high_r.
            found = linprog(sign * np.ones(3), bounds=list(zip(D * low, D * high, strict=True)))
            assert sign * found.fun == pytest.approx(end)
        for r in range(3):
            assert least_m_interval(low, high, np.eye(3)[r]) == pytest.approx((low[r], high[r]))


def inside(point: np.ndarray, polygon: np.ndarray) -> bool:
    edges = np.roll(polygon, -1, axis=0) - polygon
    to = point - polygon
    return bool((edges[:, 0] * to[:, 1] - edges[:, 1] * to[:, 0] > -1e-9).all())


def area(polygon: np.ndarray) -> float:
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
