"""The comparison with the paper: what is kept and resumed, written and told."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from paper_cases import Invented, outcome, report_file
from test_layout import ORDER
from view_cases import small_plan, small_run

import wfbook
from wfbook import planner, simulate, terrain
from wfbook.__main__ import main
from wfbook.go1_dynamics import MOTORS
from wfbook.paper import bench, gaits, store, times, waves
from wfbook.paper.bench import Bench, Execution
from wfbook.paper.options import NAMES, Options
from wfbook.paper.parts import EXPERIMENTS
from wfbook.paper.record import compared, measured, stated
from wfbook.paper.store import Store
from wfbook.paper.text import cells, markdown, number
from wfbook.quoted import PAPER_A, PAPER_B, value
from wfbook.table2.benchmark import ROWS


def test_every_number_of_the_paper_is_compared_or_says_why_not(tmp_path):
    used = [key for experiment in EXPERIMENTS for key in experiment.paper]
    used += ["delay", "omni.pitch_shift"]  # a setting of every simulation, and one of every pitch
    assert len(used) == len(set(used))
    both = PAPER_A + PAPER_B
    assert {said.key for said in both if not said.unused} == set(used)
    assert len({said.key for said in both}) == len(both)
    for said in both:
        assert said.where and said.says
        assert (said.value is not None) == bool(said.unit)
    assert value("delay") / 1e3 == bench.DELAY
    with pytest.raises(ValueError, match=r"fig8\.start"):
        value("fig8.start")


def test_the_experiments_are_those_of_the_command():
    assert tuple(experiment.name for experiment in EXPERIMENTS) == NAMES


def test_the_papers_numbers_agree_with_each_other():
    for case in ("feet", "friction", "both"):
        mean = value(f"{case}.distance") / value("speed.duration")
        assert value(f"{case}.speed") == pytest.approx(mean, abs=0.005)
    for case in ("friction", "both"):
        more = 100 * (value(f"{case}.distance") / value("feet.distance") - 1)
        assert 0 <= more - value(f"{case}.faster") < 1  # it cuts what is behind the point
    ratio = value("feet.cot") / value("both.cot")
    assert value("cot.improvement") == round(ratio, 1)
    assert value("cot.reduction") == round(100 * (1 - 1 / ratio), 1)
    assert [value(f"table2.{row.name}") for row in ROWS[:-1]] == [row.gurobi_s for row in ROWS[:-1]]
    assert value("table2.long") == 2 * value("table2.short") == 10 * gaits.SLOT_S


@pytest.mark.parametrize(
    ("key", "possible"),
    [("waves.ik_", True), ("waves.", False), ("fixed.", True), ("combined.", True)],
)
def test_no_largest_error_is_smaller_than_mean_and_deviation_make_it(key, possible):
    """Of paper B's four, one can't be: not even with the last digits rounded in its favour."""
    separator = "" if key.endswith("_") else "."
    mean, std, most = (value(f"{key.rstrip('.')}{separator}{name}") for name in ("mean", "std", "max"))
    half = 0.0005
    least = np.hypot(max(0.0, abs(mean - value("omni.height")) - half), std - half)
    assert bool(most + half >= least) == possible


def test_the_second_papers_numbers_agree_with_each_other():
    assert waves.least_error("waves") > value("waves.max")
    for name in ("cold", "warm", "stable"):
        assert value(f"omni.{name}_least") < value(f"omni.{name}_most")
    assert value("omni.stable_most") < value("omni.warm_least") < value("omni.cold_least")
    joints = sum(value(f"omni.{kind}_joints") for kind in ("leg", "steering", "wheel", "arm"))
    unlocked = value("omni.leg_joints") + value("omni.arm_joints") - 1  # the gripper
    assert value("omni.states") == 7 + 6 + 2 * unlocked
    assert joints == 23
    assert value("omni.pitch_shift") == value("omni.roll") == value("omni.yaw")
    assert value("omni.speed") > waves.SPEED


def counted(monkeypatch, answers):
    """Let the planner answer with these, one after another; return the problems it was asked."""
    asked = []

    def solve(problem, gap, time_limit, progress):
        asked.append(problem)
        found = next(answers)
        if isinstance(found, Exception):
            raise found
        return found

    for name in ("solve_executable", "solve_windows"):
        solve.__name__ = name
        monkeypatch.setattr(planner, name, solve)
    return asked


def pair(**meta):
    """A relaxed and a polished plan."""
    plan = small_plan().with_meta(com_height=0.265, **meta)
    return plan, plan.with_meta(stage="polished")


def test_a_plan_is_searched_once(monkeypatch, tmp_path):
    asked = counted(monkeypatch, itertools.repeat(pair(status="optimal")))
    problem = gaits.problem("flat")
    store = Store(tmp_path, "stamp")
    first = Bench(store).plan(problem, "flat")
    again = Bench(Store(tmp_path, "stamp")).plan(gaits.problem("flat"), "another name")
    assert len(asked) == 1
    assert first.polished.meta["stage"] == again.polished.meta["stage"] == "polished"
    assert np.array_equal(first.relaxed.p, again.relaxed.p)
    Bench(store, Options(time_limit=7.0)).plan(problem, "flat")
    Bench(store).plan(replace(problem, weights=replace(problem.weights, swing=0.03)), "flat")
    Bench(Store(tmp_path, "other code")).plan(problem, "flat")
    assert len(asked) == 4
    for path in tmp_path.iterdir():
        path.write_bytes(path.read_bytes()[:100])
    Bench(store).plan(problem, "flat")
    assert len(asked) == 5, "a damaged file is no plan"


def test_what_is_interrupted_or_not_found_is_searched_again(monkeypatch, tmp_path):
    none = planner.NoPlanError("no plan\nfound")
    stopped = planner.NoPlanError("interrupted before a gait was found that can be polished")
    answers = pair(status="interrupted"), stopped, none, pair(status="optimal")
    asked = counted(monkeypatch, iter(answers))
    bench = Bench(Store(tmp_path / "new", "stamp"))
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            bench.plan(gaits.problem("flat"), "flat")
        assert not (tmp_path / "new").exists()
    assert not bench.troubles
    assert bench.plan(gaits.problem("flat"), "flat") is None
    assert bench.troubles == ["flat: no plan found"]
    assert bench.plan(gaits.problem("flat"), "flat") is not None
    assert len(asked) == 4


def test_a_plan_is_run_once_for_each_seed(monkeypatch, tmp_path):
    ran = []

    def run(plan, delay, state, hold, seed, progress):
        ran.append((delay, state, hold, seed))
        meta = {"seed": seed, "state": state, "delay": delay}
        metrics = {
            "upright": seed == 0,
            "fall_time_s": 0.7,
            "cot_abs": np.nan,
            "distance_m": np.float64(seed),
        }
        return replace(small_run(), meta=meta, metrics=metrics)

    monkeypatch.setattr(simulate, "run", run)
    bench = Bench(Store(tmp_path, "stamp"), Options(seeds=2, state="true"))
    runs = bench.execute(small_plan(), "flat")
    assert ran == [(0.009, "true", 1.0, 0), (0.009, "true", 1.0, 1)]
    assert bench.troubles == ["flat: fell at 0.70 s, seed 1"]
    again = bench.execute(small_plan(), "another name")
    assert len(ran) == 2
    for one, other in zip(runs, again, strict=True):
        assert one.metrics == other.metrics
        assert other.metrics["cot_abs"] is None
        assert all(np.array_equal(getattr(one, name), getattr(other, name)) for name in Execution.ARRAYS)
    bench.execute(replace(small_plan(), terrain=terrain.flat(0.005)), "flat")
    bench.execute(small_plan(advance=0.09), "flat")
    assert len(ran) == 6


def test_what_is_kept_holds_for_the_code_that_made_it(monkeypatch, tmp_path):
    assert {Path(name).stem for name in store._PLANNING} == set(ORDER[: ORDER.index("planner") + 1])
    names = ("wfbook/planner/tree.py", "wfbook/wbc.py", "wfbook/view/style.py", "assets/go1/go1.xml")
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("before")
    monkeypatch.setattr(wfbook, "__file__", str(tmp_path / "wfbook" / "__init__.py"))
    changed = []
    for name in names:
        before = [store.code_stamp.__wrapped__(planning) for planning in (True, False)]
        (tmp_path / name).write_text("after")
        after = [store.code_stamp.__wrapped__(planning) for planning in (True, False)]
        changed.append([one != other for one, other in zip(before, after, strict=True)])
    assert changed == [[True, True], [False, True], [False, False], [False, True]]
    assert Store(tmp_path).path("plan", {}) != Store(tmp_path).path("run", {})


def test_a_timed_search_is_done_once(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(bench.trial, "run", lambda trial, show: asked.append(trial) or outcome(0.5))
    for _ in range(2):
        report = times._searched(Bench(Store(tmp_path, "stamp")))
    assert len(asked) == len(ROWS)
    assert report["complete"]
    assert report["rows"][0]["tight"] == outcome(0.5)


def test_work_is_that_of_the_motors_from_the_plans_begin_on():
    run = small_run()
    N = len(run.t)
    velocity = np.zeros((N, 22))
    velocity[:, MOTORS[0]], velocity[:, MOTORS[1]] = 2.0, -1.0
    kept = Execution.of(
        replace(run, tau=np.full((N, 12), 3.0), qvel=velocity, meta=dict.fromkeys(("seed", "state", "delay")))
    )
    assert np.all(kept.work[kept.t < 0] == 0.0)
    assert kept.work[-1] == pytest.approx([9.0 * kept.t[-1], 6.0 * kept.t[-1]], rel=0.01)
    assert set(np.unique(kept.modes)) == {0, 1, 2}
    assert np.allclose(np.diff(kept.t), 0.01)


def test_records_as_cells():
    said = compared("both.cot", 0.0523, "gap 1 %", [0.05, 0.055])
    assert cells(said.to_dict()) == (
        *("cost of transport, feet and wheels", "0.105", "0.0523", "0.0500 to 0.0550", "0.50", "gap 1 %"),
    )
    angle = compared("waves.roll", -1.57081234, "", [-1.571, -1.5706])
    assert cells(angle.to_dict())[1:4] == ("-1.578 rad", "-1.571 rad", "-1.571 to -1.571")
    assert cells(stated("fig9.mostly_wheels", False, 40.0, "%").to_dict())[1:5] == (
        "stated",
        "no: 40 %",
        "",
        "",
    )
    assert cells(measured("swings", None, "1").to_dict())[1:3] == ("", "none")
    assert [number(x) for x in (2.0, 0.5, 1234.5, -0.12345, 55.71)] == [
        "2",
        "0.500",
        "1234",
        "-0.123",
        "55.7",
    ]


@pytest.fixture
def command(monkeypatch, tmp_path):
    """Run the command with invented plans, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bench, "Bench", Invented)
    return lambda *words: main(["paper", *words])


def test_the_command_writes_and_tells_everything(command, capsys, tmp_path):
    assert command("--seeds", "2", "--json") == 0
    out, progress = capsys.readouterr()
    report = json.loads(out)
    folder = tmp_path / "results" / "paper"
    pictures_ = {name for experiment in EXPERIMENTS for name in experiment.pictures}
    assert {path.name for path in folder.iterdir()} == {"paper.json", "paper.md", *pictures_}
    assert json.loads((folder / "paper.json").read_text()) == report
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in pictures_)
    assert [entry["name"] for entry in report["experiments"]] == list(NAMES)
    assert report["complete"]
    assert report["options"]["delay_ms"] == 9.0
    assert report["options"]["seeds"] == [0, 1]
    assert "1 of 14  flat" in progress
    text = (folder / "paper.md").read_text()
    for said in PAPER_A + PAPER_B:
        assert said.says in text or said.key in ("delay", "omni.pitch_shift")
        assert said.unused in text
    assert text == markdown(report)
    assert all(f"]({name})" in text for name in pictures_)
    assert "None" not in text and "nan" not in text


def test_the_command_does_what_it_is_asked_and_says_what_fails(command, monkeypatch, capsys, tmp_path):
    assert command("--only", "speed", "--out", "a") == 0
    out = capsys.readouterr().out
    assert "mean speed, feet only" in out
    assert "cost of transport" not in out
    assert {path.name for path in (tmp_path / "a").iterdir()} == {"paper.json", "paper.md", "fig13.png"}

    def none(self, problem, label):
        self.troubles.append(f"{label}: no plan")

    monkeypatch.setattr(Invented, "plan", none)
    assert command("--only", "ramp-up", "transport", "--out", "a") == 1
    out = capsys.readouterr().out
    assert "ramp-up: no plan" in out
    assert "feet only: no plan" in out
    assert {path.name for path in (tmp_path / "a").iterdir()} == {"paper.json", "paper.md"}


@pytest.mark.parametrize(("stop", "code"), [(KeyboardInterrupt(), 130), (SystemExit(143), 143)])
def test_an_interrupt_keeps_what_was_done(stop, code, command, monkeypatch, capsys, tmp_path):
    plan = Invented.plan

    def interrupted(self, problem, label):
        if label == "ramp-down":
            raise stop
        self.store.folder.mkdir(parents=True, exist_ok=True)
        return plan(self, problem, label)

    monkeypatch.setattr(Invented, "plan", interrupted)
    assert command("--out", "some/where") == code
    out, err = capsys.readouterr()
    assert "incomplete" in out
    assert err.splitlines()[-1].startswith("wfbook: interrupted, what was found is in")
    report = json.loads((tmp_path / "some" / "where" / "paper.json").read_text())
    assert [entry["name"] for entry in report["experiments"]] == ["flat", "flat-friction"]
    assert not report["complete"]


def test_an_interrupt_before_anything_was_found_leaves_nothing(command, monkeypatch, capsys, tmp_path):
    def interrupted(self, problem, label):
        raise KeyboardInterrupt

    monkeypatch.setattr(Invented, "plan", interrupted)
    assert command("--out", "some/where") == 130
    assert capsys.readouterr().err.splitlines()[-1] == "wfbook: interrupted, nothing was written"
    assert list(tmp_path.iterdir()) == []


def test_a_report_of_table_two_beside_the_results_is_used_if_it_is_complete(command, capsys, tmp_path):
    path = report_file(tmp_path / "results" / "table2")
    for complete, source in ((True, str(path.relative_to(tmp_path))), (False, "searched")):
        report_file(tmp_path / "results" / "table2", complete)
        assert command("--only", "table2", "--json") == 0
        (entry,) = json.loads(capsys.readouterr().out)["experiments"]
        assert entry["settings"]["source"] == source


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--only", "figure"], "invalid choice: 'figure'"),
        (["--only"], "--only"),
        (["--seeds", "0"], "--seeds: must be at least 1, is 0"),
        (["--time-limit", "0"], "--time-limit: must be above 0, is 0"),
        (["--gap", "nan"], "--gap: must be a finite number"),
        (["--state", "known"], "invalid choice: 'known'"),
        (["--table2", "none.json"], "--table2: 'none.json': No such file"),
        (["--table2", "bad.json"], "--table2: bad.json: not a report of table2"),
        (["--table2", "old.json"], "--table2: old.json: format 0"),
        (["--only", "speed", "--table2", "old.json"], "--table2 has no effect without table2"),
        (["--out", "bad.json/paper"], "--out 'bad.json/paper' can't be written"),
    ],
)
def test_bad_options_are_one_line(words, says, command, capsys, tmp_path):
    (tmp_path / "bad.json").write_text("[1")
    (tmp_path / "old.json").write_text('{"format": 0}')
    before = set(tmp_path.iterdir())
    assert command(*words) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert says in err
    assert set(tmp_path.iterdir()) == before
