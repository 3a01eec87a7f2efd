"""Meshcat without a server: record its drawing commands and pack them into one page that plays them.

Meshcat draws by sending messages to a server process, which a browser asks for them. A page that must open
from a folder, in an exported book and in a notebook without a kernel can't ask anybody. So a
:class:`Recorder` takes the place of Meshcat's window and keeps the messages, and :func:`page` writes them,
compressed, into an HTML file together with Meshcat's own viewer.
"""

import base64
import gzip
import html
import struct
from functools import cache
from importlib.resources import files
from string import Template
from typing import Any

import umsgpack
from meshcat import Visualizer

_REFERENCES = ("uuid", "geometry", "material")


class Recorder:
    """Stands in for ``meshcat.visualizer.ViewerWindow``: keeps every command instead of sending it.

    Meshcat names its objects with random UUIDs; here they count up, so that the same drawing gives the
    same bytes.

    Attributes:
        commands: the commands in Meshcat's own form, in the order they were given.
    """

    def __init__(self) -> None:
        self.commands: list[dict[str, Any]] = []
        self._names: dict[str, str] = {}

    def send(self, command: Any) -> None:
        """Keep a command (Meshcat's window interface)."""
        self.commands.append(self._renamed(command.lower()))

    def get_scene(self) -> str:
        """Return the page (Meshcat's window interface: what ``Visualizer.static_html`` gives)."""
        return page(self.commands)

    def visualizer(self) -> Visualizer:
        """Return a Meshcat visualizer that draws into this recorder."""
        return Visualizer(window=self)

    def _renamed(self, data: Any) -> Any:
        if isinstance(data, dict):
            return {
                key: self._name(value)
                if key in _REFERENCES and isinstance(value, str)
                else self._renamed(value)
                for key, value in data.items()
            }
        if isinstance(data, list):
            return [self._renamed(value) for value in data]
        return data

    def _name(self, uuid: str) -> str:
        return self._names.setdefault(uuid, f"{len(self._names):08x}")


def pack(commands: list[dict[str, Any]]) -> bytes:
    """Pack commands for :func:`page`: each as MessagePack behind its length (4 bytes, little endian).

    Numbers are written in single precision, which halves the size and is finer than a pixel.
    """
    stream = bytearray()
    for command in commands:
        message = umsgpack.packb(command, force_float_precision="single")
        stream += struct.pack("<I", len(message)) + message
    return _zip(bytes(stream))


def unpack(packed: bytes) -> list[dict[str, Any]]:
    """Return the commands that :func:`pack` packed, as the page's player reads them."""
    stream, commands, start = gzip.decompress(packed), [], 0
    while start < len(stream):
        (length,) = struct.unpack_from("<I", stream, start)
        commands.append(umsgpack.unpackb(stream[start + 4 : start + 4 + length]))
        start += 4 + length
    return commands


def page(
    commands: list[dict[str, Any]],
    title: str = "replay",
    legend: dict[str, str] | None = None,
    start: float = 0.0,
    beside: str = "",
) -> str:
    """Return a self-contained HTML page that shows the commands and plays their animation.

    Args:
        commands: what a :class:`Recorder` kept.
        title: of the page.
        legend: colour for each name, shown in a corner.
        start: what the clock shows at the animation's first frame.
        beside: HTML over the picture's right corner. Its elements with ``data-from`` and ``data-to``, in
            seconds of the clock, have the class "now" in between.

    Returns:
        HTML that asks no server for anything; the same commands give the same text.
    """
    entries = "".join(
        f'<li><i style="background:{html.escape(colour)}"></i>{html.escape(name)}</li>'
        for name, colour in (legend or {}).items()
    )
    return Template(_read("player.html")).substitute(
        title=html.escape(title),
        legend=entries,
        start=f"{start:g}",
        beside=beside,
        script=_read("player.js"),
        viewer=_viewer(),
        commands=_text(pack(commands)),
    )


def viewer_script() -> str:
    """Return Meshcat's viewer with its licences, as a script that many pages can share."""
    viewer = files("meshcat") / "viewer"
    licences = [viewer / "LICENSE", viewer / "dist" / "main.min.js.LICENSE.txt"]
    notice = "\n".join(path.read_text(encoding="utf-8").replace("*/", "* /") for path in licences)
    return f"/* {notice} */\n{(viewer / 'dist' / 'main.min.js').read_text(encoding='utf-8')}"


def sharing(page: str, address: str) -> str:
    """Return a page that takes the viewer from a file that others take it from, too.

    Args:
        page: as :func:`page` returns it.
        address: of the file with :func:`viewer_script`, from the page.
    """
    own = f'<script type="text/plain" id="viewer">{_viewer()}</script>'
    return page.replace(own, f'<script src="{html.escape(address)}"></script>')


def frame(page: str, height: int = 420) -> str:
    """Return an iframe that holds a page, for a notebook's output."""
    source = page.replace("&", "&amp;").replace('"', "&quot;")
    style = f"width:100%;height:{height}px;border:0;display:block"
    return f'<div><iframe srcdoc="{source}" style="{style}" title="replay"></iframe></div>'


@cache
def _viewer() -> str:
    """The viewer, compressed, as text."""
    return _text(_zip(viewer_script().encode()))


@cache
def _read(name: str) -> str:
    return (files("wfbook.view") / name).read_text(encoding="utf-8")


def _zip(data: bytes) -> bytes:
    return gzip.compress(data, compresslevel=9, mtime=0)


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")
