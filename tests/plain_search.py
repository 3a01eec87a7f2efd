"""A branch and bound without any shortcut, random small problems for it, and its verdict on the planner.

It shares with the planner's search only the tight program and the solver of convex programs: it relaxes
every discrete variable to [0, 1], solves the whole second-order cone program, and fixes the most
fractional variable at 0 and at 1, depth first; those that say which legs swing go before others, slot by
slot. It knows no QP bound, no symmetry, no propagation, no templates and no rule for crossings; its plans
come from relaxations that happen to be integral. Told only what the planner's plan costs, it must find one
as cheap or prove what the planner missed.
"""

import time
from dataclasses import dataclass, field

import numpy as np

from wfbook.centroidal import Robot
from wfbook.planner import InfeasibleError, NoPlanError, Problem, solve, tight
from wfbook.planner.conic import Conic, Solution
from wfbook.planner.presolve import solve_fixed
from wfbook.planner.problem import Weights
from wfbook.terrain import Region, Terrain

GAP = 1e-3
CLOSE = 1e-4
"""Relative difference that the other search does not resolve."""
EXACT = 1e-6
"""Relative difference that the solver of convex programs leaves."""

_INTEGRAL = 1e-5
_PATIENCE = 300.0  # seconds for the planner; it must not be what ends first


@dataclass
class PlainSearch:
    """Depth-first branch and bound over the discrete variables of the tight program.

    Attributes:
        problem: what is asked.
        value: cost of the best plan; until one is found, the most that a plan may cost.
        found: whether there is a plan of that cost.
        nodes: relaxations solved so far.
        unclear: points at which neither a cost nor infeasibility could be computed.
    """

    problem: Problem
    value: float = np.inf
    found: bool = False
    nodes: int = 0
    unclear: int = 0
    _conic: Conic = field(init=False)
    _columns: np.ndarray = field(init=False)
    _turn: np.ndarray = field(init=False)

    def __post_init__(self):
        program = tight.build(self.problem)
        self._conic = Conic.compile(program.cost, program.rows())
        columns, turns = [], []
        for key, variable in program.discrete.items():
            columns.append(self._conic.columns(variable).ravel())
            kind = 0 if key == "pattern" else 2 if key[0].startswith("passing") else 1
            slot = np.broadcast_to(np.arange(self.problem.slots), variable.shape)
            turns.append(kind * self.problem.slots + slot.ravel())
        self._columns, self._turn = np.concatenate(columns), np.concatenate(turns)

    def run(self, time_limit: float) -> bool:
        """Search until nothing is open; False if the time limit, in seconds of the processor, comes first."""
        stack, deadline = [np.full(len(self._columns), np.nan)], time.process_time() + time_limit
        while stack:
            if time.process_time() > deadline:
                return False
            stack += self._open(stack.pop())
        return True

    def _open(self, fixed: np.ndarray) -> list[np.ndarray]:
        """Bound a node; return its children, the one to be opened first last."""
        relaxed, free = self._solve(fixed), np.isnan(fixed)
        if self._closed(relaxed):
            return []
        z = np.clip(np.nan_to_num(relaxed.y[self._columns], nan=0.5), 0.0, 1.0)
        distance = np.where(free, np.abs(z - np.rint(z)), -1.0)
        at = self._most_fractional(distance)
        if distance[at] < _INTEGRAL:
            whole = self._solve(np.rint(z)) if free.any() else relaxed
            if whole.status == "solved" and whole.value <= self.value:
                self.value, self.found = whole.value, True
            if not free.any():
                self.unclear += relaxed.status != "solved"
                return []
            if self._closed(relaxed):
                return []
        children = [fixed.copy(), fixed.copy()]
        nearest = np.rint(z[at])
        children[0][at], children[1][at] = 1.0 - nearest, nearest
        return children

    def _most_fractional(self, distance: np.ndarray) -> int:
        """Return the most fractional of the variables whose turn it is."""
        fractional = distance > _INTEGRAL
        if fractional.any():
            distance = np.where(self._turn == self._turn[fractional].min(), distance, -1.0)
        return int(np.argmax(distance))

    def _closed(self, relaxed: Solution) -> bool:
        """Tell whether nothing below a node is of interest."""
        enough = self.value * (1 - CLOSE) if self.found else self.value
        return relaxed.status == "infeasible" or relaxed.bound >= enough

    def _solve(self, fixed: np.ndarray) -> Solution:
        known = ~np.isnan(fixed)
        self.nodes += 1
        return solve_fixed(self._conic, self._columns[known], fixed[known])


def draw(rng: np.random.Generator, both: bool) -> Problem:
    """Return a random small problem: 3 to 5 slots on feet, 2 or 3 with both end effectors."""
    robot = Robot.go1()
    while True:
        # Under a leg, or just before it, an edge matters soonest.
        edge = rng.choice(
            [rng.uniform(-0.1, 0.35), rng.choice(robot.stance[:, 0]) + rng.uniform(-0.04, 0.08)]
        )
        terrain = draw_terrain(rng, edge)
        slots = int(rng.integers(2, 4) if both else rng.choice([3, 4, 5], p=[0.5, 0.3, 0.2]))
        start = rng.uniform(-0.05, 0.05, 2)
        far = rng.choice([1.0, 3.0])
        problem = Problem(
            terrain,
            goal=tuple(start + slots * rng.uniform((-0.05, -0.04), (0.2, 0.04))),
            slots=slots,
            knots_per_slot=2 if slots > 3 else 3,
            end_effectors=("foot", "wheel") if both else ("foot",),
            start=tuple(start),
            start_offsets=far * rng.uniform(-0.03, 0.03, (4, 2)),
            start_end_effectors=tuple(rng.choice(["foot", "wheel"], 4, p=[0.3, 0.7]))
            if both
            else ("foot",) * 4,
            beyond_reach=True,
            weights=Weights(goal=rng.choice([10.0, 40.0]), swing=rng.choice([0.02, 0.004])),
        )
        if problem.start_in_reach:
            return problem


def draw_terrain(rng: np.random.Generator, edge: float) -> Terrain:
    """Return one to three regions, of which the first ends at an edge.

    They are strips along x, joined, stepped or apart, level or sloping, some in a left and a right half.
    """
    count, x, z, pieces = int(rng.integers(1, 4)), -2.0, 0.0, []
    while len(pieces) < count:
        end = x + rng.uniform(0.05, 0.4) if pieces else edge
        if len(pieces) == count - 1:
            end = x + 4.0
        group = "deck"
        if pieces and rng.random() < 0.5:
            group = f"piece {len(pieces)}"
            gap = rng.choice([0.0, rng.uniform(0.02, 0.15)])
            x, end, z = x + gap, end + gap, z + rng.choice([0.0, rng.uniform(-0.04, 0.04)])
        slope = rng.choice([0.0, rng.uniform(-0.25, 0.25)]) if pieces else 0.0
        sides = [(-1.0, 1.0)]
        if len(pieces) + 2 <= count and rng.random() < 0.25:
            sides = [(-1.0, -0.02), (0.02, 1.0)]
        for i, (right, left) in enumerate(sides):
            top = z + slope * (end - x)
            corners = [(x, right, z), (end, right, top), (end, left, top), (x, left, z)]
            pieces.append(_region(rng, corners, group if len(sides) == 1 else f"{group}, half {i}"))
        x, z = end, top
    return Terrain("random", tuple(pieces[:count]))


def _region(rng: np.random.Generator, corners: list, group: str) -> Region:
    return Region(
        corners,
        mu_foot=rng.uniform(0.4, 0.8),
        mu_wheel=float(rng.choice([0.0, 0.02])),
        mu_wheel_lateral=rng.uniform(0.4, 0.8),
        rolling_resistance=float(rng.choice([0.0, rng.uniform(0.0, 0.03)])),
        group=group,
    )


@dataclass
class Verdict:
    """What came of an instance.

    Attributes:
        word: "agrees", "disagrees", or "open" where one of the searches did not finish.
        swings: in the planner's plan.
        crossings: slots in which a wheel rolls from one region to another, likewise.
        objective: of the planner; infinite if infeasible.
        bound: of the planner.
        optimum: of the other search; infinite if infeasible.
        nodes: of the other search.
        times: of the planner and of the other search.
    """

    word: str
    swings: int
    crossings: int
    objective: float
    bound: float
    optimum: float
    nodes: int
    times: tuple[float, float]


def judge(problem: Problem, time_limit: float) -> Verdict:
    """Search a problem twice.

    Args:
        problem: a small one.
        time_limit: of the plain search, in seconds of the processor.
    """
    begin = time.perf_counter()
    objective = bound = np.inf
    finished, swings, crossings = True, 0, 0
    try:
        plan = solve(problem, gap=GAP, time_limit=_PATIENCE)
        objective, bound = plan.meta["objective"], plan.meta["bound"]
        finished, swings = plan.meta["gap"] <= GAP * (1 + 1e-6), int(plan.S.sum())
        places = np.column_stack([problem.start_regions, plan.meta["regions"]])
        crossings = int(((np.diff(places) != 0) & (plan.S == 0)).sum())
    except InfeasibleError:
        pass
    except NoPlanError:
        bound, finished = -np.inf, False
    between = time.perf_counter()
    other = PlainSearch(problem, value=objective * (1 + CLOSE))
    closed = other.run(time_limit) and not other.unclear
    optimum = other.value if other.found else np.inf
    # A plan is a plan, however the search ended; that there is none better needs its end.
    wrong = bound > optimum * (1 + EXACT) or (finished and objective > optimum * (1 + GAP + EXACT))
    wrong |= closed and objective < np.inf and not other.found
    word = "disagrees" if wrong else "agrees" if closed and finished else "open"
    times = between - begin, time.perf_counter() - between
    return Verdict(word, swings, crossings, objective, bound, optimum, other.nodes, times)
