"""No spring is named in recordings that others made, because none of them shows one."""

from __future__ import annotations

from pathlib import Path

import pytest

from agent.cli.identify.flexible_fit import flexible_of
from agent.record.reading import read

pytestmark = pytest.mark.real


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("emps/estimation", "no resonance is excited"),
        ("emps/validation-with-pulses", "no resonance is excited"),
        ("epos-screw-drives/drive1-steady", "too noisy"),
        ("epos-screw-drives/drive2-steady", "sampled at 39.1 Hz"),
        ("cycloidal-run-in/baseline", "sampled at 1 Hz"),
        ("ur3-production/joint1", "sampled at 0.995 Hz"),
        ("odrive-cogging/slow2-slower-nocomp-0", "no resonance is excited"),
    ],
)
def test_no_spring_is_named_where_none_shows(real_recordings: Path, name: str, says: str) -> None:
    found = flexible_of([read(real_recordings / f"{name}.parquet")], starts=3)
    assert not found.fit.decidable
    assert any(says in reason for reason in found.fit.reasons), found.fit.reasons
    assert not any(p.identified for p in found.fit.parameters.values())
