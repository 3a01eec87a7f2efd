"""Chapter 12: experiments in which the robot needs its legs: a bar across the way (Paper B, Fig. 5)."""

from typing import Any

import numpy as np

from wfbook.modes import LEGS
from wfbook.omni.jump import Leap
from wfbook.omni.robot import WHEEL_RADIUS
from wfbook.omni.simulate import OmniRun, run
from wfbook.omni.stride import Gait, margin
from wfbook.omni.two_modes import Jump, RollTo, StepTo, Task
from wfbook.terrain import Region, Terrain, flat

_SURFACE = {"mu_foot": 0.7, "mu_wheel": 0.0, "mu_wheel_lateral": 0.7, "rolling_resistance": 0.0}
_HALF_WIDTH = 2.0
_TOUCHING, _SETTLED = 1.0, 30
"""Force below which a wheel touches nothing, N; samples after a landing when a miss is measured."""
FRONT, REAR = ("FL", "FR"), ("RL", "RR")

_BEFORE, _REAR_BEFORE, _BEHIND = 0.03, 0.07, 0.04
"""Gaps between a wheel and the obstacle: of the front wheels before it, of the rear ones, which roll on with
their shanks as the robot leans ahead, and of all behind it; in metres."""
_SPEED, _ROLLING = 0.4, 5.0
"""Of the attempt to roll over a bar, m/s, and its duration, s."""


def bar(height: float = 0.08, width: float = 0.05, x: float = 0.9) -> Terrain:
    """Return a level floor with a bar across it.

    Args:
        height: of the bar.
        width: of its top, along x.
        x: of its near face.

    Raises:
        ValueError: a height or width that is not positive.
    """
    if not height > 0.0 or not width > 0.0:
        raise ValueError(f"bar: height {height} and width {width} must be positive")
    edges = [(-2.0, x, 0.0), (x, x + width, height), (x + width, x + width + 4.0, 0.0)]
    regions = [
        Region(
            [
                [x0, -_HALF_WIDTH, z],
                [x1, -_HALF_WIDTH, z],
                [x1, _HALF_WIDTH, z],
                [x0, _HALF_WIDTH, z],
            ],
            **_SURFACE,
            group=f"level {z:g}",
        )
        for x0, x1, z in edges
    ]
    return Terrain(f"bar {100 * height:g} cm", tuple(regions))


def over_the_bar(
    width: float = 0.05, x: float = 0.9, beyond: float = 0.5, gait: Gait | None = None
) -> list[Task]:
    """Return the tasks that bring the robot over a bar: the front wheels step over, it rolls on, the rear do.

    Args:
        width: of the bar.
        x: of its near face.
        beyond: how far the rear wheels roll on behind it.
        gait: of the steps.
    """
    gait = Gait() if gait is None else gait
    landing = x + width + WHEEL_RADIUS + _BEHIND
    return [
        RollTo(x - WHEEL_RADIUS - _BEFORE, FRONT),
        StepTo(dict.fromkeys(FRONT, landing), gait),
        RollTo(x - WHEEL_RADIUS - _REAR_BEFORE, REAR),
        StepTo(dict.fromkeys(REAR, landing), gait),
        RollTo(landing + beyond, REAR),
    ]


def run_obstacle(
    height: float = 0.08, width: float = 0.05, gait: Gait | None = None, step: bool = True, **options: Any
) -> OmniRun:
    """Drive up to a bar, step over it, and drive on.

    Args:
        height: of the bar.
        width: of it, along the way.
        gait: of the steps.
        step: whether the robot steps; without it it tries to roll over the bar in wheeled mode.
        options: of :func:`wfbook.omni.simulate.run`: delay, noise, seed, payload, trunk_mass_scale, …
    """
    terrain = bar(height, width)
    if not step:
        return run(terrain, [(_ROLLING, [_SPEED, 0.0, 0.0])], **options)
    run_ = run(terrain, over_the_bar(width, gait=gait), **options)
    run_.metrics.update(lifts(run_))
    return run_


def run_jump(height: float = 0.08, distance: float = 0.0, **options: Any) -> OmniRun:
    """Drive, stop, jump, and drive on.

    Args:
        height: by which the centre of mass rises in the air.
        distance: ahead.
        options: of :func:`wfbook.omni.simulate.run`: delay, noise, seed, payload, trunk_mass_scale, …
    """
    tasks = [RollTo(0.3), Jump(Leap(height, distance)), RollTo(0.6 + distance)]
    run_ = run(flat(), tasks, **options)
    run_.metrics.update(flights(run_))
    return run_


def flights(run_: OmniRun) -> dict[str, Any]:
    """Return figures of a jump, all in metres and seconds.

    ``flight_s`` is for how long no wheel touched anything; ``com_rise_m`` by how much the centre of mass was
    higher than at the start, ``wheel_rise_m`` how high the lowest wheel was at best, and ``landing_miss_m``
    how far the wheels came down from where they should have, along the way, at worst.
    """
    flying = ~run_.stance.any(axis=1)
    free = flying & (run_.contact_force[:, :, 2].max(axis=1) < _TOUCHING)
    after = np.flatnonzero(flying)[-1] + _SETTLED if flying.any() else 0
    before = np.flatnonzero(flying)[0] - 1 if flying.any() else 0
    moved = run_.p[min(after, len(run_.t) - 1), :, 0] - run_.p[before, :, 0]
    wanted = sum(task["distance"] for task in run_.meta["course"] if "jump" in task)
    return {
        "flight_s": float(free.sum() * (run_.t[1] - run_.t[0])),
        "com_rise_m": float(run_.com[:, 2].max() - run_.com[0, 2]),
        "wheel_rise_m": float(run_.p[:, :, 2].min(axis=1).max()),
        "landing_miss_m": float(np.abs(moved - wanted).max()) if flying.any() else None,
    }


def lifts(run_: OmniRun) -> dict[str, Any]:
    """Return figures of a run's steps: the smallest margin of each lift, and the time in the air.

    The margin is the distance of the centre of mass to the nearest edge of the triangle of the wheels that
    the controller takes to stand, in metres.
    """
    margins, airtime = {}, {}
    for leg, name in enumerate(LEGS):
        lifted = np.flatnonzero(~run_.stance[:, leg])
        if lifted.size:
            margins[name] = float(min(margin(run_.com[i], run_.p[i], run_.stance[i]) for i in lifted))
            airtime[name] = float(lifted.size * (run_.t[1] - run_.t[0]))
    return {"lift_margin_m": margins, "airtime_s": airtime}
