"""A plan that ends at rest must be able to stay there: told by a linear program that knows no planner."""

from dataclasses import replace

import gait_plans
import numpy as np
import pytest
from scipy.optimize import linprog

from wfbook.planner import Plan, polish
from wfbook.planner.margins import HOLD
from wfbook.planner.polish import repaired
from wfbook.terrain import Terrain, flat

ONE_FOOT = ["w....", ".w...", ".....", "w...."], [[0] * 5] * 4
"""Three legs land on wheels, the fourth stays on its foot, and holds the robot."""


def slope(degrees: float, friction: float = 0.7) -> Terrain:
    (ground,) = flat().regions
    vertices = ground.vertices.copy()
    vertices[:, 2] = np.tan(np.radians(degrees)) * vertices[:, 0]
    return Terrain("slope", (replace(ground, vertices=vertices, mu_foot=friction),))


def lacking(plan: Plan, share: float) -> float:
    """The least torque, summed over axes, that forces within a share of the friction lack to hold the end."""
    held, turned = [], []
    for lever in plan.p[-1] - plan.x[-1]:
        held.append(np.eye(3))
        turned.append(np.cross(lever, np.eye(3)).T)
    slack = np.hstack([np.eye(3), -np.eye(3)])
    balance = np.vstack([np.hstack([*held, np.zeros((3, 6))]), np.hstack([*turned, slack])])
    carried = np.array([0.0, 0.0, plan.meta["mass"] * 9.81, 0.0, 0.0, 0.0])
    sides = []
    for leg in range(4):
        region = plan.terrain.regions[plan.meta["regions"][leg][-1]]
        wheel = plan.end_effector[leg, -1] == 1
        along, aside = (0.0, region.mu_wheel_lateral) if wheel else (region.mu_foot, region.mu_foot)
        for direction, mu in ((region.tangent, along), (region.binormal, aside)):
            for sign in (1.0, -1.0):
                row = np.zeros(18)
                row[3 * leg : 3 * leg + 3] = sign * direction - share * mu * region.normal
                sides.append(row)
    found = linprog(
        np.r_[np.zeros(12), np.ones(6)],
        A_ub=sides,
        b_ub=np.zeros(len(sides)),
        A_eq=balance,
        b_eq=carried,
        bounds=[(None, None)] * 12 + [(0.0, None)] * 6,
    )
    assert found.status == 0
    return found.fun


@pytest.mark.parametrize("degrees", [10.0, 12.0])
def test_a_polished_plan_stays_on_a_slope_with_one_foot_down(degrees):
    relaxed = gait_plans.relaxed(slope(degrees), 0.1, *ONE_FOOT)
    assert lacking(relaxed, HOLD) > 1.0, "this gait does not need the polish"
    polished = polish(relaxed)
    assert repaired(polished)
    assert lacking(polished, HOLD) < 0.01


def test_a_plan_that_no_foot_can_hold_is_not_repaired_and_says_what_it_lacks():
    """In motion its torques are true: only to stay, the foot would need more friction than there is."""
    polished = polish(gait_plans.relaxed(slope(12.0, friction=0.33), 0.05, *ONE_FOOT))
    assert max(polished.meta["torque_mismatch_nm"]) < 0.01
    assert sum(polished.meta["rest_mismatch_nm"]) == pytest.approx(lacking(polished, HOLD), abs=1e-3)
    assert not repaired(polished)
