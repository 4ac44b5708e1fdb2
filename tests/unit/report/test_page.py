"""The page: whole, offline, escaped, honest, the same every time."""

from __future__ import annotations

import base64
import dataclasses
import functools
import hashlib
import html
import os
import re
import subprocess
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pytest

from agent.errors import StorageError
from agent.identify.result import Estimate, Parameter
from agent.report import EstimateViews, estimate_html, write_estimate_report
from agent.report.advice import next_steps
from agent.report.provenance import in_words, metadata_rows
from tests.unit.report import estimate_examples as examples

Case = Callable[[], tuple[Estimate, EstimateViews]]
CASES = (examples.decided, examples.validated, examples.velocity_only, examples.undecided)
VOID = frozenset({"meta", "link", "img", "source", "br", "circle", "path"})
LIMIT_BYTES = 1_500_000


class Page(HTMLParser):
    """A page taken apart: elements that were closed in order, attributes, visible text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.words: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(text)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th") and self.rows:
            self.rows[-1].append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"closed but never opened: {tag}"
        assert self.open.pop() == tag, f"closed out of order: {tag}"
        if tag not in ("span", "strong", "i", "sub", "sup", "a"):
            self.words.append(" ")

    def handle_data(self, data: str) -> None:
        if "style" in self.open:
            return
        self.words.append(data)
        if self.rows and ("td" in self.open or "th" in self.open):
            self.rows[-1][-1] += data

    @property
    def text(self) -> str:
        return re.sub(r"[ \n]+", " ", "".join(self.words))

    def all(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.elements if name == tag]

    def row(self, label: str) -> list[str]:
        return next(row for row in self.rows if row and row[0] == label)


@functools.cache
def page(case: Case) -> tuple[str, Page]:
    estimate, views = case()
    text = estimate_html(estimate, views, robot="cell7-irb6650", axis=1, metadata=examples.METADATA)
    return text, Page(text)


@pytest.mark.parametrize("case", CASES)
def test_page_is_well_formed_accessible_offline_and_small(case: Case) -> None:
    text, parsed = page(case)
    assert parsed.all("html") == [{"lang": "en"}]
    assert len(parsed.all("h1")) == 1
    ids = [attributes["id"] for _, attributes in parsed.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    for _, attributes in parsed.elements:
        assert attributes.get("aria-labelledby", ids[0]) in ids
    images = parsed.all("img")
    assert images
    assert all(len(image["alt"]) > 40 for image in images)
    assert len(parsed.all("svg")) == len(parsed.all("title")) - 1
    assert len(parsed.all("table")) == len(parsed.all("caption"))
    assert all("scope" in header for header in parsed.all("th"))
    assert not parsed.all("script")
    assert "default-src 'none'" in text
    addresses = [
        attributes[name]
        for _, attributes in parsed.elements
        for name in ("src", "srcset", "href", "xlink:href", "action", "data", "poster")
        if name in attributes
    ]
    assert addresses
    assert all(address.startswith("data:") for address in addresses)
    assert "http:" not in text
    assert "https:" not in text
    assert "url(" not in text
    assert "@import" not in text
    assert len(text.encode()) < LIMIT_BYTES


@pytest.mark.parametrize("case", CASES)
def test_pictures_load_nothing_from_outside(case: Case) -> None:
    text, _ = page(case)
    pictures = re.findall(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", text)
    assert pictures
    for picture in pictures:
        svg = base64.b64decode(picture).decode("utf-8")
        links = re.findall(r'(?:href|src)="([^"]*)"', svg) + re.findall(r"url\(([^)]*)\)", svg)
        assert all(link.startswith(("#", "data:")) for link in links)
        assert "<script" not in svg
        assert "<metadata" not in svg


def test_same_input_gives_the_same_bytes_in_another_process() -> None:
    script = (
        "import hashlib, sys\n"
        "from tests.unit.report import estimate_examples as e, test_page as t\n"
        "print(hashlib.sha256(t.page(e.decided)[0].encode()).hexdigest())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        timeout=600,
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )
    here = hashlib.sha256(page(examples.decided)[0].encode()).hexdigest()
    assert done.stdout.strip() == here


def test_sections_come_from_verdict_to_method() -> None:
    _, parsed = page(examples.decided)
    order = [
        "Estimated",
        "Key numbers",
        "Friction curve",
        "The cycle over time",
        "Predicted and measured torque",
        "Friction models compared",
        "Data quality",
        "How it was computed",
    ]
    places = [parsed.text.index(f" {heading} ") for heading in order]
    assert places == sorted(places)


def test_numbers_shown_are_the_estimate_s() -> None:
    _, parsed = page(examples.decided)
    assert parsed.row("Inertia, motor side") == [
        "Inertia, motor side",
        "184.0",
        "kg cm²",
        "182.0 to 186.0",
        "yes",
    ]
    coulomb = [row for row in parsed.rows if row and row[0] == "Coulomb friction"]
    assert coulomb[0][1:4] == ["0.6042", "N m", "0.5993 to 0.6091"]
    assert coulomb[1][1:4] == ["0.630", "N m", "0.545 to 0.715"]
    assert parsed.row("Stribeck velocity")[1:4] == ["7.03", "rad/s", "6.42 to 7.64"]
    assert parsed.row("Torque offset")[1:4] == ["0.0021", "N m", "−0.0017 to 0.0059"]
    assert "Condition number (4.11) 400 " in parsed.text
    assert "Residual, rms 41.2 mN m " in parsed.text


def test_every_parameter_and_model_of_the_estimate_is_on_the_page() -> None:
    estimate, _ = examples.decided()
    _, parsed = page(examples.decided)
    for fit in estimate.friction_models:
        name = {"coulomb-viscous": "Coulomb + viscous", "stribeck": "Stribeck ✓ selected"}
        row = parsed.row(name.get(fit.model, "Feeny–Moon"))
        assert row[1] == f"{fit.bic:.1f}".replace("-", "−")
        assert float(row[3]) == pytest.approx(fit.rmse_nm * 1e3, rel=0.005)
        assert row[4] == f"{fit.fit_percent:.1f}"
        assert row[5] == fit.reason
    assert [row[0] for row in parsed.rows if row[-1:] == ["yes"]].count("Coulomb friction") == 5


def test_models_are_ranked_by_bic_and_only_the_selected_one_is_marked() -> None:
    _, parsed = page(examples.decided)
    above = [row[2] for row in parsed.rows if len(row) == 6 and row[0] != "Model"]
    assert above == ["0.0", "20.9", "53.8"]
    assert parsed.text.count("✓ selected") == 1


def test_parameter_that_is_not_identified_has_a_reason_and_no_number() -> None:
    text, parsed = page(examples.velocity_only)
    row = parsed.row("Gravity, sine of the arm angle")
    assert row == [
        "Gravity, sine of the arm angle",
        "–",
        "",
        "–",
        "no: the recording has no position",
    ]
    assert "0.0173" not in text


def test_not_decidable_shows_reasons_and_steps_and_no_numbers() -> None:
    estimate, _ = examples.undecided()
    text, parsed = page(examples.undecided)
    assert "Not decidable" in parsed.text
    assert all(reason in parsed.text for reason in estimate.reasons)
    assert "What to do" in parsed.text
    for invented in ("0.604", "184.0", "7.03", "95.3", "41.2", "Key numbers", "BIC −"):
        assert invented not in text
    assert "Friction models compared" not in text
    assert not any("kg cm²" in cell for row in parsed.rows for cell in row)
    assert len(parsed.all("img")) == 1


def test_verdict_is_told_by_word_and_shape_and_not_by_colour_alone() -> None:
    for case, word, shape in (
        (examples.decided, "Estimated", "circle"),
        (examples.undecided, "Not decidable", "path"),
    ):
        _, parsed = page(case)
        svg = next(k for k, (tag, _) in enumerate(parsed.elements) if tag == "svg")
        assert parsed.elements[svg + 1][0] == "title"
        assert parsed.elements[svg + 2][0] == shape
        assert word in parsed.text


def test_names_from_outside_are_text_and_nothing_else() -> None:
    hostile = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> $\\frac{1}{0}$ {{ 7*7 }}"
    estimate, views = examples.undecided()
    (view,) = views.recordings
    signals = dataclasses.replace(view.signals, name=hostile)
    text = estimate_html(
        dataclasses.replace(estimate, reasons=(hostile,), notes=(hostile,), sentence=hostile),
        EstimateViews((dataclasses.replace(view, signals=signals, started_at=hostile),) * 2),
        title=hostile,
        robot=hostile,
        axis=hostile,
        metadata={hostile: hostile, "drive": {hostile: [hostile]}},
    )
    parsed = Page(text)
    assert not parsed.all("script")
    assert not any("onerror" in attributes for _, attributes in parsed.elements)
    assert all(image["src"].startswith("data:") for image in parsed.all("img"))
    assert hostile in "".join(parsed.words)
    assert "49" not in html.unescape(parsed.row(hostile)[0])


def test_hostile_model_and_parameter_names_are_escaped_too() -> None:
    estimate, views = examples.decided()
    hostile = "<b>$x$</b>"
    models = tuple(
        dataclasses.replace(
            fit,
            model=f"{fit.model}{hostile}" if not fit.selected else fit.model,
            reason=hostile,
            parameters={**fit.parameters, f"{hostile}_nm": Parameter(0.1, (0.0, 0.2))},
        )
        for fit in estimate.friction_models
    )
    parsed = Page(estimate_html(dataclasses.replace(estimate, friction_models=models), views))
    assert not parsed.all("b")


def test_two_recordings_are_told_apart_and_the_validation_is_named() -> None:
    _, parsed = page(examples.validated)
    assert parsed.row("reversed-2026-03-01.parquet")[1] == "validation"
    assert parsed.row("stair-2026-03-01.parquet")[1:] == [
        "estimate",
        "2026-03-01 02:03:04",
        "40 s",
        "40\u202f000",
        "20",
        "24.1 to 24.6 °C",
    ]
    assert len(parsed.all("img")) == 5
    assert "not seen by the estimate" in parsed.text
    assert "Validation torque error 4.10 %" in parsed.text
    assert "Bear in mind" in parsed.text


def test_notes_are_sentences_and_the_method_is_told_where_it_belongs() -> None:
    made, views = examples.decided()
    names = made.recordings[0]
    notes = (
        f"{names}: 1 row was left out",
        "the arm is elastic",
        "signals and regressors were low-passed alike at 2.08 Hz",
    )
    html_text = estimate_html(dataclasses.replace(made, notes=notes), views)
    kept, computed = html_text.split('id="how"')
    assert f"<li>{names}: 1 row was left out.</li>" in kept
    assert "<li>The arm is elastic.</li>" in kept
    assert "low-passed alike" not in kept
    assert "<li>Signals and regressors were low-passed alike at 2.08\u00a0Hz.</li>" in computed
    assert "Fit of the rigid body" in kept


def test_many_recordings_stay_within_the_size_and_are_all_listed() -> None:
    estimate, _ = examples.decided()
    views = EstimateViews(tuple(examples.recording(f"run-{k}.parquet", seed=k) for k in range(6)))
    text = estimate_html(estimate, views)
    assert len(text.encode()) < LIMIT_BYTES
    parsed = Page(text)
    assert all(parsed.row(f"run-{k}.parquet") for k in range(6))
    assert "3 more recordings are part of the estimate and not drawn here" in parsed.text


def test_loss_and_missing_temperature_are_said() -> None:
    _, parsed = page(examples.velocity_only)
    assert "Samples lost 37 (0.092 %)" in parsed.text
    assert "Gearbox temperature not recorded" in parsed.text


def test_estimate_without_arrays_is_still_a_report() -> None:
    estimate, _ = examples.decided()
    bare = dataclasses.replace(
        estimate, friction_curve=None, friction_models=(), rigid_body=None, sentence=""
    )
    parsed = Page(estimate_html(bare, EstimateViews()))
    assert "The estimate is made." in parsed.text
    assert "stair-2026-03-01.parquet" in parsed.text
    assert not parsed.all("img")


def test_sentence_is_composed_from_the_numbers_when_there_is_none() -> None:
    _, parsed = page(examples.velocity_only)
    said = parsed.text.replace("\u00a0", " ")
    assert "Coulomb friction is 0.6042 N m (95 %: 0.5993 to 0.6091) and viscous friction is" in said


@pytest.mark.parametrize(
    ("reason", "word"),
    [
        ("log: sampled at 1 Hz, too slow for this motion", "Record faster"),
        ("log: the joint does not move", "this axis was driven"),
        (
            "log: the torque never changes (0 N m): check that it is the right object",
            "torque channel",
        ),
        ("log: the torque is cut off at a limit during 12 % of the time", "gentler"),
        ("log: position and velocity do not move together", "gear ratio"),
        ("the joint moves at steady velocity in one direction only", "Drive both directions"),
        ("no steady velocity was found", "Drive the stair"),
        ("the gearbox is too cold", "warm-up"),
        ("log: only 12 of 90 samples are left; too many frames lost", "why samples were lost"),
        ("something that nobody thought of", "Record this axis again"),
    ],
)
def test_reason_leads_to_what_to_do(reason: str, word: str) -> None:
    steps = next_steps([reason, reason])
    assert any(word in step for step in steps)
    assert len(steps) == len(set(steps))
    assert len(steps) <= 3


def test_metadata_is_put_in_words_and_none_is_dropped() -> None:
    rows = dict(metadata_rows({**examples.METADATA, "payload_kg": None, "zeta": True}))
    assert rows["Trajectory"] == "stair (from arm deg -50, to arm deg 50)"
    assert rows["Drive"] == "EPOS4 (vendor id 251, serial 123456)"
    assert rows["Coolant"] == "kind none"
    assert rows["Zeta"] == "yes"
    assert "Payload, kg" not in rows
    assert len(in_words(list(range(10_000)))) <= 320


def test_file_is_whole_and_replaces_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text("old")
    estimate, views = examples.undecided()
    assert write_estimate_report(path, estimate, views, metadata=examples.METADATA) == path
    assert Page(path.read_text(encoding="utf-8")).all("h1")
    assert [entry.name for entry in tmp_path.iterdir()] == ["report.html"]


def test_folder_that_is_missing_is_said_and_nothing_is_left(tmp_path: Path) -> None:
    estimate, views = examples.undecided()
    with pytest.raises(StorageError, match="missing"):
        write_estimate_report(tmp_path / "missing" / "report.html", estimate, views)
    assert not list(tmp_path.iterdir())
