"""What is finished, kept run by run: a study that is killed loses nothing.

An SQLite file, because a row is in it whole or not at all, whenever and however the program ends, and
because thousands of runs are one file. Others can read it while the study goes on.
"""

import contextlib
import fcntl
import json
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

NAME = "runs.sqlite"
FORMAT = 1
"""Version of the file; one of another version is refused."""

_NEW = f"""
    BEGIN;
    CREATE TABLE runs (key TEXT PRIMARY KEY, row TEXT NOT NULL);
    PRAGMA user_version = {FORMAT};
    COMMIT;
"""


class StoreError(ValueError):
    """The folder can't be used: another program has it, it holds something else, or the disk is full."""


class Store:
    """The finished runs of one study, by their keys."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        """Use an open file, see :func:`opened`."""
        self._connection = connection

    def rows(self) -> dict[str, dict[str, Any]]:
        """Return all rows that are kept."""
        found = self._connection.execute("SELECT key, row FROM runs")
        return {key: json.loads(row) for key, row in found}

    def keep(self, key: str, row: dict[str, Any]) -> None:
        """Keep a row; once this returns, not even a power cut takes it away.

        Raises:
            StoreError: the file can't be written, as on a full disk; what it held stays.
        """
        try:
            with self._connection:
                self._connection.execute("INSERT OR REPLACE INTO runs VALUES (?, ?)", (key, json.dumps(row)))
        except sqlite3.OperationalError as error:
            raise StoreError(f"{NAME} can't be written: {error}") from None

    def forget(self, keys: list[str]) -> None:
        """Drop rows."""
        with self._connection:
            self._connection.executemany("DELETE FROM runs WHERE key = ?", [(key,) for key in keys])


@contextlib.contextmanager
def opened(folder: Path) -> Iterator[Store]:
    """Open the store in a folder, which it makes; if nothing is kept in it, it leaves nothing behind.

    Raises:
        StoreError: another study works in the folder, or there is no store of this version.
        OSError: the folder can't be written.
    """
    made = _make(folder)
    held = os.open(folder, os.O_RDONLY)
    path = folder / NAME
    try:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StoreError(f"another study is at work in {str(folder)!r}") from None
        connection = _connection(path)
        try:
            yield Store(connection)
        finally:
            empty = not connection.execute("SELECT count(*) FROM runs").fetchone()[0]
            connection.close()
            if empty:
                path.unlink()
    finally:
        os.close(held)
        with contextlib.suppress(OSError):  # what is not empty stays
            for parent in made:
                parent.rmdir()


def _make(folder: Path) -> list[Path]:
    """Make a folder and what is missing above it; return what was made, the lowest first."""
    missing = []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    for parent in reversed(missing):
        parent.mkdir()
    return missing


def _connection(path: Path) -> sqlite3.Connection:
    try:
        connection = sqlite3.connect(path)
    except sqlite3.OperationalError as error:
        raise OSError(0, str(error), str(path)) from None
    try:
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if version != FORMAT and tables:
            raise StoreError(f"{str(path)!r}: format {version}, this program reads {FORMAT}")
        if not tables:
            connection.executescript(_NEW)
    except sqlite3.DatabaseError as error:
        connection.close()
        raise StoreError(f"{str(path)!r}: not a file of finished runs, or damaged ({error})") from None
    except StoreError:
        connection.close()
        raise
    return connection
