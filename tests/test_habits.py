"""What a tracker does besides its plan, left out piece by piece; what a polish keeps, likewise."""

from dataclasses import replace

import handmade
import numpy as np
import pytest

from wfbook import simulate
from wfbook.go1 import knees, nominal
from wfbook.lean import CALF_HALF_THICKNESS, Lean, knee_room
from wfbook.planner import polish, stored
from wfbook.planner.demands import friction_needed, grip_used, load_carried
from wfbook.planner.margins import GRIP, LOAD
from wfbook.stance import stand
from wfbook.terrain import flat
from wfbook.tracking import Habits, Tracker
from wfbook.view.motion import motion_of_plan

NONE = np.zeros((4, 3))


@pytest.fixture(scope="module")
def trot():
    return handmade.trot(0.3, 3)


def followed(plan, habits, times, touching=(True,) * 4):
    """The references that a tracker gives to a robot that stands still."""
    tracker, robot = Tracker(plan, 0.009, habits), stand().robot
    for t in times:
        yield t, tracker, tracker.update(float(t), robot, np.array(touching), NONE)[0]


def test_without_interpolation_the_reference_waits_for_the_next_knot(trot):
    knot = trot.dt * np.floor(0.25 / trot.dt)
    ((_, _, smooth),) = followed(trot, Habits(), [0.25])
    ((_, _, stairs),) = followed(trot, Habits(interpolates=False), [0.25])
    ((_, _, before),) = followed(trot, Habits(), [knot])
    np.testing.assert_allclose(stairs.com, before.com, atol=1e-12)
    assert np.abs(smooth.com - stairs.com).max() > 1e-4


def lift(plan, habits):
    """When a tracker first lifts a leg, and how early by its clock."""
    first = plan.S.any(axis=0).argmax() * plan.slot_duration
    for t, tracker, _ in followed(plan, habits, np.arange(first - 0.02, first + 0.02, 0.001)):
        if not tracker.stance.all():
            return first - t
    raise AssertionError("never lifted")


def test_who_foresees_lifts_one_delay_early(trot):
    assert lift(trot, Habits()) == pytest.approx(0.009, abs=0.0015)
    assert lift(trot, Habits(foresees=False)) == pytest.approx(0.0, abs=0.0015)


def stands_again(plan, habits, touching):
    """When the first leg that swings is commanded to stand, over its slot."""
    slot = int(plan.S.any(axis=0).argmax())
    leg, begin = int(plan.S[:, slot].argmax()), slot * plan.slot_duration
    for t, tracker, _ in followed(plan, habits, np.arange(begin, begin + 0.4, 0.002), touching):
        if t > begin + 0.02 and tracker.stance[leg]:
            return (t - begin) / plan.slot_duration
    return np.inf


def test_a_leg_that_feels_stands_when_it_touches_and_a_blind_one_by_the_clock(trot):
    on, off = (True,) * 4, (False,) * 4
    assert stands_again(trot, Habits(), on) < 0.6
    assert stands_again(trot, Habits(), off) == np.inf
    for touching in (on, off):
        assert stands_again(trot, Habits(feels=False), touching) == pytest.approx(1.0, abs=0.05)


def test_landing_early_or_not(trot):
    early, late = (Tracker(trot, 0.0, Habits(lands_early=value)).flights for value in (True, False))
    for legs in zip(early, late, strict=True):
        for one, other in zip(*legs, strict=True):
            assert one.duration == pytest.approx(0.88 * (one.end - one.start))
            assert other.duration == pytest.approx(one.end - one.start)


def test_stepping_aside_moves_footholds_and_only_then():
    """A walk on diagonals tips when no foot steps aside; that is why there is this habit."""
    plan = stored("flat-feet")
    fallen = simulate.run(plan, hold=0.0, habits=Habits(steps_aside=False))
    assert fallen.metrics["fell"] and fallen.metrics["fall_time_s"] > 0.5
    assert np.abs(fallen.com - fallen.com_ref).max() > 0.05


def test_a_habit_that_leaves_nothing_out_changes_nothing(trot):
    runs = [simulate.run(trot, hold=0.0, habits=habits) for habits in (None, Habits())]
    np.testing.assert_array_equal(runs[0].qpos, runs[1].qpos)


def test_what_the_trunk_leans_by():
    plan = stored("ramp-down")
    hips, contacts, level = (Lean(plan, by).at(2.9)[0] for by in ("hips", "contacts", "nothing"))
    np.testing.assert_array_equal(level, 0.0)
    slope = np.arctan(np.tan(np.radians(12.0)))
    # All four contacts are on the ramp: their plane is the ramp. But they stand closer than the hips.
    assert contacts[1] == pytest.approx(slope, abs=0.005)
    assert 0.5 * slope < hips[1] < contacts[1]
    with pytest.raises(ValueError, match="leans: 'stars' is none of hips, contacts, nothing"):
        Lean(plan, "stars")


def test_where_the_knees_are():
    standing = stand()
    places = knees(standing.qpos[None])[0]
    assert np.linalg.norm(places - standing.robot.centres, axis=1) == pytest.approx([0.213] * 4)
    assert (places[:, 0] < nominal()["hip_offsets"][:, 0]).all()  # they point back
    room = knee_room(standing.qpos[None], flat())[0]
    np.testing.assert_allclose(room, places[:, 2] - CALF_HALF_THICKNESS, atol=1e-9)


def test_a_level_trunk_sits_down_on_the_ramp():
    plan = stored("ramp-down")
    rooms = {}
    for by in ("hips", "nothing"):
        motion = motion_of_plan(plan, by)
        rooms[by] = np.where(motion.modes == 2, np.inf, knee_room(motion.qpos, motion.terrain)).min()
    assert rooms["nothing"] < 0.0 < rooms["hips"]


@pytest.fixture(scope="module")
def carefree():
    return polish(stored("ramp-down", relaxed=True), without=("grip", "load"))


def test_what_a_polish_keeps_and_what_it_leaves(carefree):
    kept = stored("ramp-down")
    at_rest = slice(-6, None)
    feet = kept.end_effector[:, -1] == 0
    assert np.nanmax(grip_used(kept)[at_rest][:, feet]) < GRIP + 0.01
    assert np.nanmax(grip_used(carefree)[at_rest][:, feet]) > 0.95
    assert np.nanmin(load_carried(kept)) > 0.9 * LOAD
    assert np.nanmin(load_carried(carefree)) < 0.1 * LOAD
    assert carefree.distance > kept.distance + 0.05
    with pytest.raises(ValueError, match="without: 'hope' is none of edges, grip, load, knees"):
        polish(stored("flat", relaxed=True), without=("hope",))


def test_grip_agrees_with_the_friction_that_is_needed():
    plan = stored("flat-feet")
    needed = np.nanmax(grip_used(plan)) * plan.terrain.regions[0].mu_foot
    assert needed == pytest.approx(friction_needed(plan))


def test_loads_carry_the_weight_and_legs_in_the_air_none():
    plan = stored("flat-feet")
    load = load_carried(plan)
    np.testing.assert_allclose(np.isnan(load), np.repeat(plan.S == 1, 3, axis=1).T)
    total = np.nansum(load, axis=1)
    np.testing.assert_allclose(total, 1.0 + plan.a[:, 2] / 9.81, atol=1e-6)
    steeper = replace(plan, lam=2.0 * plan.lam)
    np.testing.assert_allclose(np.nanmax(grip_used(steeper)), np.nanmax(grip_used(plan)))
