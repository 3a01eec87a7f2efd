import io
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import handmade
import numpy as np
import pytest

from wfbook import planner, receding, simulate
from wfbook.__main__ import main
from wfbook.report import ProgressLine, plain
from wfbook.results import ResultFolder
from wfbook.table2 import trial
from wfbook.terrain import flat, stepping_stones

FILES = {"plan_relaxed.npz", "plan.npz", "run.npz", "metrics.json", "gait.png", "replay.html"}


@pytest.fixture(scope="module")
def plan():
    """Stand for one slot."""
    return handmade.stand(1)


@pytest.fixture(scope="module")
def plan_file(plan, tmp_path_factory):
    path = tmp_path_factory.mktemp("plans") / "plan.npz"
    plan.save(path)
    return path


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def no_work(monkeypatch):
    """Fail the test if planning or simulation begins: wrong input must be found before."""

    def begun(*args, **options):
        pytest.fail("work began with wrong input")

    monkeypatch.setattr(planner, "solve_executable", begun)
    monkeypatch.setattr(simulate, "run", begun)
    monkeypatch.setattr(receding, "run", begun)
    monkeypatch.setattr(trial, "run", begun)


@pytest.fixture(scope="module")
def recorded(plan):
    return simulate.run(plan, hold=0.1)


@pytest.fixture
def planned(monkeypatch, plan, recorded):
    """Replace search, polish and simulation; return what is asked of the search."""
    asked = {}

    def solve(problem, **options):
        asked.update(options, problem=problem)
        options["progress"](planner.Progress(nodes=3, incumbent=np.inf, bound=0.5, gap=np.inf, time=0.1))
        options["progress"](planner.Progress(nodes=4, incumbent=0.6, bound=0.5, gap=0.2, time=0.2))
        return plan.with_meta(stage="relaxed"), plan

    monkeypatch.setattr(planner, "solve_executable", solve)
    monkeypatch.setattr(simulate, "run", lambda plan, **options: recorded)
    return asked


def refused(capsys, tmp_path, *argv):
    """Run with wrong input: one line on stderr, exit code 2, nothing on stdout, nothing written."""
    before = everything(tmp_path)
    code = main([str(word) for word in argv])
    out, err = capsys.readouterr()
    assert code == 2
    assert out == ""
    assert err.endswith("\n")
    assert err.count("\n") == 1, err
    assert everything(tmp_path) == before
    return err


def everything(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


WRONG = {
    "no command": ([], "COMMAND"),
    "unknown command": (["fly"], "'fly'"),
    "no such chapter": (["book", "--only", "77"], "'77'"),
    "no terrain": (["run"], "TERRAIN is missing"),
    "unknown terrain": (["run", "falt"], "did you mean 'flat'?"),
    "far-off terrain": (["run", "moon"], "unknown terrain 'moon'"),
    "missing terrain file": (["run", "moon.json"], "'moon.json': No such file"),
    "unknown option": (["run", "flat", "--speed", "3"], "--speed"),
    "abbreviated option": (["run", "flat", "--feet"], "--feet"),
    "goal out of reach": (["run", "flat", "--goal", "9", "0"], "out of reach"),
    "goal outside": (["run", "flat", "--goal", "0,-7"], "outside the terrain"),
    "half a goal": (["run", "flat", "--goal", "1"], "must be two numbers X Y"),
    "no goal": (["run", "flat", "--goal"], "--goal"),
    "goal is no number": (["run", "flat", "--goal", "here", "there"], "must be two numbers X Y"),
    "goal is not finite": (["run", "flat", "--goal", "nan,0"], "must be finite"),
    "no slots": (["run", "flat", "--slots", "0"], "--slots: must be at least 1, is 0"),
    "negative slots": (["run", "flat", "--slots", "-3"], "--slots: must be at least 1, is -3"),
    "half a slot": (["run", "flat", "--slots", "2.5"], "--slots: must be a whole number"),
    "unknown formulation": (["run", "flat", "--formulation", "loose"], "'loose'"),
    "negative gap": (["run", "flat", "--gap", "-0.1"], "--gap: must be above 0"),
    "gap is not finite": (["run", "flat", "--gap", "nan"], "--gap: must be a finite number"),
    "no time": (["run", "flat", "--time-limit", "0"], "--time-limit: must be above 0"),
    "negative delay": (["run", "flat", "--delay-ms", "-1"], "--delay-ms: must be at least 0"),
    "negative seed": (["run", "flat", "--seed", "-1"], "--seed: must be at least 0"),
    "unknown state": (["run", "flat", "--state", "guessed"], "'guessed'"),
    "search time while moving": (
        ["run", "flat", "--replan", "--time-limit", "3"],
        "--time-limit has no effect",
    ),
    "big-M while moving": (
        ["run", "flat", "--replan", "--formulation", "paper"],
        "--formulation has no effect",
    ),
    "clock without replanning": (["run", "flat", "--clock", "wall"], "no effect without --replan"),
    "unknown clock": (["run", "flat", "--replan", "--clock", "sun"], "'sun'"),
    "plan and replanning": (["run", "--plan", "gone.npz", "--replan"], "--replan has no effect with --plan"),
    "missing plan file": (["run", "--plan", "gone.npz"], "'gone.npz': No such file"),
    "plan and slots": (["run", "--plan", "gone.npz", "--slots", "3"], "--slots has no effect with --plan"),
    "plan and wheels": (["run", "--plan", "gone.npz", "--feet-only"], "--feet-only has no effect"),
    "unknown row": (["table2", "--rows", "1,1,6"], "'1,1,6'"),
    "unknown row of the paper's": (["table2", "--paper-rows", "1,1"], "'1,1'"),
    "row not asked for": (
        ["table2", "--rows", "1,1,5", "--paper-rows", "1,2,5"],
        "1,2,5 is not among --rows",
    ),
    "paper rows without a cap": (["table2", "--paper-rows", "1,1,5", "--cap", "0"], "no effect with --cap 0"),
    "no rows": (["table2", "--rows"], "--rows: none is left"),
    "no gap for the table": (["table2", "--gap", "0"], "--gap: must be above 0"),
    "no time for the table": (["table2", "--time-limit", "0"], "--time-limit: must be above 0"),
    "negative cap": (["table2", "--cap", "-1"], "--cap: must be at least 0"),
    "no time to grow": (["table2", "--growth-limit", "inf"], "--growth-limit: must be a finite number"),
    "no runs": (["table2", "--repeat", "0"], "--repeat: must be at least 1"),
    "a terrain for the table": (["table2", "flat"], "flat"),
    "table out under a device": (["table2", "--out", "/dev/null/results"], "can't be written"),
    "out under a device": (["run", "flat", "--out", "/dev/null/results"], "can't be written"),
    "out in a closed system": (["run", "flat", "--out", "/proc/wfbook/results"], "can't be written"),
}


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("name", WRONG)
def test_wrong_input_is_one_line(name, capsys, tmp_path):
    argv, says = WRONG[name]
    assert says in refused(capsys, tmp_path, *argv)


@pytest.mark.usefixtures("no_work")
def test_wrong_terrain_files_are_one_line(capsys, tmp_path):
    data = flat().to_dict()
    data["regions"][0]["mu_foot"] = -0.7
    (tmp_path / "floor.json").write_text(json.dumps(data))
    err = refused(capsys, tmp_path, "run", "floor.json")
    assert "'floor.json': region 0: mu_foot: must not be negative, is -0.7" in err
    (tmp_path / "floor.json").write_text("{")
    assert "'floor.json': not JSON" in refused(capsys, tmp_path, "run", "floor.json")
    (tmp_path / "folder.json").mkdir()
    assert "'folder.json'" in refused(capsys, tmp_path, "run", "folder.json")


@pytest.mark.usefixtures("no_work")
def test_wrong_plan_files_are_one_line(capsys, tmp_path, plan, plan_file):
    path = tmp_path / "bad.npz"
    whole = plan_file.read_bytes()

    for size in (0, 10, 1000, len(whole) // 2, len(whole) - 30):
        path.write_bytes(whole[:size])
        assert "bad.npz" in refused(capsys, tmp_path, "run", "--plan", path)

    path.write_text("not a plan at all\n" * 50)
    assert "bad.npz" in refused(capsys, tmp_path, "run", "--plan", path)

    lam = plan.lam.copy()
    lam[0, 0, 0] = np.nan
    replace(plan, lam=lam).save(path)
    assert "lam" in refused(capsys, tmp_path, "run", "--plan", path)

    with np.load(plan_file) as data:
        arrays = dict(data)
    arrays["meta"] = np.array(json.dumps(json.loads(str(arrays["meta"])) | {"format": 99}))
    np.savez(path, **arrays)
    assert "99" in refused(capsys, tmp_path, "run", "--plan", path)

    np.savez(path, **{**arrays, "x": np.array([{}], dtype=object)})
    assert "bad.npz" in refused(capsys, tmp_path, "run", "--plan", path)


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("seed", range(40))
def test_plan_files_with_a_flipped_byte_never_end_in_a_traceback(seed, capsys, tmp_path, plan_file):
    rng = np.random.default_rng(seed)
    data = bytearray(plan_file.read_bytes())
    data[rng.integers(len(data))] ^= int(rng.integers(1, 256))
    (tmp_path / "bad.npz").write_bytes(data)
    # The terrain does not fit the plan, so that a flip which does no harm is refused, too.
    refused(capsys, tmp_path, "run", "stepping-stones", "--plan", tmp_path / "bad.npz")


@pytest.mark.usefixtures("no_work")
def test_a_plan_for_another_terrain_is_refused(capsys, tmp_path, plan_file):
    err = refused(capsys, tmp_path, "run", "stepping-stones", "--plan", plan_file)
    assert "made for terrain 'flat'" in err


@pytest.mark.usefixtures("no_work")
def test_an_output_folder_that_is_a_file_is_refused(capsys, tmp_path):
    (tmp_path / "results").write_text("mine")
    assert "can't be written" in refused(capsys, tmp_path, "run", "flat", "--out", "results")
    assert "can't be written" in refused(capsys, tmp_path, "run", "flat", "--out", "results/deep/er")
    assert (tmp_path / "results").read_text() == "mine"


def test_a_plan_file_is_executed(capsys, tmp_path, plan_file):
    out = tmp_path / "deep" / "results"
    assert main(["run", "--plan", str(plan_file), "--out", str(out), "--json"]) == 0
    text, progress = capsys.readouterr()
    metrics = json.loads(text)
    assert metrics["upright"] is True
    assert metrics["distance_m"] < 0.01
    assert "simulating" in progress
    assert {path.name for path in out.iterdir()} == FILES - {"plan_relaxed.npz"}
    assert json.loads((out / "metrics.json").read_text()) == metrics
    assert planner.Plan.load(out / "plan.npz").terrain == flat()
    assert simulate.Run.load(out / "run.npz").metrics["upright"]
    assert (out / "gait.png").read_bytes().startswith(b"\x89PNG")
    assert "<html" in (out / "replay.html").read_text(encoding="utf-8").lower()
    assert everything(tmp_path / "deep") == {"results"} | {f"results/{path.name}" for path in out.iterdir()}


def test_options_reach_the_planner(planned, capsys, tmp_path):
    search = ["--slots", "4", "--formulation", "paper", "--gap", "0.01", "--time-limit", "7"]
    assert main(["run", "flat", "--goal", "-0.1", "0.05", "--feet-only", *search]) == 0
    problem = planned["problem"]
    assert problem.goal == (-0.1, 0.05)
    assert problem.slots == 4
    assert tuple(problem.end_effectors) == ("foot",)
    assert (planned["formulation"], planned["gap"], planned["time_limit"]) == ("paper", 0.01, 7.0)
    out, err = capsys.readouterr()
    assert "planning" in err
    assert "upright" in out
    assert {path.name for path in (tmp_path / "runs" / "flat").iterdir()} == FILES
    assert planner.Plan.load("runs/flat/plan_relaxed.npz").meta["stage"] == "relaxed"


@pytest.mark.parametrize("words", [["--goal", "0.2", "-0.1"], ["--goal", "0.2,-0.1"], ["--goal=0.2,-0.1"]])
def test_goals_can_be_written_with_and_without_a_comma(words, planned):
    for argv in (["run", "flat", *words], ["run", *words, "flat"]):
        assert main(argv) == 0
        assert planned["problem"].goal == (0.2, -0.1)


def test_the_default_goal_grows_with_the_slots(planned):
    assert main(["run", "flat", "--slots", "6"]) == 0
    assert planned["problem"].goal == pytest.approx((0.6, 0.0))
    assert set(planned["problem"].end_effectors) == {"foot", "wheel"}


def test_results_of_an_earlier_run_are_replaced(planned, plan_file, tmp_path):
    out = tmp_path / "runs" / "flat"
    assert main(["run", "flat"]) == 0
    (out / "notes.txt").write_text("mine")
    (out / "metrics.json").write_text("old")
    assert main(["run", "--plan", str(plan_file)]) == 0
    assert {path.name for path in out.iterdir()} == (FILES | {"notes.txt"}) - {"plan_relaxed.npz"}
    assert (out / "metrics.json").read_text() != "old"
    assert everything(out.parent) == {"flat"} | {f"flat/{path.name}" for path in out.iterdir()}


def test_a_fall_is_told_with_its_time(planned, recorded, monkeypatch, capsys, tmp_path):
    fell = replace(
        recorded, metrics=recorded.metrics | {"fell": True, "fall_time_s": 1.234, "upright": False}
    )
    monkeypatch.setattr(simulate, "run", lambda plan, **options: fell)
    assert main(["run", "flat", "--json"]) == 1
    out, err = capsys.readouterr()
    assert err.splitlines()[-1] == "wfbook: the robot fell at 1.23 s"
    assert json.loads(out)["fall_time_s"] == 1.234
    assert {path.name for path in (tmp_path / "runs" / "flat").iterdir()} == FILES


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (planner.NoPlanError("no plan found within 3.0 s"), 1, "no plan found within 3.0 s"),
        (KeyboardInterrupt(), 130, "interrupted, nothing was written"),
        (planner.InfeasibleError(("step",)), 1, str(planner.InfeasibleError(("step",)))),
    ],
)
def test_no_plan_leaves_nothing_behind(error, code, says, monkeypatch, capsys, tmp_path):
    def solve(*args, **options):
        raise error

    monkeypatch.setattr(planner, "solve_executable", solve)
    assert main(["run", "flat", "--time-limit", "3", "--out", "some/where/new"]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err == f"wfbook: {says}\n"
    assert everything(tmp_path) == set()


def test_a_crash_leaves_nothing_behind(planned, monkeypatch, tmp_path):
    monkeypatch.setattr(simulate, "run", lambda *args, **options: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["run", "flat", "--out", "some/where/new"])
    assert everything(tmp_path) == set()


def test_a_killed_program_leaves_nothing_behind(plan_file, tmp_path):
    command = [sys.executable, "-m", "wfbook", "run", "--plan", str(plan_file), "--out", "new/results"]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, env=os.environ | {"OMP_NUM_THREADS": "1"}
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob("new/.results-*")) and time.monotonic() < deadline:
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert everything(tmp_path) == set()


def test_help_names_every_terrain(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["run", "--help"])
    assert ended.value.code == 0
    out = " ".join(capsys.readouterr().out.split())
    for name in ("flat-friction", "ramp-down", "ramp-up", "omni-waves", "omni-squat"):
        assert name in out.replace("- ", "-"), name


def test_lab_opens_the_notebooks(monkeypatch):
    called = []
    monkeypatch.setattr(subprocess, "call", lambda command: called.append(command) or 0)
    assert main(["lab", "--no-browser"]) == 0
    assert called[0][1:3] == ["-m", "jupyterlab"]
    assert called[0][3].endswith("notebooks")
    assert called[0][4:] == ["--no-browser"]


def test_a_terrain_name_makes_a_safe_folder_name(planned, tmp_path):
    terrain = flat()
    replace(terrain, name="../My floor / 1").save(tmp_path / "floor.json")
    assert main(["run", "floor.json"]) == 0
    assert [path.name for path in (tmp_path / "runs").iterdir()] == ["My-floor-1"]


def test_result_folder_is_all_or_nothing(tmp_path):
    with pytest.raises(RuntimeError), ResultFolder(tmp_path / "a" / "b", ("x",)) as folder:
        (folder.path / "x").write_text("half")
        raise RuntimeError
    assert everything(tmp_path) == set()
    with ResultFolder(tmp_path / "a" / "b", ("x", "y")) as folder:
        (folder.path / "x").write_text("whole")
        assert not (tmp_path / "a" / "b").exists()
        folder.publish()
    assert everything(tmp_path) == {"a", "a/b", "a/b/x"}


def test_plain_makes_json_of_anything_numeric():
    value = {
        "a": np.float32(0.5),
        "b": np.array([1, 2]),
        "c": (np.bool_(True), np.nan, np.inf),
        3: np.int8(4),
    }
    assert plain(value) == {"a": 0.5, "b": [1, 2], "c": [True, None, None], "3": 4}
    json.dumps(plain(value), allow_nan=False)


class _Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_is_one_line_on_a_terminal_and_few_lines_elsewhere():
    terminal, file = _Terminal(), io.StringIO()
    for stream in (terminal, file):
        with ProgressLine(stream) as line:
            for i in range(1000):
                line.show(f"step {i}")
    assert terminal.getvalue().count("\n") == 1
    assert file.getvalue().splitlines()[0] == "step 0"
    assert file.getvalue().splitlines()[-1] == "step 999"
    assert file.getvalue().count("\n") <= 3


def test_a_file_of_several_regions_is_planned_and_executed(capsys, tmp_path):
    stepping_stones(gap=0.05, start=0.25).save(tmp_path / "stones.json")
    options = ["--slots", "3", "--goal", "0.1", "0", "--feet-only", "--gap", "0.05", "--json"]
    assert main(["run", "stones.json", *options]) == 0
    assert json.loads(capsys.readouterr().out)["terrain"] == "stepping-stones"
    assert {path.name for path in (tmp_path / "runs" / "stepping-stones").iterdir()} == FILES


def test_an_infeasible_floor_is_named(capsys, tmp_path):
    """The hind legs stand beside this floor from the start."""
    data = flat().to_dict()
    data["regions"][0]["vertices"] = [[-0.15, -1, 0], [1, -1, 0], [1, 1, 0], [-0.15, 1, 0]]
    (tmp_path / "ledge.json").write_text(json.dumps(data))
    assert main(["run", "ledge.json", "--slots", "3", "--goal", "0", "0"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    last = err.splitlines()[-1]
    assert last.startswith("wfbook: infeasible")
    assert "over no region" in last
    assert everything(tmp_path) == {"ledge.json"}


def test_no_time_is_told_in_one_line(capsys, tmp_path):
    assert main(["run", "flat", "--slots", "4", "--time-limit", "0.001"]) == 1
    assert "wfbook: no plan found within" in capsys.readouterr().err.splitlines()[-1]
    assert everything(tmp_path) == set()


@pytest.mark.parametrize("patience", [0.0, 3.0])
def test_an_interrupted_search_goes_on_with_its_incumbent(patience, tmp_path):
    command = [sys.executable, "-m", "wfbook", "run", "flat", "--slots", "12", "--gap", "1e-5", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in process.stderr:
        if "incumbent" in line and "none" not in line:
            break
    time.sleep(patience)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    metrics = json.loads(out)
    assert metrics["status"] == "interrupted"
    assert metrics["bound"] < metrics["objective"]
    assert {path.name for path in (tmp_path / "runs" / "flat").iterdir()} == FILES


def test_replanning_leaves_the_same_files(capsys, monkeypatch, plan, recorded):
    asked = {}
    window = {"slots": [0, 1], "status": "optimal", "planning_s": 0.3}
    told = {"late": 1, "without_plan": 2, "planning_s_median": 0.5, "share_max": 0.8, "windows": [window] * 3}

    def run(problem, **options):
        asked.update(options, problem=problem)
        metrics = recorded.metrics | {"replanning": told, "status": "replanned"}
        return replace(recorded, metrics=metrics), plan.with_meta(stage="relaxed"), plan

    monkeypatch.setattr(receding, "run", run)
    words = ["run", "flat", "--replan", "--slots", "20", "--clock", "wall", "--seed", "3", "--out", "here"]
    assert main(words) == 0
    assert everything(Path("here")) == FILES
    assert asked["problem"].slots == 20
    assert (asked["clock"], asked["gap"], asked["seed"]) == ("wall", 0.02, 3)
    table = capsys.readouterr().out
    assert "3 windows, 1 late, 2 without a plan; 0.50 s median, at most 80 %" in table
    assert json.loads(Path("here/metrics.json").read_text())["replanning"]["late"] == 1


def test_replanning_that_finds_no_plan_is_one_line(capsys, monkeypatch):
    def run(problem, **options):
        raise planner.NoPlanError("no plan found for the first window within its budget")

    monkeypatch.setattr(receding, "run", run)
    assert main(["run", "flat", "--replan"]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == (
        "wfbook: no plan found for the first window within its budget"
    )
