"""Chapter 3's widgets: one leg's rows of S and D, an implication as big-M, and a foot on three stones."""

import ipywidgets
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from wfbook.leg_path import LegPath, Ride, bank_and_deck, leg_path
from wfbook.modes import END_EFFECTORS, Broken, broken_rules
from wfbook.planner.one_step import OneStep, corners, least_m_interval, shares_interval
from wfbook.view.style import (
    BODY,
    FOOT,
    INK,
    LIMIT,
    PALE,
    PAPER,
    PLANNED,
    RELAXED,
    SWING,
    WHEEL,
    Picture,
    tidy,
)
from wfbook.view.widgets.panel import Panel

_RULES = {"swing": "swings\neq. 6", "foot": "stays\neq. 19", "wheel": "rolls\neqs 20, 21"}
"""What a slot asks of the leg's motion, and the equation that says so."""

_CELLS = f"""<style>
.wf-cell {{ margin: 1px; padding: 0; line-height: 26px; height: 26px; }}
.wf-cell.mod-active.wf-swing {{ background: {SWING}; color: #222; box-shadow: none; }}
.wf-cell.mod-active.wf-foot {{ background: {FOOT}; color: #fff; box-shadow: none; }}
.wf-cell.mod-active.wf-wheel {{ background: {WHEEL}; color: #222; box-shadow: none; }}
.wf-cell.wf-broken {{ outline: 3px solid {LIMIT}; outline-offset: -3px; }}
</style>"""

_MESSAGES = 3
_FINE = np.linspace(0.0, 1.0, 25)


def _rows(ride: Ride, swings: str, modes: str) -> tuple[np.ndarray, np.ndarray]:
    """Read ``"010"`` and ``"f0 w1 w1"`` as rows of S and D; a mode of ``-`` leaves D empty."""
    S, D = np.array([int(s) for s in swings]), np.zeros((ride.slots, *ride.start_dynamics.shape), int)
    for j, mode in enumerate(modes.split()):
        if mode != "-":
            D[j, int(mode[1]), "fw".index(mode[0])] = 1
    return S, D


EXAMPLES = {
    "land on the wheel": ("010000", "f0 w1 w1 w1 w1 w1"),
    "walk": ("010101", "f0 f1 f1 f1 f1 f2"),
    "switch on the ground": ("010000", "f0 f1 f1 w1 w1 w1"),
    "on nothing, on two": ("010000", "f0 - f1 f1 f1 f1"),
    "roll into the gap": ("100000", "w0 w0 w0 w0 w0 w0"),
    "too far": ("100000", "f2 f2 f2 f2 f2 f2"),
    "stay": ("000000", "f0 f0 f0 f0 f0 f0"),
}
"""Rows to begin with, for six slots on :func:`wfbook.leg_path.bank_and_deck`."""


class LegEditor(Panel):
    """Click cells of S and D for one leg, and see the path that they ask for, or which rule forbids them.

    Attributes:
        ride: body and ground.
        example: dropdown; sets all cells.
        speed: of the body.
        keep: checkbox; when set, D is filled in so that eqs 16 and 17 hold.
        swing: a toggle for each slot, the row of S.
        dynamics: by slot, region and end effector, the toggles of D.
        broken: the rules that are broken now.
        path: of the leg, None while S and D are not legal.
    """

    def __init__(self) -> None:
        self.ride = Ride(bank_and_deck())
        slots, regions = self.ride.slots, len(self.ride.terrain.regions)
        self.example = ipywidgets.Dropdown(options=list(EXAMPLES), description="rows")
        self.speed = ipywidgets.FloatSlider(0.5, min=0.0, max=0.8, step=0.05, description="body m/s")
        self.keep = ipywidgets.Checkbox(description="fill D in by eqs 16 and 17", indent=False)
        self.swing = [_cell("swing") for _ in range(slots)]
        kinds = [(r, e) for r in range(regions) for e in range(len(END_EFFECTORS))]
        self.dynamics = {(j, r, e): _cell(END_EFFECTORS[e]) for j in range(slots) for r, e in kinds}
        self.broken: list[Broken] = []
        self.path: LegPath | None = None
        self._setting = False
        numbers = [ipywidgets.Label(str(j), layout={"justify_content": "center"}) for j in range(slots)]
        lines = [("slot", numbers), ("S: swings", self.swing)]
        for r, e in kinds:
            name = f"D: region {r} ({self.ride.terrain.regions[r].group}), {END_EFFECTORS[e]}"
            lines.append((name, [self.dynamics[j, r, e] for j in range(slots)]))
        grid = ipywidgets.GridBox(
            [part for name, cells in lines for part in (ipywidgets.Label(name), *cells)],
            layout=ipywidgets.Layout(grid_template_columns=f"190px repeat({slots}, 56px)"),
        )
        self._set(*_rows(self.ride, *EXAMPLES[self.example.value]))
        self.example.observe(self._chosen, names="value")  # before the panel's own, which redraws
        super().__init__(
            [self.example, self.speed, self.keep, grid, ipywidgets.HTML(_CELLS)], ["time", "side"]
        )
        for cell in (*self.swing, *self.dynamics.values()):
            cell.observe(self._clicked, names="value")

    @property
    def S(self) -> np.ndarray:
        """``(J,)`` the row of S as it is clicked."""
        return np.array([int(cell.value) for cell in self.swing])

    @property
    def D(self) -> np.ndarray:
        """``(J, R, E)`` the rows of D as they are clicked."""
        D = np.zeros((self.ride.slots, *self.ride.start_dynamics.shape), int)
        for place, cell in self.dynamics.items():
            D[place] = cell.value
        return D

    def _set(self, S: np.ndarray, D: np.ndarray) -> None:
        self._setting = True
        for cell, value in zip(self.swing, S, strict=True):
            cell.value = bool(value)
        for place, cell in self.dynamics.items():
            cell.value = bool(D[place])
        self._setting = False

    def _chosen(self, _change: object) -> None:
        self._set(*_rows(self.ride, *EXAMPLES[self.example.value]))

    def _clicked(self, change: dict) -> None:
        if self._setting:
            return
        if self.keep.value:
            place = next((place for place, cell in self.dynamics.items() if cell is change["owner"]), None)
            self._set(self.S, self._filled_in(place))
        self._follow()

    def _filled_in(self, clicked: tuple[int, int, int] | None) -> np.ndarray:
        """Return D with what is clicked where the leg lands before it, and eq. 16 from there on."""
        S, D = self.S, self.D
        if clicked is not None:
            swings = np.flatnonzero(S[: clicked[0] + 1])
            if len(swings):
                D[swings[-1]] = 0
                D[(swings[-1], *clicked[1:])] = 1
        before = self.ride.start_dynamics
        for j in range(len(S)):
            if not S[j] or D[j].sum() != 1:
                D[j] = before
            before = D[j]
        return D

    def redraw(self) -> None:
        """Check the rows, find the path, draw both."""
        self.ride = Ride(self.ride.terrain, speed=self.speed.value)
        S, D = self.S, self.D
        self.broken = broken_rules(S[None], D[None], self.ride.start_dynamics[None])
        self.path = None if self.broken else leg_path(self.ride, S, D)
        if self.path is not None:
            self.broken = self.path.broken
        for (j, _, _), cell in self.dynamics.items():
            wrong = any(b.slot == j and b.rule in ("eq. 16", "eq. 17") for b in self.broken)
            (cell.add_class if wrong else cell.remove_class)("wf-broken")
        for j, cell in enumerate(self.swing):
            cell.description = "1" if cell.value else "0"
            wrong = any(b.slot == j and b.rule == "eq. 16" for b in self.broken)
            (cell.add_class if wrong else cell.remove_class)("wf-broken")
        for cell in self.dynamics.values():
            cell.description = "1" if cell.value else "0"
        if self.broken:
            more = len(self.broken) - _MESSAGES
            rest = f" … and {more} more." if more > 0 else ""
            self.say("Forbidden. " + "; ".join(map(str, self.broken[:_MESSAGES])) + rest)
        else:
            count = int(S.sum())
            self.say(f"Allowed: {count} swing{'s' * (count != 1)}, and the leg keeps up with the body.")
        self.show("time", self._over_time(S), "x of the contact over time, in the colours of its modes")
        self.show("side", self._from_the_side(), "the contact's path over the ground, from the side")

    def _bad_slots(self) -> list[int]:
        return sorted({broken.slot for broken in self.broken})

    def _over_time(self, S: np.ndarray) -> Picture:
        ride, figure = self.ride, Picture(8.0, 3.6)
        axes = figure.add_subplot()
        tidy(axes)
        axes.grid(axis="y", visible=False)
        for r, (low, high) in enumerate(ride.intervals):
            axes.axhspan(low, high, color=BODY, alpha=0.16 if r % 2 else 0.26, linewidth=0, gid=f"region {r}")
        for j in self._bad_slots():
            left, right = j * ride.slot_duration, (j + 1) * ride.slot_duration
            axes.axvspan(left, right, color=LIMIT, alpha=0.25, linewidth=0, gid=f"broken {j}")
        band = (ride.hip - ride.reach, ride.hip + ride.reach)
        axes.fill_between(ride.time, *band, color=PLANNED, alpha=0.13, linewidth=0)
        axes.plot(ride.time, ride.hip, color=PLANNED, linewidth=1.5, linestyle="--", gid="hip")
        low, high = ride.hip[0] - 0.3, max(ride.hip[-1] + 0.3, 0.6)
        if self.path is not None:
            for j, (x, colour, style, name) in enumerate(self._pieces()):
                axes.plot(
                    (j + _FINE) * ride.slot_duration,
                    x,
                    color=colour,
                    linewidth=3.5,
                    linestyle=style,
                    gid=name,
                )
                axes.text(
                    (j + 0.5) * ride.slot_duration, high, _RULES[name], ha="center", va="top", color=INK
                )
        for r, ends in enumerate(ride.intervals):
            inside = np.clip(ends, low, high)
            axes.text(0.01, inside.mean(), f"region {r}", va="center", color=INK)
        axes.set_ylim(low, high)
        axes.set_xlim(0.0, ride.time[-1])
        axes.set_xticks(ride.slot_duration * np.arange(ride.slots + 1))
        axes.set_xlabel("time (s)")
        axes.set_ylabel("x (m)")
        handles = [
            Line2D([], [], color=c, linewidth=3.5, label=n) for n, c in (("foot", FOOT), ("wheel", WHEEL))
        ]
        handles += [
            Line2D([], [], color=BODY, linewidth=3, linestyle=":", label="swing"),
            Line2D([], [], color=PLANNED, linestyle="--", label="hip"),
            Patch(color=PLANNED, alpha=0.13, label="reach (30)"),
            Patch(color=LIMIT, alpha=0.25, label="a rule is broken"),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
        return figure

    def _pieces(self) -> list[tuple[np.ndarray, str, str, str]]:
        """Return for each slot x over the slot, colour, line style and name of what the leg does."""
        found = []
        for j in range(self.ride.slots):
            x = self.path.along(j, _FINE)
            kind = END_EFFECTORS[self.path.wheel[j + 1]]
            stance = (x, FOOT if kind == "foot" else WHEEL, "-", kind)
            found.append((x, BODY, ":", "swing") if self.path.S[j] else stance)
        return found

    def _from_the_side(self) -> Picture:
        ride, figure = self.ride, Picture(8.0, 1.9)
        axes = figure.add_subplot()
        tidy(axes)
        for r, region in enumerate(ride.terrain.regions):
            low, high = ride.intervals[r]
            z = [region.height(x, ride.y) for x in (low, high)]
            depth = [-0.16, -0.16]
            axes.add_patch(
                Polygon(
                    [*zip([low, high, high, low], [*z, *depth], strict=True)], color=BODY, alpha=0.3, lw=0
                )
            )
            axes.plot([low, high], z, color=INK, linewidth=1.2, gid=f"region {r}")
        if self.path is not None:
            for j, (x, colour, style, name) in enumerate(self._pieces()):
                z = self.path.heights(j, _FINE)
                axes.plot(x, z, color=colour, linewidth=3, linestyle=style, gid=name)
                if name == "foot":
                    axes.plot(x[-1:], z[-1:], "o", color=colour, ms=9)
        axes.set_xlim(ride.hip[0] - 0.3, max(ride.hip[-1] + 0.3, 0.6))
        axes.set_ylim(-0.14, 0.1)
        axes.set_xlabel("x (m)")
        axes.set_ylabel("z (m)")
        return figure


def _cell(kind: str) -> ipywidgets.ToggleButton:
    cell = ipywidgets.ToggleButton(layout=ipywidgets.Layout(width="54px", height="26px"), tooltip=kind)
    cell.add_class("wf-cell")
    cell.add_class(f"wf-{kind}")
    return cell


class BigM(Panel):
    """An implication as big-M beside its convex hull, and what their relaxations know of the cost.

    Attributes:
        big: M.
        goal: where the leg would like to be.
        price: of the swing.
        bounds: of the relaxations shown: "big-M", "hull", "perspective", and the "optimum".
    """

    _M = np.geomspace(0.1, 4.0, 17)

    def __init__(self) -> None:
        self.big = ipywidgets.FloatSlider(1.0, min=0.1, max=4.0, step=0.05, description="M (m)")
        self.goal = ipywidgets.FloatSlider(0.25, min=0.0, max=0.5, step=0.05, description="goal (m)")
        self.price = ipywidgets.FloatSlider(0.2, min=0.0, max=0.6, step=0.05, description="price of S")
        self.bounds: dict[str, float] = {}
        self._curves: dict[OneStep, np.ndarray] = {}
        super().__init__([self.big, self.goal, self.price], ["sets"])

    def redraw(self) -> None:
        """Draw what both relaxations allow, and their bounds over M."""
        step = OneStep(goal=self.goal.value, price=self.price.value)
        if step not in self._curves:
            self._curves[step] = np.array([step.bound(*step.big_m(big))[0] for big in self._M])
        figure = Picture(8.0, 3.1)
        left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.05))
        named = (("big-M", left, step.big_m(self.big.value)), ("hull", middle, step.tight()))
        self.bounds = {"optimum": step.optimum, "perspective": step.perspective_bound()}
        for name, axes, relaxation in named:
            self.bounds[name], best = step.bound(*relaxation)
            _draw_relaxation(axes, step, corners(*relaxation), best)
            axes.set_title(name, fontsize="medium", color=INK)
        left.set_ylabel("step (m)")
        middle.sharey(left)
        self._draw_bounds(right, self._curves[step])
        self.show("sets", figure, "what big-M and the convex hull allow, and the bounds that follow")
        cut = (
            "" if self.bounds["big-M"] <= step.optimum + 1e-6 else " That is no bound: M cuts real steps off!"
        )
        self.say(
            f"big-M: {self.bounds['big-M']:.3f}, hull: {self.bounds['hull']:.3f}, perspective: "
            f"{self.bounds['perspective']:.3f}, best decision: {step.optimum:.3f}.{cut}"
        )

    def _draw_bounds(self, axes: object, curve: np.ndarray) -> None:
        tidy(axes)
        axes.plot(self._M, curve, color=INK, linewidth=1.5, gid="curve")
        axes.plot(self.big.value, self.bounds["big-M"], "o", color=INK, mfc=RELAXED, ms=9, gid="big-M")
        axes.axhline(self.bounds["hull"], color=INK, linestyle=":", linewidth=1.5, gid="hull")
        axes.axhline(self.bounds["optimum"], color=PLANNED, linewidth=2, gid="optimum")
        axes.set_xscale("log")
        axes.set_xticks([0.1, 0.3, 1.0, 3.0], ["0.1", "0.3", "1", "3"])
        axes.minorticks_off()
        axes.set_xlabel("M (m)")
        axes.set_ylabel("bound of the cost (1)")
        axes.set_ylim(0.0, None)
        handles = [
            Line2D([], [], color=INK, label="big-M"),
            Line2D([], [], color=INK, linestyle=":", label="hull"),
            Line2D([], [], color=PLANNED, linewidth=2, label="optimum"),
        ]
        axes.legend(handles=handles, frameon=False, fontsize="small")


def _draw_relaxation(axes: object, step: OneStep, polygon: np.ndarray, best: np.ndarray) -> None:
    """Draw what a relaxation allows in the plane of S and step, the two decisions, and the least cost."""
    tidy(axes)
    axes.add_patch(
        Polygon(polygon, facecolor=RELAXED, alpha=0.6, edgecolor=INK, linewidth=0.8, gid="allowed")
    )
    S, steps = np.meshgrid(np.linspace(-0.05, 1.05, 60), np.linspace(-0.75, 0.75, 90))
    levels = max(step.optimum, 0.05) * np.array([0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
    axes.contour(S, steps, step.cost(S, steps), levels=levels, colors=PALE, linewidths=0.8)
    axes.plot([0], [0], "s", color=PLANNED, ms=8, gid="stands")
    axes.plot([1, 1], [-step.limit, step.limit], color=PLANNED, linewidth=5, gid="swings")
    axes.plot(*best, "o", color=INK, mfc=PAPER, ms=8, gid="best")
    axes.set_xlim(-0.05, 1.05)
    axes.set_ylim(-0.75, 0.75)
    axes.set_xlabel("S (1)")


class Stones(Panel):
    """A foot on three stones by halves: where big-M with the least M lets it be, and where the hull.

    Attributes:
        first: share of the first stone.
        second: of what is left, the share of the second stone.
        intervals: by name, "big-M" and "hull", where the foot may be.
    """

    LOW, HIGH = np.array([-0.25, 0.2, 0.65]), np.array([0.0, 0.45, 0.9])

    def __init__(self) -> None:
        self.first = ipywidgets.FloatSlider(0.35, min=0.0, max=1.0, step=0.05, description="D, stone 0")
        self.second = ipywidgets.FloatSlider(0.5, min=0.0, max=1.0, step=0.05, description="of the rest")
        self.intervals: dict[str, tuple[float, float]] = {}
        super().__init__([self.first, self.second], ["stones"])

    @property
    def D(self) -> np.ndarray:
        """``(3,)`` shares of the stones."""
        rest = 1.0 - self.first.value
        return np.array([self.first.value, rest * self.second.value, rest * (1.0 - self.second.value)])

    def redraw(self) -> None:
        """Draw stones, shares and both intervals."""
        D, figure = self.D, Picture(8.0, 2.2)
        axes = figure.add_subplot()
        tidy(axes)
        axes.grid(axis="y", visible=False)
        for r, (low, high) in enumerate(zip(self.LOW, self.HIGH, strict=True)):
            axes.barh(0, high - low, left=low, color=BODY, alpha=0.25 + 0.75 * D[r], gid=f"stone {r}")
            axes.text((low + high) / 2, 0, f"D = {D[r]:.2f}", ha="center", va="center", color=INK)
        self.intervals = {
            "big-M": least_m_interval(self.LOW, self.HIGH, D),
            "hull": shares_interval(self.LOW, self.HIGH, D),
        }
        for row, (name, (low, high)) in enumerate(self.intervals.items(), start=1):
            axes.barh(row, high - low, left=low, height=0.5, color=RELAXED, edgecolor=INK, gid=name)
        axes.set_yticks(range(3), ["the stones", "big-M allows", "the hull allows"])
        axes.invert_yaxis()
        axes.set_xlim(self.LOW.min() - 0.05, self.HIGH.max() + 0.05)
        axes.set_xlabel("x of the foot (m)")
        self.show("stones", figure, "three stones, and where each relaxation lets a foot be")
        widths = {name: 100 * (high - low) for name, (low, high) in self.intervals.items()}
        self.say(f"big-M leaves {widths['big-M']:.0f} cm of freedom, the hull {widths['hull']:.0f} cm.")
