"""The page in a real browser, on a simulated drive in real time: what a technician goes through.

One drive and one server for the whole file; the tests go on where the one before has ended.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np
import pyarrow.parquet as pq
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright

from agent.acquisition import Acquisition
from agent.record.metadata import KEY, Metadata
from drivers.clock import MonotonicClock
from fakes.process import open_bus
from tests.system.processes import MULTICAST_GROUP, be_patient, free_udp_port, started

CHROMIUM = next(
    (
        found
        for name in ("chromium", "chromium-browser", "google-chrome")
        if (found := shutil.which(name))
    ),
    None,
)
AXE = Path(__file__).with_name("vendor") / "axe-4.14.1.min.js"
SCREENSHOTS = os.environ.get("STRIBECK_SCREENSHOTS")
WIDTHS = {"phone": (390, 844), "tablet": (1024, 768), "desktop": (1440, 900)}
PASSWORD = "four plain words here"
LONG_MS = 60_000
expect.set_options(timeout=LONG_MS)  # five seconds is what playwright itself waits for a fact

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium here: the page is not looked at"),
    pytest.mark.real_time,
]


@dataclass
class Site:
    """The served page, its server, and somebody's browser."""

    url: str
    folder: Path
    server: subprocess.Popen[bytes]
    browser: Browser
    token: str

    def recordings(self) -> set[Path]:
        return set((self.folder / "recordings").glob("*.parquet"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder, port = tmp_path_factory.mktemp("page"), free_udp_port()
    try:
        open_bus("udp_multicast", MULTICAST_GROUP, options={"port": port}).shutdown()
    except (can.CanError, OSError) as error:
        pytest.skip(f"this machine has no IPv4 multicast: {error}")
    cell, log = folder / "cell.toml", folder / "serve.log"
    with ExitStack() as stack:
        drive: list[str | Path] = [
            "fake",
            "--write-cell",
            cell,
            "--short",
            "--bus-option",
            f"port={port}",
        ]
        stack.enter_context(started(drive, folder / "fake.log", ready="ready"))
        be_patient(cell)
        shorter = {
            "sample_rate_hz = 500.0": "sample_rate_hz = 100.0",
            "duration_s = 12.0": "duration_s = 9.0",
            "speeds = 5": "speeds = 3",
        }
        text = cell.read_text()
        for old, new in shorter.items():
            assert old in text, old
            text = text.replace(old, new)
        cell.write_text(text)
        server = stack.enter_context(
            started(["serve", cell, "--port", "0"], log, ready="give it there")
        )
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"]
        )
        stack.callback(browser.close)
        said = log.read_text()
        url = re.search(r"(http://127\.0\.0\.1:\d+)/", said)
        token = re.search(r"once: (\S+)", said)
        assert url is not None
        assert token is not None
        yield Site(url[1], folder, server, browser, token[1])


@pytest.fixture(scope="module")
def maria(site: Site) -> Iterator[BrowserContext]:
    """Be the engineer who has come in with the printed token."""
    context = site.browser.new_context(
        viewport={"width": 1024, "height": 768}, locale="en-GB", base_url=site.url
    )
    page = context.new_page()
    page.goto("/")
    expect(page).to_have_url(f"{site.url}/welcome")
    page.get_by_label("One-time token").fill(site.token)
    page.get_by_label("Name", exact=True).fill("maria")
    page.get_by_label("Password", exact=True).fill(PASSWORD)
    page.get_by_label("Password, once more").fill(PASSWORD)
    page.get_by_role("button", name="Begin").click()
    expect(page.get_by_role("heading", name="Axis 1")).to_be_visible()
    yield context
    context.close()


def opened(context: BrowserContext, path: str = "/") -> tuple[Page, list[str]]:
    """Return a new tab and the list of what goes wrong in it."""
    page, wrong = context.new_page(), []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda told: wrong.append(told.text) if told.type == "error" else None)
    page.goto(path)
    return page, wrong


def metadata_of(path: Path) -> Metadata:
    """Return what a recording says of itself; one that was stopped at once is too short to read."""
    return Metadata.loads(pq.read_schema(path).metadata[KEY.encode()], str(path))


def start(page: Page) -> None:
    page.goto("/axes/1/start")
    expect(page.get_by_text("Nothing speaks against it now.")).to_be_visible()
    page.get_by_role("checkbox").check()
    page.get_by_role("button", name="Start: the robot moves").click()
    expect(page.locator("#stage")).to_be_visible()


def moving(page: Page) -> None:
    """Wait until the stair is being driven and its samples are on the screen."""
    expect(page.locator("#stage")).to_have_text("Driving the stair", timeout=LONG_MS)
    expect(page.locator("#now-velocity")).to_have_text(re.compile(r"\d"), timeout=LONG_MS)


def test_from_the_start_to_the_result_while_the_server_is_frozen_for_a_while(
    site: Site, maria: BrowserContext
) -> None:
    """Start -> running -> result; the connection is lost and comes back; nothing is disturbed."""
    page, wrong = opened(maria, "/axes/1/start")
    drive = page.locator("#conditions li.holds", has_text="The right drive")
    expect(drive).to_have_count(1, timeout=LONG_MS)
    expect(page.get_by_text("read just now, and is judged again after the start")).to_have_count(1)
    expect(drive).to_be_hidden()
    page.locator("#holding summary").click()
    with page.expect_response("**/preconditions*"):
        expect(drive).to_be_visible()
    expect(drive).to_be_visible()  # it stays open when it is read anew
    before = site.recordings()
    start(page)
    moving(page)
    expect(page.locator("#step")).to_have_text(re.compile(r"^[2-6]$"), timeout=LONG_MS)
    expect(page.locator("#lost")).to_be_hidden()
    os.kill(site.server.pid, signal.SIGSTOP)
    try:
        expect(page.locator("#lost")).to_be_visible(timeout=LONG_MS)
    finally:
        os.kill(site.server.pid, signal.SIGCONT)
    expect(page.locator("#lost")).to_be_hidden(timeout=LONG_MS)
    expect(page.get_by_text("The cycle ran to its end. The joint is at rest.")).to_be_visible(
        timeout=LONG_MS
    )
    (path,) = site.recordings() - before
    metadata = metadata_of(path)
    assert "stopped_because" not in metadata.extra
    counted = Acquisition.from_metadata(metadata.extra, str(path))
    assert counted is not None
    assert counted.received + counted.lost == counted.expected
    live = maria.request.get("/run/live").text()  # the whole cycle once more, and its end
    ((_state, points),) = [
        json.loads(d) for d in re.findall(r"^data: (\[\{.+)$", live, re.MULTILINE)
    ]
    time_s = pq.read_table(path, columns=["time_s"])["time_s"].to_numpy()
    assert abs(len(points) - len(set(np.floor(time_s / 0.05)))) <= 1  # the last one is not whole
    page.get_by_role("link", name="Result").click()
    expect(page.get_by_role("heading", level=1)).to_contain_text("Friction was measured")
    expect(page.locator("#curve-chart canvas")).to_be_visible()
    assert wrong == []


def test_somebody_without_log_in_stops_the_joint_in_motion_by_one_key(
    site: Site, maria: BrowserContext
) -> None:
    """Two browsers at once: one watches, one that nobody has logged in to presses Esc."""
    watching, wrong = opened(maria)
    before = site.recordings()
    start(watching)
    with site.browser.new_context(locale="de-DE", base_url=site.url) as bystander:
        page, _ = opened(bystander, "/login")
        expect(page.locator("body")).to_have_attribute("data-running", "yes", timeout=LONG_MS)
        expect(page.get_by_role("button", name="Test stoppen (kein Not-Halt)")).to_be_visible()
        moving(watching)
        page.keyboard.press("Escape")
        expect(page.locator("#stop-said")).to_contain_text("Stopp ist angefordert")
    expect(watching.get_by_text("The test was stopped.")).to_be_visible(timeout=LONG_MS)
    expect(watching.locator("pre")).to_contain_text("The joint is at rest (measured).")
    (path,) = site.recordings() - before
    assert "the operator asked for it" in metadata_of(path).extra["stopped_because"]
    assert wrong == []


def test_a_viewer_sees_and_may_not_start(site: Site, maria: BrowserContext) -> None:
    page, _ = opened(maria, "/users")
    page.get_by_label("Name").fill("vera")
    page.get_by_label("Role").select_option("viewer")
    page.get_by_role("button", name="Make a token").click()
    token = page.locator(".token").inner_text()
    with site.browser.new_context(locale="de-DE", base_url=site.url) as context:
        own, wrong = opened(context, "/welcome")
        own.get_by_label("Einmal-Token").fill(token)
        own.get_by_label("Passwort", exact=True).fill(PASSWORD)
        own.get_by_label("Passwort wiederholen").fill(PASSWORD)
        own.get_by_role("button", name="Los").click()
        expect(own.get_by_role("heading", name="Achse 1")).to_be_visible()
        expect(own.get_by_role("link", name="Ergebnis")).to_be_visible()
        expect(own.get_by_role("link", name="Test starten")).to_have_count(0)
        assert wrong == []
        own.goto("/axes/1/start")
        expect(own.get_by_role("alert")).to_contain_text("Ihre Rolle darf das nicht.")


MEASURE = """
() => {
  const wide = document.documentElement.clientWidth;
  const targets = "a, button, input:not([type=hidden]), select, summary";
  const small = [...document.querySelectorAll(targets)]
    .filter(e => e.getClientRects().length && !e.closest("p:not(.actions):not(.crumb):not(.hint)"))
    .filter(e => !e.closest("label.tick") && e.getBoundingClientRect().height < 47.5)
    .map(e => e.outerHTML.slice(0, 80));
  const out = [...document.querySelectorAll("main *")]
    .filter(e => !e.closest("svg, .scroll, .unseen") && e.getBoundingClientRect().right > wide + 1)
    .map(e => e.outerHTML.slice(0, 80));
  return { scroll: document.documentElement.scrollWidth - wide, small, out };
}
"""
LAID_OUT = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""Charts follow their width in the frame after it has changed."""
AUDIT = """
async () => (await axe.run(document, { resultTypes: ["violations"] })).violations
  .filter(v => ["serious", "critical"].includes(v.impact))
  .map(v => v.id + ": " + v.nodes.map(n => n.html.slice(0, 120)).join(" | "))
"""


@pytest.mark.parametrize("language", ["en", "de"])
def test_every_page_fits_every_width_has_big_targets_and_nothing_serious_by_axe(
    site: Site, maria: BrowserContext, language: str
) -> None:
    result = sorted(site.recordings())[0].stem
    paths = [
        "/",
        "/run",
        "/axes/1",
        "/axes/1/start",
        f"/results/{result}",
        "/alarms",
        "/users",
        "/audit",
        "/login",
        "/stopped",
        "/nowhere",
    ]
    if language == "de":  # longer words: the pages with most of them
        paths = ["/", "/axes/1", "/axes/1/start", f"/results/{result}"]
    state = maria.storage_state()
    with site.browser.new_context(
        storage_state=state, base_url=site.url, bypass_csp=True
    ) as context:
        page, _ = opened(context, f"/language/{language}?back=/")
        for path in paths:
            page.goto(path)
            for name, (width, height) in WIDTHS.items():
                page.set_viewport_size({"width": width, "height": height})
                page.evaluate(LAID_OUT)
                found = page.evaluate(MEASURE)
                assert found == {"scroll": 0, "small": [], "out": []}, (path, name)
                _kept(page, f"{language}-{name}-{path.strip('/').split('/')[0] or 'cell'}")
            if language == "en":  # what axe looks at is the same in both
                page.evaluate(AXE.read_text(encoding="utf-8") + "; 0")
                assert page.evaluate(AUDIT) == [], path


def test_on_a_phone_the_head_is_one_row_and_its_menu_never_covers_the_stop(
    site: Site, maria: BrowserContext
) -> None:
    with site.browser.new_context(
        viewport={"width": 390, "height": 480},
        has_touch=True,
        is_mobile=True,
        locale="en-GB",
        storage_state=maria.storage_state(),
        base_url=site.url,
    ) as context:
        page, wrong = opened(context)
        link = page.get_by_role("link", name="Audit trail")
        expect(link).to_be_hidden()
        head, stop = (page.locator(what).bounding_box() for what in (".top", "#stop"))
        assert head is not None
        assert stop is not None
        assert head["height"] < 64.0
        assert 48.0 <= stop["height"] < 72.0
        expect(page.get_by_text("or press Esc")).to_be_hidden()
        page.get_by_role("button", name="Menu").tap()
        expect(page.get_by_role("link", name="Alarms")).to_be_visible()
        at = (stop["x"] + stop["width"] / 2, stop["y"] + 2.0)
        assert page.evaluate("at => !!document.elementFromPoint(...at).closest('#stop')", at)
        with page.expect_response("**/stop"):
            page.touchscreen.tap(*at)
        page.get_by_role("button", name="Menu").tap()
        link.tap()
        expect(page.get_by_role("heading", name="Audit trail")).to_be_visible()
        assert wrong == []


def _kept(page: Page, name: str) -> None:
    """Keep a picture for people to look at, where STRIBECK_SCREENSHOTS names a folder."""
    if SCREENSHOTS:
        number = len(list(Path(SCREENSHOTS).glob("*.png")))
        page.screenshot(path=Path(SCREENSHOTS) / f"{number:03d}-{name}.png", full_page=True)


def test_the_page_is_ready_within_a_second(maria: BrowserContext) -> None:
    """Of the machine's own time where nothing else runs; a loaded one gets what it needs."""
    ready = []
    for _ in range(3):
        page, _wrong = opened(maria, "/")
        ready.append(
            page.evaluate("() => performance.getEntriesByType('navigation')[0].domInteractive")
        )
        page.close()
    assert min(ready) < 1000.0, ready


def test_a_page_that_is_killed_takes_its_cycle_to_rest(site: Site, maria: BrowserContext) -> None:
    """Last, for it ends the server: nobody could stop the joint from the page any more."""
    page, _ = opened(maria)
    before = site.recordings()
    start(page)
    moving(page)
    os.kill(site.server.pid, signal.SIGKILL)
    site.server.wait()
    expect(page.locator("#lost")).to_be_visible(timeout=LONG_MS)
    page.keyboard.press("Escape")
    expect(page.locator("#stop-said")).to_contain_text("THE STOP DID NOT GET THROUGH")
    deadline_s = time.monotonic() + 60.0
    while not site.recordings() - before:
        assert time.monotonic() < deadline_s
        MonotonicClock().sleep_until(time.monotonic() + 0.1)
    (path,) = site.recordings() - before
    assert "SIGHUP" in metadata_of(path).extra["stopped_because"]
