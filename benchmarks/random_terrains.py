"""Plan on seeded random terrains and check every plan with the tests' independent checker.

    python benchmarks/random_terrains.py [--count 200] [--seed 0] [--gap 0.05] [--time-limit 10]

Each terrain is planned or proven infeasible; what the time limit leaves without an answer is counted apart.
Exit code 1 if a plan violates an equation, or if an answer is wrong for the ground under the start posture.
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from terrain_cases import attempt, random_problem


def main() -> int:
    """Print one line for each terrain and the counts, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0, help="terrain i has seed SEED + i")
    parser.add_argument("--gap", type=float, default=0.05)
    parser.add_argument("--time-limit", type=float, default=10.0, help="of each search, in seconds")
    options = parser.parse_args()
    outcomes, wrong = Counter(), 0
    print(
        f"{'seed':>5} {'regions':>7} {'slots':>5} {'effectors':10} {'outcome':11} {'s':>6}  terrain",
        flush=True,
    )
    for seed in range(options.seed, options.seed + options.count):
        rng = np.random.default_rng(seed)
        problem = random_problem(rng, slots=int(rng.integers(3, 5)))
        begin = time.perf_counter()
        outcome, complaints = attempt(problem, options.gap, options.time_limit)
        spent = time.perf_counter() - begin
        outcomes[outcome] += 1
        wrong += bool(complaints)
        kinds, terrain = "+".join(problem.end_effectors), problem.terrain
        print(
            f"{seed:5} {len(terrain.regions):7} {problem.slots:5} {kinds:10} {outcome:11} {spent:6.2f}"
            f"  {terrain.name}{'  <-- wrong' if complaints else ''}",
            flush=True,
        )
        for complaint in complaints[:5]:
            print(f"      {complaint}", flush=True)
    print(", ".join(f"{outcomes[name]} {name}" for name in ("planned", "infeasible", "no answer")), end="")
    print(f" of {options.count}; {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
