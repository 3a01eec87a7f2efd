"""The robustness study: what a case is, what is kept of it, and how it is told and drawn."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace

import dask
import handmade
import numpy as np
import psutil
import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster
from matplotlib.colors import to_hex
from scipy.stats import binomtest

from wfbook.__main__ import main
from wfbook.planner import Plan
from wfbook.study import axes, case, cluster, command, design, store, tables
from wfbook.study.axes import AXES
from wfbook.study.case import TIMES
from wfbook.study.design import Study
from wfbook.study.ground import PATCH, real_terrain
from wfbook.terrain import stepping_stones
from wfbook.view import survival

FILES = {"runs.sqlite", "study.parquet", "study.json"}


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A plan file: stand."""
    path = tmp_path_factory.mktemp("plans") / "good.npz"
    handmade.stand(1).save(path)
    return str(path)


@pytest.fixture(scope="module")
def bad(tmp_path_factory):
    """A plan file that asks for what no leg can do."""
    path = tmp_path_factory.mktemp("plans") / "bad.npz"
    plan = handmade.stand(1)
    replace(plan, x=plan.x + np.array([0.0, 0.0, 1.0])).save(path)
    return str(path)


@pytest.fixture
def answers(monkeypatch):
    """Replace cluster and simulation by answers from a function; return the cases asked for."""
    asked = []

    class Workers:
        def nthreads(self):
            return {"here": 1}

    @contextmanager
    def local(count):
        yield Workers()

    def install(answer):
        def results(client, cases, plans):
            for key, one in cases.items():
                assert design.digest(plans[one.plan]) == one.plan
                asked.append(one)
                yield key, one.row() | {"error": None, "upright": True, "base_rms_m": 0.001} | answer(one)

        monkeypatch.setattr(cluster, "local", local)
        monkeypatch.setattr(cluster, "results", results)
        return asked

    return install


def falls(one):
    """Whoever is pushed with 30 N or more falls, from seed 1 on."""
    return {"upright": one.values["push"] < 30 or one.seed == 0}


def study(folder, *words):
    """Run the command."""
    return main(["study", *words, "--out", str(folder)])


def table(folder):
    """The rows of the Parquet file."""
    return pq.read_table(folder / "study.parquet").to_pylist()


def lasting(rows):
    """Rows by key without what differs from time to time."""
    return {row["run"]: {k: v for k, v in row.items() if k not in (*TIMES, "traceback")} for row in rows}


def kept(folder):
    """The rows of the store."""
    if not (folder / "runs.sqlite").exists():
        return {}
    connection = sqlite3.connect(folder / "runs.sqlite")
    try:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        return dict(connection.execute("SELECT key, row FROM runs").fetchall())
    except sqlite3.OperationalError:  # it is being made
        return {}
    finally:
        connection.close()


def living(process):
    """Whether a process still runs; nobody waits for a killed grandchild, which may stay a zombie."""
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@pytest.fixture(scope="module")
def killed(good, bad, tmp_path_factory):
    """A real study that was killed and went on: its folder, words, and the rows when it was killed."""
    folder = tmp_path_factory.mktemp("killed") / "study"
    words = ["--plan", good, bad, "--sweep", "push=0,300", "--seeds", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "wfbook", "study", *words, "--workers", "2", "--out", str(folder)],
        stderr=subprocess.PIPE,
        text=True,
    )
    while len(kept(folder)) < 2 and process.poll() is None:
        time.sleep(0.02)
    workers = psutil.Process(process.pid).children(recursive=True)
    process.kill()
    process.communicate(timeout=30)
    until = time.monotonic() + 20.0
    while any(living(worker) for worker in workers):
        assert time.monotonic() < until, "workers outlive their study"
        time.sleep(0.05)
    before = kept(folder)
    assert {path.name for path in folder.iterdir()} <= {"runs.sqlite", "runs.sqlite-journal"}
    assert study(folder, *words, "--workers", "2") == 1  # the bad plan's runs
    return folder, words, before


def test_a_killed_study_goes_on_loses_nothing_and_repeats_nothing(killed):
    folder, _, before = killed
    after = kept(folder)
    assert 2 <= len(before) < len(after) == 8
    assert all(after[key] == row for key, row in before.items())  # to the microsecond of its wall time
    assert {path.name for path in folder.iterdir()} == {*FILES, "sweeps.png"}
    rows = table(folder)
    assert len(rows) == len({row["run"] for row in rows}) == 8
    assert {(r["plan"], r["seed"], r["push_n"]) for r in rows} == {
        (plan, seed, push) for plan in ("good", "bad") for seed in (0, 1) for push in (0.0, 300.0)
    }
    for row in rows:
        if row["plan"] == "good":
            assert row["error"] is None
            assert row["upright"] == (row["push_n"] == 0.0)
            assert (row["push_angle_deg"] is None) == (row["push_n"] == 0.0)


def test_a_run_that_crashes_is_a_row(killed):
    rows = [row for row in table(killed[0]) if row["plan"] == "bad"]
    assert len(rows) == 4
    for row in rows:
        assert row["error"].startswith("ValueError: ") and "can't reach" in row["error"]
        assert row["traceback"].startswith("Traceback")
        assert row["upright"] is None and row["mujoco_version"]
    report = json.loads((killed[0] / "study.json").read_text())
    assert len(report["failures"]) == 4 and report["complete"]
    assert [cell["runs"] for sweep in report["sweeps"] for cell in sweep["cells"]] == [2, 2, 0, 0]


def test_rows_are_the_same_through_a_scheduler_with_one_worker(killed, good, bad, tmp_path):
    folder, words, _ = killed
    with LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as running:
        assert study(tmp_path / "b", *words, "--scheduler", running.scheduler_address) == 1
        assert [w.status.name for w in running.workers.values()] == ["running"]  # not ours to end
    assert lasting(table(tmp_path / "b")) == lasting(table(folder))
    assert [row["run"] for row in table(tmp_path / "b")] == [row["run"] for row in table(folder)]


def dies(*_):
    """Die as a segmentation fault or a lack of memory would make a worker die."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_local_workers_have_one_blas_thread_and_stay_local_and_their_death_is_a_row(good, monkeypatch):
    plans = {"good": handmade_bytes(good)}
    cases = {"k": Study(plans).case("good", 3, push=50.0)}
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}), cluster.local(1) as client:
        (threads,) = client.run(lambda: [os.environ[n] for n in cluster._THREADS]).values()
        assert threads == ["1", "1", "1"]
        everyone = [psutil.Process(), *psutil.Process().children(recursive=True)]
        ports = [c for p in everyone for c in p.net_connections() if c.status == psutil.CONN_LISTEN]
        assert ports and all(c.laddr.ip in ("127.0.0.1", "::1") for c in ports)
        monkeypatch.setattr(cluster, "execute", dies)
        ((key, row),) = cluster.results(client, cases, {design.digest(plans["good"]): plans["good"]})
    assert key == "k"
    assert row["error"].startswith("KilledWorker")
    assert (row["seed"], row["push_n"]) == (3, 50.0)


def handmade_bytes(path):
    """The content of a file."""
    with open(path, "rb") as file:
        return file.read()


def test_a_worker_of_another_version_ends_the_study(bad, monkeypatch, capsys, tmp_path):
    real = case.versions()
    with LocalCluster(n_workers=1, processes=False, dashboard_address=None, silence_logs=50) as running:
        address = running.scheduler_address
        monkeypatch.setattr(cluster, "versions", lambda: real | {"mujoco": "3.0"})
        assert study(tmp_path / "a", "--plan", bad, "--sweep", "push=0", "--scheduler", address) == 1
    assert f"has mujoco {real['mujoco']}, this program 3.0\n" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()


def test_no_scheduler_is_one_line(good, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(cluster, "PATIENCE_S", 0.3)
    for address in ("127.0.0.1:1", "tcp://127.0.0.1:1", "http://x"):
        assert study(tmp_path / "a", "--plan", good, "--scheduler", address) == 2
        lines = capsys.readouterr().err.strip().splitlines()
        assert lines[-1].startswith(f"wfbook: --scheduler {address!r}")
    assert list(tmp_path.iterdir()) == []


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


def test_the_standard_study_goes_over_all_axes(answers, good, tmp_path):
    asked = answers(lambda one: {})
    assert study(tmp_path / "a", "--plan", good, "--seeds", "1") == 0
    varied = {n for one in asked for n in AXES if one.values[n] != AXES[n].usual}
    assert varied == set(design.STANDARD_SWEEPS)
    maps = {"map-push-x-delay.png", "map-trunk_mass-x-ground_friction.png"}
    assert {path.name for path in (tmp_path / "a").iterdir()} == {*FILES, "sweeps.png", *maps}
    assert study(tmp_path / "b", "--plan", good, "--seeds", "1", "--state", "true") == 0
    assert {row["sensor_noise"] for row in table(tmp_path / "b")} == {1.0}


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
    assert out.splitlines()[1].split() == ["0", "1/1", "100", "%", "21", "to", "100", "%", "1.0", "1"]
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
    copy.write_bytes(handmade_bytes(good))
    assert study(tmp_path / "a", "--plan", good, str(copy)) == 2
    assert "is the same plan as" in capsys.readouterr().err
    copy = copy.rename(tmp_path / "bad.npz")
    assert study(tmp_path / "a", "--plan", bad, str(copy), "--sweep", "push=0") == 0
    assert {row["plan"] for row in table(tmp_path / "a")} == {bad, str(copy)}


def test_what_is_drawn_depends_on_the_seed_alone(good):
    study = Study({"good": handmade_bytes(good)})

    def drawn(seed, **values):
        return case._drawn(study.case("good", seed, **values), 3.0, np.random.default_rng([seed, 46]))

    assert drawn(0) == {}
    assert drawn(0, push=10.0) == drawn(0, push=90.0, delay=20.0) != drawn(1, push=10.0)
    assert drawn(0, push=10.0, push_angle=90.0) == {"push_start": drawn(0, push=10.0)["push_start"]}
    many = [drawn(seed, push=1.0) for seed in range(200)]
    assert 0 <= min(d["push_start"] for d in many) < 0.3 and 2.7 < max(d["push_start"] for d in many) <= 3
    assert np.histogram([d["push_angle"] for d in many], 4, (0, 360))[0].min() > 30


def test_a_case_is_told_to_the_simulation_in_si_units(good, monkeypatch):
    told = {}

    def run(plan, **given):
        told.update(given)
        raise RuntimeError("enough")

    monkeypatch.setattr("wfbook.simulate.run", run)
    values = {"push": 40.0, "push_angle": 90.0, "push_start": 0.1, "delay": 12.0, "joint_friction": 0.2}
    values |= {"ground_friction": 0.5, "trunk_mass": 1.2, "sensor_noise": 3.0, "terrain_error": 10.0}
    row = case.execute(Study({"good": handmade_bytes(good)}).case("good", 7, **values), handmade_bytes(good))
    assert row["error"] == "RuntimeError: enough"
    assert row["delay_ms"] == 12.0 and row["push_angle_deg"] == 90.0
    force, start, duration = told.pop("push")
    np.testing.assert_allclose(force, [0.0, 40.0, 0.0], atol=1e-9)
    assert (start, duration, told["delay"], told["seed"]) == (0.1, 0.2, 0.012, 7)
    assert told["noise"].gyro == pytest.approx(3 * 0.003)
    assert {r.mu_foot for r in told["real_terrain"].regions} == {0.35}
    assert 0 < max(abs(r.vertices[:, 2]).max() for r in told["real_terrain"].regions) <= 0.01
    assert (told["joint_friction"], told["trunk_mass_scale"], told["state"]) == (0.2, 1.2, "estimated")


@pytest.mark.parametrize(
    "plan",
    [
        handmade.trot(0.6, 6),
        handmade.roll_over_edge(),
        handmade.crawl(0.1),
        replace(handmade.stand(1), terrain=stepping_stones()),
    ],
    ids=["flat", "ramp", "crawl", "stones"],
)
def test_the_real_ground_is_the_plans_in_patches_higher_and_lower(plan):
    if isinstance(plan, dict):
        plan = plan_of(plan)

    def ground(error, seed=0, friction=1.0):
        return real_terrain(plan, friction, error, np.random.default_rng(seed))

    assert ground(0.0) == plan.terrain
    rough, same, other, twice = ground(0.01), ground(0.01), ground(0.01, seed=1), ground(0.02)
    assert rough == same and rough != other
    errors = []
    for x in np.arange(-1.0, plan.p[..., 0].max() + 2.0, 0.05):
        for y in (-0.4, -0.11, 0.13, 0.4):
            planned = plan.terrain.height(x, y)
            if planned is None:
                assert rough.height(x, y) is None
                continue
            errors.append(rough.height(x, y) - planned)
            assert abs(errors[-1]) <= 0.01 + 1e-9
            assert twice.height(x, y) - planned == pytest.approx(2 * errors[-1], abs=1e-9)
    assert len(set(np.round(errors, 6))) > 3
    for x, y, z in plan.p[0]:
        assert rough.height(x, y) == pytest.approx(z, abs=1e-9)
    areas = [sum(_area(r.vertices) for r in t.regions) for t in (plan.terrain, rough)]
    assert areas[0] == pytest.approx(areas[1])
    assert {r.group for r in rough.regions} == {r.group for r in plan.terrain.regions}
    ahead = [r for r in rough.regions if r.vertices[:, 0].min() > 0.5 and r.vertices[:, 0].max() < 0.9]
    assert all(np.ptp(r.vertices[:, 0]) <= 2 * PATCH for r in ahead)
    slippery = ground(0.0, friction=0.5)
    for one, usual in zip(slippery.regions, plan.terrain.regions, strict=True):
        assert (one.mu_foot, one.mu_wheel_lateral) == (0.5 * usual.mu_foot, 0.5 * usual.mu_wheel_lateral)
        assert (one.mu_wheel, one.rolling_resistance) == (usual.mu_wheel, usual.rolling_resistance)


def plan_of(arrays):
    """What the real ground needs of a hand-made plan for the checker."""
    from types import SimpleNamespace

    from wfbook.terrain import Terrain

    return SimpleNamespace(p=arrays["p"], terrain=Terrain.from_dict(arrays["terrain"]))


def _area(vertices):
    """The area of a polygon seen from above."""
    x, y = vertices[:, 0], vertices[:, 1]
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize(("survived", "runs"), [(0, 5), (3, 5), (5, 5), (17, 40), (1, 1)])
def test_intervals_are_wilsons(survived, runs):
    expected = binomtest(survived, runs).proportion_ci(0.95, method="wilson")
    assert tables.wilson(survived, runs) == pytest.approx((expected.low, expected.high))
    assert tables.wilson(0, 0) is None


@pytest.fixture
def report(answers, good, bad, tmp_path):
    """The report of a study of two plans, in which one falls and one run has an error."""
    best = design.digest(handmade_bytes(good))

    def answer(one):
        if one.values["push"] == 60.0 and one.values["delay"] == 20.0 and one.seed == 0:
            return {"error": "x", "upright": None}
        return {"upright": one.plan == best or one.values["push"] < 30}

    answers(answer)
    words = ["--plan", good, bad, "--sweep", "push=0,30,60", "--sweep", "trunk_mass", "--seeds", "2"]
    assert study(tmp_path, *words, "--grid", "push=0,60", "delay=4,9,20") == 1
    return json.loads((tmp_path / "study.json").read_text())


def test_the_curves_show_shares_and_intervals(report):
    figure = survival.sweeps(report)
    push, mass = (axes for axes in figure.axes if axes.get_visible())
    assert (push.get_xlabel(), mass.get_xlabel()) == ("push (N)", "trunk mass (factor)")
    assert push.get_ylabel() == "share upright to the end"
    curves = {line.get_gid(): list(line.get_ydata()) for line in push.lines if line.get_gid()}
    assert curves["push good"] == [1.0, 1.0, 1.0]
    assert curves["push bad"] == [1.0, 0.0, 0.0]
    (bars, *_) = [container.lines[2][0].get_segments() for container in push.containers]
    low, high = tables.wilson(2, 2)
    np.testing.assert_allclose(bars[0][:, 1], [low, high])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["good", "bad", "in all other runs"]
    colours = {to_hex(line.get_color()) for line in push.lines if str(line.get_gid()).startswith("push")}
    assert len(colours) == 2
    assert figure.png().startswith(b"\x89PNG")


def test_the_map_shows_every_cell(report):
    figure = survival.grid(report, "push x delay")
    good, bad, bar = figure.axes
    assert (good.get_xlabel(), good.get_ylabel()) == ("delay (ms)", "push (N)")
    assert (good.get_title(), bad.get_title()) == ("good", "bad")
    assert bar.get_ylabel() == "share upright to the end"
    assert [label.get_text() for label in good.get_xticklabels()] == ["4", "9", "20"]
    shares = good.collections[0].get_array()
    np.testing.assert_array_equal(shares, np.ones((2, 3)))
    np.testing.assert_array_equal(bad.collections[0].get_array(), [[1, 1, 1], [0, 0, 0]])
    texts = [text.get_text() for text in good.texts]
    assert texts == ["2/2"] * 5 + ["1/1\n1 error"]
    assert figure.png().startswith(b"\x89PNG")


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
