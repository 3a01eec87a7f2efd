"""The plan file: what is written is read, and what is damaged is refused by name."""

import json

import handmade
import numpy as np
import pytest

from wfbook.planner import Plan


@pytest.fixture
def file(tmp_path):
    """A plan file."""
    handmade.crawl().save(tmp_path / "plan.npz")
    return tmp_path / "plan.npz"


def rewrite(path, **changes):
    """Write the file again with some arrays changed, or left out where they are None."""
    with np.load(path, allow_pickle=False) as data:
        arrays = dict(data) | changes
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})


def test_a_plan_is_read_as_it_was_written(file):
    plan, again = handmade.crawl(), Plan.load(file)
    for name in ("t", "x", "p", "lam", "U_plus", "S", "D", "c"):
        np.testing.assert_array_equal(getattr(plan, name), getattr(again, name))
    assert again.meta == plan.meta
    assert again.terrain.to_dict() == plan.terrain.to_dict()


def test_every_truncation_and_many_flipped_bytes_are_refused_or_harmless(file):
    whole = file.read_bytes()
    rng = np.random.default_rng(0)
    for cut in [0, 1, 100, len(whole) // 2, len(whole) - 1]:
        file.write_bytes(whole[:cut])
        with pytest.raises(ValueError, match=r"plan\.npz"):
            Plan.load(file)
    for _ in range(60):
        damaged = bytearray(whole)
        damaged[rng.integers(len(whole))] ^= 1 << rng.integers(8)
        file.write_bytes(damaged)
        try:
            Plan.load(file)
        except ValueError as error:
            assert "plan.npz" in str(error)


@pytest.mark.parametrize("name", ["x", "lam", "S", "D", "meta", "terrain"])
def test_a_missing_field_is_named(file, name):
    rewrite(file, **{name: None})
    with pytest.raises(ValueError, match=f"missing field '{name}'"):
        Plan.load(file)


def test_values_that_cannot_be_are_refused_with_the_field_named(file):
    plan = handmade.crawl()
    for name, value in {
        "x": np.where(np.arange(3) == 1, np.nan, plan.x),
        "lam": plan.lam[:-1],
        "f": plan.f.astype(complex),
        "S": 2 * plan.S,
        "D": np.zeros_like(plan.D),
        "t": plan.t[::-1],
    }.items():
        plan.save(file)
        rewrite(file, **{name: value})
        with pytest.raises(ValueError, match=rf"plan\.npz: {name}: "):
            Plan.load(file)


@pytest.mark.parametrize(
    "change",
    [{"format": 99}, {"start_end_effectors": ["foot"] * 3 + ["hoof"]}, {"swing_height": "high"}],
)
def test_meta_of_another_version_or_sense_is_refused(file, change):
    with np.load(file, allow_pickle=False) as data:
        meta = json.loads(str(data["meta"]))
    rewrite(file, meta=np.array(json.dumps(meta | change)))
    with pytest.raises(ValueError, match=r"plan\.npz: meta: "):
        Plan.load(file)


def test_a_failed_save_leaves_the_old_file(file, monkeypatch):
    before = file.read_bytes()

    def full(*arguments, **arrays):
        raise OSError("no space left")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="no space"):
        handmade.stand().save(file)
    assert file.read_bytes() == before
    assert list(file.parent.iterdir()) == [file]
