"""Mirror images: where left and right can be exchanged, one of each pair of gaits is enough."""

from typing import Any

import numpy as np

from wfbook.planner.problem import Problem

MIRROR = (1, 0, 3, 2)
"""The leg on the other side: FL and FR, RL and RR."""


def mirror_symmetric(problem: Problem) -> bool:
    """Tell whether mirroring left and right leaves a problem as it is.

    Then every plan has a mirror image of the same cost, and one of the two is enough.
    """
    axis, tolerance = problem.start[1], 1e-9
    mirrored = np.asarray(problem.start_contacts)[list(MIRROR)]
    contacts = np.abs(mirrored[:, 0] - problem.start_contacts[:, 0]).max() < tolerance
    contacts &= np.abs(2 * axis - mirrored[:, 1] - problem.start_contacts[:, 1]).max() < tolerance
    state = problem.start_state
    # Velocity along y and angles about x and z change sign in the mirror.
    sideways = np.array([state.velocity[1], *state.angles[[0, 2]], *state.rates[[0, 2]]])
    kinds = list(problem.start_end_effectors)
    A, b = problem.region.halfspaces
    sides = {(round(r[0], 9), round(r[1], 9), round(c, 9)) for r, c in zip(A, b, strict=True)}
    images = {
        (round(r[0], 9), round(-r[1], 9), round(c - 2 * axis * r[1], 9)) for r, c in zip(A, b, strict=True)
    }
    patterns = {frozenset(p) for p in problem.patterns}
    return bool(
        contacts
        and abs(problem.goal[1] - axis) < tolerance
        and np.abs(sideways).max() < tolerance
        and (state.swung == state.swung[list(MIRROR)]).all()
        and kinds == [kinds[m] for m in MIRROR]
        and sides == images
        and patterns == {frozenset(MIRROR[leg] for leg in p) for p in patterns}
    )


def mirror_row(S: Any) -> Any:
    """Return a function of the gait that changes sign when it is mirrored."""
    falling = 0.5 ** np.arange(S.shape[1])
    return (S[0] - S[1]) @ falling + 0.5 * (S[2] - S[3]) @ falling
