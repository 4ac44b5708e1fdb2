"""Quiet windows on the wall's clock, through every change of the clock."""

from __future__ import annotations

import datetime
import os
import re
import shutil
import subprocess
import zoneinfo
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.night.description import AxisNight, NightDescription
from agent.night.units import units
from agent.night.windows import window_of, windows_between
from tests.night.simulated import BERLIN, utc

ZONE = zoneinfo.ZoneInfo(BERLIN)
ZONES = [BERLIN, "America/New_York", "Australia/Lord_Howe", "Pacific/Apia", "UTC"]


def axis(window: str, **more: object) -> AxisNight:
    return AxisNight.model_validate({"number": 1, "window": window, **more})


@pytest.mark.parametrize(
    ("night", "window", "begins", "ends"),
    [
        ("2026-06-01", "22:00-05:00", "2026-06-01T20:00", "2026-06-02T03:00"),
        ("2026-12-31", "22:00-05:00", "2026-12-31T21:00", "2027-01-01T04:00"),
        ("2026-02-28", "23:30-00:30", "2026-02-28T22:30", "2026-02-28T23:30"),
        # the clock goes from 2:00 to 3:00: an hour is missing inside the window
        ("2026-03-28", "22:00-05:00", "2026-03-28T21:00", "2026-03-29T03:00"),
        # ... 2:30 does not exist: begin later, end earlier
        ("2026-03-29", "02:30-05:00", "2026-03-29T01:30", "2026-03-29T03:00"),
        ("2026-03-28", "22:00-02:30", "2026-03-28T21:00", "2026-03-29T00:30"),
        # the clock goes from 3:00 to 2:00: 2:30 occurs twice: begin at the second, end at the first
        ("2026-10-24", "22:00-05:00", "2026-10-24T20:00", "2026-10-25T04:00"),
        ("2026-10-25", "02:30-05:00", "2026-10-25T01:30", "2026-10-25T04:00"),
        ("2026-10-24", "22:00-02:30", "2026-10-24T20:00", "2026-10-25T00:30"),
    ],
)
def test_a_window_in_berlin(night: str, window: str, begins: str, ends: str) -> None:
    found = window_of(axis(window), datetime.date.fromisoformat(night), ZONE)
    assert (found.begins, found.ends) == (utc(begins), utc(ends))


@given(
    zone=st.sampled_from(ZONES),
    night=st.dates(datetime.date(2020, 1, 1), datetime.date(2030, 12, 31)),
    begin=st.integers(0, 24 * 60 - 1),
    length=st.integers(1, 16 * 60),
    probe=st.floats(0.0, 0.9999),
)
def test_every_moment_of_a_window_is_quiet_on_the_wall(
    zone: str, night: datetime.date, begin: int, length: int, probe: float
) -> None:
    end = (begin + length) % (24 * 60)
    text = f"{begin // 60:02}:{begin % 60:02}-{end // 60:02}:{end % 60:02}"
    found = window_of(axis(text), night, zoneinfo.ZoneInfo(zone))
    if found.ends <= found.begins:
        return  # the change of the clock has left nothing of it
    moment = found.begins + probe * (found.ends - found.begins)
    local = moment.astimezone(zoneinfo.ZoneInfo(zone))
    minute = local.hour * 60 + local.minute + local.second / 60 + local.microsecond / 6e7
    assert (minute - begin) % (24 * 60) < length or length - 1e-6 < (minute - begin) % (24 * 60)
    assert found.ends - found.begins <= datetime.timedelta(minutes=length + 60)


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze here")
@pytest.mark.parametrize("since", ["2026-03-26T12:00", "2026-10-22T12:00"])
def test_systemd_s_timer_elapses_when_a_window_begins_also_when_the_clock_is_changed(
    since: str,
) -> None:
    """As systemd itself computes it; whether a unit then starts is systemd's own affair."""
    described = axis("01:15-05:00", days=["mon", "thu", "sat", "sun"])
    night = NightDescription.model_validate(
        {"schema": "stribeck.night/1", "time_zone": BERLIN, "axis": [described.model_dump()]}
    )
    timer = units("r", night, Path("/c.toml"), Path("/n.toml"), Path("/s")).timer
    (calendar,) = re.findall(r"^OnCalendar=(.+)$", timer, re.MULTILINE)
    base = f"{since.replace('T', ' ')}:00 UTC"
    said = subprocess.run(
        ["systemd-analyze", "calendar", "--iterations=8", f"--base-time={base}", calendar],
        capture_output=True,
        text=True,
        check=True,
        env={"TZ": "UTC", "PATH": os.defpath},
    ).stdout
    elapses = re.findall(r"(?:elapse|#\d+): \w+ (\S+ \S+) UTC", said)
    until = utc(since) + datetime.timedelta(days=21)
    windows = list(windows_between(described, ZONE, utc(since), until))[:8]
    assert [utc(e) for e in elapses] == [w.begins for w in windows]


@given(
    zone=st.sampled_from(ZONES),
    start=st.datetimes(datetime.datetime(2024, 1, 1), datetime.datetime(2028, 1, 1)),
    days=st.sets(st.sampled_from(["mon", "wed", "sat", "sun"]), min_size=1),
)
def test_windows_come_in_order_one_a_night_on_the_days_that_were_named(
    zone: str, start: datetime.datetime, days: set[str]
) -> None:
    since = start.replace(tzinfo=datetime.UTC)
    until = since + datetime.timedelta(days=21)
    described = axis("21:30-03:00", days=sorted(days))
    found = list(windows_between(described, zoneinfo.ZoneInfo(zone), since, until))
    assert all(w.ends > since and w.begins < until for w in found)
    assert [w.begins for w in found] == sorted({w.begins for w in found})
    assert {f"{w.night:%a}".lower() for w in found} <= days
    assert len(found) >= 3 * len(days) - 1
