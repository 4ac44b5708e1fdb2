"""The pages of an explanation in a real browser: nothing sticks out of them at any width."""

from __future__ import annotations

import dataclasses
import html
import json
import re
import subprocess
from pathlib import Path

import pytest

from agent.explain.result import Cell
from agent.report.explanation import explanation_page
from tests.browser.test_report_layout import BROWSER, FLAGS, MEASURE, WIDTHS_PX
from tests.unit import explanation_examples as examples

LONG = "a_name_without_any_space_that_is_longer_than_a_phone_is_wide_" * 2


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
    """Return the fullest page, a tie with long names, and one that is not decidable."""
    tied = examples.tied()
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
    return [
        explanation_page(examples.partly(), robot="cell7", axis=1, metadata=examples.METADATA),
        explanation_page(long, title=LONG, robot=LONG, axis=1, next_file=f"{LONG}.json"),
        explanation_page(examples.undecided(), metadata={"notes": LONG}),
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
        timeout=120,
    )
    match = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert match, done.stderr
    found = json.loads(html.unescape(match[1]))
    assert [frame["asked"] for frame in found] == list(WIDTHS_PX) * len(texts)
    for frame, text in zip(found, (text for text in texts for _ in WIDTHS_PX), strict=True):
        pictures = text.count("<img ")
        assert frame["images"] == pictures, frame
        assert frame["decoded"] == pictures, frame
        assert frame["scroll"] <= frame["width"], frame
        assert frame["out"] <= 0.5, frame
        assert frame["narrow"] == (pictures if frame["asked"] <= 640 else 0), frame
        assert frame["lowest"] >= 13.0, frame
