"""Chapter 8: what a plan asks of the robot at any instant.

A plan is a list of knots 0.1 s apart; a controller runs every 2 ms and its torques arrive one delay
later. In between stands :class:`Tracker`. It interpolates the plan, swings the legs, and takes from the
robot's own sensing what a plan can't know: when a leg really touches the ground.

- The centre of mass is interpolated as the plan was integrated, a parabola between knots.
- A leg is commanded to lift, and forces are redistributed, one delay before the plan says so: then it
  happens on time.
- A swing aims to land after 88 % of its slot, so that it has landed when the plan loads it.
- A leg that touches early stands from then on; a leg that is late keeps going down.
- A robot on two legs tips across the line between them. The swinging legs land as far aside as it has
  tipped, and hold it.
- The end effector is switched in the air, past the apex, when the larger wheel has room.

Each of these is a habit that can be left out (:class:`Habits`), to see what it is good for.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wfbook.drift import Drift
from wfbook.flights import LANDING_PHASE, Swing, interpolate, swings_of
from wfbook.footing import Footing
from wfbook.go1 import FOOT_RADIUS, RADII, calf_pitch, nominal
from wfbook.go1_dynamics import GRAVITY, Go1Dynamics, rotation
from wfbook.lean import Lean
from wfbook.modes import END_EFFECTORS, LEGS
from wfbook.reference import Ground, Reference
from wfbook.swing import quintic_basis, swing_position

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan
    from wfbook.terrain import Region

_SAMPLE = 0.001
_SEARCH_SPEED = 0.15
_SEARCH_DEPTH = 0.06
_LOST_AFTER = 0.02
_LOADED = 15.0
_PRESS = 0.004
_PATIENCE = 0.05
_COMMITTED = 0.9
_FARTHEST_ASIDE = 0.06
_SWITCH_ROOM = 0.004
_OFF_EDGES = 0.005
_CATCH_UP = 5.0
_ONES = np.ones(4)


@dataclass(frozen=True)
class Habits:
    """What a tracker does besides reading its plan aloud; all of it, unless a lesson leaves something out.

    Attributes:
        interpolates: between knots the CoM moves as the plan was integrated; else as at the knot before.
        foresees: legs lift, and accelerations are asked for, one delay ahead.
        lands_early: swings land after :data:`wfbook.flights.LANDING_PHASE` of their slots; else at their end.
        feels: legs stand once they touch the ground, and search it when they miss it; else they stand when
            the plan says so.
        steps_aside: swinging legs land beside their places to hold a body that tips.
        leans: by what the trunk leans, one of :data:`wfbook.lean.BY`.
    """

    interpolates: bool = True
    foresees: bool = True
    lands_early: bool = True
    feels: bool = True
    steps_aside: bool = True
    leans: str = "hips"

    @property
    def landing_phase(self) -> float:
        """Fraction of its slots after which a swing lands."""
        return LANDING_PHASE if self.lands_early else 1.0


class Tracker:
    """Turns a plan and what the robot feels into references.

    Args:
        plan: to follow. Its time 0 is the tracker's.
        delay: after which torques act.
        habits: what it does besides; by default everything.

    Attributes:
        stance: ``(4,)`` bool, which legs are commanded to carry load now.
        lifted: how many flights each leg has begun, ``(4,)``.
        footing: what is under each leg.
        lean: the trunk's orientation.
        drift: how far the plan goes along with a robot that rolls away.
    """

    def __init__(self, plan: "Plan", delay: float, habits: Habits | None = None) -> None:
        self.plan, self.delay, self.habits = plan, delay, habits or Habits()
        self.flights, self.drift = swings_of(plan, self.habits.landing_phase), Drift()
        self.lean = Lean(plan, self.habits.leans)
        self._lead = delay if self.habits.foresees else 0.0
        self.stance = np.ones(4, bool)
        self.lifted = np.zeros(4, int)
        self._from = np.zeros((4, 3))
        self._paths: list[np.ndarray] = [np.zeros((3, 2, 4))] * 4
        self._searching_since = np.full(4, np.nan)
        self._last_touch = np.zeros(4)
        self._shift = np.zeros((4, 3))
        self._extremes = np.zeros((4, 2, 3))
        self._start = np.zeros(4)
        kinds = [END_EFFECTORS.index(name) for name in plan.meta["start_end_effectors"]]
        self._kinds = np.array(kinds)
        self._hips = nominal()["hips"]
        self.footing = Footing(plan.terrain, plan.p[0], plan.D.sum(axis=3).argmax(axis=2)[:, 0])

    def start_ends(self) -> np.ndarray:
        """Return the centres of the legs' ends in the plan's first posture, ``(4, 3)``."""
        return self.plan.p[0] + RADII[self._kinds][:, None] * self.footing.normals

    def follow(self, plan: "Plan", slot: int) -> None:
        """Go on with another plan, one delay before it differs from the present one.

        Args:
            plan: up to the slot as the present one; no leg swings on both sides of the slot's begin.
            slot: the first in which it differs.
        """
        self.plan, self.flights = plan, swings_of(plan, self.habits.landing_phase)
        self.lean.follow(plan, slot)
        self.drift.end_at(slot * plan.slot_duration)

    def update(
        self, t: float, robot: Go1Dynamics, touching: np.ndarray, forces: np.ndarray
    ) -> tuple[Reference, Ground]:
        """Advance to a time and return what to do.

        Args:
            t: time since the plan's start; negative while the robot settles.
            robot: dynamics at the present state.
            touching: ``(4,)`` bool, which legs feel the ground.
            forces: ``(4, 3)`` that the controller last asked of the ground.

        Returns:
            Reference (its ``wheels`` say what each leg should stand on, its ``forces`` are zero) and ground.
        """
        ends = robot.centres
        self._last_touch[touching | (forces[:, 2] < _LOADED)] = t  # who presses on nothing feels nothing
        com, velocity, _ = self._planned(t)
        ahead = self._planned(t + self._lead)[2]
        for leg in range(4):
            self._advance(leg, t, bool(touching[leg]), ends[leg], robot.centre_velocity[leg])
        rolling, normal = bool((self._kinds | ~self.stance).all()), 0.25 * (_ONES @ self.footing.normals)
        com, velocity, ahead = self.drift.update(t, (com, velocity, ahead), robot, rolling, normal)
        p = np.zeros((4, 3))
        for leg in np.flatnonzero(self.stance):
            place, radius, speed = self._standing(leg, t, com), RADII[self._kinds[leg]], 0.0
            if self._kinds[leg]:
                late = place[0] - ends[leg, 0] + radius * self.footing.normals[leg, 0]
                speed = velocity[0] + _CATCH_UP * late
            self.footing.stand(leg, ends[leg], speed)
            p[leg] = place + radius * self.footing.normals[leg]
        ground = self.footing.ground()
        v, a = self._kinds[:, None] * velocity, np.zeros((4, 3))
        if not self.stance.all():
            if self.habits.steps_aside:
                self._step_aside(t, robot, com, velocity)
            for leg in np.flatnonzero(~self.stance):
                p[leg], v[leg], a[leg] = self._in_the_air(leg, t, ground.normals[leg])
        wheels = self._kinds.astype(bool)
        rpy, omega = self.lean.at(t)
        stance, forces = self.stance.copy(), np.zeros((4, 3))
        ref = Reference(com, velocity, ahead, rotation(rpy), p, v, a, stance, wheels, forces, omega)
        return ref, ground

    def switches(self, t: float, ends: np.ndarray, present: np.ndarray) -> list[tuple[str, str]]:
        """Return which legs should change their end effector now, as (leg, kind).

        Args:
            t: time since the plan's start.
            ends: ``(4, 3)`` centres of the legs' ends.
            present: ``(4,)`` end effectors now.
        """
        wanted = []
        for leg in np.flatnonzero(~self.stance & (self._kinds != present)):
            flight = self.flights[leg][self.lifted[leg] - 1]
            room = min(np.linalg.norm(ends[leg] - r.nearest(ends[leg])) for r in self.plan.terrain.regions)
            if t >= flight.start + 0.4 * flight.duration and room > RADII[self._kinds[leg]] + _SWITCH_ROOM:
                wanted.append((LEGS[leg], END_EFFECTORS[self._kinds[leg]]))
        return wanted

    def _planned(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the planned CoM, its velocity and acceleration, ``(3,)`` each."""
        if not self.habits.interpolates:
            t = self.plan.dt * np.floor(t / self.plan.dt + 1e-9)
        return interpolate(self.plan, t)

    def _advance(self, leg: int, t: float, touching: bool, end: np.ndarray, velocity: np.ndarray) -> None:
        """Move one leg's state on: lift-off, touch-down, loss of contact."""
        flights, count = self.flights[leg], self.lifted[leg]
        if count < len(flights) and t + self._lead >= flights[count].start - 1e-9 and self._may_lift(leg, t):
            flight = flights[count]
            self.lifted[leg] += 1
            self.stance[leg] = False
            self._start[leg] = max(t, flight.start)
            self._paths[leg] = self._flight_path(flight, leg, end, velocity)
            self._kinds[leg] = flight.kind
            self.footing.land(leg, flight.region)
            self._searching_since[leg] = np.nan
            self._shift[leg] = 0.0
            return
        if self.stance[leg]:
            if self.habits.feels and t > 0 and t - self._last_touch[leg] > self.delay + _LOST_AFTER:
                self.stance[leg] = False
                self._from[leg] = end
                self._searching_since[leg] = t
            return
        searching = np.isfinite(self._searching_since[leg])
        flight = flights[count - 1] if count else None
        falling = searching or t >= flight.start + 0.5 * flight.duration
        if (falling and touching) if self.habits.feels else (t + self._lead >= flight.end):
            self.stance[leg] = True
            self._searching_since[leg] = np.nan

    def _standing(self, leg: int, t: float, com: np.ndarray) -> np.ndarray:
        """Return where a standing leg's contact point is to be, ``(3,)``; a rolling one goes with the CoM.

        A leg that landed early stands as it will by plan, one that lifts late as it stood before.
        """
        flights, count = self.flights[leg], self.lifted[leg]
        t = max(t, flights[count - 1].end) if count else t
        t = min(t, flights[count].start) if count < len(flights) else t
        plan = self.plan
        place = min(max(t / plan.dt, 0.0), float(plan.knots))
        k = min(int(place), plan.knots - 1)
        p = plan.p[k, leg] + (place - k) * (plan.p[k + 1, leg] - plan.p[k, leg])
        if not self._kinds[leg]:
            return p
        return p + com - (plan.x[k] + (place - k) * (plan.x[k + 1] - plan.x[k]))

    def _may_lift(self, leg: int, t: float) -> bool:
        """Whether a leg due to lift leaves a diagonal pair standing; if not, it waits for late ones a little.

        Two legs of one end or one side don't carry the robot (see
        :data:`wfbook.modes.DIAGONAL_PATTERNS`).
        """
        flight = self.flights[leg][self.lifted[leg]]
        staying = {
            int(other)
            for other in np.flatnonzero(self.stance)
            if not any(f.start <= flight.start < f.end for f in self.flights[other])
        }
        return {0, 3} <= staying or {1, 2} <= staying or t > flight.start + _PATIENCE

    def _flight_path(self, flight: Swing, leg: int, start: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the path of a leg's end from lift-off to landing (Paper A, eqs 2–6).

        Args:
            flight: the swing.
            leg: which still has the end effector it lifts.
            start: ``(3,)`` where the leg's end is.
            velocity: ``(3,)`` its velocity.

        Returns:
            ``(3, n, 4)``: position, velocity and acceleration, and in the fourth column how much of a shift
            of the landing point they take on; one sample a millisecond and one beyond the end.
        """
        duration, target, landing = self._duration(leg, flight), flight.target, np.zeros(3)
        region, rolled = self.plan.terrain.regions[flight.region], flight.target
        if flight.kind:  # a wheel lands moving with the robot, and rolls on until the slot ends
            com, com_velocity, _ = interpolate(self.plan, flight.start + flight.duration)
            along = region.tangent / region.tangent[0]
            landing = com_velocity[0] * along
            back = (com[0] - interpolate(self.plan, flight.end)[0][0]) * along
            target = target + _room(region, target, back[:2]) * back
        else:
            roll = self._roll(leg, flight) * region.tangent
            target = target - (1.0 - _room(region, target, roll[:2])) * roll
            rolled = target + roll
        self._extremes[leg] = target, rolled
        target = target + (RADII[flight.kind] - _PRESS) * region.normal
        # the larger of the two end effectors clears the ground by the swing height
        apex = self.plan.meta["swing_height"] + 0.5 * abs(RADII[flight.kind] - RADII[self._kinds[leg]])
        count = round(duration / _SAMPLE) + 2
        phase = np.minimum(np.arange(count) * _SAMPLE / duration, 1.0)
        path = np.empty((3, count, 4))
        smoothness = self.plan.meta.get("swing_smoothness", 2)  # less than 2 only to show what it costs
        for d in range(3):
            basis = quintic_basis(phase, d) / duration**d
            path[d, :, :3] = swing_position(
                phase, duration, start, target, apex, velocity, landing, d, smoothness
            )
            path[d, :, 2] += duration * landing[2] * basis[:, 3]  # on a slope a wheel lands along the slope
            path[d, :, 3] = basis[:, 2]
        return path

    def _roll(self, leg: int, flight: Swing) -> float:
        """Return how far forward a foot will roll over its own roundness while it stands after a flight.

        It is a centimetre and more where the robot walks past the foot. Near an edge the foot lands so much
        before its place that it does not roll over.
        """
        pitches = []
        for t in (flight.end, self._stance_end(leg)):
            R_wb = rotation(self.lean.at(t)[0])
            pitches.append(calf_pitch(flight.target - interpolate(self.plan, t)[0] - R_wb @ self._hips[leg]))
        return FOOT_RADIUS * (pitches[1] - pitches[0])

    def _stance_end(self, leg: int) -> float:
        """Return until when a leg stands that lands next."""
        later = self.flights[leg][self.lifted[leg] :]
        return later[0].start if later else self.plan.t[-1] - self.plan.t[0]

    def _duration(self, leg: int, flight: Swing) -> float:
        """Return the time from a leg's actual lift-off to its planned landing."""
        return flight.start + flight.duration - self._start[leg]

    def _in_the_air(
        self, leg: int, t: float, normal: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where a leg's end should be in the air, its velocity and acceleration, each ``(3,)``."""
        if np.isfinite(since := self._searching_since[leg]):
            depth = min(_SEARCH_SPEED * (t - since), _SEARCH_DEPTH)
            return self._from[leg] - depth * normal, -_SEARCH_SPEED * normal, np.zeros(3)
        flight, path, shift = self.flights[leg][self.lifted[leg] - 1], self._paths[leg], self._shift[leg]
        late = t - flight.start - flight.duration
        if late >= 0.0:
            depth = min(_SEARCH_SPEED * late, _SEARCH_DEPTH)
            landing = path[1, -1, :3]
            position = path[0, -1, :3] + shift + late * landing - depth * normal
            return position, landing - _SEARCH_SPEED * normal, np.zeros(3)
        elapsed = t - self._start[leg]
        now = np.vstack([_sampled(path[:2], elapsed), _sampled(path[2:], elapsed + self._lead)])
        return tuple(now[:, :3] + now[:, 3:] * shift)

    def _step_aside(self, t: float, robot: Go1Dynamics, com: np.ndarray, velocity: np.ndarray) -> None:
        """Choose how far beside their planned footholds the swinging legs land.

        On two legs the robot is an inverted pendulum about the line between them: no force moves it across,
        and what the plan did not know of (the swing of the legs themselves, above all) grows as ``e^(ω t)``
        until other legs take over. If these land as far aside as the pendulum will have gone, they hold it.
        """
        omega = np.sqrt(-GRAVITY[2] / self.plan.meta["com_height"])
        standing = np.flatnonzero(self.stance)
        across = np.zeros(2)
        if len(standing) == 2:
            line = robot.centres[standing[1], :2] - robot.centres[standing[0], :2]
            across = np.array([-line[1], line[0]]) / np.linalg.norm(line)
        error = (robot.com - com + (robot.com_velocity - velocity) / omega)[:2]
        for leg in np.flatnonzero(~self.stance):
            flight = self.flights[leg][self.lifted[leg] - 1] if self.lifted[leg] else None
            if flight is None or t > flight.start + _COMMITTED * flight.duration:
                continue
            growth = np.exp(omega * (flight.start + flight.duration - t))
            shift = across * (across @ error) * growth
            shift *= min(1.0, _FARTHEST_ASIDE / max(np.linalg.norm(shift), 1e-9))
            until = flight.end if flight.kind else self._stance_end(leg)
            shift += self.drift.after(interpolate(self.plan, until)[0][0] - interpolate(self.plan, t)[0][0])
            region = self.plan.terrain.regions[flight.region]
            shift *= min(_room(region, point, shift) for point in self._extremes[leg])
            rise = -(region.normal[:2] @ shift) / region.normal[2]
            self._shift[leg] = [*shift, rise]


def _sampled(path: np.ndarray, elapsed: float) -> np.ndarray:
    """Return the samples ``(m, 3)`` of ``(m, n, 3)`` at a time since lift-off, interpolated linearly."""
    place = min(max(elapsed / _SAMPLE, 0.0), path.shape[1] - 1.001)
    index = int(place)
    return path[:, index] + (place - index) * (path[:, index + 1] - path[:, index])


def _room(region: "Region", point: np.ndarray, shift: np.ndarray) -> float:
    """Return how much of a shift ``(2,)`` a point can make inside its region, 0 to 1 (Paper A, eq. 22)."""
    A, b = region.halfspaces
    outward = A @ shift
    room = np.maximum(b - _OFF_EDGES - A @ point[:2], 0.0)
    leaving = outward > room
    return float(np.min(room[leaving] / outward[leaving], initial=1.0))
