"""The ground under the cycle on a real bus: the runner, and what the bus itself can do."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.bus.vcan import HostVcan, Vcan
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.bus


def test_exchange_at_500_hz_loses_nothing(vcan: Vcan) -> None:
    command = [sys.executable, "-m", "tests.bus.exchange", "--channel", vcan.channel]
    result = vcan.run([*command, "--rate", "500", "--seconds", "5"], 40.0, cwd=REPOSITORY)
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)

    assert found["sent"] == found["answered"] == found["seen_by_peer"] == 2500
    assert found["in_order"]
    # half of the answers within one period: seen 0.4 ms, so that a tick has time for its own work
    assert found["round_trip_median_s"] < 0.002, found
    assert found["stamp_period_mean_s"] == pytest.approx(0.002, rel=0.01)


def test_stamps_are_the_kernels(vcan: Vcan) -> None:
    command = [sys.executable, "-m", "tests.bus.exchange", "--channel", vcan.channel]
    result = vcan.run([*command, "--rate", "100", "--seconds", "0.5"], 40.0, cwd=REPOSITORY)
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)

    assert found["stamps_in_bracket"]
    assert 0.15 < found["stamp_age_s"] <= found["unread_for_s"] + 0.001


@pytest.fixture(params=["vcan", "host"])
def place(request: pytest.FixtureRequest) -> Vcan:
    """Return each place that a command may run in; both must be alike to the caller."""
    if request.param == "host":
        return HostVcan("unused")
    found: Vcan = request.getfixturevalue("vcan")
    return found


def test_runner_is_like_running_it_here(
    place: Vcan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STRIBECK_TEST_QUOTING", "two words, 'quoted' $HOME")
    script = 'pwd; echo "$STRIBECK_TEST_QUOTING" >file; echo talk >&2; cat; exit 7'

    result = place.run(["sh", "-c", script], 20.0, cwd=tmp_path)

    assert result.returncode == 7
    assert result.stdout == f"{tmp_path}\n"
    assert result.stderr == "talk\n"
    assert (tmp_path / "file").read_text() == "two words, 'quoted' $HOME\n"


def test_runner_ends_what_takes_too_long_and_keeps_its_output(place: Vcan, tmp_path: Path) -> None:
    endless = "echo begun; (while :; do date >>alive; sleep 0.1; done) & wait"

    with pytest.raises(subprocess.TimeoutExpired) as caught:
        place.run(["sh", "-c", endless], 1.5, cwd=tmp_path)

    assert caught.value.output == "begun\n"
    written = (tmp_path / "alive").stat().st_size
    subprocess.run(["sleep", "0.5"], check=True)
    assert (tmp_path / "alive").stat().st_size == written, "the grandchild is still running"
