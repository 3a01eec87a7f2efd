"""Chapter 5's widgets and drawings: set up, searched, interrupted, and read from what was drawn."""

from dataclasses import replace

import numpy as np
import pytest

from wfbook import terrain
from wfbook.planner import OPTIONAL, InfeasibleError, NoPlanError, Problem, Progress, Reason, solve, stored
from wfbook.view.drawings import planning as drawings
from wfbook.view.widgets import searching
from wfbook.view.widgets.planning import DEMANDS, Conflicts, FormulationRace, LiveSearch, TreeWalk
from wfbook.view.widgets.searching import Searching, watched

SMALL = Problem(terrain.flat(rolling_resistance=0.02), goal=(0.3, 0.0), slots=3)
FEET = Problem(terrain.flat(), goal=(0.2, 0.0), slots=2, end_effectors=("foot",))


def drawn(picture, gid: str) -> list:
    """The lines of a picture with a name."""
    return [line for axes in picture.axes for line in axes.lines if line.get_gid() == gid]


_KNOWN = {}


class Told:
    """A planner that solves small problems once and remembers what it was asked."""

    def __init__(self, error: BaseException | None = None):
        self.asked, self.error = [], error

    def __call__(self, problem, told):
        self.asked.append(problem)
        told(Progress(3, np.inf, 0.2, np.inf, 0.1))
        if self.error is not None:
            raise self.error
        told(Progress(4, 0.5, 0.25, 0.5, 0.2))
        key = (tuple(problem.end_effectors), tuple(problem.without))
        if key not in _KNOWN:
            _KNOWN[key] = solve(replace(SMALL, end_effectors=key[0], without=key[1]), gap=0.02)
        return _KNOWN[key]


def test_a_live_search_draws_its_plan_and_its_proof():
    solved = Told()
    widget = LiveSearch(SMALL, planner=solved)
    assert len(solved.asked) == 1 and solved.asked[0].without == ()
    (incumbent,), (bound,) = (drawn(widget.pictures["search"], f"search {n}") for n in ("incumbent", "bound"))
    assert incumbent.get_ydata()[-1] == pytest.approx(widget.plan.meta["objective"])
    assert bound.get_ydata()[-1] == pytest.approx(widget.plan.meta["bound"])
    both = np.array([bound.get_ydata(), incumbent.get_ydata()])
    assert (both[0] <= both[1] + 1e-9)[~np.isnan(both[1])].all()
    swings = [b for b in widget.pictures["gait"].axes[0].patches if str(b.get_gid()).endswith("swing")]
    width = sum(bar.get_width() for bar in swings)
    assert width == pytest.approx(widget.plan.S.sum() * SMALL.slot_duration)
    assert "optimal: cost" in widget.status.value and "as it was" in widget.table.value


def test_nothing_is_searched_until_the_button_is_pressed():
    solved = Told()
    widget = LiveSearch(SMALL, planner=solved)
    before = widget.views["gait"].value
    widget.groups["friction"].value = False
    assert len(solved.asked) == 1 and "press Plan" in widget.status.value
    assert widget.views["gait"].value == before
    widget.button.click()
    assert solved.asked[1].without == ("friction",) and "no friction" in widget.table.value
    widget.groups["friction"].value = True
    assert len(solved.asked) == 2 and "optimal: cost" in widget.status.value, "the first answer is known"


def test_every_switch_and_slider_reaches_the_problem():
    widget = LiveSearch(SMALL, planner=Told())
    assert widget.asked.without == () and widget.asked.weights == SMALL.weights
    for name in OPTIONAL:
        widget.groups[name].value = False
    assert widget.asked.without == tuple(OPTIONAL)
    widget.groups["wheels"].value = widget.groups["swing limit"].value = False
    assert widget.asked.end_effectors == ("foot",)
    assert max(map(len, widget.asked.patterns)) == 3 and len(widget.asked.patterns) == 15
    for name in widget.WEIGHTS:
        widget.weights[name].value = 10.0
        assert getattr(widget.asked.weights, name) == pytest.approx(10 * getattr(SMALL.weights, name))
    widget.slots.value, widget.goal.value = 5, 1.2
    assert (widget.asked.slots, widget.asked.goal, widget.asked.beyond_reach) == (5, (1.2, 0.0), True)


def test_the_table_tells_what_leaving_friction_out_buys():
    widget = LiveSearch(SMALL, planner=Told())
    widget.groups["friction"].value = False
    widget.button.click()
    push = widget.COLUMNS.index("μ the wheels need along t")
    rows = [row.split("</td>") for row in widget.table.value.split("<tr>")[2:]]
    numbers = [float(row[push].rsplit(">", 1)[1]) for row in rows]
    assert numbers[0] == 0.0 and numbers[1] > 0.0, "a passive wheel pushes when nobody forbids it"


def test_a_real_search_is_drawn_while_it_runs(monkeypatch):
    monkeypatch.setattr(searching, "_REDRAW", 0.1)
    seen = []
    shown = Searching.show

    def noted(self, name, *rest):
        seen.append(name)
        shown(self, name, *rest)

    monkeypatch.setattr(Searching, "show", noted)
    widget = LiveSearch(replace(SMALL, end_effectors=("foot",)))
    assert seen.count("search") > 1 and widget.plan.meta["status"] == "optimal"
    assert widget.outcome.trace[-1].gap <= 1.01e-3


def test_an_interrupt_leaves_a_clean_widget():
    planner = Told(KeyboardInterrupt())
    widget = LiveSearch(SMALL, planner=planner)
    assert "Interrupted before there was a plan" in widget.status.value
    assert widget.plan is None and not widget.button.disabled and not widget.pictures
    planner.error = None
    widget.button.click()
    assert widget.plan is not None and "optimal: cost" in widget.status.value


def test_what_was_found_until_an_interrupt_is_shown_but_not_kept():
    full = Told()(SMALL, lambda _: None)
    half = full.with_meta(status="interrupted", bound=0.1, gap=0.7)
    answers = iter([half, full])
    widget = LiveSearch(SMALL, planner=lambda problem, told: next(answers))
    assert "interrupted: cost" in widget.status.value and "gait" in widget.pictures
    widget.button.click()
    assert "optimal: cost" in widget.status.value


@pytest.mark.parametrize("error", [NoPlanError("<b>late</b>"), ValueError("goal: too far")])
def test_no_plan_is_told_in_place_of_the_pictures(error):
    widget = LiveSearch(SMALL, planner=Told(error))
    assert "No plan." in widget.status.value and "<b>late" not in widget.status.value
    assert "gait" not in widget.pictures and "no plan" in widget.table.value
    assert not widget.button.disabled


def test_an_unexpected_error_is_shown_and_raised():
    planner = Told()
    widget = LiveSearch(SMALL, planner=planner)
    planner.error = RuntimeError("broken")
    widget.slots.value = 4
    with pytest.raises(RuntimeError, match="broken"):
        widget.search()
    assert "RuntimeError: broken" in widget.status.value and not widget.button.disabled


def test_conflicting_demands_name_what_is_to_blame():
    reason = Reason("step", "steps are <short>", ("FL", "RR"), missing=0.031)
    planner = Told()
    widget = Conflicts(SMALL, held=("no wheels",), planner=planner)
    assert planner.asked[0].end_effectors == ("foot",) and "gait" in widget.pictures
    planner.error = InfeasibleError(("goal", "step"), details=(reason,))
    widget.demands["steps of 15 cm"].value = True
    widget.button.click()
    assert planner.asked[1].limits.step == (0.15, 0.1)
    assert "infeasible" in widget.status.value and not widget.pictures
    for words in ("step", "steps are &lt;short&gt;", "FL, RR", "0.03"):
        assert words in widget.reasons.value
    planner.error = None
    widget.demands["steps of 15 cm"].value = False
    assert widget.reasons.value == "" and "gait" in widget.pictures


def test_every_demand_asks_more():
    asked = replace(SMALL, beyond_reach=True)
    for name, change in DEMANDS.items():
        more = change(asked)
        assert more != asked, name
        asked = more
    assert asked.goal_tolerance and len(asked.terrain.regions) == 2
    assert {r.mu_foot for r in asked.terrain.regions} == {0.05}


def test_real_demands_conflict():
    asked = {"be within 5 cm of the goal", "no wheels", "at most 0.3 m/s"}
    widget = Conflicts(replace(SMALL, goal=(0.5, 0.0), slots=5), held=tuple(asked))
    assert "forward speed is up to 0.30 m/s" in widget.reasons.value
    assert "speed" in [d.group for d in widget.outcome.details]


def test_a_tree_is_walked_node_by_node():
    widget = TreeWalk(FEET)
    assert widget.step.max == len(widget.nodes) and "node 1 of" in widget.status.value
    assert len(widget.pictures["tree"].axes[0].texts) == 1
    for step in (2, widget.step.max):
        widget.step.value = step
        picture = widget.pictures["tree"]
        markers = sum(len(line.get_xdata()) for fate in drawings._FATES for line in drawn(picture, fate))
        assert markers == step, "one marker for each node"
        (proven,) = drawn(picture, "proven")
        assert proven.get_ydata()[0] == widget.nodes[step - 1].proven
    (incumbent,) = drawn(widget.pictures["tree"], "incumbent")
    assert incumbent.get_ydata()[0] == widget.nodes[-1].incumbent
    (stars,) = drawn(widget.pictures["tree"], "plan")
    assert min(stars.get_ydata()) == pytest.approx(widget.nodes[-1].incumbent)
    tight = widget.nodes
    widget.formulation.value = "paper"
    assert widget.nodes is not tight and widget.step.max == len(widget.nodes)


def test_the_relaxation_is_drawn_with_its_fractions():
    widget = TreeWalk(FEET)
    S = widget.nodes[0].S
    bars = {b.get_gid(): b for b in widget.pictures["relaxation"].axes[0].patches if b.get_gid()}
    for leg, name in enumerate(("FL", "FR", "RL", "RR")):
        assert bars[f"{name} 0"].get_width() == pytest.approx(S[leg, 0])


def test_no_branch_crosses_another_ones_place():
    nodes = TreeWalk(FEET).nodes
    across = drawings._across(nodes)
    assert len(set(across.values())) == len(nodes)


def test_a_race_draws_both_formulations_in_one_figure():
    widget = FormulationRace(replace(FEET, goal=(0.1, 0.0), slots=1), seconds=8.0)
    assert set(widget.traces) == {"tight", "paper"} and not widget.button.disabled
    picture = widget.pictures["race"]
    for name in ("tight", "paper"):
        (gap,) = drawn(picture, f"{name} gap")
        (bound,) = drawn(picture, f"{name} bound")
        assert (np.diff(bound.get_ydata()) >= -1e-9).all()
        assert np.nanmin(gap.get_ydata()) < 100
    assert picture.axes[1].get_xscale() == "log"
    widget.seconds.value = 9.0
    assert "Press Race" in widget.status.value


def test_a_formulation_without_a_plan_still_shows_its_bound():
    def none(note):
        note(Progress(1, np.inf, 0.3, np.inf, 0.5))
        raise NoPlanError("late")

    trace = []
    with pytest.raises(NoPlanError):
        watched(none, trace.append)
    picture = drawings.convergence({"paper": trace}, soon=True)
    assert drawn(picture, "paper bound")[0].get_ydata()[-1] == 0.3
    assert np.isnan(drawn(picture, "paper incumbent")[0].get_ydata()).all()


def test_the_dearest_term_is_on_top():
    plan = stored("flat", relaxed=True)
    axes = drawings.costs({"wheels": plan, "feet": stored("flat-feet", relaxed=True)}).axes[0]
    widths = {c.get_label(): [bar.get_width() for bar in c] for c in axes.containers}
    most = np.max(list(widths.values()), axis=0)
    assert (np.diff(most) >= 0).all()
    assert any(f"{plan.meta['objective']:.3f}" in label for label in widths)


def test_the_polish_sways_and_the_relaxed_plan_does_not():
    relaxed, polished = stored("flat-feet", relaxed=True), stored("flat-feet")
    picture = drawings.sway(relaxed, polished)
    ranges = [np.ptp(drawn(picture, f"CoM, {n}")[0].get_ydata()) for n in ("relaxed", "polished")]
    assert ranges[1] > 3 * ranges[0]
    supports = [line for line in picture.axes[0].lines if str(line.get_gid()).startswith("support")]
    assert len(supports) == int((polished.S.sum(axis=0) == 2).sum())


def test_pictures_have_descriptions():
    widget = LiveSearch(SMALL, planner=Told())
    assert set(widget.pictures) == {"search", "gait", "path"}
    for view in widget.views.values():
        assert 'alt=""' not in view.value and 'alt="' in view.value
