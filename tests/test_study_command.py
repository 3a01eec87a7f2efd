"""What ``study`` asks for, keeps, refuses, tells and writes; its cluster answers at once."""

import json

import pyarrow.parquet as pq
import pytest
from study_cases import FILES, content, falls, kept, study, table

from wfbook.__main__ import main
from wfbook.planner import Plan
from wfbook.study import axes, case, command, design, store
from wfbook.study.axes import AXES

pytest_plugins = ["study_cases"]


def test_a_study_asks_for_each_combination_once(answers, good, tmp_path, capsys):
    asked = answers(falls)
    words = ["--plan", good, "--sweep", "push=0,30,60", "--grid", "push=0,60", "delay=9,20", "--seeds", "3"]
    assert study(tmp_path / "a", *words) == 0
    # The grid's cells at the usual delay are points of the sweep, and so is the usual run.
    assert len(asked) == 3 * (3 + 2)
    rows = table(tmp_path / "a")
    assert [row["seed"] for row in rows] == sorted(row["seed"] for row in rows)
    shared = [r["experiments"] for r in rows if r["push_n"] in (0, 60) and r["delay_ms"] == 9]
    assert shared == [["push", "push x delay"]] * 6
    assert {r["delay_ms"] for r in rows if r["experiments"] == ["push x delay"]} == {20.0}
    assert all(r["trunk_mass"] == 1.0 and r["push_duration_s"] == 0.2 for r in rows)
    out, progress = capsys.readouterr()
    assert "15 of 15 runs, 9 upright, 0 with an error" in progress
    assert [line.split()[:4] for line in out.splitlines()[1:4]] == [
        ["0", "3/3", "100", "%"],
        ["30", "1/3", "33", "%"],
        ["60", "1/3", "33", "%"],
    ]
    assert "60  1/3  1/3" in out
    report = json.loads((tmp_path / "a" / "study.json").read_text())
    assert report["definition"]["grids"][0][1] == {
        "axis": "delay", "unit": "ms", "column": "delay_ms", "levels": [9.0, 20.0]
    }  # fmt: skip


def test_the_file_reads_as_one_row_a_run_with_types(answers, good, tmp_path):
    answers(lambda one: {"base_rms_xyz_m": [0.1, 0.2, 0.3], "end_effectors": ["foot"], "status": None})
    assert study(tmp_path / "a", "--plan", good, "--sweep", "push_start=0.1", "--set", "push=5") == 0
    read = pq.read_table(tmp_path / "a" / "study.parquet")
    assert read.num_rows == 5
    types = {name: str(read.schema.field(name).type) for name in read.column_names}
    assert {types[axis.column] for axis in AXES.values()} == {"double"}
    assert (types["error"], types["status"], types["upright"]) == ("string", "string", "bool")
    assert types["seed"] == "int64" and types["base_rms_xyz_m"].startswith("list<")
    assert {"wfbook_version", "code_version", "mujoco_version"} <= set(types)
    described = json.loads(read.schema.metadata[b"wfbook"])
    assert described["base"]["push"] == 5.0 and described["plans"].keys() == {"good"}


def test_the_standard_study_goes_over_all_axes(answers, good, monkeypatch, tmp_path):
    asked = answers(lambda one: {})
    assert study(tmp_path / "a", "--plan", good, "--seeds", "1") == 0
    varied = {n for one in asked for n in AXES if one.values[n] != AXES[n].usual}
    assert varied == set(design.STANDARD_SWEEPS)
    maps = {"map-push-x-delay.png", "map-trunk_mass-x-ground_friction.png"}
    assert {path.name for path in (tmp_path / "a").iterdir()} == {*FILES, "sweeps.png", *maps}
    words = ["--plan", good, "--seeds", "1", "--state", "true", "--set", "push_start=0.1"]
    asked.clear()
    monkeypatch.setattr(command, "_publish", lambda *_: None)  # the same figures again
    assert study(tmp_path / "b", *words) == 0
    assert {one.values["sensor_noise"] for one in asked} == {1.0}
    assert {one.values["push_start"] for one in asked if one.values["push"]} == {0.1}


def test_a_larger_study_goes_on_and_another_is_refused(answers, good, bad, monkeypatch, capsys, tmp_path):
    asked = answers(falls)
    sweep = ["--plan", good, "--sweep", "push=0,30"]
    assert study(tmp_path, *sweep, "--seeds", "2") == 0
    assert study(tmp_path, *sweep, "--seeds", "3", "--grid", "push=0,30", "delay=20") == 0
    assert len(asked) == 4 + 2 + 6
    assert study(tmp_path, *sweep, "--seeds", "3", "--grid", "push=0,30", "delay=20") == 0
    assert len(asked) == 12 and len(table(tmp_path)) == 12
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    capsys.readouterr()
    for words, reason in (
        ([*sweep, "--seeds", "3"], "6 runs of another study (other disturbances or seeds)"),
        (["--plan", bad, *sweep[2:]], "(another plan)"),
        ([*sweep, "--state", "true"], "(another state or wheel model)"),
    ):
        assert study(tmp_path, *words) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert reason in line and str(tmp_path) in line
    newer = case.versions() | {"mujoco": "9.9"}
    monkeypatch.setattr(design, "versions", lambda: newer)
    assert study(tmp_path, *sweep, "--seeds", "3") == 2
    assert f"(mujoco {case.versions()['mujoco']}, not 9.9)" in capsys.readouterr().err
    assert len(asked) == 12 and before == {path: path.read_bytes() for path in tmp_path.iterdir()}


def test_a_part_can_be_run_now(answers, good, capsys, tmp_path):
    asked = answers(falls)
    words = ["--plan", good, "--sweep", "push=0,30", "--seeds", "3"]
    assert study(tmp_path / "a", *words, "--runs", "0") == 1
    assert "--runs 0: no run is finished" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert study(tmp_path / "a", *words, "--runs", "4") == 0
    assert "4 of 6 runs: incomplete" in capsys.readouterr().out
    assert (len(asked), len(table(tmp_path / "a"))) == (4, 4)
    assert study(tmp_path / "a", *words, "--runs", "0", "--json") == 0
    assert json.loads(capsys.readouterr().out)["complete"] is False
    assert study(tmp_path / "a", *words) == 0
    assert len(asked) == 6


def test_errors_are_rows_and_can_be_tried_again(answers, good, capsys, tmp_path):
    asked = answers(lambda one: {"error": "OSError: x", "upright": None} if one.seed == 1 else {})
    words = ["--plan", good, "--sweep", "push=0,30", "--seeds", "2"]
    assert study(tmp_path, *words) == 1
    out = capsys.readouterr().out
    assert "2 runs ended with OSError: x" in out
    assert out.splitlines()[1].split() == ["0", "1/1", "100", "%", "21", "to", "100", "%", "1", "1.0", "1"]
    assert study(tmp_path, *words) == 1 and len(asked) == 4
    answers(lambda one: {})
    assert study(tmp_path, *words, "--retry") == 0 and len(asked) == 6


@pytest.mark.parametrize(("stop", "code"), [(KeyboardInterrupt(), 130), (SystemExit(143), 143)])
def test_an_interrupt_keeps_what_is_finished(stop, code, answers, good, capsys, tmp_path):
    def answer(one):
        if one.seed:
            raise stop
        return {}

    answers(answer)
    words = ["--plan", good, "--sweep", "push=0,30"]
    assert study(tmp_path / "a", *words) == code
    assert "interrupted, 2 of 10 runs are kept in" in capsys.readouterr().err.splitlines()[-1]
    assert len(kept(tmp_path / "a")) == 2
    asked = answers(lambda one: {})
    assert study(tmp_path / "a", *words) == 0
    assert [one.seed for one in asked[-8:]] == [1, 1, 2, 2, 3, 3, 4, 4]


def test_an_interrupt_before_any_run_is_finished_leaves_nothing(answers, good, capsys, tmp_path):
    def answer(one):
        raise KeyboardInterrupt

    answers(answer)
    assert study(tmp_path / "some" / "where", "--plan", good) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "wfbook: interrupted, nothing was written"
    assert list(tmp_path.iterdir()) == []


def test_one_study_at_a_time_in_a_folder(answers, good, capsys, tmp_path):
    answers(lambda one: {})
    with store.opened(tmp_path / "a"):
        assert study(tmp_path / "a", "--plan", good) == 2
    assert capsys.readouterr().err == f"wfbook: --out: another study is at work in {str(tmp_path / 'a')!r}\n"
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_ends_the_study_and_keeps_what_is_finished(answers, good, capsys, tmp_path):
    answers(lambda one: {} if one.seed < 2 else {"traceback": "long" * 10_000})
    opened = store._connection

    def small(path):
        connection = opened(path)
        connection.execute("PRAGMA max_page_count = 6")
        return connection

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "_connection", small)
        assert study(tmp_path, "--plan", good, "--sweep", "push=0") == 1
    assert "runs.sqlite can't be written: database or disk is full, 2 of 5" in capsys.readouterr().err
    assert len(kept(tmp_path)) == 2


@pytest.mark.parametrize("content", [b"nonsense" * 100, b""])
def test_a_store_that_is_none_is_left_alone(content, answers, good, capsys, tmp_path):
    answers(lambda one: {})
    (tmp_path / "runs.sqlite").write_bytes(content)
    code = study(tmp_path, "--plan", good, "--sweep", "push=0")
    assert code == (2 if content else 0)
    if content:
        assert "not a file of finished runs" in capsys.readouterr().err
        assert (tmp_path / "runs.sqlite").read_bytes() == content


def test_a_terrain_is_planned_once(answers, monkeypatch, capsys, tmp_path):
    answers(lambda one: {})
    words = ["flat", "--slots", "1", "--feet-only", "--sweep", "push=0", "--seeds", "1"]
    assert study(tmp_path / "a", *words) == 0
    assert "planning flat" in capsys.readouterr().err
    (path,) = (tmp_path / "a").glob("plan-flat-*.npz")
    assert Plan.load(path).slots == 1
    assert study(tmp_path / "a", *words[:-1], "2") == 0
    assert "planning" not in capsys.readouterr().err
    assert study(tmp_path / "a", *words, "--feet-only", "--slots", "2") == 2
    assert "(another plan)" in capsys.readouterr().err
    assert list((tmp_path / "a").glob("plan-flat-*.npz")) == [path]


WRONG = [
    (["--sweep", "pull"], "'pull' is none of push, push_angle"),
    (["--sweep", "push=-1"], "push: must be 0 to 1000 N, is '-1'"),
    (["--sweep", "push=0,"], "push: must be 0 to 1000 N, is ''"),
    (["--sweep", "trunk_mass=nan"], "trunk_mass: must be 0.1 to 10, is 'nan'"),
    (["--sweep", "delay=1.5"], "delay: must be 0 to 100 ms, whole, is '1.5'"),
    (["--set", "push_duration=0"], "push_duration: must be above 0 to 10 s, is '0'"),
    (["--grid", "push", "push=3"], "push stands against itself"),
    (["--sweep", "push", "--sweep", "push=3"], "push is asked for twice"),
    (["--sweep", "push_angle"], "push_angle has no effect without --set push=N"),
    (["--sweep", "push", "--sweep", "push_angle"], "push_angle has no effect without --set push=N"),
    (["--sweep", "delay", "--set", "push_start=1"], "--set push_start has no effect without"),
    (["--wheel-model", "slack", "--state", "true"], "--wheel-model has no effect with --state true"),
    (["--sweep", "sensor_noise", "--state", "true"], "sensor_noise has no effect with --state true"),
    (["--seeds", "0"], "must be at least 1"),
    (["--workers", "2", "--scheduler", "x"], "--workers has no effect with --scheduler"),
    (["--slots", "3"], "--slots has no effect with --plan"),
    (["flat"], "TERRAIN 'flat' has no effect with --plan"),
    (["--wheel-model", "guess"], "'guess' is none of encoder"),
    (["--plan", "nowhere.npz"], "'nowhere.npz': No such file"),
    (["--plan", __file__], "not a plan file"),
]


@pytest.mark.parametrize(("words", "says"), WRONG, ids=[" ".join(w) for w, _ in WRONG])
def test_wrong_input_is_one_line(words, says, answers, good, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = answers(lambda one: {})
    assert main(["study", *words, *([] if "--plan" in words else ["--plan", good])]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line
    assert not asked and list(tmp_path.iterdir()) == []


def test_the_same_plan_twice_is_refused_and_names_stay_apart(answers, good, bad, capsys, tmp_path):
    answers(lambda one: {})
    copy = tmp_path / "other.npz"
    copy.write_bytes(content(good))
    assert study(tmp_path / "a", "--plan", good, str(copy)) == 2
    assert "is the same plan as" in capsys.readouterr().err
    copy = copy.rename(tmp_path / "bad.npz")
    assert study(tmp_path / "a", "--plan", bad, str(copy), "--sweep", "push=0") == 0
    assert {row["plan"] for row in table(tmp_path / "a")} == {bad, str(copy)}


def test_maps_of_an_earlier_study_go(answers, good, tmp_path):
    answers(lambda one: {})
    words = ["--plan", good, "--seeds", "1", "--sweep", "push=0,60", "--sweep", "delay=9,20"]
    assert study(tmp_path, *words, "--grid", "push=0", "delay=9,20") == 0
    assert (tmp_path / "map-push-x-delay.png").exists()
    assert study(tmp_path, *words) == 0
    assert not (tmp_path / "map-push-x-delay.png").exists()


def test_help_names_every_axis_with_its_range(capsys):
    with pytest.raises(SystemExit):
        main(["study", "--help"])
    out = capsys.readouterr().out
    for axis in AXES.values():
        assert axis.name in out and axis.range in out
    for axis in AXES.values():
        assert all(axis.read(repr(level)) == level for level in axis.levels)
    assert axes.levels("push=9,3,3") == (AXES["push"], (3.0, 9.0))
    assert command.FORMAT == 1
