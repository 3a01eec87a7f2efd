"""Is what the search proves true? Random small problems against a branch and bound without any shortcut.

    python benchmarks/soundness.py [--count 100] [--seed 0] [--time-limit 60]

One to three regions, two to five slots, one and two end effectors. An instance agrees if both searches find
it infeasible, or if the planner's bound is not above the other's optimum and its plan not more than the
gap above it. Exit code 1 if one does not agree; what a time limit leaves open is counted apart.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from plain_search import draw, judge


def main() -> int:
    """Judge the instances, print a line for each and the counts, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--time-limit", type=float, default=60.0, help="of each plain search, in seconds")
    options = parser.parse_args()
    words: Counter[str] = Counter()
    columns = "  # regions groups slots kinds swings crossings  objective      bound      other  nodes     s"
    print(f"{columns} other s")
    for i in range(options.count):
        problem = draw(np.random.default_rng([options.seed, i]), both=i % 2 == 1)
        found = judge(problem, options.time_limit)
        words[found.word] += 1
        print(
            f"{i:3} {problem.ground.count:7} {len(problem.ground.groups):6} {problem.slots:5}"
            f" {len(problem.end_effectors):5} {found.swings:6} {found.crossings:9} {found.objective:10.6f}"
            f" {found.bound:10.6f} {found.optimum:10.6f} {found.nodes:6} {found.times[0]:5.1f}"
            f" {found.times[1]:7.1f}{'' if found.word == 'agrees' else '  <-- ' + found.word}",
            flush=True,
        )
    print(", ".join(f"{count} {word}" for word, count in words.items()))
    return 1 if words["disagrees"] else 0


if __name__ == "__main__":
    sys.exit(main())
