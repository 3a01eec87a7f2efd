"""How long Crocoddyl takes for paper B's problem (eq. 16), on one thread: python benchmarks/omni_ocp.py.

Both the wall's time and the processor's are printed: on a busy machine the first says little.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wfbook.omni.locked import holding_effort, nominal_state, nominal_target
from wfbook.omni.problem import OptimalControl

REPEATS, TICKS = 5, 500


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Return the wall's and the processor's time in milliseconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return 1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - cpu)


def standing(nodes: int, dt: float, hand: np.ndarray) -> OptimalControl:
    """Return a problem that is to move the hand from where it is."""
    ocp = OptimalControl(nodes, dt)
    target = replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))
    ocp.refer([replace(target, hand=target.hand + hand)] * (nodes + 1))
    return ocp


def cold(name: str, hand: np.ndarray, disturbance: float) -> None:
    """Print how long 160 nodes take, begun with standing still."""
    ocp, times = standing(160, 0.01, hand), []
    for seed in range(REPEATS):
        noise = disturbance * np.random.default_rng(seed).standard_normal(40)
        x = ocp.state.integrate(nominal_state(), noise)
        ocp.place_contacts(x)
        ocp.hold(x)
        times.append(timed(lambda: ocp.solve(x)))  # noqa: B023 (called at once)
    wall, cpu = np.median(times, axis=0)
    print(f"{name:34s} {wall:8.1f} {cpu:8.1f}   {ocp.solver.iter} iterations, stop {ocp.solver.stop:.0e}")


def warm() -> None:
    """Print how long one iteration of 20 nodes takes, shifted on from the last solution."""
    ocp = standing(20, 0.02, np.zeros(3))
    x, rng, times = nominal_state(), np.random.default_rng(0), []
    ocp.solve(x)
    for _ in range(TICKS):
        measured = ocp.state.integrate(ocp.xs[1], 1e-3 * rng.standard_normal(40))

        def tick(x: np.ndarray = measured) -> None:
            ocp.place_contacts(x)
            ocp.shift()
            ocp.solve(x, 1)

        times.append(timed(tick))
    for name, row in (("median", np.median(times, axis=0)), ("p95", np.percentile(times, 95, axis=0))):
        print(f"{'20 nodes, warm, 1 iteration, ' + name:34s} {row[0]:8.2f} {row[1]:8.2f}")


if __name__ == "__main__":
    print(f"{'':34s} {'wall ms':>8s} {'CPU ms':>8s}")
    cold("160 nodes, near equilibrium", np.zeros(3), 3e-3)
    cold("160 nodes, hand 0.17 m away", np.full(3, 0.1), 0.0)
    warm()
