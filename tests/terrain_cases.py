"""Random terrain files, valid and broken, and planning problems on the valid ones.

The valid ones run from an everyday ramp to ground that no plan can start on. Everything comes from the
generator that is handed in, so that a case is known by its seed.
"""

import json
import math
from typing import Any, NamedTuple

import numpy as np
import plan_checker
from plan_reading import Plane

from wfbook.planner import InfeasibleError, NoPlanError, Problem, solve
from wfbook.terrain import Terrain

STEEPEST = math.tan(math.radians(20))
# Outlines in a square of side 2 about the origin, counter-clockwise.
OUTLINES = (
    [(-1, -1), (1, -1), (1, 1), (-1, 1)],
    [(-1, -1), (1, -0.6), (1, 0.7), (-1, 1)],
    [(-1, -1), (1, -0.2), (-0.4, 1)],
    [(-1, -0.3), (-0.4, -1), (0.5, -1), (1, 0.1), (0.4, 1), (-0.6, 0.9)],
)
NO_NUMBERS = (math.nan, math.inf, -math.inf, 10**400, "0.1", True, None, [0.1], {})
ODDITIES = ("wide gap", "tiny stones", "short start", "narrow start", "leaning start", "start on two levels")


def random_terrain(rng: np.random.Generator) -> dict[str, Any]:
    """A valid terrain file: a platform to start on, then strips and stones along x, 1 to 5 regions in all.

    One in five has an oddity that its name tells: a gap of 1 m, stones of some centimetres, or a start
    platform that legs stand beside, that leans, or that has two levels.
    """
    oddity = str(rng.choice(ODDITIES)) if rng.random() < 0.2 else ""
    count = rng.integers(1, 6)
    pieces, x, z = _start(rng, oddity)
    while len(pieces) < count:
        if not oddity and rng.random() < 0.5:
            piece, x, z = _strip(rng, x, z)
            pieces.append((piece, "deck" if rng.random() < 0.7 else f"strip {len(pieces)}"))
            continue
        x += 1.0 if oddity == "wide gap" else rng.choice([0.0, rng.uniform(0.0, 0.4)])
        z += rng.uniform(-0.08, 0.08)
        half = rng.uniform(0.01, 0.03, 2) if oddity == "tiny stones" else rng.uniform((0.08, 0.1), (0.3, 0.6))
        sides = [0.0]
        if half[1] < 0.3 and len(pieces) + 1 < count:
            # One for the left legs and one for the right.
            half[1] = min(half[1], 0.1)
            sides = [-rng.uniform(half[1], 0.2), rng.uniform(half[1], 0.2)]
        for side in sides:
            # A stone in the deck's group is not what groups are for, but no file is refused for it.
            group = "deck" if rng.random() < 0.1 else f"stone {len(pieces)}"
            pieces.append((_stone(rng, (x + half[0], side, z), half), group))
        x += 2 * half[0]
    return {
        "name": f"random {rng.integers(10**6)} {oddity}".strip(),
        "regions": [_region(rng, vertices, group) for vertices, group in pieces],
    }


def _start(rng: np.random.Generator, oddity: str) -> tuple[list[tuple[np.ndarray, str]], float, float]:
    """What is under the start posture, where it ends, and its height there."""
    end = 0.1 if oddity == "short start" else rng.uniform(0.3, 0.6)
    half = rng.uniform(0.05, 0.15) if oddity == "narrow start" else rng.uniform(0.4, 0.8)
    z = rng.choice([0.0, rng.uniform(-0.5, 0.5)])
    slope = rng.uniform(-0.2, 0.2) if oddity == "leaning start" else 0.0
    back, cut = rng.uniform(-1.2, -0.6), rng.choice([0.0, rng.uniform(0.02, 0.25)])
    edge = 0.1 if oddity == "start on two levels" else end
    outline = [(edge, -half), (edge, half), (back + cut, half), (back, 0.8 * half), (back, -0.8 * half)]
    if cut:
        outline.append((back + cut, -half))
    else:
        outline[2:] = [(back, half), (back, -half)]
    pieces = [(np.array([(x, y, z + slope * x) for x, y in outline]), "deck")]
    if edge < end:
        z += rng.uniform(-0.1, 0.1)
        pieces.append(
            (np.array([(x, y, z) for x in (edge, end) for y in (-half, half)])[[0, 2, 3, 1]], "front")
        )
    return pieces, end, z + slope * end


def _strip(rng: np.random.Generator, x: float, z: float) -> tuple[np.ndarray, float, float]:
    """A slope along x that joins what ends there, and its own end and height."""
    length, (near, far) = rng.uniform(0.2, 0.8), rng.uniform(0.3, 0.8, 2)
    top = z + length * STEEPEST * rng.choice([0.0, rng.uniform(-1, 1)])
    corners = [(x, -near, z), (x + length, -far, top), (x + length, far, top), (x, near, z)]
    return np.array(corners), x + length, top


def _stone(rng: np.random.Generator, centre: tuple[float, float, float], half: np.ndarray) -> np.ndarray:
    """A polygon that leans any way: a stone for some legs, or a tilted strip for all."""
    mirror = rng.choice([-1, 1], 2)
    flat = np.array(OUTLINES[rng.integers(len(OUTLINES))]) * mirror * half
    heading, lean = rng.uniform(0, 2 * np.pi), STEEPEST * rng.choice([0.0, rng.uniform(0, 1)])
    slope = lean * np.array([np.cos(heading), np.sin(heading)])
    return (np.column_stack((flat, flat @ slope)) + centre)[:: mirror.prod()]


def _region(rng: np.random.Generator, vertices: np.ndarray, group: str) -> dict[str, Any]:
    return {
        "vertices": vertices.tolist(),
        "mu_foot": rng.uniform(0.3, 0.9),
        "mu_wheel": 0.0,
        "mu_wheel_lateral": rng.uniform(0.3, 0.9),
        "rolling_resistance": float(rng.choice([0.0, rng.uniform(0, 0.02)])),
        "group": group,
    }


def _bad_vertices(rng: np.random.Generator, v: list) -> Any:
    """Vertices that are wrong in one way."""
    i = int(rng.integers(len(v)))
    square = [[0.0, 0.0, 0.1], [1.0, 0.0, 0.1], [1.0, 0.5, 0.1], [0.0, 0.5, 0.1]]
    along, away = rng.uniform(0.2, 0.8), rng.uniform(0.02, 1.0)
    wrong = [
        v[::-1],
        v[: rng.integers(3)],
        [[x, 0.2, z + y] for x, y, z in square],
        [*square[:2], [1.0, 0.5, 0.1 + away], square[3]],
        [*square[:2], [along * 0.9, 0.45 * (1 - along), 0.1], square[3]],
        [square[0], square[2], square[1], square[3]],
        [[0.0, 0.0, z] for z in (0.0, away)] + [[0.0, 0.0, 2 * away]],
        [*v, v[i]],
        [*v[:i], v[i][:2], *v[i + 1 :]],
        [*v[:i], [*v[i], 0.0], *v[i + 1 :]],
        [*v[:i], {"x": v[i][0], "y": v[i][1], "z": v[i][2]}, *v[i + 1 :]],
        json.dumps(v),
        {str(n): vertex for n, vertex in enumerate(v)},
        None,
    ]
    at = int(rng.integers(3))
    for number in (1e7, *NO_NUMBERS):
        wrong.append([*v[:i], [*v[i][:at], number, *v[i][at + 1 :]], *v[i + 1 :]])
    return _one_of(rng, wrong)


def broken_terrain(rng: np.random.Generator) -> tuple[str, str]:
    """A terrain file with one defect.

    Returns:
        The file's text, and what the error must name: the field, after "region i: " where it is in one; of
        what is no JSON "not JSON".
    """
    data = random_terrain(rng)
    i = int(rng.integers(len(data["regions"])))
    holder, where = (data, "") if rng.random() < 0.3 else (data["regions"][i], f"region {i}: ")
    field = str(rng.choice(list(holder)))
    defect = rng.choice(
        ["missing", "unknown", "twice", "not JSON", "value", "vertices"], p=[0.1] * 4 + [0.3] * 2
    )
    if defect == "missing":
        del holder[field]
    elif defect == "unknown":
        field = str(rng.choice(["colour", "Name", "mu", "Vertices", "scale"]))
        holder[field] = rng.uniform()
    elif defect == "twice":
        # Under another name first: a dict holds no key twice.
        holder["<twice>"] = holder[field]
        return json.dumps(data).replace('"<twice>"', json.dumps(field)), where + field
    elif defect == "not JSON":
        text = json.dumps(data)
        cut = text[: rng.integers(len(text))]
        return _one_of(rng, [cut, text.replace(",", ",,", 1), text.replace('"', "'"), text + "]"]), "not JSON"
    else:
        if defect == "vertices":
            holder, where, field = data["regions"][i], f"region {i}: ", "vertices"
        holder[field] = _bad_value(rng, field, holder[field])
    return json.dumps(data), where + field


def _bad_value(rng: np.random.Generator, field: str, value: Any) -> Any:
    if field == "vertices":
        return _bad_vertices(rng, value)
    if field in ("name", "group"):
        return _one_of(rng, ["", "  ", "two\nlines", 7, None, True, ["deck"]])
    if field == "regions":
        return _one_of(rng, [[], {}, "ground", None, 3, {"0": value[0]}])
    return _one_of(rng, [-rng.uniform(1e-9, 1), *NO_NUMBERS])


def _one_of(rng: np.random.Generator, choices: list) -> Any:
    return choices[rng.integers(len(choices))]


class Attempt(NamedTuple):
    """What came of planning: "planned", "infeasible" or "no answer", and what is wrong with that."""

    outcome: str
    complaints: list[str]


def random_problem(rng: np.random.Generator, slots: int) -> Problem:
    """A short problem on a random terrain, every other one with wheels."""
    terrain = Terrain.from_dict(random_terrain(rng))
    goal = (rng.uniform(0.0, 0.1) * slots, rng.uniform(-0.05, 0.05))
    kinds = ("foot", "wheel") if rng.random() < 0.5 else ("foot",)
    return Problem(terrain, goal=goal, slots=slots, end_effectors=kinds)


def attempt(problem: Problem, gap: float, time_limit: float) -> Attempt:
    """Plan, and judge the answer: by the checker, and by what the start posture stands on."""
    start = ground_at_start(problem)
    try:
        plan = solve(problem, gap=gap, time_limit=time_limit)
    except NoPlanError:
        return Attempt("no answer", [])
    except InfeasibleError as error:
        complaints = []
        if start == "level":
            complaints.append(f"to stand still is a plan: {error}")
        if start == "none" and not any(leg in str(error) for leg in plan_checker.LEGS):
            complaints.append(f"does not name the leg over no region: {error}")
        return Attempt("infeasible", complaints)
    violations, _ = plan_checker.check(plan)
    complaints = [str(violation) for violation in violations]
    return Attempt("planned", complaints + ["a leg starts over no region"] * (start == "none"))


def ground_at_start(problem: Problem) -> str:
    """Of the ground under the legs: "none" under one of them, "level" under all, or "uneven".

    Where it is level the robot can stand still, whatever lies around.
    """
    planes = [Plane(region) for region in problem.terrain.to_dict()["regions"]]
    tops = set()
    for x, y in problem.start_contacts:
        deep = np.array([x, y, -1e3])
        rise, plane = max(((plane.over(deep, 0.0), plane) for plane in planes), key=lambda pair: pair[0])
        if rise == 0.0:
            return "none"
        tops.add((round(rise, 9), plane.n[2] > 1.0 - 1e-12))
    return "level" if len(tops) == 1 and tops.pop()[1] else "uneven"
