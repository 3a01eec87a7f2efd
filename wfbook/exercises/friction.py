"""Checks of chapter 4's exercises: friction cones."""

from collections.abc import Callable, Sequence

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.friction import friction_cone, friction_pyramid, rolling_friction, steepest_slope
from wfbook.modes import LEGS
from wfbook.standing import plane, stand
from wfbook.terrain import Region

MU = 0.35
"""Of the first exercise."""
BRAKE_MU, BRAKE_SLOPE = 0.4, np.radians(14.0)
"""Of :func:`brakes`."""
_CREEP = 0.01


def holds(feet: float, wheels_down: float, wheels_across: float) -> str:
    """Check three predicted angles, in degrees: how steep a slope may be until the robot moves.

    Args:
        feet: on four feet.
        wheels_down: on four free wheels that point down the slope.
        wheels_across: on four wheels that stand across it.
    """
    cases = (
        (feet, "feet", (MU, MU), 0.0, "what counts is the tangent, not the sine or the angle itself"),
        (wheels_down, "wheels_down", (0.0, MU), 0.0, "a free wheel gives no force along t at all"),
        (wheels_across, "wheels_across", (0.0, MU), np.pi / 2, "along its axle a wheel grips like a foot"),
    )
    for answer, name, coefficients, heading, hint in cases:
        angle = number(answer, name)
        truth = np.degrees(steepest_slope(*coefficients, heading))
        if abs(angle - truth) > 0.3:
            unit = " (degrees, not radians)" if truth and abs(np.degrees(angle) - truth) < 0.3 else ""
            raise WrongAnswer(f"{name}: {angle:g}° is not where it begins to move{unit or ': ' + hint}")
    return f"Right: atan μ = {np.degrees(np.arctan(MU)):.1f}° for what grips, and 0° for what rolls."


def admits(inside: Callable[[np.ndarray, Region, str], bool], cases: int = 400) -> str:
    """Check a function that tells whether a force in the world obeys Paper A, eq. 26, on a region.

    Args:
        inside: from a force ``(3,)`` in the world, a region and ``"foot"`` or ``"wheel"`` to yes or no.
        cases: how many random forces are tried.
    """
    random = draws(4)
    for case in range(cases):
        slope = np.radians(random.choice([0.0, 12.0, -20.0]))
        (region,) = plane(0.5, 0.0, slope).regions
        region = Region(region.vertices, 0.5, 0.1, 0.6, 0.0, "one")
        kind = ("foot", "wheel")[case % 2]
        mu_t, mu_b = (0.5, 0.5) if kind == "foot" else (0.1, 0.6)
        n = 50.0 * random.choice([-0.2, 0.5, 1.0])
        t, b = random.uniform(-1.5, 1.5, 2) * abs(n) * (mu_t, mu_b)
        margin = max(friction_pyramid(n, t, b, mu_t, mu_b))
        if abs(margin) < 1e-3:
            continue
        force = n * region.normal + t * region.tangent + b * region.binormal
        answer = called(inside, force, region, kind, name="inside")
        if not isinstance(answer, bool | np.bool_):
            raise WrongAnswer(f"inside returned {answer!r}, not True or False")
        if bool(answer) != (margin < 0):
            where = (
                f"a {kind} on a slope of {np.degrees(slope):.0f}°, n = {n:.0f}, t = {t:.0f}, b = {b:.0f} N"
            )
            raise WrongAnswer(
                f"{where}: {'refused' if margin < 0 else 'admitted'}, but {_why(n, t, b, mu_t, mu_b)}"
            )
    return f"Right: {cases} random forces, feet and wheels, on the level and on slopes."


def _why(n: float, t: float, b: float, mu_t: float, mu_b: float) -> str:
    """Name the side of the pyramid that a force breaks, or that there is none."""
    if n < 0:
        return "it pulls at the ground"
    if abs(t) > mu_t * n:
        return f"|t| is more than {mu_t} n"
    if abs(b) > mu_b * n:
        return f"|b| is more than {mu_b} n"
    return "it breaks no side of the pyramid (are n, t and b those of the region?)"


def resists(resistance: Callable[[float, float, float], float]) -> str:
    """Check a law of rolling resistance.

    Args:
        resistance: from normal force, coefficient and velocity along t to the force along t.
    """
    for n in (0.0, 20.0, 130.0):
        for c in (0.0, 0.005, 0.1):
            for velocity in (-1.0, -0.1, 0.2, 2.0):
                force = number(called(resistance, n, c, velocity, name="resistance"), "the force")
                case = f"n = {n:g} N, c = {c:g}, {velocity:g} m/s"
                if force * velocity > 1e-12:
                    raise WrongAnswer(
                        f"{case}: the force {force:g} N drives the wheel with {force * velocity:.2g} W; "
                        f"resistance only takes power"
                    )
                truth = rolling_friction(n, c, np.sign(velocity))
                if abs(force - truth) > 1e-9:
                    size = f"{abs(force):g} N, but it is {abs(truth):g} N"
                    raise WrongAnswer(f"{case}: {size}, however fast it rolls")
    at_rest = number(called(resistance, 100.0, 0.01, 0.0, name="resistance"), "the force")
    if abs(at_rest) > 1e-12:
        raise WrongAnswer(f"at rest on level ground nothing pushes: the force is {at_rest:g} N instead of 0")
    return "Right: it opposes rolling both ways, takes power and never gives any."


def brakes(legs: Sequence[str]) -> str:
    """Check which legs to put on their feet so that the robot, head down the slope, stays where it is.

    Args:
        legs: names of the legs on feet; the others stand on wheels. As few as possible.
    """
    if isinstance(legs, str) or not all(leg in LEGS for leg in legs) or len(set(legs)) != len(legs):
        raise WrongAnswer(f"{legs!r} is not a list of different legs, of {', '.join(LEGS)}")
    moved, short = _rolls_away(legs)
    names = " and ".join(legs) or "no leg"
    if moved > _CREEP:
        raise WrongAnswer(
            f"with {names} on foot the robot moves {100 * moved:.0f} cm in two seconds: along the slope the "
            f"ground gives {short:.2f} of its weight, and {np.sin(BRAKE_SLOPE):.2f} are needed"
        )
    for dropped in legs:
        fewer = [leg for leg in legs if leg != dropped]
        if _rolls_away(fewer)[0] <= _CREEP:
            raise WrongAnswer(f"it stays, but it would without {dropped} on its foot, too")
    return f"Right: {names} hold it, because the legs down the slope carry more than their share."


def _rolls_away(legs: Sequence[str]) -> tuple[float, float]:
    """Return how far the robot moves in two seconds, and the last force along the slope over its weight."""
    kinds = ["foot" if leg in legs else "wheel" for leg in LEGS]
    standing = stand(plane(BRAKE_MU, 0.0, BRAKE_SLOPE), kinds, 2.0)
    grip = float(np.mean(standing.grip[-50:])) * np.cos(BRAKE_SLOPE)
    return float(standing.distance[-1]), grip


def safe(pyramid: Callable[[float, int], np.ndarray]) -> str:
    """Check a pyramid with any number of sides inside of the friction cone.

    Args:
        pyramid: from μ and the number of sides to rows ``(sides, 3)`` along n, t, b: a force is admitted if
            no row times the force is positive.
    """
    random = draws(5)
    for mu, sides in ((0.7, 4), (0.4, 8), (0.25, 5), (1.0, 16)):
        rows = array(called(pyramid, mu, sides, name="pyramid"), (sides, 3), "the rows")
        case = f"μ = {mu}, {sides} sides"
        if (rows @ [1.0, 0.0, 0.0] >= 0.0).any():
            side = int(np.argmax(rows @ [1.0, 0.0, 0.0]))
            raise WrongAnswer(f"{case}: side {side} refuses a force straight along n")
        angle = random.uniform(0.0, 2 * np.pi, 4000)
        around = np.column_stack([np.cos(angle), np.sin(angle)])
        # How far the pyramid reaches in each direction at n = 1: the nearest side ends it.
        slant = rows[:, 1:] @ around.T
        with np.errstate(divide="ignore"):
            reach = np.where(slant > 1e-12, -rows[:, :1] / np.maximum(slant, 1e-12), np.inf).min(axis=0)
        far = int(reach.argmax())
        t, b = min(reach[far], 1e3) * around[far]
        if friction_cone(1.0, t, b, mu, mu) > 1e-6:
            times = f"{np.hypot(t, b) / mu:.2f} times what the cone does"
            raise WrongAnswer(f"{case}: it admits t = {t:.2f} n, b = {b:.2f} n, {times}")
        least = np.cos(np.pi / sides) * mu
        near = int(reach.argmin())
        if reach[near] < least - 1e-3:
            raise WrongAnswer(
                f"{case}: at {np.degrees(angle[near]):.0f}° it ends at {reach[near]:.3f} n; "
                f"a regular pyramid with its edges on the cone reaches {least:.3f} n at least"
            )
    return "Right: it never promises what the ground does not give, and wastes as little as its sides allow."
