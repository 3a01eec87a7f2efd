"""The README names what there is: chapters and their exercises, commands, benchmarks, scenarios, files."""

import importlib
import re
from pathlib import Path

import pytest
from chapters import PATHS, Chapter

from wfbook import omni_command
from wfbook.__main__ import FILES, _parser
from wfbook.terrain import Terrain

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_every_chapter_is_on_the_map_and_in_the_lecture_plan(path):
    number = int(path.stem[:2])
    assert f"| {number} | [" in README and f"](notebooks/{path.name})" in README
    points = [
        cell.metadata.nbgrader.points
        for cell in Chapter(path).cells
        if cell.metadata.get("nbgrader", {}).get("grade")
    ]
    (row,) = re.findall(rf"^\| {number + 1} \| {number} .*$", README, re.MULTILINE)
    assert row.endswith(f"| {len(points)} ({sum(points)}) |")


def test_links_lead_somewhere():
    for text in (README, CONTRIBUTING):
        for target in re.findall(r"\]\(([^)#]+)\)", text):
            assert (ROOT / target).exists(), target


def test_files_and_modules_that_are_named_exist():
    for text in (README, CONTRIBUTING):
        for name in re.findall(r"`((?:wfbook|tests|assets|benchmarks|notebooks)/[\w./]+)`", text):
            assert "NN_" in name or (ROOT / name).exists(), name
    for script in (ROOT / "benchmarks").glob("*.py"):
        assert f"benchmarks/{script.name}" in README, script.name


def test_commands_are_those_of_the_program():
    commands = set(re.findall(r"python -m wfbook (\w+)", README))
    (known,) = [action.choices for action in _parser()._actions if action.choices]
    assert commands == set(known)
    for name in omni_command.NAMES:
        assert f"-{name}`" in README
    for name in FILES:
        assert f"`{name}`" in README


def test_the_terrain_shown_is_one(tmp_path):
    (shown,) = re.findall(r"```json\n(.*?)```", README, re.DOTALL)
    path = tmp_path / "my_floor.json"
    path.write_text(shown, encoding="utf-8")
    assert Terrain.load(path).name == "my floor"


def test_the_python_shown_names_what_there_is():
    (shown,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    names = re.findall(r"wfbook\.[\w.]+", shown)
    for name in names:
        thing = importlib.import_module("wfbook")
        for part in name.split(".")[1:]:
            thing = getattr(thing, part)
