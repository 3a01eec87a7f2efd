"""One leg's path: what its modes say of its motion, and whether the planner's own program agrees."""

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest

from wfbook.centroidal import Robot
from wfbook.leg_path import Ride, bank_and_deck, leg_path
from wfbook.modes import broken_rules, legal_rows
from wfbook.planner import InitialState, Problem, bigm
from wfbook.planner.problem import Limits

GROUPS = ("start", "motion", "step", "regions", "modes", "reach x")
"""Those of the big-M program that concern one leg's motion along x."""


def rows(ride: Ride, swings: str, modes: str) -> tuple[np.ndarray, np.ndarray]:
    S, D = np.array([int(s) for s in swings]), np.zeros((len(swings), len(ride.terrain.regions), 2), int)
    for j, mode in enumerate(modes.split()):
        D[j, int(mode[1]), "fw".index(mode[0])] = 1
    assert not broken_rules(S[None], D[None], ride.start_dynamics[None])
    return S, D


@pytest.fixture
def ride() -> Ride:
    return Ride(bank_and_deck())


def test_a_foot_stays_and_a_wheel_goes_with_the_body(ride):
    path = leg_path(ride, *rows(ride, "010000", "f0 w1 w1 w1 w1 w1"))
    assert path.broken == []
    assert np.allclose(path.x[:4], 0.0)
    assert np.allclose(np.diff(path.x[6:]), np.diff(ride.hip[6:])), "eq. 20"
    assert path.region[6:].tolist() == [1] * 7 + [2] * 6, "eqs 23 to 25: over the edge without a swing"


def test_a_swing_is_the_spline_of_chapter_2(ride):
    """Eq. 6."""
    path = leg_path(ride, *rows(ride, "010010", "f0 w1 w1 w1 f2 f2"))
    assert path.broken == []
    step = 1e-5
    speeds = [
        (path.along(1, [step]) - path.along(1, [0.0]))[0],
        (path.along(1, [1.0]) - path.along(1, [1 - step]))[0],
        (path.along(4, [step]) - path.along(4, [0.0]))[0],
        (path.along(4, [1.0]) - path.along(4, [1 - step]))[0],
    ]
    assert np.allclose(np.array(speeds) / (step * ride.slot_duration), [0, 0.5, 0.5, 0], atol=1e-3)
    assert path.heights(1, [0.5])[0] == pytest.approx(ride.swing_height)
    for j in range(5):
        assert path.along(j, [1.0]) == pytest.approx(path.along(j + 1, [0.0]), abs=1e-9)
        assert path.heights(j, [1.0]) == pytest.approx(path.heights(j + 1, [0.0]), abs=1e-6)


def test_landings_are_as_near_below_the_hip_as_they_may_be(ride):
    free = leg_path(ride, *rows(ride, "010000", "f0 w1 w1 w1 w1 w1"))
    assert free.ends[2] == pytest.approx(ride.hip[6], abs=1e-6)
    fast = replace(ride, speed=0.4)
    held = leg_path(fast, *rows(fast, "010000", "f0 w1 w1 w1 w1 w1"))
    assert held.ends[2] == pytest.approx(fast.intervals[1, 0], abs=1e-6), "the deck begins beyond the hip"


@pytest.mark.parametrize(
    "swings, modes, rule, slot, words",
    [
        ("100000", "w0 w0 w0 w0 w0 w0", "eq. 23", 1, "the wheel rolls"),
        ("100000", "f2 f2 f2 f2 f2 f2", "eq. 22", 0, "the foot lands"),
        ("000000", "f0 f0 f0 f0 f0 f0", "eq. 30", 1, "reaches from its hip"),
    ],
)
def test_what_can_not_be_is_named(ride, swings, modes, rule, slot, words):
    first = leg_path(ride, *rows(ride, swings, modes)).broken[0]
    assert (first.rule, first.slot) == (rule, slot) and words in first.reason


def test_the_path_does_not_depend_on_where_the_world_begins(ride):
    S, D = rows(ride, "010010", "f0 w1 w1 w1 f2 f2")
    moved = [replace(r, vertices=r.vertices + np.array([3.0, 0.5, 0.0])) for r in ride.terrain.regions]
    other = replace(ride, terrain=replace(ride.terrain, regions=tuple(moved)), start=3.0, y=0.5)
    assert np.allclose(leg_path(other, S, D).x - 3.0, leg_path(ride, S, D).x, atol=1e-6)


def test_wrong_rows_are_refused(ride):
    S, D = rows(ride, "000000", "f0 f0 f0 f0 f0 f0")
    with pytest.raises(ValueError, match="shapes"):
        leg_path(ride, S[:5], D)
    D[2] = 0
    with pytest.raises(ValueError, match=r"eq\. 17"):
        leg_path(ride, S, D)
    with pytest.raises(ValueError, match="no region"):
        Ride(bank_and_deck(), start=0.2)


class PapersProgram:
    """The big-M program of a robot whose four legs are one behind the other's side: all have one x."""

    def __init__(self, ride: Ride):
        robot = replace(
            Robot.go1(),
            stance=np.array([[0, 0.3], [0, -0.3], [0, 0.1], [0, -0.1]]),
            reach=(ride.reach, 0.08, 9.0),
        )
        body = np.array([ride.start, 0.0, robot.height])
        state = InitialState(
            body, np.array([ride.speed, 0, 0]), np.zeros(3), np.zeros(3),
            np.column_stack([robot.stance + np.array([ride.start, 0.0]), np.zeros(4)]), np.zeros(4, bool),
        )  # fmt: skip
        problem = Problem(
            ride.terrain,
            goal=(0.3, 0.0),
            slots=ride.slots,
            start_end_effectors=(ride.end_effector,) * 4,
            start=(ride.start, 0.0),
            initial=state,
            stance_between_swings=False,
            final_stance=False,
            beyond_reach=True,
            robot=robot,
            limits=Limits(step=(ride.step, 0.15)),
        )
        self.program = bigm.build(problem)
        rows = [row for group in GROUPS for row in self.program.constraints[group]]
        rows += [self.program.x[0] == ride.hip, self.program.v[0] == ride.speed]
        self.S, self.D = (
            cp.Parameter(ride.slots),
            [cp.Parameter((ride.slots, 2)) for _ in ride.terrain.regions],
        )
        for leg in range(4):
            rows.append(self.program.discrete["S"][leg] == self.S)
            for r, D in enumerate(self.D):
                rows += [
                    self.program.discrete["D", r, e][leg] == D[:, i] for i, e in enumerate(("foot", "wheel"))
                ]
        self.problem = cp.Problem(cp.Minimize(0), rows)

    def allows(self, S: np.ndarray, D: np.ndarray) -> bool:
        self.S.value = S
        for r, part in enumerate(self.D):
            part.value = D[:, r]
        self.problem.solve(solver=cp.HIGHS)
        assert self.problem.status in ("optimal", "infeasible"), self.problem.status
        return self.problem.status == "optimal"


def test_the_papers_program_has_a_path_where_this_one_breaks_nothing():
    """Eqs 18 to 25, against the big-M program's own rows."""
    ride = Ride(bank_and_deck(), slots=3, start=0.05, speed=0.43)
    paper, rng = PapersProgram(ride), np.random.default_rng(4)
    every = list(legal_rows(ride.slots, ride.start_dynamics))
    agreed = []
    for i in rng.permutation(len(every))[:60]:
        S, D = every[i]
        ours = leg_path(ride, S, D)
        assert paper.allows(S, D) == (not ours.broken), (S, D, ours.broken)
        agreed.append(not ours.broken)
    assert 5 < sum(agreed) < 55
