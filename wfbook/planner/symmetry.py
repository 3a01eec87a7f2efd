"""Mirror images: where left and right can be exchanged, one of each pair of gaits is enough."""

from typing import Any

import numpy as np

from wfbook.planner.problem import Problem
from wfbook.terrain import Region

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
    patterns = {frozenset(p) for p in problem.patterns}
    return bool(
        contacts
        and abs(problem.goal[1] - axis) < tolerance
        and np.abs(sideways).max() < tolerance
        and (state.swung == state.swung[list(MIRROR)]).all()
        and kinds == [kinds[m] for m in MIRROR]
        and mirrored_regions(problem) is not None
        and patterns == {frozenset(MIRROR[leg] for leg in p) for p in patterns}
    )


def mirrored_regions(problem: Problem) -> np.ndarray | None:
    """Return the index of each region's mirror image, ``(R,)``; None if the terrain is not symmetric."""
    axis, found = problem.start[1], []
    keys = [_numbers(region, region.vertices) for region in problem.terrain.regions]
    groups: dict[int, int] = {}
    for r, region in enumerate(problem.terrain.regions):
        image = region.vertices * [1, -1, 1] + [0, 2 * axis, 0]
        matches = [i for i, key in enumerate(keys) if key == _numbers(region, image)]
        if not matches:
            return None
        found.append(matches[0])
        group = problem.ground.group_of[[r, matches[0]]]
        if groups.setdefault(group[0], group[1]) != group[1]:
            return None
    return np.array(found) if len(set(found)) == len(found) else None


def _numbers(region: Region, vertices: np.ndarray) -> tuple:
    """Return what two equal regions have in common, whatever corner they begin with."""
    corners = sorted(map(tuple, (np.round(vertices, 9) + 0.0).tolist()))
    surface = (region.mu_foot, region.mu_wheel, region.mu_wheel_lateral, region.rolling_resistance)
    return (*corners, *surface)


def mirror_row(S: Any) -> Any:
    """Return a function of the gait that changes sign when it is mirrored."""
    falling = 0.5 ** np.arange(S.shape[1])
    return (S[0] - S[1]) @ falling + 0.5 * (S[2] - S[3]) @ falling
