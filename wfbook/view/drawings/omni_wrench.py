"""Chapter 10's drawings: slices of wrench cones, the penalty, areas of support, a robot pushed over."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from wfbook.modes import LEGS
from wfbook.omni.support import Contact, support_area
from wfbook.omni.tipping import WIDTH, Tipping
from wfbook.omni.wrench import COMPONENTS, WrenchCone, end_forces, line_ends, penalty, polygon
from wfbook.view.style import FORCE, INK, LIMIT, MEASURED, PALE, PLANNED, WHEEL, Picture, tidy

REACH = {"fx": 120.0, "fy": 120.0, "fz": 200.0, "τx": 4.0, "τy": 4.0, "τz": 4.0}
"""How far the axes of a slice go; that of fz begins a little below zero."""

UNITS = {name: "N" if name[0] == "f" else "N m" for name in COMPONENTS}
_STYLES = ("-", "--", ":", "-.")


def limits_of(name: str) -> tuple[float, float]:
    """Return where the axis of a component begins and ends."""
    return (-30.0, REACH[name]) if name == "fz" else (-REACH[name], REACH[name])


def frame_slice(axes: Axes, across: str, up: str) -> tuple[float, float, float, float]:
    """Give axes the names, units and limits of two components; return the limits."""
    tidy(axes)
    box = (*limits_of(across), *limits_of(up))
    axes.set_xlim(*box[:2])
    axes.set_ylim(*box[2:])
    axes.axhline(0.0, color=PALE, linewidth=0.8)
    axes.axvline(0.0, color=PALE, linewidth=0.8)
    axes.set_xlabel(f"{across} ({UNITS[across]})")
    axes.set_ylabel(f"{up} ({UNITS[up]})")
    return box


def draw_slice(
    axes: Axes, cone: WrenchCone, across: str, up: str, at: Mapping[str, float], broken: Sequence[str] = ()
) -> np.ndarray:
    """Fill what a cone admits in a plane of two components, and draw the rows that are broken in red.

    Args:
        axes: to draw in.
        cone: to cut.
        across: component along the axes' x.
        up: along their y.
        at: the other four components.
        broken: names of rows.

    Returns:
        ``(k, 2)`` corners of what is admitted.
    """
    box = frame_slice(axes, across, up)
    A, b = cone.cut((across, up), at)
    corners = polygon(A, b, box)
    if len(corners):
        # A slice may be no more than a line: its edge shows it.
        axes.add_patch(Polygon(corners, facecolor=WHEEL, alpha=0.3, linewidth=0))
        axes.add_patch(Polygon(corners, fill=False, edgecolor=WHEEL, linewidth=2.5, gid="admitted"))
    for name in broken:
        row, bound = A[cone.names.index(name)], b[cone.names.index(name)]
        size = float(row @ row)
        if size > 1e-12:
            foot, along = row * bound / size, np.array([-row[1], row[0]])
            axes.axline(foot, foot + along, color=LIMIT, linewidth=1.4, linestyle="--", gid=f"row {name}")
    return corners


def compared(
    cones: Mapping[str, tuple[WrenchCone, str]], across: str, up: str, at: Mapping[str, float]
) -> Picture:
    """Draw the outlines of several cones in one slice, each with its name and colour."""
    figure = Picture(7.4, 3.8)
    axes = figure.subplots()
    box = frame_slice(axes, across, up)
    for (name, (cone, colour)), style in zip(cones.items(), _STYLES, strict=False):
        corners = polygon(*cone.cut((across, up), at), box)
        if len(corners):
            paint = {"edgecolor": colour, "linewidth": 2.2, "linestyle": style}
            axes.add_patch(Polygon(corners, fill=False, gid=name, label=name, **paint))
        else:
            axes.plot([], [], color=colour, label=f"{name}: nothing", gid=name)
    others = ", ".join(f"{name} = {value:g} {UNITS[name]}" for name, value in at.items() if value)
    axes.set_title(f"at {others}, the rest zero", loc="left", fontsize="small", color=INK)
    figure.legend(loc="outside right center", frameon=False)
    return figure


def ends(axes: Axes, forces: np.ndarray, width: float, mu: float) -> None:
    """Draw a wheel's line of contact from behind, and the forces at its ends with their friction cones.

    Args:
        axes: to draw in.
        forces: ``(2, 3)`` at the left and the right end.
        width: of the line.
        mu: friction coefficient.
    """
    tidy(axes)
    places = -100.0 * line_ends(width)[:, 1]  # seen from behind, left is left
    reach, high = 7.0, 200.0
    scale = 0.5 * reach / high
    axes.axhline(0.0, color=INK, linewidth=1.2)
    axes.plot(places, [0.0, 0.0], color=WHEEL, linewidth=7, solid_capstyle="round", gid="line")
    for place, force in zip(places, forces, strict=True):
        fan = np.array([[place, 0.0], [place - mu * high * scale, high], [place + mu * high * scale, high]])
        axes.add_patch(Polygon(fan, facecolor=WHEEL, alpha=0.18, linewidth=0))
        # The force along the wheel is drawn to the side: what counts is how it compares with the normal one.
        tip = (place + scale * force[0], force[2])
        axes.annotate(
            "",
            xy=tip,
            xytext=(place, 0.0),
            arrowprops={"arrowstyle": "-|>", "color": FORCE, "linewidth": 2.6, "shrinkA": 0, "shrinkB": 0},
        ).set_gid("force")
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-60.0, high)
    axes.set_xlabel("along the axle (cm); arrows lean by the force along the wheel")
    axes.set_ylabel("normal force (N)")


def penalties(cone: WrenchCone, at: Mapping[str, float], across: str = "fx") -> Picture:
    """Draw eq. 9, row by row and as printed, along one component of a wrench.

    Args:
        cone: whose rows are charged.
        at: the other components.
        across: the component that changes.
    """
    values = np.linspace(*limits_of(across), 801)
    wrenches = np.tile([at.get(name, 0.0) for name in COMPONENTS], (len(values), 1))
    wrenches[:, COMPONENTS.index(across)] = values
    residual = cone.residual(wrenches)
    admitted = cone.admits(wrenches)
    literal = np.where(admitted, 0.0, 0.5 * (residual**2).sum(axis=1))
    figure = Picture(7.4, 3.2)
    axes = figure.subplots()
    tidy(axes)
    if admitted.any():
        axes.axvspan(*values[admitted][[0, -1]], color=WHEEL, alpha=0.2, label="admitted", linewidth=0)
    axes.plot(values, penalty(residual), color=PLANNED, linewidth=2.4, label="row by row", gid="row by row")
    axes.plot(values, literal, color=LIMIT, linestyle="--", label="the whole vector", gid="whole vector")
    axes.set_xlabel(f"{across} ({UNITS[across]})")
    axes.set_ylabel("penalty α")
    axes.set_ylim(-0.03 * literal.max(), 0.6 * literal.max())
    figure.legend(loc="outside right center", frameon=False)
    return figure


def draw_contacts(axes: Axes, contacts: Sequence[Contact], width: float) -> None:
    """Draw contacts from above: a bar for a wheel's line, a dot for a hand."""
    for contact in contacts:
        line = "left end: fz ≥ 0" in contact.cone.names
        if line:
            tread = contact.position + line_ends(width) @ contact.R_wc.T
            axes.plot(*tread.T[:2], color=WHEEL, linewidth=6, solid_capstyle="butt", gid="wheel")
        else:
            axes.plot(*contact.position[:2], "D", color=INK, markersize=8, gid="hand")


def draw_area(
    axes: Axes, area: np.ndarray, colour: str, gid: str, style: str = "-", fill: float = 0.0
) -> None:
    """Draw an area of support; what is no polygon is a line or a dot."""
    if not len(area):
        return
    if fill:
        axes.add_patch(Polygon(area, facecolor=colour, alpha=fill, linewidth=0))
    paint = {"edgecolor": colour, "linewidth": 2.0, "linestyle": style}
    axes.add_patch(Polygon(area, fill=False, gid=gid, **paint))


def areas(contacts: Sequence[Contact], com: np.ndarray, width: float, reach: float = 1.1) -> Picture:
    """Draw the three areas of support of some contacts, from above, side by side.

    Args:
        contacts: wheels and hands.
        com: ``(3,)`` centre of mass, for the pendular area.
        width: of the wheels' lines.
        reach: of the axes.
    """
    figure = Picture(9.6, 3.6)
    titles = {
        "full": "full: any motion",
        "pendular": "pendular: CoM at its height",
        "static": "static: at rest",
    }
    ground = [contact for contact in contacts if contact.R_wc[2, 2] > 0.99]
    for axes, (kind, title) in zip(figure.subplots(1, 3, sharey=True), titles.items(), strict=True):
        tidy(axes)
        draw_area(axes, support_area(contacts, kind, com), PLANNED, kind, fill=0.2)
        draw_area(axes, support_area(ground, "full"), INK, "polygon of support", "--")
        draw_contacts(axes, contacts, width)
        axes.plot(*com[:2], "o", color=MEASURED, gid="com")
        axes.set_xlim(-0.6, reach)
        axes.set_ylim(-0.7, 0.7)
        axes.set_aspect("equal", adjustable="box")
        axes.set_title(title, loc="left", fontsize="small")
        axes.set_xlabel("x, ahead (m)")
    figure.axes[0].set_ylabel("y, to the left (m)")
    handles = [
        Patch(facecolor=PLANNED, alpha=0.2, label="where the zero-moment point can be"),
        Line2D([], [], color=INK, linestyle="--", label="polygon of support"),
        Line2D([], [], color=MEASURED, marker="o", linestyle="", label="CoM"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
    return figure


def pushed(cases: Mapping[str, Tipping]) -> Picture:
    """Draw what the wheels carry and where the zero-moment point goes while the push grows.

    Args:
        cases: by name, robots pushed to the left.
    """
    figure = Picture(9.0, 5.0)
    panes = figure.subplots(2, len(cases), sharex=True, sharey="row", squeeze=False)
    for column, (name, tipping) in zip(panes.T, cases.items(), strict=True):
        push = np.linalg.norm(tipping.push, axis=1)
        pushed_yet = tipping.t >= 0.0
        above, below = column
        for axes in column:
            tidy(axes)
        for leg, style in zip(range(4), _STYLES, strict=True):
            pressed = tipping.wrench[pushed_yet, leg, 2]
            above.plot(
                push[pushed_yet], pressed, color=WHEEL, linestyle=style, label=LEGS[leg], gid=LEGS[leg]
            )
        start = int(np.argmax(pushed_yet))
        area = support_area(tipping.contacts(start))
        below.plot(push[pushed_yet], tipping.zmp[pushed_yet, 1], color=FORCE, linewidth=2.4, gid="zmp")
        below.axhline(area[:, 1].max(), color=LIMIT, linestyle="--", gid="edge")
        lift = tipping.first_lift()
        for axes in column:
            if lift is not None:
                axes.axvline(push[lift], color=MEASURED, linewidth=1.0, gid="lift")
        above.set_title(name, loc="left", fontsize="small")
        below.set_xlabel("push to the left (N)")
    panes[0, 0].set_ylabel("normal force (N)")
    panes[1, 0].set_ylabel("zero-moment point, y (m)")
    legs = [Line2D([], [], color=WHEEL, linestyle=s, label=leg) for leg, s in zip(LEGS, _STYLES, strict=True)]
    others = [
        Line2D([], [], color=FORCE, label="zero-moment point"),
        Line2D([], [], color=LIMIT, linestyle="--", label="edge of the area"),
        Line2D([], [], color=MEASURED, linewidth=1.0, label="first wheel lifts"),
    ]
    figure.legend(handles=[*legs, *others], loc="outside upper center", ncols=7, frameon=False)
    return figure


def in_the_cones(tipping: Tipping) -> Picture:
    """Draw the simulated forces at the ends of all wheels' lines, at all times, and the cone of friction.

    The rows of :func:`.line_contact` say nothing but that these are in their pyramids.

    Args:
        tipping: what happened.
    """
    wrenches = tipping.wrench[tipping.t >= 0.0].reshape(-1, 6)
    force = np.array([end_forces(wrench, WIDTH) for wrench in wrenches])
    figure = Picture(8.6, 3.4)
    top = 1.1 * float(force[..., 2].max())
    for axes, (column, name) in zip(
        figure.subplots(1, 2, sharey=True), ((0, "fx, along"), (1, "fy, across")), strict=True
    ):
        tidy(axes)
        fan = np.array([[0.0, 0.0], [tipping.mu * top, top], [-tipping.mu * top, top]])
        draw_area(axes, fan, WHEEL, "cone", fill=0.2)
        axes.plot(
            force[..., column].ravel(), force[..., 2].ravel(), ".", color=MEASURED, markersize=2, gid="forces"
        )
        axes.set_xlim(-tipping.mu * top, tipping.mu * top)
        axes.set_ylim(-0.05 * top, top)
        axes.set_xlabel(f"{name} (N)")
    figure.axes[0].set_ylabel("normal force of an end (N)")
    return figure
