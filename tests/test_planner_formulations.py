"""The paper's big-M program and the tight one: the same plans at the same cost, whatever the ground."""

import numpy as np
import plan_checker
import pytest
from scipy import optimize

from wfbook import terrain
from wfbook.planner import InfeasibleError, Problem, bigm, solve, tight
from wfbook.planner.conic import Conic
from wfbook.planner.contacts import assignment
from wfbook.planner.gait import Gait
from wfbook.planner.presolve import solve_fixed
from wfbook.planner.problem import Limits
from wfbook.terrain import Region, Terrain

BOTH = ("foot", "wheel")
RHO = 3


def mixed() -> Terrain:
    """A platform, a slope that leans sideways too, and a stone that no wheel rolls onto; frictions differ."""
    deck = [[-2, -1, 0], [0.21, -1, 0], [0.21, 1, 0], [-2, 1, 0]]
    slope = [[0.21, -1, 0], [0.6, -1, 0.05], [0.6, 1, 0.05], [0.21, 1, 0]]
    stone = [[-0.4, -0.4, 0.01], [-0.12, -0.4, 0.01], [-0.12, 0, 0.04], [-0.4, 0, 0.04]]
    regions = (
        Region(deck, 0.6, 0.0, 0.5, 0.0, "deck"),
        Region(slope, 0.8, 0.01, 0.7, 0.01, "deck"),
        Region(stone, 0.7, 0.0, 0.6, 0.004, "stone"),
    )
    return Terrain("mixed", regions)


PROBLEMS = {
    "ramp": Problem(terrain.ramp(start=0.22, length=0.1), goal=(0.2, 0.0), slots=3),
    "ramp up, resisted": Problem(
        terrain.ramp(direction="up", start=0.22, rolling_resistance=0.02),
        goal=(0.2, 0.02),
        slots=3,
        start_end_effectors=("wheel", "foot", "wheel", "wheel"),
    ),
    "stones": Problem(terrain.stepping_stones(gap=0.05, start=0.25), goal=(0.2, 0.0), slots=3),
    "mixed": Problem(mixed(), goal=(0.15, -0.02), slots=3, start_end_effectors=("wheel",) * 3 + ("foot",)),
    "mixed, feet": Problem(mixed(), goal=(0.15, -0.02), slots=3, end_effectors=("foot",)),
}


class Both:
    """The two programs of a problem, compiled, to be solved with every binary fixed."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self.tight, self.paper = tight.build(problem), bigm.build(problem)
        for variable in self.paper.discrete.values():
            variable.attributes["boolean"] = False
        self.compiled = [Conic.compile(program.cost, program.rows()) for program in (self.tight, self.paper)]

    def values(self, gait: Gait, knots: np.ndarray) -> list[float]:
        """Return the optimum of the tight and of the paper's program, infinite where infeasible.

        Args:
            gait: with its regions.
            knots: ``(L, K)`` region of each contact at knot k + 1.
        """
        binaries = self._tight_binaries(gait, knots), self._paper_binaries(gait, knots)
        costs = []
        for program, conic, known in zip((self.tight, self.paper), self.compiled, binaries, strict=True):
            columns = np.concatenate([conic.columns(v).ravel() for v in program.discrete.values()])
            numbers = np.concatenate([known[key].ravel() for key in program.discrete])
            found = solve_fixed(conic, columns, numbers)
            assert found.status == "solved" or (
                found.status == "infeasible" and not feasible(conic, columns, numbers)
            )
            costs.append(found.value if found.status == "solved" else np.inf)
        return costs

    def _tight_binaries(self, gait: Gait, knots: np.ndarray) -> dict:
        values = assignment(self.problem, gait, self.tight.discrete)
        rolls = (1 - gait.S) * gait.wheel
        for key in values:
            if key[0].startswith("passing"):
                values[key] = rolls * (knots[:, int(key[0].split()[1]) :: RHO] == key[1])
        return values

    def _paper_binaries(self, gait: Gait, knots: np.ndarray) -> dict:
        ground, touched = self.problem.ground, gait.region.copy()
        before = self.problem.start_regions
        for j in range(self.problem.slots):
            rolls = (gait.S[:, j] == 0) & (gait.wheel[:, j] == 1)
            before = touched[:, j] = np.where(rolls, before, touched[:, j])
        values = {"S": gait.S}
        for key in self.paper.discrete:
            if key[0] == "D":
                values[key] = (touched == key[1]) & (gait.wheel == BOTH.index(key[2]))
            elif key[0] == "z":
                members = ground.groups[ground.group_of[key[1]]]
                # Where no wheel is in the group, z says nothing; let it be the first region.
                here = np.where(np.isin(knots, members), knots, members[0])
                values[key] = (here != key[1]).T
        values["s"] = np.arange(self.paper.discrete["s"].shape[0])[:, None] == gait.S.sum(axis=0)
        return {key: value.astype(float) for key, value in values.items()}


def feasible(conic: Conic, columns: np.ndarray, numbers: np.ndarray) -> bool:
    """Whether the linear rows have a point, by another solver: the cones only push U up and exclude none."""
    n, rows = conic.A.shape[1], conic.equalities + conic.inequalities
    low, up = np.full(n, -np.inf), np.full(n, np.inf)
    low[columns] = up[columns] = numbers
    least = np.where(np.arange(rows) < conic.equalities, conic.b[:rows], -np.inf)
    found = optimize.milp(
        np.zeros(n),
        constraints=optimize.LinearConstraint(conic.linear, least, conic.b[:rows]),
        bounds=optimize.Bounds(low, up),
    )
    assert found.status in (0, 2), found.message
    return found.status == 0


def random_gait(rng: np.random.Generator, p: Problem) -> tuple[Gait, np.ndarray]:
    """Return a gait, admissible or not, and in which region each contact is at each knot."""
    ground = p.ground
    S = np.zeros((p.legs, p.slots), int)
    for j in range(p.slots - 1):
        legs = p.patterns[rng.integers(len(p.patterns))]
        S[[leg for leg in legs if j == 0 or not S[leg, j - 1]], j] = 1
    wheel, region = np.zeros_like(S), np.zeros_like(S)
    knots = np.zeros((p.legs, p.knots), int)
    for leg in range(p.legs):
        kind, here = int(p.start_end_effectors[leg] == "wheel"), p.start_regions[leg]
        near = [r for r in range(ground.count) if outside(ground.regions[r], p.start_contacts[leg]) < 0.15]
        for j in range(p.slots):
            first = here
            if S[leg, j]:
                kind, here = rng.integers(1 + p.wheels), rng.choice(near)
            elif kind:
                here = rng.choice([here] + [r for r in near if ground.group_of[r] == ground.group_of[here]])
            if rng.random() < 0.005:
                kind, here = rng.integers(1 + p.wheels), rng.integers(ground.count)
            wheel[leg, j], region[leg, j] = kind, here
            inner = rng.choice([first, here], RHO - 1)
            if rng.random() < 0.02:
                inner = rng.choice(ground.groups[ground.group_of[here]], RHO - 1)
            knots[leg, RHO * j : RHO * (j + 1)] = [*inner, here]
    return Gait(S, wheel, region), knots


def outside(region: Region, point: np.ndarray) -> float:
    A, b = region.halfspaces
    return float((A @ point - b).max())


@pytest.mark.parametrize("name", PROBLEMS)
def test_fixed_binaries_have_one_value_in_both_formulations(name):
    """Eqs 1 to 33, stated in two ways, have the same cost for every gait."""
    rng, both = np.random.default_rng(3), Both(PROBLEMS[name])
    costs, crossings = [], 0
    for _ in range(30):
        gait, knots = random_gait(rng, both.problem)
        fast, paper = both.values(gait, knots)
        assert paper == pytest.approx(fast, rel=1e-5), (gait, knots)
        rolls = (gait.S == 0) & (gait.wheel == 1)
        crossings += np.isfinite(fast) and (rolls & (knots[:, RHO - 1 :: RHO] != knots[:, ::RHO])).any()
        costs.append(fast)
    assert np.isfinite(costs).any()
    assert not np.isfinite(costs).all()
    assert crossings or not (both.problem.wheels and both.problem.ground.rolls_over_edges)


def test_formulations_have_the_same_optimum_on_two_regions():
    # One leg starts so far back that it must step, on its own stone or over the gap.
    p = Problem(
        terrain.stepping_stones(gap=0.03, stones=0, start=0.09),
        goal=(0.05, 0.0),
        slots=2,
        end_effectors=("foot",),
        start_offsets=np.array([[-0.12, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]),
        patterns=((), (0,), (3,)),
        limits=Limits(rest_offset=(0.05, 0.06)),
    )
    paper, fast = solve(p, formulation="paper", gap=5e-3, time_limit=100), solve(p, gap=1e-4)
    assert paper.meta["status"] == fast.meta["status"] == "optimal"
    assert paper.meta["objective"] == pytest.approx(fast.meta["objective"], rel=5.1e-3)
    assert paper.S[0].sum() == 1
    assert paper.meta["regions"] == fast.meta["regions"]
    assert plan_checker.check(paper)[0] == []


def test_wheels_over_an_edge_are_read_from_the_papers_binaries():
    p = Problem(
        terrain.ramp(start=0.2, rolling_resistance=0.005),
        goal=(0.1, 0.0),
        slots=1,
        knots_per_slot=2,
        start_end_effectors=("wheel", "wheel", "wheel", "foot"),
        patterns=((),),
    )
    paper, fast = solve(p, formulation="paper", gap=5e-3, time_limit=100), solve(p)
    assert paper.meta["objective"] == pytest.approx(fast.meta["objective"], rel=6.1e-3)
    # The front wheels roll onto the ramp; their D stays where they stood.
    assert paper.meta["regions"][:2] == [[1], [1]]
    assert (paper.D[:2, 0, 0, 1] == 1).all()
    assert plan_checker.check(paper)[0] == []


def test_a_leg_over_no_region_is_infeasible_in_both():
    p = Problem(terrain.stepping_stones(start=0.1), goal=(0.1, 0.0), slots=1)
    for formulation in ("tight", "paper"):
        with pytest.raises(InfeasibleError):
            solve(p, formulation=formulation)
