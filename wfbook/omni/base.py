"""Chapter 9: a base on steered wheels whose motors take time, and which therefore steers first.

The map of :mod:`.wheels` is exact once the wheels point where they should. A steering motor needs a moment
for that. :class:`Base` never asks for a twist that its wheels can't be steered for in time: from rest it
turns the wheels before it moves, on the way it lets the twist change no faster than the slowest wheel can
be steered, and where that would take for ever it slows down without changing its course, and steers at
rest.
"""

from dataclasses import dataclass, field

import numpy as np

from wfbook.omni.robot import WHEEL_POSITIONS
from wfbook.omni.wheels import (
    HYSTERESIS,
    REST_SPEED,
    accelerated,
    constraint_matrix,
    wheel_command,
    wheel_velocities,
)

_SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.17, 0.12, 0.08)
"""Of the acceleration asked for, tried one after the other."""


@dataclass(frozen=True)
class Limits:
    """What the motors can do.

    Attributes:
        acceleration: ``(3,)`` largest of each component of U_SW: forward, sideways, yaw.
        steering_rate: of a wheel.
        aligned: steering error with which a wheel may begin to roll.
    """

    acceleration: np.ndarray = field(default_factory=lambda: np.array([1.0, 1.0, 2.0]))
    steering_rate: float = 6.0
    aligned: float = 0.01


@dataclass(frozen=True)
class Drive:
    """How a base moved, sampled in N + 1 steps.

    Attributes:
        t: ``(N+1,)``.
        pose: ``(N+1, 3)`` x, y, yaw.
        twist: ``(N+1, 3)`` in the body's axes.
        steering: ``(N+1, n)`` angles as the wheels stand, not wrapped.
        speed: ``(N+1, n)`` along them.
        skid: ``(N+1, n)`` sideways, of the wheels' middles.
    """

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    steering: np.ndarray
    speed: np.ndarray
    skid: np.ndarray


class Base:
    """A body on steered wheels that follows a wanted twist as fast as its motors let it.

    Args:
        positions: ``(n, 2)`` of the wheels.
        limits: of the motors.
        steer_first: whether the wheels steer before the body moves. Without it they steer while they roll.
        hysteresis: see :func:`wfbook.omni.wheels.shorter_turns`.

    Attributes:
        state: ``(6,)`` Paper B's X_SW: pose x, y, yaw in the world, twist in the body's axes.
        steering: ``(n,)`` angles, not wrapped.
        backward: ``(n,)`` bool, which wheels roll backward.
    """

    def __init__(
        self,
        positions: np.ndarray = WHEEL_POSITIONS,
        limits: Limits | None = None,
        steer_first: bool = True,
        hysteresis: float = HYSTERESIS,
    ) -> None:
        self.positions = np.array(positions, dtype=float)
        self.limits = Limits() if limits is None else limits
        self.steer_first = steer_first
        self.hysteresis = hysteresis
        self.state = np.zeros(6)
        self.steering = np.zeros(len(self.positions))
        self.backward = np.zeros(len(self.positions), bool)

    @property
    def twist(self) -> np.ndarray:
        """``(3,)`` of the body now."""
        return self.state[3:].copy()

    def advance(self, wanted: np.ndarray, dt: float) -> np.ndarray:
        """Move on by a time step towards a wanted twist ``(3,)``; return the wheels' speeds ``(n,)``."""
        wanted = np.asarray(wanted, dtype=float)
        acceleration = self._towards(wanted, dt)
        if self.steer_first and self._fastest(self.twist) < REST_SPEED:
            if self._fastest(wanted) < REST_SPEED:
                self.state[3:] = 0.0  # what is left is less than any wheel would turn for
                return np.zeros(len(self.positions))
            turn, backward = self._turn(wanted)
            if np.abs(turn).max() > self.limits.aligned:
                self.state[3:] = 0.0
                self._steer(turn, backward, dt)
                return np.zeros(len(self.positions))
        self._move(acceleration, dt)
        return (constraint_matrix(self.steering, self.positions) @ self.twist)[len(self.positions) :]

    def drive(self, wanted: np.ndarray, duration: float, dt: float = 0.01) -> Drive:
        """Follow a wanted twist, ``(3,)``, or one for each step, ``(N, 3)``, and return what happened."""
        steps = round(duration / dt)
        wanted = np.broadcast_to(wanted, (steps, 3))
        poses, angles = [self.state.copy()], [self.steering.copy()]
        for twist in wanted:
            self.advance(twist, dt)
            poses.append(self.state.copy())
            angles.append(self.steering.copy())
        states, steering = np.array(poses), np.array(angles)
        wheels = np.array(
            [
                constraint_matrix(row, self.positions) @ twist
                for row, twist in zip(steering, states[:, 3:], strict=True)
            ]
        )
        return Drive(
            t=dt * np.arange(steps + 1),
            pose=states[:, :3],
            twist=states[:, 3:],
            steering=steering,
            speed=wheels[:, len(self.positions) :],
            skid=wheels[:, : len(self.positions)],
        )

    def _towards(self, wanted: np.ndarray, dt: float) -> np.ndarray:
        """Return the acceleration ``(3,)`` straight towards a twist, within the limits."""
        missing = (wanted - self.twist) / dt
        return missing / max(1.0, float((np.abs(missing) / self.limits.acceleration).max()))

    def _braking(self, dt: float) -> np.ndarray:
        """Return the acceleration ``(3,)`` that slows down along the present course, within the limits."""
        twist = self.twist
        return -twist * min(1.0 / dt, float((self.limits.acceleration / (np.abs(twist) + 1e-12)).min()))

    def _fastest(self, twist: np.ndarray) -> float:
        return float(np.linalg.norm(wheel_velocities(twist, self.positions), axis=1).max())

    def _turn(self, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how much each wheel has to turn for a twist, and whether it rolls backward then."""
        command = wheel_command(twist, self.positions, self.steering, self.backward, self.hysteresis)
        return command.steering - self.steering, command.backward

    def _steer(self, turn: np.ndarray, backward: np.ndarray, dt: float) -> None:
        most = self.limits.steering_rate * dt
        self.steering = self.steering + np.clip(turn, -most, most)
        self.backward = backward

    def _move(self, acceleration: np.ndarray, dt: float) -> None:
        """Change the twist as much of the way as the wheels can be steered for in this step."""
        most = self.limits.steering_rate * dt + 1e-9
        for share in _SHARES if self.steer_first else _SHARES[:1]:
            turn, backward = self._turn(self.twist + share * dt * acceleration)
            if not self.steer_first or np.abs(turn).max() <= max(most, self.limits.aligned):
                break
        else:
            # Slower along the same course needs no steering; at rest the wheels steer first.
            share, acceleration = 1.0, self._braking(dt)
            turn, backward = self._turn(self.twist + dt * acceleration)
        self.state = accelerated(self.state, share * acceleration, dt)
        self._steer(turn, backward, dt)
