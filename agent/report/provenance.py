"""What the estimate stands on: quality of the data, the recordings, where they come from."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Quality
from agent.numbers import fixed, scale_for, significant
from agent.report.views import RecordingView
from trajectories import lasting

_LONGEST_TEXT = 320
_LEAST_JITTER_S = 1e-7  # below, it is rounding

# In this order on the page; what is not here follows by its own name.
_METADATA_LABELS = {
    "started_at": "Started (UTC)",
    "drive": "Drive",
    "trajectory": "Trajectory",
    "gear_ratio": "Gear ratio (motor turns per arm turn)",
    "payload_kg": "Payload, kg",
    "ambient_degc": "Ambient temperature, °C",
    "notes": "Notes",
    "software": "Software",
}
# Said elsewhere on the page, or of use to a program only.
_METADATA_UNSHOWN = frozenset({"schema", "robot", "axis", "samples_lost", "acquisition"})


@dataclass(frozen=True)
class RecordingRow:
    """One recording in the table of recordings."""

    name: str
    role: str
    started_at: str
    duration: str
    samples: str
    windows: str
    temperature: str


def quality_rows(quality: Quality) -> tuple[tuple[str, str], ...]:
    """Return what the estimate stands on, as label and text."""
    scale = scale_for("s", [quality.jitter_s])
    jitter = f"{significant(quality.jitter_s * scale.factor, 2)} {scale.unit}"
    if quality.jitter_s < _LEAST_JITTER_S:
        jitter = "none"
    asked = quality.samples + quality.samples_lost
    rows = [
        ("Samples", f"{quality.samples:,}".replace(",", "\u202f")),
        ("Samples lost", _share(quality.samples_lost, asked)),
        ("Samples masked", _share(quality.masked, quality.samples)),
        *_frame_rows(quality),
        ("Sample rate", f"{significant(quality.sample_rate_hz)} Hz"),
        ("Jitter", jitter),
    ]
    if quality.temperature_degc is None:
        rows.append(("Gearbox temperature", "not recorded"))
    else:
        low, high = quality.temperature_degc
        rows.append(("Gearbox temperature", _range_degc(low, high)))
    return tuple(rows)


def _frame_rows(quality: Quality) -> list[tuple[str, str]]:
    """Return what the recorder's account says beyond the lost samples, where there is one."""
    account = quality.acquisition
    if account is None:
        return []
    dropped = account.dropped_by_kernel
    scale = scale_for("s", [account.jitter_s])
    return [
        ("Samples asked for", f"{account.expected:,}".replace(",", "\u202f")),
        ("Not asked for in time", _share(account.not_asked, account.expected)),
        ("Answers late", _share(account.late, account.expected)),
        ("Answers twice", _share(account.duplicates, account.expected)),
        ("Frames dropped by the computer", "not known" if dropped is None else str(dropped)),
        ("Answers' jitter", f"{significant(account.jitter_s * scale.factor, 2)} {scale.unit}"),
    ]


def recording_rows(views: Sequence[RecordingView]) -> tuple[RecordingRow, ...]:
    """Return the recordings with what each of them contributes."""
    rows = []
    for view in views:
        signals = view.signals
        lasted_s = float(np.nanmax(signals.time_s) - np.nanmin(signals.time_s))
        temperature = signals.gearbox_temperature_degc
        warm = "not recorded"
        if temperature is not None and np.isfinite(temperature).any():
            warm = _range_degc(float(np.nanmin(temperature)), float(np.nanmax(temperature)))
        rows.append(
            RecordingRow(
                name=signals.name,
                role="validation" if view.validation else "estimate",
                started_at=_moment(view.started_at),
                duration=lasting(lasted_s),
                samples=f"{signals.time_s.size:,}".replace(",", "\u202f"),
                windows=str(len(view.windows)),
                temperature=warm,
            )
        )
    return tuple(rows)


def metadata_rows(metadata: Mapping[str, object]) -> tuple[tuple[str, str], ...]:
    """Return a recording's metadata as label and text, known keys first, none dropped."""
    known = [key for key in _METADATA_LABELS if key in metadata]
    others = sorted(set(metadata) - set(known) - _METADATA_UNSHOWN)
    rows = []
    for key in (*known, *others):
        text = _moment(in_words(metadata[key]))
        if text:
            rows.append((_METADATA_LABELS.get(key, key.replace("_", " ").capitalize()), text))
    return tuple(rows)


def in_words(value: object) -> str:
    """Write nested metadata on one line, cut where it becomes a listing."""
    if value is None:
        return ""
    if isinstance(value, Mapping):
        text = _mapping_in_words(value)
    elif isinstance(value, (list, tuple)):
        text = ", ".join(in_words(inner) for inner in value)
    elif isinstance(value, bool):
        text = "yes" if value else "no"
    elif isinstance(value, float):
        text = f"{value:.10g}"
    else:
        text = str(value)
    return text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 1].rstrip() + "…"


def _mapping_in_words(mapping: Mapping[str, object]) -> str:
    """Write ``{"name": "stair", "parameters": {"steps": 20}}`` as ``stair (steps 20)``."""
    parts = [
        in_words(inner)
        if key == "parameters"
        else f"{str(key).replace('_', ' ')} {in_words(inner)}"
        for key, inner in mapping.items()
        if key != "name"
    ]
    rest = ", ".join(part for part in parts if part)
    name = in_words(mapping.get("name"))
    return f"{name} ({rest})" if name and rest else name or rest


def _moment(iso: str) -> str:
    """Write an ISO 8601 stamp as ``2026-03-01 02:03:04``; what is not one stays as it is."""
    return re.sub(r"^(\d{4}-\d\d-\d\d)T(\d\d:\d\d:\d\d)(\.\d+)?Z$", r"\1 \2", iso)


def _range_degc(low: float, high: float) -> str:
    return f"{fixed(low, 1)} to {fixed(high, 1)} °C"


def _share(count: int, of: int) -> str:
    if count == 0:
        return "0"
    share = f" ({significant(100.0 * count / of, 2)} %)" if of else ""
    return f"{count:,}".replace(",", "\u202f") + share
