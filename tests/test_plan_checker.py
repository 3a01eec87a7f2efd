"""The checker must accept a valid plan and name the equation of every broken one."""

import copy

import numpy as np
import plan_checker
import pytest
from handmade import (
    APEX,
    FOOT,
    HEIGHT,
    HIPS,
    INERTIA,
    MASS,
    RHO,
    WEIGHT,
    WHEEL,
    cost,
    integrate,
    roll_off_landing,
    roll_over_edge,
    squares,
    step_onto_stones,
    with_meta,
)

from wfbook.terrain import flat

G, DT, K = 9.81, 0.1, 9


def hand_made_plan(rolling_resistance=0.0, stage="relaxed"):
    """Three slots: FL and RR swing as feet in the second, FR and RL stand on wheels, the body coasts at rest.

    The two standing legs share the weight so that nothing turns; U± lie above their squares by the same
    amount, which makes no torque.
    """
    J = 3
    x = np.tile([0.0, 0.0, HEIGHT], (K + 1, 1))
    p = np.add(np.tile(HIPS, (K + 1, 1, 1)), [0, 0, HEIGHT])
    S = np.zeros((4, J), np.int8)
    S[[0, 3], 1] = 1
    D = np.zeros((4, J, 1, 2), np.int8)
    kinds = np.array([FOOT, WHEEL, WHEEL, FOOT])
    D[np.arange(4), :, 0, kinds] = 1
    D[3, 1:, 0] = [0, 1]  # RR lands on a wheel
    s = np.arange(1, RHO) / RHO
    step = 10 * s**3 - 15 * s**4 + 6 * s**5
    lift = 64 * s**3 * (1 - s) ** 3
    for leg, sign in ((0, 1), (3, -1)):
        p[4:6, leg, 0] += sign * 0.03 * step
        p[4:6, leg, 2] += APEX * lift
        p[6:, leg, 0] += sign * 0.03
    lam = np.zeros((K, 4, 3))
    lam[:, :, 2] = WEIGHT / 4
    lam[3:6, [0, 3], 2] = 0
    lam[3:6, [1, 2], 2] = WEIGHT / 2
    f = np.zeros((K, 4, 3))
    wheel = np.zeros((K, 4), bool)
    wheel[:, 1:3] = True
    wheel[6:, 3] = True
    f[..., 0] = -rolling_resistance * lam[..., 2] * wheel
    foot_push = -f[..., 0].sum(axis=1)
    lam[:3, [0, 3], 0] = foot_push[:3, None] / 2
    lam[6:, 0, 0] = foot_push[6:]
    a = (lam + f).sum(axis=1) / MASS - [0, 0, G]
    v, x = integrate(a, x[0])
    p[:, 1:3, 0] += (x[:, 0] - x[0, 0])[:, None]
    p[6:, 3, 0] += x[6:, 0] - x[6, 0]
    p[:] = _swing_landing(p, v)
    U_plus, U_minus = squares(x, p, lam)
    alpha = np.zeros((K, 3))
    if stage == "relaxed":
        # Slack on U+ or U- of one leg takes up the torque that the forces make.
        torque = (U_plus - U_minus).sum(axis=1) / 4
        U_plus[:, 0] += np.maximum(0, -4 * torque)
        U_minus[:, 0] += np.maximum(0, 4 * torque)
    else:
        alpha = np.linalg.solve(INERTIA, (U_plus - U_minus).sum(axis=1).T / 4).T
    omega, theta = integrate(alpha, np.zeros(3))
    standing = np.repeat(S == 0, RHO, axis=1).T
    c = np.array([p[k + 1, standing[k]].mean(axis=0) for k in range(K)])
    plan = {
        "t": DT * np.arange(K + 1), "x": x, "v": v, "theta": theta, "omega": omega, "a": a, "alpha": alpha,
        "p": p, "lam": lam, "f": f, "U_plus": U_plus, "U_minus": U_minus, "S": S, "D": D, "c": c,
        "terrain": flat(rolling_resistance).to_dict(),
    }  # fmt: skip
    final_stance = rolling_resistance == 0 and stage == "relaxed"
    return with_meta(plan, (FOOT, WHEEL, WHEEL, FOOT), final_stance, stage)


def _swing_landing(p, v):
    """Bend RR's swing so that its wheel lands at the body's speed: T v (-4 s³ + 7 s⁴ - 3 s⁵)."""
    p = p.copy()
    s = np.arange(1, RHO) / RHO
    p[4:6, 3, 0] += RHO * DT * v[6, 0] * (-4 * s**3 + 7 * s**4 - 3 * s**5)
    return p


VARIANTS = [(0.0, "relaxed"), (0.0, "polished"), (0.01, "relaxed"), (0.01, "polished")]


@pytest.mark.parametrize(("resistance", "stage"), VARIANTS)
def test_a_valid_plan_passes(resistance, stage):
    violations, worst = plan_checker.check(hand_made_plan(resistance, stage))
    assert violations == []
    assert max(worst.values()) < 1e-9
    named = " ".join(worst).split()
    expected = {"1", "2-6", "7", "8", "10-15", *map(str, (16, 17, *range(19, 24), 26, 28, 29, 30))}
    assert expected <= set(named)


ON_REGIONS = {
    "feet step onto stones": step_onto_stones,
    "wheels roll down": roll_over_edge,
    "wheels roll up": lambda: roll_over_edge(15.0, "up"),
    "a wheel lands on a ramp and leaves it": roll_off_landing,
}


@pytest.fixture(scope="module")
def on_regions():
    """The plans on several regions, made once."""
    return {name: make() for name, make in ON_REGIONS.items()}


@pytest.mark.parametrize("name", ON_REGIONS)
def test_a_valid_plan_on_several_regions_passes(on_regions, name):
    violations, worst = plan_checker.check(on_regions[name])
    assert violations == []
    assert max(worst.values()) < 1e-9
    assert {"22", "26", "force limit", "start", "31-33"} <= set(worst)


def test_the_plans_on_regions_do_what_they_are_for(on_regions):
    """Else a checker blind to regions would pass all tests."""
    stones, down, _, landing = on_regions.values()
    assert stones["D"][0, -1, 1, FOOT] and stones["D"][1, -1, 2, FOOT]
    for plan, first in ((down, 0), (landing, 1)):
        region = plan_checker.Trajectory(plan).planes
        assert plan["D"][0, -1, first, WHEEL]
        assert region[first].distance(plan["p"][-1, 0]) > 1e-3
        assert region[first + 1].distance(plan["p"][-1, 0]) < 1e-12
        assert 0 < plan["p"][-1, 0, 0] - region[first + 1].corners[:, 0].min() < 0.1


@pytest.mark.parametrize("make", [hand_made_plan, *ON_REGIONS.values()])
def test_the_objective_is_that_of_eqs_31_to_33(make):
    plan = make()
    assert plan_checker.objective(plan) == pytest.approx(cost(plan), rel=1e-12)


def test_forces_in_the_basis_of_the_wrong_region_break_friction_alone(on_regions):
    violations, _ = plan_checker.check(roll_over_edge(forces_on="D"))
    assert {v.equation for v in violations} == {"26", "29"}
    assert {v.leg for v in violations} == {"FL", "FR"}
    beyond = np.flatnonzero(on_regions["wheels roll down"]["p"][:-1, 0, 0] > 0.24)
    assert {v.knot for v in violations} == set(beyond), "on the way over the edge either region will do"


# What is broken, and the equation that must be named. Other equations may break along with it.
MUTATIONS = {
    "newton": (lambda q: q["a"].__setitem__((2, 1), 0.01), "1"),
    "force without weight": (lambda q: q["lam"].__imul__(1.001), "1"),
    "speed jumps": (lambda q: q["v"].__setitem__((4, 1), 1e-3), "integration of v"),
    "body jumps": (lambda q: q["x"].__setitem__((4, 1), 1e-3), "integration of x"),
    "rate jumps": (lambda q: q["omega"].__setitem__((4, 0), 1e-2), "integration of omega"),
    "angle jumps": (lambda q: q["theta"].__setitem__((4, 2), 1e-3), "integration of theta"),
    "torque from nowhere": (
        lambda q: q["U_plus"].__setitem__((2, 1, 1), q["U_plus"][2, 1, 1] + 0.1),
        "9 sum",
    ),
    "upper bound below squares": (lambda q: _shift(q, "U_plus", -0.1), "9 U+"),
    "lower bound below squares": (lambda q: _shift(q, "U_minus", -0.1), "9 U-"),
    "mismatch left out": (lambda q: q["meta"].__setitem__("torque_mismatch_nm", [0.5, 0.5, 0.5]), "8"),
    "swing off its spline": (lambda q: q["p"].__setitem__((4, 0, 0), q["p"][4, 0, 0] + 1e-3), "2-6"),
    "swing sideways": (lambda q: q["p"].__setitem__((5, 0, 1), q["p"][5, 0, 1] + 1e-3), "2-6"),
    "swing too low": (lambda q: q["p"].__setitem__((4, 3, 2), q["p"][4, 3, 2] - 1e-3), "2-6"),
    "another apex": (lambda q: q["meta"].__setitem__("swing_height", 0.05), "2-6"),
    "force in the air": (lambda q: q["lam"].__setitem__((4, 0, 2), 1.0), "7"),
    "friction in the air": (lambda q: q["f"].__setitem__((4, 0, 0), -0.1), "7"),
    "centroid of all legs": (lambda q: q["c"].__setitem__(4, q["p"][5].mean(axis=0)), "10-15"),
    "centroid of a knot too early": (lambda q: q["c"].__setitem__(5, q["c"][5] + [0.01, 0, 0]), "10-15"),
    "switch in stance": (lambda q: _switch(q, 0, 2), "16"),
    "other end effectors at start": (
        lambda q: q["meta"].__setitem__("start_end_effectors", ["wheel"] * 4),
        "16",
    ),
    "two modes at once": (lambda q: q["D"].__setitem__((1, 0, 0, 0), 1), "17"),
    "no mode": (lambda q: q["D"].__setitem__((1, 1), 0), "17"),
    "pair of one side": (lambda q: q["S"].__setitem__((slice(None), 1), [1, 0, 1, 0]), "swing pattern"),
    "all legs swing": (lambda q: q["S"].__setitem__((slice(None), 1), 1), "13-14"),
    "foot slides": (lambda q: q["p"].__setitem__((2, 0, 0), q["p"][2, 0, 0] + 1e-3), "19"),
    "wheel slips": (lambda q: q["p"].__setitem__((2, 1, 0), q["p"][2, 1, 0] + 1e-3), "20"),
    "wheel scrubs": (lambda q: q["p"].__setitem__((2, 1, 1), q["p"][2, 1, 1] + 1e-3), "21"),
    "foot under ground": (lambda q: q["p"][:, 0].__isub__([0, 0, 1e-3]), "22"),
    "wheel above ground": (lambda q: q["p"][:, 1].__iadd__([0, 0, 1e-3]), "23"),
    "foot beside the region": (
        lambda q: q["terrain"]["regions"][0].__setitem__("vertices", _narrow(0.1)),
        "22",
    ),
    "wheel beside the region": (
        lambda q: q["terrain"]["regions"][0].__setitem__("vertices", _narrow(0.1)),
        "23",
    ),
    "foot pulls": (lambda q: q["lam"].__setitem__((1, 0, 2), -1.0), "26"),
    "foot slips": (lambda q: q["lam"].__setitem__((1, 0, 0), 0.8 * q["lam"][1, 0, 2]), "26"),
    "wheel drives": (lambda q: q["lam"].__setitem__((1, 1, 0), 0.5), "26"),
    "wheel slips sideways": (lambda q: q["lam"].__setitem__((1, 1, 1), 0.8 * q["lam"][1, 1, 2]), "26"),
    "friction on a foot": (lambda q: q["f"].__setitem__((1, 0, 0), -0.1), "28"),
    "friction that pushes": (lambda q: q["f"].__setitem__((1, 1, 0), 0.1), "29"),
    "out of reach": (lambda q: q["meta"]["reach_upper"][0].__setitem__(0, 0.2), "30"),
    "too high": (lambda q: q["meta"]["reach_lower"][2].__setitem__(2, -0.264), "30"),
    "start in motion": (lambda q: q["v"].__setitem__((0, 0), 0.1), "start"),
    "start elsewhere": (lambda q: q["meta"].__setitem__("start", [0.1, 0.0]), "start"),
    "too fast": (lambda q: q["v"].__setitem__((4, 0), 0.9), "speed limit"),
    "too fast backward": (lambda q: q["v"].__setitem__((4, 0), -0.2), "speed limit"),
    "too fast sideways": (lambda q: q["v"].__setitem__((4, 1), 0.4), "speed limit"),
    "tilted": (lambda q: q["theta"].__setitem__((4, 1), -0.4), "angle limit"),
    "one leg carries all": (lambda q: q["lam"].__setitem__((1, 0, 2), WEIGHT), "force limit"),
    "long step": (lambda q: q["meta"]["limits"].__setitem__("step", [0.02, 0.02]), "step limit"),
    "wide stance at the end": (
        lambda q: q["meta"]["limits"].__setitem__("rest_offset", [0.02, 0.02]),
        "rest offset",
    ),
    "end in motion": (lambda q: q["v"].__setitem__((-1, 0), 0.1), "end at rest"),
    "last slot swings": (lambda q: q["S"].__setitem__((1, 2), 1), "final stance"),
    "no foot at the end": (lambda q: _switch(q, 0, 0), "foot at rest"),
    "swings twice": (lambda q: q["S"].__setitem__((0, 2), 1), "stance between swings"),
    "another objective": (
        lambda q: q["meta"].__setitem__("objective", q["meta"]["objective"] * 1.01),
        "31-33",
    ),
    "another weight": (lambda q: q["meta"]["weights"].__setitem__("swing", 0.6), "31-33"),
    "bound above objective": (
        lambda q: q["meta"].__setitem__("bound", q["meta"]["objective"] * 1.01),
        "bound",
    ),
    "gap told too small": (lambda q: q["meta"].__setitem__("gap", 0.0), "gap"),
    "half-way number": (lambda q: q.__setitem__("S", q["S"] * 0.5), "binary S"),
    "missing knot": (lambda q: q.__setitem__("x", q["x"][:-1]), "shape of x"),
    "not a number": (lambda q: q["lam"].__setitem__((0, 0, 0), np.nan), "finite lam"),
    "uneven time": (lambda q: q["t"].__setitem__(3, 0.31), "even time"),
}


def _shift(plan, name, amount):
    """Move one bound on both of two legs, so that the sum of torques stays."""
    for leg, sign in ((1, 1), (0, -1)):
        plan[name][2, leg, 1] += sign * amount


def _switch(plan, leg, first_slot):
    plan["D"][leg, first_slot:, 0] = plan["D"][leg, first_slot:, 0, ::-1]


def _narrow(width):
    return [[-2, -width, 0], [2, -width, 0], [2, width, 0], [-2, width, 0]]


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_broken_plan_is_named(name):
    breaks, equation = MUTATIONS[name]
    plan = copy.deepcopy(hand_made_plan())
    breaks(plan)
    violations, worst = plan_checker.check(plan)
    assert equation in {violation.equation for violation in violations}
    assert not worst[equation] <= 1e-5


@pytest.mark.parametrize("name", ["U_plus", "U_minus"])
def test_polished_bounds_are_the_squares_themselves(name):
    plan = hand_made_plan(stage="polished")
    plan[name] += 0.1
    assert f"9 U{'+' if name == 'U_plus' else '-'}" in {v.equation for v in plan_checker.check(plan)[0]}


def test_a_violation_says_where():
    plan = hand_made_plan()
    plan["f"][1, 0, 0] = -0.1
    violations, _ = plan_checker.check(plan)
    found = next(v for v in violations if v.equation == "28")
    assert (found.leg, found.knot) == ("FL", 1)
    assert found.amount == pytest.approx(0.1 / WEIGHT)


def _name_region(plan, leg, first_slot, region):
    """Let D say that a leg is on another region, from a slot on."""
    D = plan["D"][leg, first_slot:]
    D[:, region] = D.sum(axis=1)
    D[:, np.arange(D.shape[1]) != region] = 0


def _regions(plan):
    return plan["terrain"]["regions"]


def _one_group(plan):
    for region in _regions(plan):
        region["group"] = "all"


def _use_group(plan, *elsewhere):
    _one_group(plan)
    _name_region(plan, *elsewhere)


def _move(plan, region, *by):
    _regions(plan)[region]["vertices"] = np.add(_regions(plan)[region]["vertices"], by).tolist()


def _roof(plan):
    """A second deck right above the first."""
    _regions(plan).append(_regions(plan)[0] | {"group": "roof"})
    _move(plan, -1, 0, 0, 0.02)
    plan["D"] = np.pad(plan["D"], ((0, 0), (0, 0), (0, 1), (0, 0)))


def _limit_between_normals(plan):
    """A limit that FL's force keeps along the platform's normal and exceeds along the ramp's."""
    ramp = plan_checker.Trajectory(plan).planes[1]
    plan["lam"][-1, 0] *= 3
    plan["meta"]["limits"]["force"] = (plan["lam"][-1, 0, 2] + ramp.n @ plan["lam"][-1, 0]) / 2 / WEIGHT


def _height_term_of_flat_ground(plan):
    """The cost if height counted from that of the start, as on flat ground."""
    z, p = plan["x"][1:, 2], plan_checker._ground(plan_checker.Trajectory(plan))[1:]
    plan["meta"]["objective"] += 0.5 * (((z - plan["x"][0, 2]) ** 2).sum() - ((z - HEIGHT - p) ** 2).sum())


STONES, DOWN, LANDING = "feet step onto stones", "wheels roll down", "a wheel lands on a ramp and leaves it"
# The plan, what is broken, and the equation and the leg that must be named.
REGION_MUTATIONS = {
    "wheel above the ramp": (DOWN, lambda q: q["p"][7, 0].__iadd__([0, 0, 1e-3]), "23", "FL"),
    "wheel goes on level": (DOWN, lambda q: q["p"].__setitem__((slice(None), 1, 2), 0.0), "23", "FR"),
    "wheel leaves its group": (DOWN, lambda q: _regions(q)[1].__setitem__("group", "x"), "23", "FL"),
    "wheel drives on the ramp": (DOWN, lambda q: q["lam"].__setitem__((9, 0, 0), 0.0), "26", "FL"),
    "friction pushes on the ramp": (DOWN, lambda q: q["f"][9, 0].__imul__(-1), "29", "FL"),
    "friction is level": (DOWN, lambda q: q["f"].__setitem__((9, 0, 2), 0.0), "29", "FL"),
    "large along the ramp's normal": (DOWN, _limit_between_normals, "force limit", "FL"),
    "wheel starts elsewhere": (DOWN, lambda q: _name_region(q, 0, 0, 1), "22", "FL"),
    "wheel lands elsewhere": (DOWN, lambda q: _name_region(q, 2, 1, 1), "22", "RL"),
    "wheel lands where it rolls to": (LANDING, lambda q: _name_region(q, 0, 1, 2), "22", "FL"),
    "D follows the wheel": (DOWN, lambda q: _name_region(q, 0, 3, 1), "16", "FL"),
    "foot over an edge": (STONES, lambda q: _move(q, 1, 0.16, 0, 0.15 * 0.16), "22", "FL"),
    "foot beside a leaning stone": (STONES, lambda q: _move(q, 2, 0, 0.1, 0.12 * 0.1), "22", "FR"),
    "foot in a stone": (STONES, lambda q: _move(q, 1, 0, 0, 1e-3), "22", "FL"),
    "foot lands elsewhere": (STONES, lambda q: _name_region(q, 1, 3, 0), "22", "FR"),
    "foot elsewhere in its group": (STONES, lambda q: _use_group(q, 0, 1, 0), "22", "FL"),
    "foot holds by the deck's pyramid": (
        STONES,
        lambda q: q["lam"].__setitem__((-1, 0), np.array([0.65, 0, 1]) * q["lam"][-1, 0, 2]),
        "26",
        "FL",
    ),
    "arc above the lower end": (STONES, lambda q: q["p"].__setitem__((4, 0, 2), 0.05), "2-6", "FL"),
    "start under a roof": (STONES, _roof, "start", "RR"),
    "start too high": (STONES, lambda q: q["meta"].__setitem__("com_height", HEIGHT - 1e-3), "start", None),
    "height as on flat ground": (STONES, _height_term_of_flat_ground, "31-33", None),
}


@pytest.mark.parametrize("name", REGION_MUTATIONS)
def test_a_plan_broken_on_several_regions_is_named(on_regions, name):
    which, breaks, equation, leg = REGION_MUTATIONS[name]
    plan = copy.deepcopy(on_regions[which])
    breaks(plan)
    violations, _ = plan_checker.check(plan)
    assert (equation, leg) in {(violation.equation, violation.leg) for violation in violations}


def test_feet_care_for_no_group(on_regions):
    plan = copy.deepcopy(on_regions[STONES])
    _one_group(plan)
    assert plan_checker.check(plan)[0] == []
