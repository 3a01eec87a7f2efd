"""What the search proves is true: against a plain branch and bound, against leaves, and under symmetries."""

from dataclasses import replace

import numpy as np
import pytest
from plain_search import draw, judge
from test_planner_formulations import PROBLEMS, random_gait

from wfbook import terrain
from wfbook.planner import Problem, solve
from wfbook.planner.kernel import Kernel
from wfbook.terrain import Terrain

GAP = 5e-4


@pytest.mark.parametrize("number", [1, 3, 8, 12, 17, 21])
def test_the_optimum_is_that_of_a_plain_branch_and_bound(number):
    # The same instances as those of benchmarks/soundness.py, which judges a hundred.
    problem = draw(np.random.default_rng([0, number]), both=number % 2 == 1)
    found = judge(problem, time_limit=120.0)
    assert found.word == "agrees", found


@pytest.mark.parametrize("name", ["ramp up, resisted", "mixed"])
def test_the_relaxation_is_below_every_leaf_on_several_regions(name):
    kernel, rng = Kernel(PROBLEMS[name]), np.random.default_rng(4)
    root, checked = kernel.boxes.root(), 0
    while checked < 8:
        gait, _ = random_gait(rng, kernel.problem)
        leaf = kernel.leaf(gait) if kernel.boxes.admissible(gait) else None
        if leaf is None or leaf.status != "solved":
            continue
        z = kernel.boxes.vector(gait)
        known = rng.random((2, z.size)) < 0.4
        box = kernel.boxes.propagate(*(np.where(k, z, r) for k, r in zip(known, root, strict=True)))
        assert box is not None
        assert (box[0] <= z).all() and (z <= box[1]).all(), "propagation lost a gait of the box"
        bounds = [kernel.bound(*box).bound, *kernel.gait_bounds([gait.open(), gait])]
        assert max(bounds) <= leaf.value * (1 + 1e-4)
        checked += 1


def moved(problem: Problem, by: tuple[float, float, float]) -> Problem:
    """Return a problem elsewhere in the world."""
    regions = [replace(region, vertices=region.vertices + by) for region in problem.terrain.regions]
    start, goal = (tuple(np.add(place, by[:2])) for place in (problem.start, problem.goal))
    return replace(problem, terrain=Terrain("moved", tuple(regions)), start=start, goal=goal)


def flipped(problem: Problem) -> Problem:
    """Return a problem with left and right exchanged."""
    side, legs = np.array([1, -1, 1]), [1, 0, 3, 2]
    regions = [replace(r, vertices=r.vertices[::-1] * side) for r in problem.terrain.regions]
    return replace(
        problem,
        terrain=Terrain("flipped", tuple(regions)),
        start=tuple(problem.start * side[:2]),
        goal=tuple(problem.goal * side[:2]),
        start_offsets=problem.start_offsets[legs] * side[:2],
        start_end_effectors=tuple(np.array(problem.start_end_effectors)[legs]),
    )


OFFSETS = np.array([[0.03, 0.0], [0.0, 0.01], [-0.02, 0.0], [-0.01, 0.02]])


@pytest.mark.parametrize(
    "problem",
    [
        Problem(
            terrain.ramp(start=0.22, rolling_resistance=0.01),
            goal=(0.2, 0.03),
            slots=2,
            start_offsets=OFFSETS,
            start_end_effectors=("wheel", "foot", "wheel", "wheel"),
        ),
        Problem(
            terrain.stepping_stones(gap=0.05, start=0.25),
            goal=(0.3, -0.02),
            slots=3,
            start_offsets=OFFSETS,
            end_effectors=("foot",),
        ),
    ],
    ids=["ramp", "stones"],
)
def test_moved_and_mirrored_problems_have_the_same_optimum(problem):
    costs = [
        solve(p, gap=GAP).meta["objective"]
        for p in (problem, moved(problem, (0.7, -0.4, 0.3)), flipped(problem))
    ]
    assert costs[1:] == pytest.approx([costs[0]] * 2, rel=2 * GAP)
