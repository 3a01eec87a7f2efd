"""Chapter 0's widget: the same problem with and without wheels."""

import html
import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import ipywidgets

from wfbook.view import figures
from wfbook.view.widgets.panel import PANEL, image, table

if TYPE_CHECKING:
    from wfbook.planner import Plan, Problem, Progress

Planner = Callable[["Problem", Callable[["Progress"], None]], "Plan"]

_PATIENCE = 20.0
_COLUMNS = ("", "objective", "bound", "gap", "nodes", "swings", "distance", "planned in")


def best_executable(problem: "Problem", progress: Callable[["Progress"], None]) -> "Plan":
    """Search for the best plan that a robot can execute, no longer than a reader waits."""
    from wfbook import planner

    return planner.solve_executable(problem, time_limit=_PATIENCE, progress=progress)[1]


class WheelsToggle(ipywidgets.VBox):
    """Allow wheels: yes or no. Plans again and shows what changes.

    Args:
        problem: its end effectors are what the toggle overrides.
        plan: a plan of this very problem, shown first; without one, the widget begins by planning.
        planner: called with a problem and a function that it tells its progress; returns a plan.

    Attributes:
        allow_wheels: the checkbox; set its ``value`` to plan again.
        plan: the plan that is shown, None if there is none.
        status: what the planner is doing, or why it has no plan.
        comparison: one line for every answer so far.
        gait: the gait diagram.
        path: the path of the centre of mass.
    """

    def __init__(
        self, problem: "Problem", plan: "Plan | None" = None, planner: Planner = best_executable
    ) -> None:
        self._problem = problem
        self._planner = planner
        self._plans: dict[bool, Plan] = {}
        self.plan: Plan | None = None
        self.allow_wheels = ipywidgets.Checkbox(
            value="wheel" in problem.end_effectors, description="allow wheels", indent=False
        )
        self.status, self.comparison, self.gait, self.path = (ipywidgets.HTML() for _ in range(4))
        super().__init__([self.allow_wheels, self.status, self.comparison, self.gait, self.path])
        self.add_class(PANEL)
        if plan is not None:
            self._plans[self.allow_wheels.value] = plan
            self._list_plans()
        self._plan_again()
        self.allow_wheels.observe(self._plan_again, names="value")

    def plan_for(self, wheels: bool) -> "Plan":
        """Return the plan with or without wheels, from memory or from the planner."""
        if wheels not in self._plans:
            self.status.value = "planning …"
            end_effectors = ("foot", "wheel") if wheels else ("foot",)
            try:
                self._plans[wheels] = self._planner(
                    replace(self._problem, end_effectors=end_effectors), self._report
                )
            finally:
                self.status.value = ""
            self._list_plans()
        return self._plans[wheels]

    def _plan_again(self, _change: object = None) -> None:
        """Show the plan for the checkbox's value."""
        from wfbook.planner import InfeasibleError, NoPlanError

        try:
            self._show(self.plan_for(self.allow_wheels.value))
        except (InfeasibleError, NoPlanError) as error:
            self._refuse(f"No plan: {error}")
        except Exception as error:
            # A widget's errors go to a log that few readers open.
            self._refuse(f"{type(error).__name__}: {error}")
            raise

    def _report(self, search: "Progress") -> None:
        """Tell how far the search is."""
        best = f"{search.incumbent:.3f}" if math.isfinite(search.incumbent) else "none yet"
        self.status.value = (
            f"planning … {search.time:.1f} s, {search.nodes} nodes, best plan {best}, "
            f"nothing can be better than {search.bound:.3f}"
        )

    def _list_plans(self) -> None:
        """Write one line for every plan that is known."""
        names = ("feet only", "feet and wheels")
        rows = [_row(names[wheels], plan) for wheels, plan in sorted(self._plans.items())]
        self.comparison.value = table(_COLUMNS, rows)

    def _show(self, plan: "Plan") -> None:
        """Draw a plan."""
        self.plan = plan
        self.status.value = ""
        self.gait.value = image(figures.gait(plan), "gait diagram: what each leg stands on over time")
        self.path.value = image(figures.com_path(plan), "path of the centre of mass and contacts from above")

    def _refuse(self, message: str) -> None:
        """Show why there is no plan, in the place of what would belong to another one."""
        self.plan = None
        self.status.value = f'<b role="alert">{html.escape(message)}</b>'
        self.gait.value = self.path.value = ""


def _row(name: str, plan: "Plan") -> tuple[str, ...]:
    meta = plan.meta
    return (
        name,
        f"{meta['objective']:.3f}",
        f"{meta['bound']:.3f}",
        f"{100.0 * meta['gap']:.2f} %",
        str(meta["nodes"]),
        str(int(plan.S.sum())),
        f"{plan.distance:.2f} m",
        f"{meta['solve_time']:.1f} s",
    )
