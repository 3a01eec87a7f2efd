"""Copies of the chapters: without solutions for students, whole for instructors."""

import json
from collections.abc import Sequence
from importlib import metadata

from wfbook.classroom.chapters import Chapter

STUB = (
    "# YOUR CODE HERE: replace the line below by your answer, then run the check that follows.\n"
    "raise NotImplementedError()"
)
"""What stands where a solution was."""


def student_copy(chapter: Chapter) -> str:
    """Return a chapter as students get it: no solutions, no hidden checks, no outputs; checks locked.

    nbgrader's preprocessors do it, as ``nbgrader generate_assignment`` would.

    Raises:
        ValueError: what it has is marked so that nbgrader can't take it out.
    """
    import nbformat
    from nbgrader.preprocessors import ClearHiddenTests, ClearOutput, ClearSolutions, LockCells
    from traitlets.config import Config

    config = Config({"ClearSolutions": {"code_stub": {"python": STUB}}})
    notebook, resources = nbformat.read(chapter.path, as_version=4), {}
    try:
        for step in (ClearSolutions, ClearHiddenTests, ClearOutput, LockCells):
            notebook, resources = step(config=config).preprocess(notebook, resources)
    except RuntimeError as error:
        raise ValueError(f"{chapter.path.name}: {error}") from None
    nbformat.validate(notebook)
    return nbformat.writes(notebook) + "\n"


def student_sources(chapter: Chapter) -> list[str]:
    """Return the sources of a student's copy, cell by cell."""
    return [cell["source"] for cell in _cells(student_copy(chapter))]


def instructor_copy(chapter: Chapter, run: bool = False) -> str:
    """Return a chapter whole, with its solutions.

    Args:
        chapter: the chapter.
        run: whether to run it to the end and keep what its cells show; takes as long as reading it.

    Raises:
        ValueError: a cell fails.
    """
    text = chapter.path.read_text(encoding="utf-8")
    if not run:
        return text
    import nbformat
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError

    notebook = nbformat.reads(text, as_version=4)
    try:
        NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
    except CellExecutionError as error:
        raise ValueError(f"{chapter.path.name}: {error.ename}: {error.evalue}") from None
    return nbformat.writes(notebook) + "\n"


def student_readme(chapters: Sequence[Chapter]) -> str:
    """Return what students are told: how to start, how to answer, how to hand in."""
    return f"""# Exercises

{_table(chapters)}

## Start

The chapters need the package `wfbook` {metadata.version("wfbook")}, installed as its README says, and nothing
else. Then, in this folder:

    python -m jupyterlab

Open a chapter and run its cells from the top. It stops at the first exercise that has no answer.

## Answer

- Write each answer where it says `YOUR CODE HERE`, in that cell, and run the check below it. It says what is
  wrong, or that it is right. It may be run as often as you like.
- Define the names that the check uses. Helpers may stand in cells of your own above the answer.
- When answers are graded, the same checks run again, elsewhere, and with other inputs too: an answer has to
  be right for more than the numbers that a check happens to show.
- Each answer has half a minute. It can't open files of yours, the network or another program.

## Hand in

Save the notebooks and hand in the `.ipynb` files as they are. Leave their names, and don't delete cells.
"""


def readme(chapters: Sequence[Chapter]) -> str:
    """Return what instructors are told about the folder."""
    return f"""# The book in a classroom

{_table(chapters)}

- `student/`: to hand out, with a README for students. Solutions, hidden checks and outputs are taken out.
- `instructor/`: the same chapters with their solutions.

Both need the package `wfbook`, installed as its README says; students need nothing else.

Collect what students hand in as one folder or file a student, and grade it:

    submissions/alice/{chapters[0].name}.ipynb
    submissions/bob/{chapters[0].name}.ipynb

    python -m wfbook grade submissions --out marks.csv

`marks.csv` has a line for each student and exercise: marks, a verdict and the reason. An interrupt keeps
what is graded by then. `--chapters 3 5` grades these of everybody, also of who hands in nothing.

## What may be trusted

Only cells with answers, and helpers that they mention, are taken from a notebook. They run where the
chapter stands by then, one exercise at a time, in a process that may compute and nothing else: Linux's
seccomp and Landlock refuse it other processes, signals, connections, and all files but Python's and
wfbook's own. Checks come from the installed library and run in another process, which calls the answer's
functions from afar, once with the inputs that students see and once with others. So an answer that loops,
crashes, floods, forges or deletes costs its own marks only.

Nothing here notices an answer that was copied before it was handed in, or one that calls what the library
itself has for the purpose: it is open, and students may read it. It is no defence against flaws of Linux.
On a very busy machine a slow answer may be out of time that would not be on another: raise
`--time-limit`. Elsewhere than on Linux on x86-64 there is no fence; `--no-fence` then runs answers with
your own rights.
"""


def _table(chapters: Sequence[Chapter]) -> str:
    rows = ["| chapter | exercises | points |", "|---|---|---|"]
    for chapter in chapters:
        points = sum(exercise.points for exercise in chapter.exercises)
        rows.append(f"| {chapter.name} | {len(chapter.exercises)} | {points:g} |")
    return "\n".join(rows)


def _cells(notebook: str) -> list[dict[str, str]]:
    cells = json.loads(notebook)["cells"]
    return [{"source": "".join(cell["source"])} for cell in cells]
