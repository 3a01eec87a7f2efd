"""Planar convex polygons in space: their normal, their half-spaces, and the checks that they are ones."""

import math
import numbers
import reprlib
from collections.abc import Iterable
from typing import Any

import numpy as np

PLANAR_TOLERANCE = 1e-4  # so that files written with four decimals are planar and convex
SMALLEST_SIZE = 1e-3  # edges and widths below a millimetre give no usable half-space
LARGEST_COORDINATE = 1e6
STEEPEST_NORMAL_Z = 1e-2  # faces above 89.4 degrees are walls


def checked_vertices(vertices: Iterable) -> np.ndarray:
    """Check the corners of a planar convex polygon that looks up.

    Args:
        vertices: n triples of numbers, counter-clockwise seen from above.

    Returns:
        The corners, (n, 3), read-only.

    Raises:
        ValueError: what is wrong with which vertex, and its value.
    """
    if not isinstance(vertices, list | tuple | np.ndarray):
        raise ValueError(f"vertices: must be a list of [x, y, z], is {show(vertices)}")
    if len(vertices) < 3:
        raise ValueError(f"vertices: needs at least three, is {show(vertices)}")
    for i, vertex in enumerate(vertices):
        if not isinstance(vertex, list | tuple | np.ndarray) or len(vertex) != 3:
            raise ValueError(f"vertices[{i}]: must be [x, y, z], is {show(vertex)}")
    rows = [
        [checked_number(v, f"vertices[{i}][{j}]") for j, v in enumerate(p)] for i, p in enumerate(vertices)
    ]
    points = np.array(rows)
    for i, point in enumerate(points):
        if np.abs(point).max() > LARGEST_COORDINATE:
            raise ValueError(
                f"vertices[{i}]: is over {LARGEST_COORDINATE:g} m away, is {show(point.tolist())}"
            )
        if i and np.linalg.norm(points[:i] - point, axis=1).min() < SMALLEST_SIZE:
            raise ValueError(f"vertices[{i}]: is on another vertex, is {show(point.tolist())}")
    _check_shape(points)
    return read_only(points)


def _check_shape(points: np.ndarray) -> None:
    """Raise ValueError unless the (n, 3) points are a planar convex polygon that looks up."""
    twice_area = np.linalg.norm(_twice_area(points))
    longest = np.linalg.norm(points[:, None] - points, axis=2).max()
    if twice_area < SMALLEST_SIZE * longest:
        raise ValueError(f"vertices: not convex, encloses no area, is {show(points.tolist())}")
    normal = unit_normal(points)
    off_plane = np.abs((points - points.mean(axis=0)) @ normal)
    if off_plane.max() > PLANAR_TOLERANCE:
        i = int(off_plane.argmax())
        raise ValueError(
            f"vertices: not planar, {show(points[i].tolist())} is {off_plane[i]:.3g} m off the plane"
        )
    # Seen along the plane's own normal, so that a crossed wall is not mistaken for one with a bad slope.
    across = _in_plane(points, normal)
    A, b = halfspaces(across)
    outside = (A @ across.T - b[:, None]).max(axis=0)
    if outside.max() > PLANAR_TOLERANCE:
        raise ValueError(f"vertices: not convex, is {show(points.tolist())}")
    if normal[2] < STEEPEST_NORMAL_Z:
        raise ValueError(
            "vertices: face does not look up (a wall, or clockwise order), "
            f"its normal is {show(normal.round(6).tolist())}"
        )


def _twice_area(points: np.ndarray) -> np.ndarray:
    """(3,) vector along the polygon's normal, its length twice the area (Newell's method)."""
    centred = points - points.mean(axis=0)
    return np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)


def unit_normal(points: np.ndarray) -> np.ndarray:
    """(3,) unit normal of a planar polygon (n, 3), towards the side it is counter-clockwise from."""
    area = _twice_area(points)
    return area / np.linalg.norm(area)


def _in_plane(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(n, 2) coordinates of the points in a right-handed basis of the plane with this normal."""
    u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    u /= np.linalg.norm(u)
    return points @ np.column_stack((u, np.cross(normal, u)))


def halfspaces(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit rows A and b of A @ p <= b for a counter-clockwise polygon, from its first two coordinates.

    Example:
        >>> from wfbook.polygon import halfspaces
        >>> A, b = halfspaces(np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]))
        >>> bool((A @ [1.0, 0.5] <= b).all()), bool((A @ [1.0, 1.5] <= b).all())
        (True, False)
    """
    corner = points[:, :2]
    edge = np.roll(corner, -1, axis=0) - corner
    A = np.column_stack((edge[:, 1], -edge[:, 0])) / np.linalg.norm(edge, axis=1, keepdims=True)
    return A, (A * corner).sum(axis=1)


def checked_number(value: Any, field: str) -> float:
    """Return a finite float, or raise ValueError. True and False are no numbers."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ValueError(f"{field}: must be a number, is {show(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{field}: must be finite, is {show(value)}")
    return number


def read_only(array: np.ndarray) -> np.ndarray:
    """Return the array itself, closed for writing: fields of frozen dataclasses must not change."""
    array.setflags(write=False)
    return array


def show(value: Any) -> str:
    """A short, one-line form of any value for error messages."""
    return reprlib.repr(value).replace("\n", " ")
