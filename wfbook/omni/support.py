"""Chapter 10: what all contacts can do together: balance and areas of support (Paper B, eqs 10 and 11).

Each contact has a wrench in its own cone (eq. 10); together they must balance what acts on the robot
(eq. 11). What is left open is a polyhedron in as many dimensions as there are components of wrenches. The
areas of support are its shadows on a plane, found by asking a linear program for its outermost point, one
direction after the other.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import linprog

from wfbook.omni.wrench import WrenchCone

AREAS = ("full", "pendular", "static")
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Contact:
    """Where a contact is, and what it can do.

    Attributes:
        position: ``(3,)`` of the contact's middle, world frame.
        R_wc: ``(3, 3)`` its axes in the world: x rolling direction, y axle, z normal.
        cone: of its wrench, in its own axes.
    """

    position: np.ndarray
    R_wc: np.ndarray
    cone: WrenchCone

    @property
    def G(self) -> np.ndarray:
        """``(6, 6)`` from the contact's wrench to force and moment about the world's origin, world axes.

        It is the transpose of the Jacobian in Paper B, eq. 11, for a robot that is one rigid body.
        """
        x, y, z = self.position
        across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        R = self.R_wc
        return np.block([[R, np.zeros((3, 3))], [across @ R, R]])


def axes_on(normal: Sequence[float], heading: float = 0.0) -> np.ndarray:
    """Return a contact's axes on a surface, ``(3, 3)``: z its normal, x as near as can be to the heading.

    Args:
        normal: ``(3,)`` of the surface, any length.
        heading: from the world's x towards y, rad. On a wall that faces it, x points up instead.
    """
    z = np.asarray(normal, float) / np.linalg.norm(normal)
    x = np.array([np.cos(heading), np.sin(heading), 0.0])
    x -= (x @ z) * z
    if np.linalg.norm(x) < 1e-6:
        x = np.array([0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def zmp(wrench: np.ndarray, height: float = 0.0) -> np.ndarray:
    """Return the zero-moment point of the contacts' resultant on a level plane (Paper B, after eq. 11).

    The paper's ``n × τ / (n · f)`` is the vector from ``O``, about which the moment is taken, if ``O`` lies
    in the plane. Here it is moved there first.

    Args:
        wrench: ``(..., 6)`` force and moment about the world's origin; the force must press.
        height: of the plane.

    Returns:
        ``(..., 2)`` x and y.
    """
    fx, fy, fz, tx, ty, _ = np.moveaxis(np.asarray(wrench, float), -1, 0)
    # Moving the moment up by h takes (0, 0, h) × f away from it.
    return np.stack([-(ty - height * fx), tx + height * fy], axis=-1) / fz[..., None]


def balance(contacts: Sequence[Contact], wrench: np.ndarray) -> np.ndarray | None:
    """Return contact wrenches that balance what acts on the robot (Paper B, eqs 10 and 11), or None.

    Of all that do, one with the smallest largest normal force: the load is spread.

    Args:
        contacts: N of them.
        wrench: ``(6,)`` force and moment about the world's origin that act on the robot from outside:
            gravity, inertia, payload.

    Returns:
        ``(N, 6)`` in the contacts' own axes; None if no wrenches in the cones do it.
    """
    A, b, G = _stacked(contacts)
    press = np.zeros((len(contacts), 6 * len(contacts)))
    press[np.arange(len(contacts)), 6 * np.arange(len(contacts)) + 2] = 1.0
    rows = np.block([[A, np.zeros((len(A), 1))], [press, -np.ones((len(contacts), 1))]])
    answer = linprog(
        np.append(np.zeros(A.shape[1]), 1.0),
        A_ub=rows,
        b_ub=np.concatenate([b, np.zeros(len(contacts))]),
        A_eq=np.hstack([G, np.zeros((6, 1))]),
        b_eq=-np.asarray(wrench, float),
        bounds=(None, None),
    )
    return answer.x[:-1].reshape(-1, 6) if answer.status == 0 else None


def gravity_wrench(
    com: np.ndarray, acceleration: np.ndarray | None = None, weight: float = 1.0
) -> np.ndarray:
    """Return gravity's and inertia's wrench on a point mass about the world's origin, ``(6,)``.

    Args:
        com: ``(3,)``.
        acceleration: ``(3,)`` of the centre of mass, in units of g; at rest without one.
        weight: of the robot.
    """
    pull = np.array([0.0, 0.0, -1.0]) - (np.zeros(3) if acceleration is None else acceleration)
    return weight * np.concatenate([pull, np.cross(com, pull)])


def support_area(
    contacts: Sequence[Contact],
    kind: str = "full",
    com: np.ndarray | None = None,
    height: float = 0.0,
    limit: float = 5.0,
) -> np.ndarray:
    """Return where the zero-moment point can be: the image of the contacts' wrench cone on a level plane.

    * ``"full"``: with any acceleration and any change of angular momentum. For contacts in one level plane it
      is the convex hull of all that touches the ground, whatever the friction.
    * ``"pendular"``: with a centre of mass that stays at its height and no moment about it (the linear
      pendulum of Caron, Pham and Nakamura, 2017): the resultant passes through the centre of mass.
    * ``"static"``: with a force straight up and no moment about it. Then the point is below the centre of
      mass: this is where that may be at rest.

    Args:
        contacts: of the robot.
        kind: one of :data:`AREAS`.
        com: ``(3,)`` centre of mass, for the pendular area.
        height: of the plane.
        limit: how far from the origin the area is followed; some have no end.

    Returns:
        ``(k, 2)`` corners, counter-clockwise; none if no wrench is possible.

    Raises:
        ValueError: an unknown kind, a pendular area without a centre of mass, or with one in the plane.
    """
    if kind not in AREAS:
        raise ValueError(f"kind: {kind!r} is none of {', '.join(AREAS)}")
    if kind == "pendular" and (com is None or abs(com[2] - height) < 1e-6):
        raise ValueError("com: the pendular area needs a centre of mass above or below its plane")
    A, b, G = _stacked(contacts)
    f, tau = G[:3], G[3:]
    fixed = [(f[2], 1.0)]  # all areas are of a cone, whose wrenches may be scaled
    if kind == "static":
        fixed += [(f[0], 0.0), (f[1], 0.0), (tau[2], 0.0)]
    elif kind == "pendular":
        x, y, z = com
        about = tau - np.array([y * f[2] - z * f[1], z * f[0] - x * f[2], x * f[1] - y * f[0]])
        fixed += [(row, 0.0) for row in about]
    point = np.array([height * f[0] - tau[1], tau[0] + height * f[1]])
    rows = {
        "A_ub": np.vstack([A, point, -point]),
        "b_ub": np.concatenate([b, np.full(4, limit)]),
        "A_eq": np.array([row for row, _ in fixed]),
        "b_eq": np.array([value for _, value in fixed]),
        "bounds": (None, None),
    }

    def outermost(direction: np.ndarray) -> np.ndarray | None:
        answer = linprog(-direction @ point, **rows)
        return point @ answer.x if answer.status == 0 else None

    return shadow(outermost)


def shadow(outermost: Callable[[np.ndarray], np.ndarray | None]) -> np.ndarray:
    """Return a convex polygon of which only its outermost point in a direction can be asked.

    Between two known corners the direction square to their join is asked: either it finds a corner beyond,
    or the join is an edge. A polygon of k corners takes fewer than ``3 k + 2`` questions.

    Args:
        outermost: from a direction ``(2,)`` to a point ``(2,)``, or None if there is no polygon at all.

    Returns:
        ``(k, 2)`` corners, counter-clockwise; two for a line, one for a point.
    """
    first = outermost(np.array([1.0, 0.0]))
    if first is None:
        return np.empty((0, 2))
    last = outermost(np.array([-1.0, 0.0]))

    def beyond(a: np.ndarray, b: np.ndarray) -> list[np.ndarray]:
        edge = b - a
        length = np.linalg.norm(edge)
        if length < _TOLERANCE:
            return []
        outward = np.array([edge[1], -edge[0]]) / length
        corner = outermost(outward)
        if corner is None or outward @ (corner - a) < _TOLERANCE:
            return []
        return [*beyond(a, corner), corner, *beyond(corner, b)]

    if np.linalg.norm(first - last) < _TOLERANCE:  # a vertical line, or a point
        first, last = outermost(np.array([0.0, 1.0])), outermost(np.array([0.0, -1.0]))
    corners = np.array([first, *beyond(first, last), last, *beyond(last, first)])
    distinct = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) > _TOLERANCE
    corners = corners[distinct] if distinct.any() else corners[:1]
    if len(corners) < 3:
        return corners
    # The first two were asked for with no regard to edges, and may lie on one.
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    chord, to = after - before, corners - before
    off = np.abs(chord[:, 0] * to[:, 1] - chord[:, 1] * to[:, 0]) / np.linalg.norm(chord, axis=1)
    return corners[off > _TOLERANCE]


def inside(point: np.ndarray, area: np.ndarray, tolerance: float = 1e-6) -> bool:
    """Return whether a point ``(2,)`` is in a convex counter-clockwise polygon ``(k, 2)``."""
    if len(area) < 3:
        return False
    edge, to = np.roll(area, -1, axis=0) - area, point - area
    return bool((edge[:, 0] * to[:, 1] - edge[:, 1] * to[:, 0] >= -tolerance).all())


def _stacked(contacts: Sequence[Contact]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows and bounds of all cones, ``(m, 6 N)`` and ``(m,)``, and the map to the resultant, ``(6, 6 N)``."""
    if not contacts:
        raise ValueError("contacts: there is none")
    return (
        block_diag(*(contact.cone.A for contact in contacts)),
        np.concatenate([contact.cone.b for contact in contacts]),
        np.hstack([contact.G for contact in contacts]),
    )
