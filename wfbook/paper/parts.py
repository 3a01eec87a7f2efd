"""The list of experiments: what ``python -m wfbook paper`` does, in the papers' order.

Part II will be experiments of the second paper's sections, appended here.
"""

from functools import partial

from wfbook.paper import gaits, speed, times, transport
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
)
