"""Why there is no plan: each case is infeasible, and feasible as soon as what is named is relaxed."""

import math
import re
from dataclasses import replace

import numpy as np
import plan_checker
import pytest
from terrain_cases import random_problem

from wfbook import terrain
from wfbook.planner import InfeasibleError, Limits, Problem, explain, reasons, solve, solve_executable
from wfbook.planner.explain import why_not
from wfbook.planner.extract import problem_of
from wfbook.planner.feasibility import possible
from wfbook.planner.neighbours import nearest_points, neighbours
from wfbook.planner.wide import clipped
from wfbook.terrain import Region, Terrain

FEET = ("foot",)
FLAT = terrain.flat()
PLENTY = 300.0


@pytest.fixture(autouse=True)
def _no_hurry(monkeypatch):
    """Answers must not depend on how busy the machine is."""
    monkeypatch.setattr(explain, "PATIENCE", PLENTY)
    monkeypatch.setattr(explain, "TOTAL", PLENTY)
    monkeypatch.setattr(reasons, "_FINE", PLENTY)


def region(x0, x1, y0=-1.0, y1=1.0, z=0.0, slope=0.0, group="ground", **surface) -> Region:
    """Return a rectangle that rises along x, at height z where it begins."""
    top = z + slope * (x1 - x0)
    surface = {"mu_foot": 0.7, "mu_wheel": 0.0, "mu_wheel_lateral": 0.7, "rolling_resistance": 0.0} | surface
    return Region([[x0, y0, z], [x1, y0, top], [x1, y1, top], [x0, y1, z]], **surface, group=group)


def ground(*regions: Region) -> Terrain:
    """Return a terrain of regions, each a group of its own."""
    return Terrain("built", tuple(replace(r, group=f"{r.group} {i}") for i, r in enumerate(regions)))


def walk(terrain: Terrain, x: float, slots: int, near: float = 0.05, **changes) -> Problem:
    """Return a problem on feet whose goal must be met."""
    goal = {"goal": (x, 0.0), "goal_tolerance": (near, near)}
    return Problem(terrain, slots=slots, end_effectors=FEET, **goal | changes)


def offsets(**places) -> np.ndarray:
    """Return start offsets by leg."""
    return np.array([places.get(leg, (0.0, 0.0)) for leg in ("FL", "FR", "RL", "RR")])


def reaching(p: Problem, axis: int, more: float) -> Problem:
    """Return a problem whose legs reach farther."""
    reach = list(p.robot.reach)
    reach[axis] += more
    return replace(p, robot=replace(p.robot, reach=tuple(reach)))


def limited(p: Problem, **limits) -> Problem:
    """Return a problem with other limits."""
    return replace(p, limits=replace(p.limits, **limits))


def explained(p: Problem, relaxed: Problem, almost: Problem | None = None) -> InfeasibleError:
    """Return the explanation of an infeasible problem.

    Args:
        p: the problem; asserted to be infeasible.
        relaxed: the same without what is to blame; asserted to be feasible.
        almost: the same with not quite enough of that; asserted to be infeasible.
    """
    assert possible(p, PLENTY) is False
    assert possible(relaxed, PLENTY) is True
    assert almost is None or possible(almost, PLENTY) is False
    return why_not(p)


def reason(error: InfeasibleError, group: str) -> reasons.Reason:
    """Return the first detail about a group."""
    return next(detail for detail in error.details if detail.group == group)


def test_a_leg_that_starts_over_nothing_is_named_with_its_place():
    """The front legs stand 0.04 m beyond the only region."""
    p = Problem(ground(region(-1, 0.15)), goal=(0.0, 0.0), slots=2, end_effectors=FEET)
    for plan in (solve, solve_executable, lambda p: solve(p, formulation="paper")):
        with pytest.raises(
            InfeasibleError, match=r"leg FL starts at \(0\.19, 0\.13\), over no region"
        ) as caught:
            plan(p)
        assert caught.value.groups == ("start", "regions")
        assert [d.legs for d in caught.value.details] == [("FL",), ("FR",)]
    missing = caught.value.details[0].missing
    assert possible(replace(p, terrain=ground(region(-1, 0.15 + missing + 1e-6))), PLENTY) is True


def test_a_start_posture_beyond_reach_names_leg_axis_and_slot():
    p = Problem(FLAT, goal=(0.0, 0.0), slots=3, start_offsets=offsets(FL=(0.3, 0.0)))
    error = explained(p, reaching(p, 0, 0.13), reaching(p, 0, 0.125))
    found = reason(error, "reach")
    assert error.groups == ("start", "reach")
    assert found.legs == reason(error, "start").legs == ("FL",)
    assert found.slots == (0, 0)
    assert found.missing == pytest.approx(0.13, abs=1e-6)
    assert "leg FL reaches 0.17 m along x, at least 0.13 m too little" in str(error)


def test_too_few_slots_to_put_legs_together():
    apart = offsets(FL=(0.16, 0.0), FR=(0.16, 0.0), RL=(-0.16, 0.0), RR=(-0.16, 0.0))
    p = Problem(FLAT, goal=(0.0, 0.0), slots=1, start_offsets=apart)
    error = explained(p, replace(p, slots=3), replace(p, slots=2))
    assert {"start", "end"} <= set(error.groups)
    assert not {"friction", "regions", "step"} & set(error.groups)
    assert str(error).startswith("infeasible: 1 slot of 0.3 s is too few, 3 are enough; leg FL starts at")
    found = next(d for d in error.details if d.group == "end" and d.missing)
    assert found.missing == pytest.approx(0.04, abs=1e-6)
    assert possible(limited(p, rest_offset=(0.161, 0.06)), PLENTY) is True


def test_a_gap_wider_than_the_step():
    def strips(end):
        return ground(region(-1, end), region(0.6, 3))

    p = walk(strips(0.25), 0.7, 8)
    error = explained(p, replace(p, terrain=strips(0.6)), replace(p, terrain=strips(0.29)))
    assert str(error) == (
        "infeasible: regions 0–1: gap 0.35 m exceeds the 0.30 m step (conflicting: goal, end, regions, step)"
    )
    found = reason(error, "regions")
    assert (found.regions, found.limit) == ((0, 1), 0.3)
    assert found.missing == pytest.approx(0.05)
    assert possible(replace(p, terrain=strips(0.301)), PLENTY) is True


def test_of_two_gaps_the_one_that_can_be_crossed_is_not_named():
    strips = region(-1, 0.25), region(0.3, 0.38), region(0.7, 3)
    p = walk(ground(*strips), 0.8, 8)
    error = explained(p, replace(p, terrain=ground(strips[0], region(0.3, 0.7), strips[2])))
    assert [d.regions for d in error.details] == [(1, 2)]
    assert "regions 1–2: gap 0.32 m exceeds the 0.30 m step" in str(error)


def test_all_gaps_are_named_that_must_be_closed():
    strips = region(-1, 0.3), region(0.7, 0.8), region(1.2, 3)
    p = walk(ground(*strips), 1.2, 10, near=0.1)
    closed = region(-1, 0.7), region(0.7, 1.2), strips[2]
    assert possible(replace(p, terrain=ground(*closed[:1], *strips[1:])), PLENTY) is False
    error = explained(p, replace(p, terrain=ground(*closed)))
    assert [d.regions for d in error.details] == [(0, 1), (1, 2)]


def test_a_gap_sideways_is_measured_against_the_step_sideways():
    """The left legs must cross, the right ones must not."""
    strips = region(-1, 1, -1, 0.2), region(-1, 1, 0.4, 2)
    p = Problem(ground(*strips), goal=(0.0, 0.3), goal_tolerance=(0.1, 0.02), slots=6, end_effectors=FEET)
    error = explained(p, replace(p, terrain=ground(region(-1, 1, -1, 0.4), strips[1])))
    assert reason(error, "regions").limit == p.limits.step[1] == 0.15
    assert "regions 0–1: gap 0.20 m exceeds the 0.15 m step" in str(error)


def test_a_gap_wider_than_legs_reach_is_not_blamed_on_the_step():
    def strips(end):
        return ground(region(-1, end), region(0.65, 3))

    p = walk(strips(0.25), 0.75, 6)
    p = limited(p, step=(1.0, 0.15))
    error = explained(p, replace(p, terrain=strips(0.65)))
    found = reason(error, "regions")
    assert "reach" in error.groups and "step" not in error.groups
    assert found.regions == (0, 1)
    assert found.limit + found.missing == pytest.approx(0.4)
    assert possible(replace(p, terrain=strips(0.25 + found.missing - 0.02)), PLENTY) is False


def test_a_step_up_is_measured_against_the_reach():
    p = walk(ground(region(-1, 0.3), region(0.3, 2, z=0.3)), 0.6, 6, near=0.1)
    level = replace(p, terrain=ground(region(-1, 0.3), region(0.3, 2)))
    error = explained(p, level, reaching(p, 2, 0.079))
    assert possible(reaching(p, 2, 0.081), PLENTY) is True
    assert reason(error, "regions").regions == (0, 1)
    assert reason(error, "reach").missing == pytest.approx(0.08, abs=1e-3)
    assert "regions 0–1: 0.30 m up can't be climbed; legs reach 0.04 m up and down" in str(error)


def test_a_start_on_two_levels_names_a_leg_and_its_height():
    p = Problem(ground(region(-1, 0.1), region(0.1, 2, z=0.15)), goal=(0.0, 0.0), slots=2, end_effectors=FEET)
    error = explained(p, reaching(p, 2, 0.036), reaching(p, 2, 0.034))
    assert error.groups == ("start", "reach")
    assert reason(error, "reach").missing == pytest.approx(0.035, abs=1e-6)
    assert re.search(r"leg R[LR] starts at \(-0\.19, -?0\.13, 0\.00\)", str(error))


def test_a_slope_too_steep_for_its_friction():
    slope = math.tan(math.radians(12))
    p = Problem(
        ground(region(-1, 1, slope=slope, mu_foot=0.15)), goal=(0.0, 0.0), slots=3, end_effectors=FEET
    )

    def gripping(mu):
        return replace(p, terrain=ground(region(-1, 1, slope=slope, mu_foot=mu)))

    found = reason(error := explained(p, gripping(slope + 1e-3), gripping(slope - 1e-3)), "friction")
    assert "friction" in error.groups
    assert (found.regions, found.limit) == ((0,), 0.15)
    assert found.missing == pytest.approx(slope - 0.15)
    assert "region 0: the slope of 12.0° exceeds the 8.5° on which a foot holds (mu 0.15)" in str(error)


def test_wheels_on_a_slope_run_away_within_some_slots():
    """Downhill at 1.7 m/s², from whatever speed: the range of 0.9 m/s is passed within the second slot."""
    slope = -math.tan(math.radians(10))
    changes = {"patterns": ((),), "final_stance": False, "start_end_effectors": ("wheel",) * 4}
    p = Problem(ground(region(-1, 3, slope=slope)), goal=(0.0, 0.0), slots=4, **changes)
    error = explained(
        p, replace(p, terrain=ground(region(-1, 3, slope=slope, mu_wheel=0.18))), replace(p, slots=2)
    )
    assert possible(replace(p, slots=1), PLENTY) is True
    assert {"friction", "speed", "patterns"} <= set(error.groups)
    assert reason(error, "friction").slots == (0, 1)
    assert "exceeds the 0.0° on which a wheel holds" in str(error)


def test_a_region_too_small_to_stand_on():
    """Legs may end 0.06 m nearer to each other than nominal; this strip is 0.10 m wide."""

    def strip(more):
        return ground(region(-1, 0.25), region(0.35 - more, 1.1 + more, -0.05 - more, 0.05 + more))

    p = walk(strip(0), 0.6, 6)
    lacks = np.abs(p.robot.stance[:, 1]).max() - 0.06 - 0.05
    error = explained(p, *(replace(p, terrain=strip(lacks + more)) for more in (1e-4, -1e-3)))
    found = reason(error, "regions")
    assert found.regions == (1,)
    assert found.missing == pytest.approx(lacks, abs=1e-4)
    assert f"region 1 is at least {lacks:.3f} m too small" in str(error)


def test_legs_too_weak_for_the_weight():
    p = Problem(FLAT, goal=(0.0, 0.0), slots=3, end_effectors=FEET, limits=Limits(force=0.2))
    error = explained(p, limited(p, force=0.251), limited(p, force=0.249))
    assert "force" in error.groups
    assert reason(error, "force").missing == pytest.approx(0.05, abs=1e-6)
    assert "a leg carries up to 0.20 of the weight, at least 0.05 too little" in str(error)


def test_patterns_without_a_swing():
    p = walk(FLAT, 0.4, 5, patterns=((),))
    error = explained(p, walk(FLAT, 0.4, 5))
    assert {"goal", "patterns"} <= set(error.groups)
    assert "no leg may swing" in str(error)
    assert "the goal (0.40, 0.00) must be met within 0.05 m along x" in str(error)


def test_wheels_all_round_and_no_slot_to_put_a_foot_down():
    p = Problem(FLAT, goal=(0.0, 0.0), slots=1, start_end_effectors=("wheel",) * 4)
    error = explained(p, replace(p, slots=2))
    assert "end" in error.groups
    assert "1 slot of 0.3 s is too few, 2 are enough; one leg must end on a foot" in str(error)


def test_ice_takes_more_time():
    p = walk(ground(region(-1, 2, mu_foot=0.02)), 0.2, 3)
    error = explained(p, replace(p, terrain=FLAT))
    slots = reason(error, "slots")
    enough = int(slots.limit + slots.missing)
    assert possible(replace(p, slots=enough), PLENTY) is True
    assert possible(replace(p, slots=enough - 1), PLENTY) is False
    assert reason(error, "friction").regions == (0,)
    assert "region 0: a foot holds too little (mu 0.02)" in str(error)


def test_a_speed_limit_too_low_for_the_goal():
    p = walk(FLAT, 0.4, 4)
    p = limited(replace(p, beyond_reach=True), speed=(0.2, 0.1))
    found = reason(error := explained(p, limited(p, speed=(0.8, 0.1))), "speed")
    assert {"goal", "speed"} <= set(error.groups)
    assert found.limit == 0.2
    assert possible(limited(p, speed=(0.2 + found.missing - 1e-3, 0.1)), PLENTY) is False
    assert "forward speed is up to 0.20 m/s, at least" in str(error)


def test_steps_too_short_for_the_goal():
    p = walk(FLAT, 0.4, 5)
    found = reason(error := explained(limited(p, step=(0.05, 0.15)), p), "step")
    assert {"goal", "step"} <= set(error.groups)
    assert possible(limited(p, step=(0.05 + found.missing - 1e-3, 0.15)), PLENTY) is False
    assert "steps are up to 0.05 m along x, at least" in str(error)


@pytest.mark.parametrize(
    "p",
    [
        Problem(FLAT, goal=(0.0, 0.0), slots=3, start_offsets=offsets(FL=(0.3, 0.0))),
        walk(ground(region(-1, 0.3), region(0.8, 2)), 0.8, 6, near=0.1),
    ],
)
def test_no_group_can_be_left_out(p):
    elastic = explain.Elastic(p, PLENTY, PLENTY)
    groups = why_not(p).groups

    def feasible(kept):
        return elastic.feasible([part for part in elastic.parts if part.group in kept])

    assert feasible(groups) is False
    for group in groups:
        assert feasible(set(groups) - {group}) is True


@pytest.mark.parametrize("seed", [0, 4, 8, 25, 28, 34])
def test_with_all_limits_the_elastic_program_is_the_problem(seed):
    rng = np.random.default_rng(seed)
    p = random_problem(rng, slots=4)
    goal, near = (rng.uniform(0.3, 0.6), rng.uniform(-0.1, 0.1)), tuple(rng.uniform(0.01, 0.1, 2))
    p = replace(p, goal=goal, goal_tolerance=near)
    elastic = explain.Elastic(p, PLENTY, PLENTY)
    assert elastic.feasible(elastic.parts) is possible(p, PLENTY) is not None
    assert elastic.feasible([]) is True


def test_the_search_raises_the_explanation():
    stones = ground(region(-1, 0.3), region(0.8, 2))
    p = walk(stones, 0.5, 3, near=0.1)
    with pytest.raises(InfeasibleError, match=r"regions 0–1: gap 0\.50 m exceeds the 0\.30 m step"):
        solve(p)


def test_without_time_nothing_is_claimed(monkeypatch):
    p = Problem(FLAT, goal=(0.0, 0.0), slots=3, start_offsets=offsets(FL=(0.3, 0.0)))
    monkeypatch.setattr(explain, "TOTAL", 0.0)
    error = why_not(p)
    assert error.groups == error.details == ()
    assert "could not be told" in str(error)


def test_a_group_that_could_not_be_excluded_is_said_to_be_one(monkeypatch):
    p = Problem(FLAT, goal=(0.0, 0.0), slots=3, start_offsets=offsets(FL=(0.3, 0.0)))
    answer = explain.Elastic.feasible

    def feasible(self, held, *args, **options):
        steps = [part for part in held if part.group == "step"]
        return None if held and not steps else answer(self, held, *args, **options)

    monkeypatch.setattr(explain.Elastic, "feasible", feasible)
    error = why_not(p)
    assert "step" in error.undecided
    assert "step" in error.groups
    assert "no time to tell whether" in str(error)


def test_a_required_goal_is_met_and_survives_the_plan_file():
    p = Problem(FLAT, goal=(0.25, 0.0), goal_tolerance=(0.01, 0.02), slots=3, end_effectors=FEET)
    free, plan = solve(replace(p, goal_tolerance=None), gap=0.05), solve(p, gap=0.05)
    assert abs(free.x[-1, 0] - 0.25) > 0.02
    assert abs(plan.x[-1, 0] - 0.25) < 0.01 + 1e-6
    assert problem_of(plan).goal_tolerance == (0.01, 0.02)
    assert problem_of(free).goal_tolerance is None
    assert plan_checker.check(plan)[0] == []
    (missed,) = plan_checker.check(free.with_meta(options=plan.meta["options"]))[0]
    assert missed.equation == "goal tolerance"


@pytest.mark.parametrize("bad", [(0.1,), (0.1, 0.0), (math.nan, 0.1), 0.1])
def test_wrong_tolerances_are_refused(bad):
    with pytest.raises(ValueError, match=r"^goal_tolerance: "):
        Problem(FLAT, goal_tolerance=bad)


def test_nearest_points_are_as_near_as_any_two():
    rng = np.random.default_rng(4)
    for _ in range(20):
        turn, centre = rng.uniform(0, 2 * np.pi), rng.uniform(-1, 1, 2)
        corners = np.array([[0, 0], [1, 0], [0.8, 0.5], [0.1, 0.6]]) @ [
            [np.cos(turn), np.sin(turn)],
            [-np.sin(turn), np.cos(turn)],
        ]
        first = region(-0.3, 0.4, -0.2, 0.3)
        second = replace(first, vertices=np.column_stack([corners + centre, np.zeros(4)]))
        here, there = nearest_points(first, second)
        assert first.contains(*here, 1e-9) and second.contains(*there, 1e-9)
        weights = rng.dirichlet([0.3] * 4, (2, 2000))
        a, b = weights[0] @ first.vertices[:, :2], weights[1] @ second.vertices[:, :2]
        assert np.linalg.norm(here - there) <= np.linalg.norm(a - b, axis=1).min() + 1e-9


def test_neighbours_grow_from_the_start_by_the_narrowest_gaps():
    strips = region(2.0, 3), region(-1, 0.3), region(0.5, 1.2, -1, 0), region(0.6, 1.5, 0.1, 1)
    found = neighbours(Problem(ground(*strips), goal=(0.0, 0.0), slots=3))
    assert [(n.near, n.far) for n in found] == [(1, 2), (2, 3), (3, 0)]
    assert [n.gap for n in found] == pytest.approx([0.2, 0.1, 0.5])


def test_a_square_is_cut_to_what_is_inside():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    half = clipped(square, [(np.array([1.0, 1.0]), 1.0)])
    assert sorted(map(tuple, half.tolist())) == [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)]
    assert len(clipped(square, [(np.array([1.0, 0.0]), -0.1)])) == 0
