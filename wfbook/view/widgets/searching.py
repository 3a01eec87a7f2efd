"""What widgets that search for a plan share: a button, progress drawn while it runs, and a clean end.

A search blocks the kernel for some seconds. What it tells of its progress is drawn while it runs; *Interrupt*
ends it, and what was found until then is shown.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import ipywidgets

from wfbook.view import figures
from wfbook.view.drawings import planning as drawings
from wfbook.view.widgets.panel import Panel

if TYPE_CHECKING:
    from wfbook.planner import Plan, Problem, Progress

Told = Callable[["Progress"], None]
Planner = Callable[["Problem", Told], "Plan"]

_REDRAW = 0.4  # seconds between two pictures of a search; each takes a tenth of a second
_PATIENCE = 10.0


@dataclass(frozen=True)
class Outcome:
    """What came of a search: a plan, or in words why there is none."""

    plan: "Plan | None"
    trace: "tuple[Progress, ...]"
    why: str = ""
    details: tuple[Any, ...] = ()


def watched(search: Callable[[Told], "Plan"], told: Told | None = None) -> "tuple[Plan, list[Progress]]":
    """Run a search and keep what it tells.

    Args:
        search: called with a function that it is to tell its progress; returns a plan.
        told: told as well, while it runs.

    Returns:
        The plan, and the progress until the end of the search.
    """
    from wfbook.planner import Progress

    trace: list[Progress] = []

    def note(progress: Progress) -> None:
        trace.append(progress)
        if told is not None:
            told(progress)

    plan = search(note)
    meta = plan.meta
    names = ("nodes", "objective", "bound", "gap", "solve_time")
    trace.append(Progress(*(meta[name] for name in names)))
    return plan, trace


class Searching(Panel):
    """A panel whose answer is a plan that must be searched for; its button starts the search.

    Args:
        controls: of what is asked.
        pictures: as for :class:`Panel`; "search" is drawn while it runs.
        planner: called with a problem and a function that it tells its progress; returns a plan.

    Attributes:
        button: its ``click`` searches for what the controls ask now.
        plan: the plan that is shown, None if there is none.
        outcome: what came of the last search.
    """

    def __init__(
        self, controls: Sequence[ipywidgets.Widget], pictures: Sequence[str], planner: Planner
    ) -> None:
        self._planner = planner
        self._found: dict[tuple, Outcome] = {}
        self._drawn = -math.inf
        self.plan: Plan | None = None
        self.outcome: Outcome | None = None
        self.button = ipywidgets.Button(description="Plan", button_style="primary", icon="play")
        super().__init__([*controls, self.button], pictures)
        self.button.on_click(self.search)

    @property
    def asked(self) -> "Problem":
        """The problem that the controls ask now."""
        raise NotImplementedError

    def key(self) -> tuple:
        """Return the controls' values: what an answer is remembered by."""
        raise NotImplementedError

    def draw(self, outcome: Outcome) -> None:
        """Show a plan, or why there is none."""
        raise NotImplementedError

    def redraw(self) -> None:
        """Show what is known of the controls' present values; the first time, search."""
        if self.key() in self._found:
            self._show(self._found[self.key()])
        elif self.outcome is None:
            self.search()
        else:
            self.say("Not planned yet: press Plan. The pictures are still those of the plan before.")

    def search(self, _button: object = None) -> None:
        """Search for a plan, drawing how incumbent and bound close in on each other."""
        from wfbook.planner import InfeasibleError, NoPlanError

        key, trace = self.key(), []

        def told(progress: "Progress") -> None:
            trace.append(progress)
            self._watch(trace)

        self.button.disabled = True
        self.say("planning …")
        try:
            plan, whole = watched(lambda told: self._planner(self.asked, told), told)
            outcome = Outcome(plan, tuple(whole))
        except (InfeasibleError, NoPlanError, ValueError) as error:
            outcome = Outcome(None, tuple(trace), str(error), getattr(error, "details", ()))
        except KeyboardInterrupt:
            self.outcome = self.plan = None
            self.warn("Interrupted before there was a plan. Press Plan to begin again.")
            return
        except Exception as error:
            self.warn(f"{type(error).__name__}: {error}")
            raise
        finally:
            self.button.disabled = False
        if plan_is_final(outcome):
            self._found[key] = outcome
        self._show(outcome)

    def _watch(self, trace: "Sequence[Progress]") -> None:
        """Tell and draw where a search stands."""
        last = trace[-1]
        best = f"{last.incumbent:.3f}" if math.isfinite(last.incumbent) else "none yet"
        gap = f"{last.gap:.1%}" if math.isfinite(last.gap) else "open"
        self.say(
            f"planning … {last.time:.1f} s, {last.nodes} nodes, best plan {best}, bound {last.bound:.3f}, "
            f"gap {gap}"
        )
        now = time.perf_counter()
        if "search" in self.views and now - self._drawn > _REDRAW:
            self.show("search", drawings.convergence({"search": trace}), "the search so far")
            self._drawn = time.perf_counter()

    def _show(self, outcome: Outcome) -> None:
        self.outcome, self.plan = outcome, outcome.plan
        if outcome.plan is None:
            self.warn(f"No plan. {outcome.why}")
        else:
            meta = outcome.plan.meta
            self.say(
                f"{meta['status']}: cost {meta['objective']:.4f}, no plan below {meta['bound']:.4f}, "
                f"gap {meta['gap']:.2%}, {meta['nodes']} nodes in {meta['solve_time']:.1f} s"
            )
        self.draw(outcome)

    def _draw_plan(self, plan: "Plan") -> None:
        """Draw gait and path."""
        self.show("gait", figures.gait(plan), "gait diagram: what each leg stands on over time")
        self.show("path", figures.com_path(plan), "path of the centre of mass and contacts from above")


def plan_is_final(outcome: Outcome) -> bool:
    """Tell whether a search came to its own end: what was interrupted may be asked again."""
    return outcome.plan is None or outcome.plan.meta["status"] != "interrupted"


def plan_for(problem: "Problem", told: Told) -> "Plan":
    """Search for the best plan, no longer than a reader waits."""
    from wfbook import planner

    return planner.solve(problem, time_limit=_PATIENCE, progress=told)


def switch(name: str, value: bool = True) -> ipywidgets.Checkbox:
    """Return a checkbox as wide as its name."""
    layout = ipywidgets.Layout(width="auto", margin="0 14px 0 0")
    return ipywidgets.Checkbox(value=value, description=name, indent=False, layout=layout)
