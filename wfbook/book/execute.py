"""Chapters executed side by side, each in a kernel and a folder of its own.

What a chapter leaves is a notebook with all outputs and the last state of its widgets. With a cache, a
chapter that has not changed, under code that has not changed, is not executed again.
"""

import asyncio
import contextlib
import hashlib
import os
import tempfile
from collections.abc import AsyncIterator, Callable, Coroutine, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError

import wfbook

ROOT = Path(wfbook.__file__).resolve().parent.parent
PATIENCE = 600
"""Seconds that a cell may take."""

_SOURCES = {"wfbook": ("*.py", "*.js", "*.html"), "assets": ("*.json", "*.npz", "*.xml")}
"""What chapters depend on besides their own text: by folder, the files."""


class ChapterError(Exception):
    """A cell of a chapter failed; the text names both in one line."""


def execute(
    paths: Sequence[Path],
    cores: int,
    kept: Path | None = None,
    show: Callable[[str], None] = lambda text: None,
) -> dict[Path, nbformat.NotebookNode]:
    """Execute notebooks.

    Args:
        paths: of the notebooks, which are left as they are.
        cores: how many are executed at a time.
        kept: folder of executed chapters, to take them from and put them into; by default all are executed.
        show: is told how far it is.

    Returns:
        By path, the notebooks with their outputs, in the order of ``paths``.

    Raises:
        ChapterError: a cell failed.
        OSError: a notebook can't be read, or the folder can't be written.
        ValueError: a file is no notebook.
    """
    found: dict[Path, nbformat.NotebookNode] = {}
    texts = {path: path.read_bytes() for path in paths}
    for path in paths:
        if kept is not None and (copy := kept / _name(path, texts[path])).exists():
            found[path] = nbformat.read(copy, as_version=4)
    missing = [path for path in paths if path not in found]
    if missing:
        with tempfile.TemporaryDirectory(prefix="wfbook-chapters-") as scratch:
            notebooks = {path: _read(path, texts[path]) for path in missing}

            def keep(path: Path) -> None:
                if kept is not None:
                    kept.mkdir(parents=True, exist_ok=True)
                    _write_whole(kept / _name(path, texts[path]), notebooks[path])

            _run(_all(notebooks, Path(scratch), cores, show, keep))
        found |= notebooks
    return {path: found[path] for path in paths}


def _read(path: Path, text: bytes) -> nbformat.NotebookNode:
    try:
        notebook = nbformat.reads(text.decode(), as_version=4)
        nbformat.validate(notebook)
    except (ValueError, nbformat.ValidationError) as error:  # nbformat's own errors are ValueErrors
        raise ValueError(f"{path.name!r} is no notebook: {str(error).splitlines()[0]}") from None
    return notebook


def _run(work: Coroutine[Any, Any, None]) -> None:
    """Run to the end; of several failures at a time the first is told."""
    try:
        asyncio.run(work)
    except ExceptionGroup as group:
        raise group.exceptions[0] from None


async def _all(
    notebooks: dict[Path, nbformat.NotebookNode],
    scratch: Path,
    cores: int,
    show: Callable[[str], None],
    keep: Callable[[Path], None],
) -> None:
    """Execute in place; the first failure, like an interrupt, ends the other kernels."""
    gate, done, busy = asyncio.Semaphore(cores), [], {}

    def tell() -> None:
        places = ", ".join(f"{name} cell {at}" for name, at in busy.items())
        show(f"{len(done)} of {len(notebooks)} chapters executed; {places}")

    async def one(path: Path, notebook: nbformat.NotebookNode) -> None:
        async with gate:
            folder = scratch / path.stem
            folder.mkdir()

            def at(index: int) -> None:
                busy[path.stem[:2]] = f"{index + 1}/{len(notebook.cells)}"
                tell()

            await _one(path, notebook, folder, at)
            del busy[path.stem[:2]]
            done.append(path)
            keep(path)
            tell()

    async with asyncio.TaskGroup() as group:
        for path, notebook in notebooks.items():
            group.create_task(one(path, notebook))


async def _one(path: Path, notebook: nbformat.NotebookNode, folder: Path, at: Callable[[int], None]) -> None:
    client = NotebookClient(
        notebook, timeout=PATIENCE, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    async with _kernel(client, folder):
        for index, cell in enumerate(notebook.cells):
            at(index)
            try:
                await client.async_execute_cell(cell, index)
            except (CellExecutionError, CellTimeoutError, DeadKernelError) as error:
                if asyncio.current_task().cancelling():  # which nbclient takes for a kernel's death
                    raise asyncio.CancelledError from None
                raise ChapterError(f"{path.name}, cell {index}: {_what(error)}") from None
        client.set_widgets_metadata()


@contextlib.asynccontextmanager
async def _kernel(client: NotebookClient, folder: Path) -> AsyncIterator[None]:
    """Start a kernel, and end it however this ends.

    nbclient's own context takes SIGINT and SIGTERM away from whoever waits for them.
    """
    manager = client.create_kernel_manager()
    manager.connection_file = str(folder / "kernel.json")
    manager.transport, manager.ip = "ipc", str(folder / "k")  # opens no port
    try:
        await client.async_start_new_kernel(env=_environment(folder))
        await client.async_start_new_kernel_client()
        yield
    finally:
        if client.kc is not None:
            client.kc.stop_channels()
        if manager.has_kernel:
            await manager.shutdown_kernel(now=True)


def _what(error: Exception) -> str:
    """Return what went wrong in a cell in one line."""
    if isinstance(error, CellExecutionError):
        return " ".join(f"{error.ename}: {error.evalue}".split())
    if isinstance(error, CellTimeoutError):
        return f"takes more than {PATIENCE} s"
    return "the kernel died"


def _environment(folder: Path) -> dict[str, str]:
    """A kernel imports this very wfbook, computes on one core, and keeps its history to itself."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {
        "PYTHONPATH": os.pathsep.join(paths),
        "IPYTHONDIR": str(folder / "ipython"),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }


@cache
def _code() -> bytes:
    """Digest of what every chapter depends on."""
    digest = hashlib.sha256()
    for folder, patterns in _SOURCES.items():
        for path in sorted(path for pattern in patterns for path in (ROOT / folder).rglob(pattern)):
            if not path.is_relative_to(ROOT / "wfbook" / "book"):
                digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    with contextlib.suppress(FileNotFoundError):
        digest.update((ROOT / "environment.txt").read_bytes())
    return digest.digest()


def _name(path: Path, text: bytes) -> str:
    return f"{path.stem}-{hashlib.sha256(_code() + text).hexdigest()[:20]}.ipynb"


def _write_whole(path: Path, notebook: nbformat.NotebookNode) -> None:
    scratch = path.with_suffix(".part")
    nbformat.write(notebook, scratch)
    os.replace(scratch, path)
