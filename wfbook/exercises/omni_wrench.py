"""Checks of chapter 10's exercises: contact wrench cones and areas of support."""

from collections.abc import Callable

import numpy as np

from wfbook.centroidal import GRAVITY
from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.omni.robot import WHEEL_POSITIONS
from wfbook.omni.support import Contact, axes_on, balance, gravity_wrench, zmp
from wfbook.omni.tipping import WIDTH, strongest_push
from wfbook.omni.wrench import (
    decoupled,
    line_contact,
    line_ends,
    penalty,
    penalty_derivatives,
    point_contact,
    wrench_of,
)

MASS, HEIGHT, MU = 38.0, 0.45, 0.8
"""Of the robot of the first exercise: mass, height of the centre of mass, and the wheels' friction."""
LEAN_COM, WALL, LEAN_MU, HAND_MU = np.array([0.42, 0.0, 0.45]), 0.8, 0.25, 0.2
"""Of the last: centre of mass, where the wall is, friction of the wheels and of the hand."""


def tips(push: float) -> str:
    """Check how hard a robot may be pushed from the side at its centre of mass, in N, until wheels lift."""
    answer = number(push, "push")
    com, half = np.array([0.0, 0.0, HEIGHT]), WHEEL_POSITIONS[0, 1]
    truth = strongest_push(_wheels(MU), com, com, MASS * GRAVITY, np.pi / 2)
    if abs(answer - truth) > 0.02 * truth:
        known = {
            MASS * GRAVITY * half / HEIGHT: "that is where a wheel would lift that touches in a point; "
            "a line ends half its width further out",
            MASS * GRAVITY * 2 * half / HEIGHT: "the lever of the weight is half of the track, not all of it",
            MASS * GRAVITY * MU: "that is where the wheels would slide",
            truth / GRAVITY: "the weight is a force, in newtons",
        }
        for value, hint in known.items():
            if abs(answer - value) < 0.02 * value:
                raise WrongAnswer(f"push: {answer:g} N: {hint}")
        more = "wheels have lifted before" if answer > truth else "all wheels still press"
        raise WrongAnswer(
            f"push: at {answer:g} N {more}: compare the moments about the line that it tips over"
        )
    return f"Right: at {truth:.0f} N the zero-moment point is at the outer ends of the left wheels' lines."


def admits(inside: Callable[[np.ndarray, float, float], bool], cases: int = 400) -> str:
    """Check a function that tells whether a wheel's line can give a wrench.

    Args:
        inside: from a wrench ``(6,)``, μ and the width to yes or no.
        cases: how many random wrenches are tried.
    """
    random = draws(10)
    for case in range(cases):
        mu, width = random.uniform(0.3, 1.0), random.uniform(0.02, 0.08)
        press = random.exponential(60.0, 2)
        share = random.uniform(-1.4, 1.4, (2, 2))
        if case % 3 == 0:
            share = np.clip(share, -0.98, 0.98)
        wrench = wrench_of(line_ends(width), np.column_stack([mu * press[:, None] * share, press]))
        if case % 7 == 0:
            wrench[3] *= 1.5
        if case % 11 == 0:
            wrench[4] = 2.0
        cone = line_contact(mu, width)
        if np.abs(cone.residual(wrench)[cone.residual(wrench) != 0.0]).min() < 1e-2:
            continue
        answer = called(inside, wrench, mu, width, name="inside")
        if not isinstance(answer, bool | np.bool_):
            raise WrongAnswer(f"inside returned {answer!r}, not True or False")
        if bool(answer) != bool(cone.admits(wrench)):
            where = f"μ = {mu:.2f}, w = {100 * width:.1f} cm, f = {wrench.round(2).tolist()}"
            raise WrongAnswer(f"{where}: {_why(wrench, mu, width, bool(answer))}")
    return f"Right: {cases} wrenches, made of forces at the ends, inside and outside of their pyramids."


def _why(wrench: np.ndarray, mu: float, width: float, admitted: bool) -> str:
    """Say which row an answer overlooked, or that there is none."""
    broken = line_contact(mu, width).broken(wrench)
    if not admitted:
        return "refused, but both ends press and stay in their friction pyramids"
    box = decoupled(mu, (width / 2, 0.0, mu * width / 2)).admits(wrench)
    hint = "; each moment alone is small enough, but not together with the forces" if box else ""
    return f"admitted, but it breaks {broken[0]}{hint}"


def charges(alpha: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[float, np.ndarray]]) -> str:
    """Check a penalty on broken rows (Paper B, eqs 8 and 9) and its gradient.

    Args:
        alpha: from ``A (m, 6)``, ``b (m,)`` and a wrench ``(6,)`` to the penalty and its gradient ``(6,)``.
    """
    random = draws(9)
    cone = line_contact(0.6, 0.05)
    for case in range(60):
        wrench = random.normal(size=6) * [60, 60, 40, 2, 0.5, 1] + [0, 0, 80, 0, 0, 0]
        if case % 5 == 0:
            wrench = wrench_of(line_ends(0.05), np.array([[10.0, 5.0, 60.0], [-5.0, 8.0, 50.0]]))
        answer = called(alpha, cone.A, cone.b, wrench, name="alpha")
        if not isinstance(answer, tuple | list) or len(answer) != 2:
            raise WrongAnswer("alpha returns two things: the penalty and its gradient")
        value, gradient = number(answer[0], "the penalty"), array(answer[1], (6,), "the gradient")
        residual = cone.residual(wrench)
        truth, slope = float(penalty(residual)), penalty_derivatives(cone, wrench)[0]
        if not (residual > 0.0).any() and value != 0.0:
            raise WrongAnswer(f"a wrench inside of the cone costs {value:.3g}, but no row is broken")
        if abs(value - truth) > 1e-6 * (1.0 + truth):
            count = int((residual > 0.0).sum())
            literal = 0.5 * float(residual @ residual)
            hint = (
                "rows that hold are charged, too"
                if abs(value - literal) < 1e-6 * literal
                else "half of the sum of their squares, each row for itself"
            )
            raise WrongAnswer(f"{count} broken rows cost {value:.4g} instead of {truth:.4g}: {hint}")
        if np.abs(gradient - slope).max() > 1e-6 * (1.0 + np.abs(slope).max()):
            axis = int(np.abs(gradient - slope).argmax())
            raise WrongAnswer(
                f"the penalty is right, but its slope along component {axis} is {slope[axis]:.4g}, "
                f"not {gradient[axis]:.4g}: what does a row's residual change by?"
            )
    return "Right: nothing inside, half the squares of what is broken outside, and a gradient to go back by."


def finds(point: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> str:
    """Check a function that finds the zero-moment point of forces anywhere, on the ground ``z = 0``.

    Args:
        point: from forces ``(n, 3)`` and the points ``(n, 3)`` where they act to x and y ``(2,)``.
    """
    random = draws(11)
    for level in (True, False):
        for _ in range(20):
            places = random.uniform(-0.5, 0.5, (5, 3))
            places[:, 2] = 0.0 if level else np.abs(places[:, 2])
            forces = random.normal(size=(5, 3)) * [10, 10, 5] + [0, 0, 60]
            answer = array(called(point, forces, places, name="point"), (2,), "the point")
            truth = zmp(np.concatenate([forces.sum(axis=0), np.cross(places, forces).sum(axis=0)]))
            if np.abs(answer - truth).max() < 1e-6:
                continue
            pressure = forces[:, 2] @ places[:, :2] / forces[:, 2].sum()
            if np.abs(answer - pressure).max() < 1e-6:
                hint = (
                    "that is the mean of the places, weighted by the normal forces: right on level ground, "
                )
                raise WrongAnswer(hint + "but here some forces act above it and push sideways")
            at = np.append(answer, 0.0)
            left = np.cross(places - at, forces).sum(axis=0)
            raise WrongAnswer(
                f"about your point the moment is ({left[0]:.1f}, {left[1]:.1f}) N m along x and y, not zero"
            )
    return "Right: about it no horizontal moment is left, with the hand on a wall or on the ground."


def leans(height: float) -> str:
    """Check the lowest place of a hand on a wall that lets the robot lean, in m, to within 2 cm."""
    answer = number(height, "height")
    if not 0.05 <= answer <= 1.2:
        raise WrongAnswer(f"height: {answer:g} m is not where the arm reaches the wall (0.05 to 1.2 m)")
    low, high = 0.05, 1.2
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _held(middle) else (middle, high)
    if answer < high - 0.005:
        raise WrongAnswer(
            f"height: at {answer:.3g} m no forces in the cones balance the robot: the lower the hand, the "
            "harder it has to push, and the wheels must hold against that"
        )
    if answer > high + 0.02:
        raise WrongAnswer(f"height: at {answer:.3g} m it holds, but it also does a little lower")
    return f"Right: from {high:.2f} m on the hand pushes so little that wheels on μ = {LEAN_MU} can hold it."


def _held(height: float) -> bool:
    """Whether the leaning robot is in balance with its hand on the wall at a height."""
    hand = Contact(np.array([WALL, 0.0, height]), axes_on((-1.0, 0.0, 0.0)), point_contact(HAND_MU))
    return balance([*_wheels(LEAN_MU), hand], gravity_wrench(LEAN_COM)) is not None


def _wheels(mu: float) -> list[Contact]:
    """Four wheels in the nominal posture that point ahead."""
    cone, axes = line_contact(mu, WIDTH), axes_on((0.0, 0.0, 1.0))
    return [Contact(np.array([x, y, 0.0]), axes, cone) for x, y in WHEEL_POSITIONS]
