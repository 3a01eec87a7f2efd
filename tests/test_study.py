"""Cases of the robustness study, really run through Dask: killed, crashing, and on other clusters."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from types import SimpleNamespace

import dask
import handmade
import numpy as np
import psutil
import pytest
from distributed import LocalCluster
from scipy.stats import binomtest
from study_cases import FILES, content, kept, study, table

from wfbook.study import case, cluster, design, tables
from wfbook.study.case import TIMES
from wfbook.study.design import Study
from wfbook.study.ground import PATCH, real_terrain
from wfbook.terrain import Terrain, stepping_stones

pytest_plugins = ["study_cases"]


def lasting(rows):
    """Rows by key without what differs from time to time."""
    return {row["run"]: {k: v for k, v in row.items() if k not in (*TIMES, "traceback")} for row in rows}


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
    plans = {"good": content(good)}
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


def test_what_is_drawn_depends_on_the_seed_alone(good):
    study = Study({"good": content(good)})

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
    row = case.execute(Study({"good": content(good)}).case("good", 7, **values), content(good))
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


def test_to_stand_upright_is_not_to_arrive():
    rows = [
        {"error": None, "upright": upright, "base_rms_m": 0.1, "distance_m": d, "planned_distance_m": planned}
        for upright, d, planned in ((True, 0.91, 1.0), (True, 0.6, 1.0), (False, 1.0, 1.0), (True, 0.01, 0.0))
    ]
    counted = tables.survival([*rows, {"error": "x", "upright": None}])
    assert (counted["runs"], counted["upright"], counted["arrived"], counted["errors"]) == (4, 3, 2, 1)
    assert tables.survival([])["share"] is None
