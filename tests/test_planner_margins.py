"""What a polished plan keeps in hand: load on its legs, and room under its knees."""

import numpy as np
import pytest

from wfbook.go1 import FOOT_RADIUS, WHEEL_RADIUS, leg_angles
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.planner import polish, repaired, stored
from wfbook.planner.margins import LOAD

THIGH = 0.213
CALF_HALF_THICKNESS = 0.012
"""Of the box around the calf that collides, across its diagonal."""


@pytest.fixture(scope="module")
def down():
    """A plan down the ramp that brakes with a foot far ahead of its hip."""
    return polish(stored("ramp-down", relaxed=True))


def knees(plan, k, robot):
    """Heights of the standing legs' knees above the ground, the trunk along the region under the foot."""
    slot = k * plan.slots // plan.knots
    for leg in np.flatnonzero(plan.S[:, slot] == 0):
        region = plan.terrain.regions[plan.D[leg, slot].sum(axis=1).argmax()]
        R = np.column_stack([region.tangent, region.binormal, region.normal])
        radius = WHEEL_RADIUS if plan.end_effector[leg, slot] else FOOT_RADIUS
        middle = 0.5 * (plan.x[k] + plan.x[k + 1] - plan.p[k, leg] - plan.p[k + 1, leg])
        end_b = robot.trunk_from_com - R.T @ middle + [0.0, 0.0, radius]
        hip, thigh, _calf = leg_angles(leg, end_b)
        hanging = np.array([-np.sin(thigh), 0.0, -np.cos(thigh)]) * THIGH
        c, s = np.cos(hip), np.sin(hip)
        knee_b = robot.hips[leg] + np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ hanging
        contact_b = end_b - [0.0, 0.0, radius]
        yield leg, knee_b[2] - contact_b[2]


class Trunk:
    """Where the hips are, and where the trunk's frame is seen from the centre of mass."""

    def __init__(self):
        dynamics = Go1Dynamics()
        x, y, z = 0.19, 0.127, FOOT_RADIUS
        ends = np.array([[x, y, z], [x, -y, z], [-x, y, z], [-x, -y, z]])
        qpos = dynamics.posture(np.array([0.0, 0.0, 0.265]), np.zeros(3), ends)
        dynamics.update(qpos, np.zeros(22))
        self.trunk_from_com = dynamics.com - qpos[:3]
        self.hips = dynamics.hips()


def test_three_legs_that_stand_all_carry_something(down):
    """Pushing up is the part along the normal; on a wheel without resistance it is all there is."""
    assert repaired(down)
    carried = []
    for k in range(down.knots):
        slot = k * down.slots // down.knots
        standing = np.flatnonzero(down.S[:, slot] == 0)
        normals = [down.terrain.regions[down.D[leg, slot].sum(axis=1).argmax()].normal for leg in standing]
        if len(standing) >= 3:
            carried += [n @ down.lam[k, leg] for n, leg in zip(normals, standing, strict=True)]
    weight = down.meta["mass"] * 9.81
    # Between knots a wheel may change regions, and with them its normal.
    assert min(carried) > 0.95 * LOAD * weight


def test_no_calf_lies_on_the_slope(down):
    robot = Trunk()
    room = [height - CALF_HALF_THICKNESS for k in range(down.knots) for _, height in knees(down, k, robot)]
    assert min(room) > 0.02
