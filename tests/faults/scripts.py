"""What fault scripts are made of. Node 1: TPDO 0x181, 0x281; RPDO 0x201; SDO 0x581, 0x601."""

from __future__ import annotations

from typing import Any

from tests.faults.scenario import Between

ANSWERS, ORDERS = (0x181, 0x281), (0x201,)
SYNC, EMCY, DRIVE_BEAT, OUR_BEAT = (0x080,), (0x081,), (0x701,), (0x77F,)
SDO_REQUEST, SDO_ANSWER = (0x601,), (0x581,)
LONG = Between(0.3, 2.0)
FEW = Between(0.001, 0.025)  # up to three SYNCs at 100 Hz
JUMPS = (-400_000, -100_000, 100_000, 400_000)  # counts; the limit is 81 557

FOREIGN_ORDERS = ("0f0000000000", "0f0000000600", "0f000000faff", "0f0100000600", "060000000000")
"""Controlword and velocity: 0, 38 and -38 rad/s, with halt, and no longer enabled."""

FOREIGN_SETTINGS = (
    *("2385600001000000", "2b5a600000000000"),  # quick stop: next to no ramp, none at all
    *("2b07600000000000", "2316100100000000"),  # no reaction to a lost heartbeat, no heartbeat
    *("2383600001000000", "237d600200ffffff"),  # next to no acceleration, another software limit
    *("239160010a000000", "2392600100000a00"),  # other units, a tenth and ten times as large
)
"""What a tool for setting up drives may write while the joint moves."""

OTHER_UNITS = ("239160010a000000", "2392600199190000", "2392600100000a00")
"""Gear ratio and feed constant: the drive's counts are ten times as long, or a tenth."""

OTHER_MAPPING = (
    ((0x000,), "8001"),  # PRE-OPERATIONAL, where alone it may be mapped
    ((0x601,), "2300180181010080"),  # TPDO1 invalid, no entry
    ((0x601,), "2f001a0000000000"),
    ((0x601,), "23001a0210007860"),  # 0x6078, current, where torque was: as long, as plausible
    ((0x601,), "2f001a0003000000"),
    ((0x601,), "2300180181010000"),
    ((0x000,), "0101"),
)
"""What maps TPDO1 anew, one frame a millisecond."""

SAY_SILENT = "SYNCs in a row unanswered|heartbeat|measured (velocity|position)"
"""At 100 Hz on a ramp the gate may find the last sample too far from the set-point first."""
SILENT = (4, 5)
SAY_FOLLOW = "measured (velocity|position)"


def lost(identifiers: tuple[int, ...], lasts_s: Any, towards: str = "both") -> tuple[Any, ...]:
    return ({"kind": "lost", "identifiers": identifiers, "lasts_s": lasts_s, "towards": towards},)


def injected(identifiers: tuple[int, ...], data: Any, **more: Any) -> tuple[Any, ...]:
    return ({"kind": "injected", "identifiers": identifiers, "data": data, **more},)


def falsified(identifier: int, offset: int, size: int, change: str, value: Any = 0) -> Any:
    return (
        {
            "kind": "falsified",
            "identifiers": (identifier,),
            "offset": offset,
            "size": size,
            "change": change,
            "value": value,
            "towards": "agent",
        },
    )


def mapped_anew() -> tuple[Any, ...]:
    """Return what somebody sends to the drive alone to map other objects into its answers."""
    return tuple(
        each
        for number, (identifiers, data) in enumerate(OTHER_MAPPING)
        for each in injected(identifiers, data, towards="drive", after_s=0.001 * number)
    )
