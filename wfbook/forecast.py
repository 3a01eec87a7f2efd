"""Chapter 8: where the robot will be when the next window begins.

The plan says where; but the robot may have been pushed, or its feet stand beside their places. What of
that will still be so a little later?

- A foot stays where it stands until it swings; then it lands on its place.
- As long as a foot is on the ground, the controller brings the centre of mass back to the plan, as its
  gains have it (eq. 34).
- Along x nothing holds a robot that stands on passive wheels alone: an error of its velocity stays, and moves
  it on. Its wheels go with it.
"""

from typing import TYPE_CHECKING

import numpy as np

from wfbook.go1 import RADII
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.planner.problem import InitialState, Problem
from wfbook.planner.windows import state_after
from wfbook.reference import Gains
from wfbook.tracking import Tracker, interpolate

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan

_TRIFLE = 0.01
"""Errors that are left to the controller: feet roll over their roundness by as much. A plan that ends at the
limit of its stance would have no successor if each millimetre counted."""

_SLOW = 0.02


def expected_state(
    problem: Problem, plan: "Plan", slot: int, t: float, tracker: Tracker, robot: Go1Dynamics
) -> InitialState:
    """Return the state in which a slot is expected to begin.

    Height, orientation and their rates are the plan's.

    Args:
        problem: whose limits the state keeps, so that a plan can begin there.
        plan: that the robot executes.
        slot: number of the slot.
        t: time now, since the plan's start; before the slot.
        tracker: what it tracks now.
        robot: dynamics at the state that the robot knows.
    """
    planned = state_after(problem, plan, slot)
    now = min(int((t + tracker.delay) / plan.slot_duration + 1e-2), slot - 1)
    com, velocity, _ = interpolate(plan, t)
    error, rate = (robot.com - com)[:2], (robot.com_velocity - velocity)[:2]
    for j in range(now, slot):
        duration = min((j + 1) * plan.slot_duration - t, plan.slot_duration)
        on_feet = bool(np.any((plan.S[:, j] == 0) & (plan.end_effector[:, j] == 0)))
        error, rate = _held(error, rate, duration, np.array([on_feet, True]))
    error = error if np.linalg.norm(error) > _TRIFLE else np.zeros(2)
    rate = rate if np.linalg.norm(rate) > _SLOW else np.zeros(2)
    position = planned.position.copy()
    position[:2] += error
    limits = problem.limits
    most = np.array([limits.speed[0], limits.lateral_speed])
    least = -np.array([limits.speed[1], limits.lateral_speed])
    speed = planned.velocity.copy()
    speed[:2] = np.clip(speed[:2] + rate, least, most)
    reach = (position + problem.robot.reach_lower)[:, :2], (position + problem.robot.reach_upper)[:, :2]
    contacts = planned.contacts.copy()
    for leg in np.flatnonzero(tracker.stance & ~plan.S[:, now:slot].any(axis=1)):
        wheel = bool(plan.end_effector[leg, slot - 1])
        place = (robot.centres[leg] - RADII[int(wheel)] * tracker.footing.normals[leg])[:2]
        if wheel:
            place[0] = planned.contacts[leg, 0] + error[0]
        if np.linalg.norm(place - planned.contacts[leg, :2]) > _TRIFLE or error.any():
            place = np.clip(place, reach[0][leg], reach[1][leg])
            contacts[leg] = _on_ground(problem, int(tracker.footing.landed[leg]), place, wheel)
    return InitialState(position, speed, planned.angles, planned.rates, contacts, planned.swung, planned.slot)


def _held(
    error: np.ndarray, rate: np.ndarray, duration: float, held: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return an error and its rate some time later, each ``(2,)``.

    Args:
        error: of the position.
        rate: of the velocity.
        duration: how much later.
        held: ``(2,)`` bool, along which axes the controller can act. There the error goes back like that of a
            critically damped pendulum, which the gains are close to.
    """
    omega = np.sqrt(Gains().com_kp[:2])
    decay, pull = np.exp(-omega * duration), rate + omega * error
    back = (error + pull * duration) * decay, (rate - omega * pull * duration) * decay
    return np.where(held, back[0], error + duration * rate), np.where(held, back[1], rate)


def _on_ground(problem: Problem, landed: int, place: np.ndarray, wheel: bool) -> np.ndarray:
    """Return the contact point ``(3,)`` nearest to a place on the region where a leg landed.

    A wheel may have rolled on to another region of its group.
    """
    terrain = problem.terrain
    region = terrain.regions[landed]
    under = terrain.region_at(*place) if wheel else None
    if under is not None and terrain.regions[under].group == region.group:
        region = terrain.regions[under]
    return region.nearest(np.array([*place, region.height(*place)]))
