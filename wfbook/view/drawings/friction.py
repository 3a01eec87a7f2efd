"""Chapter 4's drawings: the pyramid from above, the tilting table, and wheels that coast."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from wfbook.friction import inner_coefficient, rolling_friction, steepest_slope
from wfbook.standing import Standing
from wfbook.view.style import FOOT, FORCE, INK, LIMIT, MEASURED, PLANNED, WHEEL, Picture, tidy


def regular_pyramid(mu: float, sides: int) -> np.ndarray:
    """Return the corners of the regular pyramid inside of the cone, at unit normal force, ``(sides, 2)``."""
    angle = np.pi / sides * (1 + 2 * np.arange(sides))
    return mu * np.column_stack([np.cos(angle), np.sin(angle)])


def section(mu: float) -> Picture:
    """Draw cone and pyramids from above, at a normal force of 1: what a linearisation adds or gives away."""
    figure = Picture(7.0, 3.4)
    axes = figure.subplots()
    tidy(axes)
    draw_section(axes, mu, mu, 1.0)
    eight = regular_pyramid(mu, 8)
    axes.add_patch(Polygon(eight, fill=False, edgecolor=PLANNED, linewidth=1.8, gid="eight sides"))
    inner = inner_coefficient(mu)
    axes.add_patch(
        Polygon(
            inner * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]),
            fill=False,
            edgecolor=PLANNED,
            linestyle=":",
            linewidth=1.6,
            gid="inner pyramid",
        )
    )
    axes.set_xlabel("t, along (normal force = 1)")
    axes.set_ylabel("b, across")
    axes.set_aspect("equal", adjustable="box")
    handles = [
        Patch(facecolor=FOOT, alpha=0.25, label="cone: what the ground can give"),
        Line2D([], [], color=PLANNED, linestyle="--", label="pyramid of eq. 26"),
        Line2D([], [], color=PLANNED, linestyle=":", label="four sides, inside (μ/√2)"),
        Line2D([], [], color=PLANNED, label="eight sides, inside"),
        Patch(facecolor=FORCE, alpha=0.35, label="promised, not given"),
    ]
    figure.legend(handles=handles, loc="outside right center", frameon=False)
    return figure


def draw_section(axes: Axes, mu_t: float, mu_b: float, n: float) -> None:
    """Draw cone and pyramid of eq. 26 at a normal force ``n``, what is between them in pink.

    A wheel without traction has neither width: both are a line.
    """
    t, b = mu_t * n, mu_b * n
    corners = np.array([(t, b), (-t, b), (-t, -b), (t, -b)])
    colour = FOOT if mu_t > 0 else WHEEL
    if t > 0:
        axes.add_patch(Polygon(corners, facecolor=FORCE, alpha=0.35, linewidth=0, gid="promised"))
        angle = np.linspace(0.0, 2.0 * np.pi, 121)
        cone = np.column_stack([t * np.cos(angle), b * np.sin(angle)])
        axes.add_patch(Polygon(cone, facecolor="white", linewidth=0))
        axes.add_patch(Polygon(cone, facecolor=colour, alpha=0.25, linewidth=0, gid="cone"))
    else:
        axes.plot([0.0, 0.0], [-b, b], color=colour, linewidth=4, gid="cone")
    axes.add_patch(
        Polygon(corners, fill=False, edgecolor=PLANNED, linestyle="--", linewidth=1.6, gid="pyramid")
    )
    reach = 1.5 * max(t, b, 1e-3)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)


def tilting(cases: Sequence[tuple[str, Standing, str, str]], mu: float, width: float = 8.0) -> Picture:
    """Draw what the ground gives while a table tilts, beside what holding takes.

    Args:
        cases: name, what happened, colour and line style of each robot.
        mu: friction coefficient: the pyramid's limit, and the cone's, for a push straight along t or b.
        width: of the picture in inches.
    """
    figure = Picture(width, 3.4)
    axes = figure.subplots()
    tidy(axes)
    most = 0.0
    for rank, (name, standing, colour, style) in enumerate(cases):
        thick = 2.0 + 1.5 * (len(cases) - 1 - rank)  # one that lies on another leaves it visible
        tilts = standing.t > 0.0
        slope = np.degrees(standing.slope[tilts])
        smooth = np.convolve(np.pad(standing.grip[tilts], 4, mode="edge"), np.ones(9) / 9, "valid")
        axes.plot(slope, smooth, color=colour, linestyle=style, linewidth=thick, label=name, gid=name)
        most = max(most, float(slope.max()))
    slope = np.linspace(0.0, most, 101)
    axes.plot(
        slope, np.tan(np.radians(slope)), color=INK, linewidth=1, label="needed: tan slope", gid="needed"
    )
    axes.axhline(mu, color=LIMIT, linestyle="--", linewidth=1.4, label="μ", gid="mu")
    axes.axvline(np.degrees(np.arctan(mu)), color=LIMIT, linestyle="--", linewidth=1.0, gid="atan mu")
    axes.set_ylim(0.0, 1.25 * max(mu, float(np.tan(np.radians(most)))))
    axes.set_xlim(0.0, most)
    axes.set_xlabel("slope of the table (°)")
    axes.set_ylabel("force along / normal force (1)")
    figure.legend(loc="outside right center", frameon=False)
    return figure


def slip_angles(mu: Sequence[float], measured: dict[str, Sequence[float]]) -> Picture:
    """Draw the slope at which robots slid over the friction coefficient.

    Args:
        mu: friction coefficients that were tried.
        measured: angles in rad by what the robots stood on, ``"foot"`` or ``"wheel"`` (across the slope).
    """
    figure = Picture(6.5, 3.2)
    axes = figure.subplots()
    tidy(axes)
    fine = np.linspace(0.0, 1.15 * max(mu), 101)[1:]
    predicted = np.degrees([steepest_slope(m, m) for m in fine])
    axes.plot(fine, predicted, color=PLANNED, linewidth=1.8, label="predicted: atan μ", gid="predicted")
    for kind, angles in measured.items():
        colour, marker = (FOOT, "o") if kind == "foot" else (WHEEL, "s")
        label = "feet" if kind == "foot" else "wheels, across the slope"
        axes.plot(mu, np.degrees(angles), marker, color=colour, markersize=8, label=label, gid=kind)
    axes.set_xlim(0.0, fine[-1])
    axes.set_ylim(0.0, None)
    axes.set_xlabel("friction coefficient μ (1)")
    axes.set_ylabel("slides from (°)")
    axes.legend(frameon=False, loc="upper left")
    return figure


def coasting(standing: Standing, coefficient: float, gravity: float = 9.81) -> Picture:
    """Draw the speed of a robot that coasts on level ground, and what eq. 29 says with either sign.

    Args:
        standing: the robot; it moves along x.
        coefficient: of rolling resistance.
        gravity: m/s².
    """
    figure = Picture(6.5, 2.9)
    axes = figure.subplots()
    tidy(axes)
    t, start = standing.t, float(standing.com_velocity[0, 0])
    resistance = rolling_friction(gravity, coefficient)  # of a unit mass
    for acceleration, name, style in (
        (resistance, "against rolling (eq. 29, corrected)", "-"),
        (-resistance, "eq. 29 as printed", ":"),
    ):
        speed = np.maximum(start + acceleration * t, 0.0)
        axes.plot(t, speed, color=PLANNED, linestyle=style, linewidth=2.2, label=name, gid=name)
    axes.plot(t, standing.com_velocity[:, 0], color=MEASURED, linewidth=1.2, label="measured", gid="measured")
    axes.set_ylim(0.0, None)
    axes.set_xlim(t[0], t[-1])
    axes.set_xlabel("time (s)")
    axes.set_ylabel("speed (m/s)")
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
