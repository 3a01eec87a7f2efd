"""The list of experiments: what ``python -m wfbook paper`` does, in the papers' order."""

from functools import partial

from wfbook.paper import gaits, hardware, level, solving, speed, times, transport, waves
from wfbook.paper.record import Experiment


def _gait(name: str, figure: int, title: str, section: str, *more: str) -> Experiment:
    return Experiment(
        name,
        title,
        f"{section}, Fig. {figure}",
        partial(gaits.run, name=name, figure=figure),
        (f"fig{figure:02}.png",),
        tuple(f"fig{figure}.{key}" for key in more),
    )


def _hand(key: str) -> tuple[str, ...]:
    """Return the keys of a simulation's figures of the hand."""
    angles = (f"{name}{end}" for name in ("roll", "pitch", "yaw") for end in ("", "_std"))
    return tuple(f"{key}.{what}" for what in ("mean", "std", "max", *angles))


_TABLE_II = ("1,1,5", "1,1,10", "1,2,5", "1,2,10", "3,1,5", "3,1,10", "3,2,5")

EXPERIMENTS = (
    _gait(
        *("flat", 8, "Flat ground without friction", "IV-A.1"),
        *("duration", "start", "feet_at_end", "wheels_at_end"),
    ),
    _gait("flat-friction", 9, "Flat ground with friction", "IV-A.2", "more_feet", "mostly_wheels"),
    _gait("ramp-down", 10, "Downward ramp", "IV-A.3", "rolls_down", "crosses", "stops"),
    _gait("ramp-up", 11, "Upward ramp", "IV-A.4", "mixed", "feet"),
    _gait("stepping-stones", 12, "Stepping stones", "IV-A.5", "gap", "step", "feet"),
    Experiment(
        "speed",
        "Speed towards a goal out of reach",
        "IV-B, Fig. 13",
        speed.run,
        ("fig13.png",),
        (
            "speed.duration",
            *(f"{case}.{what}" for case in speed.CASES for what in ("distance", "speed")),
            *("both.faster", "friction.faster"),
        ),
    ),
    Experiment(
        "transport",
        "Cost of transport",
        "IV-C",
        transport.run,
        ("transport.png",),
        ("transport.duration", "feet.cot", "both.cot", "cot.improvement", "cot.reduction"),
    ),
    Experiment(
        "table2",
        "Computation times",
        "IV-D, Table II",
        times.run,
        ("table2.png",),
        (
            *("table2.short", "table2.long", *(f"table2.{row}" for row in _TABLE_II)),
            *("times.grow", "times.harder", "times.half_second"),
        ),
    ),
    Experiment(
        "omni-waves",
        "The hand over waves",
        "Paper B, Fig. 6",
        waves.run,
        ("omni-fig06.png",),
        (
            *(f"omni.{what}" for what in ("length", "peak", "height", "roll", "pitch", "yaw", "speed")),
            *("waves.ik_mean", "waves.ik_std", "waves.ik_max", *_hand("waves"), "waves.calmer"),
        ),
    ),
    Experiment(
        "omni-fixed",
        "The body in its place over disturbed wheels",
        "Paper B, Fig. 7a",
        level.fixed,
        ("omni-fig07a.png",),
        (*_hand("fixed"), "fixed.legs", "fixed.joints"),
    ),
    Experiment(
        "omni-combined",
        "Ways of driving",
        "Paper B, Fig. 7b",
        level.combined,
        ("omni-fig07b.png",),
        _hand("combined"),
    ),
    Experiment(
        "omni-turn",
        "A turn on the spot and back",
        "Paper B, Figs. 8a, 9, 10",
        hardware.turn,
        ("omni-fig09.png", "omni-fig10.png"),
        tuple(f"turn.{what}" for what in ("angle", "returns", "height", "drift", "yaw", "legs", "limit")),
    ),
    Experiment(
        "omni-squat",
        "Squat and stand up",
        "Paper B, Fig. 8b",
        hardware.squat,
        ("omni-fig08b.png",),
        ("squat.hand",),
    ),
    Experiment(
        "omni-times",
        "The robot's numbers and computing times",
        "Paper B, Formulation, Results",
        solving.run,
        (),
        (
            *(f"omni.{what}_joints" for what in ("leg", "steering", "wheel", "arm")),
            *(f"omni.{what}" for what in ("states", "nodes_cold", "precision", "cold_least", "cold_most")),
            *(f"omni.{what}" for what in ("nodes_warm", "warm_least", "warm_most", "feedback")),
            *("omni.stable_least", "omni.stable_most"),
        ),
    ),
)
