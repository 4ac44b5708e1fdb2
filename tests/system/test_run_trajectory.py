"""`stribeck run --trajectory`: a file or a name, driven over the bus in simulated time."""

from __future__ import annotations

import json
import secrets
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from agent.cell.cell import read_cell
from agent.cli.app import app
from agent.cli.cycle.run import asked_for
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.plan import triangle_of
from agent.errors import InputError
from agent.record.reading import read
from drivers.clock import SteppedClock
from fakes.can_drive import FakeDrive
from fakes.process import open_bus
from fakes.specification import FakeSpecification


@pytest.fixture
def cell_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield the cell of a simulated drive that is on its bus; commands run in simulated time."""
    channel = f"run-{secrets.token_hex(4)}"
    path = tmp_path / "cell.toml"
    text = fake_cell_text(FakeSpecification(), interface="virtual", channel=channel, short=True)
    slow = text.replace("sample_rate_hz = 500.0", "sample_rate_hz = 250.0")
    path.write_text(slow, encoding="utf-8")
    bus, clock = open_bus("virtual", channel), SteppedClock()
    drive = FakeDrive(bus, node_id=1, specification=FakeSpecification())
    clock.attach(drive.step_to)
    monkeypatch.setattr("agent.cli.cycle.run.clock_for", lambda _cell: clock)
    yield path
    bus.shutdown()


def test_a_trajectory_is_driven_by_its_name(cell_file: Path) -> None:
    arguments = ["run", str(cell_file), "--axis", "1", "--trajectory", "triangle", "--json"]
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.stderr
    (path,) = (cell_file.parent / "recordings").glob("*.parquet")
    recording = read(path)
    wave = triangle_of(read_cell(cell_file).axis_numbered(1))
    assert recording.metadata.trajectory is not None
    assert recording.metadata.trajectory["name"] == "triangle"
    fastest = float(str(wave.parameters["peak_velocity_rad_s"]))
    driven = recording["velocity_command_rad_s"][recording.columns["phase"] == "ramp"]
    assert driven.max() == pytest.approx(fastest, rel=0.01)
    assert driven.min() == pytest.approx(-fastest, rel=0.01)
    assert json.loads(result.stdout)["schema"] == "stribeck.estimate/1"


def test_a_dry_run_says_what_a_name_would_drive(cell_file: Path) -> None:
    arguments = ["run", str(cell_file), "--axis", "1", "--trajectory", "triangle", "--dry-run"]
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert "triangle" in result.stdout
    assert not (cell_file.parent / "recordings").exists()


def test_a_file_of_that_name_goes_before_the_name(
    cell_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    axis = read_cell(cell_file).axis_numbered(1)
    monkeypatch.chdir(cell_file.parent)
    named = asked_for(axis, Path("triangle"))
    assert named is not None
    other = named.reversed()
    Path("triangle").write_text(json.dumps(other.to_json()), encoding="utf-8")
    assert asked_for(axis, Path("triangle")) == other != named


def test_what_is_neither_a_file_nor_a_name_is_refused(cell_file: Path) -> None:
    axis = read_cell(cell_file).axis_numbered(1)
    assert asked_for(axis, None) is None
    with pytest.raises(InputError, match=r"no such file.*a name: triangle"):
        asked_for(axis, cell_file.parent / "rectangle")
