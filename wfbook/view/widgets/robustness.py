"""Chapter 8's widgets on what robots bear: margins of a plan, a small study, windows planned on the way."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import ipywidgets

from wfbook import planner, receding, simulate
from wfbook.planner.margins import MARGINS
from wfbook.planner.problem import Problem
from wfbook.study import here
from wfbook.study.axes import AXES
from wfbook.study.design import Study
from wfbook.terrain import flat
from wfbook.view import figures, survival
from wfbook.view.drawings import terrain_runs as drawings
from wfbook.view.widgets.controls import choice
from wfbook.view.widgets.panel import Panel, table
from wfbook.view.widgets.searching import switch
from wfbook.view.widgets.simulating import Simulating, Told, verdict

if TYPE_CHECKING:
    from wfbook.planner import Plan
    from wfbook.simulate import Run

LEVELS = {
    "push": (20.0, 40.0, 60.0),
    "push_angle": (0.0, 90.0, 180.0),
    "push_start": (0.2, 0.5, 0.8),
    "delay": (9.0, 18.0, 24.0),
    "trunk_mass": (1.0, 1.4, 1.8),
    "ground_friction": (0.3, 0.6, 1.0),
    "joint_friction": (0.0, 0.4, 0.8),
}
"""Of the axes that a small study offers, three levels each."""

BASE = {"push": 40.0, "push_angle": 90.0, "push_start": 0.4}
"""What a small study does to the robot unless an axis says otherwise."""

WAY_SLOTS = 11
"""Of the way that is planned in windows, a tenth of a metre for each."""

Polished = tuple[str, frozenset[str]]
"""Name of a stored plan, and the margins that its polish leaves out."""


class Margins(Simulating):
    """Polish a gait again without some of its margins: what does the plan keep in hand, and does it walk?

    Args:
        known: runs that there are already.
        simulator: called with a plan and a function that it tells simulated and total time.

    Attributes:
        plan: control, which gait.
        switches: by name, checkboxes of the margins.
    """

    COLUMNS = ("plan", "without", "plan (m)", "went (m)", "CoM error (mm)", "slip (mm)", "")

    def __init__(
        self,
        known: "dict[Polished, Run] | None" = None,
        simulator: "Callable[[Plan, Told], Run] | None" = None,
    ) -> None:
        self._simulator = simulator or (lambda plan, told: simulate.run(plan, progress=told))
        self._plans: dict[Polished, Plan] = {}
        names = ("ramp-down", "ramp-up", "stepping-stones", "flat", "flat-feet")
        self.plan = choice(names, "ramp-down", "gait")
        self.switches = {name: switch(name) for name in MARGINS}
        super().__init__([self.plan, *self.switches.values()], ["in hand", "tracking"], self.COLUMNS, known)

    @property
    def asked(self) -> Polished:
        """What the controls say."""
        return self.plan.value, frozenset(name for name, box in self.switches.items() if not box.value)

    def polished(self, asked: Polished) -> "Plan":
        """Return the gait's plan without some margins."""
        if asked not in self._plans:
            name, without = asked
            relaxed = planner.stored(name, relaxed=True)
            self._plans[asked] = planner.polish(relaxed, without) if without else planner.stored(name)
        return self._plans[asked]

    def run_of(self, asked: Polished, told: Told) -> "Run":
        """Simulate a plan."""
        return self._simulator(self.polished(asked), told)

    def preview(self) -> None:
        """Show what the plan keeps."""
        plan = self.polished(self.asked)
        self.say(f"The plan goes {plan.distance:.2f} m: press Simulate to see it executed.")
        self._draw_hand()

    def draw(self, run: "Run") -> None:
        """Show what the plan keeps, and how the run went."""
        metrics = run.metrics
        went = f"{metrics['distance_m']:.2f} of {metrics['planned_distance_m']:.2f} m"
        self.say(f"{verdict(run)}: {went}.")
        self._draw_hand()
        self.show("tracking", figures.tracking(run), "errors of the centre of mass and of the attitude")

    def _draw_hand(self) -> None:
        name, without = self.asked
        plans = {"all margins": self.polished((name, frozenset()))}
        if without:
            plans[f"without {', '.join(sorted(without))}"] = self.polished(self.asked)
        what = "share of the friction used, least load of a leg, and room under the knees over time"
        self.show("in hand", drawings.in_hand(plans), what)

    def row(self, asked: Polished, run: "Run") -> tuple[str, ...]:
        """Return a line of the table."""
        metrics, (name, without) = run.metrics, asked
        return (
            name,
            ", ".join(sorted(without)) or "nothing",
            f"{metrics['planned_distance_m']:.2f}",
            f"{metrics['distance_m']:.2f}",
            f"{1e3 * metrics['base_rms_m']:.1f}",
            f"{1e3 * metrics['slip_max_m']:.1f}",
            verdict(run),
        )


class SmallStudy(Panel):
    """Two things that are done to a walking robot, three levels each: who stays upright?

    What was simulated before is not simulated again.

    Args:
        plan_file: content of a plan file.
        finished: rows of runs by key, see :func:`wfbook.study.here.run`; what is run is added.
        runner: runs what is missing of a study, as :func:`wfbook.study.here.run`.

    Attributes:
        down, across: controls, which axes.
        button: its ``click`` simulates what is missing.
        report: of the study that is shown.
    """

    def __init__(
        self,
        plan_file: bytes,
        finished: dict[str, dict[str, Any]] | None = None,
        runner: Callable[..., dict[str, Any]] = here.run,
    ) -> None:
        self._file, self._runner = plan_file, runner
        self._finished = {} if finished is None else finished
        options = [(AXES[name].label, name) for name in LEVELS]
        self.down = choice(options, "push", "down")
        self.across = choice(options, "push_angle", "across")
        self.button = ipywidgets.Button(description="Simulate", button_style="primary", icon="play")
        self.report: dict[str, Any] = {}
        super().__init__([self.down, self.across, self.button], ["map"])
        self.button.on_click(self.simulate)

    @property
    def study(self) -> Study:
        """What the controls ask."""
        return small_study(self._file, self.down.value, self.across.value)

    def redraw(self) -> None:
        """Draw what is known of the two axes."""
        if self.down.value == self.across.value:
            self.warn("Choose two different axes.")
            return
        study = self.study
        missing = sum(key not in self._finished for key in study.cases)
        self._draw(here.report(study, self._finished))
        left = (
            f"{missing} of {len(study.cases)} runs are missing: press Simulate."
            if missing
            else "All runs are done."
        )
        self.say(f"{left} Besides: {_base_text(self.down.value, self.across.value)}.")

    def simulate(self, _button: object = None) -> None:
        """Run what is missing, and draw it as it comes."""
        if self.down.value == self.across.value:
            return

        def told(report: dict[str, Any], done: int, total: int) -> None:
            self._draw(report)
            self.say(f"simulating … {done} of {total} runs")

        self.button.disabled = True
        try:
            self._runner(self.study, self._finished, told)
        finally:
            self.button.disabled = False
        self.redraw()

    def _draw(self, report: dict[str, Any]) -> None:
        self.report = report
        self.show(
            "map", survival.grid(report, report["grids"][0]["name"]), "share of robots that stay upright"
        )


def small_study(
    plan_file: bytes, down: str, across: str, levels: dict[str, tuple[float, ...]] | None = None
) -> Study:
    """Return a study of two axes with one seed, in which the controller sees the true state.

    Args:
        plan_file: content of a plan file.
        down: name of an axis.
        across: of another one.
        levels: instead of :data:`LEVELS`.
    """
    levels = LEVELS | (levels or {})
    factors = tuple((AXES[name], tuple(map(float, levels[name]))) for name in (down, across))
    base = {name: value for name, value in BASE.items() if name not in (down, across)}
    return Study({"short walk": plan_file}, grids=(factors,), base=base, seeds=1, state="true")


def _base_text(*chosen: str) -> str:
    """Return what is done to the robot besides two axes."""
    kept = {AXES[name]: level for name, level in BASE.items() if name not in chosen}
    return ", ".join(f"{axis.name.replace('_', ' ')} {level:g} {axis.unit}" for axis, level in kept.items())


@dataclass(frozen=True)
class Ahead:
    """How a way is planned in windows.

    Attributes:
        window: slots that are planned at once.
        commit: slots of a window that are executed before the next takes over.
        budget: of relaxations and exact programs for a window.
    """

    window: int
    commit: int
    budget: int


def walked(asked: Ahead, told: Told) -> "Run":
    """Plan and execute a way of 1.1 m in windows."""
    problem = Problem(flat(), goal=(0.1 * WAY_SLOTS, 0.0), slots=WAY_SLOTS)
    run, _, _ = receding.run(
        problem, asked.window, asked.commit, budget=asked.budget, hold=0.5, progress=told
    )
    return run


class Windows(Simulating):
    """Plan the next window while the robot executes this one: how long are they, how late may they be?

    Args:
        simulator: called with an :class:`Ahead` and a function that it tells simulated and total time.

    Attributes:
        window, commit, budget: controls.
        windows: a line for each window of the run that is shown.
    """

    COLUMNS = (
        "window",
        "next after",
        "budget",
        "windows",
        "planning, longest",
        "of the time there was",
        "way (m)",
        "",
    )

    def __init__(self, simulator: "Callable[[Ahead, Told], Run]" = walked) -> None:
        self._simulator = simulator
        self.window = _whole(6, 3, 8, "slots planned at once")
        self.commit = _whole(3, 1, 6, "executed of them")
        self.budget = _whole(12, 4, 40, "programs for a window")
        self.windows = ipywidgets.HTML()
        super().__init__([self.window, self.commit, self.budget], ["windows"], self.COLUMNS)
        self.children = (*self.children, self.windows)

    @property
    def asked(self) -> Ahead | None:
        """What the controls say; None if windows leave gaps."""
        ahead = Ahead(self.window.value, self.commit.value, self.budget.value)
        return ahead if ahead.commit < ahead.window else None

    def run_of(self, asked: Ahead, told: Told) -> "Run":
        """Plan and execute."""
        self.say("planning the first window …")
        return self._simulator(asked, told)

    def preview(self) -> None:
        """Draw the windows as they would be."""
        self.windows.value = ""
        if self.asked is None:
            self.warn("A window must be longer than what is executed of it.")
            return
        self.say("Press Simulate: the robot sets off with its first window.")
        self.show(
            "windows", drawings.windows(WAY_SLOTS, self.window.value, self.commit.value), "windows over time"
        )

    def draw(self, run: "Run") -> None:
        """Draw the windows as they were, and how long each took."""
        ahead = run.metrics["replanning"]
        records = ahead["windows"]
        self.say(
            f"{verdict(run)}: {run.metrics['distance_m']:.2f} m, {len(records)} windows, "
            f"{ahead['late']} late, {ahead['waited_slots']} slots waited"
        )
        picture = drawings.windows(WAY_SLOTS, self.window.value, self.commit.value, records=records)
        self.show("windows", picture, "windows over time, and how long planning each took")
        lines = [
            (
                f"{record['slots'][0]} to {record['slots'][1]}",
                record["status"],
                "unknown" if record["gap"] is None else f"{100 * record['gap']:.0f} %",
                f"{record['planning_s']:.2f} s",
                "as long as it takes" if record["available_s"] is None else f"{record['available_s']:.2f} s",
                f"{1e3 * record['correction_m']:.0f} mm",
            )
            for record in records
        ]
        columns = ("slots", "search", "gap", "planning took", "time there was", "off the plan before")
        self.windows.value = table(columns, lines)

    def row(self, asked: Ahead, run: "Run") -> tuple[str, ...]:
        """Return a line of the table."""
        records = run.metrics["replanning"]["windows"][1:]
        longest = max((record["planning_s"] for record in records), default=0.0)
        share = max((record["share"] for record in records), default=0.0)
        return (
            f"{asked.window} slots",
            f"{asked.commit} slots",
            f"{asked.budget}",
            f"{len(records) + 1}",
            f"{longest:.2f} s",
            f"{100 * share:.0f} %",
            f"{run.metrics['distance_m']:.2f}",
            verdict(run),
        )


def _whole(value: int, low: int, high: int, name: str) -> ipywidgets.IntSlider:
    style, layout = {"description_width": "12em"}, ipywidgets.Layout(width="28em")
    return ipywidgets.IntSlider(
        value=value, min=low, max=high, description=name, continuous_update=False, style=style, layout=layout
    )
