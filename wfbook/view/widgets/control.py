"""Chapter 6's widgets: one program of a standing robot, late feedback, and a controller to break."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import ipywidgets
import numpy as np

from wfbook import planner, simulate
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.reference import Constraints, Gains, delay_margin, delayed_error
from wfbook.stance import Stance, limits_reached, stand
from wfbook.terrain import flat
from wfbook.view import figures
from wfbook.view.drawings import control as drawings
from wfbook.view.style import LIMIT, MEASURED, PLANNED, Picture, tidy
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.panel import Panel
from wfbook.view.widgets.simulating import Simulating, Told, verdict
from wfbook.wbc import Command, WholeBodyController

if TYPE_CHECKING:
    from wfbook.planner import Plan
    from wfbook.simulate import Run

STANCES = {
    "four feet": ((0, 0, 0, 0), (1, 1, 1, 1)),
    "one foot (FL), three wheels": ((0, 1, 1, 1), (1, 1, 1, 1)),
    "four wheels": ((1, 1, 1, 1), (1, 1, 1, 1)),
    "two feet (FL, RR)": ((0, 0, 0, 0), (1, 0, 0, 1)),
}
"""By name: which legs are on wheels, and which stand."""

TASKS = {
    "CoM": "com_weight",
    "attitude": "attitude_weight",
    "swing": "swing_weight",
    "wheels' place": "wheel_weight",
}
"""By name: the weight that is zero without the task (eq. 38)."""

CONSTRAINTS = {
    "feet stay (40)": "feet",
    "wheels don't slide (41)": "wheels",
    "friction (42)": "friction",
    "ground can't pull (42)": "pushing",
    "motor limits (43)": "torques",
}
"""By label: the constraint's name in :class:`wfbook.reference.Constraints`."""

_FARTHEST = 9.0
_NARROW = {"description_width": "initial"}


def gains_without(left_out: frozenset[str], gains: Gains | None = None) -> Gains:
    """Return gains for a program without some of its tasks and constraints.

    Args:
        left_out: keys of :data:`TASKS` and :data:`CONSTRAINTS`.
        gains: to change; by default the controller's own.
    """
    weights = {weight: 0.0 for name, weight in TASKS.items() if name in left_out}
    kept = {name: False for label, name in CONSTRAINTS.items() if label in left_out}
    return replace(gains or Gains(), constraints=Constraints(**kept), **weights)


class _Switches:
    """A row of checkboxes, all set, for the tasks and constraints of the program."""

    def __init__(self, names: list[str]) -> None:
        self.boxes = {
            name: ipywidgets.Checkbox(
                value=True, description=name, indent=False, layout=ipywidgets.Layout(width="auto")
            )
            for name in names
        }

    @property
    def left_out(self) -> frozenset[str]:
        return frozenset(name for name, box in self.boxes.items() if not box.value)


def _slider(
    value: float, low: float, high: float, step: float, text: str, form: str = ".0f"
) -> ipywidgets.FloatSlider:
    return ipywidgets.FloatSlider(
        value=value, min=low, max=high, step=step, description=text, style=_NARROW, readout_format=form
    )


class OneProgram(Panel):
    """A standing robot is asked for an acceleration; the program answers with forces and torques.

    Attributes:
        board: its handle ``"wanted"`` is the wanted acceleration of the CoM along x and y.
        legs: what the robot stands on, one of :data:`STANCES`.
        upwards: wanted acceleration along z.
        mu: friction coefficient.
        motors: their strength, in per cent.
        switches: by name, the checkboxes of tasks and constraints.
        stance: the robot, and what it is asked.
        command: the program's answer.
        got: ``(3,)`` the CoM's acceleration that it brings.
        limits: the limits that the answer is at, in words.
    """

    def __init__(self) -> None:
        self.legs = ipywidgets.Dropdown(options=list(STANCES), description="stands on", style=_NARROW)
        self.upwards = _slider(0.0, -9.0, 60.0, 1.0, "up (m/s²)")
        self.mu = _slider(0.7, 0.1, 1.2, 0.05, "friction μ", ".2f")
        self.motors = _slider(100.0, 20.0, 100.0, 5.0, "motors (%)")
        switches = _Switches(["CoM", "attitude", *CONSTRAINTS])
        self.switches = switches.boxes
        self._switches = switches
        self.board = Board({"wanted": (2.0, 0.0)}, {"wanted": PLANNED})
        self._robot = Go1Dynamics()
        self._effort = self._robot.effort.copy()
        self.stance: Stance
        self.command: Command
        self.got = np.zeros(3)
        self.limits: list[str] = []
        super().__init__([self.legs, self.upwards, self.mu, self.motors, *self.switches.values()], ["answer"])
        self.children = (*self.children[:2], self.board, *self.children[2:])
        self.board.observe(self._follow, names="points")

    def redraw(self) -> None:
        """Solve the program and draw it."""
        wheels, standing = STANCES[self.legs.value]
        self._robot.effort = self.motors.value / 100.0 * self._effort
        stance = stand(wheels, standing, self.mu.value, robot=self._robot)
        wanted = np.array([*self.board.points["wanted"], self.upwards.value])
        stance = replace(stance, ref=replace(stance.ref, com_acceleration=wanted))
        gains = gains_without(self._switches.left_out)
        command = WholeBodyController(stance.robot, gains, "daqp").tick(stance.ref, stance.ground)
        if not command.solved:
            self.warn("No forces and accelerations obey all of these constraints.")
            return
        self.stance, self.command = stance, command
        self.got = stance.robot.com_jacobian @ command.acceleration + stance.robot.com_drift
        self.limits = limits_reached(stance, command, gains.least_force)
        self.show("answer", drawings.answer(stance, command), "contact forces in their pyramids; torques")
        picture = Picture(8.0, 3.3)
        left, right = picture.subplots(1, 2, width_ratios=(1.0, 1.5))
        self._draw_plane(left, wanted)
        drawings.draw_side(right, stance, command)
        self.board.show(
            picture, left, "wanted and resulting acceleration; the robot and forces from the left"
        )
        turned = np.linalg.norm(command.acceleration[3:6])
        asked, got = (", ".join(f"{a:.1f}" for a in values) for values in (wanted, self.got.round(1) + 0.0))
        reached = "; ".join(self.limits) or "No limit is reached"
        self.say(f"wanted ({asked}), got ({got}) m/s²; the trunk turns at {turned:.1f} rad/s². {reached}.")

    def _draw_plane(self, axes: object, wanted: np.ndarray) -> None:
        """Draw the wanted acceleration and the one that results, seen from above."""
        tidy(axes)
        axes.plot(*np.array([wanted[:2], self.got[:2]]).T, color=MEASURED, linewidth=1.0, linestyle=":")
        axes.plot([0.0, self.got[0]], [0.0, self.got[1]], color=MEASURED, linewidth=2.0)
        axes.plot(*self.got[:2], "s", color=MEASURED, markersize=7, gid="got", label="got")
        axes.plot(*wanted[:2], "o", color=PLANNED, markersize=7, gid="wanted", label="wanted: drag")
        axes.set_xlim(-_FARTHEST, _FARTHEST)
        axes.set_ylim(-_FARTHEST, _FARTHEST)
        axes.set_aspect("equal")
        axes.set_xlabel("acceleration ahead (m/s²)")
        axes.set_ylabel("to the left (m/s²)")
        axes.set_xticks(range(-8, 9, 4))
        axes.set_yticks(range(-8, 9, 4))
        axes.legend(frameon=False, loc="lower left", fontsize="small")


class LateFeedback(Panel):
    """One axis of eq. 34 whose commands arrive late.

    Attributes:
        kp: gain on the error.
        kd: on its rate.
        delay: in milliseconds.
        margin: the delay that the loop just bears, in seconds.
    """

    def __init__(self, kp: float = 640.0, kd: float = 50.0) -> None:
        self.kp = _slider(kp, 0.0, 1000.0, 10.0, "kp (1/s²)")
        self.kd = _slider(kd, 0.0, 100.0, 1.0, "kd (1/s)")
        self.delay = _slider(9.0, 0.0, 60.0, 1.0, "delay (ms)")
        self.margin = np.inf
        super().__init__([self.kp, self.kd, self.delay], ["error", "margin"])

    def redraw(self) -> None:
        """Simulate the axis, and find the delay it bears."""
        kp, kd, delay = self.kp.value, self.kd.value, 1e-3 * self.delay.value
        self.margin = delay_margin(kp, kd)
        picture = Picture(8.0, 2.6)
        left, right = picture.subplots(1, 2, width_ratios=(1.5, 1.0))
        t, error = delayed_error(kp, kd, 0.0, delay, 1.2)
        for axes in (left, right):
            tidy(axes)
        left.axhline(0.0, color=PLANNED, linewidth=1.0)
        left.plot(t, error, color=MEASURED, linewidth=1.6, gid="error")
        left.set_xlim(0.0, t[-1])
        left.set_ylim(-2.0, 2.0)
        left.set_xlabel("time (s)")
        left.set_ylabel("error")
        rates = np.linspace(2.0, 100.0, 50)
        right.plot(rates, [1e3 * delay_margin(kp, rate) for rate in rates], color=LIMIT, gid="margin")
        right.plot(kd, 1e3 * delay, "o", color=MEASURED, markersize=7, gid="here")
        right.fill_between(rates, right.lines[0].get_ydata(), 60.0, color=LIMIT, alpha=0.12, linewidth=0)
        right.set_xlim(0.0, 100.0)
        right.set_ylim(0.0, 60.0)
        right.set_xlabel("kd (1/s)")
        right.set_ylabel("delay (ms)")
        right.text(98.0, 57.0, "too late", color=LIMIT, ha="right", va="top")
        self.show("error", picture, "an error over time, and which delays its gains bear")
        bears = f"{1e3 * self.margin:.1f} ms" if np.isfinite(self.margin) else "any delay"
        self.say(f"These gains bear {bears}.")


@dataclass(frozen=True)
class Setting:
    """What an experiment is run with.

    Attributes:
        motion: one of :data:`MOTIONS`.
        left_out: tasks and constraints that the program does without.
        delay_ms: of the torques.
        push: in newtons, for 0.2 s.
        direction_deg: of the push, from above: 0 ahead, 90 to the left.
        start: of the push, in seconds after the motion's.
    """

    motion: str
    left_out: frozenset[str] = frozenset()
    delay_ms: float = 9.0
    push: float = 0.0
    direction_deg: float = 90.0
    start: float = 0.2

    def describe(self) -> str:
        """Return the setting in a few words."""
        words = [
            self.motion,
            *(f"without: {name}" for name in sorted(self.left_out)),
            f"{self.delay_ms:.0f} ms",
        ]
        if self.push:
            words.append(f"{self.push:.0f} N at {self.direction_deg:.0f}° from {self.start:.1f} s")
        return ", ".join(words)


@cache
def _standing(start: tuple[str, ...]) -> "Plan":
    return planner.solve(planner.Problem(flat(), goal=(0.0, 0.0), slots=4, start_end_effectors=start))


MOTIONS: dict[str, Callable[[], "Plan"]] = {
    "stand on four feet": lambda: _standing(("foot",) * 4),
    "stand on a foot and three wheels": lambda: _standing(("wheel", "foot", "wheel", "wheel")),
    "walk": lambda: planner.stored("flat-feet"),
    "roll": lambda: planner.stored("flat"),
}
"""By name, what makes the plan that is executed."""

PUSH_DURATION = 0.2


def simulated(setting: Setting, progress: Callable[[float, float], None] | None = None) -> "Run":
    """Run an experiment in MuJoCo, with the true state."""
    angle = np.radians(setting.direction_deg)
    force = setting.push * np.array([np.cos(angle), np.sin(angle), 0.0])
    return simulate.run(
        MOTIONS[setting.motion](),
        delay=1e-3 * setting.delay_ms,
        hold=0.3,
        gains=gains_without(setting.left_out),
        push=(force, setting.start, PUSH_DURATION) if setting.push else None,
        progress=progress,
    )


class Experiment(Simulating):
    """A motion, a push, a delay and a program with holes: *simulate*, and see whether the robot bears it.

    Args:
        setting: where the controls are first.
        simulator: called with a :class:`Setting` and a function that it tells simulated and total time.

    Attributes:
        motion, delay, push, direction, start: controls, see :class:`Setting`.
        switches: by name, the checkboxes of tasks and constraints.
        button: its ``click`` simulates.
        run: the run that is shown, None before the first.
        results: what came of each setting that was tried, by setting.
        replay: shows the run in 3D.
        history: one line for each of them.
    """

    def __init__(self, setting: Setting | None = None, simulator: Callable[..., "Run"] = simulated) -> None:
        setting = setting or Setting("stand on four feet", push=50.0)
        self._simulator = simulator
        self.motion = ipywidgets.Dropdown(
            options=list(MOTIONS), value=setting.motion, description="motion", style=_NARROW
        )
        self.delay = _slider(setting.delay_ms, 0.0, 40.0, 1.0, "delay (ms)")
        self.push = _slider(setting.push, 0.0, 200.0, 10.0, "push (N)")
        self.direction = _slider(setting.direction_deg, 0.0, 345.0, 15.0, "towards (°)")
        self.start = _slider(setting.start, 0.0, 1.0, 0.1, "at (s)", ".1f")
        self._switches = _Switches([*TASKS, *CONSTRAINTS])
        self.switches = self._switches.boxes
        for name in setting.left_out:
            self.switches[name].value = False
        controls = [self.motion, self.delay, self.push, self.direction, self.start, *self.switches.values()]
        super().__init__(controls, ["limits", "tracking"], _COLUMNS)

    @property
    def setting(self) -> Setting:
        """What the controls say."""
        return Setting(
            self.motion.value,
            self._switches.left_out,
            self.delay.value,
            self.push.value,
            self.direction.value,
            self.start.value,
        )

    @property
    def asked(self) -> Setting:
        """The same: what a run is remembered by."""
        return self.setting

    def run_of(self, asked: Setting, told: Told) -> "Run":
        """Simulate a setting."""
        return self._simulator(asked, told)

    def preview(self) -> None:
        """Say how to get a run of this setting."""
        self.say(f"{self.setting.describe()}: press Simulate.")

    def draw(self, run: "Run") -> None:
        """Show a run beside its limits and its errors."""
        fall = run.metrics["fall_time_s"]
        end = "stayed upright" if fall is None else f"fell after {fall:.2f} s"
        self.say(f"{self.setting.describe()}: {end}.")
        self.show("limits", drawings.limits(run), "torques and friction beside their limits")
        self.show("tracking", figures.tracking(run), "errors of the centre of mass and the attitude")

    def row(self, asked: Setting, run: "Run") -> tuple[str, ...]:
        """Return a line of the table."""
        after = run.t >= 0.0
        error = 1e3 * np.linalg.norm((run.com - run.com_ref)[after], axis=1).max()
        tilt = np.degrees(np.abs((run.rpy - run.rpy_ref)[after, :2]).max())
        return (
            asked.describe(),
            verdict(run),
            f"{error:.0f} mm",
            f"{tilt:.1f}°",
            f"{np.abs(run.tau).max():.1f} N m",
            f"{run.metrics['qp_rescues']}",
        )


_COLUMNS = ("setting", "", "CoM error", "tilt", "largest torque", "ticks by DAQP")
