"""Runs that several tests of the estimator listen to, simulated once."""

from functools import cache

import handmade

from wfbook.runs import Run
from wfbook.simulate import run


@cache
def walk() -> Run:
    """Trots on feet."""
    return run(handmade.trot(0.4, 7), hold=0.2)


@cache
def coast() -> Run:
    """Speeds up on feet, rolls on four wheels for 1.2 s, brakes with one foot."""
    return run(handmade.coast(), hold=0.2)
