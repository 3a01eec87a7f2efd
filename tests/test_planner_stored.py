"""The plans that come with the book hold, answer what their recipes ask; the short ones are found again."""

import importlib.util
import json

import numpy as np
import plan_checker
import pytest

from wfbook.planner import repaired, stored
from wfbook.planner.extract import describe
from wfbook.planner.stored import PLANS, names


@pytest.fixture(scope="module")
def build():
    """The script that makes the plans."""
    spec = importlib.util.spec_from_file_location("build_plans", PLANS / "build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_there_is_a_recipe_for_each_plan_and_both_its_files(build):
    assert sorted(build.RECIPES) == names()
    files = {f"{name}{suffix}.npz" for name in names() for suffix in ("", "_relaxed")}
    assert {path.name for path in PLANS.glob("*.npz")} == files


def test_no_plan_of_another_name(build):
    with pytest.raises(ValueError, match="'level' is none of the stored plans far, far-feet"):
        stored("level")


@pytest.mark.parametrize("relaxed", [True, False], ids=["relaxed", "polished"])
@pytest.mark.parametrize("name", names())
def test_a_stored_plan_satisfies_every_equation(name, relaxed):
    plan = stored(name, relaxed)
    assert plan_checker.check(plan)[0] == []
    assert plan.meta["stage"] == ("relaxed" if relaxed else "polished")


@pytest.mark.parametrize("name", names())
def test_the_two_files_of_a_name_are_one_gait(name):
    relaxed, polished = stored(name, relaxed=True), stored(name)
    assert np.array_equal(relaxed.S, polished.S) and np.array_equal(relaxed.D, polished.D)
    assert repaired(polished)
    for key in ("objective", "bound", "gap", "status"):
        assert relaxed.meta[key] == polished.meta[key]
    assert relaxed.meta["objective"] == pytest.approx(plan_checker.objective(relaxed), rel=1e-6)


@pytest.mark.parametrize("name", names())
def test_a_stored_plan_answers_what_its_recipe_asks(name, build):
    problem = build.RECIPES[name].problem()
    for plan in (stored(name, relaxed=True), stored(name)):
        asked = json.loads(json.dumps(describe(problem)))
        assert {key: plan.meta[key] for key in asked} == asked
        assert plan.terrain == problem.terrain
        assert (plan.slots, plan.knots) == (problem.slots, problem.knots)
        assert plan.slot_duration == pytest.approx(problem.slot_duration)
        assert np.allclose(plan.p[0, :, :2], problem.start_contacts)
        assert (plan.meta["status"] == "optimal") == (plan.meta["gap"] <= build.GAP)


@pytest.mark.parametrize("name", ["far-feet", "flat-feet"])
def test_a_short_search_finds_the_stored_optimum_again(name, build):
    # Seconds on a quiet machine; the limit is only for one that is not.
    again, kept = build.make(name, time_limit=300.0)[0].meta, stored(name).meta
    assert again["status"] == kept["status"] == "optimal"
    assert again["objective"] >= kept["bound"] - 1e-6 * kept["objective"]
    assert kept["objective"] >= again["bound"] - 1e-6 * kept["objective"]


def test_the_list_of_plans_is_up_to_date(build):
    text = build.README.read_text(encoding="utf-8")
    assert build.listed(text) == text, "run python assets/plans/build.py --list"


def test_a_plan_is_built_as_two_files(tmp_path, build, monkeypatch, capsys):
    pair = stored("far-feet", relaxed=True), stored("far-feet")
    monkeypatch.setattr(build, "make", lambda name, time_limit: pair)
    build.build(["far-feet"], tmp_path / "plans")
    for suffix, plan in zip(("_relaxed", ""), pair, strict=True):
        written = (tmp_path / "plans" / f"far-feet{suffix}.npz").read_bytes()
        assert written == (PLANS / f"far-feet{suffix}.npz").read_bytes(), plan.meta["stage"]
    assert "far-feet: optimal, gap 0.10 %" in capsys.readouterr().out


def test_an_interrupted_search_is_not_written(tmp_path, build, monkeypatch):
    pair = [stored("far-feet", r).with_meta(status="interrupted") for r in (True, False)]
    monkeypatch.setattr(build, "make", lambda name, time_limit: pair)
    with pytest.raises(KeyboardInterrupt):
        build.build(["far-feet"], tmp_path)
    assert not list(tmp_path.iterdir())
