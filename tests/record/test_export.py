"""What other programs get: MDF 4 read back by asammdf, CSV read back by ourselves."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from agent.cli.app import app
from agent.errors import InputError, StorageError
from agent.record.export import export, unit_of
from agent.record.reading import read
from agent.record.recording import Recording
from agent.record.writing import write
from tests.unit.record.samples import metadata, recording


def full() -> Recording:
    count = 200
    gaps = np.where(np.arange(count) % 7 == 0, np.nan, 31.5)
    return recording(
        count,
        gearbox_temperature_degc=gaps,
        counter=np.arange(count, dtype=np.int32),
        brake=np.arange(count) % 2 == 0,
        note=np.array(["größer", None] * (count // 2), dtype=object),
    ).with_metadata(metadata(notes="für Prüfung", payload_kg=2.0))


def test_mdf4_holds_every_channel_with_unit_comment_and_the_metadata(tmp_path: Path) -> None:
    from asammdf import MDF

    said = full()
    path = export(said, tmp_path / "run.mf4", "mdf4")
    with MDF(path) as mdf:
        assert mdf.version == "4.10"
        comment = ElementTree.fromstring(mdf.header.comment).findtext("TX")
        assert json.loads(comment or "") == said.metadata.to_json()
        assert mdf.start_time.isoformat().startswith("2026-03-01T02:03:04.567")
        for name in said.columns:
            if name == "time_s":
                continue
            channel = mdf.get(name)
            np.testing.assert_array_equal(channel.timestamps, said["time_s"])
            assert channel.unit == unit_of(name)
            if name in ("phase", "note"):
                expected = [item or "" for item in said[name].tolist()]
                assert [item.decode() for item in channel.samples] == expected
            else:
                np.testing.assert_array_equal(
                    channel.samples, said[name].astype(channel.samples.dtype)
                )
        assert mdf.get("torque_nm").unit == "N m"
        assert mdf.get("velocity_rad_s").comment == "motor velocity in rad/s"
        assert mdf.get("gearbox_temperature_degc").unit == "°C"


def test_csv_comes_back_as_it_went(tmp_path: Path) -> None:
    said = full()
    back = read(export(said, tmp_path / "run.csv", "csv"))
    assert back.metadata.to_json() == said.metadata.to_json()
    for name in ("time_s", "torque_nm", "gearbox_temperature_degc", "phase"):
        np.testing.assert_array_equal(back[name], said[name])


def test_nothing_is_replaced_dropped_or_misnamed(tmp_path: Path) -> None:
    said = full()
    with pytest.raises(InputError, match=r"must end in \.mf4"):
        export(said, tmp_path / "run.csv", "mdf4")
    export(said, tmp_path / "run.mf4", "mdf4")
    with pytest.raises(StorageError, match="exists already"):
        export(said, tmp_path / "run.mf4", "mdf4")
    time_s = said["time_s"].copy()
    time_s[5] = np.nan
    with pytest.raises(InputError, match="1 samples have no time"):
        export(said.with_columns({"time_s": time_s}), tmp_path / "gap.mf4", "mdf4")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.mf4"]


def test_the_command(tmp_path: Path) -> None:
    path = write(recording(), tmp_path / "run.parquet")
    run = CliRunner().invoke
    done = run(app, ["export", str(path), "--format", "mdf4"])
    assert done.stdout.strip() == str(tmp_path / "run.mf4")
    assert isinstance(run(app, ["export", str(path), "--format", "xlsx"]).exception, InputError)
