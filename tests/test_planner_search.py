"""The search against enumeration, the two formulations against each other, bounds against truth."""

import multiprocessing
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise, product

import cvxpy as cp
import numpy as np
import pytest

from wfbook import terrain
from wfbook.planner import InfeasibleError, NoPlanError, Problem, bigm, solve, tight
from wfbook.planner.conic import Conic
from wfbook.planner.contacts import assignment
from wfbook.planner.gait import Gait
from wfbook.planner.gaits import templates
from wfbook.planner.kernel import Kernel
from wfbook.planner.presolve import solve_fixed
from wfbook.planner.solve import Search

BOTH = ("foot", "wheel")


def problem(slots: int, end_effectors=BOTH, **changes) -> Problem:
    """Return a flat problem with a goal that takes every slot."""
    changes = {"goal": (0.1 * slots, 0.0)} | changes
    return Problem(terrain.flat(), slots=slots, end_effectors=end_effectors, **changes)


def all_gaits(kernel: Kernel) -> Iterator[Gait]:
    """Yield every gait of a problem that its integers allow."""
    L, J = kernel.problem.legs, kernel.problem.slots
    for patterns in product(kernel.problem.patterns, repeat=J):
        S = np.array([[int(leg in p) for p in patterns] for leg in range(L)])
        swings = np.argwhere(S)
        for kinds in product(range(1 + kernel.problem.wheels), repeat=len(swings)):
            wheel = np.zeros((L, J), int)
            for (leg, j), kind in zip(swings, kinds, strict=True):
                wheel[leg, j:] = kind
            gait = on_one_region(S, wheel)
            if kernel.boxes.admissible(gait):
                yield gait


def on_one_region(S: np.ndarray, wheel: np.ndarray) -> Gait:
    return Gait(S, wheel, np.zeros_like(S))


def random_gait(rng: np.random.Generator, p: Problem) -> Gait:
    """Return a random swing matrix of admissible patterns and a wheel matrix, admissible or not."""
    S = np.zeros((p.legs, p.slots), int)
    for j in range(p.slots - 1):
        S[list(p.patterns[rng.integers(len(p.patterns))]), j] = 1
    wheel = np.zeros_like(S)
    for leg in range(p.legs):
        kind = 0
        for j in range(p.slots):
            if p.wheels and (S[leg, j] or rng.random() < 0.03):
                kind = rng.integers(2)
            wheel[leg, j] = kind
    return on_one_region(S, wheel)


@pytest.mark.parametrize(("slots", "end_effectors"), [(4, ("foot",)), (3, BOTH)])
def test_the_optimum_is_that_of_enumeration(slots, end_effectors):
    p = problem(slots, end_effectors)
    kernel = Kernel(p)
    best = min(kernel.leaf(gait).value for gait in all_gaits(kernel))
    plan = solve(p, gap=1e-4)
    assert plan.meta["status"] == "optimal"
    assert plan.meta["bound"] <= best + 1e-6
    assert best - 1e-6 <= plan.meta["objective"] <= best * (1 + 1.1e-4)


@pytest.mark.parametrize(("slots", "end_effectors"), [(2, ("foot",)), (1, BOTH)])
def test_formulations_have_the_same_optimum(slots, end_effectors):
    p = problem(slots, end_effectors, patterns=((), (0,), (3,), (0, 3)))
    paper, fast = solve(p, formulation="paper", gap=5e-3, time_limit=100), solve(p, gap=1e-4)
    assert paper.meta["status"] == fast.meta["status"] == "optimal"
    assert abs(paper.meta["objective"] - fast.meta["objective"]) <= 5.1e-3 * fast.meta["objective"]


@pytest.mark.parametrize("end_effectors", [("foot",), BOTH])
def test_an_assignment_feasible_in_one_formulation_is_feasible_in_the_other(end_effectors):
    rng = np.random.default_rng(5)
    p = problem(4, end_effectors)
    kernel, big = Kernel(p), bigm.build(p)
    verdicts = []
    for _ in range(12):
        gait = random_gait(rng, p)
        S, wheel = gait.S, gait.wheel
        fixed = [big.S == S] + ([big.wheel == wheel] if p.wheels else [])
        relaxed = cp.Problem(cp.Minimize(big.cost), big.rows() + fixed)
        booleans = [v for v in relaxed.variables() if v.attributes["boolean"]]
        for variable in booleans:
            variable.attributes["boolean"] = False
            if variable.name() == "s":  # the number of swinging legs decides it
                counts = np.eye(len(S) + 1)[S.sum(axis=0)].T[: variable.shape[0]]
                relaxed = cp.Problem(relaxed.objective, [*relaxed.constraints, variable == counts])
        relaxed.solve(solver=cp.CLARABEL)
        for variable in booleans:
            variable.attributes["boolean"] = True
        feasible = kernel.boxes.admissible(gait) and kernel.leaf(gait).status == "solved"
        assert feasible == (relaxed.status == "optimal"), (S, wheel, relaxed.status)
        if feasible:
            assert relaxed.value == pytest.approx(kernel.leaf(gait).value, rel=1e-5)
        verdicts.append(feasible)
    assert any(verdicts)
    assert not all(verdicts)


def test_the_relaxation_is_below_every_leaf_and_rises_as_boxes_shrink():
    p = problem(5, goal=(0.6, 0.05))
    kernel = Kernel(p)
    rng = np.random.default_rng(2)
    root = kernel.boxes.root()
    checked = 0
    while checked < 12:
        gait = random_gait(rng, p)
        leaf = kernel.leaf(gait) if kernel.boxes.admissible(gait) else None
        if leaf is None or leaf.status != "solved":
            continue
        z = kernel.boxes.vector(gait)
        low, high = (
            np.where(rng.random(z.size) < 0.3, z, root[0]),
            np.where(rng.random(z.size) < 0.3, z, root[1]),
        )
        box = kernel.boxes.propagate(low, high)
        assert box is not None
        assert (box[0] <= z).all() and (z <= box[1]).all(), "propagation lost a gait of the box"
        below, here = kernel.bound(*box), kernel.gait_bounds([gait])[0]
        assert kernel.bound(*root).bound <= below.bound + 1e-4
        assert below.bound <= here + 1e-4
        assert here <= leaf.value + 1e-6
        checked += 1


def test_a_presolved_leaf_has_the_value_of_the_program_itself():
    p = problem(3)
    program = tight.build(p)
    kernel = Kernel(p)
    gait = next(g for g in kernel.complete(list(templates(p))[::-1]) if kernel.boxes.admissible(g))
    assigned = assignment(p, gait, program.discrete)
    conic = Conic.compile(program.cost, program.rows())
    columns = np.concatenate([conic.columns(v).ravel() for v in program.discrete.values()])
    found = solve_fixed(conic, columns, np.concatenate([assigned[k].ravel() for k in program.discrete]))
    fixed = [v == assigned[k] for k, v in program.discrete.items()]
    whole = cp.Problem(cp.Minimize(program.cost), program.rows() + fixed)
    whole.solve(solver=cp.CLARABEL)
    assert found.value == pytest.approx(whole.value, rel=1e-5)
    slack = conic.b - conic.A @ found.y
    assert np.abs(slack[: conic.equalities]).max() < 1e-6
    assert slack[conic.equalities : conic.equalities + conic.inequalities].min() > -1e-6


def test_a_coefficient_of_rounding_size_decides_nothing():
    known, y = cp.Variable(1), cp.Variable(1)
    conic = Conic.compile(cp.sum_squares(y - 1), [known + 1e-15 * y == 0.5])
    found = solve_fixed(conic, conic.columns(known), np.array([0.5 + 2e-15]))
    assert found.status == "solved"
    assert conic.value(y, found.y) == pytest.approx(1.0)


def test_translated_and_mirrored_problems_have_translated_and_mirrored_optima():
    # The other diagonal's start is a little off, so that the problem is not its own mirror image.
    offsets = np.array([[0.02, 0.0], [0.0, 0.01], [0.0, 0.0], [-0.01, 0.0]])
    p = problem(4, start_offsets=offsets, goal=(0.4, 0.03))
    plan = solve(p, gap=1e-4)
    moved = solve(replace(p, start=(0.7, -0.4), goal=(1.1, -0.37)), gap=1e-4)
    flipped = solve(replace(p, start_offsets=(offsets * [1, -1])[[1, 0, 3, 2]], goal=(0.4, -0.03)), gap=1e-4)
    assert moved.meta["objective"] == pytest.approx(plan.meta["objective"], rel=2e-4)
    assert flipped.meta["objective"] == pytest.approx(plan.meta["objective"], rel=2e-4)
    if (moved.S == plan.S).all() and (moved.D == plan.D).all():
        assert np.abs(moved.x - plan.x - [0.7, -0.4, 0.0]).max() < 1e-3


def test_an_excluded_gait_is_not_found_again():
    p = problem(3, ("foot",))
    search = Search(p, 1e-3, 60.0)
    plan = search.run()
    search.exclude(plan)
    second = search.run()
    search.close()
    assert not (second.S == plan.S).all()
    assert second.meta["objective"] >= plan.meta["bound"] - 1e-9
    assert second.meta["rejected_gaits"] == 1


def test_a_second_core_changes_nothing_but_time_and_leaves_no_process(monkeypatch):
    p = problem(4)
    plans = [solve(p)]
    monkeypatch.setattr("wfbook.planner.kernel.available", lambda: False)
    plans.append(solve(p))
    assert multiprocessing.active_children() == []
    for key in ("objective", "bound", "nodes", "relaxations", "leaves"):
        assert plans[0].meta[key] == plans[1].meta[key]
    for name in ("S", "D", "x", "lam"):
        np.testing.assert_array_equal(getattr(plans[0], name), getattr(plans[1], name))


def test_an_interrupt_returns_the_incumbent_and_its_gap():
    def interrupt(progress):
        if np.isfinite(progress.incumbent):
            raise KeyboardInterrupt

    plan = solve(problem(8), progress=interrupt)
    assert plan.meta["status"] == "interrupted"
    assert plan.meta["bound"] < plan.meta["objective"]
    assert plan.meta["gap"] == pytest.approx(1 - plan.meta["bound"] / plan.meta["objective"])


def test_a_time_limit_returns_the_incumbent_or_says_that_there_is_none():
    p = problem(10)
    try:
        plan = solve(p, time_limit=2.0)
    except NoPlanError as error:
        assert "no plan found" in str(error)
    else:
        assert plan.meta["status"] in ("time limit", "optimal")
        assert plan.meta["bound"] <= plan.meta["objective"]


def test_progress_is_monotonous():
    seen = []
    solve(problem(5, ("foot",)), progress=seen.append)
    assert len(seen) > 2
    incumbents = [s.incumbent for s in seen]
    assert all(later <= earlier for earlier, later in pairwise(incumbents))


def test_an_infeasible_problem_names_a_minimal_set_of_groups():
    apart = np.array([[0.16, 0.0], [0.16, 0.0], [-0.16, 0.0], [-0.16, 0.0]])
    with pytest.raises(InfeasibleError, match="leg FL starts at") as caught:
        solve(problem(1, goal=(0.0, 0.0), start_offsets=apart))
    assert "start" in caught.value.groups and "end" in caught.value.groups
    assert "friction" not in caught.value.groups


def test_a_start_out_of_reach_blames_reach_and_start_alone():
    far = np.array([[0.3, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    with pytest.raises(InfeasibleError) as caught:
        solve(problem(3, start_offsets=far))
    assert caught.value.groups == ("start", "reach")


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"slots": 0}, "slots"),
        ({"slot_duration": -1.0}, "slot_duration"),
        ({"goal": (9.0, 0.0)}, "goal"),
        ({"goal": (float("nan"), 0.0)}, "goal"),
        ({"end_effectors": ("wheel",)}, "end_effectors"),
        ({"start_end_effectors": ("foot", "foot", "foot", "hoof")}, "start_end_effectors"),
        ({"start_offsets": np.zeros(3)}, "start_offsets"),
    ],
)
def test_wrong_problems_are_refused_with_the_field_named(changes, field):
    arguments = {"terrain": terrain.flat(), "slots": 5} | changes
    with pytest.raises(ValueError, match=rf"^{field}: "):
        Problem(**arguments)


@pytest.mark.parametrize("bad", [{"gap": 0.0}, {"time_limit": float("nan")}, {"formulation": "loose"}])
def test_wrong_options_are_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        solve(problem(2), **bad)
