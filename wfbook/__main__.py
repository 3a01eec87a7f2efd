"""The command line: ``python -m wfbook`` and what it can do: run, table2, study, paper, lab and others."""

import argparse
import contextlib
import json
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from wfbook import omni_command as omni
from wfbook import terrain as ground
from wfbook.arguments import (
    FAILED,
    GOAL_PER_SLOT,
    INTERRUPTED,
    LONG,
    OK,
    WRONG_INPUT,
    CommandError,
    Parser,
    file_name,
    goal,
    join_goal,
    load,
    number,
    result_folder,
    whole,
    wrong_input,
)
from wfbook.book import command as book
from wfbook.classroom import command as classroom
from wfbook.equations import command as equations
from wfbook.paper import command as paper
from wfbook.report import ProgressLine, plain, search_line, summary_table
from wfbook.study import command as study
from wfbook.table2 import command as table2

if TYPE_CHECKING:
    from wfbook.planner import Plan, Problem
    from wfbook.simulate import Run

FILES = ("plan_relaxed.npz", "plan.npz", "run.npz", "metrics.json", "gait.png", "replay.html")
PLANNING = {
    "goal": None,
    "slots": 10,
    "feet_only": False,
    "formulation": "tight",
    "gap": 1e-3,
    "time_limit": 25.0,
    "replan": False,
    "clock": "budget",
}
"""Options of planning and their defaults; no goal means ``GOAL_PER_SLOT`` ahead for each slot."""
REPLAN_GAP = 0.02
"""Of windows that are planned while the robot moves; the default of ``--gap`` then."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: the arguments without the program's name; by default those of the process.

    Returns:
        0 on success, 1 if the robot fell or something could not be planned, 2 for wrong input, 130 if
        interrupted.
    """
    try:
        parser = _parser()
        arguments, rest = parser.parse_known_args(join_goal(sys.argv[1:] if argv is None else argv))
        if arguments.command is _lab:
            return _lab(rest)
        if rest:
            parser.error(f"unknown: {' '.join(rest)}")
        return arguments.command(arguments)
    except CommandError as error:
        print(f"wfbook: {error}", file=sys.stderr)
        return error.code
    except KeyboardInterrupt:
        print("wfbook: interrupted, nothing was written", file=sys.stderr)
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="wfbook", description="How wheeled-legged robots decide and move.", allow_abbrev=False
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)

    run = commands.add_parser(
        "run", help="plan, control, simulate and draw on one terrain", allow_abbrev=False
    )
    run.set_defaults(command=_run)
    names = ", ".join(ground.BUILTIN_NAMES)
    experiments = ", ".join(omni.PREFIX + name for name in omni.NAMES)
    run.add_argument(
        "terrain",
        metavar="TERRAIN",
        nargs="?",
        help=f"{names}, or a terrain FILE.json; of part II {experiments}",
    )
    planning = run.add_argument_group("planning")
    planning.add_argument("--goal", type=goal, metavar="X,Y", help="where to go, metres (0.1 m ahead a slot)")
    planning.add_argument("--slots", type=whole(1), help="0.3 s swing slots (10)")
    planning.add_argument("--feet-only", action="store_true", default=None, help="plan without wheels")
    planning.add_argument(
        "--formulation", choices=("tight", "paper"), help="the program to search: tight, or the paper's big-M"
    )
    planning.add_argument("--gap", type=number(0.0, above=True), help="relative gap to prove (0.001)")
    planning.add_argument(
        "--time-limit", type=number(0.0, above=True), metavar="S", help="of the search (25 s)"
    )
    planning.add_argument(
        "--replan",
        action="store_true",
        default=None,
        help="plan ahead in windows while the robot moves, from where it is",
    )
    planning.add_argument(
        "--clock",
        choices=("budget", "wall"),
        help="with --replan: plans are there in time (budget), or when they are (wall)",
    )
    planning.add_argument("--plan", metavar="FILE", help="execute this plan file instead of planning")
    execution = run.add_argument_group("execution")
    execution.add_argument("--delay-ms", type=whole(0), default=9, help="torque delay (9 ms)")
    execution.add_argument(
        "--state",
        choices=("estimated", "true"),
        default="estimated",
        help="what the controller sees: the state it estimates from noisy sensors (default), or the true one",
    )
    execution.add_argument("--seed", type=whole(0), default=0, help="of everything random (0)")
    omni.add_to(run)
    output = run.add_argument_group("output")
    output.add_argument("--out", metavar="DIR", help="folder for the results (runs/TERRAIN)")
    output.add_argument("--json", action="store_true", help="print the metrics as JSON instead of a table")

    table2.add_to(commands)
    study.add_to(commands)
    paper.add_to(commands)
    book.add_to(commands)
    classroom.add_to(commands)
    equations.add_to(commands)

    lab = commands.add_parser("lab", help="open the notebooks in JupyterLab", allow_abbrev=False)
    lab.set_defaults(command=_lab)
    lab.epilog = "Other options are passed on to JupyterLab."
    return parser


def _run(arguments: argparse.Namespace) -> int:
    """Plan (or load a plan), execute, write the results and tell what happened."""
    if omni.asked_for(arguments.terrain):
        return omni.run(arguments, ("plan", *PLANNING))
    omni.refuse(arguments)
    plan = problem = None
    if arguments.plan is not None:
        plan = _given_plan(arguments)
    else:
        problem = _problem(arguments)
    name = (plan or problem).terrain.name
    target = arguments.out or Path("runs") / file_name(name)
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(result_folder(target, FILES))
        load("wfbook.receding", "wfbook.view.figures", "wfbook.view.replay")
        relaxed = None
        if problem is not None and arguments.replan:
            relaxed, plan, run = _replanned(problem, arguments)
        else:
            if plan is None:
                relaxed, plan = _planned(problem, arguments)
            run = _executed(plan, arguments)
        metrics = _write(folder.path, relaxed, plan, run)
        folder.publish()
    print(json.dumps(metrics, indent=1) if arguments.json else summary_table(metrics, folder.target))
    if metrics["fell"]:
        raise CommandError(f"the robot fell at {metrics['fall_time_s']:.2f} s", FAILED)
    return OK if metrics["upright"] else FAILED


def _given_plan(arguments: argparse.Namespace) -> "Plan":
    """Load the plan file of ``--plan``, which leaves no option of planning and no other terrain."""
    for option in PLANNING:
        if getattr(arguments, option) is not None:
            raise CommandError(f"--{option.replace('_', '-')} has no effect with --plan", WRONG_INPUT)
    load("wfbook.planner")
    from wfbook.planner import Plan

    with wrong_input():
        plan = Plan.load(arguments.plan)
        asked = arguments.terrain and ground.named_or_file(arguments.terrain)
    if asked and asked != plan.terrain:
        raise CommandError(
            f"plan file {arguments.plan!r} was made for terrain {plan.terrain.name!r}, "
            f"which is not {arguments.terrain!r}; leave TERRAIN out to take the plan's",
            WRONG_INPUT,
        )
    return plan


def _problem(arguments: argparse.Namespace) -> "Problem":
    if arguments.terrain is None:
        known = ", ".join(ground.BUILTIN_NAMES)
        text = f"TERRAIN is missing: one of {known}, a file ending in .json, or {omni.PREFIX}…"
        raise CommandError(text, WRONG_INPUT)
    with wrong_input():
        terrain = ground.named_or_file(arguments.terrain)
    unused = ("formulation", "time_limit") if arguments.replan else ("clock",)
    for option in unused:
        if getattr(arguments, option) is not None:
            how = "with" if arguments.replan else "without"
            raise CommandError(f"--{option.replace('_', '-')} has no effect {how} --replan", WRONG_INPUT)
    if arguments.replan and arguments.gap is None:
        arguments.gap = REPLAN_GAP
    for option, default in PLANNING.items():
        if getattr(arguments, option) is None:
            setattr(arguments, option, default)
    load("wfbook.planner")
    from wfbook.planner import Problem

    with wrong_input():
        return Problem(
            terrain,
            goal=arguments.goal or (GOAL_PER_SLOT * arguments.slots, 0.0),
            slots=arguments.slots,
            end_effectors=("foot",) if arguments.feet_only else ("foot", "wheel"),
        )


def _planned(problem: "Problem", arguments: argparse.Namespace) -> "tuple[Plan, Plan]":
    """Search for the best plan that can be executed.

    Returns:
        The relaxed plan and the polished one.
    """
    from wfbook import planner

    options = {"gap": arguments.gap, "time_limit": arguments.time_limit}
    with ProgressLine(sys.stderr) as line:
        options["progress"] = lambda now: line.show(f"planning {search_line(now)}")
        try:
            if problem.slots > LONG and arguments.formulation == "tight":
                return planner.solve_windows(problem, **options)
            return planner.solve_executable(problem, formulation=arguments.formulation, **options)
        except (planner.InfeasibleError, planner.NoPlanError) as error:
            raise CommandError(" ".join(str(error).split()), FAILED) from None


def _replanned(problem: "Problem", arguments: argparse.Namespace) -> "tuple[Plan, Plan, Run]":
    """Plan ahead while the robot moves.

    Returns:
        The relaxed plan and the polished one, as they were executed, and the run.
    """
    from wfbook import planner, receding

    with ProgressLine(sys.stderr) as line:
        line.show("planning the first window")
        try:
            run, relaxed, plan = receding.run(
                problem, gap=arguments.gap, clock=arguments.clock, **_execution(arguments, line)
            )
        except (planner.InfeasibleError, planner.NoPlanError) as error:
            raise CommandError(" ".join(str(error).split()), FAILED) from None
    return relaxed, plan, run


def _executed(plan: "Plan", arguments: argparse.Namespace) -> "Run":
    from wfbook import simulate

    # A plan from elsewhere may be well-formed and yet ask for what the robot can't do.
    given = wrong_input() if arguments.plan else contextlib.nullcontext()
    with given, ProgressLine(sys.stderr) as line:
        return simulate.run(plan, **_execution(arguments, line))


def _execution(arguments: argparse.Namespace, line: ProgressLine) -> dict[str, Any]:
    """Return the options of an execution."""
    return {
        "delay": arguments.delay_ms / 1000.0,
        "state": arguments.state,
        "seed": arguments.seed,
        "progress": lambda now, end: line.show(f"simulating {now:5.2f} of {end:.2f} s"),
    }


def _write(folder: Path, relaxed: "Plan | None", plan: "Plan", run: "Run") -> dict[str, Any]:
    """Write the results of a run.

    Returns:
        The metrics as they stand in ``metrics.json``.
    """
    from wfbook.view import figures, replay

    metrics = plain(run.metrics)
    if relaxed is not None:
        relaxed.save(folder / "plan_relaxed.npz")
    plan.save(folder / "plan.npz")
    run.save(folder / "run.npz")
    (folder / "metrics.json").write_text(json.dumps(metrics, indent=1, allow_nan=False) + "\n")
    (folder / "gait.png").write_bytes(figures.gait(plan).png())
    replay.save(run, folder / "replay.html")
    return metrics


def _lab(options: Sequence[str]) -> int:
    """Open the notebooks; ends when JupyterLab does."""
    notebooks = Path(__file__).parent.parent / "notebooks"
    if not notebooks.is_dir():
        raise CommandError(f"no notebooks at {str(notebooks)!r}: install with pip install -e .", FAILED)
    return subprocess.call([sys.executable, "-m", "jupyterlab", str(notebooks), *options])


def _end(*_: object) -> NoReturn:
    """Leave through the cleaning up that ``with`` does, which an unhandled SIGTERM would skip."""
    sys.exit(128 + signal.SIGTERM)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, _end)
    sys.exit(main())
