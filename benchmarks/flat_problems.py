"""Plan, polish and execute seeded flat problems: goal, slots, start posture, with and without wheels.

    python benchmarks/flat_problems.py [--count 20] [--seed 0] [--time-limit 6]

One set of weights and gains for all. A problem counts as done if the robot is upright through the plan
and a hold of 1 s, covers 0.97 to 1.03 of the planned distance, and ends at 1 cm/s or less.
"""

import argparse

import numpy as np

from wfbook import simulate, terrain
from wfbook.planner import InfeasibleError, NoPlanError, Problem, solve_executable


def draw(rng: np.random.Generator, wheels: bool) -> Problem:
    """Return a random flat problem."""
    slots = int(rng.integers(4, 11))
    goal = (float(rng.uniform(0.03, 0.11) * slots), float(rng.uniform(-0.1, 0.1)))
    return Problem(
        terrain.flat(),
        goal=goal,
        slots=slots,
        end_effectors=("foot", "wheel") if wheels else ("foot",),
        start_offsets=rng.uniform(-0.025, 0.025, (4, 2)),
    )


def main() -> None:
    """Run the problems and print one line each, then the count of those done."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--time-limit", type=float, default=6.0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    done = 0
    print(f"{'#':>3} {'slots':>5} {'goal':>14} {'wheels':>6} {'gap %':>6} {'rejected':>8}", end=" ")
    print(f"{'torque N m':>10} {'upright':>7} {'ratio':>6} {'speed m/s':>9} {'rms mm':>6} {'rms deg':>7}")
    for i in range(options.count):
        problem = draw(rng, wheels=i % 2 == 1)
        try:
            relaxed, plan = solve_executable(problem, time_limit=options.time_limit)
        except (InfeasibleError, NoPlanError) as error:
            print(f"{i:3} {problem.slots:5}  {error}", flush=True)
            continue
        metrics = simulate.run(plan).metrics
        ratio = metrics["distance_m"] / metrics["planned_distance_m"]
        good = metrics["upright"] and 0.97 <= ratio <= 1.03 and metrics["final_speed_m_s"] <= 0.01
        done += good
        goal = f"({problem.goal[0]:.2f}, {problem.goal[1]:+.2f})"
        mismatch = max(plan.meta["torque_mismatch_nm"])
        print(
            f"{i:3} {problem.slots:5} {goal:>14} {plan.end_effector.sum():6} {100 * relaxed.meta['gap']:6.2f}"
            f" {relaxed.meta['rejected_gaits']:8} {mismatch:10.1e} {metrics['upright']!s:>7} {ratio:6.3f}"
            f" {metrics['final_speed_m_s']:9.4f} {1e3 * metrics['base_rms_m']:6.1f}"
            f" {np.degrees(metrics['base_rms_rad']):7.2f}{'' if good else '  <-- not done'}",
            flush=True,
        )
    print(f"{done} of {options.count} done")


if __name__ == "__main__":
    main()
