"""Chapter 10: cones of contact wrenches against real contact forces, and the penalty against differences."""

import numpy as np
import pytest

from wfbook.omni.wrench import (
    COMPONENTS,
    decoupled,
    end_forces,
    line_contact,
    line_ends,
    penalty,
    penalty_derivatives,
    point_contact,
    polygon,
    printed,
    surface_contact,
    wrench_of,
)

MU, WIDTH, LENGTH = 0.6, 0.05, 0.12
CORNERS = 0.5 * np.array([[LENGTH, WIDTH, 0], [LENGTH, -WIDTH, 0], [-LENGTH, WIDTH, 0], [-LENGTH, -WIDTH, 0]])


def forces_in_pyramids(random, points, count=4000):
    """Forces in the friction pyramid at each point, many of them on its sides or with nothing at all."""
    press = random.exponential(50.0, (count, points)) * (random.random((count, points)) < 0.8)
    share = np.clip(random.uniform(-1.5, 1.5, (count, points, 2)), -1.0, 1.0)
    return np.concatenate([MU * press[..., None] * share, press[..., None]], axis=-1)


def forces_of(wrench, points):
    """Forces in the pyramids at points that add up to a wrench, by linear programming; None if none do."""
    from scipy.linalg import block_diag
    from scipy.optimize import linprog

    pyramid = np.array([[0, 0, -1], [1, 0, -MU], [-1, 0, -MU], [0, 1, -MU], [0, -1, -MU]])
    cross = [[[0, -z, y], [z, 0, -x], [-y, x, 0]] for x, y, z in points]
    sums = np.vstack([np.tile(np.eye(3), len(points)), np.hstack(cross)])
    rows = block_diag(*[pyramid] * len(points))
    answer = linprog(np.zeros(3 * len(points)), rows, np.zeros(len(rows)), sums, wrench, bounds=(None, None))
    return answer.x.reshape(-1, 3) if answer.status == 0 else None


@pytest.mark.parametrize(
    ("cone", "points"),
    [
        (point_contact(MU), np.zeros((1, 3))),
        (line_contact(MU, WIDTH), line_ends(WIDTH)),
        (line_contact(MU, WIDTH), np.array([[0.0, y, 0.0] for y in np.linspace(-0.5, 0.5, 7) * WIDTH])),
        (surface_contact(MU, LENGTH, WIDTH), CORNERS),
        (decoupled(MU, (WIDTH / 2, 0.0, MU * WIDTH / 2)), line_ends(WIDTH)),
    ],
)
def test_a_wrench_of_real_forces_satisfies_every_row(cone, points):
    forces = forces_in_pyramids(np.random.default_rng(0), len(points))
    wrenches = wrench_of(points, forces)
    residual = cone.residual(wrenches)
    assert residual.max() < 1e-9
    if len(points) != 7:  # between the ends one would have to meet the right forces by chance
        assert (residual.max(axis=0) > -1e-6).all(), "every row is met somewhere: none is too wide"


@pytest.mark.parametrize(
    ("cone", "points"),
    [(line_contact(MU, WIDTH), line_ends(WIDTH)), (surface_contact(MU, LENGTH, WIDTH), CORNERS)],
)
def test_a_wrench_has_real_forces_exactly_if_it_satisfies_the_rows(cone, points):
    """Eqs 6 and 7, mended, are what forces at points can do: a linear program agrees."""
    random = np.random.default_rng(1)
    counts = {True: 0, False: 0}
    for _ in range(300):
        press = random.uniform(20.0, 100.0)
        wrench = (
            press * random.uniform(-1.1, 1.1, 6) * [MU, MU, 0, WIDTH / 2, LENGTH / 2, 0.7 * MU * LENGTH / 2]
        )
        wrench[2] = press
        if len(points) == 2:
            wrench[4], wrench[5] = 0.0, wrench[5] * WIDTH / LENGTH
        if abs(cone.residual(wrench)[abs(cone.residual(wrench)) > 0].max()) < 1e-3:
            continue
        real = forces_of(wrench, points)
        assert bool(cone.admits(wrench)) == (real is not None), wrench
        counts[real is not None] += 1
    assert min(counts.values()) > 30, counts


def test_the_forces_at_the_ends_make_the_wrench_and_are_in_their_pyramids():
    random = np.random.default_rng(2)
    cone = line_contact(MU, WIDTH)
    wrenches = wrench_of(line_ends(WIDTH), forces_in_pyramids(random, 2, 200))
    for wrench in wrenches:
        forces = end_forces(wrench, WIDTH)
        assert wrench_of(line_ends(WIDTH), forces) == pytest.approx(wrench, abs=1e-9)
        assert (np.abs(forces[:, :2]) <= MU * forces[:, 2:] + 1e-9).all()
    assert cone.admits(wrenches).all()


def test_a_sole_without_length_is_a_line_and_without_width_a_point():
    random = np.random.default_rng(3)
    wrenches = random.uniform(-1, 1, (3000, 6)) * [60, 60, 0, 2.5, 0, 1.5] + [0, 0, 100, 0, 0, 0]
    line, sole = line_contact(MU, WIDTH), surface_contact(MU, 0.0, WIDTH)
    assert (line.admits(wrenches) == sole.admits(wrenches)).all()
    assert 100 < line.admits(wrenches).sum() < 2900
    moments = wrenches[:1].copy()
    assert not point_contact(MU).admits(moments).any()
    moments[:, 3:] = 0.0
    assert point_contact(MU).admits(moments) == surface_contact(MU, 0.0, 0.0).admits(moments)


def test_a_cone_is_a_cone():
    random = np.random.default_rng(4)
    for cone in (point_contact(MU), line_contact(MU, WIDTH, 0.002), surface_contact(MU, LENGTH, WIDTH)):
        assert not cone.b.any() and len(cone.names) == len(cone.A) == len(set(cone.names))
        wrench = random.normal(size=(500, 6)) * [50, 50, 100, 2, 0.1, 1]
        assert (cone.admits(wrench) == cone.admits(7.0 * wrench, 7e-9)).all()


def test_uncoupled_rows_admit_full_push_with_full_twist():
    wrench = np.array([MU * 100.0, 0, 100.0, 0, 0, MU * 100.0 * WIDTH / 2])
    assert decoupled(MU, (WIDTH / 2, 0.0, MU * WIDTH / 2)).admits(wrench)
    line = line_contact(MU, WIDTH)
    assert line.broken(wrench) == ["right end: fx ≤ μ fz"]
    assert forces_of(wrench, line_ends(WIDTH)) is None


def test_a_free_moment_has_no_rows():
    free, bound = decoupled(MU, (0.02, None, 0.01)), decoupled(MU, (0.02, 0.0, 0.01))
    wrench = np.array([0, 0, 100.0, 0, 23.0, 0])
    assert free.admits(wrench) and bound.broken(wrench) == ["τy ≤ 0"]
    assert len(free.A) == len(bound.A) - 2


def test_a_tyre_carries_a_moment_about_its_axle_only_by_rolling_resistance():
    wrench = np.array([0, 0, 100.0, 0, 0.15, 0])
    assert line_contact(MU, WIDTH, 0.002).admits(wrench) and not line_contact(MU, WIDTH, 0.001).admits(wrench)


def test_eq_7_as_printed_admits_too_much_friction_and_no_moment():
    cone = printed(0.5, (2.0, 2.0, 2.0), (-2.0, -2.0, -2.0))
    slides = np.array([150.0, 0, 100.0, 0, 0, 0])
    assert max(cone.residual(slides)[:4]) < 0, "1.5 times the normal force at μ = 0.5"
    assert "fx ≤ μ fz" in decoupled(0.5, (None,) * 3).broken(slides)
    assert not cone.admits([0, 0, 100.0, 0, 0, 0]), "no moment at all is refused"
    magnitudes = printed(0.5, (2.0, 2.0, 2.0), (2.0, 2.0, 2.0))
    assert magnitudes.admits([0, 0, 1e-3, 2.0, 0, 0]), "a wheel hardly pressed twists as hard as any"


def test_the_penalty_is_zero_inside_and_its_derivatives_are_right():
    """Eqs 8 and 9."""
    random = np.random.default_rng(5)
    cone = line_contact(MU, WIDTH)
    inner = wrench_of(line_ends(WIDTH), forces_in_pyramids(random, 2, 50))
    assert penalty(cone.residual(inner)) == pytest.approx(0.0, abs=1e-16)
    step = 1e-5 * np.eye(6)
    for _ in range(50):
        wrench = random.normal(size=6) * [50, 50, 80, 2, 0.5, 1]
        gradient, hessian = penalty_derivatives(cone, wrench)
        if np.abs(cone.residual(wrench)).min() < 0.1:
            continue  # at a face, where the second derivative jumps
        differences = [
            (penalty(cone.residual(wrench + h)) - penalty(cone.residual(wrench - h))) / 2e-5 for h in step
        ]
        assert gradient == pytest.approx(differences, rel=1e-5, abs=1e-4)
        curvature = [
            (penalty_derivatives(cone, wrench + h)[0] - penalty_derivatives(cone, wrench - h)[0]) / 2e-5
            for h in step
        ]
        assert hessian == pytest.approx(np.array(curvature), rel=1e-6, abs=1e-4)
        assert np.linalg.eigvalsh(hessian).min() > -1e-6


def test_the_penalty_charges_broken_rows_alone():
    assert penalty(np.array([-100.0, 2.0, -3.0])) == pytest.approx(2.0)
    assert penalty(np.array([[-1.0, -1.0], [3.0, 4.0]])) == pytest.approx([0.0, 12.5])


def test_a_slice_has_the_rows_of_the_cone():
    random = np.random.default_rng(6)
    cone = surface_contact(MU, LENGTH, WIDTH)
    held = {"fx": 5.0, "fy": -8.0, "fz": 90.0, "τy": 0.4}
    A, b = cone.cut(("τx", "τz"), held)
    for _ in range(100):
        place = random.uniform(-2.5, 2.5, 2)
        whole = np.array([held.get(name, 0.0) for name in COMPONENTS])
        whole[[3, 5]] = place
        assert A @ place - b == pytest.approx(cone.residual(whole))
    corners = polygon(A, b, (-5, 5, -5, 5))
    assert len(corners) >= 4 and (corners @ A.T - b).max() < 1e-6
    with pytest.raises(ValueError, match="'fx' is unknown, or both"):
        cone.cut(("fx", "fy"), {"fx": 1.0})
    with pytest.raises(ValueError, match="'torque' is unknown"):
        cone.cut(("torque", "fy"))


def test_a_polygon_may_be_a_line_or_nothing():
    box = (-1.0, 1.0, -1.0, 1.0)
    line = polygon(np.array([[0.0, 1.0], [0.0, -1.0]]), np.zeros(2), box)
    assert np.ptp(line[:, 0]) == pytest.approx(2.0) and np.abs(line[:, 1]).max() < 1e-8
    assert polygon(np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-0.5, 0.0]), box).shape == (0, 2)
    assert polygon(np.zeros((1, 2)), np.array([-1.0]), box).shape == (0, 2)
    assert len(polygon(np.zeros((0, 2)), np.zeros(0), box)) == 4


@pytest.mark.parametrize("width", [0.0, -0.1, float("nan")])
def test_a_line_has_a_width(width):
    with pytest.raises(ValueError, match="width"):
        line_contact(MU, width)
