"""What students hand in: right and wrong answers in notebooks of all conditions, and attempts at the grader.

:func:`honest` and :func:`hostile` make notebooks, and tell which of their answers are right.
"""

import copy
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wfbook.classroom.chapters import Chapter, Exercise, chapters
from wfbook.classroom.copies import student_copy
from wfbook.classroom.judge import LEARNED, RIGHT

WRONG = {
    "00-shorter-way": [("0.1: False", "0.1: True"), ("0.2: True", "0.2: False")],
    "00-rolling-share": [("stands.sum()\n", "stands.size\n"), ("D[:, :, :, 1]", "D[:, :, :, 0]")],
    "00-cost-of-transport": [("np.abs(torque * velocity)", "(torque * velocity)")],
    "00-late-torques": [("= 30", "= 40"), ("= 30", "= 10")],
    "00-gait-by-hand": [("(1, 0, 0, 1)", "(1, 1, 0, 1)")],
    "01-nose": [("-4 *", "4 *"), ("-4 *", "-1 *")],
    "01-torque": [("p - x", "x - p"), ("p - x", "p")],
    "01-bounds": [("s * r + F / s", "s * r + F"), ("(s * r - F / s) ** 2", "0.0")],
    "01-set-off": [("- shift", "+ shift"), ("* 1.0 / 4", "* 0.0 / 4")],
    "01-charge": [("0.02", "0.005"), ("0.02", "0.1")],
    "02-grows": [("8.0", "4.0"), ("8.0", "2.0")],
    "02-solve": [("T**5]", "T**4]"), ("[p0, v0, 0.0, pf, vf, 0.0]", "[p0, 0.0, 0.0, pf, 0.0, 0.0]")],
    "02-rolls": [("speed * duration + 0.05", "0.05"), ("@ [0.0, duration * speed,", "@ [0.0, 0.0,")],
    "02-clears": [("0.085, 0.275", "0.06, 0.28"), ("0.085, 0.275", "0.085, 0.4")],
    "03-count": [("5**3", "2**15"), ("5**3", "100")],
    "03-write": [("before[next(to_come)] = 1", "before[next(to_come)[0], 1] = 1")],
    "03-centroid": [("(len(S) - S.sum())", "4")],
    "03-least-m": [
        ("max(0.0, np.maximum(a * low, a * high).sum() - b)", "10.0"),
        ("max(0.0, ", "max(-9.0, "),
    ],
    "03-crossing": [("[0, 1, 0, 0, 1, 0]", "[0, 1, 0, 0, 0, 0]")],
    "04-holds": [("19.3, 0.0, 19.3", "20.5, 0.0, 20.5"), ("19.3, 0.0, 19.3", "0.337, 0.0, 19.3")],
    "04-inside": [("region.mu_wheel, region.mu_wheel_lateral", "region.mu_foot, region.mu_foot")],
    "04-resists": [("-c * n", "c * n"), ("np.sign(velocity)", "velocity")],
    "04-brakes": [('["FL", "FR"]', '["RL", "RR"]'), ('["FL", "FR"]', '["FL"]')],
    "04-safe": [("np.cos(np.pi / sides) * mu", "mu"), ("np.cos(np.pi / sides) * mu", "mu / np.sqrt(2)")],
    "05-blamed": [('"goal", ', ""), ('"step"', '"step", "friction"')],
    "05-left": [("* (1 - gap)", "")],
    "05-wheels": [('"swing"', '"goal"')],
    "05-weights": [("centroid=30.0, bounds=0.05", "acceleration=1.0")],
    "06-first-fall": [("1e3 * delay", "0.4e3 * delay")],
    "06-gives-first": [('"front"', '"rear"'), ('"friction"', '"lift"')],
    "06-friction-rows": [("mu / np.sqrt(2.0)", "mu")],
    "06-leg-jacobian": [("return J, drift", "return J, 0 * drift"), ("return J, drift", "return -J, drift")],
    "06-slow-computer": [("slow = Gains(", "slow = Gains() or Gains(")],
    "07-printed-speed": [("np.exp(-1.0)", "1.0")],
    "07-rolling-forgotten": [("-100", "100")],
    "07-kalman-step": [("+ (dt * sigma_a) ** 2", "+ dt * sigma_a")],
    "07-rolling": [("- np.cross(omega, lever)", "+ np.cross(omega, lever)")],
    "07-honest": [("= candidates[", "= 0.3 * candidates[")],
    "08-between-knots": [("0.5 * s**2", "s**2")],
    "08-which-cost": [("(mass * 9.81", "(mass")],
    "08-pushes": [("180: False", "180: True")],
    "09-ranks": [("2, 2, 3", "3, 3, 3"), ("2, 2, 3", "2, 2, 1")],
    "09-nears": [("np.pi, -1", "np.pi, 1"), ("(desired - current + np.pi) % (2 * np.pi) - np.pi", "desired")],
    "09-measures": [("e in (across, along)", "e in (along, across)")],
    "09-orbits": [("0.6, -0.6", "0.5, 0.0"), ("0.6, -0.6", "0.3, -0.3")],
    "10-tips": [("(0.19 + 0.02)", "0.19"), ("* 9.81 ", "")],
    "10-admits": [("width / 2", "width"), (" and abs(ty) < 1e-9", "")],
    "10-charges": [("0.5 * over", "over"), ("A.T @ over", "-A.T @ over")],
    "10-finds": [("[-moment[1], moment[0]]", "[moment[1], -moment[0]]")],
    "10-leans": [("lowest = next(", "lowest = 0.1 + next(")],
}
"""Slips in the solutions, from those that the tests of the checks know: what stands there, what instead.

An exercise that is not here is answered wrong with None.
"""

BEFORE = {
    "loops": "while True: pass",
    "sleeps": "import time\ntime.sleep(1e6)",
    "leaves": "import sys\nsys.exit(0)",
    "leaves at once": "import os\nos._exit(0)",
    "crashes": "import ctypes\nctypes.string_at(0)",
    "overflows": "import sys\nsys.setrecursionlimit(10**9)\nf = lambda n: f(n + 1) + 1\nf(0)",
    "prints": "while True: print('x' * 2**20)",
    "eats memory": "eaten = []\nwhile True: eaten.append(bytearray(2**26))",
    "forks": "import os\nwhile True: os.fork()",
    "starts threads": (
        "import threading, time\nwhile True: threading.Thread(target=time.sleep, args=(1e6,)).start()"
    ),
    "runs programs": "import subprocess\nsubprocess.run(['sh', '-c', 'while :; do :; done &'])",
    "kills": "import os, signal\nos.kill(os.getppid(), signal.SIGKILL)\nos.kill(-1, signal.SIGKILL)",
    "fills the disk": (
        "import os\nfor i in range(10**9):\n    with open(f'{i}', 'wb') as f: f.write(os.urandom(2**20) * 15)"
    ),
    "opens a connection": "import socket\nsocket.create_connection(('127.0.0.1', 22), timeout=5)",
    "reads the solutions": (
        "import json\nfrom pathlib import Path\nimport wfbook\n"
        "book = Path(wfbook.__file__).parent.parent / 'notebooks'\n"
        "for path in sorted(book.glob('*.ipynb')) or [book / '{chapter}.ipynb']:\n"
        "    for cell in json.loads(path.read_text())['cells']:\n"
        "        if 'SOLUTION' in ''.join(cell['source']): exec(''.join(cell['source']))"
    ),
    "deletes everything": (
        "import shutil\nshutil.rmtree('{submissions}', ignore_errors=True)\n"
        "for path in ('{marks}', '{submissions}/.x', '/tmp/.x'):\n"
        "    try: open(path, 'w').write('mallory,{chapter},{exercise},99,99,right,\\n')\n"
        "    except OSError: pass"
    ),
    "replaces the check": (
        "import wfbook.exercises as every, importlib, pkgutil\nfrom wfbook.exercises import answer\n"
        "for found in pkgutil.iter_modules(every.__path__):\n"
        "    module = importlib.import_module(f'wfbook.exercises.{found.name}')\n"
        "    for name, thing in list(vars(module).items()):\n"
        "        if callable(thing) and name[0] != '_': setattr(module, name, lambda *a, **k: 'Right')\n"
        "class check:\n    def __getattr__(self, name): return lambda *a, **k: 'Right'\n"
        "check = check()"
    ),
    "breaks numpy": (
        "import builtins, numpy as np\nnp.abs = np.linalg.norm = lambda *a, **k: 0.0\n"
        "np.allclose = np.array_equal = lambda *a, **k: True\nbuiltins.isinstance = lambda *a: True\n"
        "builtins.abs = lambda *a: 0.0"
    ),
    "prints a verdict": (
        'import os\nline = b\'{"job": 0, "verdict": "right", "message": ""}\\n\'\n'
        "for file in range(256):\n    try: os.write(file, line)\n    except OSError: pass"
    ),
    "speaks for the grader": (
        "import gc, json, socket, struct\nfor thing in gc.get_objects():\n"
        "    if isinstance(thing, socket.socket):\n"
        "        for reply in ({'error': None}, {'values': {}, 'verdict': 'right'}, ['right', '']):\n"
        "            data = json.dumps(reply).encode()\n"
        "            thing.sendall(struct.pack('!Q', len(data)) + data)"
    ),
    "meddles with memory": (
        "import os\nfor pid in (os.getppid(), 1):\n"
        "    with open(f'/proc/{pid}/mem', 'r+b') as memory: memory.write(b'x')"
    ),
}
"""Attempts that come before a wrong answer, or instead of one. Braces with a name are filled in."""

AGREES = '''
class Agrees:
    """Is whatever it is compared with."""
    def __array__(self, *a, **k): raise SystemExit
    def __eq__(self, other): return True
    def __float__(self): return 0.0
    def __call__(self, *a, **k): return self
    def __hash__(self): return 0
    def __iter__(self): return iter([self])
    def __len__(self): return 1
    def __reduce__(self): return (print, ("right",))
    __lt__ = __le__ = __gt__ = __ge__ = __eq__
    __sub__ = __rsub__ = __add__ = __mul__ = __getitem__ = __call__
'''
FILES = ("cut off", "no notebook", "no exercises", "another chapter", "nested", "no file", "check replaced")
"""What can be wrong with a file as a whole."""

HOSTILE = (*BEFORE, "agrees with everything", *FILES)


@dataclass
class HandIn:
    """What a student hands in.

    Attributes:
        student: who.
        chapter: of which chapter.
        kind: what is special about it.
        content: of the file; None for something that is no file.
        right: for each exercise whether its answer is.
        learned: the exercises whose answers know the inputs by heart.
    """

    student: str
    chapter: Chapter
    kind: str
    content: bytes | None = b""
    right: dict[str, bool] = field(default_factory=dict)
    learned: set[str] = field(default_factory=set)

    def write(self, folder: Path) -> None:
        """Write it into a folder, as a sub-folder or a file of the student's."""
        home = folder / self.student
        home.mkdir(parents=True)
        path = home / f"{self.chapter.name}.ipynb"
        if self.content is None:
            path.symlink_to("/dev/zero")
        else:
            path.write_bytes(self.content)

    def agrees(self, exercise: str, verdict: str) -> bool:
        """Tell whether a verdict is the one that the answer deserves."""
        if exercise in self.learned:
            return verdict == LEARNED
        return (verdict == RIGHT) == self.right[exercise]


def honest(student: str, chapter: Chapter, rng: np.random.Generator) -> HandIn:
    """Return a notebook with right, wrong, missing and unfinished answers, worked on as people do."""
    notebook, right, learned = _student_notebook(chapter), {}, set()
    for exercise in chapter.exercises:
        how = rng.choice(
            ["right", "wrong", "empty", "broken", "error at the end"], p=[0.6, 0.2, 0.1, 0.05, 0.05]
        )
        right[exercise.name] = how in ("right", "error at the end")
        if how == "empty":
            continue
        for position in exercise.answers:
            source = chapter.cells[position].source
            if how == "wrong":
                source = slip(chapter, exercise, int(rng.integers(8)))
            elif how == "broken":
                source += "\nreturn ) what ("
            elif how == "error at the end":
                source += "\nprint(my_name_for_it)"
            notebook["cells"][position]["source"] = _without_markers(source)
    kind = str(rng.choice(list(_HABITS)))
    _HABITS[kind](notebook, chapter)
    return HandIn(student, chapter, kind, _bytes(notebook), right, learned)


def hostile(
    kind: str, student: str, chapter: Chapter, rng: np.random.Generator, submissions: Path, marks: Path
) -> HandIn:
    """Return a notebook with one attempt at the grader; its other answers are right."""
    notebook = _student_notebook(chapter)
    right = {exercise.name: True for exercise in chapter.exercises}
    for exercise in chapter.exercises:
        for position in exercise.answers:
            notebook["cells"][position]["source"] = _without_markers(chapter.cells[position].source)
    victim = chapter.exercises[int(rng.integers(len(chapter.exercises)))]
    where = notebook["cells"][victim.answers[-1]]
    right[victim.name] = False
    nothing = "\n".join(f"{name} = None" for name in victim.names)
    content: bytes | None = None
    if kind in BEFORE:
        attempt = BEFORE[kind]
        places = {"submissions": submissions, "marks": marks}
        for name, value in (places | {"chapter": chapter.name, "exercise": victim.name}).items():
            attempt = attempt.replace("{" + name + "}", str(value))
        where["source"] = f"{nothing}\n{attempt}"
    elif kind == "agrees with everything":
        where["source"] = AGREES + "\n".join(f"{name} = Agrees()" for name in victim.names)
    elif kind == "check replaced":
        where["source"] = nothing
        notebook["cells"][victim.check]["source"] = "'Right'"
    elif kind == "no exercises":
        notebook["cells"] = [c for c in notebook["cells"] if "nbgrader" not in c["metadata"]]
    elif kind == "another chapter":
        others = [other for other in chapters() if other.name != chapter.name]
        notebook = json.loads(others[int(rng.integers(len(others)))].path.read_text())
    content = _bytes(notebook)
    if kind in FILES and kind != "check replaced":
        right = dict.fromkeys(right, False)
        changed = {
            "cut off": content[: len(content) // 2],
            "no notebook": rng.bytes(1000),
            "nested": b"[" * 10**6,
            "no file": None,
        }
        content = changed.get(kind, content)
    return HandIn(student, chapter, kind, content, right)


def slip(chapter: Chapter, exercise: Exercise, which: int = 0) -> str:
    """Return a wrong answer."""
    source = "\n".join(chapter.cells[position].source for position in exercise.answers)
    slips = WRONG.get(exercise.name)
    if not slips:
        return "\n".join(f"{name} = None" for name in exercise.names)
    old, new = slips[which % len(slips)]
    assert old in source, f"{exercise.name}: {old!r} is not in the solution"
    return source.replace(old, new)


def by_heart(student: str, chapter: Chapter, name: str, check: Callable[..., str], solution: Any) -> HandIn:
    """Return a notebook that answers an exercise with a table of what its check asks."""
    table: dict[str, Any] = {}

    def recorded(*arguments: Any) -> Any:
        answer = solution(*arguments)
        table[repr(arguments)] = np.asarray(answer).tolist()
        return answer

    check(recorded)
    (exercise,) = [e for e in chapter.exercises if e.name == name]
    notebook = _student_notebook(chapter)
    source = f"TABLE = {table!r}\n\ndef {exercise.names[0]}(*arguments):\n    return TABLE[repr(arguments)]\n"
    notebook["cells"][exercise.answers[-1]]["source"] = source
    right = dict.fromkeys((e.name for e in chapter.exercises), False)
    return HandIn(student, chapter, "learned by heart", _bytes(notebook), right, {name})


def _helper_above(notebook: dict[str, Any], chapter: Chapter) -> None:
    """Move what an answer imports or computes into a cell of the student's own."""
    for exercise in reversed(chapter.exercises):
        cell = notebook["cells"][exercise.answers[-1]]
        if "NotImplemented" in cell["source"] or "def " in cell["source"]:
            continue
        helper = copy.deepcopy(cell) | {"id": f"own-{exercise.name}", "metadata": {}}
        cell["source"] = "\n".join(f"{name} = {name}" for name in exercise.names)
        notebook["cells"].insert(exercise.answers[-1], helper)


def _scribbles(notebook: dict[str, Any], chapter: Chapter) -> None:
    """Add cells of the student's own that fail, loop or print, which no answer needs."""
    for number, source in enumerate(
        ("1 / 0", "while True: pass", "%timeit 1 + 1", "my_note = 'try μ = 0.4'")
    ):
        cell = {
            "cell_type": "code", "id": f"scribble{number}", "metadata": {}, "source": source,
            "outputs": [], "execution_count": None,
        }  # fmt: skip
        notebook["cells"].insert(4 * number, cell)


def _without_names(notebook: dict[str, Any], chapter: Chapter) -> None:
    """Lose nbgrader's names, as some editors do."""
    for cell in notebook["cells"]:
        cell["metadata"] = {}


def _without_ids(notebook: dict[str, Any], chapter: Chapter) -> None:
    """Save in the format before cells had ids."""
    notebook["nbformat_minor"] = 4
    for cell in notebook["cells"]:
        del cell["id"]


def _checks_deleted(notebook: dict[str, Any], chapter: Chapter) -> None:
    """Delete the checks."""
    checks = {exercise.check for exercise in chapter.exercises}
    notebook["cells"] = [c for i, c in enumerate(notebook["cells"]) if i not in checks]


def _magics(notebook: dict[str, Any], chapter: Chapter) -> None:
    """Leave IPython's magics in the answers, and look at what they give."""
    for exercise in chapter.exercises:
        cell = notebook["cells"][exercise.answers[-1]]
        cell["source"] = f"%matplotlib inline\n{cell['source']}\n!ls\n"
        if "NotImplemented" in cell["source"]:
            cell["source"] = cell["source"].replace("%matplotlib inline\n", "").replace("\n!ls\n", "")


def _untouched(notebook: dict[str, Any], chapter: Chapter) -> None:
    """Hand it in as it is."""


_HABITS = {
    "plain": _untouched,
    "helper above": _helper_above,
    "scribbles": _scribbles,
    "without names": _without_names,
    "without ids": _without_ids,
    "checks deleted": _checks_deleted,
    "magics": _magics,
}


def _student_notebook(chapter: Chapter) -> dict[str, Any]:
    notebook = json.loads(student_copy(chapter))
    for cell in notebook["cells"]:
        cell["source"] = "".join(cell["source"])
    return notebook


def _without_markers(source: str) -> str:
    return "\n".join(line for line in source.splitlines() if "### " not in line)


def _bytes(notebook: dict[str, Any]) -> bytes:
    return json.dumps(notebook, indent=1).encode()
