"""The mode state machine of Fig. 5: which transitions there are, and under which conditions."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from wfbook.omni.machine import ON_LEGS, Mode, Observed, State, Thresholds, advance

LIMITS = Thresholds()
DT = 0.002
AT_REST = Observed()
UNREST = {
    "base_speed": 2.0 * LIMITS.base_speed,
    "wheel_speed": 2.0 * LIMITS.wheel_speed,
    "steering_error": 2.0 * LIMITS.steering_error,
    "trunk_speed": 2.0 * LIMITS.trunk_speed,
    "standing": False,
}


def run(state: State, wants: bool, seen: Observed, seconds: float) -> State:
    for _ in range(round(seconds / DT)):
        state = advance(state, wants, seen, DT)
    return state


def random_observed(rng: np.random.Generator) -> Observed:
    kept = {name: value for name, value in UNREST.items() if rng.random() < 0.2}
    return replace(AT_REST, **kept)


def test_it_gets_to_either_mode_and_back():
    there = run(State(), True, AT_REST, 1.0)
    assert there.mode == Mode.LEGGED
    assert run(there, False, AT_REST, 1.0).mode == Mode.WHEELED


@pytest.mark.parametrize("name", UNREST)
def test_wheels_are_not_locked_before_all_conditions_hold(name):
    unrest = replace(AT_REST, **{name: UNREST[name]})
    assert run(State(), True, unrest, 5.0).mode not in ON_LEGS


@pytest.mark.parametrize("name", [name for name in UNREST if name != "steering_error"])
def test_wheels_are_not_released_before_the_robot_rests_on_all_of_them(name):
    unrest = replace(AT_REST, **{name: UNREST[name]})
    for mode in (Mode.LEGGED, Mode.RELEASING):
        assert run(State(mode), False, unrest, 5.0).mode == mode


def test_conditions_must_last():
    state, entered = State(), []
    for k in itertools.count():
        # Every tenth look says that a wheel turns.
        seen = AT_REST if k % 10 else replace(AT_REST, wheel_speed=UNREST["wheel_speed"])
        state = advance(state, True, seen, DT)
        entered.append(state.mode)
        if k * DT > 3.0:
            break
    assert set(entered) == {Mode.STOPPING}


def test_no_order_of_events_skips_a_mode():
    rng = np.random.default_rng(0)
    allowed = {
        Mode.WHEELED: {Mode.STOPPING},
        Mode.STOPPING: {Mode.ALIGNING, Mode.WHEELED},
        Mode.ALIGNING: {Mode.LOCKING, Mode.WHEELED},
        Mode.LOCKING: {Mode.LEGGED, Mode.WHEELED},
        Mode.LEGGED: {Mode.RELEASING},
        Mode.RELEASING: {Mode.WHEELED, Mode.LOCKING},
    }
    state, seen, wants, visited = State(), AT_REST, False, set()
    for k in range(20000):
        if k % 25 == 0:
            seen = AT_REST if rng.random() < 0.8 else random_observed(rng)
        if rng.random() < 0.005:
            wants = not wants
        before = state.mode
        state = advance(state, wants, seen, 0.01)
        visited.add(state.mode)
        assert state.mode == before or state.mode in allowed[before]
        if before in (Mode.ALIGNING, Mode.LOCKING) and state.mode in ON_LEGS - {before}:
            assert seen == AT_REST
    assert visited == set(allowed)


@pytest.mark.parametrize("mode", Mode)
def test_a_fault_halts_from_everywhere_for_good(mode):
    halted = advance(State(mode), True, Observed(fault=True), DT)
    assert halted.mode == Mode.HALTED
    assert run(halted, True, AT_REST, 1.0).mode == run(halted, False, AT_REST, 1.0).mode == Mode.HALTED


def test_a_task_that_changes_its_mind_is_heard_at_once():
    for mode in (Mode.STOPPING, Mode.ALIGNING, Mode.LOCKING):
        assert advance(State(mode), False, random_observed(np.random.default_rng(1)), DT).mode == Mode.WHEELED
