"""Problems that begin in motion: what a plan's rest is worth, and that every part knows the state."""

from dataclasses import replace
from itertools import product

import numpy as np
import plan_checker
import pytest

from wfbook import terrain
from wfbook.modes import END_EFFECTORS
from wfbook.planner import InfeasibleError, InitialState, Problem, polish, solve
from wfbook.planner.extract import problem_of
from wfbook.planner.gait import Gait
from wfbook.planner.kernel import Kernel
from wfbook.planner.symmetry import MIRROR

BOTH = ("foot", "wheel")
GAP = 1e-3


def rest_of(problem: Problem, plan, slot: int) -> Problem:
    """Return what is left of a problem once the first slots of a plan are done."""
    k = slot * problem.knots_per_slot
    state = InitialState(
        plan.x[k], plan.v[k], plan.theta[k], plan.omega[k], plan.p[k], plan.S[:, slot - 1] == 1, slot
    )
    kinds = [END_EFFECTORS[e] for e in plan.end_effector[:, slot - 1]]
    return problem.begun(state, kinds, slots=problem.slots - slot, beyond_reach=True)


@pytest.fixture(scope="module", params=[("foot",), BOTH], ids=["feet", "wheels"])
def whole(request):
    """A problem, its plan, and the problem that is left after two slots of five."""
    problem = Problem(terrain.flat(), goal=(0.6, 0.02), slots=5, end_effectors=request.param)
    plan = solve(problem, gap=GAP)
    return problem, plan, rest_of(problem, plan, 2)


def test_the_rest_of_an_optimal_plan_is_optimal(whole):
    problem, plan, rest = whole
    assert np.linalg.norm(rest.initial.velocity) > 0.1
    found = solve(rest, gap=GAP)
    violations, _ = plan_checker.check(found)
    assert violations == []
    # What the first two slots cost is what the plan costs without its last three.
    k = 2 * problem.knots_per_slot
    parts = {name: getattr(plan, name)[k:] for name in ("x", "v", "theta", "omega", "p")}
    parts |= {name: getattr(plan, name)[k:] for name in ("a", "alpha", "lam", "f", "U_plus", "U_minus", "c")}
    tail = replace(plan, t=plan.t[k:], S=plan.S[:, 2:], D=plan.D[:, 2:], **parts)
    tail = tail.with_meta(**found.meta)
    cost = plan_checker.objective(tail)
    head = plan.meta["objective"] - cost
    assert found.meta["objective"] <= cost * (1 + GAP) + 1e-5
    assert found.meta["objective"] + head >= plan.meta["bound"] - 1e-5


def test_the_optimum_in_motion_is_that_of_enumeration(whole):
    _, _, rest = whole
    kernel, best = Kernel(rest), np.inf
    for patterns in product(rest.patterns, repeat=rest.slots - 1):
        S = np.array([[int(leg in p) for p in (*patterns, ())] for leg in range(rest.legs)])
        swings = np.argwhere(S)
        for kinds in product(range(1 + rest.wheels), repeat=len(swings)):
            wheel = np.array([[int(e == "wheel")] * rest.slots for e in rest.start_end_effectors])
            for (leg, j), kind in zip(swings, kinds, strict=True):
                wheel[leg, j:] = kind
            gait = Gait(S, wheel, np.zeros_like(S))
            if not kernel.boxes.admissible(gait):
                continue
            leaf = kernel.leaf(gait)
            if leaf.status == "solved":
                assert kernel.gait_bounds([gait])[0] <= leaf.value + 1e-6
                best = min(best, leaf.value)
    found = solve(rest, gap=1e-4)
    assert best - 1e-6 <= found.meta["objective"] <= best * (1 + 1.1e-4)


def test_both_formulations_agree_in_motion():
    problem = Problem(terrain.flat(), goal=(0.3, 0.0), slots=3, end_effectors=("foot",))
    rest = rest_of(problem, solve(problem), 1)
    paper, tight = solve(rest, formulation="paper", gap=1e-3), solve(rest, gap=1e-4)
    assert abs(paper.meta["objective"] - tight.meta["objective"]) <= 1.2e-3 * tight.meta["objective"]


def test_the_mirror_image_of_a_motion_costs_the_same(whole):
    _, _, rest = whole
    order = list(MIRROR)
    flip, turn = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    state = rest.initial
    image = InitialState(
        state.position * flip,
        state.velocity * flip,
        state.angles * turn,
        state.rates * turn,
        state.contacts[order] * flip,
        state.swung[order],
        state.slot,
    )
    kinds = [rest.start_end_effectors[leg] for leg in MIRROR]
    mirrored = solve(rest.begun(image, kinds, goal=(rest.goal[0], -rest.goal[1])), gap=1e-4)
    assert mirrored.meta["objective"] == pytest.approx(solve(rest, gap=1e-4).meta["objective"], rel=2e-4)


def test_a_plan_in_motion_describes_its_problem(whole, tmp_path):
    _, _, rest = whole
    plan = solve(rest, gap=0.05)
    plan.save(tmp_path / "plan.npz")
    again = problem_of(type(plan).load(tmp_path / "plan.npz"))
    for name, value in vars(rest.initial).items():
        np.testing.assert_array_equal(getattr(again.initial, name), value)
    assert again.start_end_effectors == rest.start_end_effectors
    assert plan_checker.check(polish(plan))[0] == []


def test_legs_that_have_just_swung_stand_first(whole):
    _, _, rest = whole
    kernel = Kernel(replace(rest, initial=replace(rest.initial, swung=np.ones(4, bool))))
    _, upper = kernel.boxes.root()
    assert not upper[kernel.boxes.layout.S[:, 0]].any()


def test_too_fast_a_start_is_infeasible(whole):
    _, _, rest = whole
    fast = replace(rest.initial, velocity=np.array([1.2, 0.0, 0.0]))
    with pytest.raises(InfeasibleError) as caught:
        solve(replace(rest, initial=fast))
    assert set(caught.value.groups) == {"start", "speed"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"velocity": np.zeros(2)}, "velocity"),
        ({"rates": np.full(3, np.nan)}, "rates"),
        ({"slot": -1}, "slot"),
        ({"position": np.array([0.1, 0.0, 0.265])}, "start"),
        ({"contacts": np.zeros((4, 3))}, "start_offsets"),
    ],
)
def test_states_that_contradict_are_refused(changes, words):
    problem = Problem(terrain.flat(), goal=(0.3, 0.0), slots=3)
    with pytest.raises(ValueError, match=rf"^initial: .*{words}"):
        replace(problem, initial=replace(problem.start_state, **changes))


def test_contacts_in_the_air_are_refused():
    problem = Problem(terrain.flat(), goal=(0.3, 0.0), slots=3)
    state = problem.start_state
    with pytest.raises(ValueError, match="ground"):
        problem.begun(replace(state, contacts=state.contacts + np.array([0.0, 0.0, 0.1])), ("foot",) * 4)
