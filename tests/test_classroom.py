"""Copies for students hold no solution; what they hand in is found, read and matched whatever its state."""

import ast
import csv
import io
import json
import os
import re
from collections import OrderedDict
from fractions import Fraction
from pathlib import Path

import nbformat
import numpy as np
import pytest
from chapters import BEGIN, END, cleared
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

from wfbook.__main__ import main
from wfbook.classroom import marks, wire
from wfbook.classroom.chapters import bound, chapters, chosen, words
from wfbook.classroom.copies import student_copy, student_sources
from wfbook.classroom.marks import Mark
from wfbook.classroom.submissions import UnreadableError, answers, chapter_of, find, read
from wfbook.exercises import answer
from wfbook.reference import Gains

CHAPTERS = chapters()
every_chapter = pytest.mark.parametrize("chapter", CHAPTERS, ids=[chapter.name for chapter in CHAPTERS])


def solutions(source):
    """The lines of the solutions in a cell, without what every program has."""
    found, inside = [], False
    for line in source.splitlines():
        if BEGIN in line or END in line:
            inside = BEGIN in line
        elif inside and re.search(r"\w\W+\w", line):
            found.append(line.strip())
    return found


@every_chapter
def test_a_student_copy_holds_no_solution(chapter):
    copy = student_copy(chapter)
    notebook = json.loads(copy)
    nbformat.validate(nbformat.reads(copy, as_version=4))
    assert notebook["metadata"]["kernelspec"]["name"] == "python3"
    assert BEGIN not in copy and END not in copy
    assert all(cell.get("outputs", []) == [] for cell in notebook["cells"])
    assert all(cell.get("execution_count") is None for cell in notebook["cells"])
    whole = [cell["source"] for cell in notebook["cells"]] + [
        str(cell["metadata"]) for cell in notebook["cells"]
    ]
    text = "\n".join("".join(part) for part in whole)
    elsewhere = "\n".join(cleared(cell.source) for cell in chapter.cells)
    for exercise in chapter.exercises:
        lines = [line for p in exercise.answers for line in solutions(chapter.cells[p].source)]
        # What the chapter shows outside of its solutions is no secret; each solution has more than that.
        secret = [line for line in lines if line not in elsewhere]
        assert secret, f"{exercise.name}: all of its solution stands in the chapter"
        assert not [line for line in secret if line in text], exercise.name
        for position in exercise.answers:
            source = "".join(notebook["cells"][position]["source"])
            assert "YOUR CODE HERE" in source and "replace the line below" in source
            ast.parse(source)
        assert notebook["cells"][exercise.check]["metadata"]["editable"] is False


@every_chapter
def test_a_student_copy_needs_no_answer_before_the_next_exercise(chapter):
    """Cells between exercises use nothing that only a solution or a check defines: grading runs neither."""
    sources = student_sources(chapter)
    for position, cell in enumerate(chapter.cells):
        if position in chapter.setup:
            assert sources[position] == cell.source
    given = set()
    for exercise in chapter.exercises:
        given |= set().union(*(bound(chapter.cells[p].source) for p in (*exercise.answers, exercise.check)))
    known = set()
    for position in sorted(chapter.setup):
        source = chapter.cells[position].source
        assert not (given - known) & names_used(source), f"cell {position}"
        known |= bound(source)


def names_used(source):
    """The names that code reads and does not bind itself."""
    read = {
        n.id for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)
    }
    own = {
        n.id for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    }
    return read - own - {n.arg for n in ast.walk(ast.parse(source)) if isinstance(n, ast.arg)} - bound(source)


@every_chapter
def test_a_check_takes_its_names_from_the_answers(chapter):
    assert 3 <= len(chapter.exercises) <= 5
    for exercise in chapter.exercises:
        assert exercise.names and exercise.points > 0
        assert set(exercise.names) <= words(chapter.cells[exercise.check].source)


def test_checks_draw_what_grading_can_change():
    for path in sorted(set(Path(answer.__file__).parent.glob("*.py")) - {Path(answer.__file__)}):
        assert "default_rng" not in path.read_text(), f"{path.name}: use answer.draws"
    usual = np.random.default_rng(3).random()
    assert answer.draws(3).random() == usual
    with answer.other_draws(None) as seen:
        assert not seen.drawn
        assert answer.draws(3).random() == usual and seen.drawn
    with answer.other_draws(7):
        assert answer.draws(3).random() != usual
        assert answer.draws(3).random() == answer.draws(3).random()
    assert answer.draws(3).random() == usual


def test_copies_are_written_and_a_student_copy_runs_to_its_first_exercise(tmp_path, capsys):
    assert main(["classroom", "--out", str(tmp_path / "class"), "--chapters", "9", "04_friction_cones"]) == 0
    assert "2 chapters" in capsys.readouterr().out
    found = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    names = ("04_friction_cones.ipynb", "09_omnidirectional_wheels.ipynb", "README.md")
    assert found == {f"class/student/{n}" for n in names} | {f"class/instructor/{n}" for n in names[:2]} | {
        "class/README.md"
    }
    (chapter,) = chosen(["9"])
    assert (tmp_path / "class/instructor" / chapter.path.name).read_bytes() == chapter.path.read_bytes()
    for name in ("README.md", "student/README.md"):
        text = (tmp_path / "class" / name).read_text()
        assert "wfbook" in text and "| 09_omnidirectional_wheels | 4 | 7 |" in text
    notebook = nbformat.read(tmp_path / "class/student" / chapter.path.name, as_version=4)
    with pytest.raises(CellExecutionError) as stopped:
        NotebookClient(notebook, timeout=60, kernel_name="python3").execute()
    assert stopped.value.ename == "NotImplementedError"
    counts = [cell.get("execution_count") for cell in notebook.cells]
    first = chapter.exercises[0].answers[0]
    assert all(counts[position] for position in chapter.setup if position < first)
    assert counts[first] and not any(counts[first + 1 :])


WRONG = {
    "no folder to write": (["classroom"], "--out"),
    "no such chapter": (["classroom", "--out", "x", "--chapters", "77"], "--chapters: '77' is no chapter"),
    "copies under a device": (["classroom", "--out", "/dev/null/x"], "can't be written"),
    "nothing to grade": (["grade"], "SUBMISSIONS"),
    "no such folder": (["grade", "nobody"], "'nobody': No such file"),
    "an empty folder": (["grade", "empty"], "'empty' holds no notebooks"),
    "marks are a folder": (["grade", "empty", "--out", "empty"], "'empty' is a folder"),
    "marks under a device": (["grade", "empty", "--out", "/dev/null/x"], "can't be written"),
    "nobody at work": (["grade", "empty", "--jobs", "0"], "--jobs: must be at least 1"),
    "no time": (["grade", "empty", "--time-limit", "0"], "--time-limit: must be above 0"),
    "a chapter that is none": (["grade", "empty", "--chapters", "five"], "'five' is no chapter"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_input_is_one_line(name, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    argv, says = WRONG[name]
    assert main(argv) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and says in err
    assert [path.name for path in tmp_path.rglob("*")] == ["empty"]


def test_hand_ins_are_found_by_folder_and_by_file(tmp_path):
    for name in (
        "ann/09_omnidirectional_wheels.ipynb",
        "bob/deep/in/9 mine.ipynb",
        "bob/deep/.ipynb_checkpoints/09_omnidirectional_wheels-checkpoint.ipynb",
        "cem_04_friction_cones.ipynb",
        "04_dora.ipynb",
        "notes.txt",
        ".hidden/09.ipynb",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    found = [(s.student, s.path.name, s.chapter and s.chapter.name[:2]) for s in find(tmp_path, CHAPTERS)]
    assert found == [
        ("04_dora", "04_dora.ipynb", "04"),
        ("ann", "09_omnidirectional_wheels.ipynb", "09"),
        ("bob", "9 mine.ipynb", None),
        ("cem", "cem_04_friction_cones.ipynb", "04"),
    ]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "no notebook, or cut off"),
        (b'{"cells": [{"cell_type": "code"', "cut off"),
        (b"\xff\xfe\x00", "codec"),
        (b"[" * 10**6, "nested too deeply"),
        (b"[]", "no list of cells"),
        (b'{"cells": 3}', "no list of cells"),
        (b'{"cells": [3]}', "no list of cells"),
        (b"1" * 10**5, "digits"),
    ],
)
def test_what_is_no_notebook_is_told(content, says, tmp_path):
    (tmp_path / "a.ipynb").write_bytes(content)
    with pytest.raises(UnreadableError, match=says):
        read(tmp_path / "a.ipynb")


def test_what_is_no_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.ipynb")
    (tmp_path / "link.ipynb").symlink_to("/dev/zero")
    for name in ("pipe", "link", "nothing"):
        with pytest.raises(UnreadableError):
            read(tmp_path / f"{name}.ipynb")


def test_cells_are_read_as_far_as_they_are_well_formed(tmp_path):
    cells = [{}, {"cell_type": "code", "source": ["a\n", 3, "b"], "metadata": [], "id": 4}]
    cells.append(
        {"cell_type": "code", "source": None, "metadata": {"nbgrader": {"points": "x", "grade_id": 1}}}
    )
    (tmp_path / "a.ipynb").write_text(json.dumps({"cells": cells}))
    assert [(c.kind, c.source, c.role) for c in read(tmp_path / "a.ipynb")] == [
        ("markdown", "", ""),
        ("code", "a\nb", ""),
        ("code", "", ""),
    ]
    assert chapter_of(read(tmp_path / "a.ipynb"), CHAPTERS) is None


def test_an_answer_takes_what_it_mentions_along():
    (chapter,) = chosen(["9"])
    sources = student_sources(chapter)
    cells = list(chapter.cells)
    first, second = (e.answers[0] for e in chapter.exercises[:2])

    def with_source(index, source):
        return type(cells[index])(**{**vars(cells[index]), "source": source})

    own = type(cells[0])("mine", "code", "half_turn = full_turn / 2")
    other = type(cells[0])("also", "code", "full_turn = 6.283")
    unused = type(cells[0])("bad", "code", "while True: pass")
    mine = [other, unused, *cells[:first], with_source(first, "ranks = (1, 2, 3)"), own, *cells[first + 1 :]]
    place = next(i for i, cell in enumerate(mine) if cell.id == cells[second].id)
    mine[place] = type(cells[0])(**{**vars(mine[place]), "source": "nearer = half_turn"})
    found = answers(mine, chapter, sources)
    assert [source for source, _ in found[0].cells] == ["ranks = (1, 2, 3)"]
    assert [source for source, _ in found[1].cells] == [other.source, own.source, "nearer = half_turn"]
    assert [is_answer for _, is_answer in found[1].cells] == [False, False, True]


def test_two_files_of_one_chapter_and_unknown_ones_are_told(tmp_path):
    from wfbook.classroom.grading import assignment

    (chapter,) = chosen(["9"])
    copy = student_copy(chapter)
    (tmp_path / "ann").mkdir()
    for age, name in enumerate(("09 new.ipynb", "09 old.ipynb")):
        (tmp_path / "ann" / name).write_text(copy)
        os.utime(tmp_path / "ann" / name, (1000 - age, 1000 - age))
    (tmp_path / "ben.ipynb").write_text("{")
    work = assignment(tmp_path, CHAPTERS, [chapter])
    assert work.waiting == 0 and work.students == 2
    by_student = {m.student: (m.verdict, m.message) for m in work.marks if m.exercise}
    assert (
        by_student["ann"][0] == "not answered"
        and "2 files, 09 new.ipynb is the newest" in by_student["ann"][1]
    )
    assert by_student["ben"][0] == "missing"
    assert [m.verdict for m in work.marks if not m.exercise] == ["unreadable"]


def test_marks_are_whole_lines_that_no_spreadsheet_runs(tmp_path):
    some = [
        Mark("zoe", "09", "09-b", 0.0, 2.0, "wrong", "line\none\x1b[31m\u2028=" + "x" * 1000),
        Mark('=cmd|"x"', "09", "09-a", 1.5, 2.0, "right", "@me, too"),
    ]
    marks.write(tmp_path / "m.csv", some)
    rows = list(csv.reader(io.StringIO((tmp_path / "m.csv").read_text())))
    assert rows[0] == ["student", "chapter", "exercise", "marks", "max_marks", "verdict", "message"]
    assert rows[1] == ['\'=cmd|"x"', "09", "09-a", "1.5", "2", "right", "'@me, too"]
    assert rows[2][6].startswith("line one [31m =x") and len(rows[2][6]) == 300
    assert [path.name for path in tmp_path.iterdir()] == ["m.csv"]


VALUES = [
    None,
    True,
    3,
    2.5,
    float("inf"),
    "text",
    b"bytes",
    1 + 2j,
    [1, (2, {3}), frozenset()],
    {0.1: False},
]


@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_values_come_back_as_they_were(value):
    back = wire.decode(json.loads(json.dumps(wire.encode(value, int))), int)
    assert back == value and type(back) is type(value)


def test_arrays_dataclasses_and_functions_come_back():
    def sent(value, keep=int):
        return wire.decode(json.loads(json.dumps(wire.encode(value, keep))), lambda number: number)

    for array in (np.eye(3)[:, ::2], np.zeros((0, 4), np.int8), np.array(["a", "bc"]), np.float32(2.5)):
        back = sent(array)
        assert type(back) is type(array) and back.dtype == array.dtype and np.array_equal(back, array)
    assert sent(Fraction(1, 4)) == 0.25 and sent({1: 2}.keys()) == [1] and sent(range(2)) == [0, 1]
    assert sent(OrderedDict(a=1)) == {"a": 1}
    gains = Gains(com_kp=np.array([1.0, 2.0, 3.0]))
    assert isinstance(sent(gains), Gains) and np.array_equal(sent(gains).com_kp, [1.0, 2.0, 3.0])
    kept = []
    assert sent([len], lambda function: kept.append(function) or 7) == [7] and kept == [len]
    assert repr(sent({"a": np.array([None])})) == "{'a': <ndarray>}"
    nested = []
    for _ in range(100):
        nested = [nested]
    assert "<list>" in repr(sent(nested))


@pytest.mark.parametrize(
    "data",
    [
        [],
        {},
        {"list": 3},
        {"dict": [1]},
        {"array": "AAAA", "type": "O", "shape": [1], "scalar": False},
        {"array": "AAAA", "type": "<f8", "shape": [10**9], "scalar": False},
        {"array": "AAAA", "type": "|V3", "shape": [1], "scalar": False},
        {"array": "?", "type": 5, "shape": [1]},
        {"dataclass": ["subprocess", "Popen"], "fields": {"args": "ls"}},
        {"dataclass": ["wfbook.classroom.grading", "subprocess.Popen"], "fields": {"args": "ls"}},
        {"dataclass": ["wfbook.results", "ResultFolder"], "fields": {}},
        {"dataclass": ["wfbook.reference", "Gains"], "fields": {"nothing": 1}},
        {"set": [{"list": []}]},
        {"function": "x"},
        {"complex": ["a", 1]},
    ],
    ids=str,
)
def test_what_is_no_value_is_refused(data):
    with pytest.raises(wire.WireError):
        wire.decode(data, lambda number: number)
