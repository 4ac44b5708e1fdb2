"""The units with which systemd runs a cell's nights: a timer at each window's start, a service."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agent.errors import InputError
from agent.night.description import DAYS, NightDescription

_NAMES = dict(zip(DAYS, ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"), strict=True))


@dataclass(frozen=True)
class Units:
    """Two files for systemd.

    Parameters
    ----------
    name : str
        Both have it, with their suffixes.
    service, timer : str
        What they hold.
    """

    name: str
    service: str
    timer: str

    def files(self, folder: Path) -> dict[Path, str]:
        """Return what goes where."""
        return {
            folder / f"{self.name}.service": self.service,
            folder / f"{self.name}.timer": self.timer,
        }


def units(
    robot: str, description: NightDescription, cell: Path, night_file: Path, program: Path
) -> Units:
    """Return the units of a cell's nights.

    Parameters
    ----------
    robot : str
        Stands in their name.
    description : NightDescription
        Whose windows begin when the timer elapses, in its own time zone.
    cell, night_file, program : pathlib.Path
        CELL.toml, the night's file and `stribeck`.

    Raises
    ------
    agent.errors.InputError
        A path that a unit cannot hold.
    """
    for path in (cell, night_file, program):
        if any(c in str(path) for c in "\n\r\"'\\%$"):
            raise InputError(f"{path}: a unit of systemd cannot hold a path with such letters.")
    calendars = [
        f"OnCalendar={_days(axis.days)} *-*-* {axis.begins:%H:%M}:00 {description.time_zone}"
        for axis in description.axis
    ]
    timer = f"""[Unit]
Description=Nightly friction cycles of {robot}

[Timer]
{chr(10).join(dict.fromkeys(calendars))}
AccuracySec=1s
# what was missed is said by the next night, and never caught up
Persistent=false

[Install]
WantedBy=timers.target
"""
    service = f"""[Unit]
Description=Friction cycles of {robot}: tonight's windows
Wants=network-online.target
After=network-online.target time-sync.target

[Service]
Type=oneshot
WorkingDirectory={cell.parent}
ExecStart="{program}" night run "{cell}" --night "{night_file}" --once
# SIGTERM to the night alone: it asks its cycle to stop, and waits until the joint is at rest
KillMode=mixed
TimeoutStopSec=150
TimeoutStartSec=infinity
Restart=no
# secrets of the notifications: VARIABLE=value, a line each, readable for root alone
EnvironmentFile=-/etc/stribeck/{robot}.env
# no PrivateTmp: the axis's lock must be the one that every other program sees
NoNewPrivileges=true
# with a User= of your own too: the cycle runs before other programs
LimitRTPRIO=20
"""
    return Units(f"stribeck-night-{robot}", service, timer)


def _days(days: tuple[str, ...]) -> str:
    return ",".join(_NAMES[day] for day in DAYS if day in days)
