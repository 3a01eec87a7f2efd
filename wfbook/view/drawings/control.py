"""Chapter 6's drawings: forces and torques beside their limits, late feedback, forces that do nothing."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Polygon

from wfbook.go1_dynamics import Go1Dynamics
from wfbook.modes import LEGS
from wfbook.reference import delayed_error
from wfbook.stance import JOINTS, Rehearsal, Stance
from wfbook.view.style import (
    BODY,
    FOOT,
    FORCE,
    INK,
    LIMIT,
    MEASURED,
    MODE_COLOURS,
    PALE,
    PLANNED,
    SWING,
    WHEEL,
    Picture,
    tidy,
)
from wfbook.wbc import friction_pyramids

if TYPE_CHECKING:
    from wfbook.simulate import Run
    from wfbook.wbc import Command

_STYLES = ("-", "--", "-.", ":")
_LIGHT = 5.0
"""Below this normal force, in N, the ratio of two forces says nothing."""
_LONGEST = 0.12
"""Length of the arrow of a force of a quarter of the weight, in metres."""
_AROUND = (0, 4, 2, 6, 1, 7, 3, 5)
"""The sides of a friction pyramid in the order in which they go round it."""


def limits(run: "Run") -> Picture:
    """Draw the torques that acted beside the motors' limits, and how much of their friction the legs use.

    Args:
        run: on the ground that its controller knew.
    """
    figure = Picture(8.0, 6.0)
    rows = figure.subplots(4, 1, sharex=True)
    effort = Go1Dynamics().effort.reshape(4, 3)
    for joint, axes in enumerate(rows[:3]):
        tidy(axes)
        for leg, name in enumerate(LEGS):
            torque = run.tau[:, 3 * leg + joint]
            axes.plot(run.t, torque, color=MEASURED, linestyle=_STYLES[leg], linewidth=0.9, gid=name)
        for sign in (1.0, -1.0):
            axes.axhline(sign * effort[0, joint], color=LIMIT, linewidth=1.6, gid="limit")
        axes.set_ylabel(f"{JOINTS[joint]} (N m)")
    use, mu = friction_use(run)
    tidy(rows[3])
    for leg, name in enumerate(LEGS):
        rows[3].plot(run.t, use[:, leg], color=MEASURED, linestyle=_STYLES[leg], linewidth=0.9, gid=name)
    rows[3].axhline(mu, color=LIMIT, linewidth=1.6, gid="limit")
    rows[3].set_ylim(0.0, 1.3 * mu)
    rows[3].set_ylabel("tangential /\nnormal force")
    rows[3].set_xlabel("time (s)")
    rows[3].set_xlim(run.t[0], run.t[-1])
    handles = [
        Line2D([], [], color=MEASURED, linestyle=style, label=name)
        for style, name in zip(_STYLES, LEGS, strict=True)
    ]
    handles.append(Line2D([], [], color=LIMIT, linewidth=1.6, label="limit"))
    figure.legend(handles=handles, loc="outside upper center", ncols=5, frameon=False)
    return figure


def friction_use(run: "Run") -> tuple[np.ndarray, float]:
    """Return tangential over normal force ``(N, 4)`` on the legs, and the least friction coefficient.

    A leg that presses with less than 5 N has no entry (nan).
    """
    terrain = run.terrain
    use = np.full(run.p.shape[:2], np.nan)
    for leg in range(4):
        regions = [terrain.region_at(*point[:2]) for point in run.p[:, leg]]
        normals = np.array([[0.0, 0.0, 1.0] if r is None else terrain.regions[r].normal for r in regions])
        force = run.contact_force[:, leg]
        along = np.sum(force * normals, axis=1)
        aside = np.linalg.norm(force - along[:, None] * normals, axis=1)
        use[:, leg] = np.where(along > _LIGHT, aside / np.maximum(along, _LIGHT), np.nan)
    return use, min(region.mu_foot for region in terrain.regions)


def delayed(gains: Mapping[str, tuple[float, float, float]], delays: list[float], duration: float) -> Picture:
    """Draw how an error fades that is corrected late (eq. 34 on one axis).

    Args:
        gains: by name, kp, kd and ki; one panel each.
        delays: in seconds; one line each, the later the darker.
        duration: of the time axis.
    """
    figure = Picture(8.0, 2.8)
    row = figure.subplots(1, len(gains), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (name, values) in zip(row, gains.items(), strict=True):
        tidy(axes)
        for i, delay in enumerate(delays):
            t, error = delayed_error(*values, delay, duration)
            shade = 0.25 + 0.75 * (i + 1) / len(delays)
            axes.plot(t, error, color=MEASURED, alpha=shade, linewidth=1.4, label=f"{1e3 * delay:.0f} ms")
        axes.axhline(0.0, color=PLANNED, linewidth=1.0)
        axes.set_title(name, loc="left", fontsize="medium", color=INK)
        axes.set_xlabel("time (s)")
    row[0].set_ylim(-1.6, 1.6)
    row[0].set_xlim(0.0, duration)
    row[0].set_ylabel("error")
    figure.legend(
        *row[0].get_legend_handles_labels(), loc="outside right upper", frameon=False, title="delay"
    )
    return figure


def scrub(rehearsals: Mapping[str, Rehearsal]) -> Picture:
    """Draw how fast the wheels slide sideways in motions that the program takes to be free of sliding.

    Args:
        rehearsals: by name; names that end in "as printed" are drawn as limits that are broken.
    """
    figure = Picture(8.0, 2.8)
    axes = figure.add_subplot()
    tidy(axes)
    for name, rehearsal in rehearsals.items():
        sideways = np.abs(rehearsal.contact_velocity[:, :, 1]).max(axis=1)
        colour = LIMIT if "as printed" in name else WHEEL
        style = "-" if "damping" not in name else "--"
        axes.plot(rehearsal.t, 1e3 * sideways, color=colour, linestyle=style, linewidth=1.8, label=name)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("largest sideways\nwheel velocity (mm/s)")
    axes.set_ylim(bottom=-2.0)
    axes.legend(frameon=False, loc="upper left")
    return figure


def internal_forces(stance: Stance, forces: np.ndarray) -> Picture:
    """Draw forces that do nothing, seen from above: feet squeeze and twist, the robot feels none of it.

    Args:
        stance: with all legs on the ground.
        forces: ``(m, 4, 3)`` in the world, at most about one; one panel each.
    """
    figure = Picture(8.0, 2.6)
    row = figure.subplots(1, len(forces), sharex=True, sharey=True)
    points, com = stance.robot.centres, stance.robot.com
    for axes, force in zip(row, forces, strict=True):
        tidy(axes)
        axes.plot(*points[[0, 1, 3, 2, 0], :2].T, color=PALE, linewidth=1.0, zorder=1)
        axes.plot(*com[:2], "o", color=BODY, markersize=7)
        for leg, name in enumerate(LEGS):
            axes.plot(*points[leg, :2], "o", color=MODE_COLOURS[int(stance.ref.wheels[leg])], markersize=8)
            if np.linalg.norm(force[leg, :2]) > 0.1:
                tip = points[leg, :2] + _LONGEST * force[leg, :2]
                axes.add_patch(_arrow(points[leg, :2], tip, FORCE, gid=f"force {name}"))
            if abs(force[leg, 2]) > 0.1:
                text = "up" if force[leg, 2] > 0 else "down"
                place = points[leg, :2] + [0.0, 0.08 * np.sign(points[leg, 1])]
                axes.text(*place, text, color=FORCE, ha="center", va="center", gid=f"force {name}")
        axes.set_aspect("equal")
        axes.set_xlabel("x, forward (m)")
    row[0].set_ylabel("y, left (m)")
    row[0].set_xlim(-0.36, 0.36)
    row[0].set_ylim(-0.26, 0.26)
    return figure


def tick_times(parts: Mapping[str, Mapping[str, float]]) -> Picture:
    """Draw how long the parts of a tick take.

    Args:
        parts: by solver, by part, the median in milliseconds.
    """
    figure = Picture(8.0, 1.0 + 0.45 * len(parts))
    axes = figure.add_subplot()
    tidy(axes)
    axes.grid(axis="y", visible=False)
    shades = dict(zip(next(iter(parts.values())), (PALE, BODY, INK), strict=False))
    for row, (solver, times) in enumerate(parts.items()):
        left = 0.0
        for part, time in times.items():
            label = part if row == 0 else None
            axes.barh(
                row, time, left=left, color=shades[part], height=0.6, label=label, gid=f"{solver} {part}"
            )
            left += time
    axes.axvline(2.0, color=LIMIT, linewidth=1.6, label="one tick")
    axes.set_yticks(range(len(parts)), parts)
    axes.set_ylim(len(parts) - 0.5, -0.5)
    axes.set_xlabel("time (ms)")
    figure.legend(loc="outside upper center", ncols=4, frameon=False)
    return figure


def draw_side(axes: Any, stance: Stance, command: "Command") -> None:
    """Draw a standing robot from its left, its friction cones and forces (those of the right legs pale)."""
    robot, model = stance.robot, stance.robot.model
    tidy(axes)
    scale = _LONGEST * 4.0 / (robot.mass * 9.81)
    axes.axhline(0.0, color=PALE, linewidth=1.0)
    axes.plot(
        *(robot.trunk_position[[0, 2]] + np.array([[-0.2, 0.0], [0.2, 0.0]])).T, color=BODY, linewidth=9
    )
    contact = robot.centres + robot.contact_offsets(stance.ground.normals, stance.ref.wheels)
    for leg, name in enumerate(LEGS):
        thigh, calf = (
            robot.data.oMi[model.getJointId(f"{name}_{part}_joint")].translation for part in ("thigh", "calf")
        )
        chain = np.array([thigh, calf, robot.centres[leg]])
        far = name.endswith("R")
        axes.plot(chain[:, 0], chain[:, 2], color=PALE if far else BODY, linewidth=3 if far else 5, zorder=1)
        kind = int(stance.ref.wheels[leg])
        standing = bool(stance.ref.stance[leg])
        start, force = contact[leg, [0, 2]], scale * command.forces[leg, [0, 2]]
        if standing and np.linalg.norm(force) > 0.5 * scale:
            arrow = _arrow(start, start + force, FORCE, gid=f"force {name}")
            arrow.set_alpha(0.35 if far else 1.0)
            axes.add_patch(arrow)
        if far:
            continue
        axes.plot(
            *robot.centres[leg, [0, 2]], "o", color=MODE_COLOURS[kind] if standing else SWING, markersize=9
        )
        if not standing:
            continue
        mu, high = stance.ground.mu_foot[leg], 0.16
        if not kind:
            cone = start + high * np.array([[0.0, 0.0], [mu, 1.0], [-mu, 1.0]])
            axes.add_patch(Polygon(cone, color=LIMIT, alpha=0.13, linewidth=0, gid=f"cone {name}"))
    axes.set_aspect("equal")
    axes.set_xlim(-0.42, 0.42)
    axes.set_ylim(-0.04, 0.5)
    axes.set_xlabel("x, forward (m)")
    axes.set_ylabel("z, up (m)")


def _arrow(start: np.ndarray, tip: np.ndarray, colour: str, gid: str | None = None) -> FancyArrowPatch:
    arrow = FancyArrowPatch(
        tuple(start),
        tuple(tip),
        arrowstyle="-|>",
        mutation_scale=12,
        shrinkA=0,
        shrinkB=0,
        color=colour,
        linewidth=2.0,
        zorder=4,
    )
    arrow.set_gid(gid)
    return arrow


def pyramid_outline(pyramid: np.ndarray, normal_force: float) -> np.ndarray:
    """Return the corners ``(8, 2)`` of what λ_t and λ_b may be at a normal force.

    Args:
        pyramid: ``(9, 3)`` of one leg, of :func:`wfbook.wbc.friction_pyramids`.
        normal_force: λ_n.
    """
    sides = pyramid[list(_AROUND)]
    corners = []
    for first, second in zip(sides, np.roll(sides, -1, axis=0), strict=True):
        A = np.array([first[:2], second[:2]])
        corners.append(np.linalg.solve(A, -normal_force * np.array([first[2], second[2]])))
    return np.array(corners)


def answer(stance: Stance, command: "Command") -> Picture:
    """Draw what the program answers: each leg's force in its friction pyramid, and all torques.

    Args:
        stance: what was asked.
        command: the answer.
    """
    figure = Picture(8.0, 2.3)
    grid = figure.add_gridspec(1, 6, width_ratios=(1, 1, 1, 1, 0.12, 1.7))
    local = np.einsum("lij,lj->li", stance.contact.basis, command.forces)
    pyramids = friction_pyramids(stance.ground, stance.contact, stance.ref.wheels)
    outlines = [pyramid_outline(P, max(n, 0.0)) for P, n in zip(pyramids, local[:, 2], strict=True)]
    largest = max(20.0, 1.15 * np.abs(local[:, :2]).max(), 1.1 * np.abs(outlines).max())
    first = None
    for leg, name in enumerate(LEGS):
        axes = first = figure.add_subplot(grid[leg], sharex=first, sharey=first)
        tidy(axes)
        standing, colour = bool(stance.ref.stance[leg]), (FOOT, WHEEL)[int(stance.ref.wheels[leg])]
        if standing:
            axes.add_patch(
                Polygon(
                    outlines[leg], facecolor=(colour, 0.25), edgecolor=LIMIT, linewidth=1.5, gid="pyramid"
                )
            )
            axes.plot(*local[leg, :2], "o", color=FORCE, markersize=7, gid="force")
        axes.set_title(f"{name}  {local[leg, 2]:.0f} N" if standing else f"{name}  swings", fontsize="medium")
        axes.set_xlim(-largest, largest)
        axes.set_ylim(-largest, largest)
        axes.set_aspect("equal")
        axes.set_xlabel("λ_t (N)")
        if leg:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("λ_b (N)")
    bars = figure.add_subplot(grid[5])
    tidy(bars)
    share = np.abs(command.torques / stance.robot.effort).reshape(4, 3)
    width = 0.25
    for joint, name in enumerate(JOINTS):
        shade = (PALE, BODY, INK)[joint]
        bars.bar(
            np.arange(4) + (joint - 1) * width, share[:, joint], width, color=shade, label=name, gid=name
        )
    bars.axhline(1.0, color=LIMIT, linewidth=1.6)
    bars.set_ylim(0.0, 1.5)
    bars.set_xticks(range(4), LEGS)
    bars.set_ylabel("torque / limit")
    bars.legend(
        frameon=False, fontsize="small", ncols=3, loc="upper center", handlelength=0.8, columnspacing=0.8
    )
    return figure
