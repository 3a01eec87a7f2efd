"""What can be disturbed: names, units, ranges, and the values that a study takes if it is not told."""

import argparse
import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Axis:
    """A factor of the study.

    Attributes:
        name: on the command line.
        unit: of its values; empty for a factor.
        text: what it is.
        least, most: its range.
        usual: the value where nothing else is asked; None is drawn from each run's seed.
        levels: of a sweep or a grid that names none.
        whole: whether only whole numbers are possible.
        above: whether ``least`` itself is not.
    """

    name: str
    unit: str
    text: str
    least: float
    most: float
    usual: float | None
    levels: tuple[float, ...]
    whole: bool = False
    above: bool = False

    @property
    def column(self) -> str:
        """Name of the column in the results: with its unit."""
        units = {"N": "n", "N m": "nm", "degrees": "deg"}
        return self.name + (f"_{units.get(self.unit, self.unit)}" if self.unit else "")

    @property
    def label(self) -> str:
        """What stands at an axis of a figure, or over a column."""
        name = self.name.replace("_", " ")
        return f"{name} ({self.unit})" if self.unit else f"{name} (factor)"

    @property
    def range(self) -> str:
        """The range as text."""
        bounds = f"{'above ' if self.above else ''}{self.least:g} to {self.most:g}"
        return f"{bounds} {self.unit}".rstrip() + (", whole" if self.whole else "")

    def read(self, text: str) -> float:
        """Read a value.

        Raises:
            argparse.ArgumentTypeError: it is no number, or out of range.
        """
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        inside = self.least <= value <= self.most and not (self.above and value == self.least)
        if not inside or (self.whole and value != round(value)):
            raise argparse.ArgumentTypeError(f"{self.name}: must be {self.range}, is {text!r}")
        return value + 0.0  # no negative zero


_ALL = (
    Axis("push", "N", "horizontal force on the trunk", 0, 1000, 0.0, (0, 10, 20, 30, 40, 60)),
    Axis(
        *("push_angle", "degrees", "its direction, 0 forwards and 90 to the left"),
        *(-360, 360, None, (0, 45, 90, 135, 180, 225, 270, 315)),
    ),
    Axis("push_start", "s", "its start after the plan's", 0, 100, None, (0.3, 0.6, 0.9, 1.2, 1.5, 1.8)),
    Axis("push_duration", "s", "how long it lasts", 0, 10, 0.2, (0.05, 0.1, 0.2, 0.4), above=True),
    Axis("delay", "ms", "after which a torque acts", 0, 100, 9.0, (0, 4, 9, 14, 18, 22), whole=True),
    Axis("joint_friction", "N m", "dry, in every motor's joint", 0, 10, 0.0, (0, 0.1, 0.2, 0.4, 0.6, 0.8)),
    Axis(
        *("ground_friction", "", "of feet, and of wheels sideways, over what the plan was made for"),
        *(0, 10, 1.0, (0.2, 0.3, 0.4, 0.6, 0.8, 1.0)),
    ),
    Axis("trunk_mass", "", "over the usual", 0.1, 10, 1.0, (0.8, 1.0, 1.2, 1.4, 1.6, 2.0)),
    Axis("sensor_noise", "", "noise and biases over the usual", 0, 1000, 1.0, (0, 1, 2, 4, 8, 16)),
    Axis(
        *("terrain_error", "mm", "patches of the real ground are so much higher or lower at most"),
        *(0, 200, 0.0, (0, 5, 10, 15, 20, 30)),
    ),
)

AXES = {axis.name: axis for axis in _ALL}
"""By name. ``ground_friction`` 0 is ice without any friction."""

ONLY_PUSHED = ("push_angle", "push_start", "push_duration")
"""Axes without effect unless there is a push."""

Levels = tuple[Axis, tuple[float, ...]]


def levels(text: str) -> Levels:
    """Read ``AXIS`` or ``AXIS=VALUE,VALUE,…``; values are sorted, and each stands once.

    Raises:
        argparse.ArgumentTypeError: unknown axis or wrong value.
    """
    name, equals, values = text.partition("=")
    axis = _axis(name)
    if not equals:
        return axis, tuple(map(float, axis.levels))
    return axis, tuple(sorted({axis.read(value) for value in values.split(",")}))


def setting(text: str) -> tuple[Axis, float]:
    """Read ``AXIS=VALUE``.

    Raises:
        argparse.ArgumentTypeError: unknown axis or wrong value.
    """
    name, _, value = text.partition("=")
    axis = _axis(name)
    return axis, axis.read(value)


def _axis(name: str) -> Axis:
    if name not in AXES:
        raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(AXES)}")
    return AXES[name]
