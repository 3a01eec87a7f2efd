"""Chapters in real JupyterLab in a browser: they run, a widget answers, a replay plays, nobody is asked."""

import io
import re
from urllib.parse import urlsplit

import numpy as np
import psutil
import pytest
from chapters import FOLDER, PATHS
from lab import CHROMIUM, Lab, chromium, listening, watched
from PIL import Image
from playwright.sync_api import TimeoutError as Late
from playwright.sync_api import sync_playwright

SECOND = 1000.0  # Playwright counts milliseconds
WHOLE_TEST = 420.0
RUN_ALL = 300 * SECOND
ANSWER = 20 * SECOND

MOST = 4
"""How many of a panel's controls are tried; of some a picture may not depend for the moment."""

BUTTON = ".jupyter-button.mod-primary"
"""Starts what takes too long to follow a slider."""

CONTROLS = {
    "slider": ".widget-slider .noUi-handle",
    "checkbox": ".widget-checkbox input",
    "toggle": ".widget-toggle-button:not(.widget-toggle-buttons .mod-active)",
    "dropdown": ".widget-dropdown select",
    "handle": ".wfbook-board circle[role=slider]",
}

RUN = """() => {
  window.wfbookRan = null;
  window.jupyterapp.commands.execute("notebook:run-all-cells").then(
    () => { window.wfbookRan = "done"; }, (error) => { window.wfbookRan = String(error); });
}"""

ERRORS = """() => {
  const cells = [...window.jupyterapp.shell.currentWidget.content.model.cells];
  return cells.flatMap((cell, index) => (cell.outputs?.toJSON() ?? [])
    .filter((output) => output.output_type === "error")
    .map((output) => `cell ${index}: ${output.ename}: ${output.evalue}`));
}"""

READY = """() => {
  const panel = window.jupyterapp?.shell?.currentWidget;
  return panel?.context?.isReady && panel.sessionContext?.isReady
    && panel.sessionContext.session?.kernel?.status === "idle";
}"""

IDLE = """() => window.jupyterapp.shell.currentWidget.sessionContext.session.kernel.status === "idle" """

FIRST_OUTPUT = """() => document.querySelector(".jp-CodeCell .jp-Cell-outputArea")
  ?.querySelector("img, svg, canvas, iframe") !== null"""

PICTURES = """(panel) => {
  const drawn = [...panel.querySelectorAll("img, iframe, canvas, svg")]
    .filter((element) => !(element.closest(".wfbook-board") && element.closest("svg")));
  return drawn.map((element) => element.src || element.srcdoc
    || (element.toDataURL ? element.toDataURL() : element.outerHTML)).join(" ");
}"""

SHUT_DOWN = """async () => {
  const panel = window.jupyterapp.shell.currentWidget;
  await panel.sessionContext.shutdown();
  panel.context.model.dirty = false;
  panel.dispose();
}"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    chromium()
    server = Lab(FOLDER, tmp_path_factory.mktemp("lab"))
    yield server
    server.stop()


@pytest.fixture(scope="module")
def browser(lab):
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(
            executable_path=chromium(), args=list(CHROMIUM), timeout=60 * SECOND
        )
        yield found
        found.close()


@pytest.fixture
def page(browser, lab):
    """An empty page that can only reach this machine; ``page.asked`` are the other addresses it wanted."""
    # Reduced motion: replays wait for their button, and leave the processor to the kernel meanwhile.
    context = browser.new_context(viewport={"width": 1400, "height": 1000}, reduced_motion="reduce")
    context.set_default_timeout(30 * SECOND)
    page, asked = context.new_page(), []

    def leaves(address):
        parts = urlsplit(address)
        return parts.scheme not in ("data", "blob", "about") and parts.hostname != "127.0.0.1"

    def decide(route):
        if leaves(route.request.url):
            asked.append(route.request.url)
            route.abort()
        else:
            route.continue_()

    context.route("**/*", decide)
    page.on("websocket", lambda socket: asked.append(socket.url) if leaves(socket.url) else None)
    page.asked = asked
    with watched(WHOLE_TEST):
        yield page
        context.close()
    lab.shut_down_kernels()  # what a chapter that failed has left


@pytest.mark.parametrize("name", [path.name for path in PATHS])
def test_a_chapter_in_a_browser(name, lab, page):
    page.goto(lab.url(name))
    page.wait_for_function(READY, timeout=60 * SECOND)
    (kernel,) = lab.kernels()
    ports = listening([kernel])

    page.evaluate(RUN)
    page.wait_for_function("window.wfbookRan !== null", timeout=RUN_ALL)
    assert page.evaluate(ERRORS) == []
    assert page.evaluate("window.wfbookRan") == "done"
    page.wait_for_function(IDLE)
    assert page.evaluate(FIRST_OUTPUT), "the first code cell shows no picture, widget or replay"

    assert_a_widget_answers(page)
    assert_a_replay_plays(page)
    assert page.asked == []

    family = [kernel, *kernel.children(recursive=True)]
    assert listening(family) <= ports, "the chapter opened a port"
    page.evaluate(SHUT_DOWN)
    assert psutil.wait_procs(family, timeout=20.0)[1] == [], "a process outlives its kernel"


def test_a_page_that_asks_elsewhere_is_found_out(page):
    address = "http://192.0.2.1/picture.png"
    page.set_content(f"<img src={address!r} alt=''><p>text</p>")
    page.wait_for_selector("p")
    assert page.asked == [address]


@pytest.mark.parametrize(("ci", "outcome"), [("true", pytest.fail.Exception), ("", pytest.skip.Exception)])
def test_without_a_browser_ci_fails_and_others_skip(ci, outcome, monkeypatch):
    monkeypatch.setenv("CI", ci)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(outcome, match="no browser"):
        chromium()


def test_nothing_is_left_running(lab):
    assert lab.stop() == []


def assert_a_widget_answers(page):
    """Move controls, panel by panel, until the pictures around one change."""
    panels = page.locator(".wfbook-panel, .wfbook-board:not(.wfbook-panel .wfbook-board)")
    assert panels.count(), "no widget with the class wfbook-panel"
    tried = []
    for panel in panels.all():
        if answered(page, panel, tried):
            break
    else:
        pytest.fail(
            f"no picture changed after moving {', '.join(tried) or 'nothing, for there is no control'}"
        )
    alerts = page.locator(".wfbook-panel [role=alert]").all_inner_texts()
    assert not [text for text in alerts if re.match(r"\w+(Error|Exception): ", text)]


def answered(page, panel, tried):
    """Move the panel's controls in their order on the page until its pictures change.

    A panel that waits for its button gets it pressed.
    """
    button = panel.locator(BUTTON).first
    for control in panel.locator(", ".join(CONTROLS.values())).all()[:MOST]:
        if not control.is_visible() or not control.is_enabled():
            continue
        before = panel.evaluate(PICTURES)
        kind = next(k for k, css in CONTROLS.items() if control.evaluate("(e, css) => e.matches(css)", css))
        tried.append(kind)
        move(control, kind)
        if button.count() and button.is_enabled():
            button.click()
        try:
            page.wait_for_function(
                f"([panel, before]) => ({PICTURES})(panel) !== before",
                arg=[panel.element_handle(), before],
                timeout=ANSWER,
            )
        except Late:
            continue
        page.wait_for_function(IDLE, timeout=60 * SECOND)
        return True
    return False


def move(control, kind):
    """Do to a control what a reader does."""
    if kind in ("slider", "handle"):
        control.focus()
        at_end = control.get_attribute("aria-valuenow") == control.get_attribute("aria-valuemax") is not None
        for _ in range(3):
            control.press("ArrowLeft" if at_end else "ArrowRight")
    elif kind == "dropdown":
        chosen = control.evaluate("(select) => (select.selectedIndex + 1) % select.options.length")
        control.select_option(index=chosen)
    else:
        control.click()


def bring_into_view(page, locator):
    """Scroll until an element stays in the middle: cells above it take their height when they are seen."""
    for _ in range(20):
        locator.evaluate("(element) => element.scrollIntoView({block: 'center'})")
        page.wait_for_timeout(300)
        box = locator.bounding_box()
        if box and box["y"] >= 0.0 and box["y"] + box["height"] <= page.viewport_size["height"]:
            return
    pytest.fail("the replay can't be scrolled into view")


def assert_a_replay_plays(page):
    """The first replay of the page draws when it is seen, and moves when its button is pressed."""
    frame = page.locator("iframe[title=replay]").first
    bring_into_view(page, frame)
    inside = frame.element_handle().content_frame()
    inside.wait_for_selector("body[data-state=ready]", state="attached")
    picture = Image.open(io.BytesIO(frame.screenshot())).convert("RGB")
    colours = np.unique(np.asarray(picture).reshape(-1, 3), axis=0)
    assert len(colours) > 200, f"{len(colours)} colours in the replay's picture"
    still = inside.inner_text("#clock")
    inside.click("#play")
    inside.wait_for_function("(still) => document.querySelector('#clock').innerText !== still", arg=still)
    inside.click("#play")
