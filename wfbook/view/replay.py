"""Replays in 3D that open anywhere: in a notebook, in a page of the book, or as one file offline.

    replay.save(run, "replay.html")     one file; "replay.html#t=1.5" opens still at 1.5 s
    Replay(run)                         at the end of a cell, shows itself
    SideBySide({"this": a, "that": b})  likewise, in a row

A replay shows the robot with the end effector it uses (green foot, orange wheel), the contact forces, where
the legs stood and rolled, and the path of the centre of mass; of the robot of part II also that of the hand.
Of a robot that is pushed over also the push, the zero-moment point and the area that it must not leave.
The trunk of a robot that has to estimate where it is appears twice: where it is, and, light blue, where it
believes to be. A plan can be replayed too, before any controller has seen it: then the robot is posed as the
plan wants it. So can a solution of part II's optimal control problem.
"""

import itertools
import os
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from meshcat import Visualizer

from wfbook.modes import END_EFFECTORS, LEGS
from wfbook.omni.driving import Driving
from wfbook.omni.tipping import Tipping
from wfbook.standing import Standing
from wfbook.view import scene
from wfbook.view.balance import draw_balance
from wfbook.view.meshcat_static import Recorder, frame, page
from wfbook.view.motion import (
    Motion,
    motion_of_driving,
    motion_of_plan,
    motion_of_planned,
    motion_of_run,
    motion_of_standing,
    motion_of_tipping,
)
from wfbook.view.spans import SWINGING, spans
from wfbook.view.style import (
    ESTIMATED,
    FOOT,
    FORCE,
    HAND,
    INK,
    LIMIT,
    MEASURED,
    MODE_COLOURS,
    PLANNED,
    WHEEL,
)
from wfbook.view.tracks import Tracks

if TYPE_CHECKING:
    from wfbook.omni.tasks import Planned
    from wfbook.planner import Plan
    from wfbook.simulate import Run

    Shown = Run | Plan | Planned | Standing | Driving | Tipping

_MARGIN = 1.5
_ARROW_LENGTH = 0.5
"""Length of the arrow of a force as large as the robot's weight."""
_SMALLEST_FORCE = 1.0
_STRAIGHT = 0.01
"""A track is drawn in straight pieces no further than this from where the wheel rolled."""


def html(motion: "Shown", title: str | None = None, beside: str = "") -> str:
    """Return a self-contained page that replays a run or a plan.

    Args:
        motion: what to replay.
        title: of the page; by default the terrain's name.
        beside: HTML beside the picture (see :func:`.meshcat_static.page`).
    """
    shown = _motion_of(motion)
    legend = {"foot": FOOT} if shown.hand is None else {}
    legend |= {"wheel": WHEEL, "contact force": FORCE}
    if _planned(shown):
        legend["CoM planned"] = PLANNED
    if shown.measured_com is not None:
        legend["CoM measured"] = MEASURED
    if shown.hand is not None:
        legend["hand"] = HAND
    if shown.believed is not None:
        legend["trunk, as it believes"] = ESTIMATED
    if shown.balance is not None:
        legend |= {"zero-moment point": FORCE, "area of support": LIMIT, "push": INK}
    return page(commands(shown), title or f"replay: {shown.terrain.name}", legend, shown.start, beside)


def save(
    motion: "Shown",
    path: str | os.PathLike,
    title: str | None = None,
) -> None:
    """Write the page that replays a run or a plan.

    Raises:
        OSError: the file can't be written.
    """
    Path(path).write_text(html(motion, title), encoding="utf-8", newline="\n")


class Replay:
    """Shows a run or a plan in a notebook, without a server and without the kernel once it is drawn.

    Args:
        motion: what to replay.
        height: of the frame, in pixels.
        beside: HTML beside the picture (see :func:`.meshcat_static.page`).
    """

    def __init__(
        self,
        motion: "Shown",
        height: int = 420,
        beside: str = "",
    ) -> None:
        self._html = frame(html(motion, beside=beside), height)

    def _repr_html_(self) -> str:
        return self._html


class SideBySide:
    """Shows several replays in a row, each under its name.

    Args:
        motions: by name, what to replay.
        height: of the frames, in pixels.
    """

    def __init__(self, motions: "Mapping[str, Run | Plan]", height: int = 300) -> None:
        self._html = "".join(
            f'<div style="flex:1 1 380px"><b>{escape(name)}</b>{frame(html(motion), height)}</div>'
            for name, motion in motions.items()
        )

    def _repr_html_(self) -> str:
        return f'<div style="display:flex;flex-wrap:wrap;gap:8px">{self._html}</div>'


def commands(motion: Motion) -> list[dict]:
    """Return Meshcat's commands that draw and animate a motion."""
    recorder = Recorder()
    visualizer, tracks = recorder.visualizer(), Tracks()
    model = mujoco.MjModel.from_xml_path(str(motion.model))
    _stage(visualizer, tracks, motion)
    named = scene.add_robot(visualizer, model)
    _move_bodies(visualizer, tracks, model, motion.qpos)
    for leg, name in enumerate(LEGS):
        for kind, end in enumerate(END_EFFECTORS):
            if f"{name}_{end}" in named:
                tracks.add(named[f"{name}_{end}"], "visible", motion.end_effector[:, leg] == kind)
    weight = float(model.body_subtreemass[0]) * float(np.linalg.norm(model.opt.gravity))
    _move_arrows(visualizer, tracks, motion, _ARROW_LENGTH / weight)
    _draw_prints(visualizer, motion)
    if _planned(motion):
        scene.add_line(visualizer["com/planned"], motion.planned_com, PLANNED)
    if motion.measured_com is not None:
        scene.add_line(visualizer["com/measured"], motion.measured_com, MEASURED)
    if motion.hand is not None:
        scene.add_line(visualizer["hand"], motion.hand, HAND)
    if motion.believed is not None:
        scene.add_ghost(visualizer["believed"], model, ESTIMATED)
        tracks.add(visualizer["believed"], "position", motion.believed[:, :3])
        tracks.add(visualizer["believed"], "quaternion", motion.believed[:, 3:])
    if motion.balance is not None:
        draw_balance(visualizer["balance"], tracks, motion.balance)
    tracks.play(visualizer)
    return recorder.commands


def _motion_of(motion: "Shown") -> Motion:
    """Sample whatever moves."""
    if isinstance(motion, Standing):
        return motion_of_standing(motion)
    if isinstance(motion, Driving):
        return motion_of_driving(motion)
    if isinstance(motion, Tipping):
        return motion_of_tipping(motion)
    if not hasattr(motion, "qpos"):
        return motion_of_plan(motion)
    return motion_of_planned(motion) if hasattr(motion, "torques") else motion_of_run(motion)


def _planned(motion: Motion) -> bool:
    """Whether the motion had been planned."""
    return motion.planned_com is not motion.measured_com


def _stage(visualizer: Visualizer, tracks: Tracks, motion: Motion) -> None:
    """Set background, ground, light and a camera that travels with the planned centre of mass."""
    path = motion.planned_com
    visualizer["/Background"].set_property("top_color", [1.0, 1.0, 1.0])
    visualizer["/Background"].set_property("bottom_color", [0.93, 0.95, 0.97])
    visualizer["/Grid"].set_property("visible", False)
    visualizer["/Axes"].set_property("visible", False)
    low, high = path[:, :2].min(axis=0) - _MARGIN, path[:, :2].max(axis=0) + _MARGIN
    scene.add_light(visualizer["/Lights"], reach=float(np.abs([low, high]).max()))
    scene.add_terrain(visualizer, motion.terrain, low, high)
    # Where the camera looks; player.js makes it go along. In the camera's own frame y is up.
    tracks.add(visualizer["/Follow"], "position", path * [1.0, 1.0, 0.6])
    camera = visualizer["/Cameras/default/rotated/<object>"]
    camera.set_property("position", [motion.size * x for x in (0.9, 0.9, 1.9)])
    camera.set_property("zoom", 2.2)


def _move_bodies(visualizer: Visualizer, tracks: Tracks, model: mujoco.MjModel, qpos: np.ndarray) -> None:
    """Animate every body relative to the one that carries it."""
    data = mujoco.MjData(model)
    positions = np.empty((len(qpos), model.nbody, 3))
    quaternions = np.empty((len(qpos), model.nbody, 4))
    inverse = np.empty(4)
    for k, q in enumerate(qpos):
        data.qpos = q
        mujoco.mj_kinematics(model, data)
        for body in range(1, model.nbody):
            parent = int(model.body_parentid[body])
            mujoco.mju_negQuat(inverse, data.xquat[parent])
            mujoco.mju_mulQuat(quaternions[k, body], inverse, data.xquat[body])
            mujoco.mju_rotVecQuat(positions[k, body], data.xpos[body] - data.xpos[parent], inverse)
    for body, node in scene.body_nodes(visualizer, model).items():
        tracks.add(node, "position", positions[:, body])
        tracks.add(node, "quaternion", quaternions[:, body])


def _move_arrows(visualizer: Visualizer, tracks: Tracks, motion: Motion, scale: float) -> None:
    """Animate one arrow a leg, and one for a push: it starts where the force acts and is as long."""
    arrows = {name: (motion.force[:, leg], motion.contact[:, leg], FORCE) for leg, name in enumerate(LEGS)}
    if motion.balance is not None:
        arrows["push"] = (motion.balance.push, motion.balance.at, INK)
    for name, (force, place, colour) in arrows.items():
        node = visualizer["forces"][name]
        scene.add_arrow(node, colour)
        size = np.linalg.norm(force, axis=1)
        pushing = size > _SMALLEST_FORCE
        tracks.add(node, "visible", pushing)
        direction = np.where(pushing[:, None], force, [0.0, 0.0, 1.0])
        length = np.where(pushing, scale * size, 1e-3)
        tracks.add(node, "position", np.where(pushing[:, None], place, 0.0))
        tracks.add(node, "quaternion", scene.aligning(direction))
        tracks.add(node, "scale", np.column_stack((np.ones_like(length), length, np.ones_like(length))))


def _draw_prints(visualizer: Visualizer, motion: Motion) -> None:
    """Paint where the legs stood and rolled on the ground; a track has a kink where it crosses an edge."""
    terrain, count = motion.terrain, 0
    for leg, mode, start, stop in spans(motion.modes.T):
        if mode == SWINGING:
            continue
        path = motion.contact[start:stop, leg]
        regions = [terrain.region_at(*point[:2]) for point in path]
        kinks = [i for i in range(1, len(path)) if regions[i] != regions[i - 1]] if mode == 1 else []
        for first, after in itertools.pairwise([0, *kinks, len(path)]):
            region = regions[first]
            normal = [0.0, 0.0, 1.0] if region is None else terrain.regions[region].normal
            ends = first + _bends(path[first:after]) if mode == 1 else np.array([first, first])
            for start_of, end_of in itertools.pairwise(ends):
                node = visualizer["prints"][f"{LEGS[leg]} {count}"]
                scene.add_print(node, path[start_of], path[end_of], normal, MODE_COLOURS[mode])
                count += 1


def _bends(path: np.ndarray) -> np.ndarray:
    """Return the indices of those points ``(n, 3)`` whose polygon is nowhere far off a path."""
    last = len(path) - 1
    chord = path[-1] - path[0]
    along = (path - path[0]) @ chord / max(float(chord @ chord), 1e-12)
    away = np.linalg.norm(path - path[0] - np.clip(along, 0.0, 1.0)[:, None] * chord, axis=1)
    worst = int(away.argmax())
    if away[worst] <= _STRAIGHT:
        return np.array([0, last])
    return np.concatenate([_bends(path[: worst + 1])[:-1], worst + _bends(path[worst:])])
