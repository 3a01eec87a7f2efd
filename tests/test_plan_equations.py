"""Every plan satisfies every equation it claims, and no mutation of it does."""

import numpy as np
import plan_checker
import pytest

from wfbook.planner import Problem, polish, solve
from wfbook.terrain import flat

PROBLEMS = {
    "feet": {"goal": (0.3, 0.0), "slots": 4, "end_effectors": ("foot",)},
    "feet, sideways": {"goal": (0.1, -0.1), "slots": 4, "end_effectors": ("foot",)},
    "feet and wheels": {"goal": (0.4, 0.0), "slots": 4},
    "wheels with friction": {"goal": (0.4, 0.05), "slots": 4, "terrain": flat(0.02)},
    "from a stance on wheels": {"goal": (0.3, 0.0), "slots": 4, "start_end_effectors": ("wheel", "foot") * 2},
}
EQUATIONS = {"1", "9 U+", "9 U-", "10-15", "13-14", "16", "17", "19", "22", "26", "28", "30", "bound", "gap"}
TOLERANCE = 1e-6


@pytest.fixture(scope="module", params=PROBLEMS)
def stages(request):
    """The relaxed and the polished plan of a problem."""
    relaxed = solve(Problem(**{"terrain": flat()} | PROBLEMS[request.param]), gap=0.01, time_limit=60.0)
    return relaxed, polish(relaxed)


def file_of(plan, tmp_path):
    """The plan's arrays as they stand in its file, which the checker reads without the library."""
    plan.save(tmp_path / "plan.npz")
    with np.load(tmp_path / "plan.npz", allow_pickle=False) as data:
        return dict(data)


@pytest.mark.parametrize("stage", [0, 1], ids=["relaxed", "polished"])
def test_every_equation_holds(stages, stage, tmp_path):
    """Eqs 1 to 17, 19 to 23 and 26 to 33, by a checker that knows no library."""
    violations, worst = plan_checker.check(file_of(stages[stage], tmp_path), TOLERANCE)
    assert violations == []
    assert set(worst) >= EQUATIONS | ({"8"} if stage else set())
    assert stages[stage].meta["stage"] == ("relaxed", "polished")[stage]


def test_polish_keeps_gait_and_record(stages):
    relaxed, polished = stages
    np.testing.assert_array_equal(relaxed.S, polished.S)
    np.testing.assert_array_equal(relaxed.D, polished.D)
    for name in ("objective", "bound", "gap"):
        assert relaxed.meta[name] == polished.meta[name]


def test_the_polished_torque_is_true(stages):
    _, polished = stages
    lever = polished.p - polished.x[:, None]
    torque = np.cross(0.5 * (lever[1:] + lever[:-1]), polished.lam).sum(axis=1)
    missing = polished.alpha @ np.array(polished.meta["inertia"]).T - torque
    assert np.sqrt((missing**2).mean(axis=0)).max() <= 0.1


# The array to disturb, and what the checker must name at least one of.
DISTURBED = {
    "x": {"integration of x"},
    "v": {"integration of v"},
    "theta": {"integration of theta"},
    "omega": {"integration of omega"},
    "a": {"1"},
    "alpha": {"integration of omega"},
    "p": {"2-6", "19", "20", "21", "22", "23"},
    "lam": {"1", "7", "26"},
    "f": {"7", "28", "29"},
    "U_plus": {"9 sum", "9 U+"},
    "U_minus": {"9 sum", "9 U-"},
    "c": {"10-15"},
}


@pytest.mark.parametrize("stage", [0, 1], ids=["relaxed", "polished"])
@pytest.mark.parametrize("name", DISTURBED)
def test_any_number_changed_is_named(stages, stage, name, tmp_path):
    """Eqs 1 to 7, 9 to 15, 19 to 23, 26, 28 and 29 notice."""
    arrays = file_of(stages[stage], tmp_path)
    rng = np.random.default_rng(1)
    weight = stages[stage].meta["mass"] * plan_checker.GRAVITY
    size = 1e-3 * (weight if name in ("lam", "f", "U_plus", "U_minus") else 1.0)
    for _ in range(5):
        changed = arrays[name].copy()
        changed[tuple(rng.integers(n) for n in changed.shape)] += size
        violations, _ = plan_checker.check(arrays | {name: changed}, TOLERANCE)
        assert DISTURBED[name] & {violation.equation for violation in violations}


@pytest.mark.parametrize("name", ["S", "D"])
def test_any_binary_flipped_is_named(stages, name, tmp_path):
    arrays = file_of(stages[1], tmp_path)
    for index in np.ndindex(arrays[name].shape):
        changed = arrays[name].copy()
        changed[index] = 1 - changed[index]
        violations, _ = plan_checker.check(arrays | {name: changed}, TOLERANCE)
        assert violations
