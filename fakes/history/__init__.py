"""Months of one simulated joint, a stair cycle a night, by seed: own physics, no bus, no file."""

from fakes.history.climate import Climate
from fakes.history.cycle import CycleRun
from fakes.history.events import OilChange, Swap, Wear
from fakes.history.history import HistoryPlan, Worker, cycles, nightly_stair, ordinary_runs

__all__ = [
    "Climate",
    "CycleRun",
    "HistoryPlan",
    "OilChange",
    "Swap",
    "Wear",
    "Worker",
    "cycles",
    "nightly_stair",
    "ordinary_runs",
]
