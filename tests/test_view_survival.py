"""Survival maps: every level, every cell, with its interval or its count."""

import json

import numpy as np
import pytest
from matplotlib.colors import to_hex
from study_cases import content, study

from wfbook.study import design, tables
from wfbook.view import survival

pytest_plugins = ["study_cases"]


@pytest.fixture
def report(answers, good, bad, tmp_path):
    """The report of a study of two plans, in which one falls and one run has an error."""
    best = design.digest(content(good))

    def answer(one):
        if one.values["push"] == 60.0 and one.values["delay"] == 20.0 and one.seed == 0:
            return {"error": "x", "upright": None}
        return {"upright": one.plan == best or one.values["push"] < 30}

    answers(answer)
    words = ["--plan", good, bad, "--sweep", "push=0,30,60", "--sweep", "trunk_mass", "--seeds", "2"]
    assert study(tmp_path, *words, "--grid", "push=0,60", "delay=4,9,20") == 1
    return json.loads((tmp_path / "study.json").read_text())


def test_the_curves_show_shares_and_intervals(report):
    figure = survival.sweeps(report)
    push, mass = (axes for axes in figure.axes if axes.get_visible())
    assert (push.get_xlabel(), mass.get_xlabel()) == ("push (N)", "trunk mass (factor)")
    assert push.get_ylabel() == "share upright to the end"
    curves = {line.get_gid(): list(line.get_ydata()) for line in push.lines if line.get_gid()}
    assert curves["push good"] == [1.0, 1.0, 1.0]
    assert curves["push bad"] == [1.0, 0.0, 0.0]
    (bars, *_) = [container.lines[2][0].get_segments() for container in push.containers]
    low, high = tables.wilson(2, 2)
    np.testing.assert_allclose(bars[0][:, 1], [low, high])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["good", "bad", "in all other runs"]
    colours = {to_hex(line.get_color()) for line in push.lines if str(line.get_gid()).startswith("push")}
    assert len(colours) == 2
    assert figure.png().startswith(b"\x89PNG")


def test_the_map_shows_every_cell(report):
    figure = survival.grid(report, "push x delay")
    good, bad, bar = figure.axes
    assert (good.get_xlabel(), good.get_ylabel()) == ("delay (ms)", "push (N)")
    assert (good.get_title(), bad.get_title()) == ("good", "bad")
    assert bar.get_ylabel() == "share upright to the end"
    assert [label.get_text() for label in good.get_xticklabels()] == ["4", "9", "20"]
    shares = good.collections[0].get_array()
    np.testing.assert_array_equal(shares, np.ones((2, 3)))
    np.testing.assert_array_equal(bad.collections[0].get_array(), [[1, 1, 1], [0, 0, 0]])
    texts = [text.get_text() for text in good.texts]
    assert texts == ["2/2"] * 5 + ["1/1\n1 error"]
    assert figure.png().startswith(b"\x89PNG")
