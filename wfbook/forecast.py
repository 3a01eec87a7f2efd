"""Chapter 8: where the robot will be when the next window begins.

The plan says where; but the robot may have been pushed, or its feet stand beside their places. What of
that will still be so a little later?

- A foot stays where it stands until it swings; then it lands on its place.
- As long as a foot is on the ground, the controller brings the centre of mass back to the plan, as its
  gains have it (eq. 34).
- Along x nothing holds a robot that stands on passive wheels alone: an error of its velocity stays, and moves
  it on. Its wheels go with it, and so does the plan (:mod:`wfbook.drift`).
"""

from typing import TYPE_CHECKING

import numpy as np

from wfbook.drift import excess, pace_of
from wfbook.flights import interpolate
from wfbook.go1 import RADII
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.planner.problem import InitialState, Problem
from wfbook.planner.windows import state_after
from wfbook.reference import Gains
from wfbook.tracking import Tracker

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
    rho, now = problem.knots_per_slot, min(int((t + tracker.delay) / plan.slot_duration + 1e-2), slot - 1)
    com, velocity, _ = interpolate(plan, t)
    error, rate = (robot.com - com)[:2], (robot.com_velocity - velocity)[:2]
    drift, pace = tracker.drift.offset[0], tracker.drift.pace
    landings = np.zeros((problem.legs, 2))
    for j in range(now, slot):
        after, end = rho * (j + 1), (j + 1) * plan.slot_duration
        on_feet = bool(np.any((plan.S[:, j] == 0) & (plan.end_effector[:, j] == 0)))
        way = plan.x[after, 0] - com[0]
        if on_feet:
            kept = (pace - 1.0) * np.array([plan.v[after, 0], 0.0])
            error[0], drift = error[0] - drift, drift + (pace - 1.0) * way
            error, rate = _held(error, rate - kept, end - t)
            error[0], rate = error[0] + drift, rate + kept
        else:
            (_, across), (_, aside) = _held(error, rate, end - t)
            error, rate = np.array([error[0] + (end - t) * rate[0], across]), np.array([rate[0], aside])
            if excess(error[0] - drift):
                drift += excess(error[0] - drift)
                pace = pace_of(plan.v[after, 0] + rate[0], plan.v[after, 0])
        for leg in np.flatnonzero(plan.S[:, j]):
            later = np.flatnonzero(plan.S[leg, j + 1 :])
            until = rho * (j + 1 + later[0]) if len(later) else plan.knots
            landings[leg, 0] = drift + (pace - 1.0) * (plan.x[until] - plan.x[after])[0]
        t, com = end, plan.x[after]
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
    swinging = ~tracker.stance | plan.S[:, now:slot].any(axis=1)
    for leg in range(problem.legs):
        wheel = bool(plan.end_effector[leg, slot - 1])
        place = (robot.centres[leg] - RADII[int(wheel)] * tracker.footing.normals[leg])[:2]
        if swinging[leg]:
            place = planned.contacts[leg, :2] + landings[leg]
        if wheel:
            place[0] = planned.contacts[leg, 0] + error[0]
        if np.linalg.norm(place - planned.contacts[leg, :2]) > _TRIFLE or error.any():
            place = np.clip(place, reach[0][leg], reach[1][leg])
            contacts[leg] = _on_ground(problem, int(tracker.footing.landed[leg]), place, wheel)
    return InitialState(position, speed, planned.angles, planned.rates, contacts, planned.swung, planned.slot)


def _held(error: np.ndarray, rate: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Return an error and its rate some time later, each ``(2,)``, where the controller can act.

    The error goes back like that of a critically damped pendulum, which the gains are close to.
    """
    omega = np.sqrt(Gains().com_kp[:2])
    decay, pull = np.exp(-omega * duration), rate + omega * error
    return (error + pull * duration) * decay, (rate - omega * pull * duration) * decay


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
