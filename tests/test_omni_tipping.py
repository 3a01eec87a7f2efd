"""Chapter 10: a robot that is pushed in MuJoCo, against its cones and its areas of support."""

import numpy as np
import pytest

from wfbook.centroidal import GRAVITY
from wfbook.omni.support import inside, support_area
from wfbook.omni.tipping import WIDTH, strongest_push, tip
from wfbook.omni.wrench import line_contact
from wfbook.view.motion import motion_of_tipping
from wfbook.view.replay import html


@pytest.fixture(scope="module")
def pushed():
    return tip(heading=np.pi / 2)


@pytest.fixture(scope="module")
def across():
    return tip(heading=np.pi / 2, steer=np.pi / 2)


def start(tipping):
    return int(np.searchsorted(tipping.t, 0.0))


def test_the_log_obeys_newton_and_euler(pushed):
    begun = start(pushed)
    slow = slice(begun, begun + 150)
    force = pushed.contact_force[slow].sum(axis=1) + pushed.push[slow]
    assert force == pytest.approx(np.tile([0, 0, pushed.mass * GRAVITY], (150, 1)), abs=8.0), "nearly at rest"
    at_rest = pushed.zmp[begun]
    assert at_rest == pytest.approx(pushed.com[begun, :2], abs=0.01)
    moved = pushed.zmp[begun + 150] - at_rest
    lever = pushed.at[begun, 2] * np.linalg.norm(pushed.push[begun + 150]) / (pushed.mass * GRAVITY)
    assert moved == pytest.approx([0.0, lever], abs=0.02), "it runs away from the push"


def test_the_point_stays_in_its_area_and_is_at_the_edge_when_wheels_lift(pushed):
    area = support_area(pushed.contacts(start(pushed)))
    lift = pushed.first_lift()
    grown = 0.01 * np.sign(area) + area
    assert all(inside(point, grown) for point in pushed.zmp[start(pushed) : lift])
    assert pushed.zmp[lift, 1] == pytest.approx(area[:, 1].max(), abs=0.02)
    assert pushed.lifted[lift, [1, 3]].any() and not pushed.lifted[lift, [0, 2]].any(), "on the right"


def test_simulated_wrenches_are_in_the_cone(pushed, across):
    for tipping in (pushed, across, tip(1.0, 0.5, duration=2.0)):
        wrench = tipping.wrench[start(tipping) :]
        residual = line_contact(tipping.mu, WIDTH).residual(wrench)
        assert residual.max() < 0.01 * wrench[..., 2].max()
        assert residual[..., :8].max() > -30.0, "and near its faces"


def test_the_strongest_push_is_that_of_the_levers(pushed, across):
    for tipping, half in ((pushed, 0.19 + WIDTH / 2), (across, 0.19)):
        k = start(tipping)
        weight = tipping.mass * GRAVITY
        strongest = strongest_push(tipping.contacts(k), tipping.com[k], tipping.at[k], weight, np.pi / 2)
        assert strongest == pytest.approx(weight * half / tipping.at[k, 2], rel=0.01)
        lifted = np.linalg.norm(tipping.push[tipping.first_lift()])
        assert 0.85 * strongest < lifted < strongest, "it leans, and lifts a little earlier"


def test_friction_may_end_it_before(pushed):
    k, weight = start(pushed), pushed.mass * GRAVITY
    contacts = [type(c)(c.position, c.R_wc, line_contact(0.2, WIDTH)) for c in pushed.contacts(k)]
    strongest = strongest_push(contacts, pushed.com[k], pushed.at[k], weight, np.pi / 2)
    assert strongest == pytest.approx(0.2 * weight, rel=0.01)


def test_a_gentle_push_lifts_nothing():
    gentle = tip(rate=5.0, duration=0.5)
    assert gentle.first_lift() is None and gentle.t[-1] == pytest.approx(0.5)
    assert not gentle.push[gentle.t <= 0.0].any() and gentle.push[-1] == pytest.approx([0, 2.5, 0])


def test_the_replay_shows_push_point_and_area(pushed):
    motion = motion_of_tipping(pushed)
    frames = len(motion.qpos)
    assert motion.qpos.shape == (frames, 30) and motion.force.shape == (frames, 4, 3)
    assert motion.balance.push[-1, 1] > 100.0 and np.ptp(motion.balance.area[:, 1]) == pytest.approx(
        0.42, abs=2e-3
    )
    assert motion.balance.zmp[motion.modes.min(axis=1) == 1][-1, 1] > 0.0
    assert (motion.modes[-1] == [1, 2, 1, 2]).all(), "on its left wheels"
    page = html(pushed)
    for name in ("zero-moment point", "area of support", "push"):
        assert name in page
