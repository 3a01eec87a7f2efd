"""The widget is driven by setting its traits; the planner is a stand-in that answers at once."""

import base64
import inspect

import ipywidgets
import numpy as np
import pytest
from view_cases import KIND, small_plan

from wfbook.planner import InfeasibleError, NoPlanError, Problem, Progress
from wfbook.terrain import flat
from wfbook.view import figures
from wfbook.view.widgets import WheelsToggle


class Planner:
    """Remembers what it was asked and answers with a plan written by hand."""

    def __init__(self, error=None):
        self.asked, self.error = [], error

    def __call__(self, problem, progress):
        self.asked.append(tuple(problem.end_effectors))
        progress(Progress(nodes=3, incumbent=np.inf, bound=1.5, gap=np.inf, time=0.5))
        if self.error:
            raise self.error
        return small_plan(kind=KIND if "wheel" in problem.end_effectors else np.zeros((4, 5)))


@pytest.fixture
def problem():
    return Problem(flat(), goal=(0.3, 0.0), slots=5)


def test_it_plans_at_once_with_what_the_problem_allows(problem):
    planner = Planner()
    widget = WheelsToggle(problem, planner=planner)
    assert planner.asked == [("foot", "wheel")] and widget.allow_wheels.value
    drawn = base64.b64encode(figures.gait(small_plan()).png()).decode()
    assert drawn in widget.gait.value and "alt=" in widget.gait.value


def test_taking_the_wheels_away_plans_again_and_redraws(problem):
    planner = Planner()
    widget = WheelsToggle(problem, planner=planner)
    before = widget.gait.value, widget.path.value
    widget.allow_wheels.value = False
    assert planner.asked[-1] == ("foot",)
    assert widget.plan.end_effector.max() == 0
    assert widget.gait.value != before[0] and widget.path.value != before[1]
    for word in ("feet only", "feet and wheels", "2.000", "1.998", "0.10 %"):
        assert word in widget.comparison.value


def test_an_answer_is_not_computed_twice(problem):
    planner = Planner()
    widget = WheelsToggle(problem, plan=small_plan(), planner=planner)
    assert planner.asked == [], "the plan was given"
    for value in (False, True, False):
        widget.allow_wheels.value = value
    assert planner.asked == [("foot",)]


def test_asking_for_the_other_plan_leaves_the_picture_alone(problem):
    widget = WheelsToggle(problem, plan=small_plan(), planner=Planner())
    before = widget.gait.value
    assert widget.plan_for(wheels=False).end_effector.max() == 0
    assert widget.gait.value == before and widget.status.value == ""
    assert "feet only" in widget.comparison.value and "feet and wheels" in widget.comparison.value


def test_progress_is_shown_while_it_plans(problem):
    seen = []
    widget = WheelsToggle(problem, plan=small_plan(), planner=Planner())
    widget.status.observe(lambda change: seen.append(change["new"]), names="value")
    widget.allow_wheels.value = False
    assert any("3 nodes" in text and "1.500" in text for text in seen) and seen[-1] == ""


@pytest.mark.parametrize("error", [InfeasibleError(("reach",)), NoPlanError("<b>60 s</b>")])
def test_no_plan_is_an_answer(problem, error):
    widget = WheelsToggle(problem, plan=small_plan(), planner=Planner(error))
    widget.allow_wheels.value = False
    assert "No plan" in widget.status.value and widget.plan is None
    assert widget.gait.value == widget.path.value == "", "no picture of another problem's plan"
    assert "<b>60" not in widget.status.value, "messages are escaped"
    widget.allow_wheels.value = True
    assert widget.status.value == "" and widget.gait.value


def test_an_unexpected_error_is_shown_and_raised(problem):
    widget = WheelsToggle(problem, plan=small_plan(), planner=Planner(RuntimeError("broken")))
    with pytest.raises(RuntimeError, match="broken"):
        widget.allow_wheels.value = False
    assert "RuntimeError: broken" in widget.status.value


def test_it_shows_itself_in_a_notebook(problem):
    widget = WheelsToggle(problem, plan=small_plan(), planner=Planner())
    shown = widget._repr_mimebundle_()
    assert shown["application/vnd.jupyter.widget-view+json"]["model_id"] == widget.model_id


def test_no_method_hides_one_of_ipywidgets():
    own = {name for name, value in vars(WheelsToggle).items() if inspect.isfunction(value)} - {"__init__"}
    assert own and not own & set(dir(ipywidgets.VBox))
