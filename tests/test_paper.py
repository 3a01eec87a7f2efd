"""The comparison with the paper: what is compared with what, how it is kept, told, drawn and resumed."""

import itertools
import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from paper_cases import answer, execution, plan_of
from view_cases import small_plan, small_run

from wfbook import planner, simulate, terrain
from wfbook.__main__ import main
from wfbook.go1_dynamics import MOTORS
from wfbook.paper import bench, gaits, speed, times, transport
from wfbook.paper.bench import Bench, Execution, Planned
from wfbook.paper.options import NAMES, Options
from wfbook.paper.parts import EXPERIMENTS
from wfbook.paper.reading import Reading
from wfbook.paper.record import Record, compared, measured, stated
from wfbook.paper.store import Store, described
from wfbook.paper.text import cells, markdown, number
from wfbook.quoted import PAPER_A, quoted, value
from wfbook.table2.benchmark import APART, ROWS, Benchmark
from wfbook.table2.trial import OUTCOME
from wfbook.view import paper as pictures
from wfbook.view.style import FOOT, SWING, WHEEL

REACH = {("foot",): 1.5, ("foot", "wheel"): 3.0}
"""How far invented plans go, by end effectors."""


@dataclass
class Invented(Bench):
    """A bench whose plans, runs and times are invented: feet cost 0.6, wheels 0.2, with friction 0.3."""

    def plan(self, problem, label):
        self.show(self.head + label)
        kinds = tuple(problem.end_effectors)
        plans = answer(problem, REACH[kinds] if problem.beyond_reach else problem.goal[0])
        return Planned(*(plan.with_meta(gap=0.02, status="time limit") for plan in plans))

    def execute(self, plan, label, hold=1.0):
        rolls = plan.end_effector.any()
        cost = (0.3 if plan.terrain.name == "flat-friction" else 0.2) if rolls else 0.6
        return [execution(plan, seed, cost) for seed in range(self.options.seeds)]

    def time(self, asked, label):
        return outcome(0.1 * asked.slots * len(asked.end_effectors) * len(asked.terrain.regions))


def outcome(search_s, status="optimal", gap=1e-3, message=None):
    """What a timed search might find."""
    found = {"status": status, "search_s": search_s, "gap": gap, "message": message}
    return dict.fromkeys(OUTCOME) | found


def invented(tmp_path, **options) -> Invented:
    return Invented(Store(tmp_path / "cache", "stamp"), Options(**options))


def by_key(result) -> dict[str, Record]:
    """A result's records by the paper's key, else by what they are."""
    return {record.paper or record.what: record for record in result.records}


def test_every_number_of_the_paper_is_compared_or_says_why_not(tmp_path):
    used = [key for experiment in EXPERIMENTS for key in experiment.paper]
    used.append("delay")  # a setting of every simulation
    assert len(used) == len(set(used))
    assert {said.key for said in PAPER_A if not said.unused} == set(used)
    assert len({said.key for said in PAPER_A}) == len(PAPER_A)
    for said in PAPER_A:
        assert said.where and said.says
        assert (said.value is not None) == bool(said.unit)
    assert value("delay") / 1e3 == bench.DELAY
    with pytest.raises(ValueError, match=r"fig8\.start"):
        value("fig8.start")


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda e: e.name)
def test_an_experiment_compares_what_it_names_and_draws_its_pictures(experiment, tmp_path):
    result = experiment.run(invented(tmp_path, seeds=2))
    assert {record.paper for record in result.records if record.paper} == set(experiment.paper)
    assert tuple(result.pictures) == experiment.pictures
    assert result.settings
    assert not result.troubles
    for record in result.records:
        said = record.quoted
        assert record.ours is not None or record.holds is False
        assert (record.holds is None) == (said is None or said.value is not None)
        assert said is None or said.value is None or said.unit == record.unit
        assert record.low is None or record.low <= record.ours <= record.high
    json.dumps([record.to_dict() for record in result.records], allow_nan=False)


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


def test_speeds_and_gains_are_those_of_the_runs(tmp_path):
    found = by_key(speed.run(invented(tmp_path, seeds=3)))
    feet, both = 1.5, 3.0
    assert found["feet.distance"].ours == pytest.approx(feet - 0.01)
    assert (found["feet.distance"].low, found["feet.distance"].high) == pytest.approx((feet - 0.02, feet))
    assert found["both.speed"].ours == pytest.approx((both - 0.01) / 4.5)
    gains = [100 * ((both - 0.01 * s) / (feet - 0.01 * s) - 1) for s in range(3)]
    assert found["both.faster"].ours == pytest.approx(gains[1])
    assert found["both.faster"].high == pytest.approx(max(gains))
    assert found["planned to be faster than feet only, feet and wheels"].ours == pytest.approx(100.0)
    assert "gap 2.00 % (time limit, 0.5 s); seeds 0, 1, 2, true state" in found["feet.distance"].proof


def test_speed_is_asked_alike_of_all_three():
    problems = [speed.problem(case) for case in speed.CASES]
    assert {p.goal for p in problems} == {speed.GOAL}
    assert [p.duration for p in problems] == [pytest.approx(4.5)] * 3
    assert all(speed.GOAL[0] > p.limits.speed[0] * p.duration for p in problems), "out of reach"
    assert len({json.dumps(described([p.weights, p.limits])) for p in problems}) == 1


def test_costs_of_transport_are_of_equal_ways_from_rest_to_rest(tmp_path):
    bench = invented(tmp_path, seeds=2)
    asked = []
    plan = bench.plan
    bench.plan = lambda problem, label: (asked.append(problem), plan(problem, label))[1]
    result = transport.run(bench)
    assert [p.duration for p in asked] == [pytest.approx(9.0)] * 3
    assert all(p.final_stance for p in asked)
    feet, *wheels = asked
    assert feet.end_effectors == ("foot",)
    assert {p.goal[0] for p in wheels} == {result.settings["goal_of_wheels_m"]}
    assert wheels[0].goal[0] == pytest.approx(feet.goal[0])
    found = by_key(result)
    assert (found["feet.cot"].ours, found["both.cot"].ours) == pytest.approx((0.6, 0.2))
    assert found["cot.improvement"].ours == pytest.approx(3.0)
    assert found["cot.reduction"].ours == pytest.approx(100 * 2 / 3)
    assert found["feet only over feet and wheels, positive work"].ours == pytest.approx(3.0)
    rolling = "feet only over feet and wheels, rolling friction"
    for text in ("absolute work", "positive work"):
        assert found[f"{rolling}, {text}"].ours == pytest.approx(2.0)


def test_a_fallen_robot_has_no_cost_of_transport(tmp_path):
    bench = invented(tmp_path, seeds=2)
    bench.execute = lambda plan, label: [execution(plan, seed, upright=False) for seed in range(2)]
    found = by_key(transport.run(bench))
    assert found["feet.cot"].ours is None
    assert found["cot.improvement"].ours is None
    assert found["of 2 runs upright to the end, feet only"].ours == 0


@pytest.mark.parametrize("missing", ["feet", "both"])
def test_what_is_not_planned_is_left_out_and_the_rest_compared(missing, tmp_path):
    bench = invented(tmp_path, seeds=1)
    plan = bench.plan
    lacking = ("foot",) if missing == "feet" else ("foot", "wheel")
    bench.plan = lambda problem, label: None if problem.end_effectors == lacking else plan(problem, label)
    found = by_key(speed.run(bench))
    assert found[f"{missing}.distance"].ours is None
    assert found[f"{'both' if missing == 'feet' else 'feet'}.distance"].ours is not None
    assert "both.faster" not in found
    assert "cot.improvement" not in by_key(transport.run(bench))
    bench.plan = lambda problem, label: None
    assert not gaits.run(bench, "ramp-up", 11).pictures


def test_a_gait_is_read():
    read = Reading.of(plan_of(["w..f..", ".woooo", ".woooo", "wooof."]))
    assert read.lines[1] == "FR .^oooo  regions 000000"
    assert read.swings == 6
    assert read.first_wheel_s == pytest.approx(0.3)
    assert read.all_on_wheels_s is None
    stance = 4 + 5 + 5 + 4
    assert read.share_on_wheels() == pytest.approx((4 + 4 + 3) / stance)
    assert read.share_on_wheels(np.arange(6) < 1) == pytest.approx(0.0)
    assert read.share_on_wheels(False) is None
    assert read.ending == (2, 2)
    assert read.foot_contacts == 2 + 1 + 1 + 1
    assert read.switched_back == 1
    assert read.feet_only_from_s is None
    early = Reading.of(plan_of(["wof.", "wof.", "wof.", "...."]))
    assert early.all_on_wheels_s is None
    assert early.feet_only_from_s == pytest.approx(0.6)
    assert Reading.of(plan_of(["woo", "woo", ".wo", ".wo"])).all_on_wheels_s == pytest.approx(0.6)
    assert Reading.of(plan_of(["..", "..", "..", ".f"])).first_wheel_s is None


def test_rolling_over_an_edge_is_no_swing():
    ramp = terrain.ramp(start=0.1)
    plan = plan_of(["wooo", "f...", "wooo", "...."], ["0112", "1111", "0000", "0000"], terrain=ramp)
    read = Reading.of(plan)
    assert list(read.before) == [1, 1, 0, 0]
    assert read.rolled_over_edges == 2
    assert read.share_on_wheels(read.regions == 1) == pytest.approx(2 / 5)


def test_the_longest_step_is_of_a_swing():
    plan = plan_of(["f.", "oo", "..", ".."], advance=0.8)
    assert Reading.of(plan).step_m == pytest.approx(3 * 0.02)
    assert Reading.of(plan_of(["..", "oo", "..", ".."])).step_m == 0.0


@pytest.mark.parametrize("name", terrain.BUILTIN_NAMES)
def test_goals_lie_beyond_the_terrain_and_weights_are_one_set(name):
    problem = gaits.problem(name)
    assert problem.weights == planner.Weights()
    assert problem.duration == pytest.approx(value("fig8.duration"))
    regions = problem.terrain.regions
    assert len(regions) == 1 or problem.goal[0] > regions[-1].vertices[:, 0].min()


def gait_result(name, legs, regions, tmp_path):
    """What is said of a gait on a terrain."""
    bench = invented(tmp_path, seeds=1)
    plan = plan_of(legs, regions, terrain=terrain.builtin(name))
    bench.plan = lambda problem, label: Planned(plan, plan) if label == name else plan_pair("flat")
    return by_key(gaits.run(bench, name, 8))


def plan_pair(name):
    """A gait on a terrain with two stances on feet."""
    plan = plan_of(["wooo", "....", "wooo", "wof."], terrain=terrain.builtin(name))
    return Planned(plan, plan)


def test_what_the_paper_states_is_decided_by_the_gait(tmp_path):
    found = gait_result("flat", ["woof.", ".wooo", "woooo", "woooo"], None, tmp_path)
    assert found["fig8.start"].holds
    assert (found["fig8.feet_at_end"].ours, found["fig8.wheels_at_end"].ours) == (1, 3)
    assert not gait_result("flat", ["f....", ".wooo", "woooo", "woooo"], None, tmp_path)["fig8.start"].holds

    few = gait_result("flat-friction", ["wooo", ".woo", "wooo", "wof."], None, tmp_path)
    assert not few["fig9.more_feet"].holds
    assert few["fig9.mostly_wheels"].holds
    many = gait_result("flat-friction", ["f.f.", "f.f.", "f.f.", "wo.."], None, tmp_path)
    assert many["fig9.more_feet"].holds
    assert not many["fig9.mostly_wheels"].holds

    down = gait_result(
        "ramp-down", ["wof.", "wooo", "wooo", "...."], ["0112", "0112", "0112", "0000"], tmp_path
    )
    assert all(down[f"fig10.{key}"].holds for key in ("rolls_down", "crosses", "stops"))
    down = gait_result(
        "ramp-down", ["f.f.", "f.f.", "....", "wooo"], ["1122", "1122", "0000", "0000"], tmp_path
    )
    assert not any(down[f"fig10.{key}"].holds for key in ("rolls_down", "crosses", "stops"))

    up = gait_result("ramp-up", ["wof.", "....", "....", "...."], ["0011", "1111", "1111", "1111"], tmp_path)
    assert up["fig11.mixed"].holds
    assert up["fig11.feet"].holds
    up = gait_result("ramp-up", ["oooo", "oooo", "oooo", "oooo"], ["0011"] * 4, tmp_path)
    assert not up["fig11.mixed"].holds
    assert not up["fig11.feet"].holds

    feet = gait_result("stepping-stones", ["f.f.", "wooo", "....", "...."], ["1133", "0000"] * 2, tmp_path)
    assert feet["fig12.feet"].holds
    assert feet["fig12.gap"].ours == pytest.approx(20.0)
    wheels = gait_result(
        "stepping-stones", ["woof", "....", "....", "...."], ["1113"] + ["0000"] * 3, tmp_path
    )
    assert not wheels["fig12.feet"].holds


def test_times_are_compared_row_by_row(tmp_path):
    found = by_key(times.run(invented(tmp_path)))
    assert found["table2.1,1,5"].ours == pytest.approx(0.5)
    assert found["table2.3,1,10"].ours == pytest.approx(3.0)
    assert found["times.half_second"].ours == pytest.approx(0.5)
    assert found["times.grow"].holds
    assert found["times.grow"].ours == pytest.approx(2.0)
    assert not found["times.harder"].holds, "the same time is no further time"
    assert found[f"search time, row 3,2,5{APART}"].ours == pytest.approx(3.0)


def report_file(folder, complete=True, **first):
    """A report as ``table2`` leaves it."""
    report = Benchmark(ROWS, ()).report | {"complete": complete}
    for row in report["rows"]:
        row["tight"] = outcome(2.0)
    report["rows"][0] |= first
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "table2.json").write_text(json.dumps(report))
    return folder / "table2.json"


def test_table_two_is_taken_from_its_report(tmp_path):
    path = report_file(tmp_path, tight=outcome(None, "failed", None, "a\nb"))
    bench = invented(tmp_path, table2=path)
    bench.time = None  # nothing is searched
    result = times.run(bench)
    found = by_key(result)
    assert found["table2.1,2,5"].ours == 2.0
    assert found["table2.1,1,5"].ours is None
    assert result.troubles == ["1,1,5: failed: b"]
    assert result.settings["source"] == str(path)


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
        return replace(small_run(), meta=meta, metrics={"distance_m": np.float64(seed), "cot_abs": np.nan})

    monkeypatch.setattr(simulate, "run", run)
    bench = Bench(Store(tmp_path, "stamp"), Options(seeds=2, state="true"))
    runs = bench.execute(small_plan(), "flat")
    assert ran == [(0.009, "true", 1.0, 0), (0.009, "true", 1.0, 1)]
    again = bench.execute(small_plan(), "another name")
    assert len(ran) == 2
    for one, other in zip(runs, again, strict=True):
        assert one.metrics == other.metrics
        assert other.metrics["cot_abs"] is None
        assert all(np.array_equal(getattr(one, name), getattr(other, name)) for name in Execution.ARRAYS)
    bench.execute(replace(small_plan(), terrain=terrain.flat(0.005)), "flat")
    bench.execute(small_plan(advance=0.09), "flat")
    assert len(ran) == 6


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
    assert "1 of 8  flat" in progress
    text = (folder / "paper.md").read_text()
    for said in PAPER_A:
        assert said.says in text or said.key == "delay"
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


def lines(figure, name):
    """The curves and markers with this name."""
    return [line.get_xydata() for axes in figure.axes for line in axes.lines if line.get_gid() == name]


def test_the_picture_of_a_gait_shows_plan_and_run():
    plan = plan_of(["wooo", "f...", "....", "...."])
    figure = pictures.gait(plan, execution(plan, 0), "Fig. 8: flat")
    planned, run = (
        [
            (round(b.get_y() + 0.36), *b.get_bbox().intervalx, to_hex(b.get_facecolor()).upper())
            for b in axes.patches
        ]
        for axes in figure.axes
    )
    assert [bar[0] for bar in planned] == [0, 0, 1, 1, 2, 3]
    assert [bar[3] for bar in planned[:4]] == [SWING, WHEEL, SWING, FOOT]
    assert np.allclose([bar[1:3] for bar in planned[:2]], [(0, 0.3), (0.3, 1.2)])
    assert [(bar[0], bar[3]) for bar in run] == [(bar[0], bar[3]) for bar in planned]
    assert np.allclose([bar[1:3] for bar in run], [bar[1:3] for bar in planned], atol=0.02)
    assert figure.axes[0].get_title(loc="left") == "Fig. 8: flat"


def test_the_picture_of_ways_has_the_papers_ends(tmp_path):
    figure = speed.run(invented(tmp_path, seeds=1)).pictures["fig13.png"]()
    for case, end in (("feet", 1.5), ("both", 3.0), ("friction", 3.0)):
        assert lines(figure, f"{case} paper")[0] == pytest.approx(
            np.array([[4.5, value(f"{case}.distance")]])
        )
        assert lines(figure, f"{case} planned")[0][-1] == pytest.approx([4.5, end])
        assert lines(figure, f"{case} simulated")[0][0] == pytest.approx([0.0, 0.0], abs=0.011)
    names = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert names[:3] == [name for name, *_ in speed.CASES.values()]


def test_the_picture_of_transport_has_both_works_of_each_case(tmp_path):
    figure = transport.run(invented(tmp_path, seeds=1)).pictures["transport.png"]()
    for name, *_ in transport.CASES.values():
        absolute, positive = (lines(figure, f"{name} {what}")[0] for what in ("absolute", "positive"))
        assert positive[-1, 1] == pytest.approx(0.5 * absolute[-1, 1])
    assert quoted("both.cot").value == 0.105
