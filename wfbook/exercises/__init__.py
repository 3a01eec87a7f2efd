"""Checks of the chapters' exercises, one module a chapter.

A check takes a reader's answer, a number, an array or a function, and tries what has to be true of it. It
raises :class:`WrongAnswer`, whose message says which knot, leg or region breaks which rule, or returns what
it found in one line. No check compares with a stored answer where a property can be tried.
"""

from wfbook.exercises.answer import WrongAnswer

__all__ = ["WrongAnswer"]
