"""What ends a cycle while the joint moves, each in one line, and how long it takes to rest.

``python -m tests.safety.aborting`` prints the table of docs/safety.md.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.errors import StoppedError
from drivers.errors import DriverError
from fakes import faults
from fakes.fault import Fault
from fakes.specification import FakeSpecification
from tests.system.rig import Rig, rig

TRIGGER_RAD_S = 50.0
REST_RAD_S = 0.5
FAR_FROM_THE_START = FakeSpecification.from_mapping({"joint": {"initial_arm_position_rad": 0.8}})
"""So that the joint is fast soon: on its way to the start."""


@dataclass(frozen=True)
class Abort:
    """One abort condition: how it is brought about in motion, and what the error says."""

    name: str
    act: Callable[[Rig], None]
    says: str
    edit: Callable[[dict[str, Any]], None] = lambda _cell: None
    noticed_s: float = 0.17  # the stated reaction time: by us, or by the drive's watchdog
    coasts: bool = False  # the drive has no torque left to brake with; the fake has no brake


@dataclass(frozen=True)
class Aborted:
    """What came of it: time from the cause to rest, the error with its notes, what was kept."""

    rest_s: float
    error: BaseException
    recordings: int
    speed_rad_s: float


def broken(fault: Fault) -> Callable[[Rig], None]:
    return lambda bench: bench.drive._breakage.begin(fault)


def _hot(bench: Rig) -> None:
    bench.drive.plant.gearbox.temperature_degc = bench.drive.plant.gearbox.sensor_degc = 90.0


def _stop(bench: Rig) -> None:
    bench.stop_reason = "the permit is gone: the cell is stopped"


def _little_torque(cell: dict[str, Any]) -> None:
    """Allow less torque than the ramp needs, and give the dry run no model to foresee it."""
    cell["axis"][0]["limits"]["motor_torque_max_nm"] = 4.0
    del cell["axis"][0]["expected"]


ABORTS = (
    Abort("torque above its limit", lambda _bench: None, "measured torque", _little_torque),
    Abort("gearbox too hot", _hot, "gearbox temperature of .* outside"),
    Abort("temperature lost", broken(faults.TemperatureSentinel()), "temperature is not known"),
    Abort("position stands still", broken(faults.FrozenPosition()), "measured position"),
    Abort("joint runs away", broken(faults.VelocityRunaway()), "measured (velocity|torque)"),
    Abort("samples lost", broken(faults.SwallowSync(count=500)), "SYNCs in a row unanswered"),
    Abort(
        "emergency message only",
        lambda bench: bench.drive.emergency.report(0x2310, 0x03),
        "0x2310",
    ),
    Abort("fault of the drive", broken(faults.DriveFault()), "0x4210"),
    Abort(
        "statusword left 'enabled'",
        lambda bench: bench.drive.machine.disable_voltage(),
        "left operation enabled by itself|the drive is not enabled",
        coasts=True,
    ),
    Abort("drive's heartbeat stops", broken(faults.HeartbeatStops()), "heartbeat", noticed_s=0.35),
    Abort("bus cable out", broken(faults.Unplugged()), "SYNC"),
    Abort("drive loses its supply", broken(faults.PowerCut()), "SYNC", coasts=True),
    Abort("permit gone, or Stop test", _stop, "the permit is gone"),
)


def abort(condition: Abort, folder: Path) -> Aborted:
    """Bring a condition about while the joint is fast, and watch it come to rest."""
    fired_s: list[float] = []
    moving_s: list[float] = []
    with rig(folder, edit=condition.edit, specification=FAR_FROM_THE_START) as bench:

        def trigger(_stage: str, _share: float) -> None:
            if not fired_s and abs(bench.drive.motor_velocity_rad_s) > TRIGGER_RAD_S:
                fired_s.append(bench.clock.now())
                condition.act(bench)

        def watch(now_s: float) -> None:
            if abs(bench.drive.motor_velocity_rad_s) > REST_RAD_S:
                moving_s.append(now_s)

        bench.clock.attach(watch)
        try:
            bench.run(progress=trigger)
        except (StoppedError, DriverError) as stopped:
            error: BaseException = stopped
        else:
            raise AssertionError(f"nothing stopped the cycle: {condition.name}")
        bench.later(1.0)
        speed_rad_s = abs(bench.drive.motor_velocity_rad_s)
    began_s = fired_s[0] if fired_s else moving_s[0]
    return Aborted(moving_s[-1] - began_s, error, len(list(folder.glob("*.parquet"))), speed_rad_s)


def main() -> None:
    """Print the time to rest of every abort condition."""
    for condition in ABORTS:
        with tempfile.TemporaryDirectory() as folder:
            came = abort(condition, Path(folder))
        sys.stdout.write(f"| {condition.name} | {came.rest_s:.2f} s |\n")


if __name__ == "__main__":
    main()
