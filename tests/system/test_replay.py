"""A recording played as an axis: the cycle above it, from preflight to estimate, runs on data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from agent.acquisition import Acquisition
from agent.cell.cell import Cell, parse_cell, read_cell
from agent.cli.cycle.run import run_axis
from agent.conclude.outcome import conclude
from agent.cycle.ending import CycleResult
from agent.cycle.stage import Stage
from agent.errors import InputError, RefusedError, StoppedError
from agent.record.reading import read
from agent.record.recording import Recording
from agent.record.writing import write
from agent.replayed import Replayed
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import SteppedClock
from drivers.errors import RecordingEndedError
from tests.system.rig import rig


@dataclass(frozen=True)
class Driven:
    """A short cycle on the fake drive: its recording, and the description of its cell."""

    recording: Path
    cell: dict[str, Any]


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Driven:
    folder = tmp_path_factory.mktemp("driven")
    seen: list[dict[str, Any]] = []
    with rig(folder, edit=seen.append) as made:
        return Driven(made.run().recording, seen[0])


def replaying(
    driven: Driven, recording: Path, edit: Callable[[dict[str, Any]], None] = lambda _cell: None
) -> Cell:
    """Return the cell with `recording` in place of its drive."""
    description = {
        **driven.cell,
        "bus": {"interface": "replay", "channel": str(recording), "options": {"real_time": False}},
    }
    edit(description)
    return parse_cell(tomli_w.dumps(description))


def play(cell: Cell, folder: Path, *, stop_at_s: float = np.inf) -> CycleResult:
    clock = SteppedClock()
    return drive_cycle(
        CycleRequest(cell, cell.axis[0], folder),
        clock,
        stop_requested=lambda: "the test asks for it" if clock.now() >= stop_at_s else None,
    )


def changed(driven: Driven, path: Path, change: Callable[[Recording], Recording]) -> Path:
    """Return another file: the recording, changed."""
    write(change(read(driven.recording)), path)
    return path


@pytest.fixture(scope="module")
def replayed(driven: Driven, tmp_path_factory: pytest.TempPathFactory) -> CycleResult:
    return play(replaying(driven, driven.recording), tmp_path_factory.mktemp("replayed"))


def test_a_cycle_played_again_records_the_same_and_estimates_the_same(
    driven: Driven, replayed: CycleResult
) -> None:
    source, again = read(driven.recording), read(replayed.recording)
    # A replay is off at once where the drive took a tick or two, so its last rows are missing.
    left = source["phase"][len(again) :]
    assert set(left) <= {Stage.DISABLE.value}
    for name, values in source.columns.items():
        if values.dtype.kind == "f":
            assert again[name] == pytest.approx(values[: len(again)], abs=1e-9), name
        else:
            assert (again[name] == values[: len(again)]).all(), name
    assert (replayed.account.lost, replayed.account.reader) == (0, "replay")
    estimates = [conclude([recording]).estimate.to_json() for recording in (source, again)]
    assert estimates[0]["decidable"] is True
    curves = [estimate["friction_curve"]["friction_nm"] for estimate in estimates]
    assert curves[0] == pytest.approx(curves[1])


def test_a_replay_says_that_it_is_one(driven: Driven, replayed: CycleResult) -> None:
    again = read(replayed.recording)
    said = Replayed.from_metadata(again.metadata.extra, "here")
    assert said is not None
    assert said.source == driven.recording.name
    assert (said.different, said.first_difference_s) == (0, None)
    assert said.compared == len(again) - 1  # the last one takes torque away
    assert "No joint moved" in said.sentence
    assert isinstance(again.metadata.drive, dict)
    assert again.metadata.drive["name"] == "replay"


def test_what_is_doubtful_in_a_recording_is_doubtful_where_it_is_played_again(
    driven: Driven, tmp_path: Path
) -> None:
    spans = ((1.0, 1.1), (2.5, 2.5))

    def booked(recording: Recording) -> Recording:
        account = recording.metadata.extra["acquisition"]
        worse = {**account, "doubtful": 27, "doubtful_s": spans, "undecided": 1}
        return recording.with_metadata(recording.metadata.updated({"acquisition": worse}))

    source = changed(driven, tmp_path / "doubtful.parquet", booked)
    made = play(replaying(driven, source), tmp_path / "again")
    again = Acquisition.from_metadata(read(made.recording).metadata.extra, "here")
    assert again is not None
    assert (again.doubtful, again.undecided) == (27, 1)
    assert np.allclose(again.doubtful_s or (), spans, atol=1e-9)


def test_another_trajectory_is_stopped_by_the_gate_and_said(driven: Driven, tmp_path: Path) -> None:
    def faster(cell: dict[str, Any]) -> None:
        (axis,) = cell["axis"]
        cell["axis"] = [{**axis, "stair": {**axis["stair"], "motor_velocity_min_rad_s": 6.0}}]

    with pytest.raises(StoppedError, match="from its set-point") as caught:
        play(replaying(driven, driven.recording, faster), tmp_path)
    assert any("is kept in" in note for note in caught.value.__notes__)
    (kept,) = tmp_path.glob("*.parquet")
    said = Replayed.from_metadata(read(kept).metadata.extra, "here")
    assert said is not None
    assert said.different > 0
    assert said.largest_difference_rad_s > 1.0
    assert "answers the recorded ones" in said.sentence


def test_a_recording_that_ends_in_motion_is_told(driven: Driven, tmp_path: Path) -> None:
    def cut(recording: Recording) -> Recording:
        moving = np.flatnonzero(recording["phase"] == "steady")
        kept = moving[moving.size // 2]
        return Recording({n: c[:kept] for n, c in recording.columns.items()}, recording.metadata)

    short = changed(driven, tmp_path / "short.parquet", cut)
    with pytest.raises(RecordingEndedError, match="still to move") as caught:
        play(replaying(driven, short), tmp_path / "out")
    assert "NOT seen to come to rest" in "".join(caught.value.__notes__)


def test_a_stopped_recording_shows_its_standstill_when_it_is_stopped_there(
    driven: Driven, tmp_path: Path
) -> None:
    with rig(tmp_path / "driven") as made:

        def stop(_stage: str, share: float) -> None:
            made.stop_reason = "the test asks for it" if share > 0.5 else None

        with pytest.raises(StoppedError):
            made.run(progress=stop)
    (stopped,) = (tmp_path / "driven").glob("*.parquet")
    source = read(stopped)
    commands = source["velocity_command_rad_s"]
    braked_s = source["time_s"][np.flatnonzero(commands)[-1]]
    observed_s = 0.2
    with pytest.raises(StoppedError) as caught:
        play(
            replaying(driven, stopped), tmp_path / "again", stop_at_s=observed_s + braked_s + 0.004
        )
    assert "The joint is at rest (measured)." in caught.value.__notes__
    (kept,) = (tmp_path / "again").glob("*.parquet")
    again = read(kept)
    assert again["torque_nm"] == pytest.approx(source["torque_nm"][: len(again)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r.select(n for n in r.columns if n != "velocity_rad_s"), "has no velocity"),
        (lambda r: r.with_metadata(r.metadata.updated({"axis": 2})), "axis 2, gear ratio"),
        (
            lambda r: r.with_metadata(r.metadata.updated({"drive": {"mode": "pp"}})),
            "profile position",
        ),
    ],
)
def test_what_cannot_be_played_as_this_axis_is_refused(
    driven: Driven, tmp_path: Path, change: Callable[[Recording], Recording], words: str
) -> None:
    other = changed(driven, tmp_path / "other.parquet", change)
    with pytest.raises(InputError, match=words):
        play(replaying(driven, other), tmp_path / "out")


def test_no_device_of_the_cell_is_reached(driven: Driven, tmp_path: Path) -> None:
    def with_devices(cell: dict[str, Any]) -> None:
        (axis,) = cell["axis"]
        drive = {k: v for k, v in axis["drive"].items() if k != "gearbox_temperature"}
        probe = {"kind": "adam", "port": "/dev/no-such-port"}
        cell["axis"] = [{**axis, "drive": drive, "temperature": probe}]
        cell["release"] = {"kind": "modbus", "tcp": "127.0.0.1:9"}

    again = read(play(replaying(driven, driven.recording, with_devices), tmp_path).recording)
    assert set(again["gearbox_temperature_quality"]) == {"good"}  # as recorded


def test_a_temperature_that_was_recorded_as_bad_refuses_as_it_did(
    driven: Driven, tmp_path: Path
) -> None:
    def without(recording: Recording) -> Recording:
        return recording.with_columns({"gearbox_temperature_degc": np.full(len(recording), np.nan)})

    blind = changed(driven, tmp_path / "blind.parquet", without)
    with pytest.raises(RefusedError, match="gearbox temperature is not known"):
        play(replaying(driven, blind), tmp_path / "out")


def test_the_command_plays_a_recording_that_the_cell_names(
    driven: Driven,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def enough(recordings: list[Recording]) -> None:
        raise InputError(f"{len(recordings[0])} samples")

    monkeypatch.setattr("agent.cli.cycle.run.conclude", enough)  # then it is as after any cycle
    (tmp_path / "source.parquet").write_bytes(driven.recording.read_bytes())
    bus = {"interface": "replay", "channel": "source.parquet", "options": {"real_time": False}}
    path = tmp_path / "cell.toml"
    path.write_text(tomli_w.dumps({**driven.cell, "bus": bus}))
    with pytest.raises(InputError, match=r"3\d\d\d samples"):
        run_axis(path, 1, tmp_path / "out", reverse=False, as_json=False)
    assert "source.parquet was played" in " ".join(capsys.readouterr().err.split())


def test_a_replay_beside_a_controllers_job_is_refused(driven: Driven) -> None:
    def with_job(cell: dict[str, Any]) -> None:
        (axis,) = cell["axis"]
        other = {k: v for k, v in axis.items() if k != "drive"} | {"number": 2}
        other["job"] = {"kind": "modbus", "tcp": "127.0.0.1:9"}
        cell["axis"] = [axis, other]

    with pytest.raises(InputError, match=r"axis 2 has \[axis.job\]"):
        replaying(driven, driven.recording, with_job)


def test_a_misspelt_option_of_a_replay_is_refused(driven: Driven, tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    bus = {"interface": "replay", "channel": "a.parquet", "options": {"realtime": False}}
    path.write_text(tomli_w.dumps({**driven.cell, "bus": bus}))
    with pytest.raises(InputError, match="real_time"):
        read_cell(path)
