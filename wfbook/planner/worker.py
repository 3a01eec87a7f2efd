"""A second core for the search: solves one child of a split while this process solves the other.

Clarabel holds Python's lock while it works, so threads do not help. The worker is forked with the
compiled program in place and gets only a pair of vectors at a time. What is solved where depends on the
search alone, not on time, so runs repeat.
"""

import contextlib
import multiprocessing
import os
import signal
import weakref
from multiprocessing.connection import Connection

import numpy as np

from wfbook.planner.conic import Boxed, Conic, Solution


class Worker:
    """A forked process that solves a boxed program."""

    def __init__(self, conic: Conic, box: np.ndarray):
        """Start the process.

        Args:
            conic: the program.
            box: columns of the boxed variables; of ``y`` only these are sent back.
        """
        context = multiprocessing.get_context("fork")
        self._pipe, far = context.Pipe()
        process = context.Process(target=_serve, args=(far, self._pipe, conic, box), daemon=True)
        process.start()
        far.close()
        self._close = weakref.finalize(self, _stop, self._pipe, process)

    def ask(self, lower: np.ndarray, upper: np.ndarray, cutoff: float) -> None:
        """Begin to solve (see :meth:`.conic.Boxed.solve`)."""
        self._pipe.send((lower, upper, cutoff))

    def answer(self) -> Solution:
        """Wait for the solution; its ``y`` holds the boxed variables only."""
        return self._pipe.recv()

    def close(self) -> None:
        """End the process."""
        self._close()


def available() -> bool:
    """Tell whether there is a second core, and a system that can fork."""
    return hasattr(os, "fork") and len(os.sched_getaffinity(0)) > 1


def _serve(pipe: Connection, theirs: Connection, conic: Conic, box: np.ndarray) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is the search's to handle
    theirs.close()
    program = Boxed(conic, box)
    with contextlib.suppress(EOFError, OSError):
        while (question := pipe.recv()) is not None:
            pipe.send(program.solve(*question))


def _stop(pipe: Connection, process: multiprocessing.Process) -> None:
    with contextlib.suppress(OSError):
        pipe.send(None)
    pipe.close()
    process.join(timeout=5.0)
    if process.is_alive():
        process.terminate()
        process.join()
