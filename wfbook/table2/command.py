"""``python -m wfbook table2``: run the benchmark, keep what it found, tell and draw it."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from wfbook.arguments import FAILED, INTERRUPTED, OK, WRONG_INPUT, CommandError, number, result_folder, whole
from wfbook.report import ProgressLine, plain
from wfbook.results import undisturbed
from wfbook.table2.benchmark import ROWS, Benchmark, Options
from wfbook.table2.text import table

FILES = ("table2.json", "table2.png")


def add_to(commands: Any) -> None:
    """Add the command's parser to the subparsers of the program's."""
    names = [row.name for row in ROWS]
    default = Options()
    parser = commands.add_parser(
        "table2", help="the paper's Table II: how long planning takes here", allow_abbrev=False
    )
    parser.set_defaults(command=run)
    parser.add_argument(
        "--rows", nargs="*", choices=names, default=names, metavar="ROW", help=f"of {' '.join(names)} (all)"
    )
    parser.add_argument(
        "--gap", type=number(0.0, above=True), default=default.gap, help="relative gap to prove (0.001)"
    )
    limits = (
        ("--time-limit", number(0.0, above=True), "of a search by the tight formulation"),
        ("--cap", number(0.0), "of a search by the paper's formulation on SCIP, 0 for none"),
        ("--growth-limit", number(0.0, above=True), "of a search for --growth"),
    )
    for option, kind, text in limits:
        value = getattr(default, option[2:].replace("-", "_"))
        parser.add_argument(option, type=kind, default=value, metavar="S", help=f"{text} ({value:g} s)")
    parser.add_argument(
        "--paper-rows", nargs="+", choices=names, metavar="ROW", help="rows for the paper's formulation (all)"
    )
    parser.add_argument(
        "--repeat", type=whole(1), default=default.repeat, help="runs of a quick search, for the median (3)"
    )
    parser.add_argument("--growth", action="store_true", help="also how time grows with slots and regions")
    parser.add_argument("--out", metavar="DIR", default="results/table2", help="folder (results/table2)")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")


def run(arguments: argparse.Namespace) -> int:
    """Run the benchmark; an interrupt keeps what was measured.

    Returns:
        0 if the tight formulation proved every row's optimum to the gap, else 1.

    Raises:
        CommandError: wrong input, or interrupted with something measured.
        KeyboardInterrupt: interrupted with nothing measured.
    """
    rows = [row for row in ROWS if row.name in arguments.rows]
    if not rows and not arguments.growth:
        raise CommandError("--rows: none is left, and no --growth", WRONG_INPUT)
    for name in arguments.paper_rows or ():
        if name not in arguments.rows:
            raise CommandError(f"--paper-rows: {name} is not among --rows", WRONG_INPUT)
    if arguments.paper_rows and not arguments.cap:
        raise CommandError("--paper-rows has no effect with --cap 0", WRONG_INPUT)
    asked = {name: getattr(arguments, name) for name in Options.__dataclass_fields__}
    benchmark = Benchmark(rows, arguments.paper_rows or arguments.rows, Options(**asked))
    code = None
    with result_folder(arguments.out, FILES) as folder:
        try:
            with ProgressLine(sys.stderr) as line:
                benchmark.run(line.show)
        except (KeyboardInterrupt, SystemExit) as stop:
            if not benchmark.finished:
                raise
            code = stop.code if isinstance(stop, SystemExit) else INTERRUPTED
        with undisturbed():
            _write(folder.path, benchmark.report)
            folder.publish()
    report = plain(benchmark.report)
    print(
        json.dumps(report, indent=1) if arguments.json else f"{table(report)}\n\nresults in {folder.target}"
    )
    if code is not None:
        raise CommandError(f"interrupted, what was measured is in {str(folder.target)!r}", code)
    return OK if benchmark.proven else FAILED


def _write(folder: Path, report: dict[str, Any]) -> None:
    from wfbook.view import benchmarks

    text = json.dumps(plain(report), indent=1, allow_nan=False)
    (folder / "table2.json").write_text(text + "\n")
    (folder / "table2.png").write_bytes(benchmarks.table2(report).png())
