"""Generate the book's Go1 from the URDF of example-robot-data.

    python assets/go1/build.py [folder]

writes ``go1.xml`` (one MJCF for MuJoCo and for Pinocchio), five clustered meshes and ``nominal.json``
(what the planner needs to know of the robot). The same packages give the same bytes.

The URDF says masses, inertias, geometry, joint and torque limits. This script adds what paper A adds
to the robot: at the end of every calf a passive wheel beside the foot.
"""

import json
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from wfbook.go1 import FOOT_RADIUS, WHEEL_HALF_WIDTH, WHEEL_RADIUS
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.modes import LEGS

SOURCE = Path("cmeel.prefix/share/example-robot-data/robots/go1_description")
WHEEL_MASS = 0.05
GRID = {"trunk": 0.0125, "hip": 0.009, "thigh": 0.0085, "thigh_mirror": 0.0085, "calf": 0.0085}
"""Edge of the clustering cells of each mesh."""

NOMINAL_HEIGHT = 0.265
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


def add_geoms(body: ET.Element, urdf: ET.Element, link: str) -> None:
    """Write the clustered mesh a link is drawn with and the primitive it collides with."""
    element = urdf.find(f"link[@name='{link}']")
    _, rotation = pose(element.find("visual/origin"))
    mesh = Path(element.find("visual/geometry/mesh").get("filename")).stem
    visual = ET.SubElement(body, "geom", {"class": "visual", "name": f"{link}_visual", "mesh": mesh})
    if rotation.magnitude() > 1e-9:
        visual.set("quat", written(np.round(rotation.as_quat(scalar_first=True), 12)))
    position, rotation = pose(element.find("collision/origin"))
    shape = element.find("collision/geometry")[0]
    if shape.tag == "box":
        size = numbers(shape.get("size")) / 2
    else:
        size = np.array([float(shape.get("radius")), float(shape.get("length")) / 2])
    geom = {
        "class": "hull",
        "name": f"{link}_hull",
        "type": shape.tag,
        "size": written(size),
        "pos": written(position),
    }
    if rotation.magnitude() > 1e-9:
        geom["quat"] = written(np.round(rotation.as_quat(scalar_first=True), 12))
    ET.SubElement(body, "geom", geom)


def add_leg(trunk: ET.Element, actuators: ET.Element, urdf: ET.Element, leg: str) -> None:
    """Write the three links of a leg, its motors, its foot and its wheel."""
    parent = trunk
    for part in ("hip", "thigh", "calf"):
        link, joint = f"{leg}_{part}", urdf.find(f"joint[@name='{leg}_{part}_joint']")
        limit = joint.find("limit")
        effort = f"-{limit.get('effort')} {limit.get('effort')}"
        body = ET.SubElement(parent, "body", name=link, pos=written(pose(joint.find("origin"))[0]))
        add_inertial(body, *lumped_inertia(urdf, link))
        ET.SubElement(
            body,
            "joint",
            name=f"{link}_joint",
            axis=written(numbers(joint.find("axis").get("xyz"))),
            range=f"{limit.get('lower')} {limit.get('upper')}",
            actuatorfrcrange=effort,  # for Pinocchio, which does not read the motors
        )
        ET.SubElement(actuators, "motor", name=link, joint=f"{link}_joint", ctrlrange=effort)
        add_geoms(body, urdf, link)
        parent = body
    end = written(pose(urdf.find(f"joint[@name='{leg}_foot_fixed']/origin"))[0])
    ET.SubElement(parent, "site", name=f"{leg}_end", pos=end)
    ET.SubElement(parent, "geom", {"class": "foot", "name": f"{leg}_foot", "pos": end})
    wheel = ET.SubElement(parent, "body", name=f"{leg}_wheel", pos=end)
    across, axial = WHEEL_MASS * WHEEL_RADIUS**2 / 4, WHEEL_MASS * WHEEL_RADIUS**2 / 2
    across += WHEEL_MASS * WHEEL_HALF_WIDTH**2 / 3  # a disc 24 mm wide
    add_inertial(wheel, WHEEL_MASS, np.zeros(3), np.diag([across, axial, across]))
    ET.SubElement(wheel, "joint", name=f"{leg}_wheel_joint", axis="0 1 0")
    ET.SubElement(wheel, "geom", {"class": "wheel", "name": f"{leg}_wheel"})


def mjcf(urdf: ET.Element) -> str:
    """Return the MJCF of the Go1 with switchable end effectors."""
    root = ET.Element("mujoco", model="go1")
    root.append(ET.Comment(" Generated by build.py from the Go1 URDF of example-robot-data: do not edit. "))
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    option = {"timestep": "0.001", "integrator": "implicitfast", "cone": "elliptic", "impratio": "10"}
    # A wheel on a polygon needs exact normals: at the default 1e-6 they brake it like a resistance of 1e-3.
    ET.SubElement(root, "option", option | {"ccd_tolerance": "1e-9", "ccd_iterations": "100"})
    default = ET.SubElement(root, "default")
    contact = {"condim": "3", "friction": "0 0 0", "solref": "0.01 1", "solimp": "0.9 0.95 0.001"}
    ET.SubElement(default, "geom", contact | {"mass": "0"})
    visual = ET.SubElement(default, "default", {"class": "visual"})
    ET.SubElement(
        visual, "geom", type="mesh", contype="0", conaffinity="0", group="2", rgba="0.25 0.27 0.3 1"
    )
    # The terrain brings the friction (MuJoCo takes the larger of two geoms' coefficients), one set of
    # geoms for feet and hulls (bit 1), one for wheels (bit 2).
    hull = ET.SubElement(default, "default", {"class": "hull"})
    ET.SubElement(hull, "geom", contype="1", conaffinity="0", group="3")
    foot = ET.SubElement(default, "default", {"class": "foot"})
    ET.SubElement(
        foot,
        "geom",
        type="sphere",
        size=written(FOOT_RADIUS),
        contype="1",
        conaffinity="0",
        rgba="0 0.62 0.45 1",
    )
    wheel = ET.SubElement(default, "default", {"class": "wheel"})
    size = written(np.array([WHEEL_RADIUS, WHEEL_HALF_WIDTH, WHEEL_RADIUS]))
    ET.SubElement(
        wheel, "geom", type="ellipsoid", size=size, contype="2", conaffinity="0", rgba="0.9 0.62 0 0.8"
    )
    asset = ET.SubElement(root, "asset")
    for name in GRID:
        ET.SubElement(asset, "mesh", name=name, file=f"{name}.obj", inertia="shell")
    world = ET.SubElement(root, "worldbody")
    trunk = ET.SubElement(world, "body", name="trunk")
    ET.SubElement(trunk, "freejoint", name="root_joint")
    add_inertial(trunk, *lumped_inertia(urdf, "base"))
    add_geoms(trunk, urdf, "trunk")
    ET.SubElement(
        trunk, "site", name="imu", pos=written(pose(urdf.find("joint[@name='imu_joint']/origin"))[0])
    )
    actuators = ET.Element("actuator")
    for leg in LEGS:
        add_leg(trunk, actuators, urdf, leg)
    root.append(actuators)
    sensors = ET.SubElement(root, "sensor")
    ET.SubElement(sensors, "accelerometer", name="accelerometer", site="imu")
    ET.SubElement(sensors, "gyro", name="gyro", site="imu")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def nominal(path: Path) -> dict:
    """Return what the planner needs: mass, inertia, hips and contact points in the nominal stance.

    The trunk is level and the CoM is 0.265 m above the ground. The contact points are a rectangle
    centred below the CoM, as long and as wide as the hips': every leg carries a quarter of the weight,
    and left mirrors right. (The CoM is a few millimetres off the trunk's origin, so the feet stand that
    far off the hips.)
    """
    robot = Go1Dynamics(path)
    hips = robot.hips()
    offsets = np.column_stack(
        [np.sign(hips[:, :2]) * np.abs(hips[:, :2]).mean(axis=0), np.full(4, -NOMINAL_HEIGHT)]
    )
    centres = offsets + np.array([0.0, 0.0, FOOT_RADIUS])
    q = robot.posture(np.zeros(3), np.zeros(3), centres)
    robot.update(q, np.zeros(22))
    return {
        "mass": round(robot.mass, 6),
        "com_height": NOMINAL_HEIGHT,
        "inertia": np.round(robot.composite_inertia(), 6).tolist(),
        "hip_offsets": np.round(offsets, 6).tolist(),
        "hips": np.round(hips + robot.trunk_position, 6).tolist(),
        "trunk": np.round(robot.trunk_position, 6).tolist(),
        "joint_angles": np.round(robot.joint_angles, 6).tolist(),
    }


def build(folder: Path) -> None:
    """Write model, meshes and nominal constants to ``folder``."""
    source = Path(distribution("example-robot-data").locate_file(SOURCE))
    urdf = ET.parse(source / "urdf" / "go1.urdf").getroot()
    folder.mkdir(parents=True, exist_ok=True)
    for name, grid in GRID.items():
        (folder / f"{name}.obj").write_text(clustered_obj(source / "meshes" / f"{name}.dae", grid))
    (folder / "go1.xml").write_text(mjcf(urdf))
    (folder / "nominal.json").write_text(json.dumps(nominal(folder / "go1.xml"), indent=1) + "\n")


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
