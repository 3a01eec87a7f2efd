"""Whatever the ground, the answer is a plan that violates nothing, or a true "infeasible"."""

import numpy as np
import pytest
from terrain_cases import attempt, ground_at_start, random_problem


@pytest.mark.parametrize("seed", range(30))
def test_a_random_terrain_is_planned_or_proven_infeasible(seed):
    problem = random_problem(np.random.default_rng(seed), slots=3)
    outcome, complaints = attempt(problem, gap=0.1, time_limit=60.0)
    assert complaints == []
    assert outcome in ("planned", "infeasible")


def test_problems_are_told_apart_by_the_ground_under_their_legs():
    problems = [random_problem(np.random.default_rng(seed), slots=3) for seed in range(100)]
    found = [ground_at_start(problem) for problem in problems]
    assert set(found) == {"level", "uneven", "none"}
    assert found.count("level") > 50
    for problem, start in zip(problems, found, strict=True):
        heights = [problem.terrain.height(*place) for place in problem.start_contacts]
        assert (None in heights) == (start == "none")
        assert start != "level" or np.ptp(heights) < 1e-9
