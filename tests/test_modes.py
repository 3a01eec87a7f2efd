"""The rules of S and D: against the planner's own rows, against enumeration, and what they say."""

from itertools import product

import numpy as np
import pytest

from wfbook.modes import (
    LEGS,
    broken_rules,
    contact_centroid,
    dynamics_matrix,
    legal_rows,
    regions_allowed,
    start_dynamics,
    swing_count,
)
from wfbook.planner import Problem, bigm, stored
from wfbook.terrain import flat, ramp


def every_row(slots: int, regions: int):
    """Yield all S and D of one leg, legal or not."""
    for bits in product((0, 1), repeat=slots * (1 + 2 * regions)):
        yield np.array(bits[:slots]), np.array(bits[slots:]).reshape(slots, regions, 2)


def allowed_by_the_planner(problem: Problem, program, S: np.ndarray, D: np.ndarray) -> bool:
    """Whether the big-M program's rows among binaries hold, all legs having the same rows."""
    program.discrete["S"].value = np.tile(S, (problem.legs, 1)).astype(float)
    for (_, r, e), variable in ((k, v) for k, v in program.discrete.items() if k[0] == "D"):
        variable.value = np.tile(D[:, r, ("foot", "wheel").index(e)], (problem.legs, 1)).astype(float)
    return all(np.max(row.violation()) < 1e-9 for row in program.constraints["modes"])


@pytest.mark.parametrize("start", ["foot", "wheel"])
def test_the_papers_program_allows_the_same_rows(start):
    """Eqs 16 and 17 as the big-M program states them."""
    problem = Problem(
        flat(),
        goal=(0.1, 0.0),
        slots=2,
        start_end_effectors=(start,) * 4,
        stance_between_swings=False,
        final_stance=False,
    )
    program = bigm.build(problem)
    before = start_dynamics([0] * 4, [start] * 4, 1)
    legal = 0
    for S, D in every_row(2, 1):
        ours = not broken_rules(S[None], D[None], before[:1])
        assert ours == allowed_by_the_planner(problem, program, S, D), (S, D)
        legal += ours
    assert legal == 3**2


def test_legal_rows_are_those_that_break_nothing():
    start = np.array([[0, 0], [0, 1]])
    found = {(S.tobytes(), D.tobytes()) for S, D in legal_rows(2, start)}
    tried = [
        (S.astype(np.int8), D.astype(np.int8))
        for S, D in every_row(2, 2)
        if not broken_rules(S[None], D[None], start[None])
    ]
    assert found == {(S.tobytes(), D.tobytes()) for S, D in tried}
    assert len(found) == len(tried) == (1 + 2 * 2) ** 2


def test_a_broken_rule_names_equation_leg_and_slot():
    plan = stored("flat")
    start = start_dynamics([0] * 4, plan.meta["start_end_effectors"], 1)
    assert broken_rules(plan.S, plan.D, start) == []
    D = plan.D.copy()
    D[3, 5, 0] = [1, 0]
    first, second = broken_rules(plan.S, D, start)
    assert (first.rule, first.leg, first.slot, second.slot) == ("eq. 16", 3, 5, 6)
    assert (
        str(first)
        == "eq. 16: RR, slot 5: the leg stands, but D changes from wheel on region 0 to foot on region 0"
    )
    D[3, 5, 0] = 0
    assert "eq. 17: RR, slot 5: D has no entries" in str(broken_rules(plan.S, D, start)[0])
    S = plan.S.copy()
    S[:, 2] = 1
    assert [(b.rule, b.leg, b.slot) for b in broken_rules(S, plan.D, start)] == [("eq. 12", None, 2)]


def test_the_first_slot_is_compared_with_the_start():
    S, D = np.zeros((1, 1), int), np.array([[[[0, 1]]]])
    (broken,) = broken_rules(S, D, start_dynamics([0], ["foot"], 1))
    assert (broken.rule, broken.slot) == ("eq. 16", 0)
    assert broken_rules(S, D, start_dynamics([0], ["wheel"], 1)) == []


@pytest.mark.parametrize("name", ["flat", "ramp-down", "stepping-stones"])
def test_stored_plans_are_written_by_these_functions(name):
    plan = stored(name)
    regions = np.array(plan.meta["regions"])
    start = [plan.terrain.region_at(x, y) for x, y in plan.p[0, :, :2]]
    count = len(plan.terrain.regions)
    D = dynamics_matrix(plan.S, plan.end_effector, regions, start, count)
    assert np.array_equal(D, plan.D)
    assert not broken_rules(plan.S, D, start_dynamics(start, plan.meta["start_end_effectors"], count))
    assert np.allclose(contact_centroid(plan.p[1:], plan.S), plan.c, atol=1e-6)
    groups = [[i for i, r in enumerate(plan.terrain.regions) if r.group == g] for g in
              dict.fromkeys(r.group for r in plan.terrain.regions)]  # fmt: skip
    here = np.take_along_axis(regions_allowed(D, groups), regions[..., None], axis=2)
    assert here.all(), "a contact is where eqs 22 and 23 allow it"


def test_a_wheel_may_roll_through_its_group_and_a_foot_may_not():
    """Eqs 22 and 23."""
    D = np.zeros((1, 2, 3, 2), int)
    D[0, 0, 1, 0] = D[0, 1, 1, 1] = 1
    allowed = regions_allowed(D, [[0], [1, 2]])
    assert allowed[0].tolist() == [[False, True, False], [False, True, True]]
    assert ramp().regions[0].group == ramp().regions[2].group


def test_the_count_of_swings_satisfies_13_and_14():
    """Eqs 13 and 14, for every set of swinging legs."""
    S = np.array(list(product((0, 1), repeat=4))).T
    s = swing_count(S)
    assert (s.sum(axis=0) == 1).all() and (np.arange(5) @ s == S.sum(axis=0)).all()
    assert s.sum(axis=1).tolist() == [1, 4, 6, 4, 1], "with the s_0 that the paper lacks"


def test_the_centroid_moves_with_its_contacts_and_not_with_the_others():
    """Eqs 10 to 12 and 15, as a mean."""
    rng = np.random.default_rng(1)
    p, S = rng.normal(size=(6, 4, 3)), np.array([[1, 0], [0, 0], [0, 1], [1, 0]])
    c = contact_centroid(p, S)
    shift = np.array([1.0, 2.0, 3.0])
    assert np.allclose(contact_centroid(p + shift, S), c + shift)
    assert np.allclose(c[0], p[0, [1, 2]].mean(axis=0)) and np.allclose(c[3], p[3, [0, 1, 3]].mean(axis=0))
    swings = np.repeat(S.T, 3, axis=0).astype(bool)
    p[swings] += 5.0
    assert np.allclose(contact_centroid(p, S), c)
    with pytest.raises(ValueError, match="all legs swing in slot 1"):
        contact_centroid(p, np.array([[0, 1]] * len(LEGS)))
