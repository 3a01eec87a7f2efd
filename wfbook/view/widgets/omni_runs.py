"""Chapter 12's widgets: waves with whatever disturbs, habits to leave out, and paper B's scenarios."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook.omni import simulate
from wfbook.omni.habits import Habits
from wfbook.omni.locked import nominal_target
from wfbook.omni.robot import NOMINAL_HEIGHT
from wfbook.omni.scenarios import SCENARIOS
from wfbook.omni.simulate import CONTROLLERS, Noise
from wfbook.omni.waves import PEAK, waves
from wfbook.terrain import flat
from wfbook.view.drawings import omni_runs as drawings
from wfbook.view.drawings.omni_wheels import driven
from wfbook.view.widgets.controls import choice, slider
from wfbook.view.widgets.searching import switch
from wfbook.view.widgets.simulating import Simulating, Told

if TYPE_CHECKING:
    from wfbook.omni.simulate import OmniRun

GROUNDS = ("one wave", "a push", "a circle")
"""What a :class:`Trip` can be: over the first wave; ahead, pushed from the side; round, on level ground."""

_WAVE, _PUSH, _CIRCLE = GROUNDS
_WAY, _START, _REST = 2.8, -0.4, 1.0
"""Length of the trip over the waves; where it begins, on level ground; seconds after a trip."""

_SHOVE = ([0.0, 150.0, 0.0], 0.5, 0.2)
_SHOWN = 4
"""Runs in one picture, at most."""

WHO = {"ddp": "whole body", "ik-level": "arm, level trunk", "ik-true": "arm, true trunk"}
"""Names of :data:`wfbook.omni.simulate.CONTROLLERS`."""


@dataclass(frozen=True)
class Trip:
    """A short run of the robot, and what makes it hard.

    Attributes:
        controller: one of :data:`wfbook.omni.simulate.CONTROLLERS`.
        low: whether the trunk is carried lower by half a wave's height.
        ground: one of :data:`GROUNDS`.
        count: of waves on the paper's 11.5 m.
        speed: over the waves.
        delay_ms: of what is measured.
        noise: of what is measured, times :class:`wfbook.omni.simulate.Noise`.
        payload: in the hand; nobody tells the controller.
        habits: of the whole-body controller.
    """

    controller: str = "ddp"
    low: bool = False
    ground: str = _WAVE
    count: int = 5
    speed: float = 1.0
    delay_ms: float = 0.0
    noise: float = 0.0
    payload: float = 0.0
    habits: Habits = field(default_factory=Habits)

    def __str__(self) -> str:
        """What differs from the plainest trip, in a few words."""
        hard = [f"{self.count} waves"] * (self.count != 5)
        hard += [f"{self.speed:.2f} m/s"] * (self.speed != 1.0)
        hard += [f"{self.delay_ms:.0f} ms"] * (self.delay_ms > 0.0)
        hard += [f"noise × {self.noise:.0f}"] * (self.noise > 0.0)
        hard += [f"{self.payload:.1f} kg"] * (self.payload > 0.0)
        low = " low" if self.low else ""
        return ", ".join([WHO[self.controller] + low, *hard, *lacks(self.habits)])


HABITS = {
    "predict": "predicts",
    "feed back": "feeds_back",
    "start warm": "starts_warm",
    "look ahead": "looks_ahead",
    "weigh": "weighs",
    "integrate": "integrates",
    "keep places": "keeps_places",
}
"""By label: what can be left out of :class:`wfbook.omni.habits.Habits`."""


def lacks(habits: Habits) -> list[str]:
    """Return what is left out, in words."""
    return [f"without {label}" for label, name in HABITS.items() if not getattr(habits, name)]


def travelled(trip: Trip, told: Told | None = None) -> "OmniRun":
    """Simulate a trip in MuJoCo."""
    height = NOMINAL_HEIGHT - (0.5 * PEAK if trip.low else 0.0)
    options: dict[str, Any] = {
        "controller": trip.controller,
        "target": nominal_target(height=height),
        "delay": 1e-3 * trip.delay_ms,
        "noise": Noise().times(trip.noise) if trip.noise else None,
        "payload": trip.payload,
        "habits": trip.habits,
        "progress": told,
        "rest": _REST * max(1.0, trip.speed),
    }
    if trip.ground == _PUSH:
        return simulate.run(flat(), [(2.0, [0.3, 0.0, 0.0])], push=_SHOVE, **options)
    if trip.ground == _CIRCLE:
        return simulate.run(flat(), [(3.0, [0.5, 0.0, 1.0])], **options)
    course = [(_WAY / trip.speed, [trip.speed, 0.0, 0.0])]
    return simulate.run(waves(trip.count), course, start=_START, **options)


def ending(run: "OmniRun") -> str:
    """Return how a run ended."""
    if not run.events:
        return "to the end"
    when, what = run.events[0]
    return f"{when:.2f} s: {what}"


class _Trips(Simulating):
    """What the two benches of trips share.

    Args:
        controls: of the trip.
        pictures: as for :class:`wfbook.view.widgets.panel.Panel`.
        known: runs that there are already, by trip.
        simulator: called with a :class:`Trip` and a function that it tells simulated and total time.
    """

    def __init__(
        self,
        controls: list,
        pictures: list[str],
        known: "dict[Trip, OmniRun] | None",
        simulator: "Callable[[Trip, Told], OmniRun]",
    ) -> None:
        self._simulator = simulator
        super().__init__(controls, pictures, self.COLUMNS, known)

    def run_of(self, asked: Trip, told: Told) -> "OmniRun":
        """Simulate a trip."""
        return self._simulator(asked, told)

    def beside(self, same: "Callable[[Trip], Any]") -> "dict[str, OmniRun]":
        """Return the run that is shown and the last others that are comparable with it, by name."""
        others = [trip for trip in self.results if trip != self.asked and same(trip) == same(self.asked)]
        trips = [self.asked, *others[::-1][: _SHOWN - 1]]
        return {str(trip): self.results[trip] for trip in trips}

    def said(self, run: "OmniRun") -> None:
        """Write how a run went above the pictures."""
        metrics = run.metrics
        weighed = run.meta["payload_estimate"]
        mass = "" if weighed is None else f" The payload was weighed: {weighed:.2f} kg."
        self.say(
            f"{self.asked}: {ending(run)}; the hand's height {1e3 * metrics['hand_height_mean_m']:.1f} "
            f"± {1e3 * metrics['hand_height_std_m']:.1f} mm, "
            f"{1e3 * metrics['hand_height_max_error_m']:.1f} mm off at most.{mass}"
        )


def _figures(run: "OmniRun") -> tuple[str, ...]:
    """Return a run's last columns."""
    metrics = run.metrics
    return (
        f"{1e3 * metrics['hand_height_std_m']:.1f}",
        f"{1e3 * metrics['hand_height_max_error_m']:.1f}",
        f"{1e3 * metrics['hand_level_max_error_m']:.1f}",
        f"{np.degrees(metrics['hand_turn_max_rad']):.1f}",
        ending(run),
    )


_COLUMNS = ("± (mm)", "height off (mm)", "sideways off (mm)", "turned (°)", "")


class WavesBench(_Trips):
    """Who holds the hand, over which waves, with what disturbs: *Simulate*, and compare.

    Args:
        known: runs that there are already, by trip.
        simulator: as for :func:`travelled`.

    Attributes:
        controller, trunk, count, speed, delay, noise, payload: controls.
    """

    COLUMNS = ("who", "trunk", "waves", "m/s", "delay", "noise", "payload", *_COLUMNS)

    def __init__(
        self,
        known: "dict[Trip, OmniRun] | None" = None,
        simulator: "Callable[[Trip, Told], OmniRun]" = travelled,
    ) -> None:
        self.controller = choice([(WHO[name], name) for name in CONTROLLERS], "ddp", "who holds the hand")
        heights = [(f"{NOMINAL_HEIGHT:.2f} m high", False), (f"{NOMINAL_HEIGHT - PEAK / 2:.2f} m high", True)]
        self.trunk = choice(heights, False, "trunk")
        self.count = choice((3, 5, 7, 9), 5, "waves on 11.5 m")
        self.speed = slider(1.0, 0.5, 1.5, 0.25, "speed (m/s)")
        self.delay = slider(0.0, 0.0, 40.0, 2.0, "delay (ms)")
        self.noise = slider(0.0, 0.0, 8.0, 1.0, "noise, times")
        self.payload = slider(0.0, 0.0, 5.0, 0.5, "payload (kg)")
        controls = [
            *(self.controller, self.trunk, self.count, self.speed),
            *(self.delay, self.noise, self.payload),
        ]
        super().__init__(controls, ["height"], known, simulator)

    @property
    def asked(self) -> Trip:
        """What the controls say."""
        return Trip(
            controller=self.controller.value,
            low=self.trunk.value,
            count=self.count.value,
            speed=self.speed.value,
            delay_ms=self.delay.value,
            noise=self.noise.value,
            payload=self.payload.value,
        )

    def preview(self) -> None:
        """Show what there is on these waves already."""
        self.say(f"{self.asked}: press Simulate.")
        others = [trip for trip in self.results if trip.count == self.asked.count]
        if others:
            runs = {str(trip): self.results[trip] for trip in others[::-1][:_SHOWN]}
            self.show("height", drawings.heights(runs), "heights of the hand in earlier runs")

    def draw(self, run: "OmniRun") -> None:
        """Show the hand's height beside that of other runs over the same waves."""
        self.said(run)
        picture = drawings.heights(self.beside(lambda trip: trip.count))
        self.show("height", picture, "height of the hand over the way, and magnified")

    def row(self, asked: Trip, run: "OmniRun") -> tuple[str, ...]:
        """Return a line of the table."""
        return (
            WHO[asked.controller],
            "low" if asked.low else "high",
            f"{asked.count}",
            f"{asked.speed:.2f}",
            f"{asked.delay_ms:.0f} ms",
            f"× {asked.noise:.0f}",
            f"{asked.payload:.1f} kg",
            *_figures(run),
        )


class HabitBench(_Trips):
    """A trip, and a controller that leaves out some habits: *Simulate*, and see what they are good for.

    Args:
        known: runs that there are already, by trip.
        simulator: as for :func:`travelled`.

    Attributes:
        ground, delay, noise, payload: controls.
        switches: by label, checkboxes of the habits.
    """

    COLUMNS = ("on", "without", "delay", "noise", "payload", *_COLUMNS)

    def __init__(
        self,
        known: "dict[Trip, OmniRun] | None" = None,
        simulator: "Callable[[Trip, Told], OmniRun]" = travelled,
    ) -> None:
        self.ground = choice(GROUNDS, _WAVE, "trip")
        self.delay = slider(12.0, 0.0, 40.0, 2.0, "delay (ms)")
        self.noise = slider(0.0, 0.0, 8.0, 1.0, "noise, times")
        self.payload = slider(0.0, 0.0, 5.0, 0.5, "payload (kg)")
        self.switches = {label: switch(label) for label in HABITS}
        controls = [self.ground, self.delay, self.noise, self.payload, *self.switches.values()]
        super().__init__(controls, ["errors"], known, simulator)

    @property
    def asked(self) -> Trip:
        """What the controls say."""
        kept = {name: self.switches[label].value for label, name in HABITS.items()}
        return Trip(
            ground=self.ground.value,
            delay_ms=self.delay.value,
            noise=self.noise.value,
            payload=self.payload.value,
            habits=Habits(**kept),
        )

    def preview(self) -> None:
        """Show what there is of this trip already."""
        self.say(f"{self.asked}: press Simulate.")
        others = [trip for trip in self.results if trip.ground == self.asked.ground]
        if others:
            runs = {str(trip): self.results[trip] for trip in others[::-1][:_SHOWN]}
            self.show("errors", drawings.errors(runs), "errors of the hand in earlier runs")

    def draw(self, run: "OmniRun") -> None:
        """Show the hand's error beside that of other runs of the same trip."""
        self.said(run)
        picture = drawings.errors(self.beside(lambda trip: trip.ground))
        self.show("errors", picture, "distance of the hand from where it should be, over time")

    def row(self, asked: Trip, run: "OmniRun") -> tuple[str, ...]:
        """Return a line of the table."""
        left = [text.removeprefix("without ") for text in lacks(asked.habits)]
        return (
            asked.ground,
            ", ".join(left) or "nothing",
            f"{asked.delay_ms:.0f} ms",
            f"× {asked.noise:.0f}",
            f"{asked.payload:.1f} kg",
            *_figures(run),
        )


@dataclass(frozen=True)
class Experiment:
    """One of paper B's experiments.

    Attributes:
        name: in :data:`wfbook.omni.scenarios.SCENARIOS`.
        delay_ms, noise, payload: as of a :class:`Trip`.
    """

    name: str = "combined"
    delay_ms: float = 0.0
    noise: float = 0.0
    payload: float = 0.0

    def __str__(self) -> str:
        """Its name, and what disturbs."""
        hard = str(Trip(delay_ms=self.delay_ms, noise=self.noise, payload=self.payload))
        return f"{self.name}{hard.removeprefix(WHO['ddp'])}"


def done(experiment: Experiment, told: Told | None = None) -> "OmniRun":
    """Simulate an experiment in MuJoCo."""
    return SCENARIOS[experiment.name].run(
        delay=1e-3 * experiment.delay_ms,
        noise=Noise().times(experiment.noise) if experiment.noise else None,
        payload=experiment.payload,
        progress=told,
    )


class ScenarioBench(Simulating):
    """Choose an experiment of paper B, press *Simulate*, and see the hand's pose over time, beside the paper.

    Args:
        known: runs that there are already, by experiment.
        simulator: called with an :class:`Experiment` and a function that it tells simulated and total time.

    Attributes:
        name, delay, noise, payload: controls.
    """

    COLUMNS = ("what", "where", "height (m)", *_COLUMNS)

    def __init__(
        self,
        known: "dict[Experiment, OmniRun] | None" = None,
        simulator: "Callable[[Experiment, Told], OmniRun]" = done,
    ) -> None:
        self._simulator = simulator
        names = [(f"{name}: {each.title}", name) for name, each in SCENARIOS.items()]
        self.name = choice(names, "combined", "experiment")
        self.name.layout.width = "40em"
        self.delay = slider(0.0, 0.0, 40.0, 2.0, "delay (ms)")
        self.noise = slider(0.0, 0.0, 8.0, 1.0, "noise, times")
        self.payload = slider(0.0, 0.0, 5.0, 0.5, "payload (kg)")
        controls = [self.name, self.delay, self.noise, self.payload]
        super().__init__(controls, ["pose", "way"], self.COLUMNS, known)

    @property
    def asked(self) -> Experiment:
        """What the controls say."""
        return Experiment(self.name.value, self.delay.value, self.noise.value, self.payload.value)

    def run_of(self, asked: Experiment, told: Told) -> "OmniRun":
        """Simulate an experiment."""
        return self._simulator(asked, told)

    def preview(self) -> None:
        """Say what it is."""
        scenario = SCENARIOS[self.name.value]
        self.say(f"{scenario.where}: {scenario.title}. Press Simulate.")

    def draw(self, run: "OmniRun") -> None:
        """Show the hand's pose over time, and the robot's way from above."""
        metrics = run.metrics
        self.say(
            f"{self.asked}, {SCENARIOS[self.asked.name].where}: {ending(run)}; "
            f"{metrics['way_m']:.2f} m of way, the hand at most "
            f"{1e3 * metrics['hand_height_max_error_m']:.1f} mm too high or too low."
        )
        self.show("pose", drawings.hand_pose(run), "place and turn of the hand over time")
        self.show("way", driven({str(self.asked): run}), "the way from above, and the hand's height")

    def row(self, asked: Experiment, run: "OmniRun") -> tuple[str, ...]:
        """Return a line of the table."""
        metrics = run.metrics
        return (
            str(asked),
            SCENARIOS[asked.name].where,
            f"{metrics['hand_height_mean_m']:.4f}",
            *_figures(run),
        )
