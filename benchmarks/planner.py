"""The tight formulation against the paper's, in one run.

    python benchmarks/planner.py [--cap 300] [--repeat 3]

Plans on flat ground to a proven gap of 0.1 %, 0.1 m of goal for each slot: five slots with feet only
and with wheels by the tight formulation, then the first of them by the paper's big-M program given to
SCIP with a time cap. Search times; building and compiling apart.
"""

import argparse
import statistics

from wfbook import terrain
from wfbook.planner import NoPlanError, Problem, solve


def problem(slots: int, wheels: bool) -> Problem:
    """Return the row's problem."""
    kinds = ("foot", "wheel") if wheels else ("foot",)
    return Problem(terrain.flat(), goal=(0.1 * slots, 0.0), slots=slots, end_effectors=kinds)


def found(meta: dict) -> str:
    """Return what a search found and proved, in words."""
    return (
        f"{meta['status']}, gap {100 * meta['gap']:.2f} %, {meta['nodes']} nodes,"
        f" objective {meta['objective']:.4f}, root bound {meta['root_bound']:.4f}"
    )


def main() -> None:
    """Print a row for each problem and formulation, and the ratio of the two."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--cap", type=float, default=300.0, help="time limit of the paper's formulation, seconds"
    )
    parser.add_argument(
        "--repeat", type=int, default=3, help="runs of the tight formulation, the median counts"
    )
    options = parser.parse_args()
    fast = None
    for slots, wheels in ((5, False), (5, True)):
        plans = [solve(problem(slots, wheels), time_limit=120.0) for _ in range(options.repeat)]
        search = statistics.median(plan.meta["solve_time"] for plan in plans)
        build = statistics.median(plan.meta["build_time"] for plan in plans)
        meta = plans[-1].meta
        name = f"{slots} slots, {'feet and wheels' if wheels else 'feet'}"
        print(f"tight  {name:24} search {search:7.2f} s  build {build:.2f} s  {found(meta)}", end="")
        print(f", {meta['relaxations']} QPs, {meta['leaves']} leaves", flush=True)
        fast = fast or (search, meta)
    try:
        meta = solve(problem(5, False), formulation="paper", time_limit=options.cap).meta
    except NoPlanError as error:
        print(f"paper  5 slots, feet            {error}")
        spent, reached = options.cap, False
    else:
        spent, reached = meta["solve_time"], meta["status"] == "optimal"
        name, build = "5 slots, feet", meta["build_time"]
        print(f"paper  {name:24} search {spent:7.2f} s  build {build:.2f} s  {found(meta)}")
    print(f"paper / tight: {'' if reached else 'more than '}{spent / fast[0]:.0f} times the search time")


if __name__ == "__main__":
    main()
