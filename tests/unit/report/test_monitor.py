"""The monitor's page: what it must say, and what it must not do."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from agent.monitor.detection.detectors import detector
from agent.monitor.history.history import histories
from agent.monitor.verdict.verdict import Finding, judge
from agent.report import monitor as page
from agent.report.figures.monitor_curves import HEALTHY, figure_monitor_curves
from agent.report.figures.monitor_trends import figure_monitor_trends
from tests.unit.monitor.joint import Truth, months


def judged(cycles: int, truth: Truth | None = None, **joint: Any) -> Finding:
    nights = months(1, cycles, truth)
    named = dataclasses.replace(nights[0].joint, **joint)
    (history,) = histories(
        dataclasses.replace(c, joint=named, oil="VG220" if i > 50 else c.oil)
        for i, c in enumerate(nights)
    )
    return judge(history, detector(), 30)


@pytest.fixture(scope="module")
def worn() -> Finding:
    return judged(50, Truth(wear_nm=0.2, onset=32))


@pytest.fixture(scope="module")
def html(worn: Finding) -> str:
    """Return a page whose pictures are drawn, not rendered: the command's test has them whole."""
    waiting = judged(4, robot="<script>alert(1)</script>")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "data_uri", lambda _figure: "data:,")
        return page.monitor_html([worn, waiting], [("torn.parquet", "torn.parquet: is <no> file")])


def test_each_joint_has_its_verdict_and_its_reasons(html: str, worn: Finding) -> None:
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html)).replace("\u00a0", " ")
    assert "2 joints" in text
    assert "Alarm: friction has increased Friction is up" in text
    assert text.count("thesis") == 1  # where the method is explained
    assert "4 of 30 healthy cycles" in text
    assert worn.reasons is not None
    for cause in worn.reasons.causes:
        assert (cause.short if cause.slight else cause.words)[1:] in text
    assert "take a grease sample" in text
    assert worn.reasons.others.startswith("Less likely")
    assert worn.reasons.likely[0].short not in worn.reasons.others
    assert worn.reasons.others.count("under 1 %") == 1
    assert text.count("under 1 % each") == 1
    assert "Compared over 2 to 140 rad/s, low speed up to 46.7" in text
    assert "torn.parquet" in text
    assert re.findall(r'class="verdict (\w+)"', html) == ["undecided", "open"]  # no alarm's colour


def test_the_page_needs_nothing_from_outside_and_believes_no_name(html: str) -> None:
    assert not re.search(r'(src|href|srcset)="(?!data:|#)', html)
    assert "default-src 'none'" in html
    assert "<script" not in html
    assert "&lt;script&gt;" in html
    assert "is &lt;no&gt; file" in html


def title_of(axes: Axes) -> Text:
    words = axes.get_title(loc="left")
    return next(t for t in axes.findobj(Text) if str(t.get_text()) == words)


def test_every_panel_of_the_trends_is_drawn_and_events_are_named() -> None:
    finding = judged(90)
    figure = figure_monitor_trends(finding, narrow=True)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [
        "Detector (cusum): 1 is the alarm",
        "Low-speed integral",
        "Integral of the friction curve",
        "Coulomb friction",
        "Viscous friction",
        "Gearbox temperature",
    ]
    said = [t.get_text() for t in figure.axes[0].texts]
    assert said == ["oil change (VG150 to VG220)"]
    healthy = figure.axes[1].patches
    assert len(healthy) == 2, "each baseline is shaded"
    keys_stand_clear(figure)


def test_keys_of_a_phones_pictures_stand_clear_of_their_titles(worn: Finding) -> None:
    """A page's letters may be wider than those that a picture was measured with."""
    warm = months(1, 50, Truth(wear_nm=0.2, onset=32))
    warm[-1] = dataclasses.replace(warm[-1], temperature_degc=99.0)
    (history,) = histories(warm)
    trends = figure_monitor_trends(judge(history, detector(), 30), narrow=True)
    said = [t.get_text() for a in trends.axes if (k := a.get_legend()) for t in k.get_texts()]
    assert said.count("not seen by the baseline") == 1
    keys_stand_clear(trends)
    assert worn.comparison is not None
    for before in (HEALTHY, "the first cycles"):
        keys_stand_clear(figure_monitor_curves(worn.comparison, 60.0, before, narrow=True))


def keys_stand_clear(figure: Figure) -> None:
    """Check that no key is wider than the picture, or where its title would be in wider letters."""
    figure.draw_without_rendering()
    for axes in figure.axes:
        if (key := axes.get_legend()) is not None:
            covered, title = key.get_window_extent(), title_of(axes)
            box = title.get_window_extent()
            beside = Bbox.from_extents(box.x0, box.y0, box.x1 + 0.2 * box.width, box.y1)
            assert not covered.overlaps(beside), title.get_text()
            assert covered.x0 >= 0.0, "the key is wider than a phone"


def test_a_history_without_temperature_has_no_panel_for_it() -> None:
    cold = [dataclasses.replace(c, temperature_degc=float("nan")) for c in months(1, 12)]
    (history,) = histories(cold)
    finding = judge(history, detector(), 10)
    assert len(figure_monitor_trends(finding).axes) == 5
