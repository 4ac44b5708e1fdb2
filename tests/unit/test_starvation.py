"""A test in real time gets another chance where the machine stood still, and only there."""

from __future__ import annotations

import pytest

SUITE = """
    import time
    from pathlib import Path
    import pytest
    RUNS = Path(__file__).with_name("runs")

    @pytest.mark.real_time
    def test_it():
        RUNS.write_text(RUNS.read_text() + "x" if RUNS.exists() else "x")
        if {stalls}:  # one long step of C code holds the interpreter, as a starved machine would
            sum(range(20_000_000))
        assert len(RUNS.read_text()) > {fails}
"""


@pytest.mark.parametrize(
    ("stalls", "fails", "runs", "passes"),
    [(True, 1, 2, True), (True, 9, 3, False), (False, 1, 1, False), (True, 0, 1, True)],
)
def test_only_a_failure_beside_a_standstill_is_run_again(
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    stalls: bool,
    fails: int,
    runs: int,
    passes: bool,
) -> None:
    if not stalls:  # whatever this machine does meanwhile
        monkeypatch.setattr("tests.starvation.STANDSTILL_S", 1e9)
    pytester.makeconftest("from tests.starvation import pytest_runtest_protocol")
    pytester.makeini("[pytest]\nmarkers = real_time")
    pytester.makepyfile(SUITE.format(stalls=stalls, fails=fails))
    done = pytester.runpytest_inprocess("-p", "no:xdist", "-p", "no:cacheprovider")
    assert len((pytester.path / "runs").read_text()) == runs
    done.assert_outcomes(passed=int(passes), failed=int(not passes))
