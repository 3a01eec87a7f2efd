"""Chapter 8: what is under each leg, and where its normal points.

A plan names a region for every foothold. A wheel then rolls on, over the edges of its group's regions,
and a foot may stand on an edge too. There the ground has no normal of its own, but the contact has: foot and
wheel are round, so they touch the nearest point of the ground, and the force goes through their centre.
On the face of a region that is the region's normal. Over the crest of a ramp it turns as the wheel rolls
over: taken from the region below instead, it would jump by the angle of the ramp before the wheel is
there, and the controller would push the wheel back with a force that the ground does not return.
"""

from typing import TYPE_CHECKING

import numpy as np

from wfbook.reference import Ground

if TYPE_CHECKING:
    from wfbook.terrain import Terrain

_WELL_INSIDE = 0.06
"""Farther than this from every edge, a foot or wheel touches no other region."""

_TOUCHING = 0.0015
"""By how much farther another face may be that is touched too."""

_STEEPEST = np.cos(np.radians(60.0))


class Footing:
    """Where four legs stand.

    Args:
        terrain: the ground.
        places: ``(4, 3)`` points over or near which they stand.
        regions: ``(4,)`` index of the region of a leg that stands over none.

    Attributes:
        landed: ``(4,)`` index of the region on which each leg landed or is to land.
        regions: ``(4,)`` index of the region under each leg: a wheel may have left that on which it landed.
        normals: ``(4, 3)`` of the ground there.
    """

    def __init__(self, terrain: "Terrain", places: np.ndarray, regions: np.ndarray) -> None:
        self.terrain = terrain
        found = [terrain.region_at(x, y) for x, y in places[:, :2]]
        self.landed = np.array([r if f is None else f for f, r in zip(found, regions, strict=True)])
        self.regions = self.landed.copy()
        self.normals = np.array([terrain.regions[r].normal for r in self.regions])
        groups = [region.group for region in terrain.regions]
        self._joined = [[i for i, group in enumerate(groups) if group == own] for own in groups]

    def ground(self) -> Ground:
        """Return what the controller needs to know of it."""
        return Ground.under(self.terrain, self.regions, self.normals.copy())

    def land(self, leg: int, region: int) -> None:
        """Note that a leg lifts, and on which region it will land."""
        self.landed[leg] = self.regions[leg] = region
        self.normals[leg] = self.terrain.regions[region].normal

    def stand(self, leg: int, centre: np.ndarray, ahead: float = 0.0) -> None:
        """Look at what is under a standing leg: its region, or one that continues it (Paper A, eq. 23).

        Args:
            leg: index.
            centre: ``(3,)`` of its foot or wheel.
            ahead: velocity along x with which a wheel is to roll.
        """
        own = self.terrain.regions[self.regions[leg]]
        if own.outside(centre[0], centre[1]) < -_WELL_INSIDE:
            self.normals[leg] = own.normal
            return
        # Its own region comes first, and stays in a tie.
        joined = sorted(self._joined[self.regions[leg]], key=lambda i: i != self.regions[leg])
        faces = [self.terrain.regions[i].normal for i in joined]
        away = np.array([centre - self.terrain.regions[i].nearest(centre) for i in joined])
        distance = np.linalg.norm(away, axis=1)
        chosen = int(np.argmin(np.round(distance, 9)))
        if ahead:
            # In a hollow a wheel touches two faces; it will leave the one from which its motion leads away.
            touched = distance < distance[chosen] + _TOUCHING
            touched &= np.sum(away * faces, axis=1) > (1.0 - 1e-9) * distance
            leads_away = np.where(touched, ahead * np.array(faces)[:, 0], np.inf)
            if touched[chosen]:
                chosen = int(np.argmin(np.round(leads_away, 9)))
        self.regions[leg] = joined[chosen]
        self.normals[leg] = faces[chosen]
        if away[chosen] @ faces[chosen] > _STEEPEST * distance[chosen]:
            self.normals[leg] = away[chosen] / distance[chosen]

    def astray(self, leg: int, centre: np.ndarray, radius: float, rolls: bool) -> float:
        """Return how far a standing leg's lowest point is beside the regions on which it may be; 0 on them.

        Args:
            leg: index.
            centre: ``(3,)`` of its foot or wheel.
            radius: of that.
            rolls: whether it is a wheel, which may be anywhere in the group of the region where it landed.
        """
        landed = int(self.landed[leg])
        aside = []
        for region in (self.terrain.regions[i] for i in (self._joined[landed] if rolls else [landed])):
            x, y, _ = centre - radius * region.normal
            aside.append(region.outside(x, y))
        return max(0.0, min(aside))
