"""Every fault of the campaign, as data."""

from __future__ import annotations

from tests.faults.around_it import AROUND
from tests.faults.of_frames import FRAMES
from tests.faults.of_the_bus import BUS
from tests.faults.of_the_drive import DRIVE

SCENARIOS = (*FRAMES, *BUS, *DRIVE, *AROUND)
