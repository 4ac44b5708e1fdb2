"""One cycle from the closed bus back to the closed bus, on real frames in simulated time."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.acquisition import Acquisition
from agent.cli.cycle.recover import run_recover
from agent.conclude.outcome import conclude
from agent.errors import RefusedError, StoppedError
from agent.given_back import said_in
from agent.record.reading import read
from drivers.cia402.axis import Cia402Axis
from drivers.errors import DriverError
from drivers.ports import SyncAccount
from fakes import faults, live_values
from fakes.fault import Fault
from fakes.specification import FakeSpecification
from tests.system.rig import RATE_HZ, Rig, rig

REST_RAD_S = 0.5
IN_THE_STAIR_S = 3.4


def brisk(cell: dict[str, Any]) -> None:
    """Make the stair as short as what happens in the middle of it needs."""
    cell["axis"][0]["stair"] |= {"duration_s": 3.2, "speeds": 2}


def registers(bench: Rig) -> dict[tuple[int, int], int]:
    """Return every number in the drive's dictionary that the agent may have changed."""
    watched = [(0x1016, 1), (0x1017, 0), (0x6007, 0), (0x605A, 0), (0x6060, 0), (0x6083, 0)]
    watched += [(0x6084, 0), (0x6085, 0), (0x607D, 1), (0x607D, 2)]
    watched += [(i, s) for i in (0x1400, 0x1800, 0x1801) for s in (1, 2)]
    number = bench.drive.dictionary.number
    for mapping in (0x1600, 0x1A00, 0x1A01):  # entries beyond the count mean nothing
        watched += [(mapping, s) for s in range(number(mapping, 0) + 1)]
    return {key: number(*key) for key in watched}


def test_a_cycle_records_every_sample_and_leaves_the_drive_as_it_was(tmp_path: Path) -> None:
    with rig(tmp_path) as bench:
        bench.later(0.1)
        found = registers(bench)
        result = bench.run()
        assert registers(bench) == found
        assert abs(bench.drive.motor_velocity_rad_s) < REST_RAD_S
    assert result.account.lost == 0
    assert result.account.received == result.account.expected
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".json", ".parquet"]  # and its units
    recording = read(result.recording)
    assert recording.metadata.samples_lost == 0
    phases = recording.columns["phase"].tolist()
    order = list(dict.fromkeys(phases))
    assert order[:2] == ["enable", "approach"]
    assert order[-2:] == ["return", "disable"]
    assert {"ramp", "steady", "rest"} <= set(order)
    time_s = recording.columns["time_s"]
    assert np.allclose(np.diff(time_s), 1.0 / RATE_HZ)
    steady = recording.columns["phase"] == "steady"
    error = recording.columns["velocity_rad_s"] - recording.columns["velocity_command_rad_s"]
    assert np.median(np.abs(error[steady])) < 0.5
    assert np.isfinite(recording.columns["gearbox_temperature_degc"]).all()
    watchdog = recording.metadata.extra["watchdog"]
    assert watchdog["proven"]
    assert watchdog["timeout_s"] <= watchdog["reaction_s"] < watchdog["timeout_s"] + 0.02
    assert watchdog["emergencies"] == ["0x8130"]


def test_a_drive_that_never_says_that_it_obeys_the_bus_is_driven(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Bit 9 is an answer to "no longer" alone: drives that leave it out have nothing to say.
    monkeypatch.setattr(live_values, "REMOTE", 0)
    with rig(tmp_path, edit=brisk) as bench:
        assert bench.run().account.lost == 0


def test_the_same_seed_gives_the_same_recording(tmp_path: Path) -> None:
    columns = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        with rig(tmp_path / name, edit=brisk, seed=7) as bench:
            columns.append(read(bench.run().recording).columns)
    for name, values in columns[0].items():
        assert np.array_equal(values, columns[1][name]), name


@pytest.mark.parametrize(
    ("fault", "error", "says"),
    [
        (faults.DriveFault(at_s=IN_THE_STAIR_S), DriverError, "0x4210"),
        (faults.HeartbeatStops(at_s=IN_THE_STAIR_S), DriverError, "heartbeat"),
        (faults.Unplugged(at_s=IN_THE_STAIR_S), DriverError, "SYNC"),
        (faults.PowerCut(at_s=IN_THE_STAIR_S), DriverError, "SYNC"),
        (faults.SwallowSync(at_s=IN_THE_STAIR_S, count=10), DriverError, "SYNC"),
        (faults.VelocityRunaway(at_s=IN_THE_STAIR_S), StoppedError, "measured torque"),
        (faults.FrozenPosition(at_s=IN_THE_STAIR_S), StoppedError, "measured position"),
        (faults.TemperatureSentinel(at_s=IN_THE_STAIR_S), StoppedError, "temperature"),
    ],
    ids=lambda x: x.kind if isinstance(x, Fault) else "",
)
def test_a_fault_in_motion_stops_the_joint_and_keeps_the_recording(
    fault: Fault, error: type[Exception], says: str, tmp_path: Path
) -> None:
    with rig(tmp_path, faults=[fault], edit=brisk) as bench:
        with pytest.raises(error, match=says) as caught:
            bench.run()
        bench.later(1.0)
        assert abs(bench.drive.motor_velocity_rad_s) < REST_RAD_S, "the joint still moves"
    notes = " ".join(caught.value.__notes__)
    files = list(tmp_path.glob("*.parquet"))
    assert len(files) == 1
    assert str(files[0]) in notes
    kept = read(files[0])
    assert kept.columns["time_s"][-1] > 0.9 * (IN_THE_STAIR_S - 1.0)
    assert says in str(kept.metadata.extra["stopped_because"])
    assert list(tmp_path.glob("*.arrows")) == []


def test_lost_answers_and_moments_in_which_nobody_asked_are_told_apart_and_stop_nothing(
    tmp_path: Path,
) -> None:
    stalls: list[float] = []

    def stand_still(_stage: str, share: float) -> None:
        if len(stalls) < 3 and share > 0.6 + 0.1 * len(stalls):
            stalls.append(share)
            bench.later(0.03)

    with rig(tmp_path, faults=[faults.SwallowSync(at_s=IN_THE_STAIR_S, count=2)]) as bench:
        result = bench.run(progress=stand_still)
    assert len(stalls) == 3
    kept = read(result.recording)
    assert kept.metadata.samples_lost == result.account.lost == 2
    account = Acquisition.from_metadata(kept.metadata.extra, "it")
    assert account is not None
    assert (account.lost, account.lost_unexplained) == (2, 2)
    assert account.expected == account.received + 2
    assert 0.029 < account.longest_gap_s < 0.045
    missing = np.round(np.diff(kept["time_s"]) * RATE_HZ) - 1
    assert account.not_asked == np.sum(missing) - 2 > 3 * 5
    quality = conclude([kept]).estimate.quality
    assert quality.acquisition == account


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        (faults.PowerCut(), "node"),
        (faults.WrongIdentity(), "0x1018|identity|product"),
        (faults.MapNotKept(index=0x1A00), "0x1A00"),
        (faults.SdoAborts(index=0x6007, code=0x06020000), "0x6007"),
        (faults.DriveFault(at_s=0.0), "fault"),
    ],
    ids=lambda x: x.kind if isinstance(x, Fault) else "",
)
def test_a_drive_that_is_not_as_it_should_be_is_never_enabled(
    fault: Fault, says: str, tmp_path: Path
) -> None:
    with rig(tmp_path, faults=[fault]) as bench:
        with pytest.raises(DriverError, match=says):
            bench.run()
        assert bench.drive.motor_velocity_rad_s == 0.0
    assert list(tmp_path.iterdir()) == []


def test_the_operator_stops_the_cycle(tmp_path: Path) -> None:
    with rig(tmp_path, edit=brisk) as bench:
        found = registers(bench)

        def press_stop(_stage: str, share: float) -> None:
            if share > 0.5:
                bench.stop_reason = "the operator asked for it"

        with pytest.raises(StoppedError, match="the operator asked for it") as caught:
            bench.run(progress=press_stop)
        assert abs(bench.drive.motor_velocity_rad_s) < REST_RAD_S
        assert registers(bench) == found
    assert "The joint is at rest (measured)." in caught.value.__notes__


def extra(recording: Path) -> dict[str, Any]:
    return dict(read(recording).metadata.extra)


def test_what_a_killed_run_left_is_given_back_by_the_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The journal of a killed run says how the drive had been found; the next run restores it.

    So do `recover`, which reaches no drive, and the recording and the error of that next run.
    """
    with rig(tmp_path, edit=brisk) as bench:
        bench.later(0.1)
        found = registers(bench)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Cia402Axis, "close", lambda _axis: SyncAccount())  # as after kill -9
            patch.setattr(Path, "unlink", lambda *_args, **_kwargs: None)
            bench.run()
        assert registers(bench) != found
        run_recover([tmp_path])  # finishes recordings, and reaches no drive
        said = " ".join(capsys.readouterr().err.split())
        assert "axis1.found.json is there: a run has not given its drive back" in said
        bench.later(1.0)

        def press_stop(stage: str, _share: float) -> None:
            if stage == "approach":
                bench.stop_reason = "the operator asked for it"

        with pytest.raises(StoppedError) as caught:
            bench.run(progress=press_stop)
        assert registers(bench) == found
    (recording,) = (p for p in tmp_path.glob("*.parquet") if "stopped_because" in extra(p))
    sentence = said_in(extra(recording))
    assert sentence.startswith("A run before this one was ended before it gave the drive back")
    assert sentence in caught.value.__notes__
    assert not (tmp_path / ".simulated-joint-axis1.found.json").exists()


def _uncommissioned(cell: dict[str, Any]) -> None:
    cell["axis"][0]["commissioned"] = False


def _narrow(cell: dict[str, Any]) -> None:
    cell["axis"][0]["limits"] |= {"arm_position_min_deg": -5.0, "arm_position_max_deg": 5.0}


def _cold(cell: dict[str, Any]) -> None:
    cell["axis"][0]["limits"]["gearbox_temperature_min_degc"] = 40.0


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (_uncommissioned, "is not commissioned"),
        (_narrow, "position would reach"),
        (_cold, "gearbox temperature of 25.0 degC is outside"),
    ],
)
def test_what_preflight_refuses_does_not_move(edit: Any, says: str, tmp_path: Path) -> None:
    with rig(tmp_path, edit=edit) as bench:
        with pytest.raises(RefusedError, match=says):
            bench.run()
        assert bench.drive.motor_velocity_rad_s == 0.0
    assert [p for p in tmp_path.iterdir() if not p.name.endswith(".units.json")] == []


def test_a_joint_outside_its_window_is_refused(tmp_path: Path) -> None:
    outside = FakeSpecification.from_mapping({"joint": {"initial_arm_position_rad": 2.0}})
    with rig(tmp_path, specification=outside) as bench:
        with pytest.raises(RefusedError, match="outside its window"):
            bench.run()
        assert bench.drive.motor_velocity_rad_s == 0.0


def test_a_full_disk_stops_the_joint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Disk full in the middle of the stair, with the kernel's own ENOSPC (/dev/full)."""
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("needs /dev/full")
    from agent.record.streams.stream import StreamWriter

    sink = os.open(full, os.O_WRONLY)  # the writer closes it
    with rig(tmp_path, edit=brisk) as bench:
        flush = StreamWriter.flush

        def flush_to_a_full_disk(writer: StreamWriter) -> None:
            if writer.samples > 2.0 * RATE_HZ:
                writer._file._descriptor = sink
            flush(writer)

        monkeypatch.setattr(StreamWriter, "flush", flush_to_a_full_disk)
        with pytest.raises(Exception, match="the disk is full") as caught:
            bench.run()
        bench.later(0.5)
        assert abs(bench.drive.motor_velocity_rad_s) < REST_RAD_S
    assert "The joint is at rest (measured)." in caught.value.__notes__
