"""Chapter 2: the path of an end effector through the air (Paper A, eqs 2–7).

A swing is a polynomial in the phase ``s ∈ [0, 1]`` of its slot: a quintic in each horizontal
direction, a septic in the vertical. The polynomial is *linear* in what it has to meet (start, end,
apex), which is what lets a convex program move footholds freely: the basis functions below are
computed once from eq. 3, and everything else is a matrix product.
"""

from functools import cache

import numpy as np
from numpy.polynomial import polynomial as poly


@cache
def _coefficients(apex: bool) -> np.ndarray:
    """Solve eq. 3, ``G a = g``, once for unit right-hand sides.

    Returns:
        ``(n, n)``: column ``i`` holds the coefficients (ascending powers, eq. 2) of the polynomial
        that meets condition ``i`` with 1 and every other condition with 0. The conditions are those
        of eqs 4 and 5: position, velocity and acceleration at the start, the same at the end, and
        with ``apex`` position and velocity at mid-swing.
    """
    n = 8 if apex else 6
    conditions = [(s, order) for s in (0.0, 1.0) for order in (0, 1, 2)]
    if apex:
        conditions += [(0.5, 0), (0.5, 1)]
    G = np.array(
        [[poly.polyval(s, poly.polyder(np.eye(n)[i], order)) for i in range(n)] for s, order in conditions]
    )
    # All are whole numbers or halves; rounded to that, the ends are met exactly and not to 1e-13.
    return np.rint(2.0 * np.linalg.inv(G)) / 2.0


def quintic_basis(phase: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Evaluate the horizontal swing spline's basis (Paper A, eqs 2–4).

    The foot at phase ``s`` of a swing of duration ``T`` is
    ``p0 * B[..., 0] + T * v0 * B[..., 1] + pf * B[..., 2] + T * vf * B[..., 3]``; accelerations are zero at
    both ends. ``derivative`` derives by the phase: divide by ``T ** derivative`` for time.

    Args:
        phase: any shape ``(...)``, 0 at lift-off and 1 at touch-down.
        derivative: order of the derivative by the phase.

    Returns:
        ``(..., 4)``: the weights of ``p0``, ``T v0``, ``pf`` and ``T vf``.
    """
    columns = [
        poly.polyval(np.asarray(phase, float), poly.polyder(c, derivative)) for c in _coefficients(False).T
    ]
    return np.stack([columns[i] for i in (0, 1, 3, 4)], axis=-1)


def septic_basis(phase: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Evaluate the vertical swing spline's basis (Paper A, eqs 2, 3, 5).

    The height at phase ``s`` is ``z0 * B[..., 0] + zf * B[..., 1] + z_apex * B[..., 2]``; velocity and
    acceleration are zero at both ends, velocity is zero at the apex.

    Args:
        phase: any shape ``(...)``, 0 at lift-off and 1 at touch-down.
        derivative: order of the derivative by the phase.

    Returns:
        ``(..., 3)``: the weights of the start, end and apex heights.
    """
    columns = [
        poly.polyval(np.asarray(phase, float), poly.polyder(c, derivative)) for c in _coefficients(True).T
    ]
    return np.stack([columns[i] for i in (0, 3, 6)], axis=-1)


def swing_position(
    phase: np.ndarray,
    duration: float,
    start: np.ndarray,
    end: np.ndarray,
    apex_height: float,
    start_velocity: np.ndarray | None = None,
    end_velocity: np.ndarray | None = None,
    derivative: int = 0,
) -> np.ndarray:
    """Evaluate a swing, or its time derivatives, in the world frame (Paper A, eqs 2–6).

    Args:
        phase: ``(n,)`` phase of the swing, 0 at lift-off and 1 at touch-down.
        duration: of the swing.
        start: ``(3,)`` where the contact point lifts.
        end: ``(3,)`` where it lands.
        apex_height: above the mean of start and end heights, at mid-swing.
        start_velocity: ``(3,)`` at lift-off (a wheel's); the vertical part is not used. Default 0.
        end_velocity: ``(3,)`` at touch-down, likewise.
        derivative: 0 position, 1 velocity, 2 acceleration.

    Returns:
        ``(n, 3)``.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    v0 = np.zeros(3) if start_velocity is None else np.asarray(start_velocity, float)
    vf = np.zeros(3) if end_velocity is None else np.asarray(end_velocity, float)
    lateral = quintic_basis(phase, derivative) @ np.stack([start, duration * v0, end, duration * vf])
    apex = 0.5 * (start[2] + end[2]) + apex_height
    lateral[..., 2] = septic_basis(phase, derivative) @ np.array([start[2], end[2], apex])
    return lateral / duration**derivative
