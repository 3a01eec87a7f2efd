"""Ground that is not as the plan thinks: of another friction, or in patches higher and lower."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from wfbook.polygon import SMALLEST_SIZE
from wfbook.terrain import Region, Terrain

if TYPE_CHECKING:
    from wfbook.planner.plan import Plan

PATCH = 0.3
"""Length of a patch along the way, m."""

_MARGIN = 0.1


def real_terrain(plan: "Plan", friction: float, error: float, rng: np.random.Generator) -> Terrain:
    """Return the ground on which a plan is really executed.

    Regions keep their shape and slope, but are cut into patches: each that is longer than two patches every
    ``PATCH`` along the way, and all of them into a left and a right half. Each patch is raised by a height
    that is uniform between ``-error`` and ``error``, apart from the ground at the start and behind: there
    the robot stands, and knows it.

    Args:
        plan: to be executed.
        friction: multiplies the friction coefficients of feet and, sideways, of wheels.
        error: largest height error, m; without one, nothing is cut.
        rng: draws the heights.
    """
    terrain = plan.terrain
    if friction != 1.0:
        scaled = (
            replace(r, mu_foot=friction * r.mu_foot, mu_wheel_lateral=friction * r.mu_wheel_lateral)
            for r in terrain.regions
        )
        terrain = replace(terrain, regions=tuple(scaled))
    if error == 0.0:
        return terrain
    first, last = plan.p[0, :, 0].max() + _MARGIN, plan.p[..., 0].max()
    cuts = np.arange(first, max(last, first) + PATCH, PATCH)
    middle = float(plan.p[0, :, 1].mean())
    regions = []
    for region in terrain.regions:
        for patch in _patches(region, cuts, middle):
            known = any(patch.contains(x, y) for x, y, _ in plan.p[0]) or patch.vertices[:, 0].max() <= first
            height = rng.uniform(-error, error)  # drawn in any case: errors of one seed differ by scale only
            up = np.array([0.0, 0.0, 0.0 if known else height])
            regions.append(replace(patch, vertices=patch.vertices + up))
    return Terrain(terrain.name, tuple(regions))


def _patches(region: Region, cuts: np.ndarray, middle: float) -> list[Region]:
    """Cut a region across the way at some x, if it is long, and along it at one y."""
    pieces = [region.vertices]
    lines = [(1, middle)]
    if np.ptp(region.vertices[:, 0]) > 2 * PATCH:
        lines += [(0, float(x)) for x in cuts]
    for axis, at in lines:
        pieces = [half for piece in pieces for half in _halves(piece, axis, at)]
    return [replace(region, vertices=piece) for piece in pieces]


def _halves(vertices: np.ndarray, axis: int, at: float) -> list[np.ndarray]:
    """Cut a convex polygon ``(n, 3)`` where a coordinate has a value; a sliver stays with the other half."""
    side = vertices[:, axis] - at
    if max(side.min(), -side.max()) >= -SMALLEST_SIZE:
        return [vertices]
    halves = []
    for sign in (-1.0, 1.0):
        corners = []
        for here, there, a, b in zip(
            vertices, np.roll(vertices, -1, axis=0), sign * side, sign * np.roll(side, -1), strict=True
        ):
            if a >= 0.0:
                corners.append(here)
            if a * b < 0.0:
                corners.append(here + a / (a - b) * (there - here))
        halves.append(_without_doubles(np.array(corners)))
    return halves


def _without_doubles(corners: np.ndarray) -> np.ndarray:
    """Drop corners on the one before: a cut close to a corner makes two of it."""
    apart = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) >= SMALLEST_SIZE
    return corners[apart]
