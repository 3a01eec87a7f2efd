"""One meaning per colour, in every figure and every replay of the book.

The colours are Okabe and Ito's, which readers with any common colour blindness can tell apart.
"""

import io
from typing import Any

from matplotlib.figure import Figure

FOOT = "#009E73"
WHEEL = "#E69F00"
SWING = "#E4E4E4"
PLANNED = "#0072B2"
MEASURED = "#222222"
ESTIMATED = "#56B4E9"
FORCE = "#CC79A7"
LIMIT = "#D55E00"  # what may not be crossed: friction, torque, time
PAPER = "#FFFFFF"
INK = "#222222"
BODY = "#8A919C"
PALE = "#BBBBBB"
LIMIT = "#D55E00"  # what may not be crossed, and what crosses it: red says stop
HAND = "#882255"  # where an arm's hand is; wine, after Tol: Okabe and Ito's eight are spoken for
RELAXED = "#F0E442"  # what a relaxation allows besides the truth: the one hue that nothing else has

SWINGING = 2
"""Mode of a leg in the air, beside the end effectors' 0 (foot) and 1 (wheel)."""

MODE_COLOURS = (FOOT, WHEEL, SWING)
MODE_NAMES = ("foot", "wheel", "swing")

_SCREEN_DPI = 96


class Picture(Figure):
    """A matplotlib figure that a notebook shows when a cell returns it, without pyplot or a magic.

    The background is white in every theme: a transparent one leaves dark labels on a dark page.
    """

    def __init__(self, width: float = 8.0, height: float = 3.0, **options: Any) -> None:
        super().__init__(figsize=(width, height), dpi=_SCREEN_DPI, layout="constrained", **options)
        self.set_facecolor(PAPER)

    def png(self, scale: float = 2.0) -> bytes:
        """Return the figure as a PNG, ``scale`` pixels for each pixel of the screen.

        The bytes carry neither date nor version: they change only when the picture does.
        """
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=scale * _SCREEN_DPI, metadata={"Software": None})
        return buffer.getvalue()

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Show in a notebook, sharp on dense screens."""
        width, height = self.get_size_inches() * _SCREEN_DPI
        return self.png(), {"width": round(width), "height": round(height)}


def tidy(axes: Any) -> None:
    """Take away from ``axes`` what carries no information: two spines and the heavy grid."""
    axes.set_facecolor(PAPER)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.grid(True, color="#EEEEEE", linewidth=0.8)
    axes.set_axisbelow(True)


def hex_to_int(colour: str) -> int:
    """Return ``"#RRGGBB"`` as the integer that Meshcat wants."""
    return int(colour.removeprefix("#"), 16)
