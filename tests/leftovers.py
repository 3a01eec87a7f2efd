"""What tests started must end with them: a run fails that leaves a server, a kernel or a browser behind.

Every process that a run starts, however far down, inherits a mark in its environment; at the end those that
still live are looked for.
"""

import contextlib
import os
import secrets
import time

import psutil
import pytest
from lab import PATIENCE, described, listening

MARK = "WFBOOK_TEST_RUN"
_SERVERS = ("ipykernel", "jupyter", "chromium", "playwright", "distributed")


def leftovers(mark: str) -> list[psutil.Process]:
    """Return the processes with a mark, besides this one, that are servers or listen on a port."""
    found = []
    for process in psutil.process_iter():
        # Others' processes may not be read, and some end while we look.
        with contextlib.suppress(psutil.Error):
            marked = process.pid != os.getpid() and process.environ().get(MARK) == mark
            if marked and (any(word in described(process) for word in _SERVERS) or listening([process])):
                found.append(process)
    return found


class Leftovers:
    """A plugin of pytest, for the process that has the terminal; pytest-xdist's workers inherit its mark."""

    def __init__(self) -> None:
        self._mark = os.environ[MARK] = secrets.token_hex(8)
        self._found: list[str] = []

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        """Wait a moment for what is ending, then look."""
        end = time.monotonic() + PATIENCE / 6
        while (left := leftovers(self._mark)) and time.monotonic() < end:
            time.sleep(0.1)
        self._found = [described(process) for process in left]
        if self._found and exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Name what is left."""
        for name in self._found:
            terminalreporter.line(f"still running after the tests: {name}", red=True)
