"""Long horizons in windows: no seams, what is proven, and what is kept when things go wrong."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import plan_checker
import pytest

from wfbook import terrain
from wfbook.modes import END_EFFECTORS
from wfbook.planner import (
    InfeasibleError,
    NoPlanError,
    Problem,
    polish,
    repaired,
    solve,
    solve_windows,
    windows,
)
from wfbook.planner.gait import Gait
from wfbook.planner.solve import Search
from wfbook.planner.windows import intermediate_goal

BOTH = ("foot", "wheel")


def problem(slots: int, end_effectors=("foot",), **changes) -> Problem:
    """Return a flat problem with a goal that takes every slot."""
    changes = {"goal": (0.1 * slots, 0.0)} | changes
    return Problem(terrain.flat(), slots=slots, end_effectors=end_effectors, **changes)


@pytest.fixture
def searched(monkeypatch):
    """What is searched and found: pairs of a problem and its plans, in order."""
    calls = []
    first_executable = windows.first_executable

    def spy(search, polisher):
        plans = first_executable(search, polisher)
        calls.append((search.problem, search.gaits, plans))
        return plans

    monkeypatch.setattr(windows, "first_executable", spy)
    return calls


@pytest.mark.parametrize("end_effectors", [("foot",), BOTH], ids=["feet", "wheels"])
def test_windows_begin_where_the_one_before_was_and_the_whole_has_no_seam(end_effectors, searched):
    p = problem(7, end_effectors)
    relaxed, polished = solve_windows(p, window=4, commit=2, gap=0.3)
    assert plan_checker.check(relaxed)[0] == []
    assert plan_checker.check(polished)[0] == []
    assert relaxed.slots == polished.slots == 7
    *parts, (whole, gaits, _) = searched
    assert whole is p
    assert [w["slots"] for w in relaxed.meta["windows"]] == [[0, 4], [2, 6], [4, 7]]
    for (_, _, (_, before)), (part, known, _) in pairwise(parts):
        state, k = part.initial, 2 * p.knots_per_slot
        for name, array in {"position": "x", "velocity": "v", "angles": "theta", "rates": "omega"}.items():
            assert np.abs(getattr(state, name) - getattr(before, array)[k]).max() < 1e-6
        assert np.abs(state.contacts - before.p[k]).max() < 1e-6
        np.testing.assert_array_equal(state.swung, before.S[:, 1] == 1)
        kinds = [END_EFFECTORS[e] for e in before.end_effector[:, 1]]
        assert list(part.start_end_effectors) == kinds
        # The rest of the old gait, then standing, is the first that is tried.
        overlap = min(2, part.slots)
        np.testing.assert_array_equal(known[0][0][:, :overlap], before.S[:, 2:4])
        assert not known[0][0][:, overlap:].any()
    S = np.hstack([plans[0].S[:, :2] for _, _, plans in parts[:-1]] + [parts[-1][2][0].S])
    np.testing.assert_array_equal(gaits[0][0], S)
    assert parts[-1][0].goal == p.goal


def test_what_is_proven_holds_for_the_whole(searched):
    p = problem(6)
    best = solve(p, gap=1e-4)
    plan, _ = solve_windows(p, window=5, commit=3, gap=0.02)
    assert plan.meta["bound"] <= best.meta["objective"] + 1e-6
    assert plan.meta["bound"] - 1e-9 <= plan.meta["objective"] <= best.meta["objective"] * 1.021
    # Before the whole is searched, the windows' own gait is good already.
    _, gaits, _ = searched[-1]
    search = Search(p, 1e-4, 1e-3, None, gaits)
    own = search.run()
    search.close()
    np.testing.assert_array_equal(own.S, gaits[0][0])
    assert best.meta["bound"] - 1e-9 <= own.meta["objective"] <= 1.05 * best.meta["objective"]


def test_a_given_gait_is_a_plan_whatever_the_time_limit():
    p = problem(8)
    S = np.zeros((4, 8), int)
    S[[0, 3], 1], S[[1, 2], 2] = 1, 1
    search = Search(p, 1e-3, 1e-3, None, [Gait(S, 0 * S, 0 * S)])
    plan = search.run()
    search.close()
    np.testing.assert_array_equal(plan.S, S)
    assert plan.meta["status"] == "time limit"
    assert 0 < plan.meta["root_bound"] <= plan.meta["bound"] <= plan.meta["objective"]


def test_short_problems_are_searched_whole():
    relaxed, polished = solve_windows(problem(3), window=4, commit=2)
    for plan in (relaxed, polished):
        assert (plan.meta["how"], plan.meta["windows"]) == ("whole", [])
        assert plan.meta["status"] == "optimal"


def test_a_problem_in_motion_is_planned_in_windows(searched):
    p = problem(5)
    swung = np.array([True, False, False, True])
    state = replace(p.start_state, velocity=np.array([0.2, 0.0, 0.0]), swung=swung, slot=2)
    relaxed, polished = solve_windows(p.begun(state, ("foot",) * 4), window=4, commit=3, gap=0.3)
    begun = searched[0][0].initial
    assert all(np.array_equal(getattr(begun, name), value) for name, value in vars(state).items())
    assert searched[1][0].initial.slot == 5
    assert not relaxed.S[swung, 0].any()
    assert plan_checker.check(relaxed)[0] == []
    assert plan_checker.check(polished)[0] == []


def test_an_interrupt_keeps_what_is_planned_so_far():
    def interrupt(now):
        if now.part.startswith("slots 3"):
            raise KeyboardInterrupt

    relaxed, polished = solve_windows(problem(12), window=4, commit=2, progress=interrupt)
    assert [w["slots"] for w in relaxed.meta["windows"]] == [[0, 4], [2, 6]]
    assert relaxed.meta["windows"][-1]["status"] == "interrupted"
    assert relaxed.meta["status"] == "interrupted"
    assert 0 < relaxed.meta["bound"] < relaxed.meta["objective"]
    assert relaxed.S[:, :5].any()
    assert plan_checker.check(relaxed)[0] == []
    assert plan_checker.check(polished)[0] == []


def test_an_interrupt_before_the_first_plan_is_raised():
    def interrupt(now):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_windows(problem(6), window=4, commit=2, progress=interrupt)


@pytest.mark.parametrize("failing", [0, 1])
def test_a_window_without_a_plan_leaves_the_whole_to_be_searched(failing, monkeypatch):
    count = iter(range(10))
    first_executable = windows.first_executable

    def fails_once(search, polisher):
        if next(count) == failing:
            raise NoPlanError("no luck")
        return first_executable(search, polisher)

    monkeypatch.setattr(windows, "first_executable", fails_once)
    relaxed, _ = solve_windows(problem(6), window=4, commit=2, gap=0.05)
    assert len(relaxed.meta["windows"]) == failing + 1
    assert relaxed.meta["windows"][-1]["status"] == "no plan"
    assert relaxed.meta["status"] == "optimal"


def test_an_infeasible_problem_names_its_groups():
    far = np.array([[0.3, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    with pytest.raises(InfeasibleError) as caught:
        solve_windows(problem(3, start_offsets=far), window=2, commit=1)
    assert caught.value.groups == ("start", "reach")


@pytest.mark.parametrize("direction", [(1.0, 0.0), (-1.0, 0.0), (0.6, 0.8), (0.0, -1.0)])
def test_intermediate_goals_lie_ahead_within_the_speed_limit(direction):
    ahead = np.array(direction)
    p = problem(30, goal=tuple(1.9 * ahead))
    rest = p.start_state
    goal = np.array(intermediate_goal(p, rest, 8))
    assert goal @ ahead > 0
    np.testing.assert_allclose(goal, (goal @ ahead) * ahead, atol=1e-9)
    assert np.linalg.norm(goal) <= 8 * p.slot_duration * max(*p.limits.speed, p.limits.lateral_speed) + 1e-9
    fast = replace(rest, velocity=np.append(0.7 * ahead, 0.0))
    assert np.linalg.norm(intermediate_goal(p, fast, 4)) >= np.linalg.norm(intermediate_goal(p, rest, 4))
    near = replace(p, goal=tuple(0.01 * ahead))
    assert intermediate_goal(near, rest, 8) == near.goal
    assert intermediate_goal(replace(p, goal=(0.0, 0.0)), rest, 8) == (0.0, 0.0)


def test_plans_to_goals_out_of_reach_can_be_polished():
    plan = solve(problem(4, BOTH, goal=(1.2, 0.0), beyond_reach=True), gap=0.3)
    assert repaired(polish(plan))


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"window": 1}, "window"),
        ({"window": 2.5}, "window"),
        ({"commit": 0}, "commit"),
        ({"window": 4, "commit": 4}, "commit"),
        ({"gap": 0.0}, "gap"),
        ({"time_limit": np.nan}, "time_limit"),
    ],
)
def test_wrong_options_are_refused(options, name):
    with pytest.raises(ValueError, match=rf"^{name}: "):
        solve_windows(problem(6), **options)
