"""Is every honest answer marked right, whatever hostile ones do? A class of students that is made up.

    python benchmarks/grading.py [--count 100] [--seed 0] [--jobs 2] [--time-limit 30] [--chapters N …]

Honest students get answers right, wrong, not at all or nearly, in notebooks of all conditions; hostile ones
try the grader in each way that ``tests/handins.py`` knows. The command grades them; this prints what
was expected against the verdicts, and how long it took; exit code 1 if one verdict is wrong.
"""

import argparse
import csv
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from handins import HOSTILE, HandIn, honest, hostile

from wfbook.classroom.chapters import chosen
from wfbook.report import aligned


def main() -> int:
    """Make up a class, grade it, compare and tell."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--time-limit", type=float, default=30.0)
    parser.add_argument("--chapters", nargs="+")
    options = parser.parse_args()
    chapters = chosen(options.chapters)
    with tempfile.TemporaryDirectory() as home:
        submissions, marks = Path(home) / "submissions", Path(home) / "marks.csv"
        people: dict[str, HandIn] = {}
        for i in range(options.count):
            rng = np.random.default_rng([options.seed, i])
            chapter = chapters[i % len(chapters)]
            if i < len(HOSTILE):
                one = hostile(HOSTILE[i], f"mallory-{i:03}", chapter, rng, submissions, marks)
            else:
                one = honest(f"alice-{i:03}", chapter, rng)
            people[one.student] = one
            one.write(submissions)
        before = sorted(path.relative_to(submissions) for path in submissions.rglob("*"))
        command = [sys.executable, "-m", "wfbook", "grade", str(submissions), "--out", str(marks)]
        command += ["--jobs", str(options.jobs), "--time-limit", str(options.time_limit)]
        began = time.monotonic()
        code = subprocess.run([*command, "--seed", str(options.seed)]).returncode
        took = time.monotonic() - began
        rows = list(csv.DictReader(marks.open()))
        untouched = before == sorted(path.relative_to(submissions) for path in submissions.rglob("*"))
    table: Counter[tuple[str, str]] = Counter()
    mistakes = []
    for row in rows:
        one = people[row["student"]]
        who = "hostile" if one.kind in HOSTILE else "honest"
        truth = "right" if one.right.get(row["exercise"]) else "not right"
        table[f"{who}, {truth}", row["verdict"]] += 1
        if not one.agrees(row["exercise"], row["verdict"]):
            mistakes.append(
                f"{one.student} ({one.kind}) {row['exercise']}: {row['verdict']}, {row['message']}"
            )
    verdicts = sorted({verdict for _, verdict in table})
    lines = [["expected", *verdicts]]
    for truth in sorted({truth for truth, _ in table}):
        lines.append([truth, *(str(table[truth, verdict]) for verdict in verdicts)])
    print("\n" + aligned(lines))
    expected = sum(len(one.right) for one in people.values())
    print(f"\n{len(people)} students, {len(rows)} of {expected} lines, {took:.0f} s, exit code {code}")
    print(f"submissions as they were: {untouched}; wrong verdicts: {len(mistakes)}", *mistakes, sep="\n")
    return int(bool(mistakes) or not untouched or code != 0 or len(rows) != expected)


if __name__ == "__main__":
    sys.exit(main())
