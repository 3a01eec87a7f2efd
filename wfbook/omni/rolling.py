"""Chapter 12: the axes of a commanded base, and the wheels that keep to it.

**Axes.** The optimal control problem is stated in axes that move with the commanded base: the origin is on
the ground, x is ahead. The commanded twist is taken off all velocities, so a robot that drives as it should
stands still there, and nothing in the problem depends on how far it has driven. In straight motion that is
exact; what turning does to inertia is left to the feedback.

**Wheels** follow the base by the map of chapter 9. Each also corrects its own place: wheels skid and climb,
and no torque of a leg can bring one back that has rolled too far.
"""

import numpy as np
import pinocchio as pin

from wfbook.omni.base import Base
from wfbook.omni.robot import WHEEL_RADIUS
from wfbook.omni.wheels import constraint_matrix, moved, wheel_command, wheel_velocities

_PLACE_GAIN, _LARGEST_HASTE = 3.0, 0.3
"""Of a wheel that is behind, 1/s, and the most that it is sped up, m/s."""
_COURSE_GAIN, _LARGEST_CORRECTION = 1.0, 0.15
"""Of all wheels off course, 1/s, and the most that the twist is changed, as a share of it."""
_MOVING = 0.1
"""Wheels that are slower, m/s, are not steered back: they would turn for little."""


class Axes:
    """Axes that move with the commanded base: on the ground's level 0, x ahead.

    Args:
        state: ``(6,)`` of the base, Paper B's X_SW.
    """

    def __init__(self, state: np.ndarray) -> None:
        x, y, yaw = state[:3]
        cos, sin = np.cos(yaw), np.sin(yaw)
        self.R = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        self.origin = np.array([x, y, 0.0])
        self.velocity = self.R @ [state[3], state[4], 0.0]
        self.spin = np.array([0.0, 0.0, state[5]])

    def points(self, points: np.ndarray) -> np.ndarray:
        """Return world points ``(n, 3)`` in these axes."""
        return (points - self.origin) @ self.R

    def state(self, x: np.ndarray) -> np.ndarray:
        """Return a state ``(41,)`` as it looks from these axes, less their own motion."""
        seen = np.array(x)
        R_wb = pin.Quaternion(x[3:7]).toRotationMatrix()
        R_ab = self.R.T @ R_wb
        seen[:3] = self.points(x[:3])
        seen[3:7] = pin.Quaternion(R_ab).coeffs()
        lever = x[:3] - self.origin
        carried = self.velocity + np.array([-self.spin[2] * lever[1], self.spin[2] * lever[0], 0.0])
        seen[21:24] = x[21:24] - R_wb.T @ carried
        seen[24:27] = x[24:27] - R_wb.T @ self.spin
        return seen


class Wheels:
    """Wheels that follow a commanded base and correct their places; chapter 9's map, closed.

    Args:
        base: that is commanded; its state goes on with every :meth:`advance`.

    Attributes:
        steering: ``(4,)`` angles commanded.
        keep_places: whether wheels correct their places; without it they do as the base says.
    """

    def __init__(self, base: Base) -> None:
        self.base = base
        self.steering = base.steering.copy()
        self.keep_places = True
        self._speed = self._haste = np.zeros(4)

    def advance(self, wanted: np.ndarray, dt: float) -> None:
        """Move the commanded base on towards a wanted twist ``(3,)``."""
        self.base.advance(wanted, dt)

    def command(self, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return the wheels' rates ``(4,)``, and set :attr:`steering`.

        Args:
            places: ``(4, 3)`` of the wheels' contacts in the base's axes.
            normals: ``(4, 3)`` of the ground there, likewise.
        """
        twist, positions = self.base.twist, self.base.positions
        off = self.keep_places * (positions - places[:, :2])
        moving = np.linalg.norm(wheel_velocities(twist, positions), axis=1).max() > _MOVING
        if moving:
            # Where the wheels are off course together, they are steered back.
            course = np.array([*off.mean(axis=0), (_cross(positions, off)).sum() / (positions**2).sum()])
            limit = _LARGEST_CORRECTION * np.abs(twist).max()
            twist = twist + np.clip(_COURSE_GAIN * course, -limit, limit)
            command = wheel_command(twist, positions, self.steering, self.base.backward)
            self.steering = command.steering
        else:
            self.steering = self.base.steering.copy()
        along = np.column_stack([np.cos(self.steering), np.sin(self.steering)])
        self._speed = (constraint_matrix(self.steering, positions) @ self.base.twist)[4:]
        self._haste = np.clip(_PLACE_GAIN * (off * along).sum(axis=1), -_LARGEST_HASTE, _LARGEST_HASTE)
        # Uphill the way is longer than it looks from above.
        rise = -(normals[:, :2] * along).sum(axis=1) / normals[:, 2]
        return (self._speed + self._haste) * np.hypot(1.0, rise) / WHEEL_RADIUS

    def ahead(self, places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where the wheels will be if the twist stays as it is, and the directions that they roll in.

        Args:
            places: ``(4, 3)`` of the wheels' middles now, in the base's axes.
            times: ``(n,)`` from now on.

        Returns:
            ``(n, 4, 2)`` in the world, and ``(n, 4, 2)``.
        """
        poses = np.array([moved(self.base.state[:3], self.base.twist, t) for t in times])
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        back = np.array([[cos, sin], [-sin, cos]]).transpose(2, 0, 1)
        along = np.column_stack([np.cos(self.steering), np.sin(self.steering)])
        return poses[:, None, :2] + places[:, :2] @ back, along @ back

    def velocities(self, places: np.ndarray, heights: np.ndarray, dt: float) -> np.ndarray:
        """Return how the wheels go, relative to the base's axes that go along with the twist.

        Haste is over as soon as the wheel is where it should be.

        Args:
            places: ``(4, 3)`` of the wheels' middles now, in the base's axes.
            heights: ``(n + 2, 4)`` of their middles, one time step before now first.
            dt: time step.

        Returns:
            ``(n, 4, 3)``.
        """
        along = np.column_stack([np.cos(self.steering), np.sin(self.steering)])
        fade = np.exp(-_PLACE_GAIN * dt * np.arange(len(heights) - 2))
        speeds = self._speed + fade[:, None] * self._haste
        level = speeds[:, :, None] * along - wheel_velocities(self.base.twist, places[:, :2])
        return np.dstack([level, (heights[2:] - heights[:-2]) / (2.0 * dt)])


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
