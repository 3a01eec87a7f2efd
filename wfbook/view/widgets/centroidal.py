"""Chapter 1's widgets: forces that push and turn, where to stand, and the bounds of eq. 9."""

from collections.abc import Mapping
from typing import Any

import ipywidgets
import numpy as np

from wfbook.centroidal import Robot, RollOut, carried, cheapest_claim, least_bounds, roll_out
from wfbook.modes import LEGS
from wfbook.planner.instant import Instant, Stance
from wfbook.planner.problem import Weights
from wfbook.view.drawings.centroidal import METRES_A_NEWTON, arrow, side_view, support
from wfbook.view.style import FOOT, FORCE, INK, MEASURED, PALE, PLANNED, SWING, Picture, tidy
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.panel import Panel

SLOT = 0.3
"""For so long the forces act: one slot of the planner."""

_DT = 0.02
_WIDE = {"description_width": "initial"}


class ForcesAndFeet(Panel):
    """Drag two pairs of feet and the forces on them; CoM and angular momentum follow (Paper A, eqs 1 and 8).

    The robot is seen from its right. Front and rear legs push as pairs, for one slot, always with the same
    force.

    Attributes:
        example: forces to begin with; set its ``value`` to a name in :attr:`EXAMPLES`.
        again: a button that puts all handles back to where the example has them.
        board: handles ``front foot``, ``rear foot``, ``front force`` and ``rear force``.
        motion: what the forces do: a :class:`~wfbook.centroidal.RollOut`.
    """

    EXAMPLES: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = {
        "stand": ((0.0, 0.5), (0.0, 0.5)),
        "set off, load as it was": ((0.08, 0.5), (0.08, 0.5)),
        "set off, load on the rear feet": ((0.08, 0.387), (0.08, 0.613)),
        "lift the front feet": ((0.0, 0.0), (0.0, 1.0)),
        "let go": ((0.0, 0.0), (0.0, 0.0)),
    }
    """By name, forces (x, z) on the front and on the rear pair, in the robot's weights."""

    def __init__(self) -> None:
        self.robot = Robot.go1()
        self.motion: RollOut | None = None
        front, rear = self.robot.stance[0, 0], self.robot.stance[2, 0]
        reach = self.robot.reach[0]
        self._feet = feet = {"front foot": (front, 0.0), "rear foot": (rear, 0.0)}
        limits = {name: (x - reach, x + reach, 0.0, 0.0) for name, (x, _) in feet.items()}
        tips = {name.replace("foot", "force"): name for name in feet}
        self.board = Board(
            feet | self._tips("stand"),
            dict.fromkeys(feet, FOOT) | dict.fromkeys(tips, FORCE),
            limits | dict.fromkeys(tips, (-1.0, 1.0, 0.0, 1.0)),
            tips,
        )
        self.example = ipywidgets.Dropdown(options=list(self.EXAMPLES), description="begin with", style=_WIDE)
        self.again = ipywidgets.Button(description="again")
        self.again.on_click(self._begin)
        super().__init__([self.example, self.again], [])
        self.children = (*self.children, self.board)
        self.example.observe(self._begin, names="value")
        self.board.observe(self._follow, names="points")

    def _tips(self, example: str) -> dict[str, tuple[float, float]]:
        """Return where the arrows of an example end."""
        length = METRES_A_NEWTON * self.robot.weight
        return {
            name.replace("foot", "force"): (x + length * along, z + length * up)
            for (name, (x, z)), (along, up) in zip(self._feet.items(), self.EXAMPLES[example], strict=True)
        }

    def _begin(self, _change: object = None) -> None:
        start = self._feet | self._tips(self.example.value)
        self.board.points = {name: list(place) for name, place in start.items()}

    def forces(self) -> np.ndarray:
        """Return the forces on front and rear pair, ``(2, 2)``: x and z in newtons."""
        points = self.board.points
        ends = [(points[f"{pair} foot"], points[f"{pair} force"]) for pair in ("front", "rear")]
        return np.array([np.subtract(tip, foot) for foot, tip in ends]) / METRES_A_NEWTON

    def redraw(self) -> None:
        """Integrate and draw."""
        feet = np.array([self.board.points["front foot"], self.board.points["rear foot"]])
        forces, knots = self.forces(), round(SLOT / _DT)
        lam, p = np.zeros((knots, 2, 3)), np.zeros((knots + 1, 2, 3))
        lam[..., [0, 2]], p[..., [0, 2]] = forces, feet
        self.motion = motion = roll_out(self.robot.mass, _DT, p, lam, np.array([0.0, 0.0, self.robot.height]))
        pitch = motion.angles(self.robot.inertia)[:, 1]
        picture = Picture(9.0, 3.4)
        grid = picture.add_gridspec(2, 2, width_ratios=[2.1, 1.0])
        view, speed, spin = (
            picture.add_subplot(grid[:, 0]),
            *(picture.add_subplot(grid[i, 1]) for i in (0, 1)),
        )
        side_view(view, motion, pitch, feet, forces)
        view.set(xlim=(-0.5, 0.5), ylim=(-0.06, 0.5))
        for axis, style in ((0, "-"), (2, "--")):
            name = f"{'xyz'[axis]}"
            speed.plot(
                motion.t, motion.v[:, axis], color=PLANNED, linestyle=style, label=name, gid=f"v{name}"
            )
        speed.set(xlim=(0, SLOT), ylim=(-1.6, 1.6), ylabel="velocity (m/s)")
        speed.legend(loc="lower left", ncols=2, frameon=False)
        spin.plot(motion.t, motion.momentum[:, 1], color=FORCE, gid="pitch momentum")
        spin.set(xlim=(0, SLOT), ylim=(-4, 4), xlabel="time (s)", ylabel="pitch (N m s)")
        for axes in (speed, spin):
            tidy(axes)
            axes.axhline(0.0, color=PALE, linewidth=1.0)
        a, torque, turned = motion.a[0], motion.torque[0, 1], abs(np.rad2deg(pitch[-1]))
        # Beyond a right angle, eq. 8 with its small angles says no more than that the robot turns over.
        size = f"{turned:.0f}°" if turned < 90.0 else "over 90°"
        self.say(
            f"acceleration {a[0]:+.2f} m/s² ahead, {a[2]:+.2f} m/s² up;"
            f" torque {abs(torque):.1f} N m{f' nose {_nose(torque)}' if abs(torque) >= 0.05 else ''};"
            f" after {SLOT} s {motion.v[-1, 0]:+.2f} m/s,"
            f" {f'{size} nose {_nose(pitch[-1])}' if turned >= 0.5 else 'level'}"
        )
        self.board.show(
            picture, view, "a robot from its right, forces on its feet, its path and where it turns"
        )


class WhereToStand(Panel):
    """Drag CoM and feet from above, lift legs, and see whether the rest can carry the robot without tipping.

    The legs push straight up, as well as they can (:func:`wfbook.centroidal.carried`).

    Attributes:
        stands: a checkbox for each leg, in the order of :data:`wfbook.modes.LEGS`.
        board: handles ``CoM`` and ``FL`` to ``RR``.
        forces: ``(4,)`` upward force on each leg, in newtons.
        torque: ``(2,)`` roll and pitch torque that is left.
    """

    def __init__(self) -> None:
        self.robot = Robot.go1()
        self.forces, self.torque = np.zeros(4), np.zeros(2)
        feet = {leg: tuple(place) for leg, place in zip(LEGS, self.robot.stance, strict=True)}
        dx, dy, _ = self.robot.reach
        limits = {leg: (x - dx, x + dx, y - dy, y + dy) for leg, (x, y) in feet.items()}
        self.board = Board(
            {"CoM": (0.0, 0.0)} | feet, {"CoM": PLANNED} | dict.fromkeys(feet, FOOT),
            {"CoM": (-0.25, 0.25, -0.18, 0.18)} | limits,
        )  # fmt: skip
        layout = ipywidgets.Layout(width="auto", margin="0 16px 0 0")
        self.stands = [
            ipywidgets.Checkbox(value=True, description=f"{leg} stands", indent=False, layout=layout)
            for leg in LEGS
        ]
        super().__init__(self.stands, [])
        self.children = (*self.children, self.board)
        self.board.observe(self._follow, names="points")

    def redraw(self) -> None:
        """Share the load and draw."""
        p = np.array([[*self.board.points[leg], 0.0] for leg in LEGS])
        x = np.array([*self.board.points["CoM"], self.robot.height])
        stands = np.array([box.value for box in self.stands])
        self.forces = np.zeros(4)
        if stands.any():
            self.forces[stands] = carried(p[stands], x, self.robot.weight)
        lam = np.zeros((1, 4, 3))
        lam[0, :, 2] = self.forces
        motion = roll_out(self.robot.mass, SLOT, np.stack([p, p]), lam, x)
        self.torque = motion.torque[0, :2]
        picture = Picture(9.0, 3.6)
        view, bars = picture.subplots(1, 2, width_ratios=[2.4, 1.0])
        support(view, p[:, :2], stands, self.forces)
        view.plot(*x[:2], "o", color=PLANNED, markersize=8, gid="CoM")
        if stands.any():
            pressure = self.forces @ p[:, :2] / self.forces.sum()
            view.plot(
                *pressure, "x", color=FORCE, markersize=9, markeredgewidth=2.5, gid="centre of pressure"
            )
            if np.linalg.norm(x[:2] - pressure) > 2e-3:
                arrow(view, pressure, x[:2] - pressure, "tips", INK)
        view.set(xlim=(-0.46, 0.46), ylim=(-0.32, 0.32))
        self.board.paint(**{leg: FOOT if on else SWING for leg, on in zip(LEGS, stands, strict=True)})
        tidy(bars)
        bars.bar(["roll", "pitch"], self.torque, color=FORCE)
        bars.axhline(0.0, color=PALE, linewidth=1.0)
        bars.set(ylim=(-16, 16), ylabel="torque that is left (N m)")
        left = np.linalg.norm(self.torque)
        turning = np.linalg.solve(self.robot.inertia, motion.torque[0])
        if not stands.any():
            self.say("nobody stands: the robot falls, and does not turn")
        elif left < 0.05:
            self.say("the standing legs carry the robot and do not turn it")
        else:
            sides = ("left" if turning[0] < 0.0 else "right"), ("up" if turning[1] < 0.0 else "down")
            soon = np.sqrt(2.0 * np.deg2rad(10.0) / np.linalg.norm(turning))
            self.say(
                f"{left:.1f} N m are left: the robot rolls to its {sides[0]} and pitches nose {sides[1]},"
                f" by 10° in {soon:.2f} s"
            )
        self.board.show(picture, view, "contacts from above with the load on each, and the centre of mass")


class SquaresAsBounds(Panel):
    """A product as a difference of two squares, and what it costs to leave the squares (Paper A, eq. 9).

    One lever, one force at a right angle to it, one torque. The program would like another and may buy it.

    Attributes:
        lever, force, scale: of the product and of its terms; ``scale`` is the square root of newtons a metre.
        wanted: the torque that would be best.
        charge: for a unit of U⁺ or U⁻, against half of the squared torque that is missing.
        claimed: the torque that is in the program's books.
    """

    def __init__(self) -> None:
        self.claimed = 0.0
        self.lever = _slider("lever r (m)", 0.15, -0.4, 0.4, 0.01)
        self.force = _slider("force F (N)", 40.0, 0.0, 60.0, 1.0)
        self.scale = _slider("scale s", 15.0, 4.0, 40.0, 0.5)
        self.wanted = _slider("torque wanted (N m)", 12.0, -20.0, 20.0, 0.5)
        self.charge = _slider("charge", 0.5, 0.0, 3.0, 0.05)
        super().__init__([self.lever, self.force, self.scale, self.wanted, self.charge], ["bounds"])

    def parts(self, lever: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the squares U⁺ and U⁻ for levers ``(K,)`` at the present force and scale, each ``(K,)``."""
        r, none = np.asarray(lever, float)[:, None], np.zeros((len(lever), 1))
        force = np.full_like(r, self.force.value)
        # The torque about z of a lever along x and a force along y has no other terms.
        plus, minus = least_bounds([r, none, none], [none, force, none], self.scale.value)
        return plus[2][:, 0], minus[2][:, 0]

    def redraw(self) -> None:
        """Draw squares, books and charge."""
        r, force, wanted, charge = (c.value for c in (self.lever, self.force, self.wanted, self.charge))
        real = r * force
        self.claimed = cheapest_claim(real, wanted, charge)
        bought = self.claimed - real
        picture = Picture(9.5, 3.3)
        halves, books, scales = picture.subplots(1, 3, width_ratios=[1.5, 0.9, 1.2])
        _draw_halves(halves, self, np.linspace(-0.4, 0.4, 101), r, bought)
        for name, value, colour in (("real", real, MEASURED), ("claimed", self.claimed, PLANNED)):
            books.bar(name, value, color=colour, width=0.6)
        books.bar("claimed", bought, bottom=real, color=FORCE, width=0.6, gid="made by nothing")
        books.axhline(wanted, color=INK, linestyle=":", linewidth=1.5, gid="wanted")
        books.text(1.45, wanted, "wanted", ha="right", va="bottom", color=INK)
        books.set(ylim=(-27, 27), ylabel="torque (N m)")
        s = np.linspace(4.0, 40.0, 181)
        scales.plot(s, (s * r) ** 2 + (force / s) ** 2, color=PLANNED, gid="charge")
        scales.plot(self.scale.value, sum(part[0] for part in self.parts([r])) / 2, "o", color=INK, gid="now")
        scales.axhline(2 * abs(real), color=PALE, linestyle="--", gid="least")
        scales.set(xlim=(4, 40), ylim=(0, 80), xlabel="scale s", ylabel="(U⁺ + U⁻)/2 at the squares (N m)")
        for axes in (halves, books, scales):
            tidy(axes)
        self.say(
            f"real torque {real:+.1f} N m; claimed {self.claimed:+.1f} N m"
            f" ({'tight: nothing is bought' if bought == 0.0 else f'{bought:+.1f} N m made by nothing'})"
        )
        self.show("bounds", picture, "two parabolas whose difference is the torque; the torque in the books")


def _draw_halves(axes: Any, widget: SquaresAsBounds, levers: np.ndarray, r: float, bought: float) -> None:
    """Draw U⁺/4 upward, U⁻/4 downward, and their sum: the line of the torque."""
    up, down = (part / 4 for part in widget.parts(levers))
    now_up, now_down = (part[0] / 4 for part in widget.parts([r]))
    axes.plot(levers, up, color=PLANNED, gid="U+")
    axes.plot(levers, -down, color=PLANNED, linestyle="--", gid="U-")
    axes.plot(levers, levers * widget.force.value, color=MEASURED, linewidth=1.2, gid="torque")
    high, low = now_up + max(bought, 0.0), -now_down + min(bought, 0.0)
    axes.plot([r, r], [low, high], color=PALE, linewidth=1.0)
    for square, bound, name in ((now_up, high, "slack U+"), (-now_down, low, "slack U-")):
        axes.plot([r, r], [square, bound], color=FORCE, linewidth=5, solid_capstyle="butt", gid=name)
        axes.plot(r, bound, "o", color=PLANNED)
    axes.set(xlim=(-0.4, 0.4), ylim=(-27, 27), xlabel="lever r (m)", ylabel="U⁺/4 and −U⁻/4 (N m)")


class TightOrNot(Panel):
    """The planner's program at one instant: when its torque is real, and when it is bought.

    Attributes:
        legs: who stands.
        braking: demanded deceleration.
        pull: how far ahead of the standing legs' middle the cost would have the centre of mass.
        charge: on U⁺ + U⁻, as the planner's weight ``bounds``.
        relaxed, true: the two answers: :class:`~wfbook.planner.instant.Stance`.
        sweep: by charge, relaxed answers; what the curves show.
    """

    STANCES: Mapping[str, tuple[int, ...]] = {
        "all four": (0, 1, 2, 3), "FL and RR": (0, 3), "all but RR": (0, 1, 2)
    }  # fmt: skip
    """By name, who stands."""

    CHARGES = np.logspace(-4, -1, 19)

    def __init__(self) -> None:
        self.robot = Robot.go1()
        self._instants = {name: Instant(self.robot, legs) for name, legs in self.STANCES.items()}
        self._sweeps: dict[tuple, list[Stance]] = {}
        self.relaxed: Stance | None = None
        self.true: Stance | None = None
        self.sweep: list[Stance] = []
        self.legs = ipywidgets.Dropdown(options=list(self.STANCES), description="standing", style=_WIDE)
        self.braking = _slider("braking (m/s²)", 3.0, 0.0, 4.0, 0.5)
        self.pull = _slider("pulled ahead (m)", 0.0, 0.0, 0.1, 0.01)
        self.charge = ipywidgets.FloatLogSlider(
            value=Weights().bounds, min=-4, max=-1, step=0.05, description="charge",
            continuous_update=False, readout_format=".4f", style=_WIDE,
        )  # fmt: skip
        super().__init__([self.legs, self.braking, self.pull, self.charge], ["program"])

    def redraw(self) -> None:
        """Solve and draw."""
        instant, charge = self._instants[self.legs.value], self.charge.value
        task = (-self.braking.value, 0.0, 0.0), (self.pull.value, 0.0)
        key = self.legs.value, *task
        if key not in self._sweeps:
            self._sweeps[key] = [instant.relaxed(task[0], c, task[1]) for c in self.CHARGES]
        self.sweep = self._sweeps[key]
        self.relaxed, self.true = (
            solve(task[0], charge, task[1]) for solve in (instant.relaxed, instant.true)
        )
        picture = Picture(9.5, 3.8)
        grid = picture.add_gridspec(2, 2, width_ratios=[1.5, 1.0])
        view, bought, price = (
            picture.add_subplot(grid[:, 0]),
            *(picture.add_subplot(grid[i, 1]) for i in (0, 1)),
        )
        self._draw_stances(view, self.STANCES[self.legs.value])
        sizes = [np.linalg.norm(stance.fictitious) for stance in self.sweep]
        bought.fill_between(self.CHARGES, sizes, color=FORCE, alpha=0.45, linewidth=0)
        bought.plot(self.CHARGES, sizes, color=FORCE, gid="made by nothing")
        bought.set(ylabel="made by\nnothing (N m)", ylim=(0, 20))
        prices = [stance.price.max() for stance in self.sweep]
        price.plot(self.CHARGES, 4 * self.CHARGES, color=INK, linestyle=":", label="4 × charge", gid="cap")
        price.plot(self.CHARGES, prices, color=PLANNED, label="price of torque", gid="price")
        price.set(yscale="log", ylim=(2e-4, 0.5), xlabel="charge on U⁺ + U⁻", ylabel="cost per\nweight × m")
        price.legend(loc="lower right", frameon=False)
        for axes in (bought, price):
            axes.set(xscale="log", xlim=self.CHARGES[[0, -1]])
            tidy(axes)
            axes.axvline(charge, color=PALE, linewidth=1.5, gid="now")
        size = np.linalg.norm(self.relaxed.fictitious)
        verdict = "tight" if size < 0.01 else f"{size:.1f} N m made by nothing"
        self.say(
            f"{verdict}; relaxed cost {self.relaxed.cost:.5f}, true cost {self.true.cost:.5f};"
            f" the CoM is {-1e3 * self.relaxed.offset[2]:.1f} mm lower than it stands best"
        )
        self.show(
            "program", picture, "where the CoM is and how the legs push; fictitious torque against charge"
        )

    def _draw_stances(self, axes: Any, legs: tuple[int, ...]) -> None:
        """Draw the relaxed answer's loads and both answers' centres of mass from above."""
        stands, loads = np.isin(np.arange(4), legs), np.zeros(4)
        loads[stands] = np.maximum(self.relaxed.lam[:, 2], 0.0)
        support(axes, self.robot.stance, stands, loads)
        axes.plot(
            *self.relaxed.offset[:2], "o", color=PLANNED, markersize=8, label="CoM, relaxed", gid="relaxed"
        )
        axes.plot(
            *self.true.offset[:2],
            "o",
            color=MEASURED,
            fillstyle="none",
            markersize=11,
            label="CoM, true",
            gid="true",
        )
        axes.set(xlim=(-0.36, 0.36), ylim=(-0.27, 0.27))
        axes.legend(loc="center left", frameon=False)


def _nose(pitch: float) -> str:
    return "down" if pitch > 0.0 else "up"


def _slider(name: str, value: float, low: float, high: float, step: float) -> ipywidgets.FloatSlider:
    """Return a slider that redraws when it is let go: a picture takes longer than a hand."""
    return ipywidgets.FloatSlider(
        value=value, min=low, max=high, step=step, description=name, continuous_update=False, style=_WIDE
    )
