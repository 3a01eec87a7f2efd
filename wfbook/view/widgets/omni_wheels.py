"""Chapter 9's widgets: a base to drive, and a centre of rotation to drag."""

import ipywidgets
import numpy as np
from matplotlib.axes import Axes

from wfbook.omni.base import Base, Drive
from wfbook.omni.robot import WHEEL_POSITIONS
from wfbook.omni.wheels import HYSTERESIS, connection, instantaneous_centre, twist_about, wheel_command
from wfbook.view.drawings.omni_wheels import draw_base, wheels_over_time
from wfbook.view.style import INK, PALE, PLANNED, Picture, tidy
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.controls import slider
from wfbook.view.widgets.panel import PANEL, Panel

_LONGEST = 6.0
_SPAN = 2.5
"""Seconds drawn after a change, at least; the wheels are there long before in most cases."""


class DriveTheBase(Panel):
    """Drive a base on four steered wheels: choose a twist, and see how it gets there from the one before.

    The base keeps its state: what the wheels have to do depends on where they stand.

    Attributes:
        ahead, sideways, turn: the twist wanted.
        steer_first: whether the wheels steer before the body moves.
        hysteresis: see :func:`wfbook.omni.wheels.shorter_turns`, in degrees.
        base: the base; its state after what was drawn.
        drive: what was drawn.
    """

    def __init__(self) -> None:
        self.ahead = slider(0.6, -1.2, 1.2, 0.1, "ahead (m/s)")
        self.sideways = slider(0.0, -1.2, 1.2, 0.1, "to the left (m/s)")
        self.turn = slider(0.0, -2.0, 2.0, 0.1, "turn (rad/s)")
        self.hysteresis = slider(float(np.degrees(HYSTERESIS)), 0.0, 40.0, 5.0, "hysteresis (deg)")
        self.steer_first = ipywidgets.Checkbox(value=True, description="steer first", indent=False)
        self.base = Base()
        self.drive: Drive | None = None
        controls = [self.ahead, self.sideways, self.turn, self.hysteresis, self.steer_first]
        super().__init__(controls, ["above", "time"])

    @property
    def wanted(self) -> np.ndarray:
        """``(3,)`` the twist that the sliders ask for."""
        return np.array([self.ahead.value, self.sideways.value, self.turn.value])

    def redraw(self) -> None:
        """Let the base follow what is wanted now, and draw the way there."""
        self.base.steer_first = self.steer_first.value
        self.base.hysteresis = np.radians(self.hysteresis.value)
        drive = self.base.drive(self.wanted, _LONGEST)
        # The state goes on from the end; drawn is the part in which something happens.
        busy = np.flatnonzero(np.abs(np.diff(drive.steering, axis=0)).max(axis=1) > 1e-6)
        changing = np.flatnonzero(np.abs(np.diff(drive.twist, axis=0)).max(axis=1) > 1e-9)
        end = max(_SPAN, 0.5 + drive.t[max([0, *busy[-1:], *changing[-1:]])])
        shown = slice(0, int(np.searchsorted(drive.t, end)) + 1)
        self.drive = drive = Drive(
            *(
                values[shown]
                for values in (drive.t, drive.pose, drive.twist, drive.steering, drive.speed, drive.skid)
            )
        )
        figure = Picture(9.0, 4.4)
        left, right = figure.subplots(1, 2)
        draw_base(left, drive.twist[-1], drive.steering[-1])
        left.set_title("the body's view, at the end", loc="left", fontsize="medium", color=INK)
        self._draw_path(right)
        rank = np.linalg.matrix_rank(connection(drive.steering[-1], self.base.positions, 1.0), tol=1e-9)
        self.show("above", figure, "The base from above with its wheels and centre of rotation, and its way")
        self.show("time", wheels_over_time(drive), "Steering angles, speeds and skid of the wheels over time")
        self.say(self._verdict(int(rank)))

    def _draw_path(self, axes: Axes) -> None:
        """Draw the way of the body's middle and of the centre of rotation, in the ground's axes."""
        tidy(axes)
        pose = self.drive.pose
        x, y = (pose[:, :2] - pose[0, :2]).T
        cos, sin = np.cos(pose[0, 2]), np.sin(pose[0, 2])
        axes.plot(cos * y - sin * x, cos * x + sin * y, color=PLANNED, linewidth=2.0, gid="path")
        axes.plot([0.0], [0.0], marker="o", color=PALE, gid="start")
        axes.set_aspect("equal", adjustable="datalim")
        axes.invert_xaxis()
        axes.set_xlabel("to the left of where it was (m)")
        axes.set_ylabel("ahead of where it was (m)")
        axes.set_title("the way of its middle", loc="left", fontsize="medium", color=INK)

    def _verdict(self, rank: int) -> str:
        drive = self.drive
        turned = np.degrees(np.ptp(drive.steering, axis=0)).max()
        waits = float(drive.t[int(np.argmax(np.abs(drive.twist - drive.twist[0]).max(axis=1) > 1e-9))])
        centre = instantaneous_centre(drive.twist[-1])
        parts = [
            f"The wheels turn by up to {turned:.0f}° and skid with up to {np.abs(drive.skid).max():.2f} m/s."
        ]
        if waits > 0.015:
            parts.append(f"They steer for {waits:.2f} s before the body moves.")
        if centre is None:
            parts.append("No centre of rotation.")
        else:
            parts.append(f"Centre: {centre[0]:+.2f} m ahead, {centre[1]:+.2f} m to the left.")
        parts.append(f"Rank of A: {rank}.")
        return " ".join(parts)


class CentreOfRotation(ipywidgets.VBox):
    """Drag the point about which the body turns, and see how the wheels stand.

    Attributes:
        rate: yaw rate.
        board: the picture with the handle ``"centre"``, at (y, x): the view is the body's, x ahead is up.
        steering: ``(4,)`` angles of the wheels now; they go on from where they stood.
        speed: ``(4,)`` of the wheels.
    """

    def __init__(self) -> None:
        self.rate = slider(0.8, -1.5, 1.5, 0.1, "turn (rad/s)")
        self.board = Board({"centre": (0.6, -0.28)}, {"centre": INK}, {"centre": (-0.95, 0.95, -0.95, 0.95)})
        self.status = ipywidgets.HTML()
        self.steering, self.speed = np.zeros(4), np.zeros(4)
        self._backward = np.zeros(4, bool)
        super().__init__([self.rate, self.status, self.board])
        self.add_class(PANEL)
        self.rate.observe(self._follow, names="value")
        self.board.observe(self._follow, names="points")
        self._follow()

    @property
    def twist(self) -> np.ndarray:
        """``(3,)`` of the body."""
        y, x = self.board.points["centre"]
        return twist_about(np.array([x, y]), self.rate.value)

    def _follow(self, _change: object = None) -> None:
        command = wheel_command(self.twist, WHEEL_POSITIONS, self.steering, self._backward)
        self.steering, self.speed, self._backward = command.steering, command.speed, command.backward
        figure = Picture(5.2, 5.2)
        axes = figure.subplots()
        draw_base(axes, self.twist, self.steering)
        self.board.show(figure, axes, "The base from above; all axles point at the centre of rotation")
        angles = ", ".join(f"{angle:.0f}°" for angle in np.degrees(self.steering))
        speeds = ", ".join(f"{speed:+.2f}" for speed in self.speed)
        self.status.value = f"Steering FL, FR, RL, RR: {angles}. Speeds: {speeds} m/s."
