"""Chapter 1's drawings: a body that is pushed, from the side and from above, and the check on a run."""

from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from wfbook.centroidal import RollOut
from wfbook.modes import LEGS
from wfbook.runs import Momentum
from wfbook.view.style import BODY, FOOT, FORCE, INK, MEASURED, PALE, PLANNED, Picture, tidy

METRES_A_NEWTON = 0.0024
"""Length of a force's arrow: the robot's weight is 0.3 m."""

_TRUNK = np.array([[-0.19, -0.05], [0.19, -0.05], [0.19, 0.05], [-0.19, 0.05]])
_HIPS = np.array([[0.188, 0.0], [-0.188, 0.0]])
_LINK = 0.213
_ANGLES = ("roll", "pitch", "yaw")


def arrow(axes: Any, start: np.ndarray, vector: np.ndarray, name: str, colour: str = FORCE) -> None:
    """Draw an arrow from a point, named ``name`` for tests."""
    style = {"arrowstyle": "-|>,head_width=0.3,head_length=0.6", "color": colour, "linewidth": 2.4}
    tip = np.add(start, vector)
    drawn = axes.annotate("", tip, start, arrowprops=style | {"shrinkA": 0, "shrinkB": 0})
    drawn.set_gid(name)


def side_view(axes: Any, motion: RollOut, pitch: np.ndarray, feet: np.ndarray, forces: np.ndarray) -> None:
    """Draw a robot from its right: it stands on two pairs of legs, and where it goes.

    Args:
        axes: to draw in, with equal scales.
        motion: what the forces do to it.
        pitch: ``(K+1,)`` of the trunk, nose down.
        feet: ``(2, 2)`` where front and rear pair stand, x and z.
        forces: ``(2, 2)`` on the pairs, x and z, in newtons.
    """
    axes.axhline(0.0, color=PALE, linewidth=1.5)
    for k in np.linspace(0, len(motion.t) - 1, 4).astype(int)[::-1]:
        turned = np.array([[np.cos(pitch[k]), -np.sin(pitch[k])], [np.sin(pitch[k]), np.cos(pitch[k])]])
        com = motion.x[k, [0, 2]]
        shade = 1.0 if k == 0 else 0.25
        outline = com + _TRUNK @ turned
        axes.add_patch(Polygon(outline, closed=True, facecolor=BODY, alpha=0.35 * shade, gid=f"trunk {k}"))
        if k == 0:
            for hip, foot in zip(np.add(com, _HIPS), feet, strict=True):
                axes.plot(*_leg(hip, foot).T, color=BODY, linewidth=3, solid_capstyle="round", zorder=1.5)
    total = forces.sum(axis=0)
    if forces[:, 1].sum() > 1.0:
        # Where one force could act instead of two: the line on which the CoM would not be turned.
        pressure = feet[:, 0] @ forces[:, 1] / forces[:, 1].sum()
        line = np.array([[pressure, 0.0], [pressure, 0.0] + 0.6 * total / np.linalg.norm(total)])
        axes.plot(*line.T, color=FORCE, linestyle=":", linewidth=1.5, gid="line of action")
    for name, foot, force in zip(("front force", "rear force"), feet, forces, strict=True):
        arrow(axes, foot, METRES_A_NEWTON * force, name)
    axes.plot(motion.x[:, 0], motion.x[:, 2], color=PLANNED, linewidth=2, gid="CoM path")
    axes.plot(*motion.x[0, [0, 2]], "o", color=PLANNED, markersize=7, gid="CoM")
    tidy(axes)
    axes.set(xlabel="x, forward (m)", ylabel="z, up (m)", aspect="equal")


def _leg(hip: np.ndarray, foot: np.ndarray) -> np.ndarray:
    """Return hip, knee and foot; the knee points back, and a leg that can't reach is straight."""
    away = foot - hip
    length = np.hypot(*away)
    bend = np.sqrt(max(_LINK**2 - 0.25 * length**2, 0.0))
    back = np.array([away[1], -away[0]]) / max(length, 1e-9)
    return np.array([hip, hip + 0.5 * away + bend * back, foot])


def support(axes: Any, p: np.ndarray, stands: np.ndarray, forces: np.ndarray) -> None:
    """Draw contacts from above: standing legs with a disc as large as what they carry, and their polygon.

    Args:
        axes: to draw in.
        p: ``(4, 2)`` contacts.
        stands: ``(4,)`` bool.
        forces: ``(4,)`` upward, in newtons.
    """
    corners = p[stands]
    if len(corners) > 2:
        corners = corners[ConvexHull(corners).vertices]
    if len(corners) > 1:
        inside = (*to_rgb(PALE), 0.25)
        axes.add_patch(Polygon(corners, closed=True, facecolor=inside, edgecolor=PALE, gid="support"))
    for leg, name in enumerate(LEGS):
        if stands[leg]:
            # The disc's area is the load.
            axes.plot(
                *p[leg],
                "o",
                color=FORCE,
                alpha=0.4,
                markersize=4.5 * np.sqrt(forces[leg]),
                gid=f"{name} load",
            )
            axes.plot(*p[leg], "o", color=FOOT, markersize=6, gid=f"{name} foot")
        else:
            axes.plot(*p[leg], "o", color=PALE, fillstyle="none", markersize=9, gid=f"{name} in the air")
        outward = np.array([0.0, 0.06 * np.sign(p[leg, 1] or 1.0)])
        load = f"{name} {forces[leg]:.0f} N" if stands[leg] else f"{name} up"
        axes.text(*(p[leg] + outward), load, ha="center", va="center", color=INK)
    tidy(axes)
    axes.set(xlabel="x, forward (m)", ylabel="y, left (m)", aspect="equal")


def momentum_check(momentum: Momentum) -> Picture:
    """Draw eqs 1 and 8 with measured forces over what the simulator says.

    Args:
        momentum: of a run.
    """
    t = momentum.t
    figure = Picture(8.5, 4.8)
    grid = figure.subplots(3, 2, sharex=True)
    for axis in range(3):
        left, right = grid[axis]
        left.plot(t, momentum.velocity[:, axis], color=MEASURED, linewidth=3.0, alpha=0.35, gid="measured")
        left.plot(t, momentum.predicted.v[:, axis], color=FORCE, linewidth=1.2, gid="eq. 1")
        left.set_ylabel(f"{'xyz'[axis]} (m/s)")
        right.plot(t, momentum.trunk[:, axis], color=PLANNED, linewidth=0.9, gid="rigid")
        right.plot(t, momentum.angular[:, axis], color=MEASURED, linewidth=3.0, alpha=0.35, gid="measured")
        right.plot(t, momentum.predicted.momentum[:, axis], color=FORCE, linewidth=1.2, gid="eq. 8")
        right.set_ylabel(f"{_ANGLES[axis]} (N m s)")
    grid[0, 0].set_title("velocity of the CoM", fontsize="medium")
    grid[0, 1].set_title("angular momentum about the CoM", fontsize="medium")
    for axes in grid.flat:
        tidy(axes)
        axes.set_xlim(t[0], t[-1])
    for axes in grid[-1]:
        axes.set_xlabel("time (s)")
    handles = [
        Line2D([], [], color=MEASURED, linewidth=3.0, alpha=0.35, label="all bodies, MuJoCo"),
        Line2D([], [], color=FORCE, linewidth=1.2, label="from the contact forces, eqs 1 and 8"),
        Line2D([], [], color=PLANNED, linewidth=0.9, label="I θ̇, if it were one rigid body"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
    return figure
