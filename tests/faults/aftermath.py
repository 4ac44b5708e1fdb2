"""What must hold after every run, whatever the fault; the plant is the judge."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from agent.acquisition import Acquisition
from agent.errors import AgentError
from agent.record.streams.recover import recover
from agent.wire.drive import bus_config, drive_config
from drivers.can.owner import CanBusOwner
from drivers.cia402.handing_back import restore
from drivers.errors import DriverError
from fakes.fault_wire import Wire
from tests.system.rig import Rig

REST_RAD_S = 0.5

WATCHED = (
    *((0x1016, 1), (0x1017, 0), (0x6007, 0), (0x605A, 0), (0x6060, 0), (0x6083, 0), (0x6084, 0)),
    *((0x6085, 0), (0x607D, 1), (0x607D, 2)),
    *((index, sub) for index in (0x1400, 0x1800, 0x1801) for sub in (1, 2)),
)


@dataclass
class Watch:
    """What the plant really did, sampled whenever time moves."""

    times_s: list[float] = field(default_factory=list)
    positions_rad: list[float] = field(default_factory=list)
    step_s: float = 0.0  # of the plant's integration
    origin_s: float = math.nan  # when the recording's time begins
    decided_s: float = 0.0  # when the agent began to stop
    moved_s: float = -math.inf
    moves: bool = False
    rows_s: list[float] = field(default_factory=list)  # when each row was handed over

    def look(self, now_s: float, position_rad: float, velocity_rad_s: float) -> None:
        if not self.times_s or now_s > self.times_s[-1]:
            self.times_s.append(now_s)
            self.positions_rad.append(position_rad)
        self.moves = abs(velocity_rad_s) > REST_RAD_S
        if self.moves:
            self.moved_s = now_s


def registers(bench: Rig) -> dict[tuple[int, int], int]:
    """Return every number in the drive that the agent may have changed."""
    number = bench.drive.dictionary.number
    watched = list(WATCHED)
    for mapping in (0x1600, 0x1A00, 0x1A01):  # entries beyond the count mean nothing
        watched += [(mapping, sub) for sub in range(number(mapping, 0) + 1)]
    return {key: number(*key) for key in watched}


def said_troubles(error: AgentError | DriverError | None) -> list[str]:
    """Return what the message lacks: what became of the joint, and what to do."""
    if error is None:
        return []
    text = " ".join([str(error), *getattr(error, "__notes__", [])])
    fates = ("is at rest (measured)", "use the E-stop", "nothing has moved", "ran to its end")
    found = [] if any(fate in text for fate in fates) else ["nothing said of the joint's fate"]
    return found if error.do or "ran to its end" in text else [*found, "nothing said of what to do"]


def settings_troubles(
    bench: Rig, wire: Wire, found: dict[tuple[int, int], int], folder: Path, *, heals: bool
) -> list[str]:
    """Return what is wrong with the drive's settings: restored, or in a journal that restores."""
    journal = next(folder.glob(".*.found.json"), None)
    if registers(bench) == found:
        return []
    if journal is None:
        return ["the drive's settings are not as found, and no journal was left"]
    if not heals:
        return []
    wire.heal()
    bench.later(0.2)
    cell, axis = bench.cell, bench.cell.axis[0]
    owner = CanBusOwner.open(bus_config(cell.bus), bench.clock)
    try:
        restore(owner, drive_config(cell, axis), bench.clock, json.loads(journal.read_text()))
    except DriverError as error:
        return [f"the journal does not restore: {error}"]
    finally:
        owner.close()
    return [] if registers(bench) == found else ["the journal does not restore everything"]


def recording_troubles(folder: Path) -> list[str]:
    """Finish what the run could not, as `stribeck recover` does, and say what cannot be read."""
    return [
        result.sentence
        for result in recover(folder)
        if result.outcome not in ("recovered", "finished before")
    ]


def kept_of(folder: Path, watch: Watch) -> tuple[int, int | None, float, int]:
    """Return rows that can be read, samples lost, the farthest position from the truth, doubts.

    Rows of which the recording itself says when they are doubtful are no position of that time;
    what else is doubtful, all rows may be.
    """
    paths = list(folder.glob("*.parquet"))
    if not paths:
        return 0, None, 0.0, 0
    table = pq.read_table(paths[0])  # `read` wants 100 samples; a cycle may end before
    metadata = json.loads(table.schema.metadata[b"stribeck"])
    position = table["position_rad"].to_numpy()
    # The drive reads its encoder at the beginning of an integration step.
    taken_s = table["time_s"].to_numpy() + watch.origin_s - watch.step_s
    truth = np.interp(taken_s, watch.times_s, watch.positions_rad)
    account = Acquisition.from_metadata(metadata, str(paths[0]))
    if account is None:
        return len(position), metadata.get("samples_lost"), _farthest(position - truth), 0
    sure = ~account.doubts(table["time_s"].to_numpy())
    misplaced_rad = _farthest((position - truth)[sure])
    return len(position), metadata["samples_lost"], misplaced_rad, len(account.changed)


def _farthest(off_rad: NDArray[np.float64]) -> float:
    return float(np.abs(off_rad).max(initial=0.0))
