"""``python -m wfbook study``: run what is missing of a study, keep it, tell and draw it."""

import argparse
import contextlib
import json
import os
import statistics
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wfbook import terrain as ground
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
    wrong_input,
)
from wfbook.report import ProgressLine, plain
from wfbook.study import axes, cluster, design, plans, store
from wfbook.study.design import Study
from wfbook.study.tables import rows_of, summary, write_parquet
from wfbook.study.text import report_text
from wfbook.table2.benchmark import machine

FORMAT = 1
"""Version of ``study.json``."""

FILES = ("study.parquet", "study.json", "sweeps.png")
_PLANNING = {"slots": 10, "feet_only": False, "time_limit": 60.0}
"""Options of planning a terrain, and their defaults."""


def add_to(commands: Any) -> None:
    """Add the command's parser to the subparsers of the program's."""
    parser = commands.add_parser(
        "study",
        help="what a plan bears: many disturbed simulations",
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=_axes_help(),
    )
    parser.set_defaults(command=run)
    names = ", ".join(ground.BUILTIN_NAMES)
    parser.add_argument(
        "terrains", metavar="TERRAIN", nargs="*", help=f"{names}, or a terrain FILE.json (flat)"
    )
    parser.add_argument("--plan", nargs="+", metavar="FILE", help="execute these plan files instead")
    parser.add_argument("--slots", type=whole(1), help="0.3 s swing slots to plan, each for 0.1 m (10)")
    parser.add_argument("--feet-only", action="store_true", default=None, help="plan without wheels")
    parser.add_argument(
        "--time-limit", type=number(0.0, above=True), metavar="S", help="of planning a terrain (60 s)"
    )
    parser.add_argument(
        "--sweep",
        action="append",
        type=axes.levels,
        metavar="AXIS[=V,V,…]",
        help="change one factor; again for another (with neither --sweep nor --grid: "
        f"{', '.join(design.STANDARD_SWEEPS)}; {', '.join(' x '.join(g) for g in design.STANDARD_GRIDS)})",
    )
    parser.add_argument(
        "--grid",
        action="append",
        nargs=2,
        type=axes.levels,
        metavar="AXIS[=V,V,…]",
        help="change two together",
    )
    parser.add_argument(
        "--set",
        action="append",
        type=axes.setting,
        default=[],
        metavar="AXIS=V",
        help="a value in all other runs",
    )
    parser.add_argument("--seeds", type=whole(1), default=5, help="runs of each combination (5)")
    parser.add_argument(
        "--state",
        choices=("estimated", "true"),
        default="estimated",
        help="what the controller sees (estimated)",
    )
    parser.add_argument("--wheel-model", default="encoder", help="of the estimator (encoder)")
    parser.add_argument(
        "--runs", type=whole(0), metavar="N", help="run at most so many now; go on another time"
    )
    parser.add_argument(
        "--retry", action="store_true", help="run again what ended with an error in an earlier session"
    )
    parser.add_argument("--workers", type=whole(1), metavar="N", help="processes (one for each usable core)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, to run there instead")
    parser.add_argument("--out", metavar="DIR", default="results/study", help="folder (results/study)")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")


def run(arguments: argparse.Namespace) -> int:
    """Run what is not finished yet; an interrupt keeps what is.

    Returns:
        0 if no run ended with an error, else 1.

    Raises:
        CommandError: wrong input, no plan, no cluster, or interrupted with something finished.
        KeyboardInterrupt: interrupted with nothing finished.
    """
    _check(arguments)
    folder = Path(arguments.out)
    began = time.perf_counter()
    with _opened(folder) as kept, ProgressLine(sys.stderr) as line:
        study, new_plans = _study(arguments, folder, line)
        finished = kept.rows()
        _refuse_others(study, finished, folder)
        if arguments.retry:
            failed = [key for key, row in finished.items() if row["error"] is not None]
            kept.forget(failed)
            finished = {key: row for key, row in finished.items() if key not in failed}
        missing = [key for key in study.cases if key not in finished][: arguments.runs]
        try:
            with contextlib.closing(_results(arguments, study, missing, finished, line)) as results:
                for key, row in results:
                    while new_plans:  # a row is of no use without its plan
                        _write_whole(*new_plans.popitem())
                    kept.keep(key, row)
                    finished[key] = row
        except (KeyboardInterrupt, SystemExit) as stop:
            if not finished:
                raise
            code = stop.code if isinstance(stop, SystemExit) else INTERRUPTED
            raise CommandError(f"interrupted{_kept(study, finished, folder)}", code) from None
        except (cluster.ClusterError, store.StoreError) as error:
            raise CommandError(f"{error}{_kept(study, finished, folder)}", FAILED) from None
        if not finished:
            raise CommandError(f"--runs 0: no run is finished in {str(folder)!r}", FAILED)
        report = plain(_report(study, finished) | {"session_s": time.perf_counter() - began})
        _publish(folder, study, finished, report)
    print(json.dumps(report, indent=1) if arguments.json else f"{report_text(report)}\n\nresults in {folder}")
    return FAILED if report["failures"] else OK


def _check(arguments: argparse.Namespace) -> None:
    """Refuse options that contradict each other or have no effect."""
    for option in _PLANNING:
        if arguments.plan and getattr(arguments, option) is not None:
            raise CommandError(f"--{option.replace('_', '-')} has no effect with --plan", WRONG_INPUT)
    if arguments.plan and arguments.terrains:
        raise CommandError(f"TERRAIN {arguments.terrains[0]!r} has no effect with --plan", WRONG_INPUT)
    if arguments.scheduler and arguments.workers:
        raise CommandError("--workers has no effect with --scheduler", WRONG_INPUT)
    sweeps, grids = arguments.sweep or (), arguments.grid or ()
    experiments = [("--sweep", [sweep]) for sweep in sweeps] + [("--grid", grid) for grid in grids]
    names = [design.name_of(*factors) for _, factors in experiments]
    for name in names:
        if names.count(name) > 1:
            raise CommandError(f"{name} is asked for twice", WRONG_INPUT)
    for one, other in grids:
        if one[0] == other[0]:
            raise CommandError(f"--grid: {one[0].name} stands against itself", WRONG_INPUT)
    pushed = any(axis.name == "push" and value for axis, value in arguments.set)
    for option, factors in [*experiments, ("--set", arguments.set)]:
        together = {axis.name for axis, _ in factors}
        for name in together & set(axes.ONLY_PUSHED):
            # What is set may serve a push that is swept, as it is in the standard study.
            swept = any("push" in other.split(" x ") for other in names) or not names
            elsewhere = option == "--set" and swept
            if not (pushed or "push" in together or elsewhere):
                raise CommandError(f"{option} {name} has no effect without --set push=N", WRONG_INPUT)
        if "sensor_noise" in together and arguments.state == "true":
            raise CommandError(f"{option} sensor_noise has no effect with --state true", WRONG_INPUT)
    if arguments.wheel_model != Study.wheel_model and arguments.state == "true":
        raise CommandError("--wheel-model has no effect with --state true", WRONG_INPUT)


@contextlib.contextmanager
def _opened(folder: Path) -> Iterator[store.Store]:
    with contextlib.ExitStack() as stack:
        try:
            kept = stack.enter_context(store.opened(folder))
        except store.StoreError as error:
            raise CommandError(f"--out: {error}", WRONG_INPUT) from None
        except OSError as error:
            raise CommandError(
                f"--out {str(folder)!r} can't be used: {error.strerror}", WRONG_INPUT
            ) from None
        yield kept


def _study(
    arguments: argparse.Namespace, folder: Path, line: ProgressLine
) -> tuple[Study, dict[Path, bytes]]:
    """Return what is asked, and the plans that were made for it and are not kept yet."""
    load("wfbook.planner", "wfbook.estimator")
    from wfbook import planner
    from wfbook.estimator import WHEEL_MODELS

    if arguments.wheel_model not in WHEEL_MODELS:
        known = ", ".join(WHEEL_MODELS)
        raise CommandError(f"--wheel-model: {arguments.wheel_model!r} is none of {known}", WRONG_INPUT)
    new: dict[Path, bytes] = {}
    with wrong_input():
        if arguments.plan:
            found = plans.from_files(arguments.plan)
        else:
            found = {}
            for terrain in [ground.named_or_file(text) for text in arguments.terrains or ["flat"]]:
                if terrain.name in found:
                    raise CommandError(f"TERRAIN: {terrain.name!r} is given twice", WRONG_INPUT)
                options = [getattr(arguments, name) or usual for name, usual in _PLANNING.items()]
                try:
                    path, content = plans.for_terrain(terrain, *options, folder, line.show)
                except (planner.InfeasibleError, planner.NoPlanError) as error:
                    raise CommandError(" ".join(str(error).split()), FAILED) from None
                found[terrain.name] = content
                if not path.exists():
                    new[path] = content
    sweeps, grids = arguments.sweep or (), arguments.grid or ()
    if not sweeps and not grids:
        names = [n for n in design.STANDARD_SWEEPS if n != "sensor_noise" or arguments.state == "estimated"]
        sweeps = [axes.levels(name) for name in names]
        grids = [(axes.levels(one), axes.levels(other)) for one, other in design.STANDARD_GRIDS]
    base = {axis.name: value for axis, value in arguments.set}
    grids = tuple((one, other) for one, other in grids)
    study = Study(found, tuple(sweeps), grids, base, arguments.seeds, arguments.state, arguments.wheel_model)
    return study, new


def _refuse_others(study: Study, finished: dict[str, dict[str, Any]], folder: Path) -> None:
    """Refuse a folder with runs that this study does not ask for; those of a smaller one are welcome."""
    others = [row for key, row in finished.items() if key not in study.cases]
    if not others:
        return
    theirs, ours = others[0]["versions"], design.versions()
    reason = "other disturbances or seeds"
    if others[0]["plan_digest"] not in study.digests.values():
        reason = "another plan"
    elif others[0]["state"] != study.state or others[0]["wheel_model"] not in (None, study.wheel_model):
        reason = "another state or wheel model"
    for name, version in ours.items():
        if theirs.get(name) != version:
            reason = f"{name} {theirs.get(name)}, not {version}"
    raise CommandError(
        f"--out {str(folder)!r} holds {len(others)} runs of another study ({reason}): choose another folder",
        WRONG_INPUT,
    )


def _results(
    arguments: argparse.Namespace,
    study: Study,
    missing: list[str],
    finished: dict[str, dict[str, Any]],
    line: ProgressLine,
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what the missing cases give; show how far it is."""
    if not missing:
        return
    line.show(f"{len(missing)} of {len(study.cases)} runs to do, starting")
    with contextlib.ExitStack() as stack:
        if arguments.scheduler:
            try:
                client = stack.enter_context(cluster.remote(arguments.scheduler))
            except cluster.ClusterError as error:
                raise CommandError(str(error), WRONG_INPUT) from None
        else:
            workers = arguments.workers or len(os.sched_getaffinity(0))
            client = stack.enter_context(cluster.local(min(workers, len(missing))))
        began = time.monotonic()
        cases = {key: study.cases[key][1] for key in missing}
        contents = {digest: study.plans[name] for name, digest in study.digests.items()}
        for done, (key, row) in enumerate(cluster.results(client, cases, contents), 1):
            yield key, row
            left = (time.monotonic() - began) / done * (len(missing) - done)
            errors = sum(row["error"] is not None for row in finished.values())
            upright = sum(bool(row.get("upright")) for row in finished.values())
            line.show(
                f"{len(finished)} of {len(study.cases)} runs, {upright} upright, {errors} with an error, "
                f"{len(client.nthreads())} workers, {int(left) // 60}:{int(left) % 60:02d} min left"
            )


def _kept(study: Study, finished: dict[str, dict[str, Any]], folder: Path) -> str:
    """Return how a message that the study ends early goes on."""
    if not finished:
        return ""
    return (
        f", {len(finished)} of {len(study.cases)} runs are kept in {str(folder)!r}, the same command goes on"
    )


def _report(study: Study, finished: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return what ``study.json`` holds."""
    failures = [
        {"run": key, "plan": study.cases[key][0], "seed": row["seed"], "error": row["error"]}
        for key, row in finished.items()
        if row["error"] is not None
    ]
    return {
        "format": FORMAT,
        "complete": len(finished) == len(study.cases),
        "asked": len(study.cases),
        "finished": len(finished),
        "definition": study.description(),
        "machine": machine(),
        **summary(study, finished),
        "failures": failures,
        "run_s_median": statistics.median(row.get("wall_time_s", 0.0) for row in finished.values()),
    }


def _publish(folder: Path, study: Study, finished: dict[str, dict[str, Any]], report: dict[str, Any]) -> None:
    """Write table, summary and figures, and put them in place together."""
    from wfbook.view import survival

    pictures = {
        f"map-{name.replace(' ', '-')}.png": name
        for name in dict.fromkeys(g["name"] for g in report["grids"])
    }
    earlier = [path.name for path in folder.glob("map-*.png")]
    with result_folder(folder, (*FILES, *{*earlier, *pictures})) as results:
        write_parquet(results.path / "study.parquet", rows_of(study, finished), report["definition"])
        text = json.dumps(report, indent=1, allow_nan=False)
        (results.path / "study.json").write_text(text + "\n")
        if report["sweeps"]:
            (results.path / "sweeps.png").write_bytes(survival.sweeps(report).png())
        for file, name in pictures.items():
            (results.path / file).write_bytes(survival.grid(report, name).png())
        results.publish()


def _write_whole(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    scratch = path.with_suffix(".part")
    scratch.write_bytes(content)
    os.replace(scratch, path)


def _axes_help() -> str:
    """Return a line for each axis."""
    lines = ["axes of disturbance (range; usual value), the robot knows of none:"]
    for axis in axes.AXES.values():
        usual = "drawn for each seed" if axis.usual is None else f"{axis.usual:g}"
        lines.append(f"  {axis.name:16} {axis.text} ({axis.range}; {usual})")
    return "\n".join(lines)
