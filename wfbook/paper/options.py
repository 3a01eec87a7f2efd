"""What the command may be asked, without the planner and the simulator that answer it."""

from dataclasses import dataclass
from pathlib import Path

NAMES = ("flat", "flat-friction", "ramp-down", "ramp-up", "stepping-stones", "speed", "transport", "table2")
NAMES += ("omni-waves", "omni-fixed", "omni-combined", "omni-turn", "omni-squat", "omni-times")
"""Of the experiments that :mod:`wfbook.paper.parts` lists."""


@dataclass(frozen=True)
class Options:
    """What holds for all experiments.

    Attributes:
        time_limit: of each search, in seconds.
        gap: relative gap at which a search ends.
        seeds: number of runs of each plan; their seeds are 0, 1, …
        state: what the controller sees, as for :func:`wfbook.simulate.run`.
        table2: a ``table2.json`` to take Table II from; None: search its rows.
    """

    time_limit: float = 60.0
    gap: float = 1e-3
    seeds: int = 3
    state: str = "estimated"
    table2: Path | None = None
