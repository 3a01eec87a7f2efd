"""What the robots' generators share: reading a URDF, merging the vertices of meshes, writing an MJCF."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

COLLADA = "{http://www.collada.org/2005/11/COLLADASchema}"


def numbers(text: str) -> np.ndarray:
    """Read a white-space separated list."""
    return np.array(text.split(), dtype=float)


def written(values: np.ndarray) -> str:
    """Write numbers so that they read back exactly, without trailing noise such as -0.0."""
    return " ".join(f"{float(value) + 0.0:.12g}" for value in np.ravel(values))


def pose(element: ET.Element | None) -> tuple[np.ndarray, Rotation]:
    """Return translation and rotation of a URDF ``origin`` (identity when it is missing)."""
    if element is None:
        return np.zeros(3), Rotation.identity()
    return numbers(element.get("xyz", "0 0 0")), Rotation.from_euler(
        "xyz", numbers(element.get("rpy", "0 0 0"))
    )


def lumped_inertia(urdf: ET.Element, name: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre and inertia about it of a link and all that is bolted to it.

    Motor rotors, camera housings and the foot are fixed links of the URDF: a rigid body cannot tell
    them from its own metal. Everything is in the frame of link ``name``.
    """
    parts, stack = [], [(name, np.zeros(3), Rotation.identity())]
    while stack:
        link, position, rotation = stack.pop()
        inertial = urdf.find(f"link[@name='{link}']/inertial")
        if inertial is not None and (mass := float(inertial.find("mass").get("value"))) > 0:
            offset, turn = pose(inertial.find("origin"))
            i = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
            tensor = np.array(
                [
                    [i["ixx"], i["ixy"], i["ixz"]],
                    [i["ixy"], i["iyy"], i["iyz"]],
                    [i["ixz"], i["iyz"], i["izz"]],
                ]
            )
            R = (rotation * turn).as_matrix()
            parts.append((mass, position + rotation.apply(offset), R @ tensor @ R.T))
        for joint in urdf.iterfind("joint[@type='fixed']"):
            if joint.find("parent").get("link") == link:
                offset, turn = pose(joint.find("origin"))
                stack.append(
                    (joint.find("child").get("link"), position + rotation.apply(offset), rotation * turn)
                )
    mass = sum(part[0] for part in parts)
    centre = sum(m * c for m, c, _ in parts) / mass
    tensor = sum(
        about + m * (np.dot(c - centre, c - centre) * np.eye(3) - np.outer(c - centre, c - centre))
        for m, c, about in parts
    )
    return mass, centre, tensor


def cluster(vertices: np.ndarray, faces: np.ndarray, grid: float) -> tuple[np.ndarray, np.ndarray]:
    """Merge the vertices of each grid cell into their mean; drop faces that lose an edge.

    Args:
        vertices: ``(n, 3)``.
        faces: ``(f, 3)`` int.
        grid: edge of the cells.
    """
    cells, index = np.unique(np.floor(vertices / grid).astype(int), axis=0, return_inverse=True)
    index = index.ravel()
    count = np.bincount(index, minlength=len(cells))
    means = (
        np.stack([np.bincount(index, vertices[:, i], len(cells)) for i in range(3)], axis=1) / count[:, None]
    )
    faces = index[faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    turn = faces.argmin(axis=1)  # the same triangle starts at its lowest corner, whichever way it was listed
    faces = np.unique(np.take_along_axis(faces, (turn[:, None] + np.arange(3)) % 3, axis=1), axis=0)
    used, faces = np.unique(faces, return_inverse=True)
    return means[used], faces.reshape(-1, 3)


def clustered_obj(path: Path, grid: float) -> str:
    """Return a COLLADA triangle mesh, clustered, as OBJ text in whole tenths of a millimetre."""
    mesh = ET.parse(path).find(f".//{COLLADA}mesh")
    vertices = numbers(mesh.find(f"{COLLADA}source/{COLLADA}float_array").text).reshape(-1, 3)
    triangles = mesh.find(f"{COLLADA}triangles")
    stride = 1 + max(int(entry.get("offset")) for entry in triangles.iterfind(f"{COLLADA}input"))
    indices = np.array(triangles.find(f"{COLLADA}p").text.split(), dtype=int)
    faces = indices.reshape(-1, stride)[:, 0].reshape(-1, 3)
    vertices, faces = cluster(vertices, faces, grid)
    lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in np.round(vertices, 4) + 0.0]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return "\n".join(lines) + "\n"


def add_inertial(body: ET.Element, mass: float, centre: np.ndarray, tensor: np.ndarray) -> None:
    """Write the ``inertial`` element of a body; ``tensor`` is about ``centre`` in the body's frame."""
    full = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    ET.SubElement(body, "inertial", pos=written(centre), mass=written(mass), fullinertia=written(full))
