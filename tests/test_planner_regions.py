"""Bounds on several regions: what they cut off must not be missed, what they keep must be there."""

from dataclasses import replace

import numpy as np
import pytest

from wfbook import terrain
from wfbook.planner import NoPlanError, Problem, crossings, solve
from wfbook.planner.bounds import MotionBounds, least, tightened
from wfbook.planner.conic import Solution
from wfbook.planner.gait import Gait
from wfbook.planner.gaits import dive, templates
from wfbook.planner.ground import GroundMap, Places
from wfbook.planner.kernel import Kernel

RAMP = terrain.ramp(start=0.24, length=0.5, rolling_resistance=0.005)
STONES = terrain.stepping_stones(gap=0.1, stone=0.2, start=0.25)


def problem(ground, slots=4, **changes) -> Problem:
    """Return a problem on some ground with a goal that takes every slot."""
    return Problem(ground, **{"goal": (0.1 * slots, 0.0), "slots": slots} | changes)


@pytest.mark.parametrize("ground", [RAMP, terrain.ramp(direction="up", start=0.24), STONES])
def test_the_relaxation_is_below_every_leaf_and_below_no_box_of_it(ground):
    p = problem(ground)
    kernel, checked = Kernel(p), 0
    root = kernel.bound(*kernel.boxes.root()).bound
    gaits = kernel.complete([g for g in templates(p) if kernel.boxes.of_modes(g) is not None][5::6])
    for gait in filter(None, gaits):
        leaf = kernel.leaf(gait)
        if leaf.status != "solved":
            continue
        here = kernel.bound(*(2 * [kernel.boxes.vector(gait)]))
        modes = kernel.gait_bounds([gait.open()])[0]
        assert root <= modes + 1e-4
        assert here.status == "infeasible" or modes <= here.bound + 1e-4  # a mirror image is cut off
        assert min(here.bound, modes) <= leaf.value + 1e-6
        assert leaf.bound <= leaf.value <= leaf.bound * (1 + 1e-3)
        checked += 1
    assert checked >= 3


def test_narrowed_motion_holds_the_optimum_and_its_bound():
    p = problem(RAMP, slots=3)
    plan = solve(p, gap=1e-2)
    kernel = Kernel(p)
    kernel.tighten(plan.meta["objective"] * 1.02)
    narrow, wide, rho = kernel.motion, MotionBounds.of(p), p.knots_per_slot
    x = plan.x[:, 0]
    ends = x[rho::rho]
    assert (narrow.place[0, 0] <= ends).all()
    assert (ends <= narrow.place[1, 0]).all()
    travel = np.diff(x[::rho])
    assert (narrow.travel[0] <= travel).all()
    assert (travel <= narrow.travel[1]).all()
    assert np.ptp(narrow.place[:, 0], axis=0).sum() < 0.9 * np.ptp(wide.place[:, 0], axis=0).sum()
    gait = Gait(plan.S.astype(int), plan.end_effector.astype(int), np.array(plan.meta["regions"]))
    z = kernel.boxes.vector(gait)
    box = kernel.boxes.root()
    assert (box[0] <= z).all()
    assert (z <= box[1]).all()


@pytest.mark.parametrize("seed", range(20))
def test_narrowed_ranges_hold_all_that_is_cheap_in_spite_of_a_rough_solver(seed):
    """Of a quadratic cost the range at a cost of U is known: c·y is least at −√(U c' Q⁻¹ c)."""
    rng = np.random.default_rng(seed)
    p = problem(STONES, slots=3)
    n, cutoff = 4, 10.0 ** rng.uniform(-3, 0)
    root = rng.normal(size=(n, n)) + 2 * np.eye(n)
    inverse = np.linalg.inv(root @ root.T)
    rows = 0.1 * rng.normal(size=(3, n))  # of the order of the decimetres that the first probe expects

    def minimise(linear):
        value = -0.25 * linear @ inverse @ linear  # of y'Qy + linear·y
        return value + rng.uniform(-1, 1) * 1e-5, -0.5 * linear @ inverse @ linear

    wide = replace(MotionBounds.of(p), travel=np.array([[-9.0] * 3, [9.0] * 3]))

    def least_of(rows):
        return [least(row, minimise, 0.0, cutoff) for row in rows]

    narrow = tightened(wide, {"travel": rows}, least_of, lambda: False).travel
    exact = -np.sqrt(cutoff * np.einsum("ji,ik,jk->j", rows, inverse, rows))
    assert (narrow[0] <= exact).all()
    assert (narrow[1] >= -exact).all()
    if cutoff > 1e-2:
        assert (narrow[0] >= 1.1 * exact - 0.01).all(), "two probes come near"


def test_a_ladder_says_which_region():
    p = problem(STONES)
    boxes = Kernel(p).boxes
    rng = np.random.default_rng(0)
    regions = rng.integers(p.ground.count, size=(4, p.slots))
    gait = Gait(np.zeros_like(regions), np.zeros_like(regions), regions)
    assert (boxes.gait(boxes.vector(gait)).region == regions).all()
    assert not boxes.admissible(gait), "a foot that does not swing stays"


def test_a_dive_finds_a_plan_across_gaps():
    p = problem(STONES, slots=5, end_effectors=("foot",))
    (gait,) = dive(Kernel(p))
    assert Kernel(p).leaf(gait).status == "solved"


def test_a_terrain_in_one_plane_is_level_and_its_surfaces_are_one():
    ground = GroundMap.of(STONES)
    assert ground.level == 0.0
    assert len(ground.surfaces) == 1
    assert not ground.rolls_over_edges
    slope = GroundMap.of(RAMP)
    assert slope.level is None
    assert [surface.regions for surface in slope.surfaces] == [(0, 2), (1,)]
    assert slope.rolls_over_edges
    flat = problem(terrain.flat())
    assert Places.of(flat, MotionBounds.of(flat)).axes == (), "wide ground is no constraint"


@pytest.mark.parametrize("seed", range(3))
def test_boxes_of_places_hold_what_a_plan_does(seed):
    rng = np.random.default_rng(seed)
    p = problem(STONES, slots=3, goal=(rng.uniform(0.1, 0.3), 0.0))
    plan = solve(p, gap=0.05)
    places = Places.of(p, MotionBounds.of(p))
    rho = p.knots_per_slot
    for leg in range(4):
        for j in range(p.slots):
            point, r = plan.p[(j + 1) * rho, leg, :2], plan.meta["regions"][leg][j]
            assert places.reachable[r, leg, j]
            assert (places.within[r, :, leg, j] - 1e-6 <= point).all()
            assert (point <= places.upto[r, :, leg, j] + 1e-6).all()


EDGE = problem(
    terrain.ramp(start=0.2, length=0.1),
    slots=2,
    goal=(0.12, 0.0),
    start_end_effectors=("wheel", "wheel", "wheel", "foot"),
    start_offsets=np.array([[0.05, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]),
)
"""Three wheels near an edge: every plan that moves has to say between which knots it crosses."""


@pytest.mark.parametrize("gap", [1e-3, 5e-5])
def test_a_gap_is_proven_over_crossings_too_however_small(gap):
    plan = solve(EDGE, gap=gap)
    assert plan.meta["status"] == "optimal"
    assert plan.meta["gap"] <= gap * (1 + 1e-9)


def test_a_solver_without_an_answer_proves_nothing(monkeypatch):
    real = crossings.solve_fixed

    def silent(conic, columns, values):
        found = real(conic, columns, values)
        return found if len(columns) < crossings_known else Solution("failed", np.nan, -np.inf, found.y)

    few = replace(EDGE, slots=1, goal=(0.02, 0.0), patterns=((),))
    crossings_known = sum(v.size for v in Kernel(few).program.discrete.values())
    monkeypatch.setattr(crossings, "solve_fixed", silent)
    # Every gait with all integers fixed is without an answer: neither a plan nor a proof that there is none.
    with pytest.raises(NoPlanError, match="could not tell"):
        solve(few)
