"""Result folders that appear whole or not at all."""

import contextlib
import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self


class ResultFolder:
    """A folder that is filled out of sight and put in place at the end.

    Used as a context: ``path`` is a hidden folder beside the target. ``publish`` moves what it holds into
    the target. Leaving the context without ``publish`` leaves nothing behind, not even parent folders.

    Attributes:
        target: where the results will be.
        path: where to write them meanwhile; on the same file system, so that moving is one step a file.
    """

    def __init__(self, target: str | os.PathLike, names: tuple[str, ...]) -> None:
        """Remember the target; ``names`` are all files that a folder of this kind may hold."""
        self.target = Path(target)
        self.path = self.target
        self._names = names
        self._made: list[Path] = []

    def __enter__(self) -> Self:
        """Make the hidden folder, and so find out whether the target can be written.

        Raises:
            OSError: the target, or a folder above it, can't be written.
        """
        try:
            self._make_parents()
            if self.target.exists():
                # Replaces nothing yet, but fails here, before the work, if files can't be put there.
                with tempfile.TemporaryFile(dir=self.target):
                    pass
            self.path = Path(tempfile.mkdtemp(prefix=f".{self.target.name}-", dir=self.target.parent))
        except BaseException:
            self._remove_parents()
            raise
        return self

    def publish(self) -> None:
        """Move the files into the target and remove those that an earlier run left and this one lacks.

        Raises:
            OSError: a file can't be moved.
        """
        self.target.mkdir(exist_ok=True)
        for name in self._names:
            if (self.path / name).exists():
                (self.target / name).parent.mkdir(exist_ok=True)
                os.replace(self.path / name, self.target / name)
            else:
                (self.target / name).unlink(missing_ok=True)
        self._made.clear()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the hidden folder, and the parents that were made for nothing."""
        shutil.rmtree(self.path)
        self._remove_parents()

    def _make_parents(self) -> None:
        missing = []
        parent = self.target.parent
        while not parent.exists():
            missing.append(parent)
            parent = parent.parent
        for folder in reversed(missing):
            folder.mkdir()
            self._made.append(folder)

    def _remove_parents(self) -> None:
        while self._made:
            with contextlib.suppress(OSError):  # something else was put there meanwhile
                self._made.pop().rmdir()


class WholeFolder(ResultFolder):
    """A result folder of files that nobody can name beforehand: what was there gives way as a whole.

    Only an empty folder, or one that an earlier run has filled, is replaced.

    Attributes:
        target: where the results will be.
        path: where to write them meanwhile.
        scratch: for everything else; it goes away in any case.
    """

    def __init__(self, target: str | os.PathLike, mark: str) -> None:
        """Remember the target; ``mark`` is a file by which a folder of this kind is known."""
        super().__init__(target, ())
        self._mark = mark
        self._hidden = self.scratch = self.target

    def __enter__(self) -> Self:
        """Make the hidden folder.

        Raises:
            OSError: the target, or a folder above it, can't be written.
            ValueError: the target holds something else.
        """
        if self.target.is_dir() and any(self.target.iterdir()) and not (self.target / self._mark).is_file():
            raise ValueError(
                f"{str(self.target)!r} holds something else, which would be lost: choose another"
            )
        super().__enter__()
        self._hidden, self.path, self.scratch = self.path, self.path / "new", self.path / "scratch"
        self.path.mkdir()
        self.scratch.mkdir()
        return self

    def publish(self) -> None:
        """Put the new folder into the place of the old one, which goes back if that fails.

        Raises:
            OSError: a folder can't be moved.
        """
        old = self._hidden / "old"
        if self.target.exists():
            os.replace(self.target, old)
        try:
            os.replace(self.path, self.target)
        except OSError:
            if old.exists():
                os.replace(old, self.target)
            raise
        self._made.clear()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the hidden folder, with what was replaced, and the parents that were made for nothing."""
        self.path = self._hidden
        super().__exit__(kind, error, trace)


@contextlib.contextmanager
def undisturbed() -> Iterator[None]:
    """Ignore interrupts while results are written, for the impatient interrupt twice."""
    before = {kind: signal.signal(kind, signal.SIG_IGN) for kind in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)
