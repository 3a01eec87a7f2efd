"""What the widgets of chapters 6 and 8 share: a button that simulates, a replay, a table of all runs."""

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Any

import ipywidgets

from wfbook.view.replay import Replay
from wfbook.view.widgets.panel import Panel, table

if TYPE_CHECKING:
    from wfbook.simulate import Run

Told = Callable[[float, float], None]
"""Called with simulated and total time."""

_HEIGHT = 380


def verdict(run: "Run") -> str:
    """Return how a run ended."""
    fall = run.metrics["fall_time_s"]
    return "upright" if fall is None else f"fell at {fall:.2f} s"


class Simulating(Panel):
    """A panel whose answer is a run that must be simulated; its button does that.

    A subclass says what its controls ask (:attr:`asked`), simulates it (:meth:`run_of`), draws what is known
    before (:meth:`preview`) and after (:meth:`draw`), and writes a row of the table (:meth:`row`).

    Args:
        controls: of what is asked.
        pictures: as for :class:`Panel`.
        columns: of the table.
        known: runs that there are already, by what was asked.

    Attributes:
        button: its ``click`` simulates what the controls ask now.
        run: the run that is shown, None if there is none.
        results: all runs, by what was asked.
        replay: shows the run in 3D.
        history: one line for each run.
    """

    def __init__(
        self,
        controls: Sequence[ipywidgets.Widget],
        pictures: Sequence[str],
        columns: Sequence[str],
        known: "dict[Any, Run] | None" = None,
    ) -> None:
        self._columns = tuple(columns)
        self.run: Run | None = None
        self.results: dict[Hashable, Run] = dict(known or {})
        self.button = ipywidgets.Button(description="Simulate", button_style="primary", icon="play")
        self.history, self.replay = ipywidgets.HTML(), ipywidgets.HTML()
        super().__init__([*controls, self.button], pictures)
        self.children = (*self.children[:2], self.history, self.replay, *self.children[2:])
        self.button.on_click(self._pressed)
        self._tell()

    @property
    def asked(self) -> Hashable | None:
        """What the controls ask now; None if it can't be simulated."""
        raise NotImplementedError

    def run_of(self, asked: Any, told: Told) -> "Run":
        """Simulate what is asked."""
        raise NotImplementedError

    def preview(self) -> None:
        """Show what is known before a simulation, and say what to do."""
        raise NotImplementedError

    def draw(self, run: "Run") -> None:
        """Show the pictures of a run, and say how it went."""
        raise NotImplementedError

    def row(self, asked: Any, run: "Run") -> tuple[str, ...]:
        """Return a line of the table."""
        raise NotImplementedError

    def redraw(self) -> None:
        """Show the run of what the controls ask; if there is none, what is known without it."""
        run = self.results.get(self.asked)
        if run is not None:
            self._show(run)
            return
        self._clear()
        self.preview()

    def simulate(self) -> "Run":
        """Simulate what the controls ask, or take its run from memory, and show it.

        Raises:
            ValueError: there is nothing to simulate.
        """
        asked = self.asked
        if asked is None:
            raise ValueError("there is no plan for this choice")
        if asked not in self.results:
            self.results[asked] = self.run_of(asked, self._report)
            self._tell()
        self._show(self.results[asked])
        return self.results[asked]

    def _pressed(self, _button: object = None) -> None:
        if self.asked is None:
            return  # what is said above the pictures stays
        self.button.disabled = True
        try:
            self.simulate()
        except Exception as error:
            # A widget's errors go to a log that few readers open.
            self._clear()
            self.warn(f"{type(error).__name__}: {error}")
            raise
        finally:
            self.button.disabled = False

    def _report(self, time: float, total: float) -> None:
        self.say(f"simulating … {time:.1f} of {total:.1f} s")

    def _clear(self) -> None:
        """Take away what belongs to another run."""
        self.run, self.replay.value = None, ""
        self.pictures.clear()
        for view in self.views.values():
            view.value = ""

    def _tell(self) -> None:
        rows = [self.row(asked, run) for asked, run in self.results.items()]
        self.history.value = table(self._columns, rows) if rows else ""

    def _show(self, run: "Run") -> None:
        self.run = run
        self.replay.value = Replay(run, height=_HEIGHT)._repr_html_()
        self.draw(run)
