"""Chapter 12: what sensors add to what they measure, white from one tick to the next."""

from dataclasses import astuple, dataclass

import numpy as np
import pinocchio as pin

from wfbook.omni.robot import NU, NV


@dataclass(frozen=True)
class Noise:
    """Standard deviations of what is measured, white from one tick to the next.

    Attributes:
        position, rotation, velocity, spin: of the trunk: m, rad, m/s, rad/s.
        angle, rate: of the joints: rad, rad/s.
    """

    position: float = 5e-4
    rotation: float = 5e-4
    velocity: float = 5e-3
    spin: float = 2e-3
    angle: float = 1e-4
    rate: float = 1e-2

    def times(self, factor: float) -> "Noise":
        """Return so many times as much of it."""
        return Noise(*(factor * deviation for deviation in astuple(self)))

    def disturb(
        self, qpos: np.ndarray, qvel: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return a state ``(30,)``, ``(29,)`` as it is measured."""
        qpos, qvel = qpos.copy(), qvel.copy()
        qpos[:3] += self.position * rng.standard_normal(3)
        turned = pin.Quaternion(*qpos[3:7]) * pin.Quaternion(pin.exp3(self.rotation * rng.standard_normal(3)))
        qpos[3:7] = turned.coeffs()[[3, 0, 1, 2]]
        qpos[7:] += self.angle * rng.standard_normal(NU)
        qvel[:3] += self.velocity * rng.standard_normal(3)
        qvel[3:6] += self.spin * rng.standard_normal(3)
        qvel[6:] += self.rate * rng.standard_normal(NV - 6)
        return qpos, qvel
