"""The process of an answer: it runs a student's cells behind the fence, and tells what they define."""

import ast
import json
import os
import socket
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from wfbook.classroom import fence, wire


class Magics:
    """Stands for IPython where an answer left a magic: it is skipped, as it is no part of the answer."""

    def __init__(self, namespace: dict[str, Any]) -> None:
        self._namespace = namespace

    def run_cell_magic(self, name: str, line: str, cell: str) -> None:
        """Run what stands below a magic that only times or captures it."""
        if name in ("time", "timeit", "capture", "prun"):
            exec(compile(cell, "<answer>", "exec", dont_inherit=True), self._namespace)

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_, **__: None


def serve(
    channel: socket.socket,
    namespace: dict[str, Any],
    cells: Sequence[tuple[str, bool]],
    folder: Path,
    memory: int,
    seconds: float,
    fenced: bool,
) -> NoReturn:
    """Run cells, then answer questions about them until the other side ends; never returns.

    Args:
        channel: to the process that checks; everything else that is open is closed.
        namespace: of the chapter, as it is before the exercise.
        cells: sources, and whether each is the answer itself and no helper of it.
        folder: to work in.
        memory: bytes it may use.
        seconds: of processor time it may use.
        fenced: whether to close the fence.
    """
    try:
        fence.die_with_parent()
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nothing, stream)
        keep = channel.fileno()
        os.closerange(3, keep)
        os.closerange(keep + 1, os.sysconf("SC_OPEN_MAX"))
        os.chdir(folder)
        tempfile.tempdir = str(folder)
        fence.limit(memory, int(seconds))
        if fenced:
            fence.close(folder)
        magics = Magics(namespace)
        namespace["get_ipython"] = lambda: magics
        error = None
        for source, is_answer in cells:
            said = _run(source, namespace)
            error = said if is_answer and said else error
        _reply(channel, {"error": error})
        questions = Questions(channel, namespace)
        while True:
            questions.answer(questions.next())
    except BaseException:
        os._exit(1)


def _run(source: str, namespace: dict[str, Any]) -> list[str] | None:
    """Run a cell; return the kind and text of what it raises."""
    try:
        exec(compile(_plain(source), "<answer>", "exec", dont_inherit=True), namespace)
    except BaseException as error:  # an answer may call sys.exit
        return _told(error)
    return None


def _plain(source: str) -> str:
    """Return a cell as Python: IPython's own syntax becomes calls of :class:`Magics`."""
    try:
        ast.parse(source)
    except SyntaxError:
        from IPython.core.inputtransformer2 import TransformerManager

        return TransformerManager().transform_cell(source)
    return source


class Questions:
    """What the check asks: values by their names, and calls of functions, which may call back."""

    def __init__(self, channel: socket.socket, namespace: dict[str, Any]) -> None:
        self._channel = channel
        self._namespace = namespace
        self._kept: list[Any] = []

    def next(self) -> tuple[Any, ...]:
        """Return the next question, or what a function of the check returned."""
        return wire.loads(wire.receive(self._channel), self._theirs)

    def answer(self, question: tuple[Any, ...]) -> None:
        """Answer one."""
        kind, *rest = question
        try:
            reply = self._values(*rest) if kind == "values" else self._call(*rest)
        except BaseException as error:
            reply = {"error": _told(error)}
        _reply(self._channel, reply)

    def _values(self, names: Sequence[str]) -> dict[str, Any]:
        known = {name: self._namespace[name] for name in names if name in self._namespace}
        return {"values": {name: wire.encode(value, self._keep) for name, value in known.items()}}

    def _call(self, number: int, arguments: tuple[Any, ...], named: dict[str, Any]) -> dict[str, Any]:
        before = [np.array(a, copy=True) if isinstance(a, np.ndarray) else None for a in arguments]
        value = self._kept[number](*arguments, **named)
        changed = {
            str(i): wire.encode(a, self._keep)
            for i, (old, a) in enumerate(zip(before, arguments, strict=True))
            if old is not None and not (old.shape == a.shape and old.tobytes() == a.tobytes())
        }
        return {"value": wire.encode(value, self._keep), "changed": changed}

    def _keep(self, function: Any) -> int:
        self._kept.append(function)
        return len(self._kept) - 1

    def _theirs(self, number: int) -> Callable[..., Any]:
        """Return what stands for a function of the check: it is called over there."""

        def function(*arguments: Any) -> Any:
            said = [wire.encode(argument, self._keep) for argument in arguments]
            _reply(self._channel, {"callback": number, "arguments": said})
            while (message := self.next())[0] not in ("returned", "raised"):
                self.answer(message)
            kind, value = message
            if kind == "raised":
                raise RuntimeError(value)
            return value

        return function


def _told(error: BaseException) -> list[str]:
    try:
        return [type(error).__name__[:60], str(error)[:400]]
    except BaseException:
        return [type(error).__name__[:60], ""]


def _reply(channel: socket.socket, message: dict[str, Any]) -> None:
    sys.setrecursionlimit(2000)  # whatever the answer made of it
    wire.send(channel, json.dumps(message).encode())
