"""What the words of a command line may be: numbers in a range, goals, folders; one-line errors."""

import argparse
import contextlib
import importlib
import math
import re
import signal
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NoReturn

from wfbook.results import ResultFolder, WholeFolder

OK, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit codes."""

GOAL_PER_SLOT = 0.1
"""How far to go, m for each slot, where nothing else is asked."""

LONG = 12
"""Slots beyond which a first plan is found in overlapping windows."""


class CommandError(Exception):
    """Ends the program with one line on stderr and an exit code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Raise what ends the program."""
        raise CommandError(f"{message} (see python -m {self.prog} --help)", WRONG_INPUT)


def join_goal(argv: Sequence[str]) -> list[str]:
    """Write ``--goal X Y`` and ``--goal X,Y`` as ``--goal=X,Y``, which argparse reads with any sign."""
    words = list(argv)
    if "--goal" in words:
        i = words.index("--goal")
        n = 2 if "," in "".join(words[i + 1 : i + 2]) else 3
        words[i : i + n] = ["--goal=" + ",".join(words[i + 1 : i + n])]
    return words


def goal(text: str) -> tuple[float, float]:
    """Read two finite numbers with a comma between them."""
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be two numbers X Y, is {text!r}") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise argparse.ArgumentTypeError(f"must be finite, is {text!r}")
    return x, y


def whole(least: int) -> Callable[[str], int]:
    """Return what reads a whole number of at least ``least``."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"must be a whole number, is {text!r}") from None
        if value < least:
            raise argparse.ArgumentTypeError(f"must be at least {least}, is {text}")
        return value

    return read


def number(least: float, above: bool = False) -> Callable[[str], float]:
    """Return what reads a finite number of at least ``least``, or above it."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise argparse.ArgumentTypeError(f"must be a finite number, is {text!r}")
        if value < least or (above and value == least):
            raise argparse.ArgumentTypeError(
                f"must be {'above' if above else 'at least'} {least:g}, is {text}"
            )
        return value

    return read


@contextlib.contextmanager
def result_folder(target: str | Path, names: tuple[str, ...]) -> Iterator[ResultFolder]:
    """Open a result folder; that it can't be written is wrong input."""
    with contextlib.ExitStack() as stack:
        try:
            folder = stack.enter_context(ResultFolder(target, names))
        except OSError as error:
            raise CommandError(
                f"--out {str(target)!r} can't be written: {error.strerror}", WRONG_INPUT
            ) from None
        yield folder


@contextlib.contextmanager
def whole_folder(target: str | Path, mark: str) -> Iterator[WholeFolder]:
    """Open a folder that is replaced as a whole; that it can't be, or must not be, is wrong input."""
    with contextlib.ExitStack() as stack:
        try:
            folder = stack.enter_context(WholeFolder(target, mark))
        except ValueError as error:
            raise CommandError(f"--out {error}", WRONG_INPUT) from None
        except OSError as error:
            raise CommandError(
                f"--out {str(target)!r} can't be written: {error.strerror}", WRONG_INPUT
            ) from None
        yield folder


@contextlib.contextmanager
def wrong_input() -> Iterator[None]:
    """Turn what is wrong with a file or a value into one line and exit code 2."""
    try:
        yield
    except ValueError as error:
        raise CommandError(" ".join(str(error).split()), WRONG_INPUT) from None
    except OSError as error:
        text = f"{error.filename!r}: {error.strerror}" if error.filename else str(error)
        raise CommandError(text, WRONG_INPUT) from None


def file_name(terrain_name: str) -> str:
    """A terrain's name as a file's: what is not a letter, a digit, a dash or a dot becomes a dash."""
    return re.sub(r"[^\w.-]+", "-", terrain_name).strip("-.") or "terrain"


def load(*modules: str) -> None:
    """Import modules with signals held back: broken into, extension modules end in an ImportError."""
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        for module in modules:
            importlib.import_module(module)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)
