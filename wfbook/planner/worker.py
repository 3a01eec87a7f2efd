"""A second core for the search: a forked process that does half of what can be done at once.

Clarabel holds Python's lock while it works, so threads do not help. The worker is forked with the
compiled programs in place, so that only small vectors travel. What is done where depends on the search
alone, not on time, so runs repeat.
"""

import contextlib
import multiprocessing
import os
import signal
import weakref
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any


class Worker:
    """A forked process that calls one function again and again."""

    def __init__(self, function: Callable[..., Any]):
        """Start the process.

        Args:
            function: what it calls; arguments and results travel, all else is as it was at the fork.
        """
        context = multiprocessing.get_context("fork")
        self._pipe, far = context.Pipe()
        process = context.Process(target=_serve, args=(far, self._pipe, function), daemon=True)
        process.start()
        far.close()
        self._process = process
        self._close = weakref.finalize(self, _stop, self._pipe, process)

    def ask(self, *arguments: Any) -> None:
        """Begin a call."""
        self._pipe.send(arguments)

    def answer(self) -> Any:
        """Wait for the call's result."""
        return self._pipe.recv()

    def answered(self, timeout: float) -> bool:
        """Wait for the call's result for some seconds, and tell whether it is there."""
        return self._pipe.poll(timeout)

    def close(self) -> None:
        """End the process, once its call is done."""
        self._close()

    def kill(self) -> None:
        """End the process at once, in the middle of its call."""
        self._process.kill()
        self._close()


def available() -> bool:
    """Tell whether there is a second core, and a system (Linux) on which a process can be forked safely.

    A worker has no worker of its own: the other core is busy with what started it.
    """
    if multiprocessing.current_process().daemon or not hasattr(os, "sched_getaffinity"):
        return False
    return len(os.sched_getaffinity(0)) > 1


def _serve(pipe: Connection, theirs: Connection, function: Callable[..., Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is the search's to handle
    theirs.close()
    with contextlib.suppress(EOFError, OSError):
        while (arguments := pipe.recv()) is not None:
            pipe.send(function(*arguments))


def _stop(pipe: Connection, process: multiprocessing.Process) -> None:
    with contextlib.suppress(OSError):
        pipe.send(None)
    pipe.close()
    process.join(timeout=5.0)
    if process.is_alive():
        process.terminate()
        process.join()
