"""Chapter 2's widgets: a swing whose ends are chosen, and the mixture of two swings."""

import ipywidgets
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from wfbook.go1 import RADII, nominal
from wfbook.go1_dynamics import Go1Dynamics, leg_motion
from wfbook.modes import END_EFFECTORS
from wfbook.swing import swing_position
from wfbook.view.drawings.swing import SMOOTHNESS_NAMES
from wfbook.view.style import BODY, INK, MODE_COLOURS, PALE, PLANNED, SWING, Picture, tidy
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.controls import choice, slider
from wfbook.view.widgets.panel import Panel

_SAMPLES = 121
_LEG = 0
_PARTS = (("hip", ":"), ("thigh", "-"), ("calf", "--"))
_LINK = 0.213


class SwingPlayground(Panel):
    """One swing of the front left leg: choose its ends and see path, velocity, acceleration and torques.

    The trunk moves on steadily with ``speed``. On the ground a foot stands still and a wheel goes with the
    robot; where the swing does not begin or end with that velocity, it jumps.

    Attributes:
        lifts_from, lands_on: ``"foot"`` or ``"wheel"``.
        speed: of the robot.
        start_velocity, end_velocity: forward, asked of the swing.
        step, rise: from lift-off to landing, forward and up.
        apex: height above the mean of both ends at mid-swing.
        duration: of the swing.
        given: how many derivatives are met at the ends, see :func:`wfbook.swing.conditions`.
        jumps: ``(2, 2)`` what was found: jump of velocity and of acceleration, at lift-off and at landing.
        load: largest torque over the motor's most.
    """

    def __init__(self) -> None:
        self.lifts_from = choice(END_EFFECTORS, "foot", "lifts from")
        self.lands_on = choice(END_EFFECTORS, "wheel", "lands on")
        self.speed = slider(0.5, 0.0, 1.0, 0.05, "robot's speed (m/s)")
        self.start_velocity = slider(0.0, -0.5, 1.5, 0.05, "start velocity (m/s)")
        self.end_velocity = slider(0.5, -0.5, 1.5, 0.05, "end velocity (m/s)")
        self.step = slider(0.2, -0.1, 0.35, 0.01, "step (m)")
        self.rise = slider(0.0, -0.05, 0.08, 0.01, "rise (m)")
        self.apex = slider(0.06, 0.0, 0.12, 0.005, "apex (m)")
        self.duration = slider(0.3, 0.08, 0.6, 0.01, "duration (s)")
        self.given = choice([(name, s) for s, name in SMOOTHNESS_NAMES.items()], 2, "given at the ends")
        self.jumps = np.zeros((2, 2))
        self.load = 0.0
        self._hip = nominal()["hips"][_LEG] - nominal()["trunk"]
        self._below = nominal()["hip_offsets"][_LEG] - nominal()["trunk"]
        self._effort = Go1Dynamics().effort[3 * _LEG : 3 * _LEG + 3]
        controls = [
            *(self.lifts_from, self.lands_on, self.start_velocity, self.end_velocity, self.speed),
            *(self.step, self.rise, self.apex, self.duration, self.given),
        ]
        super().__init__(controls, ["path", "time"])

    def swing(self, phase: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Return the contact point, or its derivative by time, ``(n, 3)``; it lifts at the origin."""
        return swing_position(
            phase,
            self.duration.value,
            np.zeros(3),
            np.array([self.step.value, 0.0, self.rise.value]),
            self.apex.value,
            np.array([self.start_velocity.value, 0.0, 0.0]),
            np.array([self.end_velocity.value, 0.0, 0.0]),
            derivative,
            self.given.value,
        )

    def redraw(self) -> None:
        """Draw the swing as it is now."""
        phase = np.linspace(0.0, 1.0, _SAMPLES)
        path, velocity, acceleration = (self.swing(phase, d) for d in range(3))
        ground = [self.speed.value * (kind.value == "wheel") for kind in (self.lifts_from, self.lands_on)]
        along = np.array([[ground[0], 0.0, 0.0], [ground[1], 0.0, 0.0]])
        self.jumps = np.array(
            [np.linalg.norm(velocity[[0, -1]] - along, axis=1), np.linalg.norm(acceleration[[0, -1]], axis=1)]
        ).T
        trunk = self._trunk(phase)
        kinds = [END_EFFECTORS.index(kind.value) for kind in (self.lifts_from, self.lands_on)]
        centres = path + np.array([0.0, 0.0, 1.0]) * np.where(phase < 0.5, *RADII[kinds])[:, None]
        forward = np.array([self.speed.value, 0.0, 0.0])
        try:
            angles, _rates, torques = leg_motion(_LEG, centres - trunk, velocity - forward, acceleration)
        except ValueError as error:
            self.warn(f"{error}: choose a shorter step, a lower apex or a slower robot.")
            return
        share = 100.0 * torques / self._effort
        self.load = float(np.abs(share).max()) / 100.0
        self._draw_path(phase, path, trunk, angles, kinds)
        self._draw_time(phase, velocity, acceleration, share, along, kinds)
        self.say(self._verdict())

    def _trunk(self, phase: np.ndarray) -> np.ndarray:
        """Return the trunk's origin, ``(n, 3)``; at half time it is over the middle of the step."""
        middle = np.array([0.5 * self.step.value, 0.0, 0.5 * self.rise.value]) - self._below
        ahead = self.speed.value * self.duration.value * (phase - 0.5)
        return middle + ahead[:, None] * [1.0, 0.0, 0.0]

    def _verdict(self) -> str:
        (lift, start), (land, end) = self.jumps
        parts = []
        for jump, kind, verb in ((lift, self.lifts_from, "lifts from"), (land, self.lands_on, "lands on")):
            if jump > 1e-9:
                parts.append(f"It {verb} its {kind.value} with a jump of velocity of {jump:.2f} m/s.")
        if max(start, end) > 1e-9:
            parts.append(f"Acceleration jumps by {start:.1f} m/s² at lift-off, {end:.1f} m/s² at landing.")
        if not parts:
            parts.append("Nothing jumps: velocity and acceleration go over into those on the ground.")
        parts.append(f"The motors need up to {100 * self.load:.0f} % of what they have.")
        return " ".join(parts)

    def _draw_path(
        self, phase: np.ndarray, path: np.ndarray, trunk: np.ndarray, angles: np.ndarray, kinds: list[int]
    ) -> None:
        figure = Picture(8.0, 3.7)
        axes = figure.subplots()
        tidy(axes)
        for i in np.linspace(0, _SAMPLES - 1, 7).astype(int):
            hip = trunk[i] + self._hip
            knee = hip - _LINK * np.array([np.sin(angles[i, 1]), 0.0, np.cos(angles[i, 1])])
            calf = angles[i, 1] + angles[i, 2]
            foot = knee - _LINK * np.array([np.sin(calf), 0.0, np.cos(calf)])
            joints = 100 * np.array([hip, knee, foot])
            axes.plot(joints[:, 0], joints[:, 2], "-o", color=BODY, alpha=0.35, markersize=3, gid="leg")
        axes.plot(100 * path[:, 0], 100 * path[:, 2], color=PLANNED, linewidth=2, gid="path")
        ticks = np.arange(0.0, self.duration.value + 1e-9, 0.02) / self.duration.value
        dots = 100 * self.swing(ticks)
        axes.plot(dots[:, 0], dots[:, 2], "o", color=PLANNED, markersize=3.5, gid="every 20 ms")
        for point, kind, name in ((path[0], kinds[0], "lift-off"), (path[-1], kinds[1], "landing")):
            place = 100 * point[[0, 2]]
            axes.plot(*place, "o", color=MODE_COLOURS[kind], markersize=11, gid=name)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("x, forward (cm)")
        axes.set_ylabel("z, up (cm)")
        handles = [
            Line2D([], [], color=PLANNED, marker="o", markersize=3.5, label="contact point, every 20 ms"),
            *(
                Line2D(
                    [],
                    [],
                    color=MODE_COLOURS[kind],
                    marker="o",
                    linestyle="",
                    label=f"{verb} {END_EFFECTORS[kind]}",
                )
                for kind, verb in zip(kinds, ("lifts from", "lands on"), strict=True)
            ),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
        self.show(
            "path",
            figure,
            f"side view of a swing {100 * self.step.value:.0f} cm ahead, {100 * self.apex.value:.0f} cm up",
        )

    def _draw_time(
        self,
        phase: np.ndarray,
        velocity: np.ndarray,
        acceleration: np.ndarray,
        share: np.ndarray,
        along: np.ndarray,
        kinds: list[int],
    ) -> None:
        figure = Picture(9.5, 2.9)
        panels = figure.subplots(1, 3, sharex=True)
        time = 1e3 * self.duration.value * phase
        margin = 0.12 * time[-1]
        around = np.r_[-margin, 0.0, time, time[-1], time[-1] + margin]
        for axes, values, stands, name in (
            (panels[0], velocity, along, "velocity (m/s)"),
            (panels[1], acceleration, np.zeros((2, 3)), "acceleration (m/s²)"),
        ):
            for axis, letter, style in ((0, "x", "-"), (2, "z", "--")):
                before, after = stands[:, axis]
                shown = np.r_[before, before, values[:, axis], after, after]
                axes.plot(around, shown, color=PLANNED, linestyle=style, label=letter, gid=letter)
            axes.set_ylabel(name)
        for values, (part, style) in zip(share.T, _PARTS, strict=True):
            panels[2].plot(time, values, color=INK, linestyle=style, label=part, gid=part)
        panels[2].set_ylabel("torque (% of the motor's)")
        for axes in panels:
            tidy(axes)
            axes.axvspan(0.0, time[-1], color=SWING, alpha=0.5, linewidth=0)
            axes.axvline(0.0, color=MODE_COLOURS[kinds[0]], linewidth=1.5)
            axes.axvline(time[-1], color=MODE_COLOURS[kinds[1]], linewidth=1.5)
            axes.set_xlabel("time (ms)")
            axes.legend(frameon=False, fontsize="small", loc="best")
        self.show("time", figure, "velocity, acceleration and joint torques over the time of the swing")


class MixedSwings(Panel):
    """Two swings with landings that are dragged, and the swing between them.

    A swing is linear in what it has to meet, so the mixture of two swings is the swing to the mixed landing,
    with the mixed velocity. It is not linear in its duration.

    Attributes:
        board: holds the two handles, ``"A"`` and ``"B"``, in centimetres forward and up.
        share: of B in the mixture.
        velocity_a, velocity_b: with which they land.
        hurry: whether B takes half of A's time.
        mismatch: largest distance between the mixture of the two curves and the swing to the mixed ends, in
            metres.
    """

    DURATION = 0.4

    def __init__(self) -> None:
        self.board = Board({"A": (12.0, 0.0), "B": (28.0, 4.0)}, {"A": PLANNED, "B": PLANNED})
        self.share = slider(0.5, 0.0, 1.0, 0.05, "share of B")
        self.velocity_a = slider(0.0, 0.0, 1.5, 0.1, "A lands with (m/s)")
        self.velocity_b = slider(0.8, 0.0, 1.5, 0.1, "B lands with (m/s)")
        self.hurry = ipywidgets.Checkbox(value=False, description="B takes half the time", indent=False)
        self.mismatch = 0.0
        super().__init__([self.share, self.velocity_a, self.velocity_b, self.hurry], [])
        self.children = (*self.children, self.board)
        self.board.observe(self._follow, names="points")

    def redraw(self) -> None:
        """Draw both swings, their mixture, and the swing that it should be."""
        w = self.share.value
        phase = np.linspace(0.0, 1.0, _SAMPLES)
        ends = [
            np.array([self.board.points[name][0], 0.0, self.board.points[name][1]]) / 100 for name in "AB"
        ]
        speeds = [np.array([v.value, 0.0, 0.0]) for v in (self.velocity_a, self.velocity_b)]
        times = [self.DURATION, self.DURATION * (0.5 if self.hurry.value else 1.0)]
        curves = [_swing(phase, *case) for case in zip(times, ends, speeds, strict=True)]
        mixture = (1 - w) * curves[0] + w * curves[1]
        direct = _swing(phase, *((1 - w) * a + w * b for a, b in (times, ends, speeds)))
        self.mismatch = float(np.linalg.norm(mixture - direct, axis=1).max())
        figure = Picture(8.0, 3.4)
        axes = figure.subplots()
        self._draw(axes, curves, mixture, direct)
        self.board.show(figure, axes, "two swings, their mixture, and the swing to the mixed landing")
        self.pictures["board"] = figure
        if self.mismatch < 1e-9:
            self.say("The mixture of the two swings is the swing to the mixed landing, to the last digit.")
        else:
            apart = f"{1e3 * self.mismatch:.1f} mm"
            self.say(f"The mixture is not the swing of the mixed duration: they are up to {apart} apart.")

    def _draw(self, axes: Axes, curves: list[np.ndarray], mixture: np.ndarray, direct: np.ndarray) -> None:
        tidy(axes)
        for curve, name in zip(curves, "AB", strict=True):
            axes.plot(100 * curve[:, 0], 100 * curve[:, 2], color=PALE, linewidth=1.6, gid=name)
            place = 100 * curve[-1, [0, 2]]
            axes.annotate(
                name, place, textcoords="offset points", xytext=(10, 8), color=PLANNED, weight="bold"
            )
        axes.plot(
            100 * direct[:, 0],
            100 * direct[:, 2],
            color=PLANNED,
            linewidth=3,
            label="swing to the mixed landing",
            gid="direct",
        )
        axes.plot(
            100 * mixture[:, 0],
            100 * mixture[:, 2],
            "--",
            color=INK,
            linewidth=1.4,
            label="mixture of A and B",
            gid="mixture",
        )
        axes.set_xlim(-2.0, 42.0)
        axes.set_ylim(-3.0, 14.0)
        axes.set_xlabel("x, forward (cm)")
        axes.set_ylabel("z, up (cm)")
        axes.legend(loc="upper left", frameon=False, ncols=2, fontsize="small")


def _swing(phase: np.ndarray, duration: float, end: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Return a swing from rest at the origin, ``(n, 3)``."""
    return swing_position(phase, duration, np.zeros(3), end, 0.06, None, speed)
