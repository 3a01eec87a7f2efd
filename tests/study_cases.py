"""What the tests of the study share: plan files, a cluster that answers at once, and what a study left.

A test file gets the fixtures by ``pytest_plugins = ["study_cases"]``.
"""

import sqlite3
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import handmade
import numpy as np
import pyarrow.parquet as pq
import pytest

from wfbook.__main__ import main
from wfbook.study import cluster, design

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
                usual = {"error": None, "upright": True, "base_rms_m": 0.001}
                usual |= {"distance_m": 0.95, "planned_distance_m": 1.0}
                yield key, one.row() | usual | answer(one)

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


def content(path):
    """The content of a file."""
    return Path(path).read_bytes()
