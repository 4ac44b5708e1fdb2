"""Everything that is shown on a real CAN bus, in one file: the bus is made, or booted, once.

The runner; what the bus itself can do; axis contract, reader process and faults, as one pytest that
runs where the bus is; and the product: a short stair at 500 Hz, every SYNC answered.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from agent.record.reading import read
from fakes.specification import FakeSpecification
from tests.bus.vcan import CHANNEL_VARIABLE, HostVcan, Vcan
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.bus

RATE_HZ = 500.0
NOISE_LEAVES = (10.8 / 5) ** 0.5 / 1.96
"""Noise alone leaves a law of four numbers so far from five means, as a share of their half width.

An rms; chi-squared of the one degree of freedom left is beyond 10.8 once in a thousand cycles.
"""


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

    result = place.run(["sh", "-c", script], 120.0, cwd=tmp_path)

    assert result.returncode == 7
    assert result.stdout == f"{tmp_path}\n"
    assert result.stderr == "talk\n"
    assert (tmp_path / "file").read_text() == "two words, 'quoted' $HOME\n"


@pytest.mark.parametrize("endlessly", [True, False])
def test_runner_leaves_nothing_running_and_keeps_the_output(
    place: Vcan, tmp_path: Path, endlessly: bool
) -> None:
    orphan = "echo begun; (while :; do date >>alive; sleep 0.1; done) >/dev/null 2>&1 & sleep 0.5"

    if endlessly:
        for patience_s in (1.5, 10.0, 60.0):  # a busy machine may not have begun by then
            with pytest.raises(subprocess.TimeoutExpired) as caught:
                place.run(["sh", "-c", f"{orphan}; wait"], patience_s, cwd=tmp_path)
            if caught.value.output:
                break
        assert caught.value.output == "begun\n"
    else:
        assert place.run(["sh", "-c", orphan], 120.0, cwd=tmp_path).stdout == "begun\n"

    written = (tmp_path / "alive").stat().st_size
    subprocess.run(["sleep", "0.5"], check=True)
    assert (tmp_path / "alive").stat().st_size == written, "the grandchild is still running"


def test_sync_and_answer_at_500_hz_lose_nothing_and_carry_the_kernels_stamps(vcan: Vcan) -> None:
    command = [sys.executable, "-m", "tests.bus.exchange", "--channel", vcan.channel]
    result = vcan.run([*command, "--rate", "500", "--seconds", "2"], 300.0, cwd=REPOSITORY)
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)

    assert found["sent"] == found["answered"] == found["seen_by_peer"] == 1000
    assert found["in_order"]
    # half of the answers within one period: seen 0.4 ms, so that a tick has time for its own work
    assert found["round_trip_median_s"] < 0.002, found
    assert found["stamp_period_mean_s"] == pytest.approx(0.002, rel=0.01)
    assert found["stamps_in_bracket"]
    assert 0.15 < found["stamp_age_s"] <= found["unread_for_s"] + 0.001


GUESTS = {
    "tests.contract": 30,
    "tests.bus.reader_on_vcan": 7,
    "tests.bus.faults_on_vcan": 22,
}
"""What one pytest runs where the bus is, and how many tests that must be at least."""


@pytest.fixture(scope="module")
def guests(vcan: Vcan, tmp_path_factory: pytest.TempPathFactory) -> ElementTree.Element:
    """Return what became of the tests that need AF_CAN in their own process, as JUnit has it."""
    report = tmp_path_factory.mktemp("guests") / "report.xml"
    # without every plugin that is installed: each takes time to import behind slow system calls
    command = ["env", f"{CHANNEL_VARIABLE}={vcan.channel}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD=1"]
    command += [sys.executable, "-m", "pytest", "-q", "-p", "xdist.plugin", "-n0"]
    # drivers.can first: it keeps from python-can what would take seconds to import
    command += ["-p", "drivers.can", "-p", "no:cacheprovider", f"--junit-xml={report}"]
    command += ["-k", "socketcan or on_vcan", "tests/contract"]
    command += ["tests/bus/reader_on_vcan.py", "tests/bus/faults_on_vcan.py"]
    done = vcan.run(command, timeout_s=1200.0, cwd=REPOSITORY)
    assert report.is_file(), done.stdout[-4000:] + done.stderr[-1000:]
    return ElementTree.parse(report).getroot()


@pytest.mark.parametrize("module", GUESTS)
def test_what_needs_af_can_holds_on_vcan(module: str, guests: ElementTree.Element) -> None:
    cases = [c for c in guests.iter("testcase") if c.get("classname", "").startswith(module)]
    assert len(cases) >= GUESTS[module]
    # every child of a case but its output says that it did not simply pass
    assert not [
        f"{case.get('name')}: {said.text}"
        for case in cases
        for said in case
        if said.tag in ("failure", "error", "skipped")
    ]


@pytest.mark.real_time
def cycled(vcan: Vcan, tmp_path: Path) -> tuple[subprocess.CompletedProcess[str], Path]:
    """Run a cycle, and again where the guest was held up: what came late is not told apart then.

    The recording says so, and no estimate is made of it, as is right; it is not what is asked here.
    """
    for attempt in range(3):
        out = tmp_path / f"cycle-{attempt}"
        out.mkdir()
        command = [sys.executable, "-m", "tests.bus.cycle", "--channel", vcan.channel]
        done = vcan.run([*command, "--out", str(out)], 600.0, cwd=REPOSITORY)
        assert done.returncode == 0, done.stderr
        reasons = json.loads(done.stdout)["reasons"]
        if not any("may stand in another's place in time" in reason for reason in reasons):
            break
    return done, out


def test_a_cycle_on_vcan_loses_nothing_and_finds_the_friction(vcan: Vcan, tmp_path: Path) -> None:
    done, out = cycled(vcan, tmp_path)
    (path,) = out.glob("*.parquet")
    recording = read(path)
    account = recording.metadata.extra["acquisition"]
    assert (account["reader"], account["stamps"]) == ("process", "kernel")
    assert account["received"] + account["lost"] == account["expected"] > 0.95 * 12.0 * RATE_HZ
    assert account["dropped_by_kernel"] == 0
    # A guest that is held up sends SYNCs by twos; of one that is called lost the answer has come.
    nobodys = account["duplicates"] + account["unmatched"] + account["undecided"]
    assert recording.metadata.samples_lost == account["lost"] <= nobodys
    steps = np.diff(recording.columns["time_s"])
    # A guest's clock is coarse: ticks that come late are made up for by those after them.
    missing = (account["not_asked"] + account["lost"]) / account["expected"]
    assert np.mean(steps) == pytest.approx(1.0 / RATE_HZ, rel=0.01 + missing)
    assert np.median(steps) == pytest.approx(1.0 / RATE_HZ, rel=0.1)
    assert recording.columns["time_s"].size > 0.95 * 12.0 * RATE_HZ

    estimate = json.loads(done.stdout)
    assert estimate["decidable"], estimate["reasons"]
    assert estimate["quality"]["samples_lost"] == account["lost"]
    temperature = recording.columns["gearbox_temperature_degc"]
    truth = FakeSpecification().joint.friction.truth(float(np.median(temperature)))
    # The joint's law and the other one that falls are tied on five speeds, with five and four
    # numbers, and noise leaves either no further from the means than `NOISE_LEAVES`. Between them
    # and the straight line the data decide where the line misses by more than the means may be
    # off; beside other programs the ticks come irregularly, and a mean may be off by more.
    laws = {model["model"]: model for model in estimate["friction_models"]}
    half_width_nm = np.ptp(np.array(estimate["friction_curve"]["ci95_nm"]), axis=1) / 2.0
    for falling in ("stribeck", "feeny-moon"):
        # by their rms: where the guest was held up one mean may be off by more than the others
        assert laws[falling]["rmse_nm"] < NOISE_LEAVES * np.sqrt(np.mean(half_width_nm**2))
        viscous = laws[falling]["parameters"]["viscous_nm_s_per_rad"]["value"]
        assert viscous == pytest.approx(truth.viscous_nm_s_per_rad, rel=0.05)
    if laws["coulomb-viscous"]["rmse_nm"] > half_width_nm.max():
        assert not laws["coulomb-viscous"]["selected"]
    curve = estimate["friction_curve"]
    speed = np.array(curve["velocity_rad_s"])
    extra = np.exp(-((speed / truth.stribeck_velocity_rad_s) ** truth.exponent))
    expected = truth.coulomb_nm + truth.viscous_nm_s_per_rad * speed + truth.static_extra_nm * extra
    assert speed.size == 5
    np.testing.assert_allclose(curve["friction_nm"], expected, rtol=0.02)
