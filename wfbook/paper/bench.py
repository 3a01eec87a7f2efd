"""Where the experiments plan and simulate: every search and every run goes through here and is kept."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wfbook import archive, planner
from wfbook.go1_dynamics import MOTORS
from wfbook.paper.drives import Drive
from wfbook.paper.options import Options
from wfbook.paper.store import Store
from wfbook.planner import Plan, Problem
from wfbook.quoted import value
from wfbook.report import percent, plain, search_line
from wfbook.table2 import trial
from wfbook.table2.trial import Trial

if TYPE_CHECKING:
    from wfbook.simulate import Run

DELAY = value("delay") / 1e3
"""The paper's delay between commanded and acting torques, in seconds."""

LONG = 20
"""Slots beyond which a first plan is found in overlapping windows: the search of the whole finds none."""

SWINGING = 2
"""Mode of a leg that touches nothing, beside 0, on its foot, and 1, on its wheel."""

_PLACED = ("start_end_effectors", "swing_height", "com_height", "regions")
"""Entries of a plan's ``meta`` that say how it is executed."""

_EVERY = 5  # samples of a run between two that are kept: 100 Hz
_FORMAT = 1


@dataclass(frozen=True)
class Planned:
    """A gait with its relaxed motion and its polish, which is executed."""

    relaxed: Plan
    polished: Plan

    @property
    def proof(self) -> str:
        """What the search proved."""
        meta = self.relaxed.meta
        return f"gap {percent(meta['gap'])} ({meta['status']}, {meta['solve_time']:.1f} s)"


@dataclass(frozen=True)
class Execution:
    """What is kept of a run: every fifth sample of the log, ``N`` of them, and all figures of merit.

    Attributes:
        t: ``(N,)`` time, 0 when the plan begins.
        com: ``(N, 3)`` centre of mass.
        modes: ``(N, 4)`` int8: 0 on its foot, 1 on its wheel, 2 in the air.
        work: ``(N, 2)`` work of the motors since the plan began: absolute, and the positive part alone.
        metrics: of the run.
        meta: seed and state.
    """

    ARRAYS: ClassVar[tuple[str, ...]] = ("t", "com", "modes", "work")

    t: np.ndarray
    com: np.ndarray
    modes: np.ndarray
    work: np.ndarray
    metrics: dict[str, Any]
    meta: dict[str, Any]

    @classmethod
    def of(cls, run: "Run") -> "Execution":
        """Return what is kept of a run."""
        power = run.tau * run.qvel[:, MOTORS] * (run.t >= 0.0)[:, None]
        parts = np.column_stack((np.abs(power).sum(axis=1), np.maximum(power, 0.0).sum(axis=1)))
        work = np.cumsum(parts * np.gradient(run.t)[:, None], axis=0)
        modes = np.where(run.in_contact, run.end_effector, SWINGING).astype(np.int8)
        kept = slice(None, None, _EVERY)
        meta = {name: run.meta[name] for name in ("seed", "state", "delay")}
        return cls(run.t[kept], run.com[kept], modes[kept], work[kept], plain(run.metrics), meta)

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        texts = {"metrics": self.metrics, "meta": self.meta}
        archive.save(path, {name: getattr(self, name) for name in self.ARRAYS}, texts, _FORMAT)

    @classmethod
    def load(cls, path: Path) -> "Execution":
        """Read the file."""
        return cls(**archive.load(path, "execution", cls.ARRAYS, ("metrics", "meta"), _FORMAT))


@dataclass
class Bench:
    """Plans, simulates and times, with one set of options; what was done before is read from the store.

    Attributes:
        store: of results.
        options: of all experiments.
        show: called now and then with a line of text.
        head: what the lines begin with.
        troubles: what could not be planned, and who fell, a sentence each.
    """

    store: Store
    options: Options = field(default_factory=Options)
    show: Callable[[str], None] = lambda text: None
    head: str = ""
    troubles: list[str] = field(default_factory=list)

    def plan(self, problem: Problem, label: str) -> Planned | None:
        """Return the best plan that can be executed; None, with a note in ``troubles``, if there is none.

        Args:
            problem: what is asked.
            label: of it, for the reader.

        Raises:
            KeyboardInterrupt: interrupted; what was found so far is not kept, for it would pass for the
                result of a whole search.
        """
        options = {"gap": self.options.gap, "time_limit": self.options.time_limit}
        search = planner.solve_windows if problem.slots > LONG else planner.solve_executable

        def make() -> Planned:
            self._say(f"{label}: planning")
            found = search(
                problem, **options, progress=lambda now: self._say(f"{label}: planning {search_line(now)}")
            )
            if found[0].meta["status"] == "interrupted":
                raise KeyboardInterrupt
            return Planned(*found)

        definition = {"problem": problem, "options": options, "search": search.__name__}
        try:
            return self.store.get("plan", definition, make, _read_planned, _write_planned)
        except (planner.InfeasibleError, planner.NoPlanError) as error:
            if str(error).startswith("interrupted"):  # before a gait that can be executed
                raise KeyboardInterrupt from None
            self.troubles.append(f"{label}: {' '.join(str(error).split())}")
            return None

    def execute(self, plan: Plan, label: str, hold: float = 1.0) -> list[Execution]:
        """Return runs of a polished plan, one for each seed.

        Args:
            plan: what is executed.
            label: of it, for the reader.
            hold: time to stand at the end.
        """
        runs = []
        for seed in range(self.options.seeds):
            options = {"delay": DELAY, "state": self.options.state, "hold": hold, "seed": seed}
            definition = {"plan": _executed(plan), "terrain": plan.terrain, "options": options}

            def make(options: dict[str, Any] = options) -> Execution:
                from wfbook import simulate

                name = f"{label}: simulating, seed {options['seed']}"
                progress = lambda now, end: self._say(f"{name}, {now:5.2f} of {end:.2f} s")  # noqa: E731
                return Execution.of(simulate.run(plan, **options, progress=progress))

            runs.append(
                self.store.get("run", definition, make, Execution.load, lambda run, path: run.save(path))
            )
        self.troubles += [
            f"{label}: fell at {run.metrics['fall_time_s']:.2f} s, seed {run.meta['seed']}"
            for run in runs
            if not run.metrics["upright"]
        ]
        return runs

    def time(self, asked: Trial, label: str) -> dict[str, Any]:
        """Return the outcome of a timed search (see :mod:`wfbook.table2.trial`)."""

        def make() -> dict[str, Any]:
            return trial.run(asked, lambda text: self._say(f"{label}: searching {text}"))

        def read(path: Path) -> dict[str, Any]:
            return archive.load(path, "trial", (), ("meta",), _FORMAT)["meta"]

        definition = {"trial": asked}
        return self.store.get(
            "trial",
            definition,
            make,
            read,
            lambda found, path: archive.save(path, {}, {"meta": found}, _FORMAT),
        )

    def drive(self, name: str, label: str, seeds: int | None = None, **options: Any) -> list[Drive]:
        """Return runs of an experiment of part II, one for each seed.

        Args:
            name: of the scenario.
            label: of it, for the reader.
            seeds: how many; those of the options without it.
            options: of the scenario.
        """
        noisy = self.options.state == "estimated"
        runs = []
        for seed in range(self.options.seeds if seeds is None else min(seeds, self.options.seeds)):
            definition = {"scenario": name, "delay": DELAY, "noise": noisy, "seed": seed} | options

            def make(seed: int = seed) -> Drive:
                from wfbook.omni.scenarios import SCENARIOS
                from wfbook.omni.simulate import Noise

                head = f"{label}: simulating, seed {seed}"
                known = {"delay": DELAY, "noise": Noise() if noisy else None, "seed": seed}
                progress = lambda now, end: self._say(f"{head}, {now:5.2f} of {end:.2f} s")  # noqa: E731
                return Drive.of(SCENARIOS[name].run(**known, **options, progress=progress))

            runs.append(
                self.store.get("drive", definition, make, Drive.load, lambda run, path: run.save(path))
            )
        self.troubles += [
            f"{label}: {run.metrics['events'][0]}, seed {run.meta['seed']}"
            for run in runs
            if not run.metrics["finished"]
        ]
        return runs

    def solve(self, label: str) -> dict[str, Any]:
        """Return how long the optimal control problem of part II takes (see :mod:`.solving`)."""

        def make() -> dict[str, Any]:
            from wfbook.paper import solving

            self._say(f"{label}: solving")
            return solving.measure()

        def read(path: Path) -> dict[str, Any]:
            return archive.load(path, "solution times", (), ("meta",), _FORMAT)["meta"]

        return self.store.get(
            "solve", {}, make, read, lambda found, path: archive.save(path, {}, {"meta": found}, _FORMAT)
        )

    @property
    def settings(self) -> dict[str, Any]:
        """What holds for all simulations and searches, for the record."""
        kept = asdict(self.options) | {"delay_ms": 1e3 * DELAY, "seeds": list(range(self.options.seeds))}
        return kept | {"table2": self.options.table2 and str(self.options.table2)}

    def _say(self, text: str) -> None:
        self.show(self.head + text)


def proof(planned: Planned, runs: Sequence[Execution] = ()) -> str:
    """Return what a value rests on: the search, and the runs if it is measured in them."""
    if not runs:
        return planned.proof
    seeds = ", ".join(str(run.meta["seed"]) for run in runs)
    return f"{planned.proof}; {'seed' if len(runs) == 1 else 'seeds'} {seeds}, {runs[0].meta['state']} state"


def _executed(plan: Plan) -> dict[str, Any]:
    """Return what a run of a plan depends on; not how long its search took, or what it proved."""
    arrays = {f.name: getattr(plan, f.name) for f in fields(plan) if f.name not in ("terrain", "meta")}
    return arrays | {name: plan.meta.get(name) for name in _PLACED}


def _relaxed_of(path: Path) -> Path:
    return path.with_name(path.stem + "-relaxed.npz")


def _read_planned(path: Path) -> Planned:
    return Planned(Plan.load(_relaxed_of(path)), Plan.load(path))


def _write_planned(planned: Planned, path: Path) -> None:
    """Write both plans; the second name makes the pair complete."""
    planned.relaxed.save(_relaxed_of(path))
    planned.polished.save(path)
