"""Recordings for the recorder's tests: small, deterministic, with every contract column in use."""

from __future__ import annotations

from typing import Any

import numpy as np

from agent.record.recording import Metadata, Recording

STREAM_COLUMNS = ("time_s", "position_rad", "velocity_rad_s", "torque_nm", "phase")


def metadata(**changes: Any) -> Metadata:
    """Return complete metadata of an imaginary joint."""
    values: dict[str, Any] = {
        "robot": "cell7-irb6650",
        "axis": 1,
        "gear_ratio": 224.0,
        "started_at": "2026-03-01T02:03:04.567Z",
        "trajectory": {"name": "stair", "velocities_rad_s": [1.0, -1.0]},
    }
    return Metadata(**{**values, **changes})


def recording(samples: int = 200, **extra_columns: Any) -> Recording:
    """Return a recording of `samples` rows at 1 kHz."""
    time_s = np.arange(samples) / 1000.0
    columns = {
        "time_s": time_s,
        "position_rad": np.sin(time_s),
        "velocity_rad_s": np.cos(time_s),
        "torque_nm": 0.6 * np.sign(np.cos(time_s)) + 0.01 * np.cos(time_s),
        "phase": np.where(time_s < 0.1, "ramp", "steady"),
    }
    return Recording({**columns, **extra_columns}, metadata(), "made for a test")


def row(index: int, rate_hz: float = 1000.0) -> tuple[Any, ...]:
    """Return the stream's row of this number, different in every column."""
    return (
        index / rate_hz,
        0.25 * index,
        -3.0 + index,
        0.125 * index,
        "ramp" if index % 2 else "steady",
    )
