"""How text names equations, and how such names are read.

    Paper A, eq. 12        Paper B, eqs 12–15        Paper A, eqs 10–12 and 15        Paper B, after eq. 21

With its paper the name is *full*. In a docstring's first paragraph a full name is a claim: this function is
that equation. A short name (``eq. 12``) only speaks of an equation, of the paper that was named last.
"""

import re
from dataclasses import dataclass

from wfbook.equations.titles import Equation

_NUMBERS = r"\d+(?:(?:–| to |, and | and |, )\d+)*"
_NAMED = re.compile(
    r"(?:\bPaper (?P<paper>[AB]), (?P<after>after )?)?"
    rf"(?:\b[Ee]q\. (?P<one>\d+)|\b[Ee]quation (?P<spelt>\d+)|\b(?:[Ee]qs|[Ee]quations) (?P<many>{_NUMBERS}))"
)
_ODD = re.compile(r"\b(?:[Ee]qs?|[Ee]quations?)\b\.?[ ~]?\(?\d+|\b[Pp]aper'?s? eq", re.ASCII)


@dataclass(frozen=True)
class Citation:
    """An equation that a text names.

    Attributes:
        equation: which; its number may be one that the paper does not have.
        full: whether with its paper, as a claim is, and not as what something comes after.
    """

    equation: Equation
    full: bool


def citations(text: str, paper: str) -> list[Citation]:
    """Read the equations that a text names, in order.

    Args:
        text: any; line breaks are spaces.
        paper: ``"A"`` or ``"B"``, of short names before the first full one.
    """
    found = []
    for match in _NAMED.finditer(_flat(text)):
        paper = match["paper"] or paper
        full = bool(match["paper"]) and not match["after"]
        listed = match["one"] or match["spelt"] or match["many"]
        found += [Citation(Equation(paper, number), full) for number in _numbers(listed)]
    return found


def oddly_named(text: str) -> list[str]:
    """Return what looks like the name of an equation but is not written like one."""
    left = _NAMED.sub("", _flat(text))
    return [match[0] for match in _ODD.finditer(left)]


def _flat(text: str) -> str:
    return " ".join(text.split())


def _numbers(listed: str) -> list[int]:
    """Return the numbers of a list such as ``10–12 and 15``."""
    numbers: list[int] = []
    for part in re.split(r", and | and |, ", listed):
        first, *last = (int(end) for end in re.split(r"–| to ", part))
        numbers += range(first, (last[-1] if last else first) + 1)
    return numbers
