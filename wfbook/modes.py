"""Chapter 3: which leg swings when, and what touches the ground where (Paper A, eqs 10–25).

Two binary arrays say everything a plan decides. The *swing matrix* ``S[l, j]`` is 1 when leg ``l``
is in the air during slot ``j``. The *dynamics matrix* ``D[l, j, r, e]`` is 1 when leg ``l`` belongs
to region ``r`` with end effector ``e`` in slot ``j``; in a swing slot it already says how the leg
will land.
"""

from collections.abc import Iterable

import numpy as np

LEGS = ("FL", "FR", "RL", "RR")
"""The order of legs in every array."""

END_EFFECTORS = ("foot", "wheel")
"""The order of end effectors in ``D[..., e]``."""

DIAGONAL_PATTERNS = ((), (0,), (1,), (2,), (3,), (0, 3), (1, 2))
"""Sets of legs that may swing together: none, one, or a diagonal pair.

Paper A does not say which sets it allows. Two legs of one side or one end leave no support line
under the centre of mass: such plans solve the relaxed program and fall (measured: a rear-pair swing
needs 4.5 N m that no force can give).
"""


def end_effector_types(D: np.ndarray) -> np.ndarray:
    """Return which end effector each leg carries in each slot.

    Args:
        D: dynamics matrix, shape ``(L, J, R, E)``.

    Returns:
        ``(L, J)`` int8: 0 foot, 1 wheel. In a swing slot, the one the leg lands with.
    """
    return D.sum(axis=2).argmax(axis=2).astype(np.int8)


def lift_off_types(D: np.ndarray, start: Iterable[str]) -> np.ndarray:
    """Return which end effector each leg carried at the end of the slot before, ``(L, J)`` int8.

    Args:
        D: dynamics matrix, shape ``(L, J, R, E)``.
        start: the end effector of each leg before slot 0, names of :data:`END_EFFECTORS`.
    """
    first = np.array([[END_EFFECTORS.index(name)] for name in start], dtype=np.int8)
    return np.hstack([first, end_effector_types(D)[:, :-1]])
