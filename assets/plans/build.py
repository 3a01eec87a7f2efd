"""Make the stored plans again: those that take longer to find than a reader waits.

    python assets/plans/build.py NAME... | --all [--time-limit S] [--out FOLDER]
    python assets/plans/build.py --list

writes ``NAME_relaxed.npz`` and ``NAME.npz`` beside this script and brings the list in ``assets/README.md``
up to date; ``--list`` does the latter alone. Searches end at a gap of 0.1 % or at their time limit: what a
limit stopped is another plan, of another gap, on another machine. ``long`` and ``long-friction`` go as far as
the stored ``long-feet`` went: make them again after it.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from wfbook import planner
from wfbook import terrain as ground
from wfbook.modes import END_EFFECTORS
from wfbook.paper import speed, transport
from wfbook.paper.bench import LONG
from wfbook.planner import Plan, Problem
from wfbook.planner.stored import PLANS, stored
from wfbook.report import ProgressLine, percent, search_line

README = PLANS.parent / "README.md"
GAP = 1e-3


@dataclass(frozen=True)
class Recipe:
    """How a plan is found.

    Attributes:
        says: what the problem is, for the list.
        problem: states it; called when it is needed, for some goals are where another plan ended.
        time_limit: of the search, in seconds.
    """

    says: str
    problem: Callable[[], Problem]
    time_limit: float


def _short(terrain: str, kinds: Sequence[str] = END_EFFECTORS) -> Recipe:
    """What ``python -m wfbook run TERRAIN`` plans."""
    on = "on feet" if len(kinds) == 1 else "on feet and wheels"
    says = f"one metre in ten slots {on}, `{terrain}`"
    return Recipe(says, lambda: Problem(ground.builtin(terrain), end_effectors=kinds), 40.0)


def _far(case: str) -> Recipe:
    says = f"paper A, IV-B: as far as possible in {speed.SLOTS} slots, {speed.CASES[case][0]}"
    return Recipe(says, lambda: speed.problem(case), 90.0)


def _long(case: str) -> Recipe:
    """The feet's goal is the paper's; wheels are sent to where the feet ended."""
    says = f"paper A, IV-C: {transport.SLOTS} slots, {transport.CASES[case][0]}"
    if case == "feet":
        return Recipe(says, lambda: transport.problem(case), 60.0)
    return Recipe(says, lambda: transport.problem(case, stored("long-feet").distance), 60.0)


RECIPES = {
    "flat": _short("flat"),
    "flat-feet": _short("flat", ("foot",)),
    "flat-friction": _short("flat-friction"),
    "ramp-down": _short("ramp-down"),
    "ramp-up": _short("ramp-up"),
    "stepping-stones": _short("stepping-stones"),
    "far-feet": _far("feet"),
    "far": _far("both"),
    "far-friction": _far("friction"),
    "long-feet": _long("feet"),
    "long": _long("both"),
    "long-friction": _long("both, friction"),
}
"""By name, in an order in which each finds what it needs."""


def make(name: str, time_limit: float | None = None) -> tuple[Plan, Plan]:
    """Plan.

    Args:
        name: one of ``RECIPES``.
        time_limit: instead of the recipe's.

    Returns:
        The relaxed plan and the polished one.
    """
    recipe = RECIPES[name]
    problem = recipe.problem()
    search = planner.solve_windows if problem.slots > LONG else planner.solve_executable
    with ProgressLine(sys.stderr) as line:
        return search(
            problem,
            gap=GAP,
            time_limit=recipe.time_limit if time_limit is None else time_limit,
            progress=lambda now: line.show(f"{name}: planning {search_line(now)}"),
        )


def build(names: Sequence[str], folder: Path, time_limit: float | None = None) -> None:
    """Make plans and write them.

    Raises:
        KeyboardInterrupt: interrupted; what was found so far is not written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        relaxed, polished = make(name, time_limit)
        if relaxed.meta["status"] == "interrupted":
            raise KeyboardInterrupt
        relaxed.save(folder / f"{name}_relaxed.npz")
        polished.save(folder / f"{name}.npz")
        meta = polished.meta
        print(f"{name}: {meta['status']}, gap {percent(meta['gap'])}, {meta['solve_time']:.1f} s")


def rows() -> list[str]:
    """Return the lines of the list in ``assets/README.md``."""
    lines = ["| name | problem | gap | command |", "|---|---|---|---|"]
    for name, recipe in RECIPES.items():
        gap = percent(stored(name).meta["gap"])
        lines.append(f"| `{name}` | {recipe.says} | {gap} | `python assets/plans/build.py {name}` |")
    return lines


def listed(text: str) -> str:
    """Return the text of ``assets/README.md`` with the list as it has to be."""
    lines, new = text.splitlines(), rows()
    first = lines.index(new[0])
    after = next((i for i in range(first, len(lines)) if not lines[i].startswith("|")), len(lines))
    return "\n".join([*lines[:first], *new, *lines[after:]]) + "\n"


def main() -> None:
    """Read the command line and do it."""
    parser = argparse.ArgumentParser(description="Make the stored plans again.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(RECIPES))
    parser.add_argument("--all", action="store_true", help="all of them, about ten minutes")
    parser.add_argument(
        "--list", action="store_true", help="only bring the list in assets/README.md up to date"
    )
    parser.add_argument("--time-limit", type=float, metavar="S", help="of each search, instead of its own")
    parser.add_argument("--out", type=Path, default=PLANS, metavar="FOLDER", help="where to write (here)")
    arguments = parser.parse_args()
    if bool(arguments.names) + arguments.all + arguments.list != 1:
        parser.error("say NAME..., --all or --list")
    if unknown := [name for name in arguments.names if name not in RECIPES]:
        parser.error(f"no stored plan is called {', '.join(unknown)}; there are {', '.join(RECIPES)}")
    if not arguments.list:
        build(list(RECIPES) if arguments.all else arguments.names, arguments.out, arguments.time_limit)
    if arguments.out == PLANS:
        README.write_text(listed(README.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("interrupted: the plan in work was not written")
