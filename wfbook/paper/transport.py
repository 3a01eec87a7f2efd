"""IV-C: cost of transport over 9 s on flat ground, on feet, and on feet and wheels.

Rest to rest: work counts from the plan's first instant to a second after its last, in which the robot
stands. Coasting alone costs nothing, and says nothing. All go equally far in the same time, within the limits
of IV-B. A run that ends in a fall is told, and has no cost.
"""

from dataclasses import replace

import numpy as np

from wfbook import terrain as ground
from wfbook.modes import END_EFFECTORS
from wfbook.paper.bench import Bench, Execution, Planned, proof
from wfbook.paper.gaits import SLOT_S
from wfbook.paper.record import Record, Result, compared, measured
from wfbook.paper.speed import STRIDE
from wfbook.planner import Problem
from wfbook.quoted import value

DURATION = value("transport.duration")
SLOTS = round(DURATION / SLOT_S)
GOAL = DURATION * value("feet.distance") / value("speed.duration")
"""Goal of the feet, metres ahead: as far as the paper's robot comes in that time at the speed of IV-B."""

CASES = {
    "feet": ("feet only", ("foot",), "flat"),
    "both": ("feet and wheels", END_EFFECTORS, "flat"),
    "feet, friction": ("feet only, rolling friction", ("foot",), "flat-friction"),
    "both, friction": ("feet and wheels, rolling friction", END_EFFECTORS, "flat-friction"),
}
"""What each case is called, its end effectors and its ground."""

_QUOTED = {"feet": "feet.cot", "both": "both.cot"}

COSTS = {"cot_abs": "absolute work", "cot_positive": "positive work"}
"""Metrics of a run: all work of the motors as cost, or only what they put in."""


def problem(case: str, goal: float = GOAL) -> Problem:
    """Return the problem of a case, its goal so many metres ahead."""
    _, kinds, name = CASES[case]
    return Problem(
        ground.builtin(name),
        goal=(goal, 0.0),
        slots=SLOTS,
        slot_duration=SLOT_S,
        end_effectors=kinds,
        limits=STRIDE,
    )


def run(bench: Bench) -> Result:
    """Plan and execute the cases, and compare what they cost.

    A goal is a cost, and feet end short of theirs. Wheels are sent to where the feet ended.
    """
    friction = ground.builtin("flat-friction").regions[0].rolling_resistance
    result = Result(settings={"goal_of_feet_m": GOAL, "slots": SLOTS, "slot_s": SLOT_S})
    result.settings |= {"longest_step_m": STRIDE.step[0], "top_speed_m_s": STRIDE.speed[0]}
    result.settings["rolling_resistance"] = friction
    found: dict[str, tuple[Planned, list[Execution]]] = {}
    feet = bench.plan(problem("feet"), CASES["feet"][0])
    if feet is not None:
        goal = feet.polished.distance
        result.settings["goal_of_wheels_m"] = goal
        for case, (name, kinds, floor) in CASES.items():
            # Rolling friction is nothing to feet: their plan is the same.
            planned = feet if kinds == ("foot",) else bench.plan(problem(case, goal), name)
            if planned is not None:
                there = replace(planned.polished, terrain=ground.builtin(floor))
                found[case] = planned, bench.execute(there, name)
    result.records.append(compared("transport.duration", SLOTS * SLOT_S))
    for case, (planned, runs) in found.items():
        result.records += _costs(case, planned, runs)
    ways = [way for _, runs in found.values() for way in _values(runs, "distance_m").values()]
    if ways:
        spread = 100.0 * (max(ways) - min(ways)) / max(ways)
        result.records.append(measured("the shortest way is shorter than the longest by", spread, "%"))
    for suffix in ("", ", friction"):
        feet, both = found.get(f"feet{suffix}"), found.get(f"both{suffix}")
        if feet and both:
            result.records += _ratios(suffix, feet, both)
    result.notes = [
        "Feet end short of their goal, because late steps are priced higher than early ones (eq. 31); wheels "
        "are sent to where the feet ended.",
        "Step and top speed are those of IV-B. They were chosen after others had been tried: with the "
        "planner's own limits feet trot faster and fell with some seeds; with those of IV-A wheels with "
        "rolling friction coasted to the last slot, off their plan, and fell.",
        "The paper takes its definition from elsewhere and does not repeat it, nor says over which distance: "
        "both definitions are given, and only their ratios can be compared.",
        "Its friction is not given either; IV-C does not say whether rolling costs anything.",
    ]
    if found:
        result.pictures["transport.png"] = lambda: _picture(found)
    return result


def _costs(case: str, planned: Planned, runs: list[Execution]) -> list[Record]:
    """Return distance and costs of a case; the paper's number beside the absolute work's."""
    name, sure = CASES[case][0], proof(planned, runs)
    upright = sum(run.metrics["upright"] for run in runs)
    went = list(_values(runs, "distance_m").values())
    records = [measured(f"distance, {name}", _middle(went), "m", sure, went)]
    for metric, text in COSTS.items():
        costs = list(_values(runs, metric).values())
        middle = _middle(costs)
        if case in _QUOTED and metric == "cot_abs":
            records.append(compared(_QUOTED[case], middle, f"{text}; {sure}", costs))
        else:
            records.append(measured(f"cost of transport, {name}, {text}", middle, "1", sure, costs))
    return [*records, measured(f"of {len(runs)} runs upright to the end, {name}", upright, "runs", sure)]


def _ratios(
    suffix: str, feet: tuple[Planned, list[Execution]], both: tuple[Planned, list[Execution]]
) -> list[Record]:
    """Return cost on feet over cost with wheels, by both definitions, seed by seed."""
    sure = f"feet {proof(*feet)}; feet and wheels {proof(*both)}"
    records = []
    for metric, text in COSTS.items():
        costs = _values(feet[1], metric), _values(both[1], metric)
        ratios = [costs[0][seed] / costs[1][seed] for seed in costs[0] if seed in costs[1]]
        middle = _middle(ratios)
        saved = [100.0 * (1.0 - 1.0 / ratio) for ratio in ratios]
        if suffix or metric != "cot_abs":
            what = f"feet only over feet and wheels{suffix and ', rolling friction'}, {text}"
            records.append(measured(what, middle, "1", sure, ratios))
            continue
        records.append(compared("cot.improvement", middle, f"{text}; {sure}", ratios))
        records.append(compared("cot.reduction", _middle(saved), f"{text}; {sure}", saved))
    return records


def _values(runs: list[Execution], metric: str) -> dict[int, float]:
    """By seed, a metric of the runs that stayed up: what a fallen robot spent is no cost of transport."""
    return {run.meta["seed"]: run.metrics[metric] for run in runs if run.metrics["upright"]}


def _middle(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def _picture(found: dict[str, tuple[Planned, list[Execution]]]):
    from wfbook.view import paper

    return paper.transport({CASES[case][0]: runs[0] for case, (_, runs) in found.items()})
