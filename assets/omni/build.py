"""Generate the omnidirectional wheel-legged manipulator of paper B, as far as the paper describes it.

    python assets/omni/build.py [folder]

writes ``omni.xml`` (one MJCF for MuJoCo and for Pinocchio) and clustered meshes of the arm. The same packages
give the same bytes.

Paper B shows its robot and says how many joints it has, and how high it carries its hand: 0.92 m. It gives
neither lengths nor masses nor limits. The arm is a Unitree Z1, which has a public description. The rest is
ours, and plausible for a robot that carries that arm: see ``assets/README.md``.
"""

import sys
import xml.etree.ElementTree as ET
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from urdf import add_inertial, clustered_obj, lumped_inertia, numbers, pose, written

from wfbook.modes import LEGS
from wfbook.omni import robot

SOURCE = Path("cmeel.prefix/share/example-robot-data/robots/z1_description")
LINKS = ("link01", "link02", "link03", "link04", "link05", "link06")
GRID = 0.012
"""Edge of the clustering cells of the arm's meshes."""

TRUNK_SIZE = np.array([0.66, 0.28, 0.14])
TRUNK_MASS, THIGH_MASS, SHANK_MASS, FORK_MASS, WHEEL_MASS = 15.0, 1.6, 1.0, 0.4, 1.5
"""Of the trunk with battery, computer and hip motors; thigh with knee motor; shank with steering motor;
fork; wheel with hub motor."""

HIP = {"range": "-0.8 2.4", "effort": 80.0}
KNEE = {"range": "-2.6 -0.2", "effort": 80.0}
STEER_EFFORT, WHEEL_EFFORT = 20.0, 20.0
RIM_THICKNESS = 0.006
"""Half of it, of the two discs that a wheel touches the ground with."""

THIGH_RADIUS, SHANK_RADIUS = 0.03, 0.022
HAND_POSITION = np.array([0.171, 0.0, 0.0])
"""Between the fingers, in the frame of the arm's last link."""

ALONG_Y = written(np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0]))
"""Quaternion that turns a cylinder, which MuJoCo stands up along z, along y."""

DARK, LIGHT = "0.25 0.27 0.3 1", "0.55 0.57 0.6 1"


def box_inertia(mass: float, size: np.ndarray) -> np.ndarray:
    """Return the inertia of a solid box with these edges about its centre."""
    squares = size**2
    return mass / 12 * np.diag(squares.sum() - squares)


def cylinder_inertia(mass: float, radius: float, length: float, axis: int) -> np.ndarray:
    """Return the inertia of a solid cylinder along one of the axes about its centre."""
    inertia = np.full(3, mass * (3 * radius**2 + length**2) / 12)
    inertia[axis] = mass * radius**2 / 2
    return np.diag(inertia)


def joint(
    body: ET.Element, actuators: ET.Element, name: str, axis: str, effort: float, **options: str
) -> None:
    """Write a hinge and the motor that turns it."""
    limit = f"-{effort:g} {effort:g}"
    # Pinocchio reads the limit from the joint, MuJoCo from the motor.
    ET.SubElement(body, "joint", name=f"{name}_joint", axis=axis, actuatorfrcrange=limit, **options)
    ET.SubElement(actuators, "motor", name=name, joint=f"{name}_joint", ctrlrange=limit)


def bar(body: ET.Element, name: str, end: np.ndarray, radius: float) -> None:
    """Write a cylinder from the body's origin to ``end``, once to be seen and once to collide."""
    place = {"type": "cylinder", "fromto": f"0 0 0 {written(end)}", "size": written(radius)}
    ET.SubElement(body, "geom", {"class": "visual", "name": f"{name}_visual"} | place)
    ET.SubElement(body, "geom", {"class": "hull", "name": f"{name}_hull"} | place)


def motor(body: ET.Element, name: str, position: np.ndarray, radius: float, half: float) -> None:
    """Draw a motor that turns about y."""
    size = written(np.array([radius, half]))
    shape = {"type": "cylinder", "size": size, "pos": written(position), "quat": ALONG_Y}
    ET.SubElement(body, "geom", {"class": "visual", "name": name, "rgba": LIGHT} | shape)


def add_leg(trunk: ET.Element, actuators: ET.Element, leg: int) -> None:
    """Write hip, knee, steering and wheel of a leg."""
    name, down = LEGS[leg], np.array([0.0, 0.0, -1.0])
    thigh = ET.SubElement(trunk, "body", name=f"{name}_thigh", pos=written(robot.HIPS[leg]))
    add_inertial(
        thigh, THIGH_MASS, 0.5 * robot.THIGH * down,
        cylinder_inertia(THIGH_MASS, THIGH_RADIUS, robot.THIGH, 2),
    )  # fmt: skip
    joint(thigh, actuators, f"{name}_hip", "0 1 0", HIP["effort"], range=HIP["range"])
    bar(thigh, f"{name}_thigh", robot.THIGH * down, THIGH_RADIUS)
    motor(thigh, f"{name}_hip_motor", np.zeros(3), 0.048, 0.035)
    motor(thigh, f"{name}_knee_motor", robot.THIGH * down, 0.042, 0.032)
    shank = ET.SubElement(thigh, "body", name=f"{name}_shank", pos=written(robot.THIGH * down))
    add_inertial(
        shank, SHANK_MASS, 0.6 * robot.SHANK * down,
        cylinder_inertia(SHANK_MASS, SHANK_RADIUS, robot.SHANK, 2),
    )  # fmt: skip
    joint(shank, actuators, f"{name}_knee", "0 1 0", KNEE["effort"], range=KNEE["range"])
    bar(shank, f"{name}_shank", robot.SHANK * down, SHANK_RADIUS)
    # The steering axis is bolted to the shank so that it is vertical in the nominal posture.
    upright = Rotation.from_euler("y", -robot.SHANK_PITCH).as_quat(scalar_first=True)
    fork = ET.SubElement(
        shank, "body", name=f"{name}_fork", pos=written(robot.SHANK * down), quat=written(upright)
    )
    size = np.array([0.05, 0.09, robot.FORK])
    add_inertial(fork, FORK_MASS, 0.4 * robot.FORK * down, box_inertia(FORK_MASS, size))
    joint(fork, actuators, f"{name}_steer", "0 0 1", STEER_EFFORT)
    add_fork(fork, name)
    axle = written(robot.FORK * down)
    ET.SubElement(fork, "site", name=f"{name}_axle", pos=axle)
    ET.SubElement(fork, "site", name=f"{name}_contact", pos=written((robot.FORK + robot.WHEEL_RADIUS) * down))
    add_wheel(fork, actuators, name, axle)


def add_fork(fork: ET.Element, name: str) -> None:
    """Draw the steering motor, the crown over the wheel and the two blades down to its axle."""
    visual = {"class": "visual", "rgba": LIGHT}
    blade, half = 0.006, robot.WHEEL_HALF_WIDTH + 0.014
    ET.SubElement(
        fork, "geom", visual | {"name": f"{name}_steer_motor", "type": "cylinder", "size": "0.03 0.03"}
    )
    crown = {"type": "box", "size": written([0.025, half + blade, 0.004]), "pos": "0 0 -0.016"}
    ET.SubElement(fork, "geom", visual | {"name": f"{name}_crown"} | crown)
    length = robot.FORK - 0.016
    for side, sign in (("left", 1), ("right", -1)):
        place = {"type": "box", "size": written([0.014, blade / 2, length / 2 + 0.012])}
        place["pos"] = written([0.0, sign * (half + blade / 2), -0.016 - length / 2])
        ET.SubElement(fork, "geom", visual | {"name": f"{name}_blade_{side}"} | place)


def add_wheel(fork: ET.Element, actuators: ET.Element, name: str, axle: str) -> None:
    """Write a wheel: a cylinder to be seen, and two thin discs that touch the ground in a line.

    A cylinder jitters at rest and steps on camber; an ellipsoid of the wheel's width rolls well but touches
    in a point. Two thin ellipsoids at the edges of the tread roll as well and touch at both ends of a line
    that is as long as the tread is wide: a moment about the rolling direction can be carried, as paper B
    assumes, and turning the wheel on the spot scrubs.
    """
    wheel = ET.SubElement(fork, "body", name=f"{name}_wheel", pos=axle)
    radius, half = robot.WHEEL_RADIUS, robot.WHEEL_HALF_WIDTH
    add_inertial(wheel, WHEEL_MASS, np.zeros(3), cylinder_inertia(WHEEL_MASS, radius, 2 * half, 1))
    joint(wheel, actuators, f"{name}_wheel", "0 1 0", WHEEL_EFFORT)
    visual = {"class": "visual", "name": f"{name}_wheel", "type": "cylinder", "quat": ALONG_Y}
    size = {"size": written([radius, half + RIM_THICKNESS]), "rgba": "0.9 0.62 0 1"}
    ET.SubElement(wheel, "geom", visual | size)
    for side, sign in (("left", 1), ("right", -1)):
        ET.SubElement(
            wheel, "geom", {"class": "rim", "name": f"{name}_rim_{side}", "pos": written([0, sign * half, 0])}
        )


def add_arm(trunk: ET.Element, actuators: ET.Element, urdf: ET.Element) -> None:
    """Write the Z1: its foot is part of the trunk, its gripper's housing part of the last link."""
    add_link_geoms(trunk, urdf, "link00", robot.ARM_BASE)
    parent, offset = trunk, robot.ARM_BASE
    for number, link in enumerate(LINKS, 1):
        place = pose(urdf.find(f"joint[@name='joint{number}']/origin"))[0]
        body = ET.SubElement(parent, "body", name=link, pos=written(offset + place))
        add_inertial(body, *lumped_inertia(urdf, link))
        add_arm_joint(body, actuators, urdf, f"joint{number}", f"arm{number}")
        add_link_geoms(body, urdf, link, np.zeros(3))
        parent, offset = body, np.zeros(3)
    housing = pose(urdf.find("joint[@name='gripperStator']/origin"))[0]
    add_link_geoms(parent, urdf, "gripperStator", housing)
    hull = {"type": "box", "size": "0.075 0.04 0.034", "pos": written(housing + np.array([0.07, 0.0, 0.0]))}
    ET.SubElement(parent, "geom", {"class": "hull", "name": "gripperStator_hull0"} | hull)
    # z ahead, y down: the hand's roll, pitch and yaw are then paper B's (-1.57, 0, -1.57) when it is level.
    turned = Rotation.from_euler("xyz", robot.HAND_RPY).as_quat(scalar_first=True)
    ET.SubElement(parent, "site", name="hand", pos=written(HAND_POSITION), quat=written(np.round(turned, 12)))
    finger = ET.SubElement(
        parent, "body", name="gripperMover",
        pos=written(housing + pose(urdf.find("joint[@name='jointGripper']/origin"))[0]),
    )  # fmt: skip
    add_inertial(finger, *lumped_inertia(urdf, "gripperMover"))
    add_arm_joint(finger, actuators, urdf, "jointGripper", "gripper")
    add_link_geoms(finger, urdf, "gripperMover", np.zeros(3))


def add_arm_joint(body: ET.Element, actuators: ET.Element, urdf: ET.Element, source: str, name: str) -> None:
    """Write a joint of the arm with the URDF's axis and limits."""
    element = urdf.find(f"joint[@name='{source}']")
    limit = element.find("limit")
    span = written([float(limit.get("lower")), float(limit.get("upper"))])
    axis = written(numbers(element.find("axis").get("xyz")))
    joint(body, actuators, name, axis, float(limit.get("effort")), range=span)


def add_link_geoms(body: ET.Element, urdf: ET.Element, link: str, position: np.ndarray) -> None:
    """Write the mesh a link of the arm is drawn with and the cylinders it collides with."""
    element = urdf.find(f"link[@name='{link}']")
    visual = {
        "class": "visual",
        "name": f"{link}_visual",
        "type": "mesh",
        "mesh": link,
        "pos": written(position),
    }
    ET.SubElement(body, "geom", visual)
    for count, collision in enumerate(element.iterfind("collision")):
        shape = collision.find("geometry")[0]
        if shape.tag != "cylinder":
            continue
        offset, rotation = pose(collision.find("origin"))
        hull = {
            "type": "cylinder",
            "size": written([float(shape.get("radius")), float(shape.get("length")) / 2]),
            "pos": written(position + offset),
            "quat": written(np.round(rotation.as_quat(scalar_first=True), 12)),
        }
        ET.SubElement(body, "geom", {"class": "hull", "name": f"{link}_hull{count}"} | hull)


def add_defaults(root: ET.Element) -> None:
    """Write what geoms of a class have in common: see ``assets/go1/build.py`` for the contact's numbers."""
    default = ET.SubElement(root, "default")
    contact = {"condim": "3", "friction": "0 0 0", "solref": "0.01 1", "solimp": "0.9 0.95 0.001"}
    ET.SubElement(default, "geom", contact | {"mass": "0"})
    visual = ET.SubElement(default, "default", {"class": "visual"})
    ET.SubElement(visual, "geom", contype="0", conaffinity="0", group="2", rgba=DARK)
    hull = ET.SubElement(default, "default", {"class": "hull"})
    ET.SubElement(hull, "geom", contype="1", conaffinity="0", group="3")
    rim = ET.SubElement(default, "default", {"class": "rim"})
    size = written([robot.WHEEL_RADIUS, RIM_THICKNESS, robot.WHEEL_RADIUS])
    ET.SubElement(rim, "geom", type="ellipsoid", size=size, contype="2", conaffinity="0", group="3")


def trunk_inertia(urdf: ET.Element) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre and inertia about it of the trunk, a solid box, and the arm's foot on it."""
    mass, centre, tensor = lumped_inertia(urdf, "link00")
    total, foot = TRUNK_MASS + mass, robot.ARM_BASE + centre
    common = mass * foot / total
    tensor = tensor + mass * _offset(foot - common)
    return total, common, tensor + box_inertia(TRUNK_MASS, TRUNK_SIZE) + TRUNK_MASS * _offset(common)


def _offset(arm: np.ndarray) -> np.ndarray:
    """Return the inertia of a unit mass at ``arm`` from the point it turns about."""
    return np.dot(arm, arm) * np.eye(3) - np.outer(arm, arm)


def mjcf(urdf: ET.Element) -> str:
    """Return the MJCF of the robot, with its nominal posture as a keyframe."""
    root = ET.Element("mujoco", model="omni")
    root.append(
        ET.Comment(" Generated by build.py, the arm from the Z1 URDF of example-robot-data: do not edit. ")
    )
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    option = {"timestep": "0.001", "integrator": "implicitfast", "cone": "elliptic", "impratio": "10"}
    ET.SubElement(root, "option", option | {"ccd_tolerance": "1e-9", "ccd_iterations": "100"})
    add_defaults(root)
    asset = ET.SubElement(root, "asset")
    for name in meshes(urdf):
        ET.SubElement(asset, "mesh", name=name, file=f"{name}.obj", inertia="shell")
    world = ET.SubElement(root, "worldbody")
    trunk = ET.SubElement(world, "body", name="trunk")
    ET.SubElement(trunk, "freejoint", name="root_joint")
    add_inertial(trunk, *trunk_inertia(urdf))
    for kind in ("visual", "hull"):
        box = {"class": kind, "name": f"trunk_{kind}", "type": "box", "size": written(TRUNK_SIZE / 2)}
        ET.SubElement(trunk, "geom", box)
    ET.SubElement(trunk, "site", name="imu")
    actuators = ET.Element("actuator")
    for leg in range(len(LEGS)):
        add_leg(trunk, actuators, leg)
    add_arm(trunk, actuators, urdf)
    root.append(actuators)
    sensors = ET.SubElement(root, "sensor")
    ET.SubElement(sensors, "accelerometer", name="accelerometer", site="imu")
    ET.SubElement(sensors, "gyro", name="gyro", site="imu")
    keys = ET.SubElement(root, "keyframe")
    ET.SubElement(keys, "key", name="nominal", qpos=written(np.round(robot.posture(), 12)))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def meshes(urdf: ET.Element) -> dict[str, str]:
    """Return the file of each link's mesh, by the link."""
    links = ("link00", *LINKS, "gripperStator", "gripperMover")
    files = {link: urdf.find(f"link[@name='{link}']/visual/geometry/mesh").get("filename") for link in links}
    return {link: Path(file).name for link, file in files.items()}


def build(folder: Path) -> None:
    """Write model and meshes to ``folder``."""
    source = Path(distribution("example-robot-data").locate_file(SOURCE))
    urdf = ET.parse(source / "urdf" / "z1.urdf").getroot()
    folder.mkdir(parents=True, exist_ok=True)
    for name, file in meshes(urdf).items():
        (folder / f"{name}.obj").write_text(clustered_obj(source / "meshes" / "visual" / file, GRID))
    (folder / "omni.xml").write_text(mjcf(urdf))


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
