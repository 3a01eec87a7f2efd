"""How a check tells that an answer is wrong, and reads answers of any kind without stumbling."""

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

import numpy as np


class WrongAnswer(AssertionError):
    """An answer that breaks a rule. A notebook shows the message alone, without a traceback."""

    def _render_traceback_(self) -> list[str]:
        """Show one line in IPython."""
        return [f"Not yet: {self}"]


def array(answer: Any, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Return an answer as an array of floats.

    Args:
        answer: what the reader has.
        shape: what it must have; -1 allows any length in that place.
        name: of the answer, for the message.

    Raises:
        WrongAnswer: it is not of numbers, not finite or not of this shape.
    """
    try:
        values = np.asarray(answer, dtype=float)
    except (TypeError, ValueError):
        raise WrongAnswer(f"{name} is {_short(answer)}, not an array of numbers") from None
    fits = len(values.shape) == len(shape) and all(
        want in (-1, have) for have, want in zip(values.shape, shape, strict=True)
    )
    if not fits:
        wanted = tuple("any" if length == -1 else length for length in shape)
        raise WrongAnswer(f"{name} has the shape {values.shape}, not {wanted}")
    if not np.isfinite(values).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise WrongAnswer(f"{name}{list(place) if place else ''} is {values[place]}, not a finite number")
    return values


def number(answer: Any, name: str) -> float:
    """Return an answer as a finite float.

    Raises:
        WrongAnswer: it is none.
    """
    return float(array(answer, (), name))


def called(function: Callable[..., Any], *arguments: Any, name: str) -> Any:
    """Call a reader's function.

    Raises:
        WrongAnswer: it can't be called, raises, or changes its arguments; with what it was called for.
    """
    if not callable(function):
        raise WrongAnswer(f"{name} is {_short(function)}, not a function")
    before = [np.array(a, copy=True) if isinstance(a, np.ndarray) else a for a in arguments]
    try:
        answer = function(*arguments)
    except NotImplementedError:
        raise WrongAnswer(f"{name} is still to be written") from None
    except Exception as error:
        raise WrongAnswer(f"{name} raised {type(error).__name__}: {error}") from error
    for index, (old, new) in enumerate(zip(before, arguments, strict=True)):
        if isinstance(old, np.ndarray) and not np.array_equal(old, new, equal_nan=True):
            raise WrongAnswer(f"{name} changed its argument number {index + 1}; return a new array instead")
    return answer


class Draws:
    """What a check drew.

    Attributes:
        salt: that changes what is drawn; None for what a reader's check draws.
        drawn: whether anything was.
    """

    def __init__(self, salt: int | None) -> None:
        self.salt = salt
        self.drawn = False


_DRAWS: ContextVar[Draws | None] = ContextVar("draws", default=None)


def draws(seed: int) -> np.random.Generator:
    """Return what a check draws its inputs with.

    The same for every reader, so that a message can be talked about. Grading tries others, too, with
    :func:`other_draws`: an answer that knows the book's inputs by heart fails there.
    """
    now = _DRAWS.get()
    if now is None:
        return np.random.default_rng(seed)
    now.drawn = True
    return np.random.default_rng(seed if now.salt is None else [seed, now.salt])


@contextlib.contextmanager
def other_draws(salt: int | None) -> Iterator[Draws]:
    """Have checks draw other inputs, and tell whether they draw any; with None they are the same."""
    now = Draws(salt)
    token = _DRAWS.set(now)
    try:
        yield now
    finally:
        _DRAWS.reset(token)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
