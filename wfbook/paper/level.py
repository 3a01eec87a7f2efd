"""Paper B, Fig. 7: level ground. Wheels that are disturbed under a body in its place; ways of driving."""

import numpy as np

from wfbook.paper.bench import Bench
from wfbook.paper.drives import SHIFT, Drive, hand_records, over, proof
from wfbook.paper.record import Result, measured, stated
from wfbook.quoted import value

_SHIFTED, _DEVIATED = 0.02, 0.1
"""What counts as a leg's end shifted, m, and as a joint that deviates significantly, rad."""


def fixed(bench: Bench) -> Result:
    """Disturb the wheels forward and backward, and look at the hand, the wheels and the joints."""
    from wfbook.omni.scenarios import DISTURBED

    runs = bench.drive("fixed", "disturbed wheels")
    sure = proof(runs)
    result = Result(hand_records("fixed", runs), _settings(runs))
    result.settings["disturbance"] = " ".join(
        f"{speed:+g} m/s for {lasts:g} s," for lasts, speed in DISTURBED
    )[:-1]
    shift, _ = over(runs, lambda run: _least_shift(run))
    joints, _ = over(runs, lambda run: np.ptp(run.legs, axis=0).max())
    trunk, values = over(runs, lambda run: np.abs(run.trunk[:, 0] - run.trunk[0, 0]).max())
    result.records += [
        stated(
            "fixed.legs", shift > _SHIFTED, 100.0 * shift, "cm, of the least of all legs either way", sure
        ),
        stated("fixed.joints", joints > _DEVIATED, joints, "rad between the extremes of a joint", sure),
    ]
    result.records.append(
        measured("the trunk moves by at most", 100.0 * trunk, "cm", sure, [100 * v for v in values])
    )
    result.notes = [
        "The paper sets the wheels' initial velocities, and gives neither these nor a time. Here the wheels "
        "are told to go faster or slower than they should, which no controller knows of.",
        _PITCH,
    ]
    result.pictures["omni-fig07a.png"] = lambda: _picture(runs[0], "fixed", True)
    return result


def combined(bench: Bench) -> Result:
    """Drive straight, rotate on the spot, and go sideways, and look at the hand."""
    runs = bench.drive("combined", "ways of driving")
    result = Result(hand_records("combined", runs), _settings(runs))
    result.settings["course"] = ", ".join(
        f"{twist} for {lasts:g} s" for lasts, twist in runs[0].meta["course"]
    )
    result.notes = ["The paper does not give its speeds.", _PITCH]
    result.pictures["omni-fig07b.png"] = lambda: _picture(runs[0], "combined", False)
    return result


_PITCH = (
    "Pitch has the paper's shift of -1.57 rad. Roll, pitch and yaw are in axes that go along with the base."
)


def _settings(runs: list[Drive]) -> dict:
    return {"controller": runs[0].meta["controller"], "delay_ms": 1e3 * runs[0].meta["delay"]}


def _least_shift(run: Drive) -> float:
    """Return how far every leg's end went both ways, at least."""
    return float(np.minimum(run.wheels.max(axis=0), -run.wheels.min(axis=0)).min())


def _picture(run: Drive, key: str, wheels: bool):
    from wfbook.view import paper_omni

    printed = {"height": (value(f"{key}.mean"), value(f"{key}.std"))}
    printed |= {
        name: (value(f"{key}.{name}"), value(f"{key}.{name}_std")) for name in ("roll", "pitch", "yaw")
    }
    return paper_omni.hand(run, printed, SHIFT, wheels)
