"""The pages in a real browser: pictures decode, nothing sticks out of a page at any width.

One start of the browser looks at all of them.
"""

from __future__ import annotations

import dataclasses
import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from agent.explain.answer.result import Cell
from agent.report import estimate_html
from agent.report.explanation.page import explanation_page
from tests.unit.report import estimate_examples as estimates
from tests.unit.report import explanation_examples as explanations

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
LONG = "a_name_without_any_space_that_is_longer_than_a_phone_is_wide_" * 2

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


def wide_map() -> tuple[Cell, ...]:
    """Return every base parameter along every axis that there is."""
    axes = (
        "velocity_rad_s",
        "direction",
        "acceleration_rad_s2",
        "after_reversal_rad",
        "time_s",
        "elapsed_s",
        "arm_position_rad",
        "load_torque_nm",
        "order_per_motor_rev 12.5",
        "gearbox_temperature_degc",
        "motor_temperature_degc",
        "recording",
    )
    parameters = (
        "offset",
        "inertia_kg_m2",
        "viscous_nm_s_per_rad",
        "coulomb_nm",
        "gravity",
        "scale",
    )
    return tuple(
        Cell(parameter, axis, 0.013 * (i + k), 0.01, counts=i + k > 9)
        for i, axis in enumerate(axes)
        for k, parameter in enumerate(parameters)
    )


def pages() -> list[str]:
    """Return an estimate, and explanations: the fullest, a long tie, one that is not decidable."""
    tied = explanations.tied()
    following = tied.next_experiment
    assert following is not None
    long = dataclasses.replace(
        tied,
        recordings=(LONG, LONG),
        cells=wide_map(),
        reasons=(LONG,),
        aliases=((LONG, LONG),),
        not_judged={LONG: LONG},
        next_experiment=dataclasses.replace(following, tells_apart=(LONG, LONG), set_up=LONG),
    )
    estimate, views = estimates.velocity_only()
    notes = {**estimates.METADATA, "notes": "x" * 300}
    return [
        estimate_html(estimate, views, robot=LONG, axis=1, metadata=notes),
        explanation_page(
            explanations.partly(), robot="cell7", axis=1, metadata=explanations.METADATA
        ),
        explanation_page(long, title=LONG, robot=LONG, axis=1, next_file=f"{LONG}.json"),
        explanation_page(explanations.undecided(), metadata={"notes": LONG}),
    ]


@pytest.mark.skipif(BROWSER is None, reason="no chromium here: the layout is not looked at")
def test_pages_fit_phone_tablet_and_desktop(tmp_path: Path) -> None:
    assert BROWSER is not None
    texts = pages()
    frames = "".join(
        f'<iframe width="{width}" height="900" style="border:0" srcdoc="{html.escape(text)}">'
        "</iframe>"
        for text in texts
        for width in WIDTHS_PX
    )
    around = tmp_path / "around.html"
    around.write_text(f"<!doctype html><body>{frames}{MEASURE}</body>", encoding="utf-8")
    done = subprocess.run(
        [BROWSER, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", around.as_uri()],
        capture_output=True,
        text=True,
        check=True,
        timeout=600,
    )
    match = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert match, done.stderr
    found = json.loads(html.unescape(match[1]))
    assert texts[0].count("<img ") == 3
    assert [frame["asked"] for frame in found] == list(WIDTHS_PX) * len(texts)
    for frame, text in zip(found, (text for text in texts for _ in WIDTHS_PX), strict=True):
        pictures = text.count("<img ")
        assert frame["images"] == pictures, frame
        assert frame["decoded"] == pictures, frame
        assert frame["scroll"] <= frame["width"], frame
        assert frame["out"] <= 0.5, frame
        assert frame["narrow"] == (pictures if frame["asked"] <= 640 else 0), frame
        assert frame["lowest"] >= 13.0, frame
