"""The report in a real browser: pictures decode, nothing sticks out of the page at any width."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from agent.report import estimate_html
from tests.unit import report_examples as examples

NAMES = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next((found for name in NAMES if (found := shutil.which(name))), None)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--virtual-time-budget=5000",
    "--window-size=1400,2000",
)
WIDTHS_PX = (360, 420, 768, 1280)

# The page itself has no script; the page around it looks at it through frames of several widths.
MEASURE = """
<script>
addEventListener("load", () => {
  const found = [...document.querySelectorAll("iframe")].map(frame => {
    const page = frame.contentDocument, width = page.documentElement.clientWidth;
    const images = [...page.images];
    const leftOf = element => element.getBoundingClientRect().right - width;
    return {
      asked: Number(frame.width), width, scroll: page.documentElement.scrollWidth,
      images: images.length, decoded: images.filter(i => i.complete && i.naturalWidth > 0).length,
      out: Math.max(...[...page.querySelectorAll("h1,h2,p,dd,li,img")].map(leftOf)),
      narrow: images.filter(i => i.naturalWidth < 500).length,
      lowest: Math.min(...[...page.querySelectorAll("main *")].filter(
        e => !e.closest("svg,sub,sup,.unseen") && e.textContent.trim()
      ).map(e => parseFloat(frame.contentWindow.getComputedStyle(e).fontSize))),
    };
  });
  document.body.innerHTML = "<pre id=found>" + JSON.stringify(found) + "</pre>";
});
</script>
"""


@pytest.mark.skipif(BROWSER is None, reason="no chromium here: the layout is not looked at")
def test_page_fits_phone_tablet_and_desktop(tmp_path: Path) -> None:
    assert BROWSER is not None
    estimate, views = examples.velocity_only()
    text = estimate_html(
        estimate,
        views,
        robot="a-robot-with-one-very-long-name-without-any-space-in-it-" * 3,
        axis=1,
        metadata={**examples.METADATA, "notes": "x" * 300},
    )
    inside = html.escape(text)
    frames = "".join(
        f'<iframe width="{width}" height="900" style="border:0" srcdoc="{inside}"></iframe>'
        for width in WIDTHS_PX
    )
    around = tmp_path / "around.html"
    around.write_text(f"<!doctype html><body>{frames}{MEASURE}</body>", encoding="utf-8")
    done = subprocess.run(
        [BROWSER, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", around.as_uri()],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    match = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert match, done.stderr
    found = json.loads(html.unescape(match[1]))
    assert [frame["asked"] for frame in found] == list(WIDTHS_PX)
    for frame in found:
        assert frame["scroll"] <= frame["width"], frame
        assert frame["out"] <= 0.5, frame
        assert frame["images"] == frame["decoded"] == 3, frame
        assert frame["narrow"] == (3 if frame["asked"] <= 640 else 0), frame
        assert frame["lowest"] >= 13.0, frame
