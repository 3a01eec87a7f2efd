"""Each chapter has a budget of time, CI fails when one takes double, and nothing may be left running."""

import json
import os
import subprocess
import sys
from pathlib import Path

import chapter_times
import nbformat
import pytest
from chapter_times import FACTOR, LEAST, Line, read, write

ROOT = Path(__file__).parent.parent

SERVER = """
import os, socket, time
place = socket.create_server(("127.0.0.1", 0))
if os.fork() == 0:
    os.setsid()
    time.sleep(15)
"""
"""What a chapter must not leave behind: a kernel ends its children and its group, but not this."""


def test_each_chapter_has_a_budget_and_each_budget_a_chapter():
    chapters = {path.stem for path in (ROOT / "notebooks").glob("*.ipynb")}
    budgets = set(read(ROOT / chapter_times.FILE))
    command = f"python -m pytest notebooks/NN_title.ipynb {chapter_times.OPTION}"
    assert not chapters - budgets, f"no budget: {sorted(chapters - budgets)}; run {command}"
    assert not budgets - chapters, f"no such chapter: {sorted(budgets - chapters)}; run {command}"


def test_no_chapter_may_take_a_minute_and_all_of_them_eight():
    seconds = [seconds for seconds, _ in read(ROOT / chapter_times.FILE).values()]
    assert max(seconds) < 60 and sum(seconds) < 480


@pytest.mark.parametrize(
    ("seconds", "calibration", "over"),
    [
        (10.0, 0.02, False),
        (FACTOR * 10.0, 0.02, False),
        (FACTOR * 10.0 + 0.1, 0.02, True),
        (FACTOR * 10.0 + 0.1, 0.04, False),  # the machine was twice as slow
        (2 * FACTOR * 10.0 + 0.1, 0.04, True),
        (FACTOR * 10.0, 0.01, False),  # a faster machine is not asked for more
        (FACTOR * 10.0 + 0.1, 0.01, True),
    ],
)
def test_over_is_more_than_double_with_the_slowness_taken_off(seconds, calibration, over):
    line = Line("01_example", seconds, calibration, (10.0, 0.02))
    assert line.over == over
    assert ("MORE THAN DOUBLE" in str(line)) == over


def test_budgets_too_short_to_be_measured_count_as_more():
    assert not Line("01_example", FACTOR * LEAST, 0.02, (1.0, 0.02)).over
    assert Line("01_example", FACTOR * LEAST + 0.1, 0.02, (1.0, 0.02)).over


def test_without_a_budget_nothing_is_over():
    line = Line("01_example", 100.0, 0.02, None)
    assert not line.over and "no budget" in str(line)


def test_writing_keeps_the_others_and_forgets_what_is_gone(tmp_path):
    file = tmp_path / "times.json"
    old = {name: Line(name, 7.0, 0.02, None) for name in ("00_a", "01_b", "02_gone")}
    write(file, old.values(), iter(old))
    write(file, [Line("01_b", 9.04, 0.03, None)], iter(["00_a", "01_b"]))
    assert read(file) == {"00_a": (7.0, 0.02), "01_b": (9.0, 0.03)}


def test_the_fixed_work_takes_some_hundredths_of_a_second():
    assert 1e-3 < min(chapter_times.calibrate() for _ in range(3)) < 1.0


@pytest.fixture
def book(tmp_path):
    """A book of two chapters, with this project's plugins; the second chapter fails."""
    (tmp_path / "server.py").write_text(SERVER)
    bad = ["import subprocess, sys; subprocess.run([sys.executable, '../server.py'])", "assert False"]
    for name, code in (("00_good", ["a = 2", "assert a == 2"]), ("01_bad", bad)):
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(line) for line in code])
        notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "", "language": "python"}
        (tmp_path / "notebooks").mkdir(exist_ok=True)
        nbformat.write(notebook, tmp_path / "notebooks" / f"{name}.ipynb")
    (tmp_path / "tests").mkdir()
    for name in ("conftest.py", "tests/chapter_times.py", "tests/leftovers.py", "tests/lab.py"):
        text = (ROOT / name).read_text().replace(f"LEAST = {LEAST}", "LEAST = 0.0")
        (tmp_path / name).write_text(text.replace("PATIENCE = 60.0", "PATIENCE = 0.0"))
    (tmp_path / "pytest.ini").write_text("[pytest]\npythonpath = tests\naddopts = --nbval-lax\n")
    return tmp_path


def pytest_in(book, *options, **environment):
    """Run pytest there; its exit code and what it printed."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *options],
        cwd=book,
        env={**os.environ, "CI": ""} | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    return done.returncode, done.stdout


def test_a_run_of_pytest_writes_budgets_and_in_ci_fails_by_them(book):
    code, text = pytest_in(book, "notebooks", chapter_times.OPTION)
    budgets = book / chapter_times.FILE
    assert code == 1 and "not run whole, or failed: 01_bad" in text
    assert list(read(budgets)) == ["00_good"], "a chapter that fails gets no budget"
    assert "still running after the tests: " in text and "server.py" in text

    first, entry = "notebooks/00_good.ipynb", {"seconds": 1e-3, "calibration_s": 1e3}
    budgets.write_text(json.dumps({"00_good": entry}))
    code, text = pytest_in(book, first, CI="true")
    assert code == 1 and "MORE THAN DOUBLE" in text and "2 passed" in text
    assert "still running" not in text
