"""Chapter 5's widgets: searches that a reader sets up, starts and watches, and a tree to walk through."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import ipywidgets

from wfbook.modes import swing_patterns
from wfbook.terrain import stepping_stones
from wfbook.view.drawings import planning as drawings
from wfbook.view.widgets.panel import Panel, table
from wfbook.view.widgets.searching import Outcome, Planner, Searching, Told, plan_for, switch, watched

if TYPE_CHECKING:
    from wfbook.planner import Plan, Problem, Progress
    from wfbook.planner.textbook import Node

_ROWS = 8


def _limited(**limits: object) -> "Callable[[Problem], Problem]":
    return lambda problem: replace(problem, limits=replace(problem.limits, **limits))


def _slippery(problem: "Problem") -> "Problem":
    regions = tuple(replace(r, mu_foot=0.05, mu_wheel_lateral=0.05) for r in problem.terrain.regions)
    return replace(problem, terrain=replace(problem.terrain, regions=regions))


DEMANDS: "dict[str, Callable[[Problem], Problem]]" = {
    "be within 5 cm of the goal": lambda problem: replace(problem, goal_tolerance=(0.05, 0.05)),
    "no wheels": lambda problem: replace(problem, end_effectors=("foot",)),
    "one leg at a time": lambda problem: replace(problem, patterns=swing_patterns(1)),
    "steps of 15 cm": _limited(step=(0.15, 0.1)),
    "at most 0.3 m/s": _limited(speed=(0.3, 0.1)),
    "a gap of 35 cm": lambda problem: replace(
        problem, terrain=stepping_stones(gap=0.35, stones=0, start=0.25)
    ),
    "slippery ground (μ 0.05)": _slippery,
}
"""What can be demanded of a walk, in the order in which it is applied."""


class LiveSearch(Searching):
    """Leave groups of constraints out, turn the weights, and watch the search.

    Args:
        problem: what is asked with everything on and all weights times one.
        planner: as for :class:`Searching`.

    Attributes:
        groups: by name, a checkbox for each group of constraints; clear it to leave the group out.
        weights: by name, a slider for the factor of each weight.
        slots: how many slots.
        goal: how far ahead, in metres.
        table: a line for each of the last plans.
    """

    WEIGHTS = ("goal", "force", "bounds", "centroid", "swing")
    COLUMNS = (
        *("", "cost", "gap", "nodes", "swings", "wheels at the end", "distance", "torque missing, rms"),
        *("μ the feet need", "μ the wheels need along t", "reach used along x"),
    )

    def __init__(self, problem: "Problem", planner: Planner = plan_for) -> None:
        from wfbook.planner import OPTIONAL

        self._problem = problem
        self.groups = {name: switch(name) for name in (*OPTIONAL, "swing limit")}
        self.groups["wheels"] = switch("wheels", problem.wheels)
        self.slots = ipywidgets.IntSlider(value=problem.slots, min=2, max=6, description="slots")
        self.goal = ipywidgets.FloatSlider(
            value=problem.goal[0], min=0.0, max=1.2, step=0.05, description="goal (m)"
        )
        self.weights = {
            name: ipywidgets.FloatLogSlider(
                value=1.0, base=10, min=-2, max=2, step=0.25, description=f"{name} ×", readout_format=".2g"
            )
            for name in self.WEIGHTS
        }
        self.table = ipywidgets.HTML()
        self._rows: dict[str, tuple[str, ...]] = {}
        controls = [*self.groups.values(), self.slots, self.goal, *self.weights.values()]
        super().__init__(controls, ["search", "gait", "path"], planner)
        self.children = (*self.children, self.table)

    @property
    def asked(self) -> "Problem":
        """The problem that the controls ask now."""
        from wfbook.planner import OPTIONAL

        weights = {n: getattr(self._problem.weights, n) * s.value for n, s in self.weights.items()}
        return replace(
            self._problem,
            slots=self.slots.value,
            goal=(self.goal.value, self._problem.goal[1]),
            beyond_reach=True,
            without=tuple(name for name in OPTIONAL if not self.groups[name].value),
            end_effectors=("foot", "wheel") if self.groups["wheels"].value else ("foot",),
            patterns=self._problem.patterns if self.groups["swing limit"].value else swing_patterns(3),
            weights=replace(self._problem.weights, **weights),
        )

    def key(self) -> tuple:
        """Return the controls' values."""
        parts = (*self.groups.values(), self.slots, self.goal, *self.weights.values())
        return tuple(part.value for part in parts)

    def draw(self, outcome: Outcome) -> None:
        """Show search, gait and path, and add a line to the table."""
        if outcome.trace:
            drawn = drawings.convergence({"search": outcome.trace})
            self.show("search", drawn, "cost of the best plan, bound and gap over time")
        name = self._name()
        if outcome.plan is None:
            self._rows[name] = (name, "no plan", *[""] * (len(self.COLUMNS) - 2))
        else:
            self._draw_plan(outcome.plan)
            self._rows[name] = (name, *_figures(outcome.plan))
        first, *others = self._rows.values()
        self.table.value = table(self.COLUMNS, [first, *others[-_ROWS:]])

    def _name(self) -> str:
        """Say in what the present problem differs from the first."""
        parts = [f"no {name}" for name, box in self.groups.items() if not box.value]
        parts += [f"{name} × {s.value:.2g}" for name, s in self.weights.items() if abs(s.value - 1) > 1e-6]
        if (self.slots.value, self.goal.value) != (self._problem.slots, self._problem.goal[0]):
            parts.append(f"{self.goal.value:.2f} m in {self.slots.value} slots")
        return ", ".join(parts) or "as it was"


def _figures(plan: "Plan") -> tuple[str, ...]:
    """Return the numbers of a plan, for :attr:`LiveSearch.COLUMNS`."""
    from wfbook.planner import torque_mismatch
    from wfbook.planner.demands import friction_needed, reach_needed

    meta = plan.meta
    return (
        f"{meta['objective']:.4f}",
        f"{meta['gap']:.2%}",
        str(meta["nodes"]),
        str(int(plan.S.sum())),
        str(int(plan.end_effector[:, -1].sum())),
        f"{plan.distance:.2f} m",
        f"{torque_mismatch(plan).max():.1f} N m",
        f"{friction_needed(plan):.2f}",
        f"{friction_needed(plan, 'wheel'):.2f}",
        f"{reach_needed(plan)[0]:.2f} m",
    )


class Conflicts(Searching):
    """Demand more and more of a walk, until there is none; then read which demands exclude each other.

    Args:
        problem: with none of the demands.
        held: names of the demands that are made at first.
        demands: by their names, functions from a problem to one that asks more.
        planner: as for :class:`Searching`.

    Attributes:
        demands: by name, a checkbox for each.
        reasons: what the planner blames, a line for each reason.
    """

    COLUMNS = ("constraint", "what is to blame", "legs", "missing at least")

    def __init__(
        self,
        problem: "Problem",
        held: Sequence[str] = (),
        demands: "Mapping[str, Callable[[Problem], Problem]]" = DEMANDS,
        planner: Planner = plan_for,
    ) -> None:
        # Too fast a goal is to be told by its reasons, not refused.
        self._problem, self._change = replace(problem, beyond_reach=True), dict(demands)
        self.demands = {name: switch(name, name in held) for name in demands}
        self.reasons = ipywidgets.HTML()
        super().__init__(list(self.demands.values()), ["gait", "path"], planner)
        self.children = (*self.children[:2], self.reasons, *self.children[2:])

    @property
    def asked(self) -> "Problem":
        """The problem with the demands that are ticked."""
        problem = self._problem
        for name, box in self.demands.items():
            problem = self._change[name](problem) if box.value else problem
        return problem

    def key(self) -> tuple:
        """Return which demands are ticked."""
        return tuple(box.value for box in self.demands.values())

    def draw(self, outcome: Outcome) -> None:
        """Show the plan, or the reasons why there is none."""
        self.reasons.value = ""
        if outcome.plan is not None:
            self._draw_plan(outcome.plan)
        elif outcome.details:
            rows = [
                (d.group, d.text, ", ".join(d.legs), "" if d.missing is None else f"{d.missing:.2g}")
                for d in outcome.details
            ]
            self.reasons.value = table(self.COLUMNS, rows)


class TreeWalk(Panel):
    """A branch and bound to step through, node by node.

    Args:
        problem: small, on a single region.

    Attributes:
        formulation: "tight" or "paper".
        step: how many nodes have been bounded.
        nodes: of the whole search.
    """

    def __init__(self, problem: "Problem") -> None:
        self._problem = problem
        self._trees: dict[str, list[Node]] = {}
        self.formulation = ipywidgets.Dropdown(options=("tight", "paper"), description="formulation")
        self.step = ipywidgets.IntSlider(value=1, min=1, max=1, description="nodes", continuous_update=False)
        super().__init__([self.formulation, self.step], ["tree", "relaxation"])

    @property
    def nodes(self) -> "list[Node]":
        """The tree of the formulation that is chosen."""
        from wfbook.planner.textbook import grow

        name = self.formulation.value
        if name not in self._trees:
            self._trees[name] = grow(self._problem, name)
        return self._trees[name]

    def redraw(self) -> None:
        """Draw the tree so far, and the relaxation of its last node."""
        nodes = self.nodes
        if self.step.max != len(nodes):
            self.step.max = len(nodes)
        shown = min(self.step.value, len(nodes))
        last = nodes[shown - 1]
        bound = "no motion satisfies it" if not math.isfinite(last.bound) else f"bound {last.bound:.4f}"
        best = "no plan yet" if not math.isfinite(last.incumbent) else f"best plan {last.incumbent:.4f}"
        what = last.decision or "the root: nothing is decided"
        self.say(f"node {shown} of {len(nodes)}: {what}; {bound}; {best}; nothing is below {last.proven:.4f}")
        self.show("tree", drawings.tree(nodes, shown), f"tree of {shown} nodes, each at its bound")
        self.show("relaxation", drawings.half_swings(last), "swing matrix of the relaxation, with fractions")


class FormulationRace(Panel):
    """The paper's big-M program against the tight one: the same problem, incumbent, bound and gap over time.

    Args:
        problem: small.
        seconds: how long each may search.

    Attributes:
        slots: of the problem.
        seconds: how long each may search.
        button: its ``click`` starts both, one after the other.
        traces: by formulation, what it told of its progress.
    """

    def __init__(self, problem: "Problem", seconds: float = 5.0) -> None:
        self._problem = problem
        self._known: dict[tuple, dict[str, list[Progress]]] = {}
        self.traces: dict[str, list[Progress]] = {}
        self.slots = ipywidgets.IntSlider(value=problem.slots, min=1, max=4, description="slots")
        self.seconds = ipywidgets.FloatSlider(
            value=seconds, min=1.0, max=60.0, step=1.0, description="seconds"
        )
        self.button = ipywidgets.Button(description="Race", button_style="primary", icon="play")
        super().__init__([self.slots, self.seconds, self.button], ["race"])
        self.button.on_click(self.race)

    def redraw(self) -> None:
        """Show what is known; the first time, race."""
        key = (self.slots.value, self.seconds.value)
        if key in self._known:
            self._draw(self._known[key])
        elif not self._known:
            self.race()
        else:
            self.say("Press Race. The picture is still that of the race before.")

    def race(self, _button: object = None) -> None:
        """Give the problem to both formulations."""
        from wfbook.planner import NoPlanError, solve

        per_slot = self._problem.goal[0] / self._problem.slots
        problem = replace(
            self._problem, slots=self.slots.value, goal=(per_slot * self.slots.value, self._problem.goal[1])
        )
        key, traces = (self.slots.value, self.seconds.value), {}
        self.button.disabled = True
        try:
            for name in ("tight", "paper"):
                told = traces[name] = []

                def note(progress: "Progress", name: str = name, told: list = told) -> None:
                    told.append(progress)
                    self.say(f"{name}: {progress.time:.1f} s, {progress.nodes} nodes …")

                def search(note: Told, name: str = name) -> "Plan":
                    return solve(problem, name, time_limit=self.seconds.value, progress=note)

                try:
                    traces[name] = watched(search, note)[1]
                except NoPlanError:
                    continue  # its bound is all that it has
        except KeyboardInterrupt:
            self.say("Interrupted. Press Race to begin again.")
            return
        finally:
            self.button.disabled = False
        self._known[key] = traces
        self._draw(traces)

    def _draw(self, traces: "dict[str, list[Progress]]") -> None:
        self.traces = traces
        ends = [f"{name}: {_end(trace)}" for name, trace in traces.items()]
        self.say("; ".join(ends))
        self.show(
            "race", drawings.convergence(traces, soon=True), "incumbent, bound and gap of both over time"
        )


def _end(trace: "Sequence[Progress]") -> str:
    """Say how a search ended."""
    if not trace:
        return "nothing to tell"
    last = trace[-1]
    gap = f"gap {last.gap:.1%}" if math.isfinite(last.gap) else "no plan"
    return f"{gap} after {last.time:.2f} s"
