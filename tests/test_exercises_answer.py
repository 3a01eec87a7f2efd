"""Answers of every kind are read, or refused with a line that says why."""

import numpy as np
import pytest

from wfbook.exercises.answer import WrongAnswer, array, called, number


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, r"torque is None, not an array of numbers|torque has the shape"),
        ("one", "torque is 'one', not an array of numbers"),
        ([[1, 2], [3]], "not an array of numbers"),
        ([1.0, 2.0], r"torque has the shape \(2,\), not \(3,\)"),
        ([1.0, np.nan, 0.0], r"torque\[1\] is nan, not a finite number"),
    ],
)
def test_what_is_no_array_of_that_shape_is_refused(answer, message):
    with pytest.raises(WrongAnswer, match=message):
        array(answer, (3,), "torque")


def test_an_array_of_that_shape_is_read():
    assert array([1, 2, 3], (3,), "torque").dtype == float
    assert array(np.ones((5, 3)), (-1, 3), "torque").shape == (5, 3)
    assert number(np.float32(2), "mass") == 2.0


def test_a_function_that_raises_or_spoils_its_arguments_is_refused():
    def divides(x):
        return 1 / 0

    def later(x):
        raise NotImplementedError

    def spoils(x):
        x += 1
        return x

    for function, message in (
        (3.0, "is 3.0, not a function"),
        (divides, "slope raised ZeroDivisionError"),
        (later, "slope is still to be written"),
        (spoils, "changed its argument number 1"),
    ):
        with pytest.raises(WrongAnswer, match=message):
            called(function, np.ones(2), name="slope")
    assert called(np.sum, np.ones(2), name="slope") == 2.0


def test_a_notebook_shows_the_message_alone():
    assert WrongAnswer("leg RL pulls")._render_traceback_() == ["Not yet: leg RL pulls"]
