"""`study` with a run of its own: the reversed stair is judged in place of the fit's recordings."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from agent.cli.identify.study import run_study, study_of
from agent.conclude.outcome import conclude
from agent.record.reading import read
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from agent.report.study import study_html
from tests.science.identify_plant import Joint, record, stair

SPEEDS = (4.0, 12.0, 32.0, 70.0)
RIGHT = Joint()
SOFT = Joint(static_extra_nm=0.4, stribeck_velocity_rad_s=20.0)


def save(folder: Path, name: str, joint: Joint, *, backwards: bool, seed: int = 0) -> str:
    order = SPEEDS[::-1] if backwards else SPEEDS
    ways = (-1, 1) if backwards else (1, -1)
    motion = stair(order, rate_hz=250.0, ramp_s=0.252, longest_s=2.0, directions=ways)
    signals = record(joint, motion, seed=seed, memory=0.0)
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    columns = {
        "time_s": signals.time_s,
        "position_rad": signals.position_rad,
        "velocity_rad_s": signals.velocity_rad_s,
        "torque_nm": signals.torque_nm,
    }
    metadata = Metadata("cell", 1, 224.0, "2026-03-01T02:03:04Z", {"name": "stair"})
    path = folder / f"{name}.parquet"
    write(Recording(columns, metadata, str(path)), path)
    return str(path)


def test_the_unseen_run_is_judged_not_the_fit(tmp_path: Path) -> None:
    stairs = save(tmp_path, "stair", RIGHT, backwards=False)
    good = save(tmp_path, "reversed", RIGHT, backwards=True, seed=1)
    worn = save(tmp_path, "worn", SOFT, backwards=True, seed=2)
    own = study_of(conclude([read(stairs)]))
    honest, changed = (study_of(conclude([read(stairs)], read(run))) for run in (good, worn))
    assert own.validation is None
    assert own.judged_on == "stair.parquet"
    assert honest.judged_on == "reversed.parquet"
    assert honest.validation is not None
    assert changed.validation is not None
    assert honest.validation.fit_percent > 97.0
    assert changed.validation.fit_percent < honest.validation.fit_percent - 3.0
    assert honest.correlation is not None
    assert changed.correlation is not None
    assert changed.correlation.auto_outside > honest.correlation.auto_outside + 0.3
    assert honest.correlation.cross_outside < 0.1
    assert any("velocity alone" in finding for finding in changed.findings)
    assert not any("velocity alone" in finding for finding in honest.findings)


def test_page_text_and_document_say_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stairs = save(tmp_path, "stair", RIGHT, backwards=False)
    unseen = save(tmp_path, "reversed", RIGHT, backwards=True, seed=1)
    run_study([stairs], tmp_path / "out", as_json=True, validation=unseen)
    document = json.loads(capsys.readouterr().out)
    fit = document["validation"]["fit_percent"]
    assert document["residual"]["judged_on"] == "reversed.parquet"
    assert len(document["residual"]["auto"]) == len(document["residual"]["auto_band"])
    assert len(document["residual"]["cross"]) == len(document["residual"]["cross_band"])
    run_study([stairs], tmp_path / "out", as_json=False, validation=unseen)
    said = capsys.readouterr().out
    assert f"{fit:.1f} % fit" in said
    assert "which the fit has not seen" in said
    html = (tmp_path / "out" / "study.html").read_text(encoding="utf-8")
    assert f"{fit:.1f} % fit" in html
    assert "The residual on reversed.parquet" in html
    without = study_html(study_of(conclude([read(stairs)])))
    assert "has not seen" not in without
