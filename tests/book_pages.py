"""The book's pages as a browser has them, opened from a folder: what is asked of every page, and of some."""

import contextlib
import re
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from lab import CHROMIUM, chromium
from playwright.sync_api import Page, sync_playwright

SECOND = 1000.0  # Playwright counts milliseconds
TELEPHONE = {"width": 390, "height": 800}

TYPESET = """() => {
  const all = [...document.querySelectorAll(".math")];
  return [all.length, all.filter((e) => e.querySelector(".katex-html")).length,
    [...document.querySelectorAll(".katex-error")].map((e) => e.textContent)];
}"""
BROKEN_IMAGES = (
    """() => [...document.images].filter((i) => i.complete && !i.naturalWidth).map((i) => i.src)"""
)
WIDTH = "document.documentElement.scrollWidth"
BACKGROUND = "getComputedStyle(document.body).backgroundColor"


class Watched:
    """A page, and what it asked for or complained of.

    Attributes:
        page: Playwright's.
        complaints: errors of scripts, and files that are missing.
        asked: addresses outside of the folder.
    """

    def __init__(self, page: Page, folder: Path) -> None:
        self.page, self.complaints, self.asked = page, [], []
        self._folder = folder.resolve()
        page.on("request", lambda request: self._look(request.url))
        page.on("websocket", lambda socket: self.asked.append(socket.url))
        page.on("requestfailed", lambda request: self.complaints.append(f"missing: {request.url[:200]}"))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", self._read)

    def open(self, name: str) -> Page:
        """Go to a page of the book."""
        self.page.goto(f"{self._folder.as_uri()}/{name}")
        return self.page

    def _look(self, address: str) -> None:
        parts = urlsplit(address)
        inside = parts.scheme == "file" and Path(unquote(parts.path)).is_relative_to(self._folder)
        if not inside and parts.scheme not in ("data", "blob", "about"):
            self.asked.append(address)

    def _read(self, message: object) -> None:
        if message.type == "error" or "theme mode" in message.text:
            self.complaints.append(message.text)


@contextlib.contextmanager
def browsed(folder: Path, **options: object) -> Iterator[Watched]:
    """Open a browser without a network on a folder; options are those of Playwright's contexts."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium(), args=list(CHROMIUM), timeout=60 * SECOND
        )
        context = browser.new_context(viewport={"width": 1400, "height": 1000}, **options)
        context.set_default_timeout(60 * SECOND)
        yield Watched(context.new_page(), folder)
        browser.close()


def pages_of(folder: Path) -> list[str]:
    """Return all pages of a book but the replays."""
    found = (path.relative_to(folder).as_posix() for path in folder.rglob("*.html"))
    return sorted(name for name in found if not name.startswith(("replays/", "_static/")))


def faults_of(watched: Watched, name: str) -> list[str]:
    """Open a page, and return what is wrong with it: requests, errors, mathematics, pictures, width."""
    watched.asked.clear()
    watched.complaints.clear()
    page = watched.open(name)
    page.wait_for_load_state("load")
    found = [f"asks {address}" for address in watched.asked]
    found += [f"says {text}" for text in watched.complaints]
    formulas, typeset, errors = page.evaluate(TYPESET)
    if formulas != typeset:
        found.append(f"{formulas - typeset} of {formulas} formulas are not typeset")
    found += [f"can't be typeset: {text}" for text in errors]
    found += [f"no picture: {address[:80]}" for address in page.evaluate(BROKEN_IMAGES)]
    before = page.viewport_size
    page.set_viewport_size(TELEPHONE)
    if (wide := page.evaluate(WIDTH)) > TELEPHONE["width"]:
        found.append(f"is {wide} pixels wide on a telephone of {TELEPHONE['width']}")
    page.set_viewport_size(before)
    return [f"{name}: {text}" for text in found]


def dead_links(folder: Path) -> list[str]:
    """Return the links that lead nowhere within the book: no such file, or no such place in it."""
    found = []
    for name in pages_of(folder):
        for address in sorted(_read(folder / name)[0]):
            parts = urlsplit(address)
            if parts.scheme or parts.netloc or address == "#":
                continue
            target = (folder / name).parent / unquote(parts.path) if parts.path else folder / name
            places = target.suffix == ".html" and "replays" not in target.parts
            if not target.is_file():
                found.append(f"{name}: {address}: no such file")
            elif parts.fragment and places and unquote(parts.fragment) not in _read(target.resolve())[1]:
                found.append(f"{name}: {address}: no such place")
    return found


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.links, self.places = set(), set()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self.places |= {given[key] for key in ("id", "name") if given.get(key)}
        self.links |= {given[key] for key in ("href", "src") if given.get(key)}


@cache
def _read(path: Path) -> tuple[frozenset[str], frozenset[str]]:
    """Return the links of a page, and the places in it that can be linked to."""
    reader = _Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    return frozenset(reader.links), frozenset(reader.places)


def assert_a_replay_plays(page: Page) -> None:
    """The first replay of a long page starts when it is seen, and lends its picture when it is not."""
    frame = page.locator("iframe[title=replay]").first
    frame.scroll_into_view_if_needed()
    inside = frame.element_handle().content_frame()

    def wait(condition: str) -> None:
        # Not by the frame's own pictures: what is out of sight draws none.
        inside.wait_for_function(condition, polling=200)

    inside.wait_for_selector("body[data-state=ready]", state="attached")
    still = inside.inner_text("#clock")
    wait(f"document.querySelector('#clock').innerText !== {still!r}")
    lost = "window.replay.viewer.renderer.getContext().isContextLost()"
    wait(f"!{lost}")
    page.evaluate("window.scrollTo(0, document.documentElement.scrollHeight)")
    wait(lost)
    frame.scroll_into_view_if_needed()
    wait(f"!{lost}")


def found_by_search(watched: Watched, words: str) -> list[str]:
    """Return the pages that the book's own search finds."""
    page = watched.open(f"search.html?q={words}")
    page.wait_for_selector("#search-results li a")
    page.wait_for_function(
        "!/Searching|Preparing/.test(document.querySelector('#search-results h2').innerText)"
    )
    return page.eval_on_selector_all("#search-results li a", "(links) => links.map((link) => link.href)")


def backgrounds(page: Page) -> dict[str, float]:
    """Choose light and dark with the page's own button; return how light its background is then."""
    found = {}
    for mode in ("light", "dark"):
        page.locator("button.theme-switch-button:visible").first.click()
        page.locator(f"button.theme-change-button[data-mode={mode}]:visible").first.click()
        page.wait_for_selector(f"html[data-theme={mode}]", state="attached")
        found[mode] = luminance(page.evaluate(BACKGROUND))
    return found


def luminance(colour: str) -> float:
    """Return how light a CSS colour ``rgb(r, g, b)`` is, from 0 to 1."""
    red, green, blue = (float(part) for part in re.findall(r"[\d.]+", colour)[:3])
    return (0.2126 * red + 0.7152 * green + 0.0722 * blue) / 255.0
