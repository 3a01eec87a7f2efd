"""Keyframes for Meshcat's animation: rounded, and only those that say something new."""

import numpy as np
from meshcat import Visualizer
from meshcat.animation import Animation, AnimationClip, AnimationTrack

FPS = 30
_DECIMALS = 4
_TYPES = {"position": "vector3", "quaternion": "quaternion", "scale": "vector3", "visible": "bool"}


class Tracks:
    """Collects what moves. A property that never changes becomes a constant, not a track.

    Attributes:
        animation: what Meshcat plays, :data:`FPS` frames a second.
    """

    def __init__(self) -> None:
        self.animation = Animation(default_framerate=FPS)

    def add(self, node: Visualizer, name: str, values: np.ndarray) -> None:
        """Animate a property of a node.

        Args:
            node: where in Meshcat's tree.
            name: "position" or "scale", (N, 3); "quaternion", (N, 4), w x y z; "visible", (N,) bool.
            values: one row for every frame.
        """
        values = np.asarray(values)
        if name == "quaternion":
            values = np.roll(continuous(values), -1, axis=1)  # three.js wants x y z w
        if name != "visible":
            values = np.round(values, _DECIMALS) + 0.0  # + 0.0 turns -0.0 into 0.0
        frames = _telling(values)
        if len(frames) == 1:
            node.set_property(name, values[0].tolist())
            return
        clip = self.animation.clips.setdefault(node.path, AnimationClip(fps=FPS))
        clip.tracks[name] = AnimationTrack(
            name, _TYPES[name], frames=frames.tolist(), values=values[frames].tolist()
        )

    def play(self, visualizer: Visualizer) -> None:
        """Hand the animation to Meshcat, at rest."""
        visualizer.set_animation(self.animation, play=False)


def continuous(quaternions: np.ndarray) -> np.ndarray:
    """Flip signs in (N, 4) so that neighbours are on the same half sphere: q and -q are one rotation."""
    turn = np.sign(np.sum(quaternions[1:] * quaternions[:-1], axis=1))
    turn[turn == 0] = 1.0
    return quaternions * np.cumprod([1.0, *turn])[:, None]


def _telling(values: np.ndarray) -> np.ndarray:
    """Return the frames to keep: those that differ from a neighbour, or the first if none does."""
    rows = values.reshape(len(values), -1)
    change = np.any(rows[1:] != rows[:-1], axis=1)
    if not change.any():
        return np.array([0])
    keep = np.zeros(len(values), dtype=bool)
    keep[:-1] |= change
    keep[1:] |= change
    keep[[0, -1]] = True
    return np.flatnonzero(keep)
