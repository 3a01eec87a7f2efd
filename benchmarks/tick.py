"""How long a control tick takes, part by part: ``python benchmarks/tick.py``.

The robot stands on two wheels and a foot, swings the fourth leg and sways at 1.5 Hz. Then it executes a
stored plan, on estimates: there a tick has the tracker's work, too, and contacts come and go.
"""

import time
from collections.abc import Callable

import numpy as np

from wfbook import simulate, wbc
from wfbook.go1 import FOOT_RADIUS, nominal
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.planner import stored
from wfbook.qp import QuadraticProgram
from wfbook.reference import Ground, Reference
from wfbook.terrain import flat

COUNT = 2000


def timed(work: Callable[[int], object]) -> np.ndarray:
    """Return the durations of ``work(i)`` in microseconds."""
    durations = np.empty(COUNT)
    for i in range(COUNT):
        began = time.perf_counter()
        work(i)
        durations[i] = 1e6 * (time.perf_counter() - began)
    return durations[COUNT // 10 :]


def main() -> None:
    """Print median and 99th percentile of each part."""
    rng = np.random.default_rng(0)
    robot = Go1Dynamics()
    ends = nominal()["hip_offsets"] + np.array([0.0, 0.0, 0.265 + FOOT_RADIUS])
    com = np.array([0.0, 0.0, 0.265])
    qpos = robot.posture(com, np.zeros(3), ends)
    phases, sway = rng.uniform(0.0, 2 * np.pi, (2, 23)), 2 * np.pi * 1.5 * 0.002
    states = [
        (qpos + 0.01 * np.sin(sway * i + phases[0]), 0.1 * np.cos(sway * i + phases[1, :22]))
        for i in range(COUNT)
    ]
    for q, _ in states:
        q[3:7] /= np.linalg.norm(q[3:7])
    stance, wheels = np.array([True, False, True, True]), np.array([False, True, True, False])
    ground = Ground.under(flat(), np.zeros(4, int))
    still = np.zeros((4, 3))
    share = wbc.weight_share(robot, np.zeros(3), stance)
    ref = Reference(com, still[0], still[0], np.eye(3), ends, still, still, stance, wheels, share)
    controller = wbc.WholeBodyController(robot)

    def whole_tick(i: int) -> None:
        robot.update(*states[i])
        controller.tick(ref, ground)

    parts = {
        "dynamics (Pinocchio and wheels)": lambda i: robot.update(*states[i]),
        "assembly of the program": lambda i: controller.problem(ref, ground),
        "assembly and OSQP": lambda i: controller.tick(ref, ground),
        "whole tick": whole_tick,
    }
    print(f"{'part':34s} {'median':>9s} {'p99':>9s}")
    for name, work in parts.items():
        durations = timed(work)
        print(f"{name:34s} {np.median(durations):6.0f} us {np.percentile(durations, 99):6.0f} us")
    execute()


def execute() -> None:
    """Print the times of a run, and OSQP's iterations on the run's programs with units and without."""
    programs: list[tuple[np.ndarray, ...]] = []
    solve = QuadraticProgram.solve

    def recorded(self: QuadraticProgram, *program: np.ndarray) -> np.ndarray | None:
        programs.append(program)
        return solve(self, *program)

    plan = stored("flat")
    run = simulate.run(plan, state="estimated")
    for name in ("tick", "estimator"):
        durations = 1e3 * run.times[name]
        print(
            f"{'in a run: ' + name:34s} {np.median(durations):6.0f} us {np.percentile(durations, 99):6.0f} us"
        )
    print(f"simulated time over wall time      {run.metrics['real_time_factor']:6.2f}")
    QuadraticProgram.solve = recorded
    simulate.run(plan, state="estimated")
    QuadraticProgram.solve = solve
    for name, units in (("with units", wbc.units()), ("without", ())):
        program = QuadraticProgram(*wbc.pattern(), "osqp", *units)
        for data in programs:
            program.solve(*data)
        mean = program.iterations / len(programs)
        print(f"OSQP {name:29s} {mean:6.0f} iterations a tick, {program.rescues} of {len(programs)} unsolved")


if __name__ == "__main__":
    main()
