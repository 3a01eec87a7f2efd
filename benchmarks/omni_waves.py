"""Paper B's Fig. 6 at three wave counts, against both baselines: python benchmarks/omni_waves.py.

Each row is of several seeds: the hand's height, mean and standard deviation over all samples, the largest
error from 0.92 m, and how many of the runs ended before the waves did: those are not averaged. Undisturbed
runs are all the same, so there is one of each. The disturbed ones see everything 12 ms late and with noise,
and carry 1 kg in the hand and 10 % more trunk that nobody told the controller of.
"""

import argparse
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from wfbook.omni.simulate import CONTROLLERS, Noise, run_waves

COUNTS, SEEDS = (3, 5, 7), 5
CONDITIONS = {
    "0.5 m/s": {"speed": 0.5},
    "1 m/s": {"speed": 1.0},
    "1 m/s, disturbed": {
        "speed": 1.0,
        "delay": 0.012,
        "noise": Noise(),
        "payload": 1.0,
        "trunk_mass_scale": 1.1,
    },
}


@dataclass(frozen=True)
class Case:
    """One run."""

    condition: str
    count: int
    controller: str
    seed: int

    def run(self) -> tuple["Case", dict[str, float], bool]:
        """Return the case, its metrics, and whether the robot got to the end."""
        options = CONDITIONS[self.condition]
        metrics = run_waves(count=self.count, controller=self.controller, seed=self.seed, **options).metrics
        return self, metrics, metrics["finished"]


def cases(seeds: int) -> list[Case]:
    """Return what there is to run."""
    return [
        Case(condition, count, controller, seed)
        for condition, options in CONDITIONS.items()
        for count in COUNTS
        for controller in CONTROLLERS
        for seed in range(seeds if "noise" in options else 1)
    ]


def row(case: Case, runs: list[tuple[dict[str, float], bool]]) -> str:
    """Return a line of the table."""
    done = [metrics for metrics, finished in runs if finished]
    label = f"{case.condition:17s} {case.count:2d} waves  {case.controller:9s} {len(runs):2d} runs"
    label += f"  {len(runs) - len(done):2d} ended early"
    if not done:
        return label

    def of(name: str) -> np.ndarray:
        return np.array([metrics[name] for metrics in done])

    spread = 1e3 * of("hand_height_std_m")
    text = f"{label}  {of('hand_height_mean_m').mean():.4f} m"
    text += f"  std {spread.mean():6.2f} (worst {spread.max():6.2f})"
    text += f"  max {1e3 * of('hand_height_max_error_m').max():6.2f} mm "
    for angle in ("roll", "pitch", "yaw"):
        mean, std = of(f"hand_{angle}_mean_rad").mean(), of(f"hand_{angle}_std_rad").mean()
        text += f"  {mean:.3f} ± {std:.4f}"
    return text


def report(results: Iterable[tuple[Case, dict[str, float], bool]]) -> None:
    """Print each line as soon as its runs are there."""
    for _, runs in groupby(results, key=lambda result: replace(result[0], seed=0)):
        runs = list(runs)
        print(row(runs[0][0], [(metrics, finished) for _, metrics, finished in runs]), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description="The hand's height over waves, in mm, and its angles, in rad."
    )
    parser.add_argument(
        "--quick", dest="seeds", action="store_const", const=1, default=SEEDS, help="one seed"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    arguments = parser.parse_args()
    todo = cases(arguments.seeds)
    if arguments.jobs > 1:
        with ProcessPoolExecutor(arguments.jobs) as pool:
            report(pool.map(Case.run, todo))
    else:
        report(map(Case.run, todo))
