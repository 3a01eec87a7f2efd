"""The parts that all widgets are made of."""

import ipywidgets
import numpy as np
import pytest
import traitlets

from wfbook.view.style import INK, Picture
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.panel import Panel, image, table


class Line(Panel):
    """Draws a line of some slope; of slope 3 it can't."""

    def __init__(self):
        self.slope = ipywidgets.FloatSlider(value=1.0, min=-3, max=3, description="slope")
        super().__init__([self.slope], ["line"])

    def redraw(self):
        if self.slope.value == 3.0:
            raise ValueError("too <steep>")
        picture = Picture(3, 2)
        picture.subplots().plot([0, 1], [0, self.slope.value])
        self.show("line", picture, "a line")
        self.say("fine")


def test_a_picture_follows_its_control():
    widget = Line()
    before = widget.views["line"].value
    widget.slope.value = 2.0
    assert widget.views["line"].value != before
    assert widget.pictures["line"].axes[0].lines[0].get_ydata()[1] == 2.0
    assert widget.status.value == "fine"


def test_an_error_takes_the_picture_away_and_is_raised():
    widget = Line()
    with pytest.raises(ValueError, match="steep"):
        widget.slope.value = 3.0
    assert "ValueError: too &lt;steep&gt;" in widget.status.value
    assert widget.views["line"].value == "" and not widget.pictures
    widget.slope.value = 0.0
    assert widget.views["line"].value and widget.status.value == "fine"


def test_what_comes_from_outside_is_escaped():
    assert "&lt;b&gt;" in table(("a",), [("<b>",)])
    assert 'alt="&quot;x&quot;"' in image(Picture(1, 1), '"x"')


@pytest.fixture
def board():
    """A board whose axes end at its edges: 300 by 200 pixels for x in 0 to 3 and y in -1 to 1."""
    widget = Board({"foot": (1.0, 0.0), "hip": (2.0, 0.5)}, {"foot": "#009E73"})
    picture = Picture(300 / 96, 200 / 96)
    picture.set_layout_engine("none")
    axes = picture.add_axes((0, 0, 1, 1), xlim=(0, 3), ylim=(-1, 1))
    widget.show(picture, axes, "a field")
    return widget


def test_the_frame_turns_data_into_pixels_from_the_top_left(board):
    assert board._size == [300, 200] and board._limits == [0, 3, -1, 1]
    assert np.allclose(board._frame, [0, 100, 100, 0], atol=0.5), "(0, 0) left, half way down; (1, 1) above"
    assert board._image.startswith("data:image/png;base64,") and board._description == "a field"


def test_moving_a_handle_tells_who_watches(board):
    seen = []
    board.observe(lambda change: seen.append(change["new"]["foot"]), names="points")
    board.move("foot", 1.5, -0.25)
    assert seen == [[1.5, -0.25]] and board.points["hip"] == [2.0, 0.5]


@pytest.mark.parametrize(
    "points", [{"foot": [0, 0]}, {"foot": [0, np.nan], "hip": [0, 0]}, {"foot": [0], "hip": [0, 0]}]
)
def test_a_browser_can_not_send_what_is_no_point(board, points):
    with pytest.raises(traitlets.TraitError):
        board.points = points


def test_a_handle_stays_within_its_own_limits_whoever_moves_it():
    board = Board({"foot": (1.0, 0.0)}, limits={"foot": (0.0, 2.0, 0.0, 0.0)})
    board.move("foot", 3.0, 0.7)
    assert board.points["foot"] == [2.0, 0.0], "it slides along the ground"
    board.points = {"foot": [-5, -5]}  # what a browser sends
    assert board.points["foot"] == [0.0, 0.0]


def test_a_carried_handle_moves_along_but_not_the_other_way_round():
    board = Board({"foot": (1.0, 0.0), "tip": (1.5, 1.0)}, carriers={"tip": "foot"})
    board.move("foot", 2.0, 0.0)
    assert board.points == {"foot": [2.0, 0.0], "tip": [2.5, 1.0]}
    board.move("tip", 3.0, 2.0)
    assert board.points == {"foot": [2.0, 0.0], "tip": [3.0, 2.0]}


@pytest.mark.parametrize("option", ["colours", "limits", "carriers"])
def test_a_handle_that_there_is_none_of_is_refused(option):
    with pytest.raises(ValueError, match="no handle 'knee'"):
        Board({"foot": (1.0, 0.0)}, **{option: {"knee": "foot"}})


def test_the_layout_does_not_change_under_the_hand():
    def draw(label):
        picture = Picture(3, 2)
        axes = picture.subplots(1, 2)
        axes[0].set(xlim=(0, 3), ylim=(-1, 1))
        axes[1].set_ylabel(label)
        return picture, axes[0], "a field"

    board = Board({"foot": (1.0, 0.0)})
    board.show(*draw(""))
    frame, image = board._frame, board._image
    board.show(*draw("two\nlines"))
    assert board._frame == frame and board._image != image
    board.show(Picture(3, 2), Picture(3, 2).subplots(), "another kind of picture")
    assert board._frame != frame


def test_handles_can_be_painted_anew(board):
    board.paint(foot="#E4E4E4")
    assert board._colours == {"foot": "#E4E4E4", "hip": INK}
    with pytest.raises(ValueError, match="no handle 'knee'"):
        board.paint(knee="#E4E4E4")
