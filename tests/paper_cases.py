"""Plans and runs by hand for the comparison with the paper, so that no test waits for a search."""

import json
from dataclasses import dataclass, replace

import numpy as np
from view_cases import SLOT, small_plan

from wfbook.paper.bench import Bench, Execution, Planned
from wfbook.paper.drives import Drive
from wfbook.paper.options import Options
from wfbook.paper.record import Record
from wfbook.paper.store import Store
from wfbook.planner import Plan, Problem
from wfbook.table2.benchmark import ROWS, Benchmark
from wfbook.table2.trial import OUTCOME

LETTERS = {".": (0, 0), "o": (0, 1), "f": (1, 0), "w": (1, 1)}
"""What a leg does in a slot: stands on its foot or wheel, swings and lands on its foot or wheel."""


def plan_of(legs: list[str], regions: list[str] | None = None, advance: float = 0.5, **changes) -> Plan:
    """Return a plan with a gait: for each leg a letter a slot, and the regions it is in when slots end."""
    S, kind = (np.array([[LETTERS[letter][i] for letter in leg] for leg in legs]) for i in (0, 1))
    where = np.array([list(map(int, leg)) for leg in regions]) if regions else np.zeros_like(S)
    plan = replace(small_plan(S, kind, advance), **changes)
    known = {"regions": where.tolist(), "status": "time limit", "com_height": 0.265}
    if len(plan.terrain.regions) > 1:
        D = np.zeros((*S.shape, len(plan.terrain.regions), 2), np.int8)
        legs_, slots = np.indices(S.shape)
        D[legs_, slots, where, kind] = 1
        plan = replace(plan, D=D)
    return plan.with_meta(**known)


def answer(problem: Problem, advance: float) -> tuple[Plan, Plan]:
    """Return plans that a search might find: a step of FL, or all legs soon on wheels and FR down to stop."""
    J = problem.slots
    if "wheel" in problem.end_effectors:
        legs = ["w" + "o" * (J - 1), ".w" + "o" * (J - 5) + "f..", ".w" + "o" * (J - 2), "w" + "o" * (J - 1)]
    else:
        legs = ["f" + "." * (J - 1), *["." * J] * 3]
    plan = plan_of(legs, advance=advance, terrain=problem.terrain)
    return plan, plan.with_meta(stage="polished")


def execution(plan: Plan, seed: int, cost: float = 0.5, upright: bool = True) -> Execution:
    """Return what would be kept of a run of a plan that comes 1 cm a seed less far."""
    t = np.arange(-0.1, plan.t[-1] + 1.0, 0.01)
    x = np.interp(t, plan.t, plan.x[:, 0])
    distance = plan.distance - 0.01 * seed
    slot = np.clip((t / SLOT).astype(int), 0, plan.slots - 1)
    modes = np.where(plan.S == 1, 2, plan.end_effector).T[slot].astype(np.int8)
    work = np.column_stack((np.clip(t, 0, None), 0.5 * np.clip(t, 0, None)))
    metrics = {"distance_m": distance, "upright": upright, "cot_abs": cost, "cot_positive": 0.5 * cost}
    com = np.column_stack((x, 0 * x, 0 * x + 0.265))
    return Execution(t, com, modes, work, metrics, {"seed": seed, "state": "true", "delay": 0.009})


REACH = {("foot",): 1.5, ("foot", "wheel"): 3.0}
"""How far invented plans go, by end effectors."""


@dataclass
class Invented(Bench):
    """A bench whose plans, runs and times are invented: feet cost 0.6, wheels 0.2, with friction 0.3.

    In part II the hand wobbles by 1 mm; by 2 and 50 mm when the arm alone carries it.
    """

    def plan(self, problem, label):
        self.show(self.head + label)
        kinds = tuple(problem.end_effectors)
        plans = answer(problem, REACH[kinds] if problem.beyond_reach else problem.goal[0])
        return Planned(*(plan.with_meta(gap=0.02, status="time limit") for plan in plans))

    def execute(self, plan, label, hold=1.0):
        rolls = plan.end_effector.any()
        cost = (0.3 if plan.terrain.name == "flat-friction" else 0.2) if rolls else 0.6
        return [execution(plan, seed, cost) for seed in range(self.options.seeds)]

    def time(self, asked, label):
        return outcome(0.1 * asked.slots * len(asked.end_effectors) * len(asked.terrain.regions))

    def drive(self, name, label, seeds=None, **options):
        self.show(self.head + label)
        wobble = {"ik-level": 0.05, "ik-true": 0.002}.get(options.get("controller"), 0.001)
        seeds = self.options.seeds if seeds is None else min(seeds, self.options.seeds)
        return [drive(seed, wobble, options.get("controller", "ddp")) for seed in range(seeds)]

    def solve(self, label):
        return {
            **{"cold": [90.0, 100.0, 120.0], "cold_iterations": 3, "cold_far": 900.0},
            **{"cold_far_iterations": 14, "warm": [2.0, 3.0, 4.0], "states": 41, "precision": 1e-4},
        }


def drive(seed: int = 0, wobble: float = 0.001, controller: str = "ddp") -> Drive:
    """Return what would be kept of a run of part II whose hand wobbles, in metres, a tenth more a seed.

    The base turns by 1.8 rad and back, the trunk goes down by 0.1 m and up again, wheels go 5 cm both ways.
    """
    t = np.arange(0.0, 4.0, 0.02)
    wave, hump = np.sin(2 * np.pi * t), np.sin(np.pi * t / 4.0)
    size = wobble * (1 + 0.1 * seed)
    hand = np.column_stack((0.5 + 0 * t, 0.5 * size * wave, 0.92 + size * wave))
    rpy = np.array([-np.pi / 2, 0.0, -np.pi / 2]) + 2.0 * size * np.column_stack((wave, 0 * t, -wave))
    base = rpy + np.outer(1.8 * hump, [0.0, 0.0, -1.0])
    legs = np.tile([0.8, -1.6], 4) + 0.1 * np.outer(wave, np.tile([1.0, -1.0], 4))
    metrics = {
        "hand_height_mean_m": float(hand[:, 2].mean()),
        "hand_height_std_m": float(hand[:, 2].std()),
        "hand_height_max_error_m": size,
        "hand_level_max_error_m": 0.5 * size,
        "hand_turn_max_rad": 3.0 * size,
        "base_rms_rad": 0.01,
        "finished": True,
        "events": [],
    }
    for axis, name in enumerate(("roll", "pitch", "yaw")):
        metrics[f"hand_{name}_mean_rad"] = float(rpy[:, axis].mean())
        metrics[f"hand_{name}_std_rad"] = float(rpy[:, axis].std())
    metrics |= {f"plan_ms_{name}": value for name, value in (("p5", 4.0), ("median", 5.0), ("p95", 6.0))}
    meta = {"seed": seed, "controller": controller, "noise": True, "delay": 0.009}
    return Drive(
        t=t,
        hand=hand,
        hand_ref=np.tile([0.5, 0.0, 0.92], (len(t), 1)),
        rpy=rpy,
        base_rpy=base,
        base_rpy_ref=base,
        trunk=np.column_stack((3.0 * t - 0.5, 0 * t, 0.53 - 0.1 * hump)),
        yaw=1.8 * hump,
        legs=legs,
        legs_ref=legs + 0.01,
        wheels=np.tile(0.05 * wave[:, None], 4),
        arm_margin=0.3 + 0 * t,
        metrics=metrics,
        meta=meta | {"course": [[2.0, [0.0, 0.0, 0.9]], [2.0, [0.0, 0.0, -0.9]]]},
    )


def outcome(search_s, status="optimal", gap=1e-3, message=None):
    """What a timed search might find."""
    found = {"status": status, "search_s": search_s, "gap": gap, "message": message}
    return dict.fromkeys(OUTCOME) | found


def invented(tmp_path, **options) -> Invented:
    return Invented(Store(tmp_path / "cache", "stamp"), Options(**options))


def by_key(result) -> dict[str, Record]:
    """A result's records by the paper's key, else by what they are."""
    return {record.paper or record.what: record for record in result.records}


def report_file(folder, complete=True, **first):
    """A report as ``table2`` leaves it."""
    report = Benchmark(ROWS, ()).report | {"complete": complete}
    for row in report["rows"]:
        row["tight"] = outcome(2.0)
    report["rows"][0] |= first
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "table2.json").write_text(json.dumps(report))
    return folder / "table2.json"
