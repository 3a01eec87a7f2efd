"""What a replay draws: the robot of an MJCF, the ground, arrows, lines and prints, as Meshcat objects."""

import mujoco
import numpy as np
from meshcat import Visualizer
from meshcat import geometry as g

from wfbook.terrain import Terrain
from wfbook.view.style import BODY, FOOT, INK, WHEEL, hex_to_int

_TILE = 0.25
_TILE_COLOURS = ("#FAFAFA", "#E9E9E9")
_SKIRT_COLOUR = "#B4BAC2"
_SKIRT = 0.06
"""Depth of the sides that a region shows where the ground ends or bends."""
_GLOW = 0.3
"""How much of an end effector's colour survives in the robot's own shade."""
_COLLISION_GROUP = 3
"""MuJoCo's custom: geoms of this group and above collide and are not drawn."""


def material(colour: str, **options: object) -> g.Material:
    """Return a matt material of a colour ``"#RRGGBB"``."""
    return g.MeshLambertMaterial(color=hex_to_int(colour), reflectivity=0.0, **options)


def signal(colour: str) -> g.Material:
    """Return a material that is seen through everything else, in the same colour in light and shade."""
    return g.MeshBasicMaterial(color=hex_to_int(colour), transparent=True, opacity=0.95, depthTest=False)


def pose(position: np.ndarray, rotation: np.ndarray | None = None) -> np.ndarray:
    """Return the (4, 4) transform of a position (3,) and a rotation matrix (3, 3)."""
    transform = np.eye(4)
    transform[:3, 3] = position
    if rotation is not None:
        transform[:3, :3] = rotation
    return transform


def aligning(directions: np.ndarray) -> np.ndarray:
    """Return unit quaternions (N, 4), w x y z, that turn +y into each of the directions (N, 3)."""
    y = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    # Half way between +y and the direction; straight down is half a turn about x.
    quaternions = np.column_stack((1.0 + y[:, 1], y[:, 2], np.zeros(len(y)), -y[:, 0]))
    quaternions[y[:, 1] < -1.0 + 1e-9] = (0.0, 1.0, 0.0, 0.0)
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def body_nodes(visualizer: Visualizer, model: mujoco.MjModel) -> dict[int, Visualizer]:
    """Return Meshcat's node of each body but the world, nested as the bodies are.

    With nested nodes a link keeps its length between two keyframes, and a hinge needs no position track.
    """
    nodes = {0: visualizer["robot"]}
    for body in range(1, model.nbody):
        name = model.body(body).name or f"body{body}"
        nodes[body] = nodes[int(model.body_parentid[body])][name]
    del nodes[0]
    return nodes


def add_robot(visualizer: Visualizer, model: mujoco.MjModel) -> dict[str, Visualizer]:
    """Draw the geoms of a model in the frames of their bodies.

    Returns:
        The nodes of the named geoms: to hide the feet and the wheels that are not in use.
    """
    nodes, named = body_nodes(visualizer, model), {}
    for i in range(model.ngeom):
        geom = model.geom(i)
        body = int(geom.bodyid[0])
        if body == 0 or geom.group[0] >= _COLLISION_GROUP:
            continue
        name = geom.name or f"geom{i}"
        node = nodes[body]["geoms"][name]
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, geom.quat)
        node.set_transform(pose(geom.pos, rotation.reshape(3, 3) @ _upright(model, i)))
        if name.endswith("_foot"):
            # A little larger than it is, else the calf's mesh hides it.
            node.set_object(
                g.Sphere(1.2 * float(geom.size[0])),
                material(FOOT, emissive=hex_to_int(FOOT), emissiveIntensity=_GLOW),
            )
        elif name.endswith("_wheel"):
            node["tyre"].set_object(
                _geometry(model, i), material(WHEEL, emissive=hex_to_int(WHEEL), emissiveIntensity=_GLOW)
            )
            node["spoke"].set_object(_spoke(model, i), material(INK))
        else:
            node.set_object(_geometry(model, i), material(BODY))
        named[name] = node
    return named


def add_ghost(node: Visualizer, model: mujoco.MjModel, colour: str) -> None:
    """Draw the trunk alone, to be seen through, a little larger than it is: it may be where the robot is."""
    trunk = model.body("trunk").id
    for i in np.flatnonzero(model.geom_bodyid == trunk):
        if model.geom_group[i] >= _COLLISION_GROUP:
            continue
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[i])
        part = node[f"geom{i}"]
        part.set_transform(pose(model.geom_pos[i], 1.04 * rotation.reshape(3, 3) @ _upright(model, int(i))))
        part.set_object(_geometry(model, int(i)), material(colour, transparent=True, opacity=0.5))


def _geometry(model: mujoco.MjModel, index: int) -> g.Geometry:
    """Return the Meshcat shape of a geom, in the geom's frame."""
    kind, size = mujoco.mjtGeom(int(model.geom_type[index])), model.geom_size[index]
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return g.Sphere(float(size[0]))
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return g.Ellipsoid(size.tolist())
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return g.Box((2.0 * size).tolist())
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return g.Cylinder(2.0 * float(size[1]), float(size[0]))
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.mesh(int(model.geom_dataid[index]))
        vertices = model.mesh_vert[mesh.vertadr[0] :][: mesh.vertnum[0]]
        faces = model.mesh_face[mesh.faceadr[0] :][: mesh.facenum[0]]
        return g.TriangularMeshGeometry(vertices, faces)
    raise ValueError(f"geom {model.geom(index).name!r}: type {kind.name} can't be drawn in a replay")


def _upright(model: mujoco.MjModel, index: int) -> np.ndarray:
    """Return the rotation (3, 3) from Meshcat's axes of a shape to MuJoCo's: its cylinders stand along y."""
    if int(model.geom_type[index]) == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    return np.eye(3)


def _spoke(model: mujoco.MjModel, index: int) -> g.Geometry:
    """Return a bar across a wheel, as thick as its axle: a plain disc would not show that it rolls."""
    radius, half, _ = model.geom_size[index].tolist()
    return g.Box([1.7 * radius, 2.02 * half, 0.3 * radius])


def add_arrow(node: Visualizer, colour: str) -> None:
    """Draw an arrow of length 1 along +y: turn and stretch it by animation."""
    node["shaft"].set_object(g.Cylinder(0.8, 0.008), signal(colour))
    node["shaft"].set_transform(pose([0.0, 0.4, 0.0]))
    node["head"].set_object(g.Cylinder(0.2, radiusTop=0.0, radiusBottom=0.02), signal(colour))
    node["head"].set_transform(pose([0.0, 0.9, 0.0]))


def add_ball(node: Visualizer, colour: str, radius: float = 0.022) -> None:
    """Draw a ball that is seen through everything else."""
    node.set_object(g.Sphere(radius), signal(colour))


def add_rod(node: Visualizer, start: np.ndarray, stop: np.ndarray, colour: str) -> None:
    """Draw a thin rod between two points (3,), where a line one pixel wide would be lost."""
    node.set_object(g.Cylinder(float(np.linalg.norm(stop - start)), 0.004), material(colour))
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, aligning((stop - start)[None])[0])
    node.set_transform(pose(0.5 * (start + stop), turn.reshape(3, 3)))


def add_line(node: Visualizer, points: np.ndarray, colour: str) -> None:
    """Draw a line through points (N, 3)."""
    geometry = g.PointsGeometry(np.asarray(points, dtype=np.float32).T)
    node.set_object(g.Line(geometry, g.LineBasicMaterial(color=hex_to_int(colour))))


def add_print(node: Visualizer, start: np.ndarray, stop: np.ndarray, normal: np.ndarray, colour: str) -> None:
    """Draw where an end effector stands on the ground, or along which stroke (start, stop, (3,)) it rolls."""
    height, width = 0.002, 0.036
    y = np.asarray(normal, dtype=float)
    x = np.array([1.0, 0.0, 0.0]) - y[0] * y
    stroke = stop - start
    length = float(np.linalg.norm(stroke))
    if length > 1e-3:
        x = stroke - (stroke @ y) * y
    x /= np.linalg.norm(x)
    rotation = np.column_stack((x, y, np.cross(x, y)))
    paint = material(colour, transparent=True, opacity=0.55)
    if length > 1e-3:
        node["track"].set_object(g.Box([length, height, 0.5 * width]), paint)
        node["track"].set_transform(pose(0.5 * (start + stop), rotation))
    node["spot"].set_object(g.Cylinder(1.5 * height, 0.5 * width), paint)
    node["spot"].set_transform(pose(start, rotation))


def add_light(lights: Visualizer, reach: float) -> None:
    """Light the scene from above so that what is off the ground is seen by its shadow.

    Args:
        lights: Meshcat's node of lights; its own, which cast no shadow, are put out.
        reach: how far from the world's origin shadows fall.
    """
    for name in ("PointLightNegativeX", "PointLightPositiveX", "FillLight"):
        lights[name].set_property("visible", False)
    lights["AmbientLight/<object>"].set_property("intensity", 0.55)
    lights["Sun"].set_object(_Sun(reach))


class _Sun(g.Object):
    """A light from one direction, which Meshcat's viewer knows and its Python side does not."""

    def __init__(self, reach: float) -> None:
        g.SceneElement.__init__(self)
        self.camera = g.OrthographicCamera(-reach, reach, reach, -reach, 0.1, 40.0)
        self.camera.uuid = f"{self.uuid} camera"
        self.intensity = 0.5

    def lower(self) -> dict:
        shadow = {"camera": self.camera.lower()["object"], "mapSize": [2048, 2048], "bias": -0.001}
        light = {
            "uuid": self.uuid,
            "type": "DirectionalLight",
            "color": 0xFFFFFF,
            "intensity": self.intensity,
        }
        matrix = pose([-2.0, -3.0, 12.0]).T.ravel().tolist()
        return {
            "metadata": {"version": 4.5, "type": "Object"},
            "geometries": [],
            "materials": [],
            "object": light | {"matrix": matrix, "castShadow": True, "shadow": shadow},
        }


def add_terrain(visualizer: Visualizer, terrain: Terrain, low: np.ndarray, high: np.ndarray) -> None:
    """Draw the regions as a chequerboard of 25 cm tiles, cut off at the box from low (2,) to high (2,).

    Several regions have outlines and sides: one sees where the ground bends, and where there is none.
    """
    cells_low = np.floor(low / _TILE).astype(int)
    cells_high = np.ceil(high / _TILE).astype(int)
    for shade, colour in enumerate(_TILE_COLOURS):
        vertices: list[np.ndarray] = []
        faces: list[tuple[int, int, int]] = []
        for region in terrain.regions:
            corners = region.vertices[:, :2]
            first = np.maximum(cells_low, np.floor(corners.min(axis=0) / _TILE).astype(int))
            last = np.minimum(cells_high, np.ceil(corners.max(axis=0) / _TILE).astype(int))
            for i, j in np.ndindex(*np.maximum(last - first, 0)):
                cell = first + np.array([i, j])
                if cell.sum() % 2 != shade:
                    continue
                tile = clip(corners, _TILE * cell, _TILE * (cell + 1))
                start = len(vertices)
                vertices += [np.array([x, y, region.height(x, y)]) for x, y in tile]
                faces += [(start, start + k, start + k + 1) for k in range(1, len(tile) - 1)]
        if faces:
            node = visualizer["terrain"][f"tiles{shade}"]
            node.set_object(g.TriangularMeshGeometry(vertices, faces), material(colour))
    if len(terrain.regions) > 1:
        _add_sides(visualizer["terrain"], terrain, low, high)


def _add_sides(node: Visualizer, terrain: Terrain, low: np.ndarray, high: np.ndarray) -> None:
    """Draw a line round every region and the sides below it."""
    vertices: list[np.ndarray] = []
    faces: list[tuple[int, int, int]] = []
    for index, region in enumerate(terrain.regions):
        outline = clip(region.vertices[:, :2], low, high)
        if not len(outline):
            continue
        rim = np.array([[x, y, region.height(x, y)] for x, y in outline])
        loop = np.vstack([rim, rim[:1]]) + np.array([0.0, 0.0, 0.001])
        add_line(node[f"outline{index}"], loop, _SKIRT_COLOUR)
        start, n = len(vertices), len(rim)
        vertices += [*rim, *(rim - np.array([0.0, 0.0, _SKIRT]))]
        for k in range(n):
            a, b = start + k, start + (k + 1) % n
            faces += [(a, a + n, b), (b, a + n, b + n)]
    if faces:
        node["sides"].set_object(g.TriangularMeshGeometry(vertices, faces), material(_SKIRT_COLOUR))


def clip(polygon: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the part of a convex polygon (n, 2) inside the box from low (2,) to high (2,), (m, 2)."""
    points = np.asarray(polygon, dtype=float)
    for axis, bound, side in ((0, low[0], 1), (0, high[0], -1), (1, low[1], 1), (1, high[1], -1)):
        kept: list[np.ndarray] = []
        depth = side * (points[:, axis] - bound)
        for k in range(len(points)):
            if depth[k - 1] * depth[k] < 0.0:
                share = depth[k - 1] / (depth[k - 1] - depth[k])
                kept.append(points[k - 1] + share * (points[k] - points[k - 1]))
            if depth[k] >= 0.0:
                kept.append(points[k])
        if len(kept) < 3:
            return np.empty((0, 2))
        points = np.array(kept)
    return points
