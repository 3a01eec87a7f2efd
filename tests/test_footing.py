"""What a foot or a wheel stands on near an edge, and how the trunk leans."""

import handmade
import numpy as np
import pytest

from wfbook.footing import Footing
from wfbook.go1 import WHEEL_RADIUS, calf_pitch, convex_bodies, leg_angles, leg_kinematics
from wfbook.lean import Lean
from wfbook.terrain import Region, Terrain, ramp, stepping_stones

START = 0.4
ANGLE = np.radians(12.0)


def footing(terrain: Terrain) -> Footing:
    return Footing(terrain, np.zeros((4, 3)), np.zeros(4, int))


def touching(terrain: Terrain, x: float) -> np.ndarray:
    """Return where the centre of a wheel is that touches the ground from above at x."""
    low, high = -0.5, 0.5
    for _ in range(60):
        z = 0.5 * (low + high)
        centre = np.array([x, 0.1, z])
        gap = min(np.linalg.norm(centre - r.nearest(centre)) for r in terrain.regions)
        low, high = (low, z) if gap > WHEEL_RADIUS else (z, high)
    return centre


@pytest.mark.parametrize("direction", ["down", "up"])
@pytest.mark.parametrize("ahead", [-0.3, 0.0, 0.3])
def test_the_normal_turns_from_one_region_to_the_next(direction, ahead):
    terrain = ramp(12.0, direction, start=START, length=0.8)
    feet, ground = footing(terrain), [r.normal for r in terrain.regions]
    turned = []
    for x in np.linspace(START - 0.05, START + 0.05, 201):
        feet.stand(0, touching(terrain, x), ahead)
        turned.append(np.degrees(np.arccos(np.clip(feet.normals[0] @ ground[0], -1, 1))))
        assert np.linalg.norm(feet.normals[0]) == pytest.approx(1.0)
    assert turned[0] == 0.0 and turned[-1] == pytest.approx(12.0)
    assert np.all(np.diff(turned) > -1e-6)
    # Over the crest it turns while the wheel rolls over, in the hollow at once.
    largest = np.diff(turned).max()
    assert largest < 1.0 if direction == "down" else largest > 11.0


def test_in_a_hollow_the_face_counts_into_which_a_wheel_rolls():
    terrain = ramp(12.0, "up", start=START, length=0.8)
    corner = touching(terrain, START - WHEEL_RADIUS * np.tan(ANGLE / 2))
    for ahead, region in ((0.2, 1), (-0.2, 0)):
        feet = footing(terrain)
        feet.stand(0, corner, ahead)
        assert feet.regions[0] == region


def test_a_group_ends_at_its_last_edge():
    terrain = stepping_stones(gap=0.2, stone=0.25, start=0.3)
    feet = footing(terrain)
    feet.stand(0, np.array([0.31, 0.0, 0.02]))
    assert feet.regions[0] == 0 and feet.normals[0][0] > 0.3
    feet.stand(0, np.array([0.45, 0.0, -0.1]))  # in the gap: no direction makes sense but the region's
    np.testing.assert_array_equal(feet.normals[0], terrain.regions[0].normal)
    assert feet.astray(0, np.array([0.31, 0.0, 0.02]), 0.02, rolls=False) == pytest.approx(0.01)
    assert feet.astray(0, np.array([0.25, 0.0, 0.02]), 0.02, rolls=False) == 0.0


def test_a_wheel_may_be_on_any_region_of_its_group_and_a_foot_only_on_its_own():
    feet = footing(ramp(12.0, "down", start=START))
    beyond = np.array([START + 0.1, 0.0, 0.0])
    assert feet.astray(0, beyond, 0.04, rolls=True) == 0.0
    assert feet.astray(0, beyond, 0.02, rolls=False) == pytest.approx(0.1)


@pytest.mark.parametrize("seed", range(20))
def test_the_nearest_point_of_a_polygon_is_nearer_than_any_other(seed):
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, 6))
    angles[:3] = [0.0, 2.0, 4.0]
    flat = np.column_stack([np.cos(np.sort(angles)), np.sin(np.sort(angles))])
    slope = rng.uniform(-0.4, 0.4, 2)
    region = Region(np.column_stack([flat, flat @ slope]), 0.7, 0.0, 0.7, 0.0, "deck")
    point = rng.uniform(-1.5, 1.5, 3)
    nearest = region.nearest(point)
    assert region.outside(*nearest[:2]) < 1e-9
    assert region.height(*nearest[:2]) == pytest.approx(nearest[2], abs=1e-9)
    others = rng.dirichlet(np.ones(6), 2000) @ region.vertices
    assert np.linalg.norm(others - point, axis=1).min() >= np.linalg.norm(nearest - point) - 1e-9


def test_a_crest_is_one_body_and_a_hollow_two():
    assert convex_bodies(ramp(direction="down")) == [[0, 1], [2]]
    assert convex_bodies(ramp(direction="up")) == [[0], [1, 2]]
    assert convex_bodies(stepping_stones()) == [[0], [1], [2], [3]]


def test_regions_of_different_friction_stay_apart():
    first, second, *_ = ramp(direction="down").regions
    rough = Region(second.vertices, 0.9, 0.0, 0.7, 0.0, "ramp")
    assert convex_bodies(Terrain("two grounds", (first, rough))) == [[0], [1]]


def test_a_level_plan_leaves_the_trunk_level():
    lean = Lean(handmade.trot(0.2, 4))
    for t in (-0.5, 0.0, 0.7, 2.0):
        np.testing.assert_allclose(np.concatenate(lean.at(t)), 0.0, atol=1e-12)


def test_the_lean_is_smooth_and_its_rate_is_its_derivative():
    plan = handmade.trot(0.2, 6)
    p = plan.p.copy()
    p[..., 2] += 0.2 * p[..., 0] + 0.1 * p[..., 1] * (np.arange(len(p)) > 9)[:, None]
    lean = Lean(type(plan)(**{**plan.__dict__, "p": p}))
    assert np.tan(lean.at(9.0)[0][1]) == pytest.approx(-0.2)
    for t in np.linspace(-0.5, 2.5, 31):
        (before, _), (_, omega), (after, _) = lean.at(t - 1e-5), lean.at(t), lean.at(t + 1e-5)
        rates = (after - before) / 2e-5
        pitch = lean.at(t)[0][1]
        expected = [rates[0] * np.cos(pitch), rates[1], -rates[0] * np.sin(pitch)]
        np.testing.assert_allclose(omega, expected, atol=1e-6)
        accelerations = np.diff([lean.at(t + s)[1] for s in (-1e-4, 0.0, 1e-4)], axis=0) / 1e-4
        assert np.abs(np.diff(accelerations, axis=0)).max() < 0.01


def test_the_calf_pitches_as_the_legs_kinematics_say():
    for x, z in ((0.0, -0.3), (0.1, -0.25), (-0.12, -0.28)):
        hip = np.array([0.1881, 0.04675 + 0.08, 0.0])
        angles = np.array([leg_angles(0, hip + np.array([x, 0.0, z]))] * 4)
        ends, _, _ = leg_kinematics(angles)
        np.testing.assert_allclose(ends[0] - hip, [x, 0.0, z], atol=1e-9)
        assert calf_pitch(ends[0] - hip) == pytest.approx(angles[0, 1] + angles[0, 2])
