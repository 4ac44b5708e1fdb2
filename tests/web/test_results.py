"""What a finished cycle says, an axis over time, alarms."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.record.events_file import read_events
from agent.record.verdict_file import read_verdict, verdict_path
from agent.web.against import Curve, against, curve_of
from agent.web.roles import Role
from agent.web.routes.cell import next_run
from agent.web.verdicts import finding
from tests.web.bench import Bench, estimate_document

SPEEDS = np.array([-50.0, -5.0, 5.0, 50.0])


@given(factor=st.floats(0.3, 3.0), half=st.floats(1e-4, 0.05))
def test_a_known_rise_is_recovered_in_both_directions(factor: float, half: float) -> None:
    friction = np.sign(SPEEDS) * (0.6 + 0.01 * np.abs(SPEEDS))
    spread = np.full(4, half)
    found = against(Curve(SPEEDS, factor * friction, spread), Curve(SPEEDS, friction, spread))
    assert found is not None
    assert found.whole.percent == pytest.approx(100.0 * (factor - 1.0), abs=1e-6)
    assert found.low is not None
    assert found.high is not None
    rise = abs(factor - 1.0) * np.abs(friction).mean()
    assert found.whole.clear == bool(rise > half * np.sqrt(2.0) / 2.0)


def test_noise_alone_is_called_clear_as_often_as_the_interval_says() -> None:
    generator = np.random.default_rng(7)
    friction, spread, clear = 0.6 + 0.01 * np.abs(SPEEDS), np.full(4, 1.96 * 0.01), 0
    signed = np.sign(SPEEDS) * friction
    for _ in range(2000):
        now, then = signed + 0.01 * generator.standard_normal((2, 4))
        found = against(Curve(SPEEDS, now, spread), Curve(SPEEDS, then, spread))
        assert found is not None
        clear += found.whole.clear
    assert 0.035 < clear / 2000 < 0.065


def test_curves_without_common_speeds_are_not_compared() -> None:
    one = Curve(np.array([1.0, 2.0]), np.ones(2), np.ones(2))
    other = Curve(np.array([5.0, 9.0]), np.ones(2), np.ones(2))
    assert against(one, other) is None


@pytest.mark.parametrize(
    "broken",
    [
        None,
        {},
        {"friction_curve": None},
        {"friction_curve": []},
        {"friction_curve": {"velocity_rad_s": [1], "friction_nm": "x", "ci95_nm": [[1, 2]]}},
        {"friction_curve": {"velocity_rad_s": [1, 2], "friction_nm": [1], "ci95_nm": [[1, 2]]}},
    ],
)
def test_an_estimate_without_a_usable_curve_has_none(broken: Any) -> None:
    assert curve_of(broken) is None


def kinds(bench: Bench, chosen: str = "") -> dict[str, str]:
    own = bench.page.shelf.look(bench.recordings, "simulated-joint", 1)
    return {cycle.name: finding(cycle, own, chosen).kind for cycle in own}


def test_each_cycle_says_what_it_is(bench: Bench) -> None:
    bench.shelve("first", 1)
    bench.shelve("same", 2, friction=1.0001)
    bench.shelve("more", 3, friction=1.2)
    bench.shelve("alarm", 4, friction=1.3, alarm=True)
    bench.shelve("undecided", 5, decidable=False)
    bench.shelve("stopped", 6, extra={"stopped_because": "stop"})
    bench.shelve("swapped", 7, extra={"gearbox_serial": "new"})
    bench.shelve("plain", 8).replace("x", "")
    (bench.recordings / "plain.estimate.json").write_text("[not json")
    assert kinds(bench) == {
        "first": "baseline",
        "same": "as_before",
        "more": "changed",
        "alarm": "alarm",
        "undecided": "undecidable",
        "stopped": "stopped",
        "swapped": "baseline",
        "plain": "unestimated",
    }
    assert kinds(bench, "more")["first"] == "changed"
    assert kinds(bench, "more")["more"] == "baseline"


def test_a_wide_interval_is_called_unclear_and_a_small_change_as_before(bench: Bench) -> None:
    bench.shelve("first", 1)
    bench.shelve("small", 2, friction=1.04)
    bench.shelve("wide", 3, friction=1.08)
    path = bench.recordings / "wide.estimate.json"
    document = json.loads(path.read_text())
    curve = document["friction_curve"]
    curve["ci95_nm"] = [[f - 0.4, f + 0.4] for f in curve["friction_nm"]]
    path.write_text(json.dumps(document))
    assert kinds(bench) == {"first": "baseline", "small": "as_before", "wide": "unclear"}
    text = bench.browser(Role.VIEWER).get("/results/wide").text
    text = text.replace('<span class="date">2026-03-01</span>', "2026-03-01")
    assert "does not tell whether friction has changed since 2026-03-01: +8.0\u00a0%" in text


def test_a_result_names_the_change_its_interval_and_what_the_temperature_may_do(
    bench: Bench,
) -> None:
    bench.shelve("first", 1)
    bench.shelve("warm", 2, friction=0.9, temperature_degc=[34.0, 36.0])
    browser = bench.browser(Role.VIEWER)
    text = browser.get("/results/warm").text
    text = text.replace('<span class="date">2026-03-01</span>', "2026-03-01")
    change = "Friction is 10.0\u00a0% (±\u00a00.1\u00a0%) lower than in the baseline of 2026-03-01."
    assert change in text
    assert "+9.5 K against the baseline" in text
    browser.get("/language/de?back=/")
    assert "10,0\u00a0% (±\u00a00,1\u00a0%) niedriger als in der Referenz vom 01.03.2026" in (
        browser.get("/results/warm").text
    )


def test_files_of_others_and_broken_files_are_passed_over(bench: Bench) -> None:
    bench.shelve("first", 1)
    (bench.recordings / "broken.parquet").write_bytes(b"PAR1 no")
    (bench.recordings / ".first.parquet.1.tmp.parquet").write_bytes(b"")
    (bench.recordings / "first.verdict.json").write_text("{}")
    bench.browser(Role.VIEWER)
    assert bench.browser(Role.VIEWER).get("/axes/1").status_code == 200
    assert list(kinds(bench)) == ["first"]


def test_csv_has_what_parquet_has(bench: Bench) -> None:
    bench.shelve("first", 1)
    browser = bench.browser(Role.VIEWER)
    parquet = pq.read_table(io.BytesIO(browser.get("/results/first/download/parquet").content))
    answer = browser.get("/results/first/download/csv")
    assert 'filename="first.csv"' in answer.headers["content-disposition"]
    table = pacsv.read_csv(io.BytesIO(answer.content)).cast(parquet.schema)
    assert table.replace_schema_metadata(None).equals(parquet.replace_schema_metadata(None))


def test_an_alarm_is_acknowledged_once_with_a_note_by_somebody(bench: Bench) -> None:
    bench.shelve("bad", 2, alarm=True)
    bench.shelve("fine", 3, alarm=False)
    toni = bench.browser(Role.TECHNICIAN)
    assert toni.post("/alarms/fine", {"note": "x"}).status_code == 404
    assert toni.post("/alarms/bad", {"note": "  "}).status_code == 422
    assert toni.post("/alarms/bad", {"note": "grease <checked>"}).status_code == 303
    assert toni.post("/alarms/bad", {"note": "again"}).status_code == 409
    text = toni.get("/alarms").text
    assert "grease &lt;checked&gt;" in text
    ((_, event),) = read_events(bench.recordings)[0]
    assert (event.kind, event.by, event.axis) == ("acknowledged", "toni", 1)


def test_an_event_is_kept_with_who_noted_it(bench: Bench) -> None:
    toni = bench.browser(Role.TECHNICIAN)
    for day in (1, 2):
        bench.shelve(f"cycle{day}", day)
    assert 'class="key event"' not in toni.get("/axes/1").text  # none is drawn yet
    assert toni.post("/axes/1/events", {"kind": "party"}).status_code == 422
    assert toni.post("/axes/1/events", {"kind": "oil-change", "note": "2.3 l"}).status_code == 303
    assert "2.3 l" in toni.get("/axes/1").text
    assert 'class="key event"' in toni.get("/axes/1").text
    ((_, event),) = read_events(bench.recordings)[0]
    assert (event.kind, event.by, event.text) == ("oil-change", "toni", "2.3 l")


def test_a_real_cycle_has_what_the_page_reads_and_is_judged_by_its_history(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The bench's document has the keys that the page reads, where a real estimate has them."""
    from agent.cli.page.run import judge_by_history
    from agent.cli.record.keep import keep
    from agent.conclude.outcome import conclude
    from agent.record.reading import read
    from tests.system.rig import rig

    with rig(tmp_path) as cell:
        result = cell.run()
    conclusion = conclude([read(result.recording)])
    real = conclusion.estimate.to_json()
    made = estimate_document(1.0)
    for part in ("friction_curve", "rigid_body", "quality"):
        assert set(made[part]) <= set(real[part]), part
    assert set(made["friction_models"][0]) <= set(real["friction_models"][0])
    assert curve_of(real) is not None
    own = keep(result.recording, conclusion)
    judge_by_history(verdict_path(result.recording))
    judged = read_verdict(verdict_path(result.recording))
    assert not judged.alarm  # one cycle is no baseline
    assert judged.sentence != own.sentence
    assert " ".join(judged.sentence.split()) in " ".join(capsys.readouterr().err.split())


def test_a_card_says_when_the_axis_runs_next(tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    assert next_run(cell, 1, "2026-03-02T12:00:00Z") == ""
    (tmp_path / "cell.night.toml").write_text(
        'schema = "stribeck.night/1"\ntime_zone = "Europe/Berlin"\n'
        '[[axis]]\nnumber = 1\ndays = ["tue"]\nwindow = "22:00-05:00"\n'
    )
    assert next_run(cell, 1, "2026-03-02T12:00:00Z") == "2026-03-03T21:00:00+00:00"
    assert next_run(cell, 1, "2026-03-29T12:00:00Z") == "2026-03-31T20:00:00+00:00"
    assert next_run(cell, 2, "2026-03-02T12:00:00Z") == ""
    (tmp_path / "cell.night.toml").write_text("[[")
    assert next_run(cell, 1, "2026-03-02T12:00:00Z") == ""


def test_a_recording_without_an_estimate_has_no_empty_headings(bench: Bench) -> None:
    bench.shelve("first", 1)
    (bench.recordings / "first.estimate.json").unlink()
    text = bench.browser(Role.VIEWER).get("/results/first").text
    assert "There is a recording, but no estimate of it." in text
    sections = re.findall(r"<section.*?</section>", text, re.DOTALL)
    said = [re.sub(r"<h2.*?</h2>|<[^>]+>", "", section, flags=re.DOTALL) for section in sections]
    assert len(said) == 3  # verdict, what next, files
    assert all(words.strip() for words in said)


def test_pdf_and_mdf4_are_made_beside_the_page(bench: Bench) -> None:
    bench.shelve("first", 1, alarm=True)
    browser = bench.browser(Role.VIEWER)
    pdf = browser.get("/results/first/download/pdf")
    assert pdf.content.startswith(b"%PDF-")
    assert pdf.headers["content-type"] == "application/pdf"
    mdf = browser.get("/results/first/download/mdf4")
    assert mdf.content.startswith(b"MDF     4.10")
    (bench.recordings / "first.parquet").write_bytes(b"PAR1 cut short")
    assert browser.get("/results/first/download/pdf").status_code == 404
