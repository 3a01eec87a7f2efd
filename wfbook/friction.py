"""Chapter 4: what force a foot or a wheel may apply (Paper A, eqs 26 and 29).

A contact's force is written in the basis of its region: ``n`` along the normal, ``t`` along the
rolling direction, ``b`` across it. A foot grips both ways; a wheel grips across but rolls along.

The arguments of :func:`friction_pyramid` and :func:`rolling_friction` are NumPy arrays or CVXPY expressions:
the same lines state the planner's constraints and check its answer. Which of them hold, D says (eqs 27 and
28): that is the planner's. The rest tells what they give away.
"""

from typing import Any

import numpy as np


def friction_pyramid(n: Any, t: Any, b: Any, mu_t: float, mu_b: float) -> list[Any]:
    """Return the sides of the linearised friction cone (Paper A, eq. 26).

    Args:
        n: normal force of the contacts, any shape.
        t: force along the rolling direction, the same shape.
        b: force across it, the same shape.
        mu_t: friction coefficient along ``t``. A free wheel's is near zero.
        mu_b: friction coefficient along ``b``.

    Returns:
        Five expressions that are all ``<= 0`` exactly when the force is inside the pyramid.
    """
    return [-n, t - mu_t * n, -t - mu_t * n, b - mu_b * n, -b - mu_b * n]


def friction_cone(n: Any, t: Any, b: Any, mu_t: float, mu_b: float) -> np.ndarray:
    """Return how far forces are outside of the friction cone, which eq. 26 linearises.

    The cone is elliptic: ``(t / μ_t)² + (b / μ_b)² ≤ n²``. For equal coefficients it is Coulomb's.

    Args:
        n: normal force of the contacts, any shape.
        t: force along the rolling direction, the same shape.
        b: force across it, the same shape.
        mu_t: friction coefficient along ``t``.
        mu_b: friction coefficient along ``b``.

    Returns:
        A force of that shape, ``<= 0`` exactly when the force is inside the cone.

    Example:
        The pyramid of the same coefficients also holds what the cone forbids, both at once:

        >>> from wfbook.friction import friction_cone, friction_pyramid
        >>> inside = lambda rows: all(row <= 0.0 for row in np.atleast_1d(rows))
        >>> asked = (10.0, 6.0, 6.0, 0.7, 0.7)
        >>> inside(friction_pyramid(*asked)), inside(friction_cone(*asked))
        (True, False)
    """
    used = [
        np.abs(part) / mu if mu > 0 else np.where(np.asarray(part) == 0.0, 0.0, np.inf)
        for part, mu in ((t, mu_t), (b, mu_b))
    ]
    return np.hypot(*used) - n


def ground_force(asked: np.ndarray, mu_t: float, mu_b: float) -> np.ndarray:
    """Return what the ground gives of a force that a leg asks of it: along the ground, what the cone allows.

    A contact that slides feels friction against its sliding. Here it is taken to slide the way it is pushed.

    Args:
        asked: ``(3,)`` along n, t, b.
        mu_t: friction coefficient along ``t``.
        mu_b: friction coefficient across it.

    Returns:
        ``(3,)`` along n, t, b.

    Example:
        >>> from wfbook.friction import ground_force
        >>> ground_force(np.array([10.0, 8.0, 6.0]), 0.5, 0.5).round(6).tolist()
        [10.0, 4.0, 3.0]
    """
    n, t, b = np.asarray(asked, float)
    if n <= 0.0:
        return np.zeros(3)
    if mu_t == 0.0:
        return np.array([n, 0.0, np.clip(b, -mu_b * n, mu_b * n)])
    used = max(np.hypot(t / mu_t, b / mu_b) / n, 1.0)
    return np.array([n, t / used, b / used])


def inner_coefficient(mu: Any, sides: int = 4) -> Any:
    """Return the coefficient with which a regular pyramid lies inside of the friction cone of ``mu``.

    Each of its sides is ``cos(π / sides)`` nearer to the axis than its edges, and these are to lie on the
    cone: ``μ / √2`` for four sides. With ``mu`` itself the pyramid contains the cone, and its edges promise
    forces at which the contact slips.

    Args:
        mu: friction coefficient, any shape.
        sides: of the pyramid.
    """
    return np.cos(np.pi / sides) * mu


def support_on_slope(slope: float, heading: float = 0.0) -> tuple[float, float, float]:
    """Return the force ``(n, t, b)`` that holds a body of unit weight at rest on a slope.

    Args:
        slope: angle of the slope, rad.
        heading: of the way down, from ``t`` towards ``b``, rad. At 0 a wheel points straight down the slope,
            at π/2 it stands across.
    """
    uphill = -np.sin(slope)
    return float(np.cos(slope)), float(uphill * np.cos(heading)), float(uphill * np.sin(heading))


def steepest_slope(mu_t: float, mu_b: float, heading: float = 0.0, cone: bool = False) -> float:
    """Return the steepest slope on which the force of :func:`support_on_slope` is admissible, rad.

    Args:
        mu_t: friction coefficient along the rolling direction.
        mu_b: friction coefficient across it.
        heading: of the way down, as there.
        cone: ask the friction cone instead of the pyramid of eq. 26.

    Example:
        A slope is held up to the angle whose tangent is the coefficient of friction:

        >>> from wfbook.friction import steepest_slope
        >>> bool(np.isclose(np.tan(steepest_slope(0.7, 0.7, cone=True)), 0.7))
        True
    """
    along, across = abs(np.cos(heading)), abs(np.sin(heading))
    used = [part / mu if mu > 0 else np.inf for part, mu in ((along, mu_t), (across, mu_b)) if part > 1e-12]
    most = np.linalg.norm(used) if cone else max(used)
    return float(np.arctan(1.0 / most))


def rolling_friction(n: Any, coefficient: float, direction: Any = 1.0) -> Any:
    """Return the force along ``t`` that rolling resistance adds to a wheel (Paper A, eq. 29).

    Not as printed: with the paper's positive sign it would push the robot forward. Resistance opposes
    rolling, hence the minus. And ``‖n‖²`` is 1, for n is a unit vector.

    Args:
        n: normal force on the wheel, any shape.
        coefficient: of rolling resistance, dimensionless.
        direction: in which it rolls along ``t``, 1 or −1; the wheels of the planner roll forward. At rest the
            force is whatever holds the wheel, up to this much.
    """
    return -coefficient * direction * n
