"""Paper B, Figs. 8 to 10: what it does on hardware, simulated: a turn on the spot and back, and a squat.

The paper's text has hardly a number of these; what it states is decided by thresholds of ours.
"""

import numpy as np

from wfbook.paper.bench import Bench
from wfbook.paper.drives import Drive, over, proof
from wfbook.paper.record import Record, Result, compared, measured, stated

_CONSTANT = 0.005
"""A height that stays within, m, is nearly constant."""
_MINOR = 0.05
"""A horizontal drift within, m, is minor."""
_BACK = 0.05
"""An angle that is back within, rad, has returned."""
_STABLE = 0.02
"""An error of the hand's direction within, rad, is that of a stable hand."""


def turn(bench: Bench) -> Result:
    """Turn on the spot and back while the hand keeps its place in the world."""
    runs = bench.drive("turn", "turn and back")
    sure = proof(runs)
    angle, angles = over(runs, lambda run: np.ptp(run.yaw))
    end, _ = over(runs, lambda run: abs(run.yaw[-1] - run.yaw[0]))
    height, _ = over(runs, lambda run: run.metrics["hand_height_max_error_m"])
    drift, _ = over(runs, lambda run: run.metrics["hand_level_max_error_m"])
    seen, _ = over(runs, lambda run: np.ptp(run.base_rpy[:, 2]))
    back, _ = over(runs, lambda run: abs(run.base_rpy[-1, 2] - run.base_rpy[0, 2]))
    margin, _ = over(runs, lambda run: run.arm_margin.min())
    legs, _ = over(runs, lambda run: np.abs(run.legs - run.legs_ref).max())
    tilt, _ = over(runs, lambda run: run.metrics["base_rms_rad"])
    result = Result(settings=_settings(runs))
    result.records = [
        compared("turn.angle", angle, sure, angles),
        stated("turn.returns", end < _BACK, end, "rad from where it began", sure),
        stated("turn.height", height < _CONSTANT, 1e3 * height, "mm, largest error", sure),
        stated("turn.drift", 0.0 < drift < _MINOR, 1e3 * drift, "mm, largest", sure),
        stated("turn.yaw", seen > 0.9 * angle and back < _BACK, seen, "rad between its extremes", sure),
        stated(
            "turn.legs", tilt < _BACK, tilt, "rad between trunk and commanded base, root mean square", sure
        ),
        stated("turn.limit", margin <= 0.0, margin, "rad left to the nearest limit", sure),
        measured("a leg's joint from where it was planned to be, at most", legs, "rad", sure),
        *_hand(runs, sure),
    ]
    result.notes = [
        "Simulated: the paper turns its hardware.",
        "The hand keeps its place and its direction in the world: in the paper's base axes its yaw turns and "
        "recovers, and its horizontal drifts are minor. Our arm has no limit on the way; the paper's has.",
        "What is planned for the legs begins anew, every 20 ms, where they are: both lie on each other.",
    ]
    result.pictures["omni-fig09.png"] = lambda: _picture("legs", runs[0])
    result.pictures["omni-fig10.png"] = lambda: _picture("pose", runs[0])
    return result


def squat(bench: Bench) -> Result:
    """Squat and stand up while the hand keeps its place."""
    runs = bench.drive("squat", "squat")
    sure = proof(runs)
    height, _ = over(runs, lambda run: run.metrics["hand_height_max_error_m"])
    turned, _ = over(runs, lambda run: run.metrics["hand_turn_max_rad"])
    depth, depths = over(runs, lambda run: np.ptp(run.trunk[:, 2]))
    result = Result(settings=_settings(runs))
    result.records = [
        stated(
            "squat.hand", height < _CONSTANT and turned < _STABLE, 1e3 * height, "mm, largest error", sure
        ),
        measured("the trunk goes down by", 100.0 * depth, "cm", sure, [100.0 * d for d in depths]),
        *_hand(runs, sure),
    ]
    result.notes = ["Simulated: the paper's hardware squats, and how deep is not given."]
    result.pictures["omni-fig08b.png"] = lambda: _picture("squat", runs[0])
    return result


def _hand(runs: list[Drive], sure: str) -> list[Record]:
    """Return how far the hand is turned at most, and its height's deviation."""
    records = []
    for what, name in (("hand's height, standard deviation", "hand_height_std_m"),
                       ("hand's direction, largest error", "hand_turn_max_rad")):  # fmt: skip
        unit = "mm" if name.endswith("_m") else "mrad"
        middle, values = over(runs, lambda run, name=name: 1e3 * run.metrics[name])
        records.append(measured(what, middle, unit, sure, values))
    return records


def _settings(runs: list[Drive]) -> dict:
    return {
        "controller": runs[0].meta["controller"],
        "delay_ms": 1e3 * runs[0].meta["delay"],
        "course": ", ".join(f"{twist} for {lasts:.2f} s" for lasts, twist in runs[0].meta["course"]),
    }


def _picture(name: str, run: Drive):
    from wfbook.view import paper_omni

    return getattr(paper_omni, name)(run)
