"""The process that checks one answer: the check runs here, the answer runs in a process of its own."""

import ast
import contextlib
import os
import signal
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wfbook.classroom import answering, fence, wire
from wfbook.exercises.answer import WrongAnswer, other_draws

RIGHT, WRONG, LEARNED = "right", "wrong", "learned by heart"
EMPTY, FAILS, TIME, CRASH = "not answered", "raises", "out of time", "crashed"
"""Verdicts."""

_CHECK_MEMORY = 4 * 2**30
_CHECK_SECONDS = 900


@dataclass(frozen=True)
class Limits:
    """Of one answer.

    Attributes:
        seconds: that it may take, of wall clock and of processor time.
        memory: bytes that it may use beyond what the chapter does.
        fenced: whether it runs behind the fence.
    """

    seconds: float = 30.0
    memory: int = 2 * 2**30
    fenced: bool = True


class Ended(BaseException):
    """An answer that is over before its check is. No ``Exception``, for checks catch those of answers."""

    def __init__(self, verdict: str, message: str) -> None:
        super().__init__(message)
        self.verdict = verdict


class Answerer:
    """The other process, seen from here."""

    def __init__(self, channel: socket.socket, limits: Limits) -> None:
        self._channel = channel
        self._limits = limits
        self._left = limits.seconds
        self._functions: list[Any] = []

    def listen(self) -> dict[str, Any]:
        """Return the next message.

        Raises:
            Ended: there is none.
        """
        began = time.monotonic()
        try:
            return wire.receive_json(self._channel, began + self._left)
        except TimeoutError:
            raise Ended(TIME, f"it takes more than {self._limits.seconds:g} s") from None
        except (EOFError, OSError):
            raise Ended(CRASH, "its process ended") from None
        except wire.WireError as error:
            raise Ended(CRASH, f"its process sent something else than an answer ({error})") from None
        finally:
            self._left -= time.monotonic() - began

    def ask(self, *question: Any) -> dict[str, Any]:
        """Send a question; return the answer to it."""
        began = time.monotonic()
        self._channel.settimeout(max(self._left, 1e-3))
        try:
            wire.send(self._channel, wire.dumps(question, self._functions))
        except TimeoutError:
            raise Ended(TIME, f"it takes more than {self._limits.seconds:g} s") from None
        except OSError:
            raise Ended(CRASH, "its process ended") from None
        self._left -= time.monotonic() - began
        return self.listen()

    def values(self, names: Sequence[str]) -> dict[str, Any]:
        """Return what the answer calls by these names; what it does not know is left out."""
        reply = self.ask("values", list(names))
        if "error" in reply:
            raise Ended(FAILS, _line(reply["error"]))
        return {name: self._read(value) for name, value in self._object(reply, "values").items()}

    def call(self, number: int, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """Call a function of the answer, which may change arrays and raise as it would here."""
        reply = self.ask("call", number, arguments, named)
        while "callback" in reply:
            reply = self.ask(*self._called_back(reply))
        if "error" in reply:
            raise _raised(reply["error"])
        for index, changed in self._object(reply, "changed").items():
            with contextlib.suppress(ValueError, IndexError, TypeError):  # it lies: nothing has changed
                arguments[int(index)][...] = self._read(changed)
        return self._read(reply.get("value"))

    def _called_back(self, reply: dict[str, Any]) -> tuple[str, Any]:
        """Call a function of the check's that an answer was given; the time counts as the answer's."""
        began, number, arguments = time.monotonic(), reply["callback"], reply.get("arguments")
        if not isinstance(number, int) or not isinstance(arguments, list):
            raise Ended(CRASH, "its process sent something else than an answer")
        try:
            return "returned", self._functions[number](*map(self._read, arguments))
        except Exception as error:
            return "raised", f"{type(error).__name__}: {error}"
        finally:
            self._left -= time.monotonic() - began

    def _read(self, data: Any) -> Any:
        try:
            return wire.decode(data, lambda number: RemoteFunction(self, number))
        except wire.WireError as error:
            raise Ended(WRONG, f"the answer can't be read: {error}") from None

    def _object(self, reply: dict[str, Any], name: str) -> dict[str, Any]:
        value = reply.get(name)
        if not isinstance(value, dict):
            raise Ended(CRASH, "its process sent something else than an answer")
        return value


class RemoteFunction:
    """A function of the answer, called from the check."""

    def __init__(self, answerer: Answerer, number: int) -> None:
        self._answerer = answerer
        self._number = number

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call it with arrays and other values."""
        return self._answerer.call(self._number, arguments, named)

    def __repr__(self) -> str:
        return "<a function>"


def judge(
    cells: Sequence[tuple[str, bool]],
    check: str,
    names: Sequence[str],
    namespace: dict[str, Any],
    folder: Path,
    limits: Limits,
    salt: Path,
) -> tuple[str, str]:
    """Run an answer and check it.

    Args:
        cells: as :func:`wfbook.classroom.answering.serve` takes them.
        check: source of the cell that checks.
        names: that it takes from the answer.
        namespace: of the chapter, before the exercise.
        folder: for the answer to work in.
        limits: of the answer.
        salt: file with the number that makes a check draw other inputs, the second time; it is read when
            the answer has a process of its own, which can't find it then.

    Returns:
        The verdict and one line.
    """
    here, there = socket.socketpair()
    child = os.fork()
    if child == 0:
        here.close()
        answering.serve(there, namespace, cells, folder, limits.memory, limits.seconds, limits.fenced)
    there.close()
    fence.limit(_CHECK_MEMORY, _CHECK_SECONDS)
    try:
        return _judged(Answerer(here, limits), check, names, namespace, int(salt.read_text()))
    except Ended as ended:
        return ended.verdict, str(ended) + _how_it_ended(child, ended)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)


def run_imports(source: str, namespace: dict[str, Any]) -> None:
    """Run the imports of a check's cell, which later checks use, too."""
    tree = ast.parse(source)
    tree.body = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    exec(compile(tree, "<check>", "exec", dont_inherit=True), namespace)


def _judged(
    answerer: Answerer, check: str, names: Sequence[str], namespace: dict[str, Any], salt: int
) -> tuple[str, str]:
    error = answerer.listen().get("error")
    if error and error[0] == "NotImplementedError":
        return EMPTY, "the answer still raises NotImplementedError"
    values = answerer.values(names)
    lacking = [name for name in names if name not in values]
    if lacking:
        why = f"; the cell raises {_line(error)}" if error else ""
        return FAILS if error else WRONG, f"{lacking[0]} is not defined{why}"
    after = f" (the cell raises {_line(error)})" if error else ""
    with other_draws(None) as seen:
        verdict, message = _checked(check, namespace | values)
    if verdict != RIGHT:
        return (FAILS if error else verdict), message + after
    if seen.drawn:
        with other_draws(salt):
            hidden, why = _checked(check, namespace | values)
        if hidden != RIGHT:
            return LEARNED, f"right for the inputs in the chapter, not for others: {why}"
    return RIGHT, message + after


def _checked(check: str, namespace: dict[str, Any]) -> tuple[str, str]:
    """Run a check; its last expression is what it says."""
    tree = ast.parse(check)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    try:
        exec(compile(tree, "<check>", "exec", dont_inherit=True), namespace)
        said = last and eval(compile(ast.Expression(last.value), "<check>", "eval"), namespace)
    except WrongAnswer as error:
        return WRONG, str(error)
    except Exception as error:  # the check met what it was not made for
        return WRONG, f"the check can't use the answer: {type(error).__name__}: {error}"
    return RIGHT, said if isinstance(said, str) else ""


def _how_it_ended(child: int, ended: Ended) -> str:
    """Say how the answer's process ended, if that is why the answer did."""
    if ended.verdict != CRASH:
        return ""
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
            return f": {signal.Signals(-code).name if code < 0 else f'exit code {code}'}"
        time.sleep(0.01)
    return ""


def _raised(error: Any) -> Exception:
    """Return an exception of the kind that the answer raised."""
    kind, text = _pair(error)
    if kind == "NotImplementedError":
        return NotImplementedError(text)
    return type(kind if kind.isidentifier() else "Exception", (Exception,), {})(text)


def _line(error: Any) -> str:
    kind, text = _pair(error)
    return f"{kind}: {text}" if text else kind


def _pair(error: Any) -> tuple[str, str]:
    kind, text = error if isinstance(error, list) and len(error) == 2 else ("Exception", "")
    return str(kind)[:60], str(text)[:400]
