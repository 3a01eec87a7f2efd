"""What the planner decides on each terrain (Paper A, IV-A), and how fast wheels make it (IV-B).

    python benchmarks/behaviours.py [--terrains] [--speed] [--time-limit 60]

IV-A: ten slots on each of the five terrains, one set of weights; the gait is printed leg by leg, ``.`` for a
foot, ``o`` for a wheel and ``^`` for a swing, with the region each leg is in. IV-B: 4.5 s to a goal out of
reach, feet only, both without rolling friction, and both with it: distances and their ratios.
"""

import argparse

import numpy as np

from wfbook import terrain
from wfbook.modes import LEGS
from wfbook.planner import Limits, NoPlanError, Plan, Problem, solve

PAPER_DISTANCE = {"feet": 1.43, "both": 3.4, "both, friction": 2.5}
FAR = (10.0, 0.0)
STRIDE = Limits(step=(0.185, 0.15))
"""IV-B: with steps of 0.185 m feet come as far as the paper's 1.43 m; it gives neither step nor speed."""

LEAP = Limits(step=(0.50, 0.15))
"""IV-A.5: the paper's longest step on the stones."""


def drawn(plan: Plan) -> list[str]:
    """Return a line for each leg: what it does in each slot, and the regions under it."""
    lines = []
    regions = np.array(plan.meta["regions"])
    for leg, name in enumerate(LEGS):
        row = zip(plan.S[leg], plan.end_effector[leg], strict=True)
        kinds = "".join("^" if swings else ".o"[kind] for swings, kind in row)
        lines.append(f"    {name} {kinds}   regions {''.join(map(str, regions[leg]))}")
    return lines


def proved(plan: Plan) -> str:
    """Return what was found and proven, in words."""
    meta = plan.meta
    return (
        f"objective {meta['objective']:.3f}, gap {100 * meta['gap']:.2f} % ({meta['status']},"
        f" {meta['solve_time']:.1f} s, {meta['nodes']} nodes)"
    )


def terrains(time_limit: float) -> None:
    """Plan on each terrain and print its gait."""
    for name in terrain.BUILTIN_NAMES:
        limits = LEAP if name == "stepping-stones" else Limits()
        problem = Problem(terrain.builtin(name), goal=(1.0, 0.0), slots=10, limits=limits)
        try:
            plan = solve(problem, time_limit=time_limit)
        except NoPlanError as error:
            print(f"{name}: {error}", flush=True)
            continue
        wheels = (plan.end_effector * (1 - plan.S)).sum() / (1 - plan.S).sum()
        print(
            f"{name}: {plan.distance:.3f} m, {plan.S.sum()} swings, {100 * wheels:.0f} % of stance on wheels"
        )
        print(f"    {proved(plan)}", *drawn(plan), sep="\n", flush=True)


def speed(time_limit: float) -> None:
    """Plan to a goal out of reach three times and print distances and ratios."""
    cases = {
        "feet": (("foot",), "flat"),
        "both": (("foot", "wheel"), "flat"),
        "both, friction": (("foot", "wheel"), "flat-friction"),
    }
    first = None
    for name, (kinds, ground) in cases.items():
        problem = Problem(
            terrain.builtin(ground),
            goal=FAR,
            slots=15,
            end_effectors=kinds,
            final_stance=False,
            beyond_reach=True,
            limits=STRIDE,
        )
        plan = solve(problem, gap=1e-3, time_limit=time_limit)
        first = first or plan.distance
        paper = PAPER_DISTANCE[name]
        print(
            f"{name:15} {plan.distance:.2f} m in 4.5 s, {plan.distance / first:.2f} times feet only"
            f" (paper {paper} m, {paper / PAPER_DISTANCE['feet']:.2f}); {proved(plan)}"
        )
        print(*drawn(plan), sep="\n", flush=True)


def main() -> None:
    """Run what is asked for, by default both."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--terrains", action="store_true", help="section IV-A only")
    parser.add_argument("--speed", action="store_true", help="section IV-B only")
    parser.add_argument("--time-limit", type=float, default=60.0, help="of each search, in seconds")
    options = parser.parse_args()
    both = options.terrains == options.speed
    if both or options.terrains:
        terrains(options.time_limit)
    if both or options.speed:
        speed(options.time_limit)


if __name__ == "__main__":
    main()
