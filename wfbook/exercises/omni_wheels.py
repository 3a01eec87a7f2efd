"""Checks of chapter 9's exercises: steered wheels."""

from collections.abc import Callable

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, draws
from wfbook.modes import LEGS
from wfbook.omni.robot import WHEEL_POSITIONS, WHEEL_RADIUS
from wfbook.omni.wheels import (
    body_twist,
    connection,
    crab,
    moved,
    rotation,
    wheel_command,
    wheel_velocities,
    wrap,
)

OBJECT = np.array([1.0, 0.0])
"""What :func:`orbits` drives round, in the body's axes."""
FASTEST = 0.8
LONGEST = 3.0
_TWISTS = {
    "driving straight": crab(0.6, 0.0),
    "crabbing": crab(0.6, 0.7),
    "turning in place": rotation(1.0),
}


def ranks(answer: tuple[int, int, int]) -> str:
    """Check the ranks of the connection A when driving straight, crabbing and turning in place."""
    numbers = array(answer, (3,), "ranks")
    for rank, (name, twist) in zip(numbers, _TWISTS.items(), strict=True):
        steering = wheel_command(twist, WHEEL_POSITIONS, np.zeros(4)).steering
        truth = int(np.linalg.matrix_rank(connection(steering, WHEEL_POSITIONS, WHEEL_RADIUS), tol=1e-9))
        if rank == truth:
            continue
        if truth == 2:
            hint = "the wheels are parallel: spin them as you like, can they move the body across?"
            if rank == 1:
                hint = "opposite spins left and right turn the body, though the wheels skid"
        else:
            hint = "the rank counts what spins make in the mean, skidding included, not what rolls cleanly"
        raise WrongAnswer(f"{name}: not {rank:g}. Think of the four columns that spin a wheel each; {hint}")
    return "Right: with parallel wheels no spins move the body across them. They have to steer first."


def nears(nearer: Callable[[float, float], tuple[float, float]], cases: int = 400) -> str:
    """Check a function that finds the nearer way to steer, forward or backward (Paper B, eq. 14).

    Args:
        nearer: from the desired direction and the present angle, any real numbers, to the new angle and a
            sign: 1 forward, -1 backward.
        cases: how many random pairs are tried.
    """
    random = draws(9)
    pairs = [(np.radians(179.0), np.radians(-179.0)), (3.0, -3.0), (0.1, 6.0 * np.pi), (-2.0, 2.5)]
    pairs += [tuple(pair) for pair in random.uniform(-10.0, 10.0, (cases, 2))]
    for desired, current in pairs:
        answer = called(nearer, float(desired), float(current), name="nearer")
        angle, sign = array(answer, (2,), "what nearer returns")
        case = f"desired {np.degrees(desired):.0f}°, present {np.degrees(current):.0f}°"
        if sign not in (1.0, -1.0):
            raise WrongAnswer(f"{case}: the sign is {sign:g}, neither 1 nor -1")
        rolls = sign * np.array([np.cos(angle), np.sin(angle)])
        wanted = np.array([np.cos(desired), np.sin(desired)])
        if np.linalg.norm(rolls - wanted) > 1e-6:
            where = np.degrees(np.arctan2(rolls[1], rolls[0]))
            raise WrongAnswer(
                f"{case}: at {np.degrees(angle):.0f}° with sign {sign:g} it rolls to {where:.0f}°"
            )
        turn = np.degrees(angle - current)
        if abs(turn) > 90.0 + 1e-6:
            hint = "the angle is right up to whole turns, but a motor would turn all of them"
            if abs(np.degrees(wrap(angle - current))) > 90.0 + 1e-6:
                hint = "compare the angles after bringing their difference between -180° and 180°"
            raise WrongAnswer(f"{case}: it turns by {turn:.0f}°; {hint}")
    return f"Right: {len(pairs)} pairs, no turn beyond a quarter."


def measures(odometry: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray], cases: int = 50) -> str:
    """Check a function that says from the wheels how the body moves.

    Args:
        odometry: from steering angles ``(n,)``, speeds ``(n,)`` and positions ``(n, 2)`` to the twist.
        cases: how many random bases are tried.
    """
    random = draws(10)
    for case in range(cases):
        n = 4 if case < cases // 2 else int(random.integers(2, 7))
        positions = WHEEL_POSITIONS if n == 4 else random.normal(size=(n, 2))
        twist = random.normal(size=3)
        command = wheel_command(twist, positions, random.uniform(-9.0, 9.0, n))
        found = called(odometry, command.steering, command.speed, positions.copy(), name="odometry")
        found = array(found, (3,), "the twist")
        wrong = np.abs(found - twist)
        if wrong.max() > 1e-6:
            part = ("v_x", "v_y", "omega")[int(wrong.argmax())]
            hint = ""
            if np.allclose(found[:2], twist[:2], atol=1e-6):
                hint = "; a turn moves each wheel by omega J r"
            value = found[wrong.argmax()]
            raise WrongAnswer(f"{n} wheels, twist {np.round(twist, 2).tolist()}: {part} is {value:.2f}{hint}")
    if fault := _contradictory(odometry):
        raise WrongAnswer(fault)
    return "Right, and where the wheels contradict each other it is the best fit."


def _contradictory(odometry: Callable) -> str:
    """Say what is wrong when one wheel spins faster than the others, or nothing."""
    steering, speed = np.zeros(4), np.array([1.0, 1.0, 1.0, 2.0])
    found = called(odometry, steering, speed, WHEEL_POSITIONS.copy(), name="odometry")
    found = array(found, (3,), "the twist")
    best, _ = body_twist(steering, speed, WHEEL_POSITIONS)
    if np.abs(found - best).max() > 1e-6:
        return (
            f"all straight, the {LEGS[3]} wheel at 2 m/s and the others at 1: the best fit is "
            f"{np.round(best, 2).tolist()}, yours {np.round(found, 2).tolist()}; "
            "use all eight rows, also those that say 0"
        )
    return ""


def orbits(twist: np.ndarray) -> str:
    """Check the design of a quarter turn round an object while facing it: path, heading, wheels, time."""
    twist = array(twist, (3,), "twist")
    if abs(twist[2]) < 1e-6:
        raise WrongAnswer("it does not turn, so it can't go on facing the object")
    duration = 0.5 * np.pi / abs(twist[2])
    for t in np.linspace(0.0, duration, 31):
        pose = moved(np.zeros(3), twist, float(t))
        ahead = np.array([np.cos(pose[2]), np.sin(pose[2])])
        to_object = OBJECT - pose[:2]
        distance = np.linalg.norm(to_object)
        if abs(distance - 1.0) > 0.01:
            raise WrongAnswer(f"after {t:.1f} s it is {distance:.2f} m from the object instead of 1 m")
        off = np.degrees(np.arctan2(ahead[0] * to_object[1] - ahead[1] * to_object[0], ahead @ to_object))
        if abs(off) > 1.0:
            raise WrongAnswer(f"after {t:.1f} s it faces {off:.0f}° past the object")
    speeds = np.linalg.norm(wheel_velocities(twist, WHEEL_POSITIONS), axis=1)
    worst = int(speeds.argmax())
    if speeds[worst] > FASTEST + 1e-9:
        raise WrongAnswer(
            f"the {LEGS[worst]} wheel rolls at {speeds[worst]:.2f} m/s, more than {FASTEST} m/s"
        )
    if duration > LONGEST:
        raise WrongAnswer(f"a quarter turn takes {duration:.1f} s, more than {LONGEST:g} s")
    return f"Right: round it in {duration:.1f} s, the {LEGS[worst]} wheel at {speeds[worst]:.2f} m/s."
