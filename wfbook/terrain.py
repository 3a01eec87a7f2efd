"""Where a leg may touch the ground: planar convex regions, terrains and terrain files.

Paper A, section II-D: the ground is a set of convex planes ("safe regions"), each with the half-spaces
of eq. 22, a basis n, t, b with t in the wheel's rolling direction (eq. 26), friction per end effector and
direction (eq. 26) and rolling resistance (eq. 29). Regions of one group are continuous: wheels may roll
from one to the next (eq. 23).

Everything is in the world frame, x forward, y left, z up, in metres.
"""

import difflib
import itertools
import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from wfbook.polygon import (
    SMALLEST_SIZE,
    checked_number,
    checked_vertices,
    halfspaces,
    read_only,
    show,
    unit_normal,
)

_FRICTION = ("mu_foot", "mu_wheel", "mu_wheel_lateral", "rolling_resistance")


@dataclass(frozen=True, eq=False)
class Region:
    """A planar convex polygon that legs may touch, with its contact parameters.

    Attributes:
        vertices: (n, 3) corners in the world frame, counter-clockwise seen from above.
        mu_foot: friction coefficient of a foot, in every direction.
        mu_wheel: traction coefficient of a wheel along its rolling direction.
        mu_wheel_lateral: friction coefficient of a wheel along its axle.
        rolling_resistance: rolling friction force over normal force (Paper A, eq. 29).
        group: regions of one group join without a gap; wheels may roll between them.

    Raises:
        ValueError: a field is wrong; the message names the field and its value.
    """

    FIELDS: ClassVar[tuple[str, ...]] = ("vertices", *_FRICTION, "group")

    vertices: np.ndarray
    mu_foot: float
    mu_wheel: float
    mu_wheel_lateral: float
    rolling_resistance: float
    group: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", checked_vertices(self.vertices))
        for name in _FRICTION:
            object.__setattr__(self, name, _checked_coefficient(getattr(self, name), name))
        _check_text(self.group, "group")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Region) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash((*self.vertices.flat, *(getattr(self, name) for name in _FRICTION), self.group))

    @cached_property
    def normal(self) -> np.ndarray:
        """(3,) unit normal n of the plane, upwards."""
        return read_only(unit_normal(self.vertices))

    @cached_property
    def tangent(self) -> np.ndarray:
        """(3,) unit rolling direction t: the world's x axis projected on the plane."""
        along = np.array([1.0, 0.0, 0.0]) - self.normal[0] * self.normal
        return read_only(along / np.linalg.norm(along))

    @cached_property
    def binormal(self) -> np.ndarray:
        """(3,) unit axle direction b = n × t, towards the world's +y."""
        return read_only(np.cross(self.normal, self.tangent))

    @cached_property
    def halfspaces(self) -> tuple[np.ndarray, np.ndarray]:
        """The A (n, 2) with unit rows and b (n,) of Paper A, eq. 22: inside is A @ [p_x, p_y] <= b."""
        A, b = halfspaces(self.vertices)
        return read_only(A), read_only(b)

    def height(self, x: float, y: float) -> float:
        """Height z of the region's plane at (x, y), inside the polygon or not."""
        n = self.normal
        origin = self.vertices.mean(axis=0)
        return float(origin[2] - (n[0] * (x - origin[0]) + n[1] * (y - origin[1])) / n[2])

    def outside(self, x: float, y: float) -> float:
        """How far (x, y) is outside the polygon's farthest edge, seen from above; negative inside."""
        A, b = self.halfspaces
        return max((A[:, 0] * x + A[:, 1] * y - b).tolist())

    def contains(self, x: float, y: float, tolerance: float = 1e-9) -> bool:
        """Whether (x, y) is inside the polygon or at most ``tolerance`` metres outside an edge."""
        return self.outside(x, y) <= tolerance

    def nearest(self, point: np.ndarray) -> np.ndarray:
        """The polygon's point (3,) that is nearest to a point (3,) in space."""
        below = point - self.normal @ (point - self.vertices[0]) * self.normal
        if self.contains(below[0], below[1]):
            return below
        edges = np.roll(self.vertices, -1, axis=0) - self.vertices
        along = ((point - self.vertices) * edges).sum(axis=1) / (edges**2).sum(axis=1)
        on_edges = self.vertices + np.clip(along, 0.0, 1.0)[:, None] * edges
        return on_edges[((on_edges - point) ** 2).sum(axis=1).argmin()]

    def to_dict(self) -> dict[str, Any]:
        """The region as plain JSON types, as it stands in a terrain file."""
        return {name: getattr(self, name) for name in self.FIELDS} | {"vertices": self.vertices.tolist()}


@dataclass(frozen=True)
class Terrain:
    """A named, non-empty tuple of regions. Ground outside every region must not be touched.

    Attributes:
        name: the terrain's name, in results and pictures.
        regions: the regions, in the order of the dynamics matrix's r.

    Raises:
        ValueError: the name is no text, or there is no region.

    Example:
        >>> from wfbook.terrain import Terrain, stepping_stones
        >>> stepping_stones().save("stones.json")
        >>> Terrain.load("stones.json") == stepping_stones()
        True
    """

    name: str
    regions: tuple[Region, ...]

    def __post_init__(self) -> None:
        _check_text(self.name, "name")
        object.__setattr__(self, "regions", tuple(self.regions))
        if not self.regions:
            raise ValueError("regions: needs at least one region, is []")
        if not all(isinstance(region, Region) for region in self.regions):
            raise ValueError(f"regions: must be Region objects, is {show(self.regions)}")

    def region_at(self, x: float, y: float, tolerance: float = 1e-9) -> int | None:
        """Index of the highest region at (x, y), the first of equals, or None over no region.

        Args:
            x: where to look.
            y: likewise.
            tolerance: how far outside of an edge still counts, in metres.
        """
        over = [i for i, region in enumerate(self.regions) if region.contains(x, y, tolerance)]
        return max(over, key=lambda i: self.regions[i].height(x, y), default=None)

    def height(self, x: float, y: float) -> float | None:
        """Height z of the ground at (x, y), or None over no region."""
        index = self.region_at(x, y)
        return None if index is None else self.regions[index].height(x, y)

    def to_dict(self) -> dict[str, Any]:
        """The terrain as plain JSON types: what a terrain file holds."""
        return {"name": self.name, "regions": [region.to_dict() for region in self.regions]}

    @classmethod
    def from_dict(cls, data: Any, source: str = "terrain") -> "Terrain":
        """Build a terrain from what a terrain file holds.

        Args:
            data: the parsed JSON.
            source: where the data come from; error messages begin with it.

        Raises:
            ValueError: names the source, the region's index, the field and its value.
        """
        _check_keys(data, ("name", "regions"), source)
        if not isinstance(data["regions"], list | tuple):
            raise ValueError(f"{source}: regions: must be a list, is {show(data['regions'])}")
        regions = []
        for i, entry in enumerate(data["regions"]):
            _check_keys(entry, Region.FIELDS, f"{source}: region {i}")
            try:
                regions.append(Region(**entry))
            except ValueError as error:
                raise ValueError(f"{source}: region {i}: {error}") from None
        try:
            return cls(data["name"], tuple(regions))
        except ValueError as error:
            raise ValueError(f"{source}: {error}") from None

    def save(self, path: str | Path) -> None:
        """Write the terrain file. ``Terrain.load`` gives back the same numbers to the last bit."""
        Path(path).write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> "Terrain":
        """Read and check a terrain file.

        Raises:
            ValueError: one line naming the file, the region's index, the field and its value.
            OSError: the file can't be read.
        """
        source = f"terrain file {str(path)!r}"
        try:
            text = Path(path).read_text(encoding="utf-8-sig")
            data = json.loads(text, object_pairs_hook=_Object)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{source}: not JSON: {str(error).splitlines()[0]}") from None
        return cls.from_dict(data, source)


def flat(rolling_resistance: float = 0.0) -> Terrain:
    """Level ground at z = 0, 12 m by 4 m, with or without rolling friction (Paper A, IV-A.1 and 2).

    Example:
        >>> from wfbook.terrain import flat
        >>> floor = flat(rolling_resistance=0.01)
        >>> floor.height(1.0, 0.2), floor.region_at(1.0, 0.2)
        (0.0, 0)
    """
    surface = _surface(rolling_resistance)
    name = "flat-friction" if rolling_resistance > 0 else "flat"
    return Terrain(name, (_strip((-2.0, 0.0), (10.0, 0.0), surface, "ground"),))


def ramp(
    angle_deg: float = 12.0,
    direction: str = "down",
    start: float = 0.4,
    length: float = 0.8,
    rolling_resistance: float = 0.0,
) -> Terrain:
    """A platform at z = 0, a slope and a second platform, one group (Paper A, IV-A.3 and 4).

    Args:
        angle_deg: slope angle in degrees, between 0 and 45.
        direction: "down" or "up", seen in +x.
        start: x at which the slope begins.
        length: extent of the slope along x, not along its surface.
        rolling_resistance: rolling friction over normal force.

    Raises:
        ValueError: a parameter is out of range.

    Example:
        >>> from wfbook.terrain import ramp
        >>> down = ramp()
        >>> down.height(0.0, 0.0), down.height(2.0, 0.0) < 0.0
        (0.0, True)
    """
    if direction not in ("down", "up"):
        raise ValueError(f"direction: must be 'down' or 'up', is {show(direction)}")
    if not 0.0 < angle_deg <= 45.0:
        raise ValueError(f"angle_deg: must be above 0 and at most 45, is {show(angle_deg)}")
    for value, name in ((start, "start"), (length, "length")):
        if not 0.0 < value <= 100.0:
            raise ValueError(f"{name}: must be above 0 and at most 100 m, is {show(value)}")
    surface = _surface(rolling_resistance)
    rise = length * math.tan(math.radians(angle_deg)) * (1.0 if direction == "up" else -1.0)
    profile = [(-2.0, 0.0), (start, 0.0), (start + length, rise), (start + length + 8.0, rise)]
    regions = (_strip(a, b, surface, "ramp") for a, b in itertools.pairwise(profile))
    return Terrain(f"ramp-{direction}", tuple(regions))


def stepping_stones(
    gap: float = 0.2,
    stone: float = 0.25,
    stones: int = 2,
    start: float = 0.3,
    rolling_resistance: float = 0.0,
) -> Terrain:
    """Two platforms at z = 0 with stones between them, each a group of its own (Paper A, IV-A.5).

    Args:
        gap: free distance between neighbours along x.
        stone: extent of each stone along x.
        stones: how many stones stand between the platforms.
        start: x at which the first platform ends.
        rolling_resistance: rolling friction over normal force.

    Raises:
        ValueError: a parameter is out of range.
    """
    for value, name in ((gap, "gap"), (stone, "stone"), (start, "start")):
        if not SMALLEST_SIZE <= value <= 100.0:
            raise ValueError(f"{name}: must be {SMALLEST_SIZE} to 100 m, is {show(value)}")
    if isinstance(stones, bool) or not isinstance(stones, int) or stones < 0:
        raise ValueError(f"stones: must be a whole number, 0 or more, is {show(stones)}")
    surface = _surface(rolling_resistance)
    first = [start + gap + i * (stone + gap) for i in range(stones + 1)]
    spans = [(-2.0, start), *((x, x + stone) for x in first[:-1]), (first[-1], first[-1] + 8.0)]
    regions = [_strip((a, 0.0), (b, 0.0), surface, f"stone {i}") for i, (a, b) in enumerate(spans)]
    return Terrain("stepping-stones", tuple(regions))


# Rolling resistance 0.005 is that of hard rubber on a smooth floor. Paper A gives no number.
_BUILTIN = {
    "flat": flat,
    "flat-friction": lambda: flat(rolling_resistance=0.005),
    "ramp-down": lambda: ramp(direction="down"),
    "ramp-up": lambda: ramp(direction="up"),
    "stepping-stones": stepping_stones,
}
BUILTIN_NAMES = tuple(_BUILTIN)


def builtin(name: str) -> Terrain:
    """One of the paper's five terrains by its command-line name.

    Args:
        name: one of ``BUILTIN_NAMES``. "flat-friction" has rolling resistance 0.005, the ramps 12 degrees.

    Raises:
        ValueError: unknown name; the message suggests the closest one.
    """
    if name in _BUILTIN:
        return _BUILTIN[name]()
    close = difflib.get_close_matches(str(name), BUILTIN_NAMES, n=1)
    hint = f"did you mean {close[0]!r}? " if close else ""
    known = ", ".join(BUILTIN_NAMES)
    raise ValueError(f"unknown terrain {show(name)}: {hint}known are {known} and files ending in .json")


def named_or_file(text: str) -> Terrain:
    """The terrain that a command-line argument means: a built-in name, or a path ending in .json."""
    if text.lower().endswith(".json"):
        return Terrain.load(text)
    return builtin(text)


def _surface(rolling_resistance: float) -> dict[str, float]:
    """Contact parameters of the built-in terrains.

    Wheels get no traction: the 0.02 that bearings have would be 0.2 m/s² of free propulsion in the plan.
    """
    return {
        "mu_foot": 0.7,
        "mu_wheel": 0.0,
        "mu_wheel_lateral": 0.7,
        "rolling_resistance": rolling_resistance,
    }


def _strip(a: tuple[float, float], b: tuple[float, float], surface: dict[str, float], group: str) -> Region:
    """The 4 m wide rectangle over the segment from a to b in the (x, z) plane."""
    (x0, z0), (x1, z1) = a, b
    return Region([[x0, -2.0, z0], [x1, -2.0, z1], [x1, 2.0, z1], [x0, 2.0, z0]], **surface, group=group)


class _Object(dict):
    """A JSON object that remembers a key given twice, which ``dict`` would swallow."""

    def __init__(self, pairs: list[tuple[str, Any]]) -> None:
        super().__init__(pairs)
        names = [name for name, _ in pairs]
        self.duplicates = [name for name in self if names.count(name) > 1]


def _check_keys(data: Any, keys: tuple[str, ...], where: str) -> None:
    """Raise ValueError unless ``data`` is an object with exactly these keys, each once."""
    if not isinstance(data, dict):
        raise ValueError(f"{where}: must be an object, is {show(data)}")
    for key in getattr(data, "duplicates", ()):
        raise ValueError(f"{where}: {show(key)} stands twice")
    for key in keys:
        if key not in data:
            raise ValueError(f"{where}: {key}: missing")
    for key in data:
        if key not in keys:
            raise ValueError(f"{where}: unknown key {show(key)}, known are {', '.join(keys)}")


def _checked_coefficient(value: Any, field: str) -> float:
    number = checked_number(value, field)
    if number < 0.0:
        raise ValueError(f"{field}: must not be negative, is {show(value)}")
    return number


def _check_text(value: Any, field: str) -> None:
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise ValueError(f"{field}: must be printable text, is {show(value)}")
