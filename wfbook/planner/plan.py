"""What the planner returns, and the file it is kept in."""

import os
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from wfbook import archive
from wfbook.centroidal import contact_torque
from wfbook.modes import END_EFFECTORS, LEGS, end_effector_types, lift_off_types
from wfbook.terrain import Terrain

FORMAT = 1
"""Version of the plan file; a file of another version is refused."""


@dataclass(frozen=True)
class Plan:
    """A trajectory with its contacts: what the mixed-integer program found, or its polish.

    ``L`` legs (FL, FR, RL, RR), ``J`` slots, ``K`` knots, ``R`` regions, ``E`` end effectors.
    SI units, world frame, x forward. ``lam[k]`` and ``f[k]`` act from knot ``k`` to ``k + 1``.

    Attributes:
        t: ``(K+1,)`` time.
        x: ``(K+1, 3)`` centre of mass.
        v: ``(K+1, 3)`` its velocity.
        theta: ``(K+1, 3)`` roll, pitch and yaw, small angles.
        omega: ``(K+1, 3)`` their rates.
        a: ``(K, 3)`` acceleration of the centre of mass.
        alpha: ``(K, 3)`` angular acceleration.
        p: ``(K+1, L, 3)`` contact point of each leg.
        lam: ``(K, L, 3)`` contact force on the robot.
        f: ``(K, L, 3)`` rolling friction on the robot.
        U_plus: ``(K, L, 3)`` upper part of the torque's bound (eq. 9).
        U_minus: ``(K, L, 3)`` lower part; ``(U_plus − U_minus)/4`` is a torque in N m.
        S: ``(L, J)`` int8 swing matrix.
        D: ``(L, J, R, E)`` int8 dynamics matrix.
        c: ``(K, 3)`` centroid of the contacts at knot ``k + 1``.
        terrain: what the plan stands on.
        meta: stage ("relaxed" or "polished"), objective, bound, gap, status, options and more.
    """

    t: np.ndarray
    x: np.ndarray
    v: np.ndarray
    theta: np.ndarray
    omega: np.ndarray
    a: np.ndarray
    alpha: np.ndarray
    p: np.ndarray
    lam: np.ndarray
    f: np.ndarray
    U_plus: np.ndarray
    U_minus: np.ndarray
    S: np.ndarray
    D: np.ndarray
    c: np.ndarray
    terrain: Terrain
    meta: dict[str, Any]

    @property
    def slots(self) -> int:
        """Number of slots ``J``."""
        return self.S.shape[1]

    @property
    def knots(self) -> int:
        """Number of intervals ``K``; there are ``K + 1`` knots."""
        return len(self.t) - 1

    @property
    def dt(self) -> float:
        """Time between knots."""
        return float(self.t[1] - self.t[0])

    @property
    def slot_duration(self) -> float:
        """Duration of a slot."""
        return float(self.t[-1] - self.t[0]) / self.slots

    @property
    def distance(self) -> float:
        """Horizontal distance from the first to the last centre of mass."""
        return float(np.linalg.norm(self.x[-1, :2] - self.x[0, :2]))

    @property
    def end_effector(self) -> np.ndarray:
        """``(L, J)`` int8, 0 foot and 1 wheel; in a swing slot what the leg will land with."""
        return end_effector_types(self.D)

    @property
    def lift_off_end_effector(self) -> np.ndarray:
        """``(L, J)`` int8: what each leg carried at the end of the slot before."""
        return lift_off_types(self.D, self.meta["start_end_effectors"])

    @property
    def middle_lever(self) -> np.ndarray:
        """``(K, L, 3)`` levers ``p − x`` at the middle of each interval."""
        lever = self.p - self.x[:, None]
        return 0.5 * (lever[:-1] + lever[1:])

    @property
    def contact_torque(self) -> np.ndarray:
        """``(K, 3)`` torque about the centre of mass that the contact forces really make (Paper A, eq. 8)."""
        lever, force = (np.moveaxis(part, -1, 0) for part in (self.middle_lever, self.lam))
        return np.stack([torque.sum(axis=1) for torque in contact_torque(lever, force)], axis=-1)

    def with_meta(self, **changes: Any) -> Self:
        """Return the same plan with entries of ``meta`` changed."""
        return replace(self, meta=self.meta | changes)

    def save(self, path: str | os.PathLike) -> None:
        """Write the plan file, whole or not at all.

        Raises:
            OSError: the file can't be written.
        """
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        archive.save(path, arrays, {"terrain": self.terrain.to_dict(), "meta": self.meta}, FORMAT)

    @classmethod
    def load(cls, path: str | os.PathLike) -> Self:
        """Read a plan file.

        Raises:
            ValueError: the file is no plan, is truncated, is of another version, or holds an array
                of a wrong shape or a number that is not finite. The message names file and field.
            OSError: the file can't be read.
        """
        data = archive.load(path, "plan", _ARRAYS, ("terrain", "meta"), FORMAT)
        data["terrain"] = Terrain.from_dict(data["terrain"], source=f"{path}: terrain")
        plan = cls(**data)
        plan._check(path)
        return plan

    def _check(self, path: str | os.PathLike) -> None:
        """Refuse arrays whose shapes do not fit together, and numbers that are not finite."""
        for name in ("S", "D"):
            array = getattr(self, name)
            if not np.issubdtype(array.dtype, np.integer) or not np.isin(array, (0, 1)).all():
                raise ValueError(f"{path}: {name}: entries must be the integers 0 and 1")
        L, J = self.S.shape if self.S.ndim == 2 else (len(LEGS), 0)
        K, R, E = max(self.t.size - 1, 0), len(self.terrain.regions), len(END_EFFECTORS)
        shapes = {name: (K, L, 3) for name in ("lam", "f", "U_plus", "U_minus")}
        shapes |= {name: (K + 1, 3) for name in ("x", "v", "theta", "omega")}
        shapes |= {name: (K, 3) for name in ("a", "alpha", "c")}
        shapes |= {"t": (K + 1,), "p": (K + 1, L, 3), "S": (len(LEGS), J), "D": (L, J, R, E)}
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array.shape != shape:
                raise ValueError(f"{path}: {name}: shape {array.shape}, expected {shape}")
            if array.dtype.kind not in "iuf" or not np.isfinite(array).all():
                raise ValueError(f"{path}: {name}: holds a value that is not a finite number")
        if J < 1 or K % max(J, 1) or np.any(np.diff(self.t) <= 0):
            raise ValueError(f"{path}: t: {K} intervals do not make {J} whole slots in rising time")
        if (self.D.sum(axis=(2, 3)) != 1).any():
            raise ValueError(f"{path}: D: a leg needs one region and one end effector in each slot (eq. 17)")
        for key in ("stage", "start_end_effectors", "swing_height", "com_height"):
            if key not in self.meta:
                raise ValueError(f"{path}: meta: missing key {key!r}")
        for key in ("swing_height", "com_height"):
            value = self.meta[key]
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < np.inf:
                raise ValueError(f"{path}: meta: {key} {value!r} is not a positive number")
        kinds = self.meta["start_end_effectors"]
        if not isinstance(kinds, list) or len(kinds) != L or any(k not in END_EFFECTORS for k in kinds):
            raise ValueError(f"{path}: meta: start_end_effectors {kinds!r}, expected {L} of {END_EFFECTORS}")


_ARRAYS = tuple(field.name for field in fields(Plan) if field.name not in ("terrain", "meta"))
