"""A gait: everything about contacts that is a whole number."""

from typing import NamedTuple

import numpy as np

UNKNOWN = -1
"""A region that is not chosen yet."""


class Gait(NamedTuple):
    """Which leg swings when, what it carries, and where it stands when each slot ends.

    Attributes:
        S: ``(L, J)`` swing matrix.
        wheel: ``(L, J)`` 1 where a leg carries, or will land on, its wheel.
        region: ``(L, J)`` index of the region under the contact at the end of the slot. On one region
            all zeros; :data:`UNKNOWN` where it is left open.
    """

    S: np.ndarray
    wheel: np.ndarray
    region: np.ndarray

    @property
    def key(self) -> bytes:
        """Equal for equal gaits only."""
        return np.concatenate([np.ravel(part) for part in self]).astype(np.int16).tobytes()

    @classmethod
    def from_key(cls, key: bytes, legs: int) -> "Gait":
        """Return the gait with a key."""
        return cls(*np.frombuffer(key, np.int16).reshape(3, legs, -1).astype(int))

    @property
    def modes(self) -> bytes:
        """Equal for gaits that differ in regions only."""
        return np.concatenate([np.ravel(self.S), np.ravel(self.wheel)]).astype(np.int8).tobytes()

    def open(self) -> "Gait":
        """Return the gait with its regions left open."""
        return self._replace(region=np.full_like(self.S, UNKNOWN))
