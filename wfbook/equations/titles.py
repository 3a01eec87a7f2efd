"""The numbered equations of both papers: which there are, and what each says in a line.

What implements an equation stands in no list but in docstrings (:mod:`.docstrings`).
"""

from dataclasses import dataclass
from typing import NamedTuple


class Equation(NamedTuple):
    """A numbered equation: ``Equation("A", 12)``."""

    paper: str
    number: int

    def __str__(self) -> str:
        return f"{self.paper} {self.number}"

    @property
    def anchor(self) -> str:
        """Its label in the book, as ``eq-a-12``."""
        return f"eq-{self.paper.lower()}-{self.number}"


@dataclass(frozen=True)
class Section:
    """A part of a paper and what its equations say, in their order.

    Attributes:
        name: as the paper has it.
        titles: one line for each equation.
    """

    name: str
    titles: tuple[str, ...]


NAMES = {
    "A": "Morgan and Agheli, Trajectory Optimization Through Mixed-Integer Optimization of Contact Dynamics "
    "for Switching End Effector Locomotion",
    "B": "Chen, Li, Liu, Li, Yin and Li, Whole-body Motion Control of an Omnidirectional Wheel-Legged "
    "Mobile Manipulator via Contact-Aware Dynamic Optimization",
}
"""The papers, by the letter that this book gives them."""

SECTIONS = {
    "A": (
        Section("II-A Linear centroidal dynamics", ("Newton's law for the centre of mass",)),
        Section(
            "II-B Gait and swing trajectory",
            (
                "a swing is a polynomial of its phase",
                "its coefficients solve a linear system",
                "what a horizontal swing has to meet: the quintic",
                "what a vertical swing has to meet: the septic, with an apex",
                "a leg that swings follows its spline",
                "a leg that swings applies no force",
            ),
        ),
        Section(
            "II-C Angular centroidal dynamics",
            (
                "the contacts' torque turns the robot",
                "the torque is a difference of two bounds, convex each, that the cost presses down",
                "the vertex of a standing leg is its contact",
                "a swinging leg has no vertex",
                "the centroid is the mean of the contacts that stand",
                "how many legs swing, written in binaries",
                "just one number of legs swings",
                "that number decides by how many the vertices' sum is divided",
            ),
        ),
        Section(
            "II-D Region assignment and contact dynamics",
            (
                "a leg changes region or end effector in a swing only",
                "a leg has one region and one end effector",
                "a standing leg obeys the dynamics that D chooses",
                "a standing foot stays where it is",
                "a wheel goes ahead with the body",
                "a wheel does not slide sideways",
                "a foot is on its region",
                "a wheel is on one of the regions that join",
                "which region of the union it is, in big-M format",
                "one region of the union holds at least",
                "the friction pyramid, for foot and wheel",
                "the pyramid holds for the region and end effector that D chooses",
                "a foot has no rolling friction",
                "a wheel's rolling friction is proportional to its normal force",
            ),
        ),
        Section("II-E Reachability constraints", ("each leg's contact is within a box",)),
        Section(
            "II-F Trajectory optimization",
            (
                "what the plan costs: its end, its way, its swings",
                "what the end costs: distance from the goal",
                "what the way costs: acceleration, force, torque bounds, distance from the centroid",
            ),
        ),
        Section(
            "III Whole-body control and state estimation",
            (
                "the reference acceleration of centre of mass and trunk",
                "the reference acceleration of a rolling wheel",
                "the reference acceleration of a swinging leg's end",
                "the robot's equations of motion, with feet and wheels",
                "what the controller's program minimises",
                "it obeys the equations of motion",
                "its standing feet stay",
                "its wheels do not slide sideways",
                "its forces are within the friction pyramids",
                "its torques are within the motors' limits",
                "what a leg's kinematics measure, foot or wheel",
            ),
        ),
    ),
    "B": (
        Section(
            "Dynamic model with contact",
            (
                "the configuration: trunk, legs, arm; and its velocity",
                "the equations of motion, with contacts",
                "contacts do not accelerate",
                "accelerations and contact forces, in one linear system",
                "without contact, the free robot's acceleration",
                "a contact's wrench is in a cone of half-spaces",
                "rows of the cone: friction pyramid and bounds on moments",
                "the residual of a row, positive where it is broken",
                "the penalty on broken rows",
                "each contact's wrench is in its own cone",
                "all wrenches balance what acts on the robot",
            ),
        ),
        Section(
            "Unified model for omnidirectional mobile robots",
            (
                "the velocity of a wheel's middle, from the body's twist",
                "the angle to which a wheel should steer",
                "the nearer of two ways to steer: forward, or turned round and backward",
                "from a twist to all wheels' speeds and angles",
            ),
        ),
        Section(
            "Formulation of motion control",
            (
                "the optimal control problem",
                "the terms of its cost",
                "the value function: the least cost from here to the end",
                "the Bellman equation",
                "the parabola of the cost about a trajectory",
                "the step that minimises it: feed-forward and feedback",
            ),
        ),
        Section("Appendix", ("the matrix from a twist to the wheels' sideways and rolling speeds",)),
    ),
}
"""The papers' sections in order; equations are numbered through them from 1."""


def _titles() -> dict[Equation, str]:
    return {
        Equation(paper, number): title
        for paper, sections in SECTIONS.items()
        for number, title in enumerate((t for section in sections for t in section.titles), start=1)
    }


TITLES = _titles()
"""Every numbered equation in order, and what it says."""
