"""The examples in the library's docstrings do what they say."""

import doctest
import importlib
from pathlib import Path

import numpy as np
import pytest

import wfbook

ROOT = Path(wfbook.__file__).parent
MODULES = sorted(
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__")
    for path in ROOT.rglob("*.py")
    if ">>> " in path.read_text(encoding="utf-8")
)


def examples(module):
    """The examples of a module, by the name of what they show; ``np`` is NumPy in all of them."""
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = finder.find(importlib.import_module(module), globs={"np": np})
    return {test.name: test for test in found if test.examples}


def test_the_main_functions_of_every_chapter_have_examples():
    assert {name.split(".")[1] for name in MODULES} >= {
        *("terrain", "centroidal", "swing", "modes", "friction", "planner", "kalman", "omni"),
    }
    assert sum(len(examples(module)) for module in MODULES) >= 20


@pytest.mark.parametrize("module", MODULES)
def test_examples_do_what_they_say(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, test in examples(module).items():
        told = []
        doctest.DocTestRunner().run(test, out=told.append)
        assert not told, f"{name}\n{''.join(told)}"
