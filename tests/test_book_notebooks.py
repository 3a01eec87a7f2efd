"""What is asked of every chapter as it is stored: output only if checked, the skeleton, the exercises."""

import ast
import importlib
import inspect
import re

import nbformat
import pytest
from chapters import BEGIN, END, PATHS, Chapter, calls, cleared

LONGEST_CELL = 40
TAG, MARK = "keep_output", "# NBVAL_CHECK_OUTPUT"
KERNEL = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
METADATA = {"kernelspec": KERNEL, "language_info": {"name": "python"}}
TABLE = ("**You need**", "**Equations**", "**Running time**", "**To start**")
SOLUTION = {"grade": False, "locked": False, "schema_version": 3, "solution": True, "task": False}
CHECK = {"grade": True, "locked": True, "schema_version": 3, "solution": False, "task": False}
ELSEWHERE = re.compile(
    r"(?<![\w.~)}\]-])/(home|root|tmp|usr|opt|var|etc|mnt|work|Users)\b|~/|file://|[A-Z]:\\"
)

every_chapter = pytest.mark.parametrize(
    "chapter", list(map(Chapter, PATHS)), ids=[path.stem for path in PATHS]
)


def exercises(chapter):
    """Each exercise: its solution cells and its check cell, by position."""
    found, solutions = [], []
    for index, cell in enumerate(chapter.cells):
        role = cell.metadata.get("nbgrader", {})
        if role.get("solution"):
            solutions.append(index)
        elif role.get("grade"):
            found.append((solutions, index))
            solutions = []
    assert not solutions, f"cell {solutions}: a solution without a check"
    return found


def checker(chapter):
    """The module of the chapter's checks, and its name in the notebook."""
    names = [
        (alias.name, alias.asname or alias.name)
        for tree in chapter.trees
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == "wfbook.exercises"
        for alias in node.names
    ]
    assert len(names) == 1, f"imports {names} from wfbook.exercises instead of one module as check"
    (module, name), *_ = names
    return importlib.import_module(f"wfbook.exercises.{module}"), name


def checks_of(module):
    """The checks in a module: its public functions that return a line of text."""
    return {
        name: function
        for name, function in vars(module).items()
        if inspect.isfunction(function)
        and function.__module__ == module.__name__
        and name[0] != "_"
        and inspect.signature(function).return_annotation in (str, "str")
    }


def test_chapters_are_numbered_in_reading_order():
    assert PATHS and [path.stem[:3] for path in PATHS] == [f"{number:02}_" for number in range(len(PATHS))]


@every_chapter
def test_a_chapter_is_a_valid_notebook(chapter):
    nbformat.validate(chapter.notebook)
    assert (chapter.notebook.nbformat, chapter.notebook.nbformat_minor) == (4, 5)
    assert chapter.notebook.metadata == METADATA
    ids = [cell.id for cell in chapter.cells]
    assert len(set(ids)) == len(ids)
    keys = {key for cell in chapter.cells for key in cell.metadata}
    assert keys <= {"tags", "nbgrader"}, f"cells carry what an editor left: {sorted(keys)}"


@every_chapter
def test_cells_are_numbered_as_one_run_does(chapter):
    counts = [cell.execution_count for cell in chapter.code]
    assert counts == list(range(1, len(counts) + 1)), "run all cells once, then strip the outputs"


@every_chapter
def test_only_what_is_checked_has_output(chapter):
    kept = 0
    for index, cell in enumerate(chapter.cells):
        if cell.cell_type != "code":
            continue
        tagged = TAG in cell.metadata.get("tags", [])
        marked = cell.source.startswith(MARK + "\n")
        assert tagged == marked == bool(cell.outputs), (
            f"cell {index}: tag {tagged}, mark {marked}, {len(cell.outputs)} outputs"
        )
        assert all(o.output_type == "stream" and o.name == "stdout" for o in cell.outputs), f"cell {index}"
        kept += tagged
    assert kept, "no cell whose output is checked"


@every_chapter
def test_it_opens_with_a_title_a_promise_and_what_is_needed(chapter):
    assert [(level, cell) for level, _, cell in chapter.headings if level == 1] == [(1, 0)]
    assert chapter.cells[0].source.startswith("# ")
    first = next(i for i, cell in enumerate(chapter.cells) if cell.cell_type == "code")
    assert first < 3, "no picture within the first three cells"
    opening = "\n".join(cell.source for cell in chapter.cells[:first])
    for wanted in ("At the end of this chapter you can", *TABLE):
        assert wanted in opening, f"before the first code: {wanted}"


@every_chapter
def test_it_ends_with_a_summary(chapter):
    sections = [(text, cell) for level, text, cell in chapter.headings if level == 2]
    assert sections[-1] == ("Summary", len(chapter.cells) - 1), "the summary comes last"
    assert "**The way on.**" in chapter.cells[-1].source
    differing = [text for text, _ in sections if {"paper", "differ"} <= set(text.lower().split())]
    assert set(differing) <= {"Where the paper and this book differ"}


@every_chapter
def test_something_is_touched_and_something_moves(chapter):
    assert chapter.imported_from("wfbook.view.widgets")
    assert any("Replay" in calls(tree) for tree in chapter.trees), "no replay"


@every_chapter
def test_there_are_three_to_five_numbered_exercises(chapter):
    found, after = exercises(chapter), 0
    assert 3 <= len(found) <= 5
    for number, (solutions, check) in enumerate(found, 1):
        tasks = [cell.source for cell in chapter.cells[after : solutions[0]] if cell.cell_type == "markdown"]
        begins = re.compile(rf"^(#+ |\*\*)(Exercise )?{number}[.:] ", re.MULTILINE)
        assert any(map(begins.search, tasks)), (
            f"exercise {number}: no heading '### {number}. What it is about'"
        )
        assert solutions[-1] + 1 == check, f"exercise {number}: its check is not next to its solution"
        after = check + 1


@every_chapter
def test_exercises_can_be_graded(chapter):
    for solutions, index in exercises(chapter):
        check = chapter.cells[index].metadata.nbgrader
        name = check.grade_id.removesuffix("-check")
        assert name.startswith(f"{chapter.number}-") and check.grade_id == f"{name}-check"
        assert {key: check[key] for key in CHECK} == CHECK and check.points > 0
        assert set(check) == set(CHECK) | {"grade_id", "points"}
        for solution in solutions:
            role = chapter.cells[solution].metadata.nbgrader
            assert {key: role[key] for key in SOLUTION} == SOLUTION
            assert set(role) == set(SOLUTION) | {"grade_id"} and role.grade_id.startswith(name)


def test_grade_ids_are_unique():
    roles = [cell.metadata.get("nbgrader") for path in PATHS for cell in Chapter(path).cells]
    ids = [role.grade_id for role in roles if role]
    assert len(set(ids)) == len(ids)


@every_chapter
def test_a_solution_can_be_taken_out(chapter):
    for solutions, index in exercises(chapter):
        for solution in solutions:
            source = chapter.cells[solution].source
            assert source.count(BEGIN) == source.count(END) >= 1, f"cell {solution}"
            student = cleared(source)
            ast.parse(student)
            assert "YOUR CODE HERE" in student and BEGIN not in student and END not in student
        assert BEGIN not in chapter.cells[index].source
    marked = [index for index, cell in enumerate(chapter.cells) if BEGIN in cell.source]
    assert marked == [index for solutions, _ in exercises(chapter) for index in solutions]


@every_chapter
def test_each_check_is_called_and_each_call_is_a_check(chapter):
    module, name = checker(chapter)
    known, called = checks_of(module), set()
    for _, index in exercises(chapter):
        tree = ast.parse(chapter.cells[index].source)
        here = {call.removeprefix(f"{name}.") for call in calls(tree) if call.startswith(f"{name}.")}
        assert here and here <= set(known), f"cell {index} calls {sorted(here)}, there are {sorted(known)}"
        called |= here
    assert called == set(known), f"never called: {sorted(set(known) - called)}"
    assert all(function.__doc__ for function in known.values())


@every_chapter
def test_cells_are_short_plain_python_and_at_home_everywhere(chapter):
    for index, cell in enumerate(chapter.cells):
        assert not (found := ELSEWHERE.search(cell.source)), f"cell {index}: {found.group()}"
        if cell.cell_type != "code":
            continue
        assert len(cell.source.splitlines()) <= LONGEST_CELL, f"cell {index}"
        tree = ast.parse(cell.source)  # refuses magics and shell commands
        modules = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        modules |= {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
        assert not [module for module in modules if "pyplot" in module], f"cell {index}"
        assert not {"interact", "get_ipython"} & calls(tree), f"cell {index}"
