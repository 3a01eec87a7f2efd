"""What goes between the process of an answer and the one that checks it.

The answer's side is not trusted. What comes from it is JSON of a few kinds of values, never a pickle, which
could run code where it is read. A function stays where it is and is called from afar.
"""

import base64
import binascii
import dataclasses
import importlib
import io
import json
import numbers
import pickle
import socket
import struct
import time
import types
from collections.abc import Callable, KeysView, ValuesView
from typing import Any

import numpy as np

LARGEST = 64 * 2**20
"""Bytes of a message, at most."""

_LENGTH = struct.Struct("!Q")
_SEQUENCES = {"list": list, "tuple": tuple, "set": set, "frozenset": frozenset}
_DEPTH = 40
_BITS = 4096
_OURS = "wfbook."


class WireError(Exception):
    """What came is no message."""


@dataclasses.dataclass(frozen=True)
class Unknown:
    """Stands for a value of a kind that is not sent.

    Attributes:
        kind: its type.
    """

    kind: str

    def __repr__(self) -> str:
        return f"<{self.kind}>"


def encode(value: Any, keep: Callable[[Any], int], depth: int = 0) -> Any:
    """Return a value in JSON's types.

    Args:
        value: numbers, texts, arrays, wfbook's dataclasses, functions, and lists, tuples, sets and
            dictionaries of them. What is derived from one of these becomes one, and anything else
            :class:`Unknown`.
        keep: keeps a function, and returns the number it is called by.
        depth: of this value in another.
    """
    kind = type(value)
    if depth > _DEPTH:
        return {"unknown": kind.__name__}
    if isinstance(value, np.ndarray | np.generic) and np.asarray(value).dtype.kind in "biufcUS":
        array = np.asarray(value)
        data = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
        scalar = isinstance(value, np.generic)
        return {"array": data, "type": array.dtype.str, "shape": array.shape, "scalar": scalar}
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int) and value.bit_length() < _BITS:
        return int(value)
    if isinstance(value, numbers.Real | str):
        return str(value) if isinstance(value, str) else float(value)
    if isinstance(value, complex):
        return {"complex": [value.real, value.imag]}
    if isinstance(value, bytes):
        return {"bytes": base64.b64encode(value).decode()}
    if isinstance(value, dict):
        return {"dict": [[encode(k, keep, depth + 1), encode(v, keep, depth + 1)] for k, v in value.items()]}
    for name, sequence in _SEQUENCES.items():
        if isinstance(value, sequence):
            return {name: [encode(entry, keep, depth + 1) for entry in value]}
    if isinstance(value, range | KeysView | ValuesView):
        return {"list": [encode(entry, keep, depth + 1) for entry in value]}
    if dataclasses.is_dataclass(kind) and kind.__module__.startswith(_OURS):
        fields = {
            field.name: encode(getattr(value, field.name), keep, depth + 1)
            for field in dataclasses.fields(value)
            if field.init
        }
        return {"dataclass": [kind.__module__, kind.__qualname__], "fields": fields}
    if callable(value):
        return {"function": keep(value)}
    return {"unknown": kind.__name__}


def dumps(value: Any, functions: list[Any]) -> bytes:
    """Return a pickle of what a check asks; functions that are no module's are appended to ``functions``.

    Only this way is trusted: from the check to the answer.
    """
    stream = io.BytesIO()
    pickler = _Pickler(stream)
    pickler.functions = functions
    pickler.dump(value)
    return stream.getvalue()


def loads(data: bytes, function: Callable[[int], Any]) -> Any:
    """Return what :func:`dumps` packed, with ``function(number)`` for each function that stayed there."""
    unpickler = _Unpickler(io.BytesIO(data))
    unpickler.function = function
    return unpickler.load()


class _Pickler(pickle.Pickler):
    functions: list[Any]

    def persistent_id(self, value: Any) -> int | None:
        """Number a function that can't be imported."""
        if isinstance(value, types.FunctionType) and "<" in value.__qualname__:
            self.functions.append(value)
            return len(self.functions) - 1
        return None


class _Unpickler(pickle.Unpickler):
    function: Callable[[int], Any]

    def persistent_load(self, number: int) -> Any:
        """Return what stands for a function."""
        return self.function(number)


def decode(data: Any, function: Callable[[int], Any]) -> Any:
    """Return the value that was encoded.

    Args:
        data: of :func:`encode`, from whom it may.
        function: returns what stands for a function with a number.

    Raises:
        WireError: it is none.
    """
    try:
        return _decode(data, function)
    except (ValueError, TypeError, KeyError, AttributeError, ImportError, binascii.Error) as error:
        raise WireError(f"{type(error).__name__}: {error}") from None
    except (RecursionError, MemoryError, OverflowError) as error:
        raise WireError(type(error).__name__) from None


def _decode(data: Any, function: Callable[[int], Any]) -> Any:
    if not isinstance(data, dict):
        if isinstance(data, list):
            raise WireError("a bare list")
        return data
    if "array" in data:
        kind = np.dtype(data["type"])
        if kind.kind not in "biufcUS":
            raise WireError(f"an array of {kind}")
        array = np.frombuffer(base64.b64decode(data["array"]), kind).reshape(data["shape"]).copy()
        return array[()] if data["scalar"] else array
    if "complex" in data:
        return complex(*data["complex"])
    if "bytes" in data:
        return base64.b64decode(data["bytes"])
    if "dict" in data:
        return {_decode(k, function): _decode(v, function) for k, v in data["dict"]}
    if "dataclass" in data:
        return _dataclass(*data["dataclass"])(
            **{name: _decode(value, function) for name, value in data["fields"].items()}
        )
    if "function" in data:
        return function(int(data["function"]))
    if "unknown" in data:
        return Unknown(str(data["unknown"])[:60])
    for name, kind in _SEQUENCES.items():
        if name in data:
            return kind(_decode(entry, function) for entry in data[name])
    raise WireError("a value of no known kind")


def _dataclass(module: str, name: str) -> type:
    """Return one of wfbook's dataclasses, and nothing else."""
    if not module.startswith(_OURS):
        raise WireError(f"a dataclass of {module!r}")
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    ours = isinstance(found, type) and dataclasses.is_dataclass(found) and found.__module__ == module
    if not ours:
        raise WireError(f"{name} is no dataclass")
    return found


def send(channel: socket.socket, message: bytes) -> None:
    """Send one message."""
    channel.sendall(_LENGTH.pack(len(message)) + message)


def receive(channel: socket.socket, until: float | None = None) -> bytes:
    """Return one message.

    Args:
        channel: where it comes.
        until: when to stop waiting, by the monotonic clock; by default never.

    Raises:
        EOFError: the other side has ended.
        WireError: it is too long.
        TimeoutError: it does not come in time.
    """
    (length,) = _LENGTH.unpack(_exactly(channel, _LENGTH.size, until))
    if length > LARGEST:
        raise WireError(f"{length} bytes")
    return _exactly(channel, length, until)


def receive_json(channel: socket.socket, until: float | None = None) -> dict[str, Any]:
    """Return one message that is a JSON object; arguments and errors as those of :func:`receive`."""
    try:
        message = json.loads(receive(channel, until))
    except (ValueError, RecursionError):
        raise WireError("not JSON") from None
    if not isinstance(message, dict):
        raise WireError("no object")
    return message


def _exactly(channel: socket.socket, length: int, until: float | None) -> bytes:
    parts = bytearray()
    while len(parts) < length:
        if until is not None:
            channel.settimeout(max(until - time.monotonic(), 1e-3))
        part = channel.recv(min(length - len(parts), 2**20))
        if not part:
            raise EOFError
        parts += part
    return bytes(parts)
