"""A line of the comparison: what the paper reports, what came out here, and how sure that is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook.quoted import Quoted, quoted

if TYPE_CHECKING:
    from wfbook.paper.bench import Bench
    from wfbook.view.style import Picture


@dataclass(frozen=True)
class Record:
    """A figure of ours, beside the paper's if it has one.

    Attributes:
        what: the quantity, or what is stated.
        ours: its value; None if there was no plan or nothing to measure.
        unit: of it; "1" for ratios.
        paper: key of what the paper says (see :mod:`wfbook.quoted`), or None.
        holds: whether the paper's statement is true of ours; None for numbers.
        low: the least value over the seeds, for what was simulated.
        high: the largest.
        proof: what it rests on: the gap and status of a search, seeds of a simulation.
    """

    what: str
    ours: float | None
    unit: str = ""
    paper: str | None = None
    holds: bool | None = None
    low: float | None = None
    high: float | None = None
    proof: str = ""

    @property
    def quoted(self) -> Quoted | None:
        """What the paper says."""
        return None if self.paper is None else quoted(self.paper)

    def to_dict(self) -> dict[str, Any]:
        """Return the record in JSON's types, with the paper's number or words."""
        said = self.quoted
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "paper"}
        source = (
            {"key": said.key, "where": said.where, "says": said.says, "value": said.value} if said else None
        )
        return fields | {"paper": source}


def compared(key: str, ours: float | None, proof: str = "", runs: Sequence[float] = ()) -> Record:
    """Return our value beside a number of the paper's.

    Args:
        key: of the number.
        ours: in the paper's unit.
        proof: what ours rests on.
        runs: values over the seeds.
    """
    said = quoted(key)
    return Record(said.says, ours, said.unit, key, None, *_range(runs), proof)


def stated(key: str, holds: bool | None, ours: float | None, unit: str, proof: str = "") -> Record:
    """Return whether something that the paper states is true here, with the value that decides it."""
    return Record(quoted(key).says, ours, unit, key, holds, proof=proof)


def measured(what: str, ours: float | None, unit: str, proof: str = "", runs: Sequence[float] = ()) -> Record:
    """Return a value of ours that the paper has no counterpart for."""
    return Record(what, ours, unit, None, None, *_range(runs), proof)


def _range(runs: Sequence[float]) -> tuple[float | None, float | None]:
    return (float(np.min(runs)), float(np.max(runs))) if len(runs) else (None, None)


@dataclass
class Result:
    """What an experiment found.

    Attributes:
        records: in the order in which they are shown.
        settings: conditions that the paper leaves open, and those that it gives.
        lines: to be shown as they are, in columns.
        notes: what a reader must know about the comparison, a sentence each.
        troubles: what went wrong, a sentence each.
        pictures: by file name, functions that draw them.
    """

    records: list[Record] = field(default_factory=list)
    settings: dict[str, Any] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)
    pictures: "dict[str, Callable[[], Picture]]" = field(default_factory=dict)


@dataclass(frozen=True)
class Experiment:
    """Something of the paper that is done again.

    Attributes:
        name: on the command line.
        title: what it is.
        where: in the paper.
        run: does it.
        pictures: file names that it may draw.
        paper: keys of what the paper says about it.
    """

    name: str
    title: str
    where: str
    run: "Callable[[Bench], Result]"
    pictures: tuple[str, ...]
    paper: tuple[str, ...]
