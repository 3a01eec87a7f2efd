"""Chapter 11's widgets: DDP at work on a pendulum in honey, and the robot's problem with parts left out."""

import itertools

import ipywidgets
import numpy as np

from wfbook.modes import LEGS
from wfbook.omni.bellman import tabulate
from wfbook.omni.ddp import Iterate, iterations, parabolas
from wfbook.omni.locked import nominal_state
from wfbook.omni.problem import OptimalControl
from wfbook.omni.systems import Honey
from wfbook.omni.tasks import (
    HAND_STEP,
    STARTS,
    Attempt,
    Planned,
    ask,
    attempt,
    begin,
    planned,
    twelve_rows,
)
from wfbook.view.drawings.whole_body_ddp import (
    MOTORS,
    draw_costs,
    draw_loads,
    draw_map,
    draw_parabola,
    draw_ways,
)
from wfbook.view.style import INK, Picture
from wfbook.view.widgets.controls import choice, slider
from wfbook.view.widgets.panel import Panel, table

_GRID, _CONTROLS = np.linspace(-4.6, 4.6, 161), np.linspace(-10.0, 10.0, 61)
_STEPS = tuple(0.5 ** np.arange(11))


def _box(value: bool, name: str) -> ipywidgets.Checkbox:
    """Return a checkbox as wide as its text."""
    layout = ipywidgets.Layout(width=f"{3 + 0.62 * len(name):.1f}em")
    return ipywidgets.Checkbox(value=value, description=name, indent=False, layout=layout)


def _newtons(force: float) -> str:
    """Return a force without the sign of a zero."""
    return f"{round(force)} N" if np.isfinite(force) else "–"


class Iterations(Panel):
    """DDP on a pendulum in honey, iterate by iterate, over the true value function.

    Attributes:
        start: angle in degrees, 0 hanging.
        guess: torque of the first guess, the same at every step.
        horizon: in seconds.
        damping: of the first iteration.
        shorter: whether steps shorter than the whole are tried.
        iteration: which iterate is shown.
        time: of the parabola, in seconds.
        system: the pendulum.
        table: its value function over the longest horizon.
        found: the iterates there are.
        parabola: value, slope and curvature that are drawn, or None.
    """

    MOST, LONGEST = 40, 3.0

    def __init__(self) -> None:
        self.system = Honey()
        self.table = tabulate(self.system, _GRID, _CONTROLS, round(self.LONGEST / self.system.dt))
        self.start = slider(30.0, -150.0, 150.0, 5.0, "start (°)")
        self.guess = slider(0.0, -6.0, 6.0, 0.5, "first torque (N m)")
        self.horizon = slider(2.0, 0.5, self.LONGEST, 0.25, "horizon (s)")
        self.damping = choice([0.0, 0.1, 1.0, 10.0], 0.0, "first damping")
        self.shorter = _box(True, "shorter steps")
        self.iteration = slider(0, 0, 1, 1, "iterate")
        self.iteration.readout_format = ".0f"
        self.time = slider(0.5, 0.0, 2.0, 0.05, "parabola at (s)")
        self.found: list[Iterate] = []
        self.parabola: tuple[float, float, float] | None = None
        self._asked: tuple | None = None
        controls = [self.start, self.guess, self.horizon, self.damping, self.shorter]
        super().__init__([*controls, self.iteration, self.time], ["search"])

    @property
    def nodes(self) -> int:
        """Steps of the horizon."""
        return round(self.horizon.value / self.system.dt)

    def redraw(self) -> None:
        """Search, if what is searched has changed; draw the iterate that is chosen."""
        if self._search():
            return  # a slider whose range has changed calls again
        shown, first = int(self.iteration.value), len(self.table.value) - 1 - self.nodes
        step = min(round(self.time.value / self.system.dt), self.nodes)
        now = self.found[shown]
        self.parabola = self._parabola(now, step)
        figure = Picture(9.6, 5.0)
        panes = figure.subplot_mosaic(
            [["ways", "near"], ["costs", "costs"]], height_ratios=(2, 1), width_ratios=(3, 2)
        )
        over, near, below = panes["ways"], panes["near"], panes["costs"]
        draw_map(over, self.table, self.system.dt, first)
        draw_ways(over, [one.states[:, 0] for one in self.found], shown, self.system.dt)
        over.axvline(step * self.system.dt, color=INK, linewidth=1.0, linestyle=":")
        draw_parabola(near, self.table, first + step, float(now.states[step, 0]), self.parabola)
        near.set_title(f"at {step * self.system.dt:.2f} s", loc="left", fontsize="small")
        draw_costs(below, {"cost": np.array([one.cost for one in self.found])}, shown)
        best = self.table.at(first, float(np.radians(self.start.value)))
        below.axhline(best, color=INK, linestyle="--", linewidth=1.0, gid="best")
        words = "trajectories over the value function, the parabola at one time, the cost of every iterate"
        self.show("search", figure, words)
        self.say(self._verdict(shown, best))

    def _search(self) -> bool:
        """Search anew if asked for something else; tell whether that moved a slider."""
        asked = tuple(c.value for c in (self.start, self.guess, self.horizon, self.damping, self.shorter))
        if asked == self._asked:
            return False
        self._asked = asked
        steps = _STEPS if self.shorter.value else _STEPS[:1]
        start = np.array([np.radians(self.start.value)])
        guess = np.full((self.nodes, 1), self.guess.value)
        search = iterations(self.system, start, guess, self.damping.value, steps)
        self.found = [next(search)]
        for one in itertools.islice(search, self.MOST):
            self.found.append(one)
            if one.slope <= 1e-6 * (1.0 + one.cost):
                break
        before = self.iteration.value, self.time.value
        self.iteration.max = max(1, len(self.found) - 1)
        self.time.max = self.horizon.value
        self.iteration.value = min(self.iteration.value, len(self.found) - 1)
        return before != (self.iteration.value, self.time.value)

    def _parabola(self, now: Iterate, step: int) -> tuple[float, float, float] | None:
        """Return value, slope and curvature at a step, with the least damping there are gains with."""
        for damping in (0.0, *10.0 ** np.arange(-4.0, 4.0)):
            try:
                V, V_s, V_ss = parabolas(self.system, now.states, now.controls, damping)
            except np.linalg.LinAlgError:
                continue
            return float(V[step]), float(V_s[step, 0]), float(V_ss[step, 0, 0])
        return None

    def _verdict(self, shown: int, best: float) -> str:
        now = self.found[shown]
        if shown == 0:
            text = "The first guess"
        elif now.step == 0.0:
            text = f"Iterate {shown}: no step made the cost smaller, damping grows"
        else:
            text = f"Iterate {shown}: step {now.step:.3g}, damping {now.damping:.2g}"
        text += f", cost {now.cost:.3f}; the least on a grid: {best:.3f}."
        last = self.found[-1]
        if shown < len(self.found) - 1:
            return text
        if last.slope > 1e-6 * (1.0 + last.cost):
            return f"{text} The search goes on."
        if last.cost > 1.02 * best + 0.01:
            return f"{text} Nothing more to gain from here, but there is a better way: DDP can't see it."
        return f"{text} Found."


TERMS = ("hand", "hand_rotation", "com", "trunk", "posture", "effort", "contact", "limits", "leg")
"""Terms of eq. 17 that can be left out, as :class:`.OptimalControl` calls them."""


class Parts(Panel):
    """The robot's problem with terms and contacts taken away or added: what it costs, and what breaks.

    The hand is to move to the left and up. The problem is solved from rest. Then the robot is one node
    further and a little disturbed, and it is solved twice again: cold, from a start that knows nothing, and
    warm.

    Attributes:
        terms: by name, whether the term is in the cost.
        wheels: by leg, whether it stands.
        rows: whether all wheels are held across: twelve rows.
        hand: whether the hand is on a wall.
        glued: whether moments about axles are free.
        mu: friction coefficient.
        reach: how far the hand is to go, as a share of :data:`.HAND_STEP`.
        nodes: of the horizon.
        solver: of :class:`.OptimalControl`.
        start: of the cold solve, one of :data:`.STARTS`.
        found: by ``"cold"`` and ``"warm"``, how the solves went.
        plan: the cold solution.
        results: the table.
    """

    MOST, DISTURBANCE = 30, 3e-3

    def __init__(self) -> None:
        self.terms = {name: _box(True, name.replace("_", " ")) for name in TERMS}
        self.wheels = {leg: _box(True, leg) for leg in LEGS}
        self.rows = _box(False, "all wheels held across (12 rows)")
        self.hand = _box(False, "hand on a wall")
        self.glued = _box(False, "moments about axles free")
        self.mu = slider(0.7, 0.1, 1.2, 0.1, "μ")
        self.reach = slider(1.0, 0.0, 2.0, 0.25, "reach (1: 22 cm)")
        self.nodes = choice([10, 20, 40, 80], 20, "nodes")
        self.solver = choice(["FDDP", "BoxFDDP"], "FDDP", "solver")
        self.start = choice(STARTS, STARTS[0], "cold start")
        self.results = ipywidgets.HTML()
        self.found: dict[str, Attempt] = {}
        self.plan: Planned | None = None
        self._ready: tuple | None = None
        boxes = [*self.terms.values(), *self.wheels.values(), self.rows, self.hand, self.glued]
        controls = [self.nodes, self.solver, self.start, self.mu, self.reach]
        super().__init__([*boxes, *controls], ["pictures"])
        self.children = (*self.children[:2], self.results, *self.children[2:])

    @property
    def stance(self) -> tuple[bool, ...]:
        """``(4,)`` which wheels stand."""
        return tuple(box.value for box in self.wheels.values())

    def redraw(self) -> None:
        """Solve and show, or say why that can't be."""
        trouble = self._impossible()
        if trouble:
            self.found, self.plan, self.results.value, self._ready = {}, None, "", None
            self.warn(trouble)
            return
        ocp, before, x = self._prepared()
        self.found, plans = {}, {}
        for name in ("cold", "warm"):
            if name == "warm":
                ocp.xs, ocp.us = list(before[0]), list(before[1])
                ocp.shift()
            else:
                begin(ocp, x, self.start.value)
            self.found[name] = attempt(ocp, x, self.MOST)
            plans[name] = planned(ocp)
            if name == "cold":
                self.plan, self.moments = plans[name], self._moments(ocp)
        self._tell(plans)
        self.say(" ".join(self.broken()) or "Nothing breaks.")
        figure = Picture(9.6, 3.4)
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
        draw_costs(left, {name: np.maximum(one.costs, 1e-6) for name, one in self.found.items()})
        draw_loads(right, np.nan_to_num(self.plan.load.max(axis=0)))
        self.show("pictures", figure, "cost of every iteration, cold and warm, and torques over their limits")

    def _impossible(self) -> str:
        if not any(self.stance):
            return "No wheel stands: there is nothing to push against."
        if not all(self.stance) and (self.rows.value or self.glued.value):
            return "These contacts are for four wheels that stand."
        return ""

    def _prepared(self) -> tuple[OptimalControl, tuple, np.ndarray]:
        """Return the problem, its solution from rest, and the state one node later; solve if need be."""
        without = tuple(name for name, box in self.terms.items() if not box.value)
        also = tuple(name for name, box in (("hand", self.hand), ("axle", self.glued)) if box.value)
        asked = (without, also, self.stance, self.rows.value, self.mu.value, self.reach.value)
        asked = (*asked, self.nodes.value, self.solver.value)
        if self._ready is None or self._ready[0] != asked:
            mode = "wheeled" if all(self.stance) else "legged"
            ocp = OptimalControl(
                self.nodes.value, 0.02, mode, None, self.mu.value, without, self.solver.value, also
            )
            ask(ocp, self.reach.value * np.array(HAND_STEP), stance=self.stance)
            if self.rows.value:
                twelve_rows(ocp)
            attempt(ocp, nominal_state(), self.MOST)
            noise = self.DISTURBANCE * np.random.default_rng(0).standard_normal(40)
            self._ready = asked, ocp, (ocp.xs, ocp.us), ocp.state.integrate(ocp.xs[1], noise)
        return self._ready[1:]

    def _moments(self, ocp: OptimalControl) -> dict[str, np.ndarray]:
        """Return force and moment of the contacts beside the wheels', ``(N, 6)`` each."""
        nodes = [ocp.others(node) for node in range(ocp.nodes)]
        return {name: np.array([node[name] for node in nodes]) for name in nodes[0]}

    def broken(self) -> list[str]:
        """Say what is wrong with the cold solution, a sentence each."""
        plan, cold = self.plan, self.found["cold"]
        if cold.error or not cold.iterations or not np.isfinite(cold.costs[-1]):
            return ["There is no solution: the numbers are not finite."]
        said = []
        if not cold.converged:
            said.append(f"Not converged after {cold.iterations} iterations.")
        if cold.gaps[-1] > 1e-6:
            said.append(f"The states do not obey eq. 4: gaps of up to {cold.gaps[-1]:.2g}.")
        largest = plan.load.max(axis=0)
        if largest.max() > 1.0 + 1e-6:
            motor = int(largest.argmax())
            said.append(f"{MOTORS[motor]} is asked for {largest[motor]:.1f} times what it has.")
        if plan.lightest < -2.0:
            said.append(f"The ground would have to pull at a wheel with {-plan.lightest:.0f} N.")
        if plan.grip > 1.2:
            said.append(f"A wheel pushes along the ground with {plan.grip:.1f} times what friction allows.")
        gifts = [abs(self.moments[name][:, 4]).max() for name in self.moments if name != "hand"]
        if gifts and max(gifts) > 0.1:
            said.append(f"Moments about axles of up to {max(gifts):.0f} N m, which no wheel has.")
        if "hand" in self.moments:
            pushes = self.moments["hand"][-1, :3]
            said.append(
                f"The hand pushes the wall with {-pushes[0]:.0f} N and along it with "
                f"{np.hypot(*pushes[1:]):.0f} N."
            )
        if plan.hand_error > 0.02:
            said.append(f"The hand ends {100 * plan.hand_error:.0f} cm from where it should.")
        if plan.tilt > np.radians(8.0):
            said.append(f"The trunk tilts by {np.degrees(plan.tilt):.0f}°.")
        return said

    def _tell(self, plans: dict[str, Planned]) -> None:
        columns = ("", "iterations", "time", "cost", "hand off by", "largest torque", "lightest wheel")
        rows = []
        for name, one in self.found.items():
            plan, cost = plans[name], one.costs[-1]
            rows.append(
                (
                    name,
                    f"{one.iterations}{'' if one.converged else ' (not converged)'}",
                    f"{1e3 * one.seconds:.0f} ms",
                    f"{cost:.3g}",
                    f"{1e3 * plan.hand_error:.0f} mm",
                    f"{plan.load.max():.2f} × limit",
                    _newtons(plan.lightest),
                )
            )
        self.results.value = table(columns, rows)
