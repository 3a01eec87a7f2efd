"""Plan and run files: arrays and JSON texts in one ``.npz``, written whole or not at all."""

import json
import os
import tempfile
import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

# A damaged archive shows itself in any of these ways.
_DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, KeyError, RuntimeError)


def save(path: str | os.PathLike, arrays: dict[str, np.ndarray], texts: dict[str, Any], version: int) -> None:
    """Write an archive; what was there stays if it fails.

    Args:
        path: of the file.
        arrays: by name.
        texts: values for JSON, by name, ``meta`` among them.
        version: of the format, kept in ``meta``.

    Raises:
        OSError: the file can't be written.
    """
    path = Path(path)
    texts = texts | {"meta": texts["meta"] | {"format": version}}
    contents = arrays | {name: np.array(json.dumps(value)) for name, value in texts.items()}
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".npz", delete=False) as file:
        try:
            np.savez(file, **contents)
            file.close()
            os.chmod(file.name, 0o644)
            os.replace(file.name, path)
        except BaseException:
            os.unlink(file.name)
            raise


def load(
    path: str | os.PathLike, kind: str, arrays: Iterable[str], texts: Iterable[str], version: int
) -> dict[str, Any]:
    """Read an archive.

    Args:
        path: of the file.
        kind: what it should be, for messages.
        arrays: names of the arrays it must hold.
        texts: names of the JSON texts it must hold, ``meta`` among them.
        version: of the format that is read.

    Returns:
        Arrays and values by name, ``meta`` without the version.

    Raises:
        ValueError: the file is no such archive, is truncated, or is of another version.
        FileNotFoundError: there is no such file.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            data = {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise
    except _DAMAGE as error:
        raise ValueError(f"{path}: not a {kind} file, or truncated") from error
    for name in (*arrays, *texts):
        if name not in data:
            raise ValueError(f"{path}: not a {kind} file: missing field {name!r}")
    result = {name: data[name] for name in arrays}
    for name in texts:
        try:
            result[name] = json.loads(str(data[name]))
        except json.JSONDecodeError as error:
            raise ValueError(f"{path}: {name}: not JSON ({error})") from error
    found = result["meta"].pop("format", None) if isinstance(result["meta"], dict) else None
    if found != version:
        raise ValueError(f"{path}: meta: {kind} format {found!r}, this program reads {version}")
    return result
