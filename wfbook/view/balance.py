"""What a replay shows of a robot that is pushed: the push, the zero-moment point, and where that may be."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from meshcat import Visualizer

from wfbook.view import scene
from wfbook.view.style import FORCE, LIMIT
from wfbook.view.tracks import Tracks

if TYPE_CHECKING:
    from wfbook.omni.tipping import Tipping

_LIFT = 0.004
"""So much above the ground lines are drawn, that it does not hide them."""


@dataclass(frozen=True)
class Balance:
    """N frames.

    Attributes:
        zmp: (N, 3) zero-moment point; NaN while nothing presses.
        area: (k, 3) corners of the area of support.
        push: (N, 3) force from outside.
        at: (N, 3) where it acts.
    """

    zmp: np.ndarray
    area: np.ndarray
    push: np.ndarray
    at: np.ndarray


def balance_of(tipping: "Tipping", at: np.ndarray) -> Balance:
    """Sample a robot that is pushed over; the area is that of its contacts when the push begins.

    Args:
        tipping: what happened.
        at: (N,) indices of the samples that are shown.
    """
    from wfbook.omni.support import support_area

    area = support_area(tipping.contacts(int(np.searchsorted(tipping.t, 0.0))))
    return Balance(
        zmp=np.column_stack([tipping.zmp[at], np.full(len(at), _LIFT)]),
        area=np.column_stack([area, np.full(len(area), _LIFT)]),
        push=tipping.push[at],
        at=tipping.at[at],
    )


def draw_balance(node: Visualizer, tracks: Tracks, balance: Balance) -> None:
    """Draw the area as rods and animate the zero-moment point as a ball; the push is an arrow like others."""
    ends = np.roll(balance.area, -1, axis=0)
    for k, (start, stop) in enumerate(zip(balance.area, ends, strict=True)):
        scene.add_rod(node["area"][str(k)], start, stop, LIMIT)
    known = np.isfinite(balance.zmp).all(axis=1)
    scene.add_ball(node["zmp"], FORCE)
    tracks.add(node["zmp"], "visible", known)
    tracks.add(node["zmp"], "position", np.where(known[:, None], balance.zmp, 0.0))
