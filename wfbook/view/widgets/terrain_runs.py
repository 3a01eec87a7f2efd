"""Chapter 8's widgets: journeys over terrains, a tracker to break, margins, a small study, and windows."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from wfbook import planner, simulate
from wfbook import terrain as ground
from wfbook.lean import BY
from wfbook.paper.bench import Execution
from wfbook.quoted import value
from wfbook.tracking import Habits
from wfbook.view import figures, paper
from wfbook.view.replay import Replay
from wfbook.view.widgets.controls import choice, slider
from wfbook.view.widgets.searching import switch
from wfbook.view.widgets.simulating import Simulating, Told, verdict

if TYPE_CHECKING:
    from wfbook.planner import Plan
    from wfbook.simulate import Run

JOURNEYS = ("one metre in 3 s", "as far as possible in 4.5 s", "9 s, from rest to rest")
"""The book's short plans, and those of Paper A's sections IV-B and IV-C."""

_SHORT, _FAR, _LONG = JOURNEYS
_STORED = {
    **{(name, _SHORT, False): name for name in ground.BUILTIN_NAMES},
    ("flat", _SHORT, True): "flat-feet",
    ("flat-friction", _SHORT, True): "flat-feet",
    ("flat", _FAR, False): "far",
    ("flat", _FAR, True): "far-feet",
    ("flat-friction", _FAR, False): "far-friction",
    ("flat-friction", _FAR, True): "far-feet",
    ("flat", _LONG, False): "long",
    ("flat", _LONG, True): "long-feet",
    ("flat-friction", _LONG, False): "long-friction",
    ("flat-friction", _LONG, True): "long-feet",
}
"""Names of the stored plans, by terrain, way and whether they use feet alone. Rolling friction is nothing to
feet, so that their plan is the same with it."""

_CASES = {("flat", True): "feet", ("flat", False): "both", ("flat-friction", False): "friction"}
_FIGURES = dict(zip(ground.BUILTIN_NAMES, range(8, 13), strict=True))
_NOTHING = "–"


@dataclass(frozen=True)
class Journey:
    """A stored plan, and how it is executed.

    Attributes:
        terrain: name of a built-in one.
        way: one of :data:`JOURNEYS`.
        feet_only: whether the plan may use feet alone.
        habits: of the tracker.
        delay_ms: of the torques.
        push: in newtons, to the left, for 0.2 s.
        push_start: in seconds after the plan's start.
    """

    terrain: str = "flat"
    way: str = _SHORT
    feet_only: bool = False
    habits: Habits = field(default_factory=Habits)
    delay_ms: float = 9.0
    push: float = 0.0
    push_start: float = 0.5

    @property
    def stored(self) -> str | None:
        """Name of the stored plan; None if there is none."""
        return _STORED.get((self.terrain, self.way, self.feet_only))

    def plan(self, relaxed: bool = False) -> "Plan":
        """Return the plan, on this terrain.

        Raises:
            ValueError: there is none.
        """
        if self.stored is None:
            raise ValueError(f"no plan is stored for {self.terrain}, {self.way}, feet only: {self.feet_only}")
        return replace(planner.stored(self.stored, relaxed), terrain=ground.builtin(self.terrain))

    @property
    def hold(self) -> float:
        """Time to stand at the end; a plan that goes as far as possible ends in motion."""
        return 0.0 if self.way == _FAR else 0.5


def travelled(journey: Journey, told: Told | None = None) -> "Run":
    """Execute a journey in MuJoCo, with the true state."""
    push = np.array([0.0, journey.push, 0.0]), journey.push_start, 0.2
    return simulate.run(
        journey.plan(),
        delay=1e-3 * journey.delay_ms,
        hold=journey.hold,
        habits=journey.habits,
        push=push if journey.push else None,
        progress=told,
    )


class TerrainRuns(Simulating):
    """Choose terrain, way and end effectors; see the plan, press *Simulate*, and compare with the paper.

    Args:
        known: runs that there are already, by journey.
        simulator: called with a :class:`Journey` and a function that it tells simulated and total time.

    Attributes:
        terrain, way, ends: controls.
    """

    COLUMNS = (
        *("terrain", "on", "plan (m)", "went (m)", "m/s", "paper, m/s", "CoT |τω|", "CoT positive"),
        *("paper, CoT", "error (mm)", ""),
    )

    def __init__(
        self,
        known: "dict[Journey, Run] | None" = None,
        simulator: "Callable[[Journey, Told], Run]" = travelled,
    ) -> None:
        self._simulator = simulator
        self.terrain = choice(ground.BUILTIN_NAMES, "flat", "terrain")
        self.way = choice(JOURNEYS, _SHORT, "way")
        self.ends = choice((("feet and wheels", False), ("feet only", True)), False, "stands on")
        super().__init__([self.terrain, self.way, self.ends], ["gait", "work"], self.COLUMNS, known)

    @property
    def asked(self) -> Journey | None:
        """The journey that the controls say; None if no plan of it is stored."""
        journey = Journey(self.terrain.value, self.way.value, self.ends.value)
        return journey if journey.stored else None

    def run_of(self, asked: Journey, told: Told) -> "Run":
        """Simulate a journey."""
        return self._simulator(asked, told)

    def preview(self) -> None:
        """Show the plan, posed as it is written."""
        self.button.disabled = self.asked is None
        if self.asked is None:
            command = f"python -m wfbook run {self.terrain.value}" + " --feet-only" * self.ends.value
            self.say(f"No such plan comes with the book. To search for one: {command}")
            return
        plan = self.asked.plan()
        self.say(
            f"The plan goes {plan.distance:.2f} m in {plan.t[-1]:.1f} s: press Simulate to see it executed."
        )
        self.replay.value = Replay(plan, height=380)._repr_html_()
        self.show("gait", figures.gait(plan, self._title("as planned")), "gait as planned")

    def draw(self, run: "Run") -> None:
        """Show gait and work of a run."""
        self.button.disabled = False
        metrics, plan = run.metrics, self.asked.plan()
        kept = Execution.of(run)
        cost = "" if metrics["cot_abs"] is None else f", cost of transport {metrics['cot_abs']:.3f}"
        went = f"{metrics['distance_m']:.2f} of {metrics['planned_distance_m']:.2f} m"
        self.say(f"{verdict(run)}: {went}, {metrics['speed_m_s']:.2f} m/s{cost}.")
        self.show("gait", paper.gait(plan, kept, self._title("planned and executed")), "gait of plan and run")
        picture = paper.transport({"on feet" if self.ends.value else "on feet and wheels": kept})
        self.show("work", picture, "work of the motors and way of the robot over time")

    def _title(self, what: str) -> str:
        figure = f"; compare Fig. {_FIGURES[self.terrain.value]}" if self.way.value == _SHORT else ""
        return f"{self.terrain.value}, {what}{figure if not self.ends.value else ''}"

    def row(self, asked: Journey, run: "Run") -> tuple[str, ...]:
        """Return a line of the table; a cost only where the run begins and ends at rest."""
        metrics, case = run.metrics, _CASES.get((asked.terrain, asked.feet_only))
        costs = [metrics["cot_abs"], metrics["cot_positive"]]
        rest = asked.way != _FAR and metrics["upright"]
        return (
            f"{asked.terrain}, {asked.way}",
            "feet" if asked.feet_only else "both",
            f"{metrics['planned_distance_m']:.2f}",
            f"{metrics['distance_m']:.2f}",
            f"{metrics['speed_m_s']:.2f}",
            f"{value(f'{case}.speed'):.2f}" if case and asked.way == _FAR else _NOTHING,
            *(f"{cost:.3f}" if rest and cost is not None else _NOTHING for cost in costs),
            f"{value(f'{case}.cot'):.3f}" if asked.way == _LONG and case in ("feet", "both") else _NOTHING,
            f"{1e3 * metrics['base_rms_m']:.1f}",
            verdict(run),
        )


HABITS = {
    "interpolate": "interpolates",
    "one delay ahead": "foresees",
    "land early": "lands_early",
    "feel the ground": "feels",
    "step aside": "steps_aside",
}
"""By label: what can be left out of :class:`wfbook.tracking.Habits`."""

_PLANS = {"walk": ("flat", True), "roll": ("flat", False)}
_PLANS |= {name: (name, False) for name in ("ramp-down", "ramp-up", "stepping-stones")}


class TrackerBench(Simulating):
    """A plan, and a tracker that leaves out some of its habits: *Simulate*, and see what they are good for.

    Args:
        known: runs that there are already, by journey.
        simulator: as for :class:`TerrainRuns`.

    Attributes:
        plan: control, which plan.
        switches: by name, checkboxes of the habits.
        leans: control, by what the trunk leans.
        delay, push: controls.
    """

    COLUMNS = ("plan", "without", "delay", "push", "CoM error (mm)", "tilt (°)", "slip (mm)", "CoT |τω|", "")

    def __init__(
        self,
        known: "dict[Journey, Run] | None" = None,
        simulator: "Callable[[Journey, Told], Run]" = travelled,
    ) -> None:
        self._simulator = simulator
        self.plan = choice(tuple(_PLANS), "walk", "plan")
        self.switches = {name: switch(name) for name in HABITS}
        leans = {"hips": "with the ground under the hips", "contacts": "with the plane through the contacts"}
        self.leans = choice([(leans.get(by, "not at all"), by) for by in BY], "hips", "the trunk leans")
        self.delay = slider(9.0, 0.0, 30.0, 1.0, "delay (ms)")
        self.push = slider(0.0, -60.0, 60.0, 10.0, "push to the left (N)")
        controls = [self.plan, self.leans, self.delay, self.push, *self.switches.values()]
        super().__init__(controls, ["gait", "tracking"], self.COLUMNS, known)

    @property
    def asked(self) -> Journey:
        """What the controls say."""
        terrain, feet_only = _PLANS[self.plan.value]
        kept = {name: self.switches[label].value for label, name in HABITS.items()}
        habits = Habits(**kept, leans=self.leans.value)
        return Journey(terrain, _SHORT, feet_only, habits, self.delay.value, self.push.value)

    def run_of(self, asked: Journey, told: Told) -> "Run":
        """Simulate a journey."""
        return self._simulator(asked, told)

    def preview(self) -> None:
        """Show the plan's gait."""
        self.say("Press Simulate.")
        self.show("gait", figures.gait(self.asked.plan()), "gait as planned")

    def draw(self, run: "Run") -> None:
        """Show gait and errors of a run."""
        self.say(f"{_without(self.asked.habits)}: {verdict(run)}.")
        picture = paper.gait(self.asked.plan(), Execution.of(run), "planned and executed")
        self.show("gait", picture, "gait as planned and as executed")
        self.show("tracking", figures.tracking(run), "errors of the centre of mass and of the attitude")

    def row(self, asked: Journey, run: "Run") -> tuple[str, ...]:
        """Return a line of the table."""
        metrics = run.metrics
        going = run.t >= 0.0
        error = 1e3 * np.linalg.norm((run.com - run.com_ref)[going], axis=1).max(initial=0.0)
        tilt = np.degrees(np.abs((run.rpy - run.rpy_ref)[going, :2]).max(initial=0.0))
        cost = metrics["cot_abs"] if metrics["upright"] else None
        return (
            next(name for name, plan in _PLANS.items() if plan == (asked.terrain, asked.feet_only)),
            _without(asked.habits).removeprefix("without "),
            f"{asked.delay_ms:.0f} ms",
            f"{asked.push:.0f} N",
            f"{error:.1f}",
            f"{tilt:.1f}",
            f"{1e3 * metrics['slip_max_m']:.1f}",
            _NOTHING if cost is None else f"{cost:.3f}",
            verdict(run),
        )


def _without(habits: Habits) -> str:
    left = [label for label, name in HABITS.items() if not getattr(habits, name)]
    if habits.leans != "hips":
        left.append("leaning" if habits.leans == "nothing" else "hips (leans by the contacts)")
    return f"without {', '.join(left)}" if left else "without nothing"
