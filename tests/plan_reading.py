"""A plan as the checker reads it: the terrain's planes from their corners, and what the binaries say.

Apart from the library, like the checker itself.
"""

import json
from typing import Any

import numpy as np

GRAVITY = 9.81
FOOT, WHEEL = 0, 1


class Plane:
    """One region of the terrain, rebuilt from its vertices."""

    def __init__(self, region: dict[str, Any]) -> None:
        self.corners = np.array(region["vertices"], dtype=float)
        self.group = region["group"]
        self.mu = {
            FOOT: (region["mu_foot"], region["mu_foot"]),
            WHEEL: (region["mu_wheel"], region["mu_wheel_lateral"]),
        }
        self.rolling_resistance = region["rolling_resistance"]
        # The plane through widely spaced corners: least squares over all of them.
        centre = self.corners.mean(axis=0)
        normal = np.linalg.svd(self.corners - centre)[2][2]
        self.n = normal * np.sign(normal[2])
        self.origin = centre
        binormal = np.cross(self.n, [1.0, 0.0, 0.0])
        self.b = binormal / np.linalg.norm(binormal)
        self.t = np.cross(self.b, self.n)

    def outside(self, point: np.ndarray) -> float:
        """How far a point of the plane is outside of the polygon's edges; negative inside."""
        worst = -np.inf
        following = np.roll(self.corners, -1, axis=0)
        for here, there in zip(self.corners, following, strict=True):
            outward = np.cross(there - here, self.n)
            worst = max(worst, float(outward @ (point - here)) / np.linalg.norm(outward))
        return worst

    def distance(self, point: np.ndarray) -> float:
        """How far a contact point is off the polygon: off its plane or outside an edge (eq. 22)."""
        return max(abs(float(self.n @ (point - self.origin))), self.outside(point))

    def over(self, point: np.ndarray, tolerance: float) -> float:
        """How far the polygon is above a point that is under it, not just under its edge; else 0."""
        rise = float(self.n @ (self.origin - point)) / self.n[2]
        return max(0.0, rise) if self.outside(np.add(point, (0.0, 0.0, rise))) < -tolerance else 0.0

    def friction_excess(self, force: np.ndarray, kind: int) -> float:
        """By how much a force is outside of the pyramid (eq. 26)."""
        normal, along, across = self.n @ force, self.t @ force, self.b @ force
        mu_t, mu_b = self.mu[kind]
        return max(0.0, -normal, abs(along) - mu_t * normal, abs(across) - mu_b * normal)


class Trajectory:
    """The plan's arrays, and what follows from its binaries."""

    ARRAYS = (
        "t",
        "x",
        "v",
        "theta",
        "omega",
        "a",
        "alpha",
        "p",
        "lam",
        "f",
        "U_plus",
        "U_minus",
        "S",
        "D",
        "c",
    )

    def __init__(self, plan: Any) -> None:
        get = plan.__getitem__ if hasattr(plan, "__getitem__") else lambda name: getattr(plan, name)
        for name in self.ARRAYS:
            setattr(self, name, np.asarray(get(name)))
        self.meta = _parsed(get("meta"))
        terrain = _parsed(get("terrain"))
        self.planes = [Plane(region) for region in terrain["regions"]]
        self.weight = self.meta["mass"] * GRAVITY
        self.J = self.S.shape[1] if self.S.ndim == 2 else 0
        self.K = len(self.t) - 1
        self.rho = self.K // max(self.J, 1)
        self.dt = (self.t[-1] - self.t[0]) / max(self.K, 1)

    def slot(self, k: int) -> int:
        """The slot of interval k, from knot k to k + 1."""
        return k // self.rho

    def swings(self, leg: int, k: int) -> bool:
        """Whether a leg swings during interval k."""
        return bool(self.S[leg, self.slot(k)])

    def kind(self, leg: int, j: int) -> int:
        """The end effector of slot j; of the start for j = −1."""
        if j < 0:
            return ("foot", "wheel").index(self.meta["start_end_effectors"][leg])
        return int(self.D[leg, j].sum(axis=0).argmax())

    def plane(self, leg: int, j: int) -> Plane:
        """The region of slot j: where a foot stands, where a wheel touched down, where either will land."""
        return self.planes[int(self.D[leg, j].sum(axis=1).argmax())]

    def allowed_planes(self, leg: int, j: int) -> list[Plane]:
        """The planes that a leg may touch in slot j: a wheel all those of its region's group (eq. 23)."""
        own = self.plane(leg, j)
        if self.kind(leg, j) == FOOT:
            return [own]
        return [plane for plane in self.planes if plane.group == own.group]

    def lever(self, k: int, leg: int) -> np.ndarray:
        """The lever p − x at the middle of interval k."""
        return 0.5 * (self.p[k, leg] - self.x[k] + self.p[k + 1, leg] - self.x[k + 1])


def _parsed(value: Any) -> dict[str, Any]:
    if isinstance(value, dict):
        return value
    return value.to_dict() if hasattr(value, "to_dict") else json.loads(str(value))
