"""A class with students who attack the grader: it costs them their marks, and nobody else anything."""

import csv
import json
import os
import subprocess
import sys

import numpy as np
import psutil
import pytest
from handins import by_heart, honest, hostile

from wfbook.__main__ import main
from wfbook.classroom import command, fence, grading
from wfbook.classroom.chapters import Chapter, chosen
from wfbook.classroom.copies import instructor_copy, student_copy
from wfbook.exercises import omni_wheels

pytestmark = pytest.mark.skipif(bool(fence.missing()), reason="this kernel has no seccomp or no Landlock")

ATTACKS = ("loops", "leaves at once", "eats memory", "deletes everything", "replaces the check", "cut off")


def rows(path):
    with open(path) as file:
        return list(csv.DictReader(file))


def nearer(desired, current):
    turn = (desired - current + np.pi) % (2 * np.pi) - np.pi
    if abs(turn) <= np.pi / 2:
        return current + turn, 1
    return current + turn - np.sign(turn) * np.pi, -1


def test_a_class_with_hostile_students_gets_the_marks_it_deserves(tmp_path, capsys):
    (chapter,) = chosen(["9"])
    submissions, marks = tmp_path / "submissions", tmp_path / "marks.csv"
    people = [
        hostile(kind, f"mallory-{i}", chapter, np.random.default_rng(i), submissions, marks)
        for i, kind in enumerate(ATTACKS)
    ]
    people += [honest(f"alice-{seed}", chapter, np.random.default_rng(seed)) for seed in (1, 5)]
    people.append(by_heart("bob", chapter, "09-nears", omni_wheels.nears, nearer))
    for one in people:
        one.write(submissions)
    assert {True, False} == {right for one in people[6:8] for right in one.right.values()}
    options = ["--out", str(marks), "--time-limit", "5", "--seed", "1", "--jobs", "2"]
    assert main(["grade", str(submissions), *options]) == 0
    out, err = capsys.readouterr()
    assert "9 students" in out and "answers of 9 students" in err
    assert sum(path.is_file() for path in submissions.rglob("*")) == 9
    found, by_name = rows(marks), {one.student: one for one in people}
    assert len(found) == 9 * 4
    for row in found:
        one = by_name[row["student"]]
        assert one.agrees(row["exercise"], row["verdict"]), f"{one.kind}: {row}"
        assert float(row["marks"]) == (float(row["max_marks"]) if row["verdict"] == "right" else 0.0)
    verdicts = {by_name[row["student"]].kind: row for row in found if row["verdict"] != "right"}
    assert verdicts["loops"]["verdict"] in ("out of time", "crashed")
    assert verdicts["leaves at once"]["message"] == "its process ended: exit code 0"
    assert verdicts["eats memory"]["verdict"] in ("raises", "crashed", "out of time")
    assert not psutil.Process().children(recursive=True)


def cell(source, **nbgrader):
    metadata = (
        {"nbgrader": {"locked": False, "schema_version": 3, "task": False, **nbgrader}} if nbgrader else {}
    )
    code = {"cell_type": "code", "execution_count": None, "outputs": []}
    return {**code, "id": f"cell-{abs(hash(source)) % 10**8}", "metadata": metadata, "source": source}


def exercise(name, answer, check):
    solution = cell(
        f"### BEGIN SOLUTION\n{answer}\n### END SOLUTION", solution=True, grade=False, grade_id=name
    )
    return [solution, cell(check, solution=False, grade=True, points=2, grade_id=f"{name}-check")]


@pytest.fixture
def tiny(tmp_path, monkeypatch):
    """A book of one chapter that runs at once; returns what makes a student hand in answers."""
    path, kernel = tmp_path / "42_tiny.ipynb", {"name": "python3", "display_name": "Python 3"}
    cells = [
        cell("import numpy as np\n\nhalf = 4.0\nthree = np.arange(3.0)"),
        *exercise(
            "42-grows",
            "factor = 2 * half",
            "from wfbook.exercises import swing as check\n\ncheck.grows(factor)",
        ),
        cell("half = 5.0"),
        *exercise("42-solve", "coefficients = None", "check.solves(coefficients)"),
    ]
    monkeypatch.chdir(tmp_path)

    def teach(old="", new=""):
        """Write the book, with something replaced."""
        notebook = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
        path.write_text(json.dumps(notebook).replace(old, new))
        hand_in.chapter = Chapter(path)
        monkeypatch.setattr(command, "chapters", lambda: (hand_in.chapter,))
        monkeypatch.setattr(command, "chosen", lambda asked: (hand_in.chapter,))

    def hand_in(student, *sources):
        notebook = json.loads(student_copy(hand_in.chapter))
        for each, source in zip(hand_in.chapter.exercises, sources, strict=True):
            if source is not None:
                notebook["cells"][each.answers[0]]["source"] = source
        (tmp_path / "subs" / student).mkdir(parents=True)
        (tmp_path / "subs" / student / path.name).write_text(json.dumps(notebook))

    hand_in.teach = teach
    teach()
    return hand_in


def graded(*options):
    assert main(["grade", "subs", "--seed", "0", *options]) == 0
    return {(row["student"], row["exercise"]): (row["verdict"], row["message"]) for row in rows("marks.csv")}


COEFFICIENTS = """
def coefficients(p0, v0, pf, vf, T):
    n = np.arange(6)
    rows = [t**n for t in (0.0, T)] + [n * t ** np.maximum(n - 1, 0) for t in (0.0, T)]
    rows += [n * (n - 1) * t ** np.maximum(n - 2, 0) for t in (0.0, T)]
    return np.linalg.solve(rows, [p0, pf, v0, vf, 0.0, 0.0])
"""


def test_answers_run_where_their_exercise_stands_and_fail_alone(tiny):
    tiny("ann", "factor = 2 * half", COEFFICIENTS)
    tiny("bob", "factor = nonsense", COEFFICIENTS)
    tiny("cem", "factor = 8.0\n1 / 0", COEFFICIENTS.replace("p0, pf, v0", "0.0, pf, v0"))
    tiny("dan", None, "coefficients = 3")
    tiny("eva", "import sys\nsys.exit()", "def coefficients(*a):\n    raise KeyError('\\n=x')")
    tiny("fay", "%time\n!ls\nfactor = 8", "factor = 8\ncoefficients = lambda *a: np.array(a)")
    tiny(
        "gus",
        "class Yes:\n    __eq__ = lambda *_: True\n\nfactor = Yes()",
        "del three\ndef coefficients(*a):\n    raise RuntimeError('three is gone')",
    )
    found = graded()
    assert [found[name, "42-grows"][0] for name in ("ann", "cem", "fay")] == ["right"] * 3
    assert "(the cell raises ZeroDivisionError: division by zero)" in found["cem", "42-grows"][1]
    assert [found[name, "42-solve"][0] for name in ("ann", "bob")] == ["right"] * 2
    assert found["bob", "42-grows"] == (
        "raises", "factor is not defined; the cell raises NameError: name 'nonsense' is not defined"
    )  # fmt: skip
    assert found["cem", "42-solve"][0] == "wrong" and "at lift-off" in found["cem", "42-solve"][1]
    assert found["dan", "42-grows"][0] == "not answered"
    assert found["dan", "42-solve"] == ("wrong", "coefficients is 3, not a function")
    assert found["eva", "42-grows"][0] == "raises" and "SystemExit" in found["eva", "42-grows"][1]
    assert found["eva", "42-solve"][0] == "wrong" and "raised KeyError" in found["eva", "42-solve"][1]
    assert found["fay", "42-solve"][0] == "wrong" and "shape (5,)" in found["fay", "42-solve"][1]
    assert found["gus", "42-grows"] == ("wrong", "factor is <Yes>, not an array of numbers")
    assert found["gus", "42-solve"] == ("wrong", "coefficients raised RuntimeError: three is gone")


def test_a_check_sees_what_an_answer_does_to_its_arguments(tiny):
    tiny.teach("check.solves(coefficients)", "check.called(coefficients, np.ones(2), [3], name='f')")
    tiny("ann", None, "def coefficients(x, y):\n    x += 1\n    return x")
    tiny("bob", None, "def coefficients(x, y):\n    return x + y")
    tiny("cem", None, "def coefficients(x, y):\n    raise NotImplementedError")
    tiny("dan", None, "coefficients = lambda x, y: print(x, y)")
    found = graded("--chapters", "42")
    assert found["dan", "42-solve"][0] == "right"
    assert found["ann", "42-solve"] == (
        "wrong",
        "f changed its argument number 1; return a new array instead",
    )
    assert found["bob", "42-solve"][0] == "right"
    assert found["cem", "42-solve"] == ("wrong", "f is still to be written")


def test_an_answer_may_call_what_a_check_gives_it(tiny):
    tiny.teach("check.solves(coefficients)", "check.number(coefficients(lambda x: 1 / x, 4.0), 'f')")
    tiny("ann", None, "coefficients = lambda cost, x: cost(cost(x)) + cost(np.array([x]))[0]")
    tiny("bob", None, "coefficients = lambda cost, x: cost(0)")
    tiny("cem", None, "coefficients = lambda cost, x: cost")
    tiny("dan", None, "def coefficients(cost, x):\n    while True: cost(x)")
    found = graded("--time-limit", "2")
    assert found["ann", "42-solve"] == ("right", "")
    assert "RuntimeError: ZeroDivisionError: division by zero" in found["bob", "42-solve"][1]
    assert found["cem", "42-solve"] == ("wrong", "f is <a function>, not an array of numbers")
    assert found["dan", "42-solve"][0] in ("out of time", "crashed")


def test_an_instructor_copy_runs_to_its_end(tiny):
    solved = COEFFICIENTS.strip().replace("\n", "\\n")
    tiny.teach("coefficients = None", solved)
    outputs = [cell.get("outputs") for cell in json.loads(instructor_copy(tiny.chapter, run=True))["cells"]]
    assert ["Right" in str(output) for output in outputs] == [False, False, True, False, False, True]
    tiny.teach("2 * half", "half")
    with pytest.raises(ValueError, match="WrongAnswer"):
        instructor_copy(tiny.chapter, run=True)


def test_an_interrupt_keeps_what_is_graded(tiny, monkeypatch, capsys):
    for name in ("ann", "bob"):
        tiny(name, "factor = 8.0", "import time\ntime.sleep(1e6)")
    real = grading.graded

    def interrupted(*arguments):
        for result in real(*arguments):
            yield result
            if not isinstance(result, str):
                raise KeyboardInterrupt

    monkeypatch.setattr(grading, "graded", interrupted)
    assert main(["grade", "subs", "--jobs", "2"]) == 130
    assert capsys.readouterr().err.endswith("interrupted, 1 of 4 answers are graded in 'marks.csv'\n")
    assert [row["verdict"] for row in rows("marks.csv")] == ["right"]
    assert not psutil.Process().children(recursive=True)


def test_a_chapter_that_fails_itself_is_told(tiny, capsys):
    tiny("ann", "factor = 8.0", COEFFICIENTS)
    tiny.teach("half = 5.0", "half = 1 / 0")
    assert main(["grade", "subs"]) == 1
    assert "wfbook: 42_tiny: cell 3 raises ZeroDivisionError: division by zero" in capsys.readouterr().err
    assert [row["verdict"] for row in rows("marks.csv")] == ["right", "not graded"]


def test_without_a_fence_nothing_runs_unless_it_is_asked_for(tiny, monkeypatch, capsys):
    tiny("ann", "factor = 8.0", None)
    monkeypatch.setattr(fence, "missing", lambda: ["Landlock"])
    assert main(["grade", "subs"]) == 1
    assert "this system has no Landlock" in capsys.readouterr().err
    assert not os.path.exists("marks.csv")
    assert graded("--no-fence")["ann", "42-grows"][0] == "right"


REFUSED = """
import os, socket, subprocess, sys
from pathlib import Path
from wfbook.classroom import fence

mine, other, parent = Path(sys.argv[1]), Path(sys.argv[2]), os.getppid()
fence.limit(2**30, 20)
fence.close(mine)
(mine / "a").write_text("mine")
tries = {
    "write": lambda: (other / "b").write_text("x"),
    "read": lambda: (other / "a").read_text(),
    "list": lambda: os.listdir(other),
    "delete": lambda: os.unlink(other / "a"),
    "move": lambda: os.rename(mine / "a", other / "b"),
    "link": lambda: os.symlink(other / "a", other / "b"),
    "cut": lambda: os.truncate(other / "a", 0),
    "mode": lambda: os.chmod(other / "a", 0),
    "time": lambda: os.utime(other / "a", (0, 0)),
    "fork": os.fork,
    "run": lambda: subprocess.run(["true"]),
    "kill": lambda: os.kill(parent, 0),
    "kill all": lambda: os.kill(-1, 0),
    "own group": os.setsid,
    "memory": lambda: open(f"/proc/{parent}/mem"),
    "connect": socket.socket,
    "allocate": lambda: bytearray(2**31),
    "large file": lambda: (mine / "big").write_bytes(bytes(2**25)),
}
for name, attempt in tries.items():
    try:
        attempt()
    except (OSError, MemoryError):
        continue
    print(name)
"""


def test_the_fence_refuses_everything_but_its_folder(tmp_path):
    mine, other = tmp_path / "mine", tmp_path / "other"
    mine.mkdir()
    other.mkdir()
    (other / "a").write_text("other")
    command = [sys.executable, "-c", REFUSED, str(mine), str(other)]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == ""
    assert (other / "a").read_text() == "other" and [p.name for p in other.iterdir()] == ["a"]
