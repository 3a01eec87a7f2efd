"""Chapter 2: the path of an end effector through the air (Paper A, eqs 2–6).

A swing is a polynomial in the phase ``s ∈ [0, 1]`` of its slot: a quintic in each horizontal
direction, a septic in the vertical. The polynomial is *linear* in what it has to meet (start, end,
apex), which is what lets a convex program move footholds freely: the basis functions below are
computed once from eq. 3, and everything else is a matrix product. That a leg in the air applies no force
(eq. 7) is a line of the program, see :mod:`wfbook.planner`.
"""

from functools import cache

import numpy as np
from numpy.polynomial import polynomial as poly


def conditions(smoothness: int = 2, apex: bool = False) -> list[tuple[float, int]]:
    """List what a swing's polynomial has to meet (Paper A, eqs 4 and 5).

    Args:
        smoothness: how many derivatives are given at lift-off and at touch-down, beside the position. Paper
            A gives two, velocity and acceleration; fewer are there to see what those are good for.
        apex: whether position and velocity at mid-swing are given, too.

    Returns:
        Pairs of a phase and an order: 0 position, 1 velocity, 2 acceleration.
    """
    if smoothness not in (0, 1, 2):
        raise ValueError(f"smoothness: must be 0, 1 or 2, is {smoothness!r}")
    found = [(s, order) for s in (0.0, 1.0) for order in range(smoothness + 1)]
    return found + [(0.5, 0), (0.5, 1)] * apex


def condition_matrix(smoothness: int = 2, apex: bool = False) -> np.ndarray:
    """Return the ``G`` of Paper A, eq. 3, square: row ``i`` is condition ``i`` of :func:`conditions`.

    ``G @ a`` is what a polynomial with the coefficients ``a`` (ascending powers of the phase, eq. 2) does
    there. ``smoothness`` 2 is the paper's quintic, with ``apex`` its septic.

    Example:
        >>> from wfbook.swing import condition_matrix
        >>> condition_matrix(smoothness=1).astype(int)
        array([[1, 0, 0, 0],
               [0, 1, 0, 0],
               [1, 1, 1, 1],
               [0, 1, 2, 3]])
    """
    rows = conditions(smoothness, apex)
    powers = np.eye(len(rows))
    return np.array([[poly.polyval(s, poly.polyder(power, order)) for power in powers] for s, order in rows])


@cache
def _coefficients(smoothness: int, apex: bool) -> np.ndarray:
    """Solve Paper A, eq. 3, ``G a = g``, once for unit right-hand sides.

    Returns:
        ``(n, n)``: column ``i`` holds the coefficients (ascending powers, eq. 2) of the polynomial
        that meets condition ``i`` of :func:`conditions` with 1 and every other condition with 0.
    """
    # All are whole numbers or halves; rounded to that, the ends are met exactly and not to 1e-13.
    return np.rint(2.0 * np.linalg.inv(condition_matrix(smoothness, apex))) / 2.0


def _basis(
    phase: np.ndarray, derivative: int, smoothness: int, wanted: tuple[tuple[float, int], ...]
) -> np.ndarray:
    """Evaluate the polynomials that belong to some conditions, zero for those that are not asked for."""
    apex = any(s == 0.5 for s, _ in wanted)
    given, coefficients = conditions(smoothness, apex), _coefficients(smoothness, apex)
    phase = np.asarray(phase, float)
    columns = [
        poly.polyval(phase, poly.polyder(coefficients[:, given.index(condition)], derivative))
        if condition in given
        else np.zeros_like(phase)
        for condition in wanted
    ]
    return np.stack(columns, axis=-1)


def quintic_basis(phase: np.ndarray, derivative: int = 0, smoothness: int = 2) -> np.ndarray:
    """Evaluate the horizontal swing spline's basis (Paper A, eqs 2–4).

    The foot at phase ``s`` of a swing of duration ``T`` is
    ``p0 * B[..., 0] + T * v0 * B[..., 1] + pf * B[..., 2] + T * vf * B[..., 3]``; accelerations are zero at
    both ends. ``derivative`` derives by the phase: divide by ``T ** derivative`` for time.

    Args:
        phase: any shape ``(...)``, 0 at lift-off and 1 at touch-down.
        derivative: order of the derivative by the phase.
        smoothness: see :func:`conditions`; 1 is a cubic, 0 a straight line that knows no velocities.

    Returns:
        ``(..., 4)``: the weights of ``p0``, ``T v0``, ``pf`` and ``T vf``.

    Example:
        At mid-swing a swing at rest at both ends is half way, at 15/8 of its mean speed:

        >>> from wfbook.swing import quintic_basis
        >>> half = np.array([0.5])
        >>> quintic_basis(half)[:, [0, 2]].tolist(), quintic_basis(half, derivative=1)[:, [0, 2]].tolist()
        ([[0.5, 0.5]], [[-1.875, 1.875]])
    """
    return _basis(phase, derivative, smoothness, ((0.0, 0), (0.0, 1), (1.0, 0), (1.0, 1)))


def septic_basis(phase: np.ndarray, derivative: int = 0, smoothness: int = 2) -> np.ndarray:
    """Evaluate the vertical swing spline's basis (Paper A, eqs 2, 3, 5).

    The height at phase ``s`` is ``z0 * B[..., 0] + zf * B[..., 1] + z_apex * B[..., 2]``; velocity and
    acceleration are zero at both ends, velocity is zero at the apex.

    Not as printed, eq. 5: vertical velocities are zero at the ends, on a ramp a rolling wheel's is not. There
    the controller puts in the slope times the forward velocity.

    Args:
        phase: any shape ``(...)``, 0 at lift-off and 1 at touch-down.
        derivative: order of the derivative by the phase.
        smoothness: see :func:`conditions`; 1 is a quintic, 0 a cubic, a parabola between equal heights.

    Returns:
        ``(..., 3)``: the weights of the start, end and apex heights.
    """
    return _basis(phase, derivative, smoothness, ((0.0, 0), (1.0, 0), (0.5, 0)))


def swing_position(
    phase: np.ndarray,
    duration: float,
    start: np.ndarray,
    end: np.ndarray,
    apex_height: float,
    start_velocity: np.ndarray | None = None,
    end_velocity: np.ndarray | None = None,
    derivative: int = 0,
    smoothness: int = 2,
) -> np.ndarray:
    """Evaluate a swing, or its time derivatives, in the world frame (Paper A, eqs 2–6).

    Not as printed, eqs 4–6: the polynomial is one of the phase, so the velocities in its conditions are by
    phase. Those here are by time, and come times the swing's duration, a factor that the paper does not
    write.

    Args:
        phase: ``(n,)`` phase of the swing, 0 at lift-off and 1 at touch-down.
        duration: of the swing.
        start: ``(3,)`` where the contact point lifts.
        end: ``(3,)`` where it lands.
        apex_height: above the mean of start and end heights, at mid-swing.
        start_velocity: ``(3,)`` at lift-off (a wheel's); the vertical part is not used. Default 0.
        end_velocity: ``(3,)`` at touch-down, likewise.
        derivative: 0 position, 1 velocity, 2 acceleration.
        smoothness: how many derivatives are met at the ends, see :func:`conditions`.

    Returns:
        ``(n, 3)``.

    Example:
        >>> from wfbook.swing import swing_position
        >>> swing_position(np.array([0.0, 0.5, 1.0]), 0.3, [0.2, 0.1, 0.0], [0.3, 0.1, 0.0], 0.06).round(6)
        array([[0.2 , 0.1 , 0.  ],
               [0.25, 0.1 , 0.06],
               [0.3 , 0.1 , 0.  ]])
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    v0 = np.zeros(3) if start_velocity is None else np.asarray(start_velocity, float)
    vf = np.zeros(3) if end_velocity is None else np.asarray(end_velocity, float)
    given = np.stack([start, duration * v0, end, duration * vf])
    lateral = quintic_basis(phase, derivative, smoothness) @ given
    apex = 0.5 * (start[2] + end[2]) + apex_height
    lateral[..., 2] = septic_basis(phase, derivative, smoothness) @ np.array([start[2], end[2], apex])
    return lateral / duration**derivative
