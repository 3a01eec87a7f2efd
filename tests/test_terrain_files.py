"""Random terrain files: the valid ones are read to the last bit, the broken ones refused by name."""

import json
import re
from itertools import pairwise

import numpy as np
import pytest
from plan_reading import Plane
from terrain_cases import ODDITIES, broken_terrain, random_terrain

from wfbook.terrain import Region, Terrain

COUNT = 100


def random_file(seed):
    return random_terrain(np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_valid_file_is_read_and_saved_bit_for_bit(seed, tmp_path):
    data = random_file(seed)
    given, saved = tmp_path / "given.json", tmp_path / "saved.json"
    given.write_text(json.dumps(data), encoding="utf-8")
    terrain = Terrain.load(given)
    assert terrain.to_dict() == data
    terrain.save(saved)
    assert json.loads(saved.read_text(encoding="utf-8")) == data
    assert Terrain.load(saved) == terrain == Terrain.from_dict(data)


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_broken_file_is_refused_by_file_region_and_field(seed, tmp_path):
    text, field = broken_terrain(np.random.default_rng(seed))
    path = tmp_path / "broken.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="terrain file") as caught:
        Terrain.load(path)
    message = str(caught.value)
    assert "\n" not in message
    region, _, name = field.rpartition(": ")
    begin = f"terrain file {str(path)!r}: " + (f"{region}: " if region else "")
    assert message.startswith(begin)
    # The field is named first: what follows may list the known ones.
    named = re.match(r"(?:unknown key )?'?(\w+( JSON)?)", message.removeprefix(begin))
    assert named and named[1] == name


def test_the_broken_files_break_everything_there_is():
    fields = {broken_terrain(np.random.default_rng(seed))[1].split(": ")[-1] for seed in range(COUNT)}
    assert fields >= {"name", "regions", "not JSON", *Region.FIELDS}


def test_the_valid_files_are_as_various_as_they_should_be():
    files = [random_file(seed) for seed in range(COUNT)]
    regions = [region for file in files for region in file["regions"]]
    assert {len(file["regions"]) for file in files} == {1, 2, 3, 4, 5}
    assert {len(region["vertices"]) for region in regions} >= {3, 4, 6}
    assert all(any(file["name"].endswith(oddity) for file in files) for oddity in ODDITIES)
    assert any(len({r["group"] for r in f["regions"]}) < len(f["regions"]) for f in files)
    slopes = np.degrees([np.arccos(min(Plane(region).n[2], 1.0)) for region in regions])
    assert 10 < slopes.max() < 20.001
    assert 0.2 < (slopes < 1e-6).mean() < 0.9
    usual = [file["regions"] for file in files if not file["name"].endswith(ODDITIES)]
    bounds = [[(np.min(r["vertices"], axis=0), np.max(r["vertices"], axis=0)) for r in f] for f in usual]
    for (low, high), *_ in bounds:
        assert low[0] <= -0.6 and high[0] >= 0.3
        assert low[1] <= -0.4 and high[1] >= 0.4
    gaps = [b[0][0] - a[1][0] for file in bounds for a, b in pairwise(file)]
    assert max(gaps) <= 0.4 + 1e-9
