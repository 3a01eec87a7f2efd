"""Chapter 10: what wrench one contact can give: cones of half-spaces and their penalty (Paper B, eqs 6–9).

A contact wrench is ``(fx, fy, fz, τx, τy, τz)`` in the contact's own frame, at its middle: z is the ground's
normal, x the rolling direction and y the wheel's axle. A wheel touches the ground along a line of its width
on y, a fingertip at a point, a sole on a rectangle. The rows of a :class:`WrenchCone` are what these contacts
can do with Coulomb's friction, linearised to a pyramid at each place that they touch.

The paper's own eq. 7 is here twice: :func:`printed` as it stands, which the chapter takes apart, and
:func:`decoupled`, mended. The line's own cone is :func:`line_contact`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wfbook.friction import friction_pyramid

COMPONENTS = ("fx", "fy", "fz", "τx", "τy", "τz")
"""Of a contact wrench, in this order; forces in N, moments in N m."""

_E = np.eye(6)
_FX, _FY, _FZ, _TX, _TY, _TZ = _E


@dataclass(frozen=True)
class WrenchCone:
    """The wrenches ``f`` with ``A f ≤ b`` (Paper B, eq. 6).

    Attributes:
        A: ``(m, 6)`` normals of the faces.
        b: ``(m,)`` bounds; all zero for a cone.
        names: what each row demands.
    """

    A: np.ndarray
    b: np.ndarray
    names: tuple[str, ...]

    def residual(self, wrench: np.ndarray) -> np.ndarray:
        """Return ``A f − b`` (Paper B, eq. 8), ``(..., m)`` for wrenches ``(..., 6)``: positive is broken."""
        return np.asarray(wrench) @ self.A.T - self.b

    def admits(self, wrench: np.ndarray, tolerance: float = 1e-9) -> np.ndarray:
        """Return whether no row is broken, ``(...)`` for wrenches ``(..., 6)``."""
        return (self.residual(wrench) <= tolerance).all(axis=-1)

    def broken(self, wrench: np.ndarray, tolerance: float = 1e-9) -> list[str]:
        """Return the names of the rows that one wrench ``(6,)`` breaks, the worst first."""
        residual = self.residual(wrench)
        worst_first = np.argsort(-residual, kind="stable")
        return [self.names[row] for row in worst_first if residual[row] > tolerance]

    def cut(
        self, axes: Sequence[str], at: Mapping[str, float] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows in a few components, the others held where they are.

        Args:
            axes: components that stay free, of :data:`COMPONENTS`.
            at: values of the others; zero where nothing is said. With forces free and moments at zero these
                are the rows of a contact that is modelled by its force alone.

        Returns:
            ``A (m, n)`` and ``b (m,)`` of the slice.

        Raises:
            ValueError: an unknown component, or one that is both free and held.
        """
        at = at or {}
        for name in (*axes, *at):
            if name not in COMPONENTS or (name in axes and name in at):
                raise ValueError(f"axes: {name!r} is unknown, or both free and held")
        held = np.array([at.get(name, 0.0) for name in COMPONENTS])
        return self.A[:, [COMPONENTS.index(name) for name in axes]], self.b - self.A @ held


def _cone(rows: Sequence[tuple[np.ndarray, str]]) -> WrenchCone:
    """Gather rows, ``row @ f ≤ 0``, and their names."""
    A = np.array([row for row, _ in rows]) + 0.0  # no negative zeros, which look like something
    return WrenchCone(A, np.zeros(len(rows)), tuple(name for _, name in rows))


def _between(
    value: np.ndarray, bound: np.ndarray, name: str, limit: str, where: str = ""
) -> list[tuple[np.ndarray, str]]:
    """Two rows: ``−bound ≤ value ≤ bound``; both are linear forms of a wrench, ``(6,)``."""
    return [(value - bound, f"{where}{name} ≤ {limit}"), (-value - bound, f"{where}−{name} ≤ {limit}")]


def _pressed(mu: float) -> list[tuple[np.ndarray, str]]:
    """The five sides of the friction pyramid, which chapter 4 has already (Paper A, eq. 26)."""
    names = ("fz ≥ 0", "fx ≤ μ fz", "−fx ≤ μ fz", "fy ≤ μ fz", "−fy ≤ μ fz")
    return list(zip(friction_pyramid(_FZ, _FX, _FY, mu, mu), names, strict=True))


def point_contact(mu: float) -> WrenchCone:
    """Return the cone of a point: a force in the friction pyramid and no moment (Paper B, eqs 6 and 7).

    The paper keeps the first four rows of eq. 7, corrected here, and ``fz ≥ 0``, for the arm's hand.

    Args:
        mu: friction coefficient.
    """
    rows = _pressed(mu)
    for name, row in zip(COMPONENTS[3:], _E[3:], strict=True):
        rows += _between(row, 0.0 * row, name, "0")
    return _cone(rows)


def line_contact(mu: float, width: float, rolling: float = 0.0) -> WrenchCone:
    """Return the cone of a wheel that touches the ground along a line (Paper B, eqs 6 and 7, corrected).

    All that a line can do its two ends can do. With the half width ``a``, the left end (+y) presses with
    ``(fz + τx / a) / 2`` and pushes along with ``(fx − τz / a) / 2``; the right end with the other signs.
    Each has a friction pyramid of its own, hence rows in which force and moment are coupled. Across, only the
    sum matters.

    Not as printed, eq. 7: the moment that the paper leaves free is the one about the axle, ``τy``, which has
    no lever on the line: it is none at all. (The paper's x is lateral and its y rolls; that can't be meant.)

    Args:
        mu: friction coefficient.
        width: of the line, positive.
        rolling: how far ahead of the axle a soft tyre's pressure may be, in metres: ``|τy| ≤ rolling fz``.

    Raises:
        ValueError: the width is not positive.

    Example:
        A wheel whose load stands beyond the end of its line of 4 cm tips over:

        >>> from wfbook.omni.wrench import line_contact
        >>> wheel = line_contact(mu=0.7, width=0.04)
        >>> load = lambda y: np.array([0.0, 0.0, 100.0, 100.0 * y, 0.0, 0.0])
        >>> bool(wheel.admits(load(0.019))), bool(wheel.admits(load(0.021)))
        (True, False)
    """
    if not width > 0.0:
        raise ValueError(f"width: must be positive, is {width!r}")
    a = 0.5 * width
    rows = _pressed(mu)[3:]
    for side, name in ((1.0, "left"), (-1.0, "right")):
        press, along = _FZ + side * _TX / a, _FX - side * _TZ / a
        rows.append((-press, f"{name} end: fz ≥ 0"))
        rows += _between(along, mu * press, "fx", "μ fz", f"{name} end: ")
    return _cone([*rows, *_between(_TY, rolling * _FZ, "τy", "rolling · fz" if rolling else "0")])


def surface_contact(mu: float, length: float, width: float) -> WrenchCone:
    """Return the cone of a rectangle, as a sole has it: the full wrench of Paper B, eq. 7, corrected.

    It is the sum of the friction pyramids at the four corners, in the closed form of Caron, Pham and Nakamura
    (ICRA 2015): the moment about the normal is limited by what the forces and the other moments leave over.

    Args:
        mu: friction coefficient.
        length: along x.
        width: along y.
    """
    x, y = 0.5 * length, 0.5 * width
    rows = _pressed(mu)
    rows += _between(_TX, y * _FZ, "τx", "w/2 · fz")
    rows += _between(_TY, x * _FZ, "τy", "l/2 · fz")
    most = mu * (x + y) * _FZ
    for i in (1.0, -1.0):
        for j in (1.0, -1.0):
            signs = f"({'+' if i > 0 else '−'}, {'+' if j > 0 else '−'})"
            over, under = y * _FX + mu * _TX, y * _FX - mu * _TX
            across, back = x * _FY + mu * _TY, x * _FY - mu * _TY
            rows.append((_TZ + i * over + j * across - most, f"τz ≤ what {signs} leaves"))
            rows.append((-_TZ + i * under + j * back - most, f"−τz ≤ what {signs} leaves"))
    return _cone(rows)


def decoupled(mu: float, levers: Sequence[float | None]) -> WrenchCone:
    """Return Paper B, eq. 7, mended: friction rows with μ at ``fz``, moments bounded by levers of ``fz``.

    Not as printed: the friction rows say ``|fx| ≤ fz / μ``. And a constant bound on a moment is no cone: it
    would let a wheel that is hardly pressed twist as hard as one that carries the robot.

    The levers of a line are ``w/2``, 0 and ``μ w/2``. Each row is true of the
    contact, but all together admit more than :func:`line_contact`: full push and full twist at once.

    Args:
        mu: friction coefficient.
        levers: about x, y, z; ``None`` leaves a moment free, as the paper does with τy.
    """
    rows = _pressed(mu)
    for name, row, lever in zip(COMPONENTS[3:], _E[3:], levers, strict=True):
        if lever is not None:
            rows += _between(row, lever * _FZ, name, f"lever{name[1:]} · fz" if lever else "0")
    return _cone(rows)


def printed(mu: float, largest: Sequence[float], smallest: Sequence[float]) -> WrenchCone:
    """Return A and b of Paper B, eq. 7, as printed. Don't use it: see :func:`decoupled`.

    Args:
        mu: friction coefficient. The rows say ``μ |fx| ≤ fz``.
        largest: ``(3,)`` bounds of τx, τy, τz from above.
        smallest: ``(3,)`` numbers that stand in ``b`` where ``−τ ≤ b``: a lower bound of −2 N m written as −2
            demands ``τ ≥ 2``.
    """
    A = np.zeros((10, 6))
    A[:4, 2] = -1.0
    A[0, 0], A[1, 0], A[2, 1], A[3, 1] = mu, -mu, mu, -mu
    names = [f"{sign}μ {name} ≤ fz" for name in COMPONENTS[:2] for sign in ("", "−")]
    for i, name in enumerate(COMPONENTS[3:]):
        A[4 + 2 * i, 3 + i], A[5 + 2 * i, 3 + i] = 1.0, -1.0
        names += [f"{name} ≤ {name},max", f"−{name} ≤ {name},min"]
    moments = np.column_stack([largest, smallest]).astype(float).ravel()
    return WrenchCone(A, np.concatenate([np.zeros(4), moments]), tuple(names))


def penalty(residual: np.ndarray) -> np.ndarray:
    """Return ``½ Σ max(r, 0)²`` (Paper B, eq. 9, row by row): ``(...)`` for residuals ``(..., m)``.

    Not as printed: the paper writes it for the whole vector, ``½ rᵀr`` if ``r > 0``. Taken like that, one
    broken row would charge for all rows that hold as well, and more the better they hold.
    """
    over = np.maximum(residual, 0.0)
    return 0.5 * (over * over).sum(axis=-1)


def penalty_derivatives(cone: WrenchCone, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return gradient and Hessian of :func:`penalty` in the wrench (Paper B, eqs 8 and 9).

    Both are zero inside the cone and the gradient is continuous across its faces; the Hessian jumps there.

    Args:
        cone: whose rows are charged.
        wrench: ``(6,)``.

    Returns:
        ``(6,)`` and ``(6, 6)``.
    """
    residual = cone.residual(wrench)
    active = cone.A[residual > 0.0]
    return active.T @ residual[residual > 0.0], active.T @ active


def wrench_of(points: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Return what forces ``(..., n, 3)`` at points ``(n, 3)`` of a contact add up to, ``(..., 6)``.

    Example:
        >>> from wfbook.omni.wrench import line_ends, wrench_of
        >>> wrench_of(line_ends(0.04), np.array([[0.0, 0.0, 75.0], [0.0, 0.0, 25.0]])).tolist()
        [0.0, 0.0, 100.0, 1.0, 0.0, 0.0]
    """
    moments = np.cross(points, forces)
    return np.concatenate([np.sum(forces, axis=-2), np.sum(moments, axis=-2)], axis=-1)


def line_ends(width: float) -> np.ndarray:
    """Return the ends of a wheel's line of contact in its frame, left and right, ``(2, 3)``."""
    return np.array([[0.0, 0.5 * width, 0.0], [0.0, -0.5 * width, 0.0]])


def end_forces(wrench: np.ndarray, width: float) -> np.ndarray:
    """Return the forces at the two ends of a line that make a wrench, left and right, ``(2, 3)``.

    The force across the wheel could be shared in any way; each end takes as much of it as it presses.

    Args:
        wrench: ``(6,)`` without a moment about the axle, which no force on the line can make.
        width: of the line.
    """
    fx, fy, fz, tx, _, tz = wrench
    side = np.array([1.0, -1.0])
    press = 0.5 * (fz + side * tx / (0.5 * width))
    along = 0.5 * (fx - side * tz / (0.5 * width))
    share = press / fz if fz > 0.0 else np.full(2, 0.5)
    return np.column_stack([along, share * fy, press])


def polygon(A: np.ndarray, b: np.ndarray, box: tuple[float, float, float, float]) -> np.ndarray:
    """Return the corners of ``A p ≤ b`` within a box of the plane, counter-clockwise.

    One half-plane after the other cuts the box. A slice of a cone is often no more than a line, for which
    libraries that ask for an inner point have no answer; here its corners come out on top of each other.

    Args:
        A: ``(m, 2)``.
        b: ``(m,)``.
        box: smallest and largest x, smallest and largest y.

    Returns:
        ``(k, 2)``; no corners if nothing is left.
    """
    left, right, low, high = box
    corners = np.array([[left, low], [right, low], [right, high], [left, high]], dtype=float)
    slack = 1e-9 * max(np.abs(box))
    for row, bound in zip(A, b, strict=True):
        size = np.linalg.norm(row)
        if size < 1e-12:
            if bound < -slack:
                return np.empty((0, 2))
            continue
        over = (corners @ row - bound) / size - slack
        kept = []
        for k in range(len(corners)):
            if over[k - 1] * over[k] < 0.0:
                share = over[k - 1] / (over[k - 1] - over[k])
                kept.append(corners[k - 1] + share * (corners[k] - corners[k - 1]))
            if over[k] <= 0.0:
                kept.append(corners[k])
        corners = np.array(kept).reshape(-1, 2)
        if not len(corners):
            break
    return corners
