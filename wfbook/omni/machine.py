"""Chapter 12: the mode state machine: which mode the robot is in, and when it may change (Paper B, Fig. 5).

A task says which mode it needs. The machine gets there safely: before wheels are locked the base must be at
rest, with its wheels steered straight ahead, and brakes must have closed; before they roll again all four
must stand and the trunk be at rest. Nothing here knows how the robot moves: :func:`advance` is a pure
function of the mode, what the task needs, and what is observed. Wheel kinematics have no modes at all.
"""

from dataclasses import dataclass
from enum import IntEnum


class Mode(IntEnum):
    """Modes of the robot; a run's ``mode`` holds these numbers.

    Two are the paper's, and drive or walk. The others are on the way, or the end.
    """

    WHEELED = 0
    STOPPING = 1
    ALIGNING = 2
    LOCKING = 3
    LEGGED = 4
    RELEASING = 5
    HALTED = 6


ON_LEGS = frozenset({Mode.LOCKING, Mode.LEGGED, Mode.RELEASING})
"""Modes in which wheels and steering are locked."""


@dataclass(frozen=True)
class Observed:
    """What the machine looks at.

    Attributes:
        base_speed: fastest that any wheel is to roll by the commanded twist, m/s.
        wheel_speed: fastest that any wheel turns, rad/s.
        steering_error: largest angle of a wheel from straight ahead, rad.
        trunk_speed: of the trunk, m/s.
        standing: whether all four wheels stand.
        fault: whether something went wrong.
    """

    base_speed: float = 0.0
    wheel_speed: float = 0.0
    steering_error: float = 0.0
    trunk_speed: float = 0.0
    standing: bool = True
    fault: bool = False


@dataclass(frozen=True)
class Thresholds:
    """When something counts as done.

    Attributes:
        base_speed: at rest, m/s.
        wheel_speed: stopped, rad/s.
        steering_error: aligned, rad.
        trunk_speed: at rest, m/s.
        dwell: how long conditions must have held before the mode changes, s.
    """

    base_speed: float = 1e-3
    wheel_speed: float = 0.3
    steering_error: float = 0.03
    trunk_speed: float = 0.05
    dwell: float = 0.1


@dataclass(frozen=True)
class State:
    """Of the machine: its mode, and for how long what ends it has been true, s."""

    mode: Mode = Mode.WHEELED
    ready: float = 0.0


def ready(mode: Mode, wants_legs: bool, seen: Observed, limits: Thresholds) -> Mode:
    """Return the mode that conditions allow next, or the same one."""
    rests = seen.base_speed <= limits.base_speed and seen.wheel_speed <= limits.wheel_speed
    still = rests and seen.trunk_speed <= limits.trunk_speed and seen.standing
    aligned = seen.steering_error <= limits.steering_error
    match mode:
        case Mode.WHEELED if wants_legs:
            return Mode.STOPPING
        case Mode.STOPPING | Mode.ALIGNING | Mode.LOCKING if not wants_legs:
            return Mode.WHEELED
        case Mode.STOPPING if still:
            return Mode.ALIGNING
        case Mode.ALIGNING if still and aligned:
            return Mode.LOCKING
        case Mode.LOCKING if still and aligned:
            return Mode.LEGGED
        case Mode.LEGGED if not wants_legs and still:
            return Mode.RELEASING
        case Mode.RELEASING if wants_legs:
            return Mode.LOCKING
        case Mode.RELEASING if still:
            return Mode.WHEELED
    return mode


def advance(
    state: State, wants_legs: bool, seen: Observed, dt: float, limits: Thresholds | None = None
) -> State:
    """Return the machine's state a little later.

    Args:
        state: now.
        wants_legs: whether the task needs legged mode.
        seen: what is observed.
        dt: since the last call, s.
        limits: by default :class:`Thresholds`.
    """
    if seen.fault or state.mode == Mode.HALTED:
        return State(Mode.HALTED)
    limits = Thresholds() if limits is None else limits
    following = ready(state.mode, wants_legs, seen, limits)
    if following == state.mode:
        return State(state.mode)
    # What a task asks for is heard at once; what is measured must last.
    asked = (state.mode, following) in _AT_ONCE
    if asked or state.ready + dt >= limits.dwell - 1e-9:
        return State(following)
    return State(state.mode, state.ready + dt)


_AT_ONCE = {
    (Mode.WHEELED, Mode.STOPPING),
    (Mode.STOPPING, Mode.WHEELED),
    (Mode.ALIGNING, Mode.WHEELED),
    (Mode.LOCKING, Mode.WHEELED),
    (Mode.RELEASING, Mode.LOCKING),
}
