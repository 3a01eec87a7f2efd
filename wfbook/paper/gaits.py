"""IV-A: which gait and which end effectors are chosen on the five terrains (Figs. 8 to 12).

All five are planned with the same weights and limits, over the time that Fig. 8 gives, to the same goal, at
the pace of the book's other plans. It lies beyond the last edge of every terrain.
"""

import itertools

import numpy as np

from wfbook import terrain as ground
from wfbook.paper.bench import Bench, Execution, Planned, proof
from wfbook.paper.reading import Reading
from wfbook.paper.record import Record, Result, compared, measured, stated
from wfbook.planner import Limits, Problem
from wfbook.quoted import value
from wfbook.table2.benchmark import GOAL_PER_SLOT

SLOT_S = value("table2.short") / 5
"""The paper's 0.3 s: five slots in 1.5 s."""

SLOTS = round(value("fig8.duration") / SLOT_S)

GOAL = (GOAL_PER_SLOT * SLOTS, 0.0)

LIMITS = Limits(step=(value("fig12.step") / 100.0, Limits().step[1]), speed=(0.5, Limits().speed[1]))
"""The longest step is the paper's. Top speed is what the controller is known to follow at a trot: steps of
half a metre at the planner's 0.8 m/s, which wheels can keep, end in a fall."""


def problem(name: str) -> Problem:
    """Return the problem of a built-in terrain."""
    return Problem(ground.builtin(name), goal=GOAL, slots=SLOTS, slot_duration=SLOT_S, limits=LIMITS)


def run(bench: Bench, name: str, figure: int) -> Result:
    """Plan on a terrain, execute, and read the gait.

    Args:
        bench: plans and simulates.
        name: of the terrain.
        figure: of the paper.
    """
    asked = problem(name)
    planned = bench.plan(asked, name)
    settings = {"terrain": name, "goal_m": GOAL[0], "slots": SLOTS, "slot_s": SLOT_S}
    settings |= {"longest_step_m": LIMITS.step[0], "top_speed_m_s": LIMITS.speed[0]}
    if planned is None:
        return Result([measured("a plan that can be executed", None, "m")], settings)
    runs = bench.execute(planned.polished, name)
    read = Reading.of(planned.relaxed)
    sure = planned.proof
    records = _SAID[name](bench, read, planned) + _common(read, sure) + moved(planned, runs)
    result = Result(records, settings, read.lines)
    result.notes.append(
        "The paper gives no top speed; this one, for all five terrains, was chosen after a robot had fallen "
        "that trotted over the stones at the planner's own. It does not measure its ramps either."
    )
    result.pictures[f"fig{figure:02}.png"] = lambda: _picture(planned, runs, figure)
    return result


def moved(planned: Planned, runs: list[Execution]) -> list[Record]:
    """Return how far the robot was to go, how far it went, and whether it stayed up."""
    distances = [run.metrics["distance_m"] for run in runs]
    planned_m = planned.polished.distance
    sure = proof(planned, runs)
    upright = sum(run.metrics["upright"] for run in runs)
    return [
        measured("planned distance", planned_m, "m", planned.proof),
        measured("distance in the simulation", float(np.median(distances)), "m", sure, distances),
        measured(f"of {len(runs)} runs upright to the end", upright, "runs", sure),
    ]


def _common(read: Reading, sure: str) -> list[Record]:
    return [
        measured("share of stance on wheels", _percent(read.share_on_wheels()), "%", sure),
        measured("first stance on a wheel", read.first_wheel_s, "s", sure),
        measured("swings", read.swings, "1", sure),
    ]


def _flat(bench: Bench, read: Reading, planned: Planned) -> list[Record]:
    feet, wheels = read.ending
    early, sure = read.all_on_wheels_s, planned.proof
    half = 0.5 * value("fig8.duration")
    return [
        compared("fig8.duration", planned.relaxed.t[-1] - planned.relaxed.t[0]),
        stated("fig8.start", early is not None and early < half, early, "s", sure),
        compared("fig8.feet_at_end", feet, sure),
        compared("fig8.wheels_at_end", wheels, sure),
    ]


def _friction(bench: Bench, read: Reading, planned: Planned) -> list[Record]:
    share, sure = read.share_on_wheels(), planned.proof
    records = []
    without = bench.plan(problem("flat"), "flat")
    if without is not None:
        more = read.foot_contacts - Reading.of(without.relaxed).foot_contacts
        both = f"{sure}; without friction {without.proof}"
        records.append(stated("fig9.more_feet", more > 0, more, "contacts more", both))
    return [*records, stated("fig9.mostly_wheels", share > 0.5, _percent(share), "%", sure)]


def _down(bench: Bench, read: Reading, planned: Planned) -> list[Record]:
    slope, sure = read.regions == 1, planned.proof
    share = read.share_on_wheels(slope)
    rolled = read.rolled_over_edges
    stops = read.switched_back
    return [
        stated(
            "fig10.rolls_down", share is not None and share > 0.5, _percent(share), "% of stance there", sure
        ),
        stated("fig10.crosses", rolled > 0, rolled, "edges", sure),
        stated("fig10.stops", stops > 0, stops, "legs", sure),
    ]


def _up(bench: Bench, read: Reading, planned: Planned) -> list[Record]:
    arrived = np.flatnonzero((read.regions > 0).all(axis=0))
    begins = int(arrived[0]) if len(arrived) else read.regions.shape[1]
    share = read.share_on_wheels(np.arange(read.regions.shape[1]) < begins)
    feet_from, sure = read.feet_only_from_s, planned.proof
    mixed = share is not None and 0.0 < share < 1.0
    return [
        stated("fig11.mixed", mixed, _percent(share), "% of stance before all legs are on it", sure),
        stated("fig11.feet", feet_from is not None, feet_from, "s", sure),
    ]


def _stones(bench: Bench, read: Reading, planned: Planned) -> list[Record]:
    regions, sure = planned.relaxed.terrain.regions, planned.proof
    ends = [(region.vertices[:, 0].min(), region.vertices[:, 0].max()) for region in regions]
    gaps = [100.0 * float(begin - end) for (_, end), (begin, _) in itertools.pairwise(ends)]
    limited = (read.regions > 0) & (read.regions < len(regions) - 1)
    share = read.share_on_wheels(limited)
    feet = None if share is None else 100.0 - 100.0 * share
    return [
        compared("fig12.gap", max(gaps)),
        compared("fig12.step", 100.0 * read.step_m, sure),
        stated("fig12.feet", share == 0.0, feet, "% of stance on the stones", sure),
    ]


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _picture(planned: Planned, runs: list[Execution], figure: int):
    from wfbook.view import paper

    return paper.gait(planned.relaxed, runs[0], f"Fig. {figure}: {planned.relaxed.terrain.name}")


_SAID = {
    "flat": _flat,
    "flat-friction": _friction,
    "ramp-down": _down,
    "ramp-up": _up,
    "stepping-stones": _stones,
}
"""By terrain, what the paper says about its gait."""
