"""Chapter 11's widgets and drawings: what is drawn are iterates, parabolas, costs and torques."""

import itertools

import numpy as np
import pytest

from wfbook.omni.ddp import iterations, parabolas
from wfbook.omni.locked import nominal_state
from wfbook.omni.tasks import HAND_STEP, attempt, lifting, planned, reaching
from wfbook.view.drawings import whole_body_ddp as drawings
from wfbook.view.motion import motion_of_planned
from wfbook.view.replay import Replay, commands
from wfbook.view.spans import SWINGING
from wfbook.view.style import LIMIT, PALE, PLANNED
from wfbook.view.tracks import FPS
from wfbook.view.widgets.whole_body_ddp import Iterations, Parts


@pytest.fixture(scope="module")
def watched():
    return Iterations()


@pytest.fixture
def search(watched):
    """The widget as it opens."""
    for name, value in (("start", 30.0), ("guess", 0.0), ("horizon", 2.0), ("damping", 0.0), ("time", 0.5)):
        getattr(watched, name).value = value
    watched.shorter.value = True
    watched.iteration.value = 0
    return watched


@pytest.fixture
def parts():
    """The board with a shorter horizon."""
    board = Parts()
    board.nodes.value = 10
    return board


@pytest.fixture(scope="module")
def lifted():
    ocp = lifting(shift=0.3, swing=0.4, settle=0.2)
    attempt(ocp, nominal_state())
    return planned(ocp)


def line(picture, gid, axes=0):
    (found,) = [drawn for drawn in picture.axes[axes].lines if drawn.get_gid() == gid]
    return found


def test_iterates_are_the_librarys(search):
    start, guess = np.radians([30.0]), np.zeros((40, 1))
    expected = list(itertools.islice(iterations(search.system, start, guess), len(search.found)))
    assert [one.cost for one in search.found] == [one.cost for one in expected]
    search.iteration.value = 7
    shown = line(search.pictures["search"], "shown")
    assert shown.get_ydata() == pytest.approx(np.degrees(expected[7].states[:, 0]))
    assert shown.get_color() == PLANNED
    pale = [drawn for drawn in search.pictures["search"].axes[0].lines if drawn.get_color() == PALE]
    assert len(pale) == len(expected) - 1
    costs = line(search.pictures["search"], "cost", 2)
    assert costs.get_ydata() == pytest.approx([one.cost for one in expected])
    assert line(search.pictures["search"], "shown", 2).get_xdata() == 7
    assert f"cost {expected[7].cost:.3f}" in search.status.value


def test_the_parabola_touches_the_trajectory_and_at_the_end_the_value_function(search):
    search.iteration.value = search.iteration.max
    for time in (0.0, 0.5, 1.5):
        search.time.value = time
        now, step = search.found[-1], round(time / 0.05)
        V, V_s, V_ss = parabolas(search.system, now.states, now.controls)
        angle, height = line(search.pictures["search"], "parabola", 1).get_data()
        off = np.radians(angle) - now.states[step, 0]
        low, high = search.pictures["search"].axes[1].get_ylim()
        assert low < V[step] < high
        expected = V[step] + V_s[step, 0] * off + 0.5 * V_ss[step, 0, 0] * off**2
        assert height == pytest.approx(expected)
        true = line(search.pictures["search"], "value", 1)
        here = np.interp(np.degrees(now.states[step, 0]), true.get_xdata(), true.get_ydata())
        assert V[step] == pytest.approx(here, rel=0.02, abs=0.03)


def test_it_says_when_it_has_found_the_least_and_when_not(search):
    search.iteration.value = search.iteration.max
    assert search.status.value.endswith("Found.")
    search.start.value, search.guess.value = -30.0, 3.0
    search.iteration.value = search.iteration.max
    assert "a better way" in search.status.value
    search.start.value, search.guess.value = 0.0, 0.0
    assert len(search.found) == 2 and search.iteration.max == 1
    search.iteration.value = 1
    assert "a better way" in search.status.value and "step 1, damping 0.1" in search.status.value


def test_horizon_and_damping_change_the_search(search):
    search.guess.value = 2.0
    plain = [one.cost for one in search.found]
    search.damping.value = 10.0
    assert search.found[1].damping == 10.0 and search.found[1].cost > plain[1]
    search.horizon.value = 1.0
    assert search.nodes == 20 and len(search.found[0].controls) == 20 and search.time.max == 1.0
    search.iteration.value = search.iteration.max
    best = line(search.pictures["search"], "best", 2).get_ydata()[0]
    assert search.found[-1].cost == pytest.approx(best, rel=0.02)
    search.shorter.value = False
    assert {one.step for one in search.found} <= {0.0, 1.0}


def test_costs_and_torques_are_those_of_the_solutions(parts):
    ocp = reaching(HAND_STEP, nodes=10)
    attempt(ocp, nominal_state(), parts.MOST)
    x = ocp.state.integrate(ocp.xs[1], parts.DISTURBANCE * np.random.default_rng(0).standard_normal(40))
    ocp.hold(x)
    cold = attempt(ocp, x, parts.MOST)
    assert parts.found["cold"].costs == pytest.approx(cold.costs, rel=1e-6)
    drawn = line(parts.pictures["pictures"], "cold")
    assert drawn.get_ydata() == pytest.approx(cold.costs, rel=1e-6)
    bars = [bar.get_height() for bar in parts.pictures["pictures"].axes[1].patches]
    assert bars == pytest.approx(planned(ocp).load.max(axis=0), rel=1e-4, abs=1e-6)
    assert f"{cold.iterations}" in parts.results.value and "warm" in parts.results.value
    assert parts.found["warm"].iterations < parts.found["cold"].iterations
    assert "times what it has" in parts.status.value
    red = [bar for bar in parts.pictures["pictures"].axes[1].patches if bar.get_height() > 1.0]
    assert red and all(bar.get_facecolor()[:3] == pytest.approx(_rgb(LIMIT)) for bar in red)


def _rgb(colour):
    return [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]


def test_terms_that_are_missing_are_missed(parts):
    parts.terms["hand"].value = False
    assert "The hand ends 22 cm" in parts.status.value
    parts.terms["hand"].value, parts.terms["contact"].value = True, False
    assert "The ground would have to pull" in parts.status.value
    parts.terms["contact"].value = True
    assert "pull" not in parts.status.value


def test_contacts_are_taken_away_and_added(parts):
    parts.reach.value = 0.0
    assert parts.status.value == "Nothing breaks."
    parts.wheels["FL"].value = False
    assert not parts.plan.stance[:, 0].any() and np.all(parts.plan.contact_force[:, 0] == 0.0)
    parts.glued.value = True
    assert "four wheels that stand" in parts.status.value and not parts.pictures
    parts.wheels["FL"].value, parts.reach.value = True, 1.0
    assert "Moments about axles" in parts.status.value
    parts.glued.value, parts.hand.value = False, True
    assert "The hand pushes the wall" in parts.status.value
    assert np.linalg.norm(parts.plan.hand[-1] - parts.plan.hand[0]) < 0.03
    parts.hand.value, parts.rows.value = False, True
    assert "no solution" in parts.status.value or "Not converged" in parts.status.value
    parts.rows.value = False
    for box in parts.wheels.values():
        box.value = False
    assert "No wheel stands" in parts.status.value


def test_solver_start_and_friction(parts):
    parts.solver.value = "BoxFDDP"
    assert parts.plan.load.max() <= 1.0 + 1e-6 and "times what it has" not in parts.status.value
    parts.solver.value, parts.start.value = "FDDP", "no torque"
    assert parts.found["cold"].gaps[0] > 0.1 > parts.found["cold"].gaps[-1]
    parts.start.value, parts.mu.value = "standing", 0.2
    slippery = np.abs(parts.plan.contact_force[:-1, :, :2]).max()
    parts.mu.value = 1.0
    assert np.abs(parts.plan.contact_force[:-1, :, :2]).max() > slippery


def test_a_planned_motion_is_replayed(lifted):
    motion = motion_of_planned(lifted)
    assert len(motion.qpos) == int(lifted.t[-1] * FPS + 1e-6) + 1
    assert np.linalg.norm(motion.qpos[:, 3:7], axis=1) == pytest.approx(np.ones(len(motion.qpos)))
    frame = round(0.4 * FPS)  # a node, too
    assert motion.qpos[frame] == pytest.approx(lifted.qpos[20], abs=1e-6)
    assert motion.hand[frame] == pytest.approx(lifted.hand[20])
    assert (motion.modes[frame] == [SWINGING, 1, 1, 1]).all() and (motion.modes[0] == 1).all()
    assert np.all(motion.force[frame, 0] == 0.0) and motion.measured_com is None
    names = {command.get("path", "") for command in commands(motion)}
    assert any("hand" in name for name in names) and any("com/planned" in name for name in names)
    assert "CoM planned" in Replay(lifted)._repr_html_()


def test_the_drawing_of_a_motion(lifted):
    picture = drawings.motion(lifted)
    assert line(picture, "hand left").get_ydata() == pytest.approx(
        100 * (lifted.hand[:, 1] - lifted.hand[0, 1])
    )
    assert line(picture, "load FL hip", 1).get_ydata() == pytest.approx(lifted.load[:, 0])
    assert line(picture, "load arm 6", 1).get_ydata() == pytest.approx(lifted.load[:, 13])
    assert line(picture, "force FL", 2).get_ydata() == pytest.approx(lifted.contact_force[:-1, 0, 2])


def test_drawings_of_values_searches_rides_and_moments(search):
    table, dt = search.table, search.system.dt
    picture = drawings.value_map(table, dt, {"there": table.follow(search.system, 0.5)})
    assert line(picture, "there").get_ydata()[0] == pytest.approx(np.degrees(0.5))
    last = len(table.value) - 1
    assert line(picture, f"value {last}", 1).get_ydata() == pytest.approx(table.value[-1])
    ocp = reaching(nodes=10)
    found = attempt(ocp, nominal_state(), 5)
    picture = drawings.attempts({"it": found})
    assert line(picture, "it").get_ydata() == pytest.approx(found.costs)
    assert (line(picture, "it", 1).get_ydata() >= 1e-6).all()
    assert line(drawings.costs({"a": np.ones(4), "b": np.ones(3)}), "b").get_xdata()[-1] == 2
    assert line(drawings.rides({"far": np.array([1.0, 0.5])}), "far").get_ydata() == pytest.approx([1e3, 5e2])
    assert line(drawings.gifts({"FL": np.arange(3.0)}, 0.1), "FL").get_xdata()[-1] == pytest.approx(0.2)
