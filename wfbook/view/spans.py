"""From matrices to stretches of time: when a leg stands on what, for figures and replays alike."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wfbook.view.style import SWINGING


class Span(NamedTuple):
    """A leg keeps one mode over the half-open range ``[start, stop)`` of slots or of samples."""

    leg: int
    mode: int
    start: int
    stop: int


def plan_modes(swing_matrix: np.ndarray, end_effector: np.ndarray) -> np.ndarray:
    """Return each leg's mode in each slot.

    Args:
        swing_matrix: (L, J), 1 where the leg swings (Paper A's S).
        end_effector: (L, J), 0 foot or 1 wheel (from Paper A's D).

    Returns:
        (L, J) integers: 0 stands on its foot, 1 on its wheel, 2 swings.
    """
    return np.where(np.asarray(swing_matrix) == 1, SWINGING, np.asarray(end_effector)).astype(int)


def spans(modes: np.ndarray) -> list[Span]:
    """Return the stretches of constant mode.

    Args:
        modes: (L, T), the mode of leg l in slot (or sample) t.

    Returns:
        Spans in the order of legs, then of time; together they cover every slot of every leg once.
    """
    found = []
    for leg, row in enumerate(np.asarray(modes)):
        edges = [0, *(np.flatnonzero(np.diff(row)) + 1), len(row)]
        found += [Span(leg, int(row[start]), int(start), int(stop)) for start, stop in pairwise(edges)]
    return found
