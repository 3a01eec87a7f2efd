"""A JupyterLab of the tests' own, and the browser that opens it. Nothing of either may outlive the tests."""

import contextlib
import json
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

PATIENCE = 60.0
"""For a server to answer or to end, in seconds."""

CHROMIUM = (
    *("--headless", "--no-sandbox", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--disable-quic"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)
"""Options with which Chromium draws WebGL on any machine, and asks nobody for anything by itself."""


def chromium() -> str:
    """Return the path of Debian's Chromium; without it fail in CI, and skip elsewhere."""
    path = shutil.which("chromium")
    if path is None:
        if os.environ.get("CI") == "true":
            pytest.fail("no browser: .ci/run has to install Debian's package chromium")
        pytest.skip("no browser: install Debian's package chromium")
    return path


class Lab:
    """``python -m jupyterlab`` on a copy of the notebooks, with a home of its own.

    Args:
        notebooks: the folder to copy.
        folder: an empty one for the copy, settings and logs.

    Attributes:
        address: of the server.
        token: that lets a browser in.
    """

    def __init__(self, notebooks: Path, folder: Path) -> None:
        shutil.copytree(notebooks, folder / "notebooks", ignore=shutil.ignore_patterns(".*"))
        with socket.create_server(("127.0.0.1", 0)) as probe:
            self._port = probe.getsockname()[1]
        self.address, self.token = f"http://127.0.0.1:{self._port}", secrets.token_hex(16)
        home = folder / "home"
        home.mkdir()
        names = ("CONFIG", "DATA", "RUNTIME")
        environment = dict(os.environ) | {f"JUPYTER_{name}_DIR": str(home / name) for name in names}
        environment |= {f"JUPYTERLAB_{name}_DIR": str(home / name) for name in ("SETTINGS", "WORKSPACES")}
        environment |= {"HOME": str(home), "IPYTHONDIR": str(home), "MPLCONFIGDIR": str(home)}
        command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--ip=127.0.0.1"]
        command += [f"--port={self._port}", "--ServerApp.port_retries=0", "--expose-app-in-browser"]
        command += [f"--IdentityProvider.token={self.token}", f"--notebook-dir={folder / 'notebooks'}"]
        # The server must not ask anybody for extensions, news or its own next version either.
        command += ["--LabApp.extension_manager=readonly", "--LabApp.news_url="]
        command += ["--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate"]
        self._log = folder / "jupyterlab.log"
        with self._log.open("w") as log:
            self._server = subprocess.Popen(
                command,
                env=environment,
                stdout=log,
                stderr=log,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        self._seen: set[psutil.Process] = {psutil.Process(self._server.pid)}
        self._wait_until_it_answers()

    def url(self, name: str) -> str:
        """Return where a browser finds a notebook."""
        return f"{self.address}/lab/tree/{name}?token={self.token}&reset"

    def kernels(self) -> list[psutil.Process]:
        """Return the processes of the kernels that run now."""
        return [process for process in self._descendants() if _is_kernel(process)]

    def shut_down_kernels(self) -> None:
        """End all kernels, as JupyterLab's own menu does: one that is merely killed is started again."""
        for kernel in json.load(self._ask("/api/kernels")):
            self._ask(f"/api/kernels/{kernel['id']}", method="DELETE").close()

    def stop(self) -> list[str]:
        """End the server as a user does, with a signal, and then by force whatever is left.

        Returns:
            Of each process that had to be killed, its command line; and the port, if it is still open.
        """
        self._descendants()
        if self._server.poll() is None:
            self._server.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._server.wait(PATIENCE)
        _, alive = psutil.wait_procs(self._seen, timeout=5.0)
        left = [described(process) for process in alive]
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._server.pid, signal.SIGKILL)
        for process in alive:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", self._port)) == 0:
                left.append(f"port {self._port}")
        return left

    def _descendants(self) -> set[psutil.Process]:
        """Return the processes below the server, and remember them: kernels are not in its group."""
        with contextlib.suppress(psutil.NoSuchProcess):
            now = set(psutil.Process(self._server.pid).children(recursive=True))
            self._seen |= now
            return now
        return set()

    def _ask(self, path: str, method: str = "GET") -> Any:
        """Return the server's answer, a file to read."""
        headers = {"Authorization": f"token {self.token}"}
        request = urllib.request.Request(f"{self.address}{path}", headers=headers, method=method)
        return urllib.request.urlopen(request, timeout=10.0)

    def _wait_until_it_answers(self) -> None:
        end = time.monotonic() + PATIENCE
        while self._server.poll() is None and time.monotonic() < end:
            with contextlib.suppress(urllib.error.URLError, ConnectionError, TimeoutError):
                self._ask("/api/status").close()
                return
            time.sleep(0.1)
        self.stop()
        raise RuntimeError(f"JupyterLab does not answer:\n{self._log.read_text()}")


@contextlib.contextmanager
def watched(seconds: float) -> Iterator[None]:
    """Kill the browser when this takes too long: then its commands fail, also those that know no timeout."""

    def kill() -> None:
        for process in psutil.Process().children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                if "chrom" in process.name():
                    process.kill()

    timer = threading.Timer(seconds, kill)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def listening(family: Iterable[psutil.Process]) -> set[int]:
    """Return the ports on which processes listen."""
    ports = set()
    for process in family:
        with contextlib.suppress(psutil.NoSuchProcess):
            found = process.net_connections("inet")
            ports |= {place.laddr.port for place in found if place.status == psutil.CONN_LISTEN}
    return ports


def _is_kernel(process: psutil.Process) -> bool:
    try:
        return "ipykernel_launcher" in process.cmdline()
    except psutil.NoSuchProcess:
        return False


def described(process: psutil.Process) -> str:
    """Return a process's command line."""
    try:
        return " ".join(process.cmdline()) or process.name()
    except psutil.NoSuchProcess:
        return str(process)
