"""``python -m wfbook paper``: do the experiments, keep what is found, tell and draw it."""

import argparse
import json
import sys
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wfbook.arguments import (
    FAILED,
    INTERRUPTED,
    OK,
    WRONG_INPUT,
    CommandError,
    load,
    number,
    result_folder,
    whole,
)
from wfbook.paper.options import NAMES, Options
from wfbook.report import ProgressLine, plain
from wfbook.results import undisturbed

if TYPE_CHECKING:
    from wfbook.paper.record import Experiment, Result

FORMAT = 1
"""Version of ``paper.json``."""

CACHE = "cache"
"""Folder of plans and runs under that of the results."""


def add_to(commands: Any) -> None:
    """Add the command's parser to the subparsers of the program's."""
    parser = commands.add_parser(
        "paper", help="the papers' figures and numbers beside what comes out here", allow_abbrev=False
    )
    default = Options()
    parser.set_defaults(command=run)
    parser.add_argument(
        "--only", nargs="+", choices=NAMES, metavar="NAME", help=f"experiments, of {' '.join(NAMES)} (all)"
    )
    positive = number(0.0, above=True)
    parser.add_argument(
        "--time-limit", type=positive, default=default.time_limit, metavar="S", help="of each search (60 s)"
    )
    parser.add_argument("--gap", type=positive, default=default.gap, help="relative gap to prove (0.001)")
    parser.add_argument("--seeds", type=whole(1), default=default.seeds, help="runs of each plan (3)")
    parser.add_argument(
        "--state", choices=("estimated", "true"), default=default.state, help="what the controller sees"
    )
    parser.add_argument(
        "--table2",
        metavar="FILE",
        help="report to take Table II from (table2/table2.json beside DIR; if there is none, it is run)",
    )
    parser.add_argument("--out", metavar="DIR", default="results/paper", help="folder (results/paper)")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    parser.epilog = (
        "Plans and runs are kept in DIR/cache: after an interrupt the same command goes on where it was."
    )


def run(arguments: argparse.Namespace) -> int:
    """Do the experiments; an interrupt keeps what was found.

    Returns:
        0 if everything was planned and nobody fell, else 1.

    Raises:
        CommandError: wrong input, or interrupted with something found.
        KeyboardInterrupt: interrupted with nothing found.
    """
    load("wfbook.paper.parts", "wfbook.simulate", "wfbook.view.paper", "wfbook.view.paper_omni")
    given = _table2(arguments)
    from wfbook.paper.bench import Bench
    from wfbook.paper.parts import EXPERIMENTS
    from wfbook.paper.store import Store

    options = Options(
        time_limit=arguments.time_limit,
        gap=arguments.gap,
        seeds=arguments.seeds,
        state=arguments.state,
        table2=given,
    )
    asked = [e for e in EXPERIMENTS if arguments.only is None or e.name in arguments.only]
    names = tuple(name for experiment in EXPERIMENTS for name in experiment.pictures)
    target, code = Path(arguments.out), None
    bench = Bench(Store(target / CACHE), options)
    done: dict[str, Result] = {}
    with result_folder(target, ("paper.json", "paper.md", *names)) as folder:
        try:
            with ProgressLine(sys.stderr) as line:
                bench.show = line.show
                for place, experiment in enumerate(asked, 1):
                    bench.head = f"{place} of {len(asked)}  "
                    done[experiment.name] = _done(experiment, bench)
        except (KeyboardInterrupt, SystemExit) as stop:
            if not bench.store.folder.exists():
                raise
            code = stop.code if isinstance(stop, SystemExit) else INTERRUPTED
        with undisturbed():
            report = _report(asked, done, bench)
            _write(folder.path, report, done)
            folder.publish()
    from wfbook.paper.text import table

    print(
        json.dumps(report, indent=1) if arguments.json else f"{table(report)}\n\nresults in {folder.target}"
    )
    if code is not None:
        raise CommandError(f"interrupted, what was found is in {str(folder.target)!r}", code)
    return FAILED if any(result.troubles for result in done.values()) else OK


def _table2(arguments: argparse.Namespace) -> Path | None:
    """Return the file to take Table II from, which must be readable; None if its rows are to be searched."""
    if arguments.only is not None and "table2" not in arguments.only:
        if arguments.table2 is not None:
            raise CommandError("--table2 has no effect without table2 among --only", WRONG_INPUT)
        return None
    path = Path(arguments.table2 or Path(arguments.out).parent / "table2" / "table2.json")
    if arguments.table2 is None and not path.exists():
        return None
    from wfbook.paper.times import read

    try:
        report = read(path)
    except ValueError as error:
        raise CommandError(f"--table2: {error}", WRONG_INPUT) from None
    except OSError as error:
        raise CommandError(f"--table2: {str(path)!r}: {error.strerror}", WRONG_INPUT) from None
    return path if arguments.table2 is not None or report["complete"] else None


def _done(experiment: "Experiment", bench: Any) -> "Result":
    """Do an experiment; what could not be planned meanwhile are its troubles."""
    bench.troubles = []
    result = experiment.run(bench)
    result.troubles += bench.troubles
    return result


def _report(asked: "list[Experiment]", done: "dict[str, Result]", bench: Any) -> dict[str, Any]:
    """Return what ``paper.json`` holds, in JSON's types."""
    from wfbook.quoted import PAPER_A, PAPER_B
    from wfbook.table2.benchmark import machine

    entries = []
    for experiment in asked:
        if experiment.name not in done:
            continue
        result = done[experiment.name]
        entries.append(
            {
                "name": experiment.name,
                "title": experiment.title,
                "where": experiment.where,
                "records": [record.to_dict() for record in result.records],
                "settings": result.settings,
                "lines": result.lines,
                "notes": result.notes,
                "troubles": result.troubles,
                "pictures": list(result.pictures),
            }
        )
    return plain(
        {
            "format": FORMAT,
            "complete": len(done) == len(asked),
            "written": datetime.now(UTC).isoformat(timespec="seconds"),
            "machine": machine(),
            "options": bench.settings,
            "experiments": entries,
            "unused": [asdict(said) for said in PAPER_A + PAPER_B if said.unused],
        }
    )


def _write(folder: Path, report: dict[str, Any], done: "dict[str, Result]") -> None:
    from wfbook.paper.text import markdown

    (folder / "paper.json").write_text(json.dumps(report, indent=1, allow_nan=False) + "\n")
    (folder / "paper.md").write_text(markdown(report))
    for result in done.values():
        for name, draw in result.pictures.items():
            (folder / name).write_bytes(draw().png())
