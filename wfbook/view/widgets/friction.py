"""Chapter 4's widgets: a force that is dragged about in its cone, and a table that tilts."""

import ipywidgets
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from wfbook.friction import friction_cone, friction_pyramid, ground_force, steepest_slope, support_on_slope
from wfbook.go1 import nominal
from wfbook.go1_dynamics import GRAVITY
from wfbook.modes import END_EFFECTORS, LEGS
from wfbook.standing import Standing, plane, stand
from wfbook.view.drawings.friction import draw_section, tilting
from wfbook.view.style import BODY, FOOT, FORCE, INK, MEASURED, WHEEL, Picture, tidy
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.controls import choice, slider
from wfbook.view.widgets.panel import Panel

_TOLERANCE = 1e-9
_WIDE, _HIGH, _LOW = 60.0, 70.0, -10.0
_ARROWS = (("holds it at rest", BODY, 2.0), ("asked for", FORCE, 3.0), ("given", MEASURED, 1.6))
_HEADINGS = (("ahead", 0.0), ("half left", np.pi / 4), ("to the left", np.pi / 2), ("backward", np.pi))


class ForceOnSlope(Panel):
    """One contact on a slope: drag the force that the leg asks of the ground.

    Attributes:
        board: the side view, with the handle ``"force"`` in newtons, forward and up.
        end_effector: ``"foot"`` or ``"wheel"``; the wheel rolls ahead, down the slope.
        slope: in degrees, downhill ahead.
        mu: friction coefficient of the foot in all directions, of the wheel across.
        across: the force along b, in newtons.
        friction: whether eqs 26 and 27 hold. Without them a plan may use any force that pushes.
        asked: ``(3,)`` the force asked for, along n, t, b.
        given: ``(3,)`` what the ground gives, likewise.
    """

    def __init__(self) -> None:
        self.weight = 0.25 * nominal()["mass"] * float(-GRAVITY[2])
        self.board = Board({"force": (0.0, self.weight)}, {"force": FORCE})
        self.end_effector = choice(END_EFFECTORS, "foot", "end effector")
        self.slope = slider(15.0, -30.0, 30.0, 1.0, "slope, down (°)")
        self.mu = slider(0.4, 0.05, 1.0, 0.05, "μ")
        self.across = slider(0.0, -40.0, 40.0, 1.0, "force across (N)")
        self.friction = ipywidgets.Checkbox(value=True, description="friction constraint", indent=False)
        self.asked = self.given = np.zeros(3)
        super().__init__([self.end_effector, self.slope, self.mu, self.across, self.friction], ["section"])
        self.children = (*self.children[:2], self.board, *self.children[2:])
        self.board.observe(self._follow, names="points")

    @property
    def coefficients(self) -> tuple[float, float]:
        """Friction coefficients along t and b."""
        return (self.mu.value if self.end_effector.value == "foot" else 0.0), self.mu.value

    @property
    def basis(self) -> np.ndarray:
        """``(3, 3)`` rows n, t, b in the world."""
        angle = np.radians(self.slope.value)
        n, t = [np.sin(angle), 0.0, np.cos(angle)], [np.cos(angle), 0.0, -np.sin(angle)]
        return np.array([n, t, [0.0, 1.0, 0.0]])

    def redraw(self) -> None:
        """Draw side view and section, and say what the ground makes of the force."""
        x, z = self.board.points["force"]
        self.asked = self.basis @ [x, 0.0, z]
        self.asked[2] = self.across.value
        self.given = ground_force(self.asked, *self.coefficients)
        self.say(self._verdict())
        self._draw_side()
        self._draw_section()

    def _verdict(self) -> str:
        n, t, b = self.asked
        name = self.end_effector.value
        if n < 0.0:
            return "This force pulls at the ground. No contact does that, and the leg lifts."
        if not self.friction.value:
            return "Without eqs 26 and 27 a plan may count on any force that pushes, the pink one too."
        inside = max(friction_pyramid(n, t, b, *self.coefficients)) <= _TOLERANCE
        holds = float(friction_cone(n, t, b, *self.coefficients)) <= _TOLERANCE * max(n, 1.0)
        text = f"n = {n:.1f} N, t = {t:.1f} N, b = {b:.1f} N: "
        if holds:
            return text + "inside the cone and the pyramid. " + self._at_rest()
        lost = np.linalg.norm(self.asked - self.given)
        what = "rolls" if name == "wheel" and abs(b) <= self.mu.value * n else "slides"
        promised = "inside the pyramid of eq. 26, but outside the cone" if inside else "outside the pyramid"
        return text + f"{promised}. The {name} {what}: {lost:.1f} N are not given. " + self._at_rest()

    def _at_rest(self) -> str:
        needed = support_on_slope(np.radians(self.slope.value))
        holds = max(friction_pyramid(*needed, *self.coefficients)) <= _TOLERANCE
        return f"Standing still (grey) is {'possible' if holds else 'impossible'} here."

    def _draw_side(self) -> None:
        figure = Picture(7.2, 4.6)
        axes = figure.subplots()
        tidy(axes)
        n, t = self.basis[0][[0, 2]], self.basis[1][[0, 2]]
        far = 200.0
        ground = np.array([-far * t, far * t, far * t - far * n, -far * t - far * n])
        axes.add_patch(Polygon(ground, facecolor="#F0F0F0", edgecolor=INK, linewidth=1.2, gid="ground"))
        mu_t, colour = self.coefficients[0], FOOT if self.end_effector.value == "foot" else WHEEL
        if self.friction.value:
            sides = np.array([[0.0, 0.0], far * (n + mu_t * t), far * (n - mu_t * t)])
        else:
            sides = np.array([-far * t, far * t, far * t + far * n, -far * t + far * n])
        # A wheel's cone is as thin as a line: its edge shows it.
        paint = {"facecolor": (*to_rgb(colour), 0.3), "edgecolor": colour, "linewidth": 2.0}
        axes.add_patch(Polygon(sides, gid="admissible", **paint))
        tips = ([0.0, self.weight], self.board.points["force"], (self.given @ self.basis)[[0, 2]])
        for tip, arrow in zip(tips, _ARROWS, strict=True):
            self._arrow(axes, np.array(tip), *arrow)
        axes.set_xlim(-_WIDE, _WIDE)
        axes.set_ylim(_LOW, _HIGH)
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlabel("force forward (N)")
        axes.set_ylabel("force up (N)")
        handles = [
            *(Line2D([], [], color=shade, linewidth=width, label=text) for text, shade, width in _ARROWS),
            Patch(facecolor=colour, alpha=0.3, label="admissible"),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
        self.board.show(
            figure, axes, "side view of a contact on a slope, its friction cone and the force in it"
        )
        self.pictures["side"] = figure

    @staticmethod
    def _arrow(axes: Axes, tip: np.ndarray, name: str, colour: str, width: float) -> None:
        arrow = axes.annotate(
            "",
            xy=tuple(tip),
            xytext=(0.0, 0.0),
            arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": width, "shrinkA": 0, "shrinkB": 0},
        )
        arrow.set_gid(name)

    def _draw_section(self) -> None:
        n, t, b = self.asked
        figure = Picture(7.2, 2.8)
        axes = figure.subplots()
        tidy(axes)
        if self.friction.value:
            draw_section(axes, *self.coefficients, max(n, 0.0))
        for (along, across), colour, size, name in (
            ((t, b), FORCE, 10, "asked"),
            (self.given[1:], MEASURED, 5, "given"),
        ):
            axes.plot(along, across, "o", color=colour, markersize=size, label=name, gid=name)
        reach = max(1.25 * abs(t), 1.25 * abs(b), 1.3 * self.mu.value * max(n, 0.0), 5.0)
        axes.set_xlim(-2.0 * reach, 2.0 * reach)
        axes.set_ylim(-reach, reach)
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlabel("t, along (N)")
        axes.set_ylabel("b, across (N)")
        axes.set_title("from above: pyramid dashed, cone filled", loc="left", fontsize="small", color=INK)
        figure.legend(loc="outside right center", frameon=False)
        self.show("section", figure, "the cone cut at the present normal force, and the pyramid around it")


class TiltingTable(Panel):
    """A robot that only stands, on a table that tilts: simulated again at every change.

    Attributes:
        wheels: a checkbox for each leg, by its name: on its wheel instead of its foot.
        heading: of the way down, as the robot sees it.
        mu: friction coefficient of feet, and of wheels across.
        resistance: rolling resistance.
        standing: what happened.
        predicted: slope from which on the pyramid can't hold, for four equal legs; None for mixed ones.
    """

    RATE = np.radians(10.0)

    def __init__(self) -> None:
        self.wheels = {
            leg: ipywidgets.Checkbox(
                value=False, description=f"{leg} wheel", indent=False, layout=ipywidgets.Layout(width="7em")
            )
            for leg in LEGS
        }
        self.heading = choice(_HEADINGS, 0.0, "downhill is")
        self.mu = slider(0.4, 0.1, 0.45, 0.05, "μ")
        self.resistance = slider(0.0, 0.0, 0.1, 0.01, "rolling resistance")
        self.standing: Standing | None = None
        self.predicted: float | None = None
        super().__init__([*self.wheels.values(), self.heading, self.mu, self.resistance], ["grip"])

    def redraw(self) -> None:
        """Tilt the table once more."""
        kinds = tuple("wheel" if box.value else "foot" for box in self.wheels.values())
        mu = self.mu.value
        until = 1.3 * np.arctan(mu) / self.RATE
        self.standing = stand(
            plane(mu, self.resistance.value),
            kinds,
            float(until),
            tilt=lambda t: self.RATE * t,
            heading=self.heading.value,
        )
        found, self.predicted = self.standing.slip_angle, None
        text = "It never slips." if found is None else f"It slips at {np.degrees(found):.1f}°."
        if len(set(kinds)) == 1:
            name, colour = ("feet", FOOT) if kinds[0] == "foot" else ("wheels", WHEEL)
            mu_t = mu if kinds[0] == "foot" else self.resistance.value
            self.predicted, cone = (
                steepest_slope(mu_t, mu, self.heading.value, cone=round_one) for round_one in (False, True)
            )
            text += f" The pyramid holds to {np.degrees(self.predicted):.1f}°"
            text += f", the cone to {np.degrees(cone):.1f}°."
        else:
            name, colour = "feet and wheels", INK
            text += f" {kinds.count('foot')} of four legs stand on feet."
        picture = tilting([(name, self.standing, colour, "-")], mu)
        self.show("grip", picture, "force along the table over normal force while the table tilts")
        self.say(text)
