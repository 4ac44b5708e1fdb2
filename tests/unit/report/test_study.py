"""`stribeck study`: one offline page and its numbers, from recordings."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from agent.cli.identify.study import finding, pulls_apart, run_study, study_of, to_json
from agent.conclude.outcome import conclude
from agent.errors import InputError
from agent.identify.rigid.thresholding import AXIS_WITHOUT_GRAVITY, AccelerationSweep
from agent.record.reading import read
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from agent.report.figures.study import (
    correlation_in_words,
    course_in_words,
    figure_correlation,
    figure_speed_study,
    figure_threshold_sweep,
    speed_study_in_words,
    threshold_sweep_in_words,
)
from agent.report.study import StudyPage, study_html
from tests.science.identify_plant import Joint, Motion, record, stair

STAIR = stair((4.0, 12.0, 32.0, 70.0), rate_hz=125.0, longest_s=2.0)


def save(folder: Path, motion: Motion = STAIR, name: str = "stair", seed: int = 0) -> Path:
    signals = record(Joint(), motion, seed=seed)
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    columns = {
        "time_s": signals.time_s,
        "position_rad": signals.position_rad,
        "velocity_rad_s": signals.velocity_rad_s,
        "torque_nm": signals.torque_nm,
        "velocity_command_rad_s": motion.velocity_rad_s,
    }
    metadata = Metadata(
        robot="<b>cell</b>",
        axis=3,
        gear_ratio=224.0,
        started_at="2026-03-01T02:03:04Z",
        trajectory={"name": "stair"},
    )
    path = folder / f"{name}.parquet"
    write(Recording(columns, metadata, str(path)), path)
    return path


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> StudyPage:
    folder = tmp_path_factory.mktemp("study")
    paths = [save(folder, name=f"run{k}", seed=k) for k in range(3)]
    return study_of(conclude([read(path) for path in paths]))


def labels(figure: Figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes]


@pytest.mark.parametrize("narrow", [False, True])
def test_every_panel_is_titled(page: StudyPage, narrow: bool) -> None:
    assert page.correlation is not None
    assert page.speeds is not None
    for figure in (
        figure_threshold_sweep(page.sweep, narrow=narrow),
        figure_speed_study(page.speeds, narrow=narrow),
    ):
        assert labels(figure)[0].startswith("Inertia")
        assert labels(figure)[-1] == "Condition number (4.11)"
        assert all(axes.get_ylabel() for axes in figure.axes[:-1])
    assert len(figure_correlation(page.correlation, narrow=narrow).axes) == 2


def test_words_carry_the_pictures_numbers(page: StudyPage) -> None:
    assert page.correlation is not None
    assert page.speeds is not None
    first = f"{page.sweep.condition_number[0]:.3g}"
    assert first in threshold_sweep_in_words(page.sweep)
    assert first in page.sentence
    assert "3 runs" in speed_study_in_words(page.speeds)
    share = f"{100 * page.correlation.cross_outside:.0f} %"
    assert share in correlation_in_words(page.correlation)


def test_the_page_is_offline_escaped_and_the_same_every_time(page: StudyPage) -> None:
    html = study_html(page, robot="<b>cell</b>", axis=3)
    assert html == study_html(page, robot="<b>cell</b>", axis=3)
    assert "<b>cell</b>" not in html
    assert "http" not in html.replace("http-equiv", "")
    assert "<script" not in html
    assert html.count("<img") == 4
    assert page.course is not None
    assert course_in_words(page.course) in html
    assert "Instrumental variables" in html
    assert all(finding in html for finding in page.findings)


def test_the_command_writes_both_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "study"
    run_study([str(save(tmp_path))], out, as_json=True)
    document = json.loads(capsys.readouterr().out)
    assert document == json.loads((out / "study.json").read_text(encoding="utf-8"))
    assert document["schema"] == "stribeck.study/1"
    assert document["speeds"] is None
    sweep = document["threshold_sweep"]
    assert sweep["parameters"]["inertia_kg_m2"]["value"][0] == pytest.approx(0.0184, rel=0.02)
    assert len(sweep["condition_number"]) == len(sweep["threshold_rad_s2"])
    assert document["instrumental"]["strength"] > 0.9
    run_study([str(tmp_path / "stair.parquet")], out, as_json=False)
    assert str(out / "study.html") in capsys.readouterr().out


def test_the_document_holds_no_infinities(page: StudyPage, tmp_path: Path) -> None:
    conclusion = conclude([read(save(tmp_path))])
    text = json.dumps(to_json(page, conclusion), allow_nan=False)
    assert np.isfinite(json.loads(text)["cutoff_hz"])


def test_what_carries_no_regression_is_refused_with_the_reason(tmp_path: Path) -> None:
    path = save(tmp_path, stair((4.0, 12.0, 32.0), rate_hz=125.0, directions=(1,)))
    with pytest.raises(InputError, match="one direction only"):
        run_study([str(path)], tmp_path / "out", as_json=False)
    assert not (tmp_path / "out").exists()


def swept(inertia_deviation: list[float]) -> AccelerationSweep:
    """Return three steps, of which the last mixes inertia and friction up least."""
    deviation = np.column_stack((inertia_deviation, [0.1] * 3, [0.1] * 3))
    return AccelerationSweep(
        AXIS_WITHOUT_GRAVITY,
        np.array([400.0, 40.0, 4.0]),
        np.ones((3, 3)),
        deviation,
        np.array([168.0, 80.0, 48.0]),
        np.array([900, 800, 700]),
    )


def test_a_trade_off_is_told_from_both_sides_and_not_approved(page: StudyPage) -> None:
    torn = swept([0.002, 0.01, 0.06])
    said = finding(torn)
    assert "without accelerations above 4 rad/s², the last step of this scan" in said
    assert "condition number 48; with every sample 168" in said
    assert "known to 6 % only; it is known best, to 0.2 %, with every sample" in said
    html = study_html(replace(page, sentence=said, trade_off=pulls_apart(torn)))
    assert "A trade-off" in html
    assert "verdict decided" not in html
    agreed = swept([0.02, 0.01, 0.01])
    assert not pulls_apart(agreed)
    assert "as well there as anywhere" in finding(agreed)
