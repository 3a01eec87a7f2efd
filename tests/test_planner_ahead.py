"""Windows planned elsewhere: plans joined, hints, budgets, and processes that end."""

import multiprocessing
from dataclasses import replace

import handmade
import numpy as np
import plan_checker
import pytest

from wfbook import terrain
from wfbook.planner import NoPlanError, Problem, ahead, solve
from wfbook.planner.ahead import Planner, hints, plan_window
from wfbook.planner.extract import gait_of
from wfbook.planner.gait import Gait
from wfbook.planner.kernel import Kernel
from wfbook.planner.solve import Search
from wfbook.planner.stitch import standing, stitched
from wfbook.planner.windows import state_after, window_problem

SERIES = ("x", "v", "theta", "omega", "p", "a", "alpha", "lam", "f", "U_plus", "U_minus", "c")


def cut(plan, slot):
    """Return what is left of a plan from a slot on."""
    k = slot * (plan.knots // plan.slots)
    series = {name: getattr(plan, name)[k:] for name in SERIES}
    kinds = [("foot", "wheel")[e] for e in plan.end_effector[:, slot - 1]]
    part = replace(plan, t=plan.t[k:] - plan.t[k], S=plan.S[:, slot:], D=plan.D[:, slot:], **series)
    return part.with_meta(start_end_effectors=kinds)


def problem(slots=5, end_effectors=("foot",)):
    return Problem(terrain.flat(), goal=(0.1 * slots, 0.0), slots=slots, end_effectors=end_effectors)


def after(p, plan, slot, slots):
    """Return the problem of a window that begins in a slot of a plan."""
    kinds = [("foot", "wheel")[e] for e in plan.end_effector[:, slot - 1]]
    state = state_after(p, plan, slot)
    return window_problem(p, state, slots, last=True).begun(state, kinds)


@pytest.fixture(scope="module", params=[("foot",), ("foot", "wheel")], ids=["feet", "wheels"])
def begun(request):
    """A window, and what became of it."""
    p = problem(5, request.param)
    return p, plan_window(p, [], 0.02, 200)


def test_a_plan_joined_with_its_own_rest_is_itself():
    plan = handmade.coast()
    for slot in (1, 4):
        joined = stitched(plan, slot, cut(plan, slot))
        for name in ("t", "S", "D", *SERIES):
            np.testing.assert_allclose(getattr(joined, name), getattr(plan, name), atol=1e-12)
        np.testing.assert_array_equal(joined.end_effector, plan.end_effector)


def test_standing_carries_the_weight_and_turns_nothing(begun):
    p, answer = begun
    plan = answer.plans[1]
    still = replace(state_after(p, plan, 5), velocity=np.zeros(3), rates=np.zeros(3), angles=np.zeros(3))
    kinds = [("foot", "wheel")[e] for e in plan.end_effector[:, -1]]
    rest = standing(p.begun(still, kinds, slots=2, beyond_reach=True), gait_of(plan).region[:, -1])
    np.testing.assert_allclose(rest.lam.sum(axis=1)[:, 2], p.robot.weight)
    np.testing.assert_allclose(rest.contact_torque, 0.0, atol=1e-9)
    rest = rest.with_meta(objective=plan_checker.objective(rest), bound=0.0, gap=1.0)
    assert plan_checker.check(rest)[0] == []
    joined = stitched(plan, 5, rest)
    assert joined.slots == 7 and not joined.S[:, 5:].any()
    np.testing.assert_array_equal(joined.end_effector[:, -1], plan.end_effector[:, -1])


def test_hints_are_the_rest_of_a_gait_and_the_same_with_a_later_stop():
    S = np.zeros((4, 6), int)
    S[[0, 3], 0::2], S[[1, 2], 1::2] = 1, 1
    S[:, 5] = 0
    first, *others = hints(Gait(S, 0 * S, 0 * S), 2, 6)
    np.testing.assert_array_equal(first.S, np.hstack([S[:, 2:], np.zeros((4, 2))]))
    assert any(np.array_equal(gait.S, S) for gait in others)
    assert all(gait.S.shape == (4, 6) for gait in others)
    shorter = hints(Gait(S, 0 * S, 0 * S), 2, 4)
    assert len(shorter) == 1
    np.testing.assert_array_equal(shorter[0].S, S[:, 2:])
    (stand,) = hints(Gait(S, 0 * S, 0 * S), 9, 3)[:1]
    assert stand.S.shape == (4, 3) and not stand.S.any()


def test_the_rest_of_a_plan_is_a_plan(begun):
    p, answer = begun
    gaits = hints(gait_of(answer.plans[0]), 2, 5)
    kernel = Kernel(after(p, answer.plans[1], 2, 5))
    assert np.isfinite(kernel.price(gaits[:1])[0])


@pytest.mark.parametrize("budget", [1, 40])
def test_what_a_budget_leaves_open_is_not_proven(budget):
    p = problem(5)
    best = solve(p, gap=1e-2).meta
    search = Search(p, 1e-3, 1e6, budget=budget)
    try:
        found = search.run().meta
    except NoPlanError:
        assert budget == 1
        return
    finally:
        search.close()
    assert found["bound"] <= best["objective"] * (1 + 1e-9)
    assert found["objective"] >= best["bound"] * (1 - 1e-9)
    assert found["relaxations"] + found["leaves"] <= budget + 20
    assert found["status"] == "budget"


def test_answers_do_not_depend_on_the_process(begun, monkeypatch):
    p, answer = begun
    part, known = after(p, answer.plans[1], 2, 5), hints(gait_of(answer.plans[0]), 2, 5)
    found = []
    for cores in (True, False):
        monkeypatch.setattr(ahead, "available", lambda cores=cores: cores)
        planner = Planner()
        planner.ask(part, known, 0.02, 20)
        found.append(planner.answer())
        planner.close()
    assert found[0].status == found[1].status
    for name in (*SERIES, "S", "D"):
        for one, other in zip(found[0].plans, found[1].plans, strict=True):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert found[0].duration > 0 and found[0].cpu_time > 0


def test_a_start_out_of_reach_is_infeasible(begun):
    p, answer = begun
    state = state_after(p, answer.plans[1], 2)
    part = p.begun(replace(state, position=state.position + np.array([0.5, 0.0, 0.0])), ("foot",) * 4)
    assert plan_window(part, [], 0.02, 20)[:2] == ("infeasible", None)


def test_cancelled_and_closed_planners_leave_no_process():
    before = set(multiprocessing.active_children())
    planner = Planner()
    planner.ask(problem(8, ("foot", "wheel")), [], 1e-3, 10000)
    assert planner.answer(timeout=0.0) is None
    planner.cancel()
    planner.ask(problem(2), [], 0.5, 20)
    assert planner.answer().plans is not None
    planner.ask(problem(8), [], 1e-3, 10000)
    planner.close()
    assert set(multiprocessing.active_children()) <= before
