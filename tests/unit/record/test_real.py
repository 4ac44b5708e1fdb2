"""Other people's recordings are read as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from agent.record.reading import read_all
from agent.record.recording import FLOAT_COLUMNS
from agent.record.writing import write

pytestmark = pytest.mark.real


@pytest.mark.parametrize(
    ("folder", "files", "has_position"),
    [
        ("cycloidal-run-in", 1, False),
        ("emps", 2, True),
        ("epos-screw-drives", 4, False),
        ("odrive-cogging", 8, True),
        ("ur3-production", 2, False),
    ],
)
def test_a_real_folder_is_read_and_survives_a_round_trip(
    real_recordings: Path, tmp_path: Path, folder: str, files: int, has_position: bool
) -> None:
    found = read_all([real_recordings / folder])
    assert len(found) == files
    for made in found:
        assert ("position_rad" in made) is has_position
        assert made.gear_ratio == 1.0
        assert "licence" in made.metadata.extra or "source" in made.metadata.extra
        for suffix in ("parquet", "csv"):
            (again,) = read_all([write(made, tmp_path / f"{Path(made.source).stem}.{suffix}")])
            assert again.metadata == made.metadata
            assert list(again.columns) == list(made.columns)
            assert again.masked == made.masked
            for name in made.columns:
                equal_nan = name in FLOAT_COLUMNS
                assert np.array_equal(again[name], made[name], equal_nan=equal_nan), name


def test_gaps_of_the_production_log_are_masked_not_dropped(real_recordings: Path) -> None:
    first, second = read_all([real_recordings / "ur3-production"])
    assert (len(first), first.masked) == (2869, 10)
    assert (len(second), second.masked) == (2869, 10)
