"""Chapter 9: how four steered, driven wheels move a body (Paper B, eqs 12–15 and 22).

A twist is what the body does: ``(v_x, v_y, omega)``, the velocity of the middle of its wheels in the body's
own axes and its yaw rate. A wheel stands at ``positions[i]`` in the same axes, is steered by an angle from
straight ahead, and rolls with a speed along that direction. Nothing here knows a mode: driving straight,
crabbing, turning about the middle or about anything else are twists (:func:`twist_about`, :func:`crab`).
"""

from dataclasses import dataclass

import numpy as np

J = np.array([[0.0, -1.0], [1.0, 0.0]])
"""A quarter turn to the left."""

REST_SPEED = 1e-3
"""A wheel that is to be slower than this keeps its steering angle: its direction would be noise."""

HYSTERESIS = np.radians(10.0)
"""By how much more than a quarter turn a wheel turns before it changes between forward and backward."""


def wheel_velocities(twist: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return the velocities ``(n, 2)`` of the wheels' middles in the body's axes (Paper B, eq. 12).

    Args:
        twist: ``(3,)`` v_x, v_y, omega.
        positions: ``(n, 2)`` of the wheels.

    Example:
        >>> from wfbook.omni.wheels import rotation, wheel_velocities
        >>> wheel_velocities(rotation(2.0), np.array([[0.3, 0.2]])).tolist()
        [[-0.4, 0.6]]
    """
    twist = np.asarray(twist, dtype=float)
    return twist[:2] + twist[2] * np.asarray(positions) @ J.T


def twist_about(centre: np.ndarray, rate: float) -> np.ndarray:
    """Return the twist ``(3,)`` that turns about a point ``(2,)`` of the body with a yaw rate."""
    return np.array([*(-rate * J @ centre), rate])


def instantaneous_centre(twist: np.ndarray) -> np.ndarray | None:
    """Return the point ``(2,)``, of the body that a twist ``(3,)`` turns about; None if it does not turn.

    Example:
        >>> from wfbook.omni.wheels import crab, instantaneous_centre, twist_about
        >>> instantaneous_centre(twist_about(np.array([0.4, -0.1]), 0.8)).round(9).tolist()
        [0.4, -0.1]
        >>> instantaneous_centre(crab(0.6, 0.3)) is None
        True
    """
    return None if twist[2] == 0.0 else J @ twist[:2] / twist[2]


def crab(speed: float, angle: float) -> np.ndarray:
    """Return the twist of driving at an angle to straight ahead without turning: all wheels parallel."""
    return np.array([speed * np.cos(angle), speed * np.sin(angle), 0.0])


def ackermann(speed: float, radius: float, rear: float) -> np.ndarray:
    """Return the twist of a car: it turns about a point on the line of its rear axle.

    Args:
        speed: of the rear axle's middle, ahead.
        radius: of its path, to the left; negative to the right.
        rear: x of the rear axle, negative.
    """
    return twist_about(np.array([rear, radius]), speed / radius)


def pivot(speed: float, radius: float) -> np.ndarray:
    """Return the twist of a turn with front and rear wheels steered against each other.

    The centre is beside the body's middle, to the left by ``radius``. With a radius that goes to zero, and
    the speed with it, this is :func:`rotation`.
    """
    return twist_about(np.array([0.0, radius]), speed / radius)


def rotation(rate: float) -> np.ndarray:
    """Return the twist of turning about the body's middle."""
    return twist_about(np.zeros(2), rate)


def wrap(angles: np.ndarray | float) -> np.ndarray:
    """Return angles brought between -pi (included) and pi by whole turns.

    Example:
        >>> from wfbook.omni.wheels import wrap
        >>> float(np.degrees(wrap(np.radians(179.0 - -179.0))).round(9))
        -2.0
    """
    return (np.asarray(angles) + np.pi) % (2.0 * np.pi) - np.pi


def steering_directions(velocities: np.ndarray) -> np.ndarray:
    """Return the directions ``(n,)`` of velocities ``(n, 2)`` (Paper B, eq. 13).

    Not as printed: the paper calls them optimal. They are the desired angles of eq. 14, which finds the
    optimal.
    """
    return np.arctan2(velocities[:, 1], velocities[:, 0])


def shorter_turns(
    desired: np.ndarray,
    current: np.ndarray,
    backward: np.ndarray | None = None,
    hysteresis: float = HYSTERESIS,
) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much to turn each wheel, forward or backward, whichever is nearer (Paper B, eq. 14).

    Not as printed: the paper compares angles without wrapping them: 179° and -179° are 358° apart, so it
    reverses a wheel that is 2° from where it should be. Here differences are wrapped first.

    A wheel at a quarter turn from its direction could change its mind with every bit of noise; so one that
    goes backward or forward already stays with it until that costs a quarter turn *and* ``hysteresis``.

    Args:
        desired: ``(n,)`` directions of the wheels' velocities.
        current: ``(n,)`` steering angles, not wrapped.
        backward: ``(n,)`` bool, whether the wheel rolls backward so far; None if it does not matter.
        hysteresis: angle.

    Returns:
        ``(n,)`` turns, and ``(n,)`` bool, whether it rolls backward then.
    """
    forth = wrap(np.asarray(desired) - current)
    back = wrap(forth + np.pi)
    if backward is None:
        return np.where(np.abs(forth) <= np.abs(back), forth, back), np.abs(forth) > np.abs(back)
    stay = np.where(backward, back, forth)
    reverse = np.abs(stay) > np.pi / 2 + hysteresis
    now = np.asarray(backward) != reverse
    return np.where(now, back, forth), now


@dataclass(frozen=True)
class WheelCommand:
    """What each wheel is told (Paper B, eq. 15).

    Attributes:
        steering: ``(n,)`` angles, beside the present ones: not wrapped.
        speed: ``(n,)`` along the steered direction; negative backward.
        backward: ``(n,)`` bool, the memory of the hysteresis.
    """

    steering: np.ndarray
    speed: np.ndarray
    backward: np.ndarray

    def spin(self, radius: float) -> np.ndarray:
        """Return the wheels' angular velocities ``(n,)``: pure rolling on this radius."""
        return self.speed / radius


def wheel_command(
    twist: np.ndarray,
    positions: np.ndarray,
    steering: np.ndarray,
    backward: np.ndarray | None = None,
    hysteresis: float = HYSTERESIS,
    rest_speed: float = REST_SPEED,
) -> WheelCommand:
    """Return steering angles and speeds that give the body a twist (Paper B, eq. 15).

    Every wheel gets exactly the velocity that the twist has at its place, whatever the twist. A wheel that
    is to stand holds its angle: eq. 13 has no direction for it, and atan2(0, 0) = 0 would swing it straight
    ahead.

    Args:
        twist: ``(3,)`` v_x, v_y, omega.
        positions: ``(n, 2)`` of the wheels.
        steering: ``(n,)`` present steering angles.
        backward: ``(n,)`` bool, which wheels roll backward so far; None: no hysteresis.
        hysteresis: see :func:`shorter_turns`.
        rest_speed: below it a wheel holds its angle and stands.
    """
    velocities = wheel_velocities(twist, positions)
    speed = np.linalg.norm(velocities, axis=1)
    turns, back = shorter_turns(steering_directions(velocities), steering, backward, hysteresis)
    moving = speed >= rest_speed
    before = np.zeros(len(speed), bool) if backward is None else np.asarray(backward)
    return WheelCommand(
        steering=steering + np.where(moving, turns, 0.0),
        speed=np.where(moving, np.where(back, -speed, speed), 0.0),
        backward=np.where(moving, back, before),
    )


def constraint_matrix(steering: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return S ``(2n, 3)``: sideways, then rolling speeds of the wheels from a twist (Paper B, eq. 22).

    ``S @ twist`` is ``[0, speed]`` where nothing skids and all wheels roll. The upper half are the sideways
    rows.

    Not as printed: the paper's twist is ``(ω, v)`` above the matrix and ``(v, ω)`` beside it. Here it is
    ``(v_x, v_y, ω)`` throughout.
    """
    cos, sin = np.cos(steering), np.sin(steering)
    along, across = np.column_stack([cos, sin]), np.column_stack([-sin, cos])
    turning = np.asarray(positions) @ J.T
    return np.vstack(
        [np.column_stack([e, np.sum(e * turning, axis=1)]) for e in (across, along)],
    )


def body_twist(
    steering: np.ndarray, speed: np.ndarray, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the twist that fits the wheels best, and how much they skid (Paper B, appendix).

    Args:
        steering: ``(n,)`` angles.
        speed: ``(n,)`` along them, radius times spin.
        positions: ``(n, 2)``.

    Returns:
        ``(3,)`` twist by the pseudo-inverse, and ``(n, 2)`` the wheels' skid sideways and along: zero if
        they are steered and driven for one and the same twist.

    Example:
        The wheels' angles and speeds give back the twist that they were made from:

        >>> from wfbook.omni.robot import WHEEL_POSITIONS
        >>> from wfbook.omni.wheels import body_twist, wheel_command
        >>> command = wheel_command(np.array([0.5, 0.2, 0.8]), WHEEL_POSITIONS, np.zeros(4))
        >>> twist, skid = body_twist(command.steering, command.speed, WHEEL_POSITIONS)
        >>> twist.round(9).tolist(), bool(np.abs(skid).max() < 1e-12)
        ([0.5, 0.2, 0.8], True)
    """
    S = constraint_matrix(steering, positions)
    wanted = np.concatenate([np.zeros(len(speed)), speed])
    twist = np.linalg.pinv(S) @ wanted
    return twist, (S @ twist - wanted).reshape(2, -1).T


def connection(steering: np.ndarray, positions: np.ndarray, radius: float) -> np.ndarray:
    """Return A(r) ``(3, 2n)`` with twist = -A (steering rates, spins) (Paper B, appendix).

    Its first n columns are zero: turning a wheel about its own middle moves nothing. The paper's proof ends
    with rank three from rank S = 3 and rank B = 4, from which it follows only that it is *at most* three.
    It is, for most steering angles; but with all wheels parallel, which is driving straight and crabbing,
    it is two: no spins move the body across the wheels. And rank three is not yet freedom: see
    :func:`free_twists`.
    """
    n = len(positions)
    B = np.diag(np.concatenate([np.zeros(n), np.full(n, radius)]))
    return -np.linalg.pinv(constraint_matrix(steering, positions)) @ B


def free_twists(steering: np.ndarray, positions: np.ndarray, tolerance: float = 1e-9) -> np.ndarray:
    """Return the twists ``(k, 3)`` that no wheel skids sideways for: k = 1 when all axles meet in a point.

    k = 0 when they don't: then the body can't move at all. That is why wheels steer first.
    """
    sideways = constraint_matrix(steering, positions)[: len(positions)]
    _, size, directions = np.linalg.svd(sideways)
    return directions[int(np.sum(size > tolerance)) :]


def moved(pose: np.ndarray, twist: np.ndarray, duration: float) -> np.ndarray:
    """Return the pose ``(3,)`` x, y, yaw after a constant twist: an arc about the instantaneous centre."""
    yaw = pose[2] + 0.5 * duration * twist[2]
    # An arc's chord points where the body heads half way; it is shorter than the arc by sinc.
    chord = duration * np.sinc(0.5 * duration * twist[2] / np.pi)
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y = np.array([[cos, -sin], [sin, cos]]) @ twist[:2] * chord
    return pose + np.array([x, y, duration * twist[2]])


def accelerated(state: np.ndarray, acceleration: np.ndarray, duration: float) -> np.ndarray:
    """Return Paper B's X_SW ``(6,)``, pose and twist, after a constant U_SW ``(3,)`` for a short time.

    The acceleration is of the twist's components, in the body's axes. The pose follows the mean twist.
    """
    twist = state[3:] + duration * np.asarray(acceleration)
    return np.concatenate([moved(state[:3], 0.5 * (state[3:] + twist), duration), twist])
