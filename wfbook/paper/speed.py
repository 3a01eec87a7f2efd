"""IV-B: how far the robot comes towards a goal out of reach, on feet, and on feet and wheels (Fig. 13).

The motion does not end at rest, so distances are those at the plan's end, and a run stops there.
"""

import numpy as np

from wfbook import terrain as ground
from wfbook.modes import END_EFFECTORS
from wfbook.paper.bench import Bench, Execution, Planned, proof
from wfbook.paper.gaits import SLOT_S
from wfbook.paper.record import Record, Result, compared, measured
from wfbook.planner import Limits, Problem
from wfbook.quoted import value

DURATION = value("speed.duration")
SLOTS = round(DURATION / SLOT_S)
STRIDE = Limits(step=(0.185, 0.15))
"""With steps of 0.185 m feet come as far as the paper's 1.43 m; it gives neither step nor top speed."""

GOAL = (5.0, 0.0)
"""Farther than top speed goes in that time, which is 3.6 m, so out of reach for all three.

Not much farther, for the pull of a goal grows with its distance: at 10 m the polish crouches until a knee
hits the ground.
"""

CASES = {
    "feet": ("feet only", ("foot",), "flat"),
    "both": ("feet and wheels", END_EFFECTORS, "flat"),
    "friction": ("feet and wheels, rolling friction", END_EFFECTORS, "flat-friction"),
}
"""By the paper's keys: what it is called, the end effectors and the ground."""


def problem(case: str) -> Problem:
    """Return the problem of a case."""
    _, kinds, name = CASES[case]
    return Problem(
        ground.builtin(name),
        goal=GOAL,
        slots=SLOTS,
        slot_duration=SLOT_S,
        end_effectors=kinds,
        final_stance=False,
        beyond_reach=True,
        limits=STRIDE,
    )


def run(bench: Bench) -> Result:
    """Plan and execute the three cases, and compare distances, speeds and how much faster wheels are."""
    result = Result(settings={"goal_m": GOAL[0], "slots": SLOTS, "slot_s": SLOT_S})
    result.settings |= {"longest_step_m": STRIDE.step[0], "top_speed_m_s": STRIDE.speed[0]}
    friction = ground.builtin(CASES["friction"][2]).regions[0].rolling_resistance
    result.settings["rolling_resistance"] = friction
    found: dict[str, tuple[Planned, list[Execution]]] = {}
    for case, (name, *_) in CASES.items():
        planned = bench.plan(problem(case), name)
        if planned is not None:
            found[case] = planned, bench.execute(planned.polished, name, hold=0.0)
    result.records.append(compared("speed.duration", SLOTS * SLOT_S))
    for case in CASES:
        result.records += _distances(case, *found.get(case, (None, [])))
    for case in ("both", "friction"):
        if "feet" in found and case in found:
            result.records += _ratios(case, found["feet"], found[case])
    result.notes = [
        "A run ends with the plan, in motion; whether the robot could stop from there is not asked.",
        "The paper's step and top speed are not given: ours were chosen so that feet alone match its "
        "distance, and hold for all three.",
        "The goal lies not much farther than out of reach: it was moved nearer after a robot, with rolling "
        "friction, had crouched so low in its first push that a knee hit the ground.",
        f"The paper does not give its rolling friction; here it is {friction:g} of the normal force.",
    ]
    if found:
        result.pictures["fig13.png"] = lambda: _picture(found)
    return result


def _distances(case: str, planned: Planned | None, runs: list[Execution]) -> list[Record]:
    """Return distances and mean speed of a case, planned and simulated."""
    name = CASES[case][0]
    if planned is None:
        return [compared(f"{case}.distance", None), compared(f"{case}.speed", None)]
    went = _went(runs)
    middle, sure = float(np.median(went)), proof(planned, runs)
    upright = sum(run.metrics["upright"] for run in runs)
    return [
        measured(f"planned distance, {name}", planned.polished.distance, "m", planned.proof),
        compared(f"{case}.distance", middle, sure, went),
        compared(f"{case}.speed", middle / DURATION, sure, [distance / DURATION for distance in went]),
        measured(f"of {len(runs)} runs upright to the plan's end, {name}", upright, "runs", sure),
    ]


def _ratios(
    case: str, feet: tuple[Planned, list[Execution]], other: tuple[Planned, list[Execution]]
) -> list[Record]:
    """Return how much farther a case goes than feet, in per cent: planned and simulated, seed by seed."""
    name = CASES[case][0]
    sure = f"{name} {proof(*other)}; feet only {feet[0].proof}"
    planned = _more(other[0].polished.distance, feet[0].polished.distance)
    gains = [_more(a, b) for a, b in zip(_went(other[1]), _went(feet[1]), strict=True)]
    return [
        measured(f"planned to be faster than feet only, {name}", planned, "%", sure),
        compared(f"{case}.faster", float(np.median(gains)), sure, gains),
    ]


def _went(runs: list[Execution]) -> list[float]:
    """Distances along the way when the runs end; a fall ends a run early, and its distance is what counts."""
    return [run.metrics["distance_m"] for run in runs]


def _more(one: float, other: float) -> float:
    return 100.0 * (one / other - 1.0)


def _picture(found: dict[str, tuple[Planned, list[Execution]]]):
    from wfbook.view import paper

    cases = {case: (CASES[case][0], planned.polished, runs[0]) for case, (planned, runs) in found.items()}
    ends = {case: (DURATION, value(f"{case}.distance")) for case in cases}
    return paper.way(cases, ends)
