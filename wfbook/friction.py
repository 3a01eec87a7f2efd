"""Chapter 4: what force a foot or a wheel may apply (Paper A, eqs 26–29).

A contact's force is written in the basis of its region: ``n`` along the normal, ``t`` along the
rolling direction, ``b`` across it. A foot grips both ways; a wheel grips across but rolls along.

The arguments are NumPy arrays or CVXPY expressions: the same lines state the planner's constraints
and check its answer.
"""

from typing import Any


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


def rolling_friction(n: Any, coefficient: float) -> Any:
    """Return the force along ``t`` that rolling resistance adds to a wheel (Paper A, eq. 29).

    The paper prints it with a positive sign, which would push the robot forward. Resistance opposes
    rolling, and the wheels of this book roll forward, hence the minus.

    Args:
        n: normal force on the wheel, any shape.
        coefficient: of rolling resistance, dimensionless.
    """
    return -coefficient * n
