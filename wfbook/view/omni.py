"""Figures of a run of part II: what its wheels do over time, and how still its hand is meanwhile."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import median_filter

from wfbook.modes import LEGS
from wfbook.omni.merits import hand_rpy, hand_rpy_ref, lifted
from wfbook.omni.robot import STEERS_V, WHEEL_RADIUS, WHEELS_V
from wfbook.view.figures import draw_gait
from wfbook.view.style import HAND, INK, LIMIT, MODE_COLOURS, PLANNED, SWINGING, Picture, tidy

if TYPE_CHECKING:
    from wfbook.omni.runs import OmniRun

_ROLLS = 0.02
"""Speed over the ground, m/s, below which a wheel stands."""
_STEADY = 21
"""Samples over which what a wheel does is the most frequent: 0.2 s."""
_ARROWS = 24
"""Along the time axis, at most."""
_NAMES = ("stands", "rolls", "swings")


def wheel_modes(run: "OmniRun") -> np.ndarray:
    """Return what each wheel does, ``(N, 4)``: 0 stands, 1 rolls, 2 swings."""
    rolls = np.abs(WHEEL_RADIUS * run.qvel[:, WHEELS_V]) > _ROLLS
    steady = median_filter(rolls.astype(int), (_STEADY, 1), mode="nearest")
    return np.where(lifted(run), SWINGING, steady)


def gait(run: "OmniRun", title: str | None = None) -> Picture:
    """Draw which wheel stands, rolls or swings over time, and how far the hand is from its target.

    Args:
        run: to draw.
        title: above the picture.

    Returns:
        Above, a bar for every stretch of each wheel; arrows show where it rolls, seen from above, ahead
        being up. Below, the hand's error in height, and in roll, pitch and yaw.
    """
    figure = Picture(8.0, 5.0)
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(1.5, 1.0, 1.0))
    modes = wheel_modes(run)
    draw_gait(top, np.append(run.t, 2 * run.t[-1] - run.t[-2]), modes.T)
    _arrows(top, run, modes)
    top.set_ylabel("wheel")
    middle.plot(run.t, 1e3 * (run.hand - run.hand_ref)[:, 2], color=HAND, linewidth=1.2, gid="height")
    middle.set_ylabel("hand, height\nerror (mm)")
    turned = 1e3 * (hand_rpy(run) - hand_rpy_ref(run))
    for axis, (name, stroke) in enumerate(zip(("roll", "pitch", "yaw"), ("-", "--", ":"), strict=True)):
        bottom.plot(run.t, turned[:, axis], color=HAND, linestyle=stroke, linewidth=1.2, label=name, gid=name)
    bottom.set_ylabel("hand, angle\nerror (mrad)")
    bottom.set_xlabel("time (s)")
    bottom.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    for axes, least in ((middle, 1.0), (bottom, 2.0)):
        tidy(axes)
        axes.axhline(0.0, color=PLANNED, linewidth=1.0, zorder=1)
        reach = max(least, 1.1 * max(float(np.abs(line.get_ydata()).max()) for line in axes.lines))
        axes.set_ylim(-reach, reach)
    for when, what in run.events:
        for axes in (top, middle, bottom):
            axes.axvline(when, color=LIMIT, linewidth=1.5, gid="event")
        middle.annotate(
            what.split(":")[0], (when, 0.9), xycoords=("data", "axes fraction"), color=LIMIT, ha="right",
            va="top", xytext=(-4, 0), textcoords="offset points",
        )  # fmt: skip
    top.set_xlim(run.t[0], run.t[-1])
    used = sorted(set(np.unique(modes).tolist()))
    handles: list[Any] = [Patch(color=MODE_COLOURS[mode], label=_NAMES[mode]) for mode in used]
    if 1 in used:
        handles.append(Line2D([], [], color=INK, marker=r"$\uparrow$", linestyle="", label="ahead"))
    top.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    if title:
        top.set_title(title, loc="left", color=INK)
    return figure


def _arrows(axes: Any, run: "OmniRun", modes: np.ndarray) -> None:
    """Draw where each wheel rolls, at equal times, on its bar."""
    at = np.linspace(0, len(run.t) - 1, _ARROWS + 2).astype(int)[1:-1]
    for wheel in range(len(LEGS)):
        rolling = at[modes[at, wheel] == 1]
        angle = run.qpos[rolling, 1 + STEERS_V[wheel]]
        sign = np.sign(run.qvel[rolling, WHEELS_V[wheel]])
        axes.quiver(
            *(run.t[rolling], np.full(len(rolling), wheel), -sign * np.sin(angle), sign * np.cos(angle)),
            **{"angles": "uv", "pivot": "middle", "units": "dots", "scale_units": "inches", "scale": 6.5},
            **{"width": 1.6, "color": INK, "gid": f"{LEGS[wheel]} ways"},
        )
