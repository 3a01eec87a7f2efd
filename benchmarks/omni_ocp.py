"""How long Crocoddyl takes for paper B's problem (eq. 16), on one thread: python benchmarks/omni_ocp.py.

Both the wall's time and the processor's are printed: on a busy machine the first says little.
"""

import numpy as np

from wfbook.paper.solving import cold, warm


def show(name: str, row: np.ndarray, more: str = "") -> None:
    """Print times of the wall and of the processor ``(2,)`` in ms."""
    print(f"{name:34s} {row[0]:8.2f} {row[1]:8.2f}   {more}".rstrip())


if __name__ == "__main__":
    print(f"{'':34s} {'wall ms':>8s} {'CPU ms':>8s}")
    for name, hand, disturbance in (
        ("160 nodes, near equilibrium", np.zeros(3), 3e-3),
        ("160 nodes, hand 0.17 m away", np.full(3, 0.1), 0.0),
    ):
        times, ocp = cold(hand, disturbance)
        found = f"{ocp.solver.iter} iterations, stop {ocp.solver.stop:.0e}"
        show(name, np.median(times, axis=0), found)
    times = warm()
    show("20 nodes, warm, 1 iteration, median", np.median(times, axis=0))
    show("20 nodes, warm, 1 iteration, p95", np.percentile(times, 95, axis=0))
