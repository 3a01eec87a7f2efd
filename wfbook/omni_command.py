"""``python -m wfbook run omni-…``: paper B's experiments, simulated, written, told and drawn.

Nothing is planned by a mixed-integer program here, so there are no plan files, and no option of planning has
an effect.
"""

import argparse
import difflib
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wfbook.arguments import FAILED, OK, WRONG_INPUT, CommandError, load, number, result_folder, whole
from wfbook.report import ProgressLine, plain

if TYPE_CHECKING:
    from wfbook.omni.scenarios import Scenario
    from wfbook.omni.simulate import OmniRun

PREFIX = "omni-"
NAMES = ("waves", "fixed", "straight", "crab", "rotate", "pivot", "combined", "turn", "squat")
"""Of the scenarios that :mod:`wfbook.omni.scenarios` lists."""

FILES = ("run.npz", "metrics.json", "gait.png", "replay.html")
PLANNED = ("status", "objective", "bound", "gap", "solve_time_s", "nodes")
ESTIMATED = ("estimate_drift_percent", "estimate_velocity_rms_m_s")
"""Metrics of part I that mean nothing here: there is neither a plan nor an estimator. They are null."""

OPTIONS = ("controller", "waves", "speed", "payload", "trunk_scale")
"""Options of part II alone; a scenario's own go by other names in the library."""
_OWN = {"waves": "count", "speed": "speed"}
MOST_WAVES = 20
"""More are steeper than friction carries."""
_SPEEDS = (0.05, 2.0)
"""Slower takes for ever, m/s; faster the paper does not go."""


def add_to(parser: argparse.ArgumentParser) -> None:
    """Add the options of part II to those of ``run``."""
    group = parser.add_argument_group(
        "part II (omni-…)",
        "Without planning: no plan files are written, options of planning are refused, --delay-ms is the age "
        "of what is measured, and --state estimated is measured with noise.",
    )
    group.add_argument(
        "--controller",
        choices=("ddp", "ik-level", "ik-true"),
        help="the paper's (ddp), or inverse kinematics of the arm over a trunk that it takes to be level, "
        "or whose pose it knows",
    )
    group.add_argument("--waves", type=whole(1), help="of omni-waves, on 11.5 m (5)")
    group.add_argument(
        "--speed",
        type=number(_SPEEDS[0]),
        metavar="M/S",
        help="of omni-waves, -straight and -crab (0.5) and -pivot (0.25)",
    )
    group.add_argument(
        "--payload",
        type=number(0.0),
        metavar="KG",
        help="in the hand; the controller does not know of it (0)",
    )
    group.add_argument(
        "--trunk-scale",
        type=number(0.0, above=True),
        metavar="X",
        help="true mass of the trunk over what is believed (1)",
    )


def asked_for(name: str | None) -> bool:
    """Whether what is to be run is an experiment of part II; a terrain file may be called anything."""
    return name is not None and name.startswith(PREFIX) and not name.lower().endswith(".json")


def refuse(arguments: argparse.Namespace) -> None:
    """Refuse options of part II where something else is run.

    Raises:
        CommandError: one of them is set.
    """
    for option in OPTIONS:
        if getattr(arguments, option) is not None:
            raise CommandError(f"--{option.replace('_', '-')} has no effect without {PREFIX}…", WRONG_INPUT)


def run(arguments: argparse.Namespace, planning: tuple[str, ...]) -> int:
    """Simulate a scenario, write the results and tell what happened.

    Args:
        arguments: of ``run``.
        planning: names of the options that have no effect here.

    Returns:
        0 if the robot stayed up and came to the end.

    Raises:
        CommandError: wrong input, or the run ended early.
    """
    name = arguments.terrain.removeprefix(PREFIX)
    if name not in NAMES:
        close = difflib.get_close_matches(name, NAMES, n=1)
        hint = f"did you mean {PREFIX + close[0]!r}? " if close else ""
        known = ", ".join(PREFIX + known for known in NAMES)
        raise CommandError(f"unknown experiment {arguments.terrain!r}: {hint}known are {known}", WRONG_INPUT)
    for option in planning:
        if getattr(arguments, option) is not None:
            text = f"--{option.replace('_', '-')} has no effect with {PREFIX + name}: nothing is planned"
            raise CommandError(text, WRONG_INPUT)
    if arguments.waves is not None and arguments.waves > MOST_WAVES:
        raise CommandError(f"--waves: must be at most {MOST_WAVES}, is {arguments.waves}", WRONG_INPUT)
    if arguments.speed is not None and arguments.speed > _SPEEDS[1]:
        raise CommandError(f"--speed: must be at most {_SPEEDS[1]:g}, is {arguments.speed:g}", WRONG_INPUT)
    load("wfbook.omni.scenarios")
    from wfbook.omni.scenarios import SCENARIOS

    scenario = SCENARIOS[name]
    for option, own in _OWN.items():
        if getattr(arguments, option) is not None and own not in scenario.options:
            raise CommandError(f"--{option} has no effect with {PREFIX + name}", WRONG_INPUT)
    with result_folder(arguments.out or Path("runs") / f"{PREFIX}{name}", FILES) as folder:
        load("wfbook.view.omni", "wfbook.view.replay")
        with ProgressLine(sys.stderr) as line:
            done = _simulated(scenario, arguments, line)
        metrics = _write(folder.path, scenario, done)
        folder.publish()
    print(json.dumps(metrics, indent=1) if arguments.json else table(metrics, folder.target))
    if done.events:
        when, what = done.events[0]
        raise CommandError(f"at {when:.2f} s: {what}", FAILED)
    return OK


def _simulated(scenario: "Scenario", arguments: argparse.Namespace, line: ProgressLine) -> "OmniRun":
    from wfbook.omni.simulate import Noise

    options: dict[str, Any] = {
        own: getattr(arguments, option)
        for option, own in _OWN.items()
        if getattr(arguments, option) is not None
    }
    return scenario.run(
        **options,
        controller=arguments.controller or "ddp",
        delay=arguments.delay_ms / 1000.0,
        noise=Noise() if arguments.state == "estimated" else None,
        seed=arguments.seed,
        payload=arguments.payload or 0.0,
        trunk_mass_scale=arguments.trunk_scale or 1.0,
        progress=lambda now, end: line.show(f"simulating {now:5.2f} of {end:.2f} s"),
    )


def metrics_of(scenario: "Scenario", done: "OmniRun") -> dict[str, Any]:
    """Return what ``metrics.json`` holds, in JSON's types; those without a meaning here are null."""
    given = ("controller", "delay", "noise", "seed", "payload", "payload_estimate", "trunk_mass_scale")
    return plain(
        {
            "experiment": f"{PREFIX}{scenario.name}",
            "title": scenario.title,
            "where": scenario.where,
            "terrain": done.terrain.name,
            "end_effectors": ["wheel"],
            **dict.fromkeys((*PLANNED, *ESTIMATED)),
            **done.metrics,
            **{name: done.meta[name] for name in given},
        }
    )


def _write(folder: Path, scenario: "Scenario", done: "OmniRun") -> dict[str, Any]:
    """Write the results of a run; return the metrics as they stand in ``metrics.json``."""
    from wfbook.view import omni, replay

    metrics, title = metrics_of(scenario, done), f"{PREFIX}{scenario.name}: {scenario.title}"
    done.save(folder / "run.npz")
    (folder / "metrics.json").write_text(json.dumps(metrics, indent=1, allow_nan=False) + "\n")
    (folder / "gait.png").write_bytes(omni.gait(done, title).png())
    replay.save(done, folder / "replay.html", title)
    return metrics


def table(metrics: dict[str, Any], folder: Path) -> str:
    """Return the summary that is printed at the end.

    Args:
        metrics: as :func:`metrics_of` has them.
        folder: where the results are.
    """

    def shown(what: str, scale: float = 1.0, form: str = ".3f") -> str:
        values = (scale * metrics[f"hand_{name}_{what}_rad"] for name in ("roll", "pitch", "yaw"))
        return ", ".join(format(round(value, 3) + 0.0, form) for value in values)  # + 0.0: no "-0.000"

    cost = "none, it stays where it is"
    if metrics["cot_abs"] is not None:
        cost = f"{metrics['cot_abs']:.3f}, of positive work alone {metrics['cot_positive']:.3f}"
    noise = ", with noise" if metrics["noise"] else ""
    rows = {
        "experiment": f"{metrics['experiment']}: {metrics['title']} ({metrics['where']})",
        "controller": f"{metrics['controller']}, measures {1e3 * metrics['delay']:g} ms late{noise}",
        "moved": f"{metrics['way_m']:.3f} m in {metrics['duration_s']:.2f} s, "
        f"{metrics['speed_m_s']:.2f} m/s, {metrics['swings']} swings",
        "hand, height": f"{metrics['hand_height_mean_m']:.4f} m on average, "
        f"std {1e3 * metrics['hand_height_std_m']:.2f} mm, "
        f"error at most {1e3 * metrics['hand_height_max_error_m']:.2f} mm",
        "hand, roll pitch yaw": f"{shown('mean')} rad on average, "
        f"error at most {shown('max_error', 1e3, '.1f')} mrad",
        "cost of transport": cost,
        "body error, rms": f"{1e3 * metrics['base_rms_m']:.1f} mm, "
        f"{math.degrees(metrics['base_rms_rad']):.2f} degrees",
        "slip, at most": f"{1e3 * metrics['slip_max_m']:.1f} mm",
        "payload": f"{metrics['payload']:g} kg, weighed as {metrics['payload_estimate'] or 0.0:.2f} kg",
        "control tick": f"{metrics['tick_ms_median']:.2f} ms median, {metrics['tick_ms_p99']:.2f} ms p99; "
        f"that solves {metrics['plan_ms_median']:.2f} ms median",
        "real-time factor": f"{metrics['real_time_factor']:.2f}",
        "upright": "yes" if metrics["upright"] else "no",
        "results": str(folder),
    }
    if metrics["payload_estimate"] is None:  # inverse kinematics weighs nothing and solves nothing
        rows["payload"] = f"{metrics['payload']:g} kg"
        rows["control tick"] = rows["control tick"].split(";")[0]
    if not metrics["payload"]:
        del rows["payload"]
    return "\n".join(f"{label:21} {text}" for label, text in rows.items())
