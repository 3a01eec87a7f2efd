import itertools
import json
import math

import numpy as np
import pytest

from wfbook.terrain import (
    BUILTIN_NAMES,
    Region,
    Terrain,
    builtin,
    flat,
    named_or_file,
    ramp,
    stepping_stones,
)

SURFACE = {"mu_foot": 0.7, "mu_wheel": 0.0, "mu_wheel_lateral": 0.6, "rolling_resistance": 0.01, "group": "g"}
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def region(vertices=SQUARE, **changes):
    return Region(vertices, **(SURFACE | changes))


def random_polygon(rng):
    """A random convex polygon on an ellipse in a random plane that looks up, and its plane's normal."""
    n = int(rng.integers(3, 9))
    angles = (np.arange(n) + rng.uniform(0.1, 0.9, n)) * 2 * np.pi / n
    flat_points = np.column_stack((np.cos(angles), 0.5 * np.sin(angles), np.zeros(n))) * rng.uniform(0.2, 3.0)
    tilt, heading, spin = rng.uniform(0, 1.2), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
    R = _about_z(heading) @ _about_y(tilt) @ _about_z(spin)
    return flat_points @ R.T + rng.uniform(-5, 5, 3), R[:, 2]


def _about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _about_y(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


@pytest.mark.parametrize("seed", range(60))
def test_random_polygons_have_the_geometry_they_were_built_with(seed):
    rng = np.random.default_rng(seed)
    vertices, normal = random_polygon(rng)
    r = region(vertices)
    np.testing.assert_allclose(r.normal, normal, atol=1e-9)
    basis = np.column_stack((r.tangent, r.binormal, r.normal))
    np.testing.assert_allclose(basis.T @ basis, np.eye(3), atol=1e-12)
    assert np.linalg.det(basis) == pytest.approx(1.0)
    assert r.tangent[0] > 0
    # t is the projection of world x: nothing of x is left across it in the plane
    assert r.binormal[0] == pytest.approx(0.0, abs=1e-12)
    assert r.binormal[1] > 0

    weights = rng.dirichlet(np.ones(len(vertices)), 50)
    A, b = r.halfspaces
    np.testing.assert_allclose(np.linalg.norm(A, axis=1), 1.0)
    for x, y, z in weights @ vertices:
        assert np.all(A @ (x, y) <= b + 1e-12)
        assert r.contains(x, y)
        assert r.height(x, y) == pytest.approx(z, abs=1e-9)
    middles = 0.5 * (vertices + np.roll(vertices, -1, axis=0))[:, :2]
    for middle, outward in zip(middles, A, strict=True):
        assert not r.contains(*(middle + 1e-3 * outward))
        assert r.contains(*(middle - 1e-6 * outward))


@pytest.mark.parametrize("seed", range(20))
def test_turning_the_world_about_z_turns_the_region(seed):
    rng = np.random.default_rng(seed)
    vertices, _ = random_polygon(rng)
    R = _about_z(rng.uniform(0, 2 * np.pi))
    before, after = region(vertices), region(vertices @ R.T)
    np.testing.assert_allclose(after.normal, R @ before.normal, atol=1e-9)
    np.testing.assert_allclose(after.halfspaces[0], before.halfspaces[0] @ R[:2, :2].T, atol=1e-9)
    np.testing.assert_allclose(after.halfspaces[1], before.halfspaces[1], atol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_shifting_the_first_vertex_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    vertices, _ = random_polygon(rng)
    a, b = region(vertices), region(np.roll(vertices, 1, axis=0))
    np.testing.assert_allclose(a.normal, b.normal, atol=1e-12)
    np.testing.assert_allclose(np.roll(a.halfspaces[1], 1), b.halfspaces[1], atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_files_round_trip_to_the_last_bit(seed, tmp_path):
    rng = np.random.default_rng(seed)
    friction = dict(zip(SURFACE, rng.uniform(0, 1, 4), strict=False))
    regions = [
        region(random_polygon(rng)[0], **friction, group=f"gruppe {i} – ö") for i in range(rng.integers(1, 5))
    ]
    terrain = Terrain(f"random {seed}", regions)
    terrain.save(tmp_path / "t.json")
    again = Terrain.load(tmp_path / "t.json")
    assert again == terrain
    assert hash(again) == hash(terrain)
    assert Terrain.from_dict(json.loads(json.dumps(terrain.to_dict()))) == terrain


@pytest.mark.parametrize("seed", range(40))
def test_random_polygons_made_wrong_are_refused(seed):
    rng = np.random.default_rng(seed)
    vertices, normal = random_polygon(rng)
    with pytest.raises(ValueError, match=r"^vertices: face does not look up"):
        region(vertices[::-1])
    if len(vertices) > 3:
        lifted = vertices.copy()
        lifted[1] += 0.05 * normal
        with pytest.raises(ValueError, match=r"^vertices: not planar"):
            region(lifted)
        dented = vertices.copy()
        across = 0.5 * (vertices[0] + vertices[2])
        dented[1] = across + 0.1 * (across - vertices[1])
        crossed = vertices.copy()
        crossed[[1, 2]] = crossed[[2, 1]]
        for wrong in (dented, crossed):
            with pytest.raises(ValueError, match=r"^vertices: (not convex|face does not look up)"):
                region(wrong)


def test_vertices_written_with_four_decimals_are_planar():
    rng = np.random.default_rng(0)
    for _ in range(100):
        vertices, _ = random_polygon(rng)
        region(vertices.round(4))


@pytest.mark.parametrize(
    ("vertices", "says"),
    [
        (SQUARE[:2], "vertices: needs at least three"),
        ([], "vertices: needs at least three"),
        ("square", "vertices: must be a list"),
        ([[0, 0], [1, 0], [1, 1]], r"vertices\[0\]: must be \[x, y, z\], is \[0, 0\]"),
        ([*SQUARE[:3], 7], r"vertices\[3\]: must be \[x, y, z\], is 7"),
        ([*SQUARE[:3], [0, 1, math.nan]], r"vertices\[3\]\[2\]: must be finite, is nan"),
        ([*SQUARE[:3], [0, 10**400, 0]], r"vertices\[3\]\[1\]: must be finite"),
        ([*SQUARE[:3], [0, True, 0]], r"vertices\[3\]\[1\]: must be a number, is True"),
        ([*SQUARE[:3], [0, "1", 0]], r"vertices\[3\]\[1\]: must be a number, is '1'"),
        ([*SQUARE, SQUARE[0]], r"vertices\[4\]: is on another vertex"),
        (SQUARE * 2, r"vertices\[4\]: is on another vertex"),
        ([*SQUARE[:3], [0, 1e7, 0]], r"vertices\[3\]: is over 1e\+06 m away"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], "vertices: not convex, encloses no area"),
        ([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]], "vertices: face does not look up"),
        (SQUARE[::-1], "vertices: face does not look up"),
        ([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]], "vertices: not convex"),
        ([[0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]], "vertices: not convex"),
        (
            [[math.cos(0.8 * k * math.pi), math.sin(0.8 * k * math.pi), 0] for k in range(5)],
            "vertices: not convex",
        ),
    ],
)
def test_wrong_vertices_are_refused(vertices, says):
    with pytest.raises(ValueError, match=says) as caught:
        region(vertices)
    assert type(caught.value) is ValueError
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("field", ["mu_foot", "mu_wheel", "mu_wheel_lateral", "rolling_resistance"])
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf, True, "0.7", None, [0.7], 1 + 0j])
def test_wrong_coefficients_are_refused(field, value):
    with pytest.raises(ValueError, match=rf"^{field}: must"):
        region(**{field: value})


@pytest.mark.parametrize("group", ["", "  ", 3, None, "two\nlines"])
def test_wrong_groups_are_refused(group):
    with pytest.raises(ValueError, match=r"^group: must be printable text"):
        region(group=group)


def _file(tmp_path, text):
    path = tmp_path / "ground.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def _changed(**changes):
    """A two-region terrain file in which the second region is changed; None drops the key."""
    good = {"vertices": SQUARE, **SURFACE}
    bad = {k: v for k, v in (good | changes).items() if v is not None}
    return json.dumps({"name": "n", "regions": [good, bad]})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "not JSON"),
        ("{", "not JSON"),
        (b"\xff\xfe\x00", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("[]", r"must be an object, is \[\]"),
        ("{}", "name: missing"),
        ('{"name": "n"}', "regions: missing"),
        ('{"name": "n", "regions": []}', r"regions: needs at least one region"),
        ('{"name": "n", "regions": {}}', r"regions: must be a list, is \{\}"),
        ('{"name": 7, "regions": ' + json.dumps([{"vertices": SQUARE, **SURFACE}]) + "}", "name: must be"),
        ('{"name": "n", "name": "m", "regions": []}', "'name' stands twice"),
        ('{"name": "n", "regions": [], "scale": 2}', "unknown key 'scale'"),
        ('{"name": "n", "regions": [3]}', "region 0: must be an object, is 3"),
        (_changed(mu_foot=-0.7), r"region 1: mu_foot: must not be negative, is -0\.7"),
        (_changed(mu_foot=math.nan), "region 1: mu_foot: must be finite, is nan"),
        (_changed(mu_wheel=math.inf), "region 1: mu_wheel: must be finite, is inf"),
        (_changed(mu_wheel_lateral=True), "region 1: mu_wheel_lateral: must be a number, is True"),
        (_changed(rolling_resistance=None), "region 1: rolling_resistance: missing"),
        (_changed(colour="red"), "region 1: unknown key 'colour'"),
        (_changed(vertices=SQUARE[::-1]), "region 1: vertices: face does not look up"),
        (_changed(group=4), "region 1: group: must be printable text, is 4"),
        (_changed().replace('"mu_foot": 0.7', '"mu_foot": 0.7, "mu_foot": 0.8'), "'mu_foot' stands twice"),
        (_changed().replace('"mu_foot": 0.7', '"mu_foot": 1e999'), "mu_foot: must be finite, is inf"),
    ],
)
def test_wrong_files_are_refused_in_one_line_that_names_the_file(tmp_path, text, says):
    path = _file(tmp_path, text)
    with pytest.raises(ValueError, match=says) as caught:
        Terrain.load(path)
    assert type(caught.value) is ValueError
    assert str(caught.value).startswith(f"terrain file {str(path)!r}: ")
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        Terrain.load(tmp_path / "none.json")


def test_a_terrain_needs_regions():
    with pytest.raises(ValueError, match="regions: must be Region objects"):
        Terrain("n", ("region",))
    with pytest.raises(ValueError, match="regions: needs at least one"):
        Terrain("n", ())


def test_regions_cannot_be_changed():
    r = region()
    with pytest.raises(ValueError, match="read-only"):
        r.vertices[0, 0] = 5.0
    with pytest.raises(AttributeError):
        r.mu_foot = 1.0


def test_region_at_finds_the_highest_region():
    low, high = region(), region(np.array(SQUARE) * 0.5 + [0.5, 0.5, 0.3])
    terrain = Terrain("steps", (low, high))
    assert terrain.region_at(0.2, 0.2) == 0
    assert terrain.region_at(0.7, 0.7) == 1
    assert terrain.region_at(2.0, 0.0) is None
    assert terrain.height(0.7, 0.7) == pytest.approx(0.3)
    assert terrain.height(2.0, 0.0) is None


@pytest.mark.parametrize("name", BUILTIN_NAMES)
def test_the_five_terrains_start_level_at_the_origin(name):
    terrain = builtin(name)
    assert terrain.name == name
    assert terrain.height(0.0, 0.0) == 0.0
    assert Terrain.from_dict(terrain.to_dict()) == terrain
    for y in (-0.2, 0.2):
        for x in (-0.25, 0.25):
            assert terrain.height(x, y) == 0.0
    mirrored = [np.abs(r.vertices * [1, -1, 1] - r.vertices[::-1]).max() for r in terrain.regions]
    assert max(mirrored) < 1e-12, "the terrains are symmetric about y = 0"


def test_flat_with_friction_is_named_so():
    assert flat().name == "flat"
    assert flat(0.01).name == "flat-friction"
    assert flat(0.01).regions[0].rolling_resistance == 0.01
    with pytest.raises(ValueError, match=r"rolling_resistance: must not be negative, is -0\.1"):
        flat(-0.1)


@pytest.mark.parametrize(("direction", "sign"), [("up", 1), ("down", -1)])
def test_ramps_are_one_group_with_the_angle_asked_for(direction, sign):
    terrain = ramp(15.0, direction, start=0.5, length=1.0)
    assert len({r.group for r in terrain.regions}) == 1
    slope = terrain.regions[1]
    assert math.degrees(math.acos(slope.normal[2])) == pytest.approx(15.0)
    rise = sign * math.tan(math.radians(15.0))
    assert terrain.height(3.0, 0.0) == pytest.approx(rise)
    for x in (0.5, 1.5):  # neighbours meet without a step
        heights = [r.height(x, 0.0) for r in terrain.regions if r.contains(x, 0.0)]
        assert len(heights) == 2
        assert heights[0] == pytest.approx(heights[1])


@pytest.mark.parametrize("gap", [0.1, 0.2, 0.35])
def test_stones_are_as_far_apart_as_asked_for(gap):
    terrain = stepping_stones(gap, stones=3)
    ends = [(r.vertices[:, 0].min(), r.vertices[:, 0].max()) for r in terrain.regions]
    assert len(ends) == 5
    for (_, right), (left, _) in itertools.pairwise(ends):
        assert left - right == pytest.approx(gap)
        assert terrain.region_at(0.5 * (left + right), 0.0) is None
    assert len({r.group for r in terrain.regions}) == 5, "no wheel may roll over a gap"


@pytest.mark.parametrize(
    "build",
    [
        lambda: ramp(0.0),
        lambda: ramp(math.nan),
        lambda: ramp(80.0),
        lambda: ramp(direction="left"),
        lambda: ramp(length=-1.0),
        lambda: stepping_stones(gap=0.0),
        lambda: stepping_stones(gap=-0.2),
        lambda: stepping_stones(stones=1.5),
        lambda: stepping_stones(stones=-1),
    ],
)
def test_builders_refuse_what_makes_no_terrain(build):
    with pytest.raises(ValueError, match="must be"):
        build()


def test_named_or_file(tmp_path):
    terrain = stepping_stones()
    terrain.save(tmp_path / "mine.json")
    assert named_or_file(str(tmp_path / "mine.json")) == terrain
    assert named_or_file("ramp-up") == builtin("ramp-up")
    with pytest.raises(ValueError, match=r"unknown terrain 'falt': did you mean 'flat'\?"):
        named_or_file("falt")
    with pytest.raises(ValueError, match="unknown terrain 'moon': known are flat, "):
        named_or_file("moon")
