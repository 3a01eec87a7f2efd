"""Chapter 12: a jump: crouch, push off, fly, land, stand, by eqs 4 and 5.

In the air no wheel stands, eq. 4 has no contact rows left, and the centre of mass goes as gravity wants it.
What it is asked to do is therefore a parabola, with a push and a landing of the same constant acceleration
before and after. Wheels are drawn up and put down again; locked, as in every other step.
"""

from dataclasses import dataclass, replace

import numpy as np

from wfbook.omni.costs import Weights
from wfbook.omni.locked import Target
from wfbook.omni.stride import Schedule, Swing, ease

GRAVITY = 9.81
JUMP_WEIGHTS = Weights(
    leg=1e5, com=(5e3, 5e3, 2e4), trunk=(200.0, 200.0, 200.0), posture=0.05, velocity=0.2, contact=1.0,
    least_force=5.0,
)  # fmt: skip
"""Of the whole motion."""


@dataclass(frozen=True)
class Leap:
    """How it is done.

    Attributes:
        height: by which the centre of mass rises in the air, m.
        distance: ahead, m.
        retract: by how much less than that the legs are drawn up, over the ground, m.
        crouch: depth below where the robot stands, from which it pushes off and to which it lands, m.
        stretch: height above it, at which it leaves the ground and meets it, m.
        squat, rise, rest: durations of crouching, of standing up again, and of standing at the end, s.
    """

    height: float = 0.08
    distance: float = 0.0
    retract: float = 0.06
    crouch: float = 0.08
    stretch: float = 0.03
    squat: float = 0.6
    rise: float = 0.6
    rest: float = 0.3

    @property
    def speed(self) -> float:
        """Upward, when the wheels leave the ground."""
        return float(np.sqrt(2.0 * GRAVITY * self.height))

    @property
    def push(self) -> float:
        """Duration of the push, and of the landing, s."""
        return 2.0 * (self.crouch + self.stretch) / self.speed

    @property
    def flight(self) -> float:
        """Duration in the air, s."""
        return 2.0 * self.speed / GRAVITY

    def way(self, t: float) -> np.ndarray:
        """Return how far ahead and how much higher the centre of mass is at a time, ``(2,)``."""
        down, push, flight = self.squat, self.push, self.flight
        pace = self.distance / (push + flight)
        if t < down:
            return np.array([0.0, -self.crouch * ease(t / down)])
        t -= down
        if t < push:
            return np.array([0.5 * pace * t * t / push, -self.crouch + 0.5 * self.speed / push * t * t])
        t -= push
        if t < flight:
            return np.array([pace * (0.5 * push + t), self.stretch + self.speed * t - 0.5 * GRAVITY * t * t])
        t -= flight
        if t < push:
            left = push - t
            ahead = self.distance - 0.5 * pace * left * left / push
            return np.array([ahead, -self.crouch + 0.5 * self.speed / push * left * left])
        return np.array([self.distance, -self.crouch * (1.0 - ease((t - push) / self.rise))])


def leap_schedule(target: Target, feet: np.ndarray, com: np.ndarray, leap: Leap, dt: float) -> Schedule:
    """Return the references of a jump from standing.

    Args:
        target: of hand and body now, and at the end relative to the base that has moved on.
        feet: ``(4, 3)`` axles now.
        com: ``(3,)`` centre of mass now.
        leap: how.
        dt: from node to node.

    Raises:
        ValueError: a height that is not positive.
    """
    if not leap.height > 0.0:
        raise ValueError(f"leap: height {leap.height} must be positive")
    first = round((leap.squat + leap.push) / dt)
    last = first + round(leap.flight / dt)
    nodes = last + round((leap.push + leap.rise + leap.rest) / dt)
    # Nodes are a little off these times: the flight is stretched to whole nodes.
    times = np.interp(
        np.arange(nodes + 1),
        [0, first, last, nodes],
        [0.0, leap.squat + leap.push, leap.squat + leap.push + leap.flight, dt * nodes],
    )
    ahead = np.array([leap.distance, 0.0, 0.0])
    targets, stances = [], []
    for k, t in enumerate(times):
        moved, flown = leap.way(t), np.clip((k - first) / (last - first), 0.0, 1.0)
        lift = np.array([0.0, 0.0, leap.retract * np.sin(np.pi * flown) ** 2])
        hand = ease((t - leap.squat) / (2.0 * leap.push + leap.flight)) * ahead
        targets.append(
            replace(
                target,
                hand=target.hand + hand,
                com=com + np.array([moved[0], 0.0, moved[1]]),
                feet=feet + ease(flown) * ahead + lift,
            )
        )
        stances.append((not first <= k < last,) * 4)
    swings = [Swing(leg, first, last, feet[leg].copy(), feet[leg] + ahead) for leg in range(4)]
    return Schedule(dt, targets, stances, swings, np.array([leap.distance, 0.0]))
