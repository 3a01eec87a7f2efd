"""The benchmark: trials in processes of their own, what is kept of them, and how it is told and drawn."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex

from wfbook.__main__ import main
from wfbook.report import aligned
from wfbook.table2 import benchmark, command, text, trial
from wfbook.table2.benchmark import Benchmark, Options, Row, apart, cut
from wfbook.table2.trial import OUTCOME, Trial
from wfbook.terrain import Terrain, flat, ramp
from wfbook.view import benchmarks
from wfbook.view.style import BODY, FOOT, PAPER, PLANNED, WHEEL

FILES = {"table2.json", "table2.png"}
FEET = ("foot",)
TINY = (Row(flat(), 1, 1, 0.5), Row(flat(), 1, 2, 1.0))


def asked(slots=1, **changes) -> Trial:
    """A trial on flat ground."""
    return replace(Trial(flat(), goal=(0.1 * slots, 0.0), slots=slots, end_effectors=FEET), **changes)


def ledge() -> Terrain:
    """Ground that the hind legs stand beside from the start."""
    data = flat().to_dict()
    data["regions"][0]["vertices"] = [[-0.15, -1, 0], [1, -1, 0], [1, 1, 0], [-0.15, 1, 0]]
    return Terrain.from_dict(data | {"name": "ledge"})


def outcome(search_s=0.5, status="optimal", gap=1e-3, message=None, **changes):
    """What a trial might find."""
    found = {"objective": 0.7, "bound": 0.7 * (1 - gap), "root_bound": 0.6, "nodes": 7} if gap else {}
    found |= {"status": status, "search_s": search_s, "gap": gap, "message": message, "build_s": 0.1}
    return dict.fromkeys(OUTCOME) | found | {"peak_memory_mb": 200.0, "time_limit_s": 300.0} | changes


@pytest.fixture
def answers(monkeypatch):
    """Replace the trials' processes by answers from a function; return the trials asked for."""
    trials = []

    def install(answer):
        def run(trial, show):
            trials.append(trial)
            show("0.1 s")
            return answer(trial)

        monkeypatch.setattr(trial, "run", run)
        return trials

    return install


def living(group):
    """The living processes of a process group."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, pgid = path.read_text().rpartition(")")[2].split()[:3]
        except OSError:  # it ended meanwhile
            continue
        if int(pgid) == group and state not in "ZX":
            found.append(path.parent.name)
    return found


def ended(group, patience=10.0):
    """Whether all processes of a group end; a killed grandchild takes a moment, and nobody waits for it."""
    until = time.monotonic() + patience
    while living(group):
        if time.monotonic() > until:
            return False
        time.sleep(0.01)
    return True


@pytest.fixture
def started(monkeypatch):
    """Processes that trials start."""
    found = []

    class Noted(subprocess.Popen):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            found.append(self)

    monkeypatch.setattr(subprocess, "Popen", Noted)
    return found


def test_a_trial_has_a_process_and_a_memory_of_its_own(started):
    ballast = np.ones(150_000_000, np.uint8)  # must not count
    shown = []
    found = trial.run(asked(2, repeat=2, gap=1e-4), shown.append)
    assert set(found) == set(OUTCOME)
    assert found["status"] == "optimal"
    assert found["bound"] <= found["objective"]
    assert found["gap"] <= 1.0001e-4
    assert found["root_bound"] <= found["objective"] + 1e-9
    assert len(found["searches_s"]) == 2
    assert min(found["searches_s"]) <= found["search_s"] <= max(found["searches_s"])
    alone = found["peak_memory_mb"]
    assert 30 < alone < 2000
    assert shown
    assert ended(started[0].pid)
    ballast = np.concatenate([ballast] * 4)
    assert abs(trial.run(asked(2))["peak_memory_mb"] - alone) < 100
    del ballast


@pytest.mark.parametrize(
    ("given", "status", "says"),
    [
        (asked(4, goal=(9.0, 0.0)), "refused", "goal"),
        (asked(4, time_limit=1e-3), "no plan", "no plan found within"),
        (asked(3, terrain=ledge(), goal=(0.0, 0.0)), "infeasible", "infeasible"),
    ],
)
def test_a_trial_without_a_plan_says_why(given, status, says):
    found = trial.measure(given)
    assert set(found) == set(OUTCOME)
    assert found["status"] == status
    assert says in found["message"]
    assert found["objective"] is None
    assert found["peak_memory_mb"] > 0


def test_a_crash_is_an_outcome(monkeypatch, tmp_path):
    found = trial.run(asked(gap="small"))
    assert set(found) == set(OUTCOME)
    assert found["status"] == "failed"
    assert found["message"].startswith("Traceback")
    assert "TypeError" in found["message"].splitlines()[-1]

    killed = tmp_path / "killed"
    killed.write_text("#!/bin/sh\nkill -9 $$\n")
    killed.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(killed))
    found = trial.run(asked())
    assert (found["status"], found["message"]) == ("failed", "ended by SIGKILL")


def test_an_interrupt_ends_all_processes_of_a_trial(started):
    def show(text):
        if "nodes" in text:  # the search runs, on two cores
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trial.run(asked(10), show)
    assert started[0].returncode == -signal.SIGKILL
    assert ended(started[0].pid)


def test_a_trial_travels_as_it_is():
    given = asked(3, terrain=ramp(), gap=1 / 3, formulation="paper", end_effectors=("foot", "wheel"))
    back = Trial.from_json(given.to_json())
    assert replace(back, goal=tuple(back.goal), end_effectors=tuple(back.end_effectors)) == given


def test_the_rows_are_the_papers_and_the_ramp_without_rolling_between_regions():
    names = [row.name for row in benchmark.ROWS]
    assert names == ["1,1,5", "1,1,10", "1,2,5", "1,2,10", "3,1,5", "3,1,10", "3,2,5", "3,2,5-apart"]
    free, held = benchmark.ROWS[-2:]
    assert len({region.group for region in free.terrain.regions}) == 1
    assert len({region.group for region in held.terrain.regions}) == 3
    assert free.gurobi_s == held.gurobi_s
    for one, other in zip(free.terrain.regions, held.terrain.regions, strict=True):
        assert one == replace(other, group=one.group)


@pytest.mark.parametrize("regions", range(1, 7))
def test_cut_ground_is_the_same_ground(regions):
    terrain = cut(regions)
    assert len(terrain.regions) == regions
    assert len({region.group for region in terrain.regions}) == 1
    spans = [(region.vertices[:, 0].min(), region.vertices[:, 0].max()) for region in terrain.regions]
    assert all(end == begin for (_, end), (begin, _) in pairwise(spans))
    (whole,) = flat().regions
    assert (spans[0][0], spans[-1][1]) == (whole.vertices[:, 0].min(), whole.vertices[:, 0].max())
    for region in terrain.regions:
        assert np.array_equal(region.vertices[:, 1:], whole.vertices[:, 1:])


def test_each_row_is_searched_by_both_formulations_with_their_own_limits(answers):
    trials = answers(lambda t: outcome(50.0) if t.formulation == "paper" else outcome(0.25))
    shown = []
    rows = (*TINY, Row(apart(ramp()), 2, 2, 3.0))
    run = Benchmark(rows, ["1,1,2"], Options(gap=0.01, time_limit=7.0, cap=9.0, repeat=4))
    assert not run.proven
    assert run.finished == 0
    run.run(shown.append)
    assert [(t.formulation, t.slots, t.time_limit, t.repeat) for t in trials] == [
        *[("tight", 1, 7.0, 4), ("tight", 2, 7.0, 4), ("tight", 2, 7.0, 4)],
        ("paper", 2, 9.0, 1),
    ]
    assert all(t.gap == 0.01 and t.goal == pytest.approx((0.1 * t.slots, 0.0)) for t in trials)
    assert [t.end_effectors for t in trials] == [FEET, FEET, ("foot", "wheel"), FEET]
    first, second, third = run.report["rows"]
    assert (first["ratio_gurobi"], first["ratio_paper"]) == (2.0, None)
    assert (second["ratio_gurobi"], second["ratio_paper"]) == (4.0, 200.0)
    assert second["ratio_paper_at_least"] is False
    assert (third["row"], third["terrain"], third["regions"]) == ("3,2,2-apart", "ramp-down-apart", 3)
    assert run.proven
    assert run.finished == 4
    assert run.report["complete"]
    assert shown[0] == "1 of 4  1,1,1 tight  0.1 s"


def test_ratios_say_what_is_known(answers):
    answers(lambda t: outcome(100.0, "time limit", gap=0.5) if t.formulation == "paper" else outcome(0.25))
    run = Benchmark(TINY[:1], ["1,1,1"])
    run.run()
    assert run.report["rows"][0]["ratio_paper"] == 400.0
    assert run.report["rows"][0]["ratio_paper_at_least"] is True
    assert "> 400" in text.table(run.report)
    answers(lambda t: outcome(100.0, "time limit", gap=0.5))
    run = Benchmark(TINY[:1], ["1,1,1"])
    run.run()
    assert run.report["rows"][0]["ratio_gurobi"] is None
    assert run.report["rows"][0]["ratio_paper"] is None
    assert not run.proven


def test_growth_goes_over_slots_and_regions(answers):
    trials = answers(lambda t: outcome())
    run = Benchmark((), (), Options(growth=True, growth_limit=11.0))
    run.run()
    assert {t.time_limit for t in trials} == {11.0}
    by_slots = {(t.slots, len(t.end_effectors)) for t in trials if t.terrain == flat()}
    assert by_slots == {(slots, types) for slots in range(4, 13) for types in (1, 2)}
    by_regions = {(len(t.terrain.regions), len(t.end_effectors)) for t in trials if t.terrain != flat()}
    assert by_regions == {(regions, types) for regions in range(1, 7) for types in (1, 2)}
    assert run.finished == len(trials) == 30
    for axis, counts in (("slots", range(4, 13)), ("regions", range(1, 7))):
        points = run.report["growth"][axis]
        assert [p["count"] for p in points if p["end_effectors"] == ["foot"]] == list(counts)
    assert "12 slots" in text.table(run.report)


def test_the_command_measures_tells_and_draws(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "ROWS", (TINY[0], Row(ledge(), 1, 3, 1.0)))
    assert main(["table2", "--paper-rows", "1,1,1", "--cap", "60", "--repeat", "1", "--json"]) == 1
    out, progress = capsys.readouterr()
    report = json.loads(out)
    assert "1 of 3  1,1,1 tight" in progress
    first, second = report["rows"]
    for name in ("tight", "paper"):
        assert set(first[name]) == set(OUTCOME)
        assert first[name]["status"] == "optimal"
    assert (
        abs(first["tight"]["objective"] - first["paper"]["objective"]) <= 2e-3 * first["tight"]["objective"]
    )
    assert first["ratio_gurobi"] == pytest.approx(0.5 / first["tight"]["search_s"])
    assert first["ratio_paper"] == pytest.approx(first["paper"]["search_s"] / first["tight"]["search_s"])
    assert second["tight"]["status"] == "infeasible"
    assert second["paper"] is second["ratio_gurobi"] is None
    assert report["complete"] is True
    assert report["machine"]["usable_cores"] >= 1
    assert {"cvxpy", "clarabel", "pyscipopt"} <= set(report["machine"]["packages"])
    folder = tmp_path / "results" / "table2"
    assert {path.name for path in folder.iterdir()} == FILES
    assert json.loads((folder / "table2.json").read_text()) == report
    assert (folder / "table2.png").read_bytes().startswith(b"\x89PNG")


def test_the_command_prints_tables(answers, monkeypatch, capsys, tmp_path):
    answers(
        lambda t: (
            outcome(status="failed", search_s=None, gap=None, message="a\nb") if t.slots > 1 else outcome()
        )
    )
    monkeypatch.setattr(command, "ROWS", TINY)
    assert main(["table2", "--rows", "1,1,1", "--out", str(tmp_path / "a")]) == 0
    out = capsys.readouterr().out
    assert "flat 1,1,1" in out
    assert "1,1,2" not in out
    assert out.splitlines()[-1] == f"results in {tmp_path / 'a'}"
    assert main(["table2", "--cap", "0", "--out", str(tmp_path / "b")]) == 1
    out = capsys.readouterr().out
    assert "flat 1,1,2, tight: failed: b\n" in out
    assert json.loads((tmp_path / "b" / "table2.json").read_text())["rows"][1]["tight"]["message"] == "a\nb"


@pytest.mark.parametrize(("stop", "code"), [(KeyboardInterrupt(), 130), (SystemExit(143), 143)])
def test_an_interrupt_keeps_what_was_measured(stop, code, answers, monkeypatch, capsys, tmp_path):
    def answer(given):
        if given.slots > 1:
            raise stop
        return outcome()

    answers(answer)
    monkeypatch.setattr(command, "ROWS", TINY)
    handler = signal.getsignal(signal.SIGINT)
    assert main(["table2", "--growth", "--out", str(tmp_path / "out")]) == code
    assert signal.getsignal(signal.SIGINT) == handler
    out, err = capsys.readouterr()
    assert "incomplete" in out
    assert err.splitlines()[-1].startswith("wfbook: interrupted, what was measured is in")
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES
    report = json.loads((tmp_path / "out" / "table2.json").read_text())
    assert report["complete"] is False
    assert report["rows"][0]["tight"] == outcome()
    assert report["rows"][1]["tight"] is None


def test_an_interrupt_before_anything_was_measured_leaves_nothing(answers, monkeypatch, capsys, tmp_path):
    def answer(given):
        raise KeyboardInterrupt

    answers(answer)
    assert main(["table2", "--out", str(tmp_path / "some" / "where")]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "wfbook: interrupted, nothing was written"
    assert list(tmp_path.iterdir()) == []


def test_a_signal_from_outside_keeps_what_was_measured(tmp_path):
    words = ["table2", "--rows", "1,1,5", "1,2,10", "--cap", "0", "--repeat", "1", "--gap", "0.2"]
    words += ["--out", "kept", "--json"]
    process = subprocess.Popen(
        [sys.executable, "-m", "wfbook", *words],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )
    for line in process.stderr:
        if line.startswith("2 of 2"):
            break
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    report = json.loads(out)
    assert [row["tight"] and row["tight"]["status"] for row in report["rows"]] == ["optimal", None]
    assert {path.name for path in (tmp_path / "kept").iterdir()} == FILES


def drawn(figure):
    """``{name: (x, y, face)}`` of the markers of a picture."""
    return {
        line.get_gid(): (*line.get_xydata()[0], to_hex(line.get_markerfacecolor()).upper())
        for axes in figure.axes
        for line in axes.lines
        if line.get_gid()
    }


def test_the_picture_shows_times_and_what_was_not_proven(answers):
    def answer(given):
        if given.formulation == "paper":
            return (
                outcome(300.0, "time limit", gap=0.62)
                if given.slots == 1
                else outcome(300.0, "no plan", None)
            )
        return outcome(0.25) if given.slots < 8 else outcome(None, "refused", None)

    answers(answer)
    run = Benchmark(TINY, ["1,1,1", "1,1,2"], Options(growth=True))
    run.run()
    figure = benchmarks.table2(run.report)
    found = drawn(figure)
    assert found["1,1,1 Gurobi"][:2] == (0, 0.5)
    assert found["1,1,1 tight"] == (0, 0.25, PLANNED.upper())
    assert found["1,1,1 paper"] == (0, 300.0, PAPER.upper())
    assert BODY.upper() not in {face for *_, face in found.values()}
    assert found["5 slots feet only"] == (5, 0.25, FOOT.upper())
    assert found["6 regions feet and wheels"] == (6, 0.25, WHEEL.upper())
    assert "9 slots feet only" not in found
    texts = [label.get_text() for axes in figure.axes for label in axes.texts]
    assert texts[:2] == ["gap 62 %", "no plan"]
    assert texts.count("refused") == 10
    assert all(axes.get_yscale() == "log" for axes in figure.axes)
    assert figure.png().startswith(b"\x89PNG")


@pytest.mark.parametrize("rows", [TINY, ()])
def test_a_picture_can_be_drawn_of_any_part(rows, answers):
    answers(lambda t: outcome())
    run = Benchmark(rows, (), Options(growth=not rows))
    with pytest.raises(KeyboardInterrupt):
        run.run(lambda line: stop_at(line, 2))
    assert len(benchmarks.table2(run.report).axes) == (1 if rows else 2)
    assert "incomplete" in text.table(run.report)
    run.run()
    assert benchmarks.table2(run.report).png().startswith(b"\x89PNG")


def stop_at(line, number):
    """Interrupt at a trial."""
    if line.startswith(f"{number} of"):
        raise KeyboardInterrupt


def test_columns_are_aligned():
    lines = aligned([("name", "n", "end"), ("a", "1000", "x"), ("longer", "2", "")], left=(0, 2)).splitlines()
    assert lines == ["name       n  end", "a       1000  x", "longer     2"]
