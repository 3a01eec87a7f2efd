"""Chapter 10's widgets: a wrench dragged about in a slice of its cone, and contacts that support a robot."""

import ipywidgets
import numpy as np
from matplotlib.patches import Patch

from wfbook.centroidal import GRAVITY
from wfbook.modes import LEGS
from wfbook.omni.robot import WHEEL_POSITIONS
from wfbook.omni.support import AREAS, Contact, axes_on, inside, support_area
from wfbook.omni.wrench import (
    COMPONENTS,
    WrenchCone,
    decoupled,
    end_forces,
    line_contact,
    penalty,
    point_contact,
    printed,
    surface_contact,
)
from wfbook.view.drawings.omni_wrench import (
    UNITS,
    draw_area,
    draw_contacts,
    draw_slice,
    ends,
    limits_of,
)
from wfbook.view.style import FORCE, INK, LIMIT, MEASURED, PLANNED, WHEEL, Picture, tidy
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.controls import choice, slider
from wfbook.view.widgets.panel import Panel

KINDS = ("line (a wheel)", "point (a hand)", "rectangle (a sole)", "eq. 7, mended", "eq. 7, as printed")
SOLE = 0.12
"""Length of the rectangle."""

_START = {"fx": 20.0, "fy": 0.0, "fz": 100.0, "τx": 0.5, "τy": 0.0, "τz": 0.3}
_STEP = {name: 1.0 if name[0] == "f" else 0.05 for name in COMPONENTS}


class ConeSlice(Panel):
    """A contact's wrench in a plane of two of its six components: drag it in and out of the cone.

    Attributes:
        board: the slice, with the handle ``"wrench"``.
        kind: of contact, one of :data:`KINDS`.
        mu: friction coefficient.
        width: of the contact in cm, along the axle.
        across: component along the picture's x.
        up: component along its y.
        components: a slider for each component by its name; the two of the slice follow the handle.
        cone: what is cut.
    """

    def __init__(self) -> None:
        self.board = Board({"wrench": (_START["fx"], _START["τz"])}, {"wrench": FORCE})
        self.kind = choice(KINDS, KINDS[0], "contact")
        self.mu = slider(0.6, 0.1, 1.2, 0.05, "μ")
        self.width = slider(4.0, 1.0, 10.0, 0.5, "width (cm)")
        self.across = choice(COMPONENTS, "fx", "to the right")
        self.up = choice(COMPONENTS, "τz", "upward")
        self.components = {
            name: slider(_START[name], *limits_of(name), _STEP[name], f"{name} ({UNITS[name]})")
            for name in COMPONENTS
        }
        self.cone: WrenchCone | None = None
        self._moving = False
        self._axes = ("fx", "τz")
        chosen = [self.kind, self.mu, self.width, self.across, self.up]
        super().__init__([*chosen, *self.components.values()], ["ends"])
        self.children = (*self.children[:2], self.board, *self.children[2:])
        self.board.observe(self._dragged, names="points")

    @property
    def wrench(self) -> np.ndarray:
        """``(6,)`` the wrench that is shown."""
        return np.array([control.value for control in self.components.values()])

    def redraw(self) -> None:
        """Cut the cone, put the wrench into the picture, and say which rows it breaks."""
        if self._moving:
            return
        axes = (self.across.value, self.up.value)
        if axes[0] == axes[1]:  # the other axis takes what this one had
            kept = self._axes[1] if axes[0] != self._axes[1] else self._axes[0]
            moved = self.up if axes[0] != self._axes[0] else self.across
            moved.value = self._axes[0] if moved is self.up else kept
            return
        self._axes = axes
        self._moving = True
        for name, control in self.components.items():
            control.disabled = name in axes
        self.board.move("wrench", *(self.components[name].value for name in axes))
        self._moving = False
        self.cone = self._chosen()
        broken = self.cone.broken(self.wrench, 1e-6)
        self.say(self._verdict(broken))
        self._draw_slice(broken)
        self._draw_ends()

    def _chosen(self) -> WrenchCone:
        mu, width = self.mu.value, 0.01 * self.width.value
        moment = 1.5
        return {
            KINDS[0]: lambda: line_contact(mu, width),
            KINDS[1]: lambda: point_contact(mu),
            KINDS[2]: lambda: surface_contact(mu, SOLE, width),
            KINDS[3]: lambda: decoupled(mu, (width / 2, None, mu * width / 2)),
            KINDS[4]: lambda: printed(mu, (moment, 1e3, moment), (moment, 1e3, moment)),
        }[self.kind.value]()

    def _verdict(self, broken: list[str]) -> str:
        if not broken:
            text = "Inside: this contact can give this wrench."
            if self.kind.value in KINDS[3:] and line_contact(self.mu.value, 0.01 * self.width.value).broken(
                self.wrench, 1e-6
            ):
                text = "These rows admit it, but a real line of this width has no such forces."
            return text
        charge = float(penalty(self.cone.residual(self.wrench)))
        return f"Outside. Broken: {'; '.join(broken)}. Penalty of eq. 9: {charge:.3g}."

    def _draw_slice(self, broken: list[str]) -> None:
        figure = Picture(7.2, 4.4)
        axes = figure.subplots()
        at = {name: control.value for name, control in self.components.items() if name not in self._axes}
        draw_slice(axes, self.cone, *self._axes, at, broken)
        place = [self.components[name].value for name in self._axes]
        axes.plot(*place, "o", color=LIMIT if broken else FORCE, markersize=9, gid="wrench")
        axes.set_title(
            ", ".join(f"{name} = {value:.3g} {UNITS[name]}" for name, value in at.items()),
            loc="left",
            fontsize="small",
        )
        words = f"slice of the wrench cone in {self._axes[0]} and {self._axes[1]}, the wrench "
        self.board.show(figure, axes, words + ("outside" if broken else "inside"))
        self.pictures["slice"] = figure

    def _draw_ends(self) -> None:
        """Show the forces at the ends of the line that would make the wrench."""
        figure = Picture(7.2, 2.8)
        axes = figure.subplots()
        width = 0.01 * self.width.value
        ends(axes, end_forces(self.wrench, width), width, self.mu.value)
        axes.set_title(
            "the same wrench as forces at the two ends of a wheel's line", loc="left", fontsize="small"
        )
        self.show("ends", figure, "forces at the two ends of the line that make the wrench, and their cones")

    def _dragged(self, _change: object) -> None:
        if self._moving:
            return
        self._moving = True
        for name, value in zip(self._axes, self.board.points["wrench"], strict=True):
            self.components[name].value = value
        self._moving = False
        self._follow()


class Support(Panel):
    """Four wheels, and perhaps a hand on a wall, seen from above: where may the zero-moment point be?

    Attributes:
        board: the top view, with a handle for each wheel, ``"com"`` and ``"zmp"``.
        kind: of area, one of :data:`AREAS`.
        mu: friction coefficient of the wheels.
        height: of the centre of mass.
        steer: angle of all wheels in degrees.
        wheels: by leg, whether it is on the ground.
        hand: whether the hand pushes against the wall.
        area: ``(k, 2)`` what is shown.
        polygon: ``(k, 2)`` polygon of support of the wheels.
    """

    WIDTH, WALL, HAND_HEIGHT, HAND_MU = 0.04, 0.85, 0.92, 0.6
    REACH = (-0.6, 1.2, -0.6, 0.6)

    def __init__(self) -> None:
        points = {leg: tuple(place) for leg, place in zip(LEGS, WHEEL_POSITIONS.tolist(), strict=True)}
        points |= {"com": (0.0, 0.0), "zmp": (0.1, 0.05)}
        colours = dict.fromkeys(LEGS, WHEEL) | {"com": MEASURED, "zmp": FORCE}
        self.board = Board(points, colours)
        self.kind = choice(AREAS, "pendular", "area")
        self.mu = slider(0.3, 0.05, 1.2, 0.05, "μ of the wheels")
        self.height = slider(0.45, 0.2, 0.9, 0.05, "height of the CoM (m)")
        self.steer = slider(0.0, -90.0, 90.0, 5.0, "wheels steered (°)")
        box = {"indent": False}
        self.wheels = {
            leg: ipywidgets.Checkbox(
                value=True, description=leg, layout=ipywidgets.Layout(width="5em"), **box
            )
            for leg in LEGS
        }
        self.hand = ipywidgets.Checkbox(value=False, description="hand on the wall", **box)
        self.area = self.polygon = np.empty((0, 2))
        controls = [self.kind, self.mu, self.height, self.steer, *self.wheels.values(), self.hand]
        super().__init__(controls, [])
        self.children = (*self.children, self.board)
        self.board.observe(self._follow, names="points")

    @property
    def contacts(self) -> list[Contact]:
        """Wheels on the ground, and the hand, if it pushes."""
        R = axes_on((0.0, 0.0, 1.0), np.radians(self.steer.value))
        cone = line_contact(self.mu.value, self.WIDTH)
        found = [
            Contact(np.array([*self.board.points[leg], 0.0]), R, cone)
            for leg in LEGS
            if self.wheels[leg].value
        ]
        if self.hand.value:
            place = np.array([self.WALL, 0.0, self.HAND_HEIGHT])
            found.append(Contact(place, axes_on((-1.0, 0.0, 0.0)), point_contact(self.HAND_MU)))
        return found

    def redraw(self) -> None:
        """Find area and polygon, and say whether the point is in them and what motion that is."""
        contacts = self.contacts
        ground = [contact for contact in contacts if contact.R_wc[2, 2] > 0.5]
        com = np.array([*self.board.points["com"], self.height.value])
        zmp = np.array(self.board.points["zmp"])
        if not ground:
            self.area = self.polygon = np.empty((0, 2))
            self.say("No wheel is on the ground.")
        else:
            self.area = support_area(contacts, self.kind.value, com)
            self.polygon = support_area(ground)
            self.say(self._verdict(com, zmp))
        figure = Picture(8.0, 5.0)
        axes = figure.subplots()
        tidy(axes)
        draw_area(axes, self.area, PLANNED, "area", fill=0.2)
        draw_area(axes, self.polygon, INK, "polygon", "--")
        if self.hand.value:
            axes.axvline(self.WALL, color=INK, linewidth=3)
        draw_contacts(axes, contacts, self.WIDTH)
        axes.plot(*zip(com[:2], zmp, strict=True), color=FORCE, linewidth=1.0, linestyle=":")
        left, right, low, high = self.REACH
        axes.set_xlim(left, right)
        axes.set_ylim(low, high)
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlabel("x, ahead (m)")
        axes.set_ylabel("y, to the left (m)")
        handles = [
            Patch(facecolor=PLANNED, alpha=0.2, label=f"{self.kind.value} area"),
            Patch(fill=False, edgecolor=INK, linestyle="--", label="polygon of support"),
            Patch(color=MEASURED, label="CoM"),
            Patch(color=FORCE, label="zero-moment point"),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
        self.board.show(figure, axes, "wheels from above, the area of support, and the polygon around them")
        self.pictures["above"] = figure

    def _verdict(self, com: np.ndarray, zmp: np.ndarray) -> str:
        if self.kind.value == "static":
            held = inside(com[:2], self.area)
            text = f"At rest the CoM is {'held' if held else 'not held'}"
            return f"{text}; it is {self._where(com[:2])} the polygon of support."
        possible = inside(zmp, self.area)
        if self.kind.value == "full":
            motion = "possible with some motion" if possible else "impossible with any motion"
            return f"This zero-moment point is {motion}; it is {self._where(zmp)} the polygon of support."
        push = GRAVITY * (com[:2] - zmp) / com[2]
        text = f"The CoM is accelerated by ({push[0]:.1f}, {push[1]:.1f}) m/s² at its height"
        text += f": {'possible' if possible else 'impossible'}"
        return f"{text}. The zero-moment point is {self._where(zmp)} the polygon of support."

    def _where(self, point: np.ndarray) -> str:
        return "inside" if inside(point, self.polygon) else "outside"
