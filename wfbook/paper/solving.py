"""Paper B, Formulation of Motion Control: the robot's numbers, and how long its optimal control takes."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook.paper.record import Result, compared, measured
from wfbook.quoted import value

if TYPE_CHECKING:
    from wfbook.omni.problem import OptimalControl
    from wfbook.paper.bench import Bench

REPEATS, TICKS = 5, 500
"""Cold starts, and iterations of a warm start."""

_COLD = round(value("omni.nodes_cold")), 0.01
_WARM = round(value("omni.nodes_warm")), 0.02
"""Nodes, and the time step, which the paper does not give."""


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Return the wall's and the processor's time in milliseconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return 1e3 * (time.perf_counter() - wall), 1e3 * (time.process_time() - cpu)


def standing(nodes: int, dt: float, hand: np.ndarray) -> "OptimalControl":
    """Return a problem that is to move the hand from where it is by ``(3,)``."""
    from wfbook.omni.locked import holding_effort, nominal_state, nominal_target
    from wfbook.omni.problem import OptimalControl

    ocp = OptimalControl(nodes, dt)
    target = replace(nominal_target(), effort=holding_effort(ocp.model, nominal_state()))
    ocp.refer([replace(target, hand=target.hand + hand)] * (nodes + 1))
    return ocp


def cold(hand: np.ndarray, disturbance: float) -> "tuple[np.ndarray, OptimalControl]":
    """Solve the long problem from standing still, again and again.

    Args:
        hand: ``(3,)`` how far the hand is to move.
        disturbance: standard deviation of each number of the first state.

    Returns:
        Times of the wall and of the processor ``(REPEATS, 2)`` in ms, and the problem.
    """
    from wfbook.omni.locked import nominal_state

    ocp, times = standing(*_COLD, hand), []
    for seed in range(REPEATS):
        x = ocp.state.integrate(
            nominal_state(), disturbance * np.random.default_rng(seed).standard_normal(40)
        )
        ocp.place_contacts(x)
        ocp.hold(x)
        times.append(timed(lambda x=x: ocp.solve(x)))
    return np.array(times), ocp


def warm() -> np.ndarray:
    """Return the times of one iteration of the short problem, shifted on from the last solution.

    Returns:
        ``(TICKS, 2)`` of the wall and of the processor in ms; the robot stands, measured with noise.
    """
    from wfbook.omni.locked import nominal_state

    ocp = standing(*_WARM, np.zeros(3))
    x, rng, times = nominal_state(), np.random.default_rng(0), []
    ocp.solve(x)
    for _ in range(TICKS):
        measured_x = ocp.state.integrate(ocp.xs[1], 1e-3 * rng.standard_normal(40))

        def tick(x: np.ndarray = measured_x) -> None:
            ocp.place_contacts(x)
            ocp.shift()
            ocp.solve(x, 1)

        times.append(timed(tick))
    return np.array(times)


def measure() -> dict[str, Any]:
    """Return the processor's times in ms, and what was computed, in JSON's types."""
    near, ocp = cold(np.zeros(3), 3e-3)
    far, there = cold(np.full(3, 0.1), 0.0)
    return {
        "cold": near[:, 1].tolist(),
        "cold_iterations": int(ocp.solver.iter),
        "cold_far": float(np.median(far[:, 1])),
        "cold_far_iterations": int(there.solver.iter),
        "warm": np.percentile(warm()[:, 1], (5, 50, 95)).tolist(),
        "states": int(ocp.state.nq + ocp.state.nv),
        "precision": float(ocp.solver.th_stop),
    }


def run(bench: "Bench") -> Result:
    """Compare the robot's numbers and the computing times."""
    from wfbook.omni.controller import FEEDBACK
    from wfbook.omni.robot import ARM_V, GRIPPER_V, LEGS_V, STEERS_V, WHEELS_V
    from wfbook.paper.waves import COUNTS, SPEED

    found = bench.solve("optimal control")
    # The same runs as in Fig. 6.
    runs = bench.drive("waves", f"{COUNTS[0]} waves", controller="ddp", count=COUNTS[0], speed=SPEED)
    driven = f"over the waves, 5th and 95th percentile, {len(runs)} runs"
    times = {name: [run.metrics[f"plan_ms_{name}"] for run in runs] for name in ("p5", "median", "p95")}
    near = f"near equilibrium, {found['cold_iterations']} iterations, {REPEATS} starts"
    stands = "standing, 5th and 95th percentile, one iteration"
    result = Result(settings={"cold_step_s": _COLD[1], "warm_step_s": _WARM[1]})
    result.records = [
        compared("omni.leg_joints", len(LEGS_V)),
        compared("omni.steering_joints", len(STEERS_V)),
        compared("omni.wheel_joints", len(WHEELS_V)),
        compared("omni.arm_joints", len({*ARM_V.tolist(), GRIPPER_V})),
        compared("omni.states", found["states"], "steering, wheels and gripper locked"),
        compared("omni.nodes_cold", _COLD[0]),
        compared("omni.precision", found["precision"], "of the gradient"),
        compared("omni.cold_least", min(found["cold"]), near),
        compared("omni.cold_most", max(found["cold"]), near),
        measured(
            "time of a cold start, hand 0.17 m away", found["cold_far"], "ms",
            f"{found['cold_far_iterations']} iterations",
        ),
        compared("omni.nodes_warm", _WARM[0]),
        compared("omni.warm_least", float(np.median(times["p5"])), driven, times["p5"]),
        compared("omni.warm_most", float(np.median(times["p95"])), driven, times["p95"]),
        compared("omni.stable_least", found["warm"][0], stands),
        compared("omni.stable_most", found["warm"][2], stands),
        compared("omni.feedback", 1.0 / FEEDBACK),
    ]  # fmt: skip
    result.notes = [
        "Times are those of one thread. Of cold starts and of standing they are the processor's; over the "
        "waves they are the wall's, with whatever else the machine did, of the whole tick in which the "
        "problem is solved: payload, prediction, contacts, one iteration.",
        "The paper gives no time step, and does not say from what a cold start starts.",
    ]
    return result
