"""Chapter 9's drawings: a base from above, the four classical modes, how steering and speed go over time."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from wfbook.modes import LEGS
from wfbook.omni.base import Drive
from wfbook.omni.driving import Driving
from wfbook.omni.robot import HAND_HEIGHT, WHEEL_HALF_WIDTH, WHEEL_POSITIONS, WHEEL_RADIUS
from wfbook.omni.wheels import instantaneous_centre, wheel_command, wheel_velocities
from wfbook.view.style import BODY, HAND, INK, MEASURED, PALE, PLANNED, WHEEL, Picture, tidy

TRUNK = np.array([[0.33, 0.14], [-0.33, 0.14], [-0.33, -0.14], [0.33, -0.14]])
LEG_STYLES = ("-", "--", "-.", ":")
_ARROW = 0.35
"""Length of the arrow of a wheel at 1 m/s, in metres."""


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return points @ np.array([[cos, sin], [-sin, cos]])


def draw_base(
    axes: Axes,
    twist: np.ndarray,
    steering: np.ndarray,
    reach: float = 1.0,
    positions: np.ndarray = WHEEL_POSITIONS,
) -> None:
    """Draw trunk, wheels, their velocities and the centre of rotation from above, x ahead to the top.

    The view is the body's: its x axis points up on the page, its y axis to the left.

    Args:
        axes: to draw on.
        twist: ``(3,)`` of the body.
        steering: ``(n,)`` angles of the wheels.
        reach: how far the view goes to each side.
        positions: ``(n, 2)`` of the wheels.
    """
    tidy(axes)
    axes.set_aspect("equal")
    axes.set_xlim(reach, -reach)
    axes.set_ylim(-reach, reach)
    axes.set_xticks(np.arange(-0.5, 0.6, 0.5))
    axes.set_yticks(np.arange(-0.5, 0.6, 0.5))
    axes.set_xlabel("y, to the left (m)")
    axes.set_ylabel("x, ahead (m)")
    axes.add_patch(Polygon(TRUNK[:, ::-1], closed=True, facecolor=BODY, alpha=0.35, edgecolor=INK))
    velocity = wheel_velocities(twist, positions)
    centre = instantaneous_centre(twist)
    near = centre is not None and np.abs(centre).max() <= 20.0
    tyre = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [WHEEL_RADIUS, 1.4 * WHEEL_HALF_WIDTH]
    for place, angle, v in zip(positions, steering, velocity, strict=True):
        if near:
            line = np.array([place, centre])
            axes.plot(line[:, 1], line[:, 0], color=PALE, linestyle="--", linewidth=1.0, zorder=1)
        corners = place + _turned(tyre, angle)
        axes.add_patch(Polygon(corners[:, ::-1], closed=True, facecolor=WHEEL, edgecolor=INK, zorder=3))
        front = place + _turned(np.array([[0.0, 0.0], [0.8 * WHEEL_RADIUS, 0.0]]), angle)
        axes.plot(front[:, 1], front[:, 0], color=INK, linewidth=1.2, zorder=4)
        if np.linalg.norm(v) > 1e-3:
            axes.annotate(
                "",
                xy=(place + _ARROW * v)[::-1],
                xytext=place[::-1],
                arrowprops={"arrowstyle": "-|>", "color": PLANNED, "linewidth": 1.8},
                zorder=5,
            )
    if near:
        axes.plot(*centre[::-1], marker="o", color=INK, markersize=8, linestyle="", gid="centre", zorder=6)


def modes(twists: Mapping[str, np.ndarray]) -> Picture:
    """Draw what one map makes of several twists, each under its name."""
    figure = Picture(2.6 * len(twists), 3.1)
    for axes, (name, twist) in zip(
        figure.subplots(1, len(twists), squeeze=False)[0], twists.items(), strict=True
    ):
        draw_base(axes, twist, wheel_command(twist, WHEEL_POSITIONS, np.zeros(4)).steering, 0.95)
        axes.set_title(name, loc="left", fontsize="medium", color=INK)
        if axes is not figure.axes[0]:
            axes.set_ylabel("")
    return figure


def over_time(axes: Axes, t: np.ndarray, values: np.ndarray, label: str) -> None:
    """Draw one line for each wheel."""
    tidy(axes)
    for line, name, style in zip(values.T, LEGS, LEG_STYLES, strict=True):
        axes.plot(t, line, color=WHEEL, linestyle=style, linewidth=1.8, label=name, gid=name)
    axes.set_ylabel(label)


def wheels_over_time(drive: Drive, before: float = 0.0) -> Picture:
    """Draw steering angles, speeds and sideways skid of the four wheels.

    Args:
        drive: what the base did.
        before: time from which something else is wanted, marked by a line.
    """
    figure = Picture(9.0, 5.2)
    rows = figure.subplots(3, 1, sharex=True)
    over_time(rows[0], drive.t, np.degrees(drive.steering), "steering (deg)")
    over_time(rows[1], drive.t, drive.speed, "speed (m/s)")
    over_time(rows[2], drive.t, drive.skid, "skid (m/s)")
    for axes, least in zip(rows, (30.0, 0.2, 0.1), strict=True):
        low, high = axes.get_ylim()
        room = max(0.0, 2 * least - (high - low)) / 2
        axes.set_ylim(low - room, high + room)
        axes.axvline(before, color=PALE, linewidth=1.0)
    rows[2].set_xlabel("time (s)")
    rows[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return figure


def driven(drivings: Mapping[str, Driving]) -> Picture:
    """Draw the ways of the base and of the robot from above, and the height of the hand, for each drive."""
    figure = Picture(9.0, 3.2 * len(drivings))
    for row, (name, driving) in zip(
        figure.subplots(len(drivings), 2, squeeze=False), drivings.items(), strict=True
    ):
        above, height = row
        for axes in row:
            tidy(axes)
        above.plot(
            *driving.pose[:, :2].T, color=PLANNED, linewidth=2.5, label="wheels' arithmetic", gid="base"
        )
        above.plot(
            *driving.qpos[:, :2].T, color=MEASURED, linewidth=1.4, label="robot in MuJoCo", gid="robot"
        )
        above.set_aspect("equal", adjustable="datalim")
        above.set_xlabel("x (m)")
        above.set_ylabel("y (m)")
        above.set_title(name, loc="left", fontsize="medium", color=INK)
        above.legend(frameon=False, fontsize="small")
        height.plot(
            driving.t, 1e3 * (driving.hand[:, 2] - HAND_HEIGHT), color=HAND, linewidth=1.8, gid="hand"
        )
        height.set_xlabel("time (s)")
        height.set_ylabel("hand, from 0.92 m (mm)")
    return figure
