"""Closed loop: the next window is planned while the robot executes this one."""

import multiprocessing
from dataclasses import replace

import handmade
import numpy as np
import pytest
from test_planner_ahead import SERIES, cut

from wfbook import receding, simulate, terrain
from wfbook.planner import InfeasibleError, Problem, ahead
from wfbook.planner.ahead import Answer, Planner
from wfbook.planner.stitch import stitched
from wfbook.runs import Run

FEET = {"window": 5, "commit": 2, "budget": 30}
BOTH = {"window": 6, "commit": 3, "budget": 20}


def problem(slots=8, end_effectors=("foot",), **changes):
    changes = {"goal": (0.15 * slots, 0.0)} | changes
    return Problem(terrain.flat(), slots=slots, end_effectors=end_effectors, **changes)


@pytest.fixture(scope="module")
def walked():
    return receding.run(problem(), **FEET, state="estimated", hold=0.3)


def windows(run):
    return run.metrics["replanning"]["windows"]


def smooth(run, plan, allowed):
    """Check that references move with their velocity, but for the corrections where windows meet."""
    going = (run.t[:-1] > 0.0) & (run.t[1:] < plan.t[-1])
    moved = np.diff(run.com_ref, axis=0) - 0.001 * (run.com_velocity_ref[1:] + run.com_velocity_ref[:-1])
    assert np.linalg.norm(moved[going], axis=1).max() < allowed + 1e-4
    assert np.abs(np.diff(run.com_velocity_ref, axis=0)[going]).max() < allowed + 0.03
    # Between windows a landing that was early may move the rest of its pair.
    meeting = np.abs(run.t[1:, None] - [0.3 * w["slots"][0] for w in windows(run)]).min(axis=1) < 0.02
    swinging = (going & meeting)[:, None] & ~run.stance[1:] & ~run.stance[:-1]
    steps = np.linalg.norm(np.diff(run.p_ref, axis=0), axis=2)
    same = run.end_effector[1:] == run.end_effector[:-1]
    assert steps[swinging & same].max() < allowed + 0.006


def test_windows_of_a_plan_are_executed_as_the_whole_is():
    plan = handmade.coast()
    whole = simulate.run(plan, hold=0.2)
    handed = []

    def go_on(t, tracker, robot):
        slot = 2 + 2 * len(handed)
        if slot > 4 or t + tracker.delay + 0.003 < 0.3 * slot:
            return None
        handed.append(slot)
        known = stitched(tracker.plan, slot, cut(plan, slot))
        return known, slot

    k = 4 * (plan.knots // plan.slots)
    series = {name: getattr(plan, name) for name in SERIES}
    begun = replace(
        plan,
        t=plan.t[: k + 1],
        S=plan.S[:, :4],
        D=plan.D[:, :4],
        **{name: array[: k + (len(array) > plan.knots)] for name, array in series.items()},
    )
    parts = simulate.run(begun, hold=0.2, continuation=go_on)
    assert handed == [2, 4]
    np.testing.assert_allclose(parts.t, whole.t)
    for name in ("qpos", "com_ref", "p_ref", "stance"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), atol=1e-6)


def test_the_robot_walks_window_by_window(walked):
    run, relaxed, plan = walked
    assert run.metrics["upright"] and run.metrics["status"] == "replanned"
    assert plan.slots == relaxed.slots == 8
    assert [w["slots"] for w in windows(run)] == [[0, 5], [2, 7], [4, 8], [6, 8]]
    assert plan.S[:, 2:4].any() and plan.S[:, 4:6].any()
    assert run.metrics["distance_m"] == pytest.approx(plan.distance, abs=0.03)
    assert windows(run)[-1]["goal"] == pytest.approx([1.2, 0.0])
    for window in windows(run)[1:]:
        assert window["available_s"] == pytest.approx(0.6, abs=0.02)
        assert window["share"] == pytest.approx(window["planning_s"] / window["available_s"])
    np.testing.assert_allclose(run.com_ref[run.t > plan.t[-1]][-1], plan.x[-1], atol=1e-9)


def test_references_pass_from_window_to_window_without_a_jump(walked):
    run, _, plan = walked
    smooth(run, plan, max(w["correction_m"] for w in windows(run)))
    for leg, slot in np.argwhere(np.diff(np.hstack([np.zeros((4, 1)), plan.S]), axis=1) == 1):
        lifted = run.t[np.flatnonzero(~run.stance[:, leg] & (run.t > 0.3 * slot - 0.05))[0]]
        # one delay before the slot, or a little later if the leg waits for a late one
        assert -0.0091 <= lifted - 0.3 * slot <= 0.05


def test_two_runs_of_a_seed_are_the_same_with_and_without_a_second_core(walked, monkeypatch, tmp_path):
    monkeypatch.setattr(ahead, "available", lambda: False)
    run, _, plan = receding.run(problem(), **FEET, state="estimated", hold=0.3)
    for name in Run.LOGGED:
        np.testing.assert_array_equal(getattr(run, name), getattr(walked[0], name))
    for name in SERIES:
        np.testing.assert_array_equal(getattr(plan, name), getattr(walked[2], name))
    for i, result in enumerate((run, walked[0])):
        result.save(tmp_path / f"{i}.npz")
    assert (tmp_path / "0.npz").read_bytes() == (tmp_path / "1.npz").read_bytes()
    assert Run.load(tmp_path / "0.npz").meta["replanning"]["late"] == 0


def test_a_pushed_robot_ends_nearer_to_the_goal_than_without_replanning():
    p = problem(11, ("foot", "wheel"), goal=(1.0, 0.0))
    push = (np.array([-25.0, 0.0, 0.0]), 0.7, 0.2)
    undisturbed, _, plan = receding.run(p, **BOTH, hold=0.0)
    closed, _, _ = receding.run(p, **BOTH, hold=0.0, push=push)
    opened = simulate.run(plan, hold=0.0, push=push)
    nominal, near, far = (np.linalg.norm(run.com[-1, :2] - p.goal) for run in (undisturbed, closed, opened))
    assert nominal < 0.1
    assert closed.metrics["upright"] and opened.metrics["upright"]
    assert max(w["correction_m"] for w in windows(closed)) > 0.05
    assert near < 0.5 * far


def test_a_late_plan_finds_the_robot_at_rest_and_it_goes_on():
    late = {1: 1.0, 2: 1.7}
    p = problem(10)
    run, _, plan = receding.run(p, **FEET, clock=lambda i, wall: late.get(i, 0.0), hold=0.2)
    told = run.metrics["replanning"]
    assert run.metrics["upright"]
    assert [w["status"] == "late" for w in windows(run)][:3] == [False, True, False]
    assert told["late"] == 1 and told["waited_slots"] == 3
    assert windows(run)[2]["slots"][0] == 8
    assert not plan.S[:, 4:8].any() and plan.S[:, 8:].any()
    waiting = (run.t > 1.6) & (run.t < 2.3)
    assert np.linalg.norm(run.com_velocity[waiting], axis=1).max() < 0.03
    assert run.meta["replanning"]["late"] == 1


def test_plans_that_take_too_long_by_the_clock_on_the_wall_are_late():
    run, _, plan = receding.run(problem(6), window=5, commit=1, budget=2000, gap=1e-6, clock="wall", hold=0.0)
    for window in windows(run)[1:]:
        late = window["status"] == "late"
        assert late == (window["planning_s"] > window["available_s"] - 1e-9)
    assert run.metrics["upright"]
    assert plan.slots >= 5


def test_without_a_plan_the_robot_carries_on_to_the_end_and_stands(monkeypatch):
    answer, count = Planner.answer, iter(range(100))

    def fails(self, timeout=None):
        found = answer(self, timeout)
        return found if next(count) == 0 else Answer("no plan", None, found.duration, found.cpu_time)

    monkeypatch.setattr(Planner, "answer", fails)
    run, _, plan = receding.run(problem(9), **FEET, hold=0.0)
    told = run.metrics["replanning"]
    assert run.metrics["upright"] and run.metrics["final_speed_m_s"] < 0.01
    assert told["without_plan"] == 4 and told["waited_slots"] == 2
    assert plan.slots == 7 and not plan.S[:, 5:].any()


def test_a_goal_may_move():
    def goal(t):
        return (0.6, 0.0) if t < 0.5 else (0.3, 0.2)

    run, _, _ = receding.run(problem(8), **FEET, goal=goal, hold=0.0)
    assert windows(run)[-1]["goal"] == [0.3, 0.2]
    assert run.com[-1, 1] > 0.05


def test_an_interrupt_leaves_no_process():
    before = set(multiprocessing.active_children())

    def interrupt(now, end):
        if now > 0.8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        receding.run(problem(), **FEET, progress=interrupt)
    assert set(multiprocessing.active_children()) <= before


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"window": 1}, "window"),
        ({"window": 4, "commit": 4}, "commit"),
        ({"gap": 0.0}, "gap"),
        ({"budget": 0}, "budget"),
        ({"budget": 1.5}, "budget"),
        ({"clock": "sun"}, "clock"),
    ],
)
def test_wrong_options_are_refused(options, name):
    with pytest.raises(ValueError, match=rf"^{name}: "):
        receding.run(problem(), **options)


def test_problems_that_windows_cannot_begin_are_refused():
    p = problem()
    with pytest.raises(ValueError, match="initial"):
        receding.run(replace(p, initial=p.start_state))
    with pytest.raises(ValueError, match="stance_between_swings"):
        receding.run(replace(p, stance_between_swings=False))
    far = np.array([[0.3, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    with pytest.raises(InfeasibleError):
        receding.run(problem(start_offsets=far))
