"""Every fault of the campaign, as data. Node 1: TPDO 0x181, 0x281; RPDO 0x201; SDO 0x581, 0x601."""

from __future__ import annotations

from typing import Any

from tests.faults.scenario import (
    BEFORE_TEARDOWN,
    COASTS_S,
    PHASES,
    Between,
    OneOf,
    Scenario,
)

ANSWERS, ORDERS = (0x181, 0x281), (0x201,)
SYNC, EMCY, DRIVE_BEAT, OUR_BEAT = (0x080,), (0x081,), (0x701,), (0x77F,)
SDO_REQUEST, SDO_ANSWER = (0x601,), (0x581,)
LONG = Between(0.3, 2.0)
FEW = Between(0.001, 0.025)  # up to three SYNCs at 100 Hz
JUMPS = (-400_000, -100_000, 100_000, 400_000)  # counts; the limit is 81 557

FOREIGN_ORDERS = ("0f0000000000", "0f0000000600", "0f000000faff", "0f0100000600", "060000000000")
"""Controlword and velocity: 0, 38 and -38 rad/s, with halt, and no longer enabled."""

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


FRAMES = (
    Scenario(
        "a few answers lost",
        lost(ANSWERS, FEW),
        outcome="either",  # at 100 Hz it bears them; at 200 Hz they may be five
        says="SYNCs in a row unanswered",
    ),
    Scenario(
        "answers lost at random, 5 %",
        ({"kind": "lost", "identifiers": ANSWERS, "lasts_s": 2.0, "share": 0.05},),
        outcome="either",
        says=SAY_SILENT,
        codes=SILENT,
    ),
    Scenario("no more answers", lost(ANSWERS, LONG), says=SAY_SILENT, codes=SILENT),
    Scenario("a few orders lost", lost(ORDERS, FEW), outcome="bears"),
    Scenario(
        "no more orders",
        lost(ORDERS, 10.0),
        says=f"{SAY_FOLLOW}|outside|did not take torque away",
        outcome="either",
        codes=(4, 5),
    ),
    Scenario("SYNC stopped", lost(SYNC, LONG), says=SAY_SILENT, codes=SILENT),
    Scenario("our heartbeat lost", lost(OUR_BEAT, LONG), says="8130"),
    Scenario(
        "drive's heartbeat lost", ({"kind": "heartbeat-stops"},), says="heartbeat", within_s=0.8
    ),
    Scenario(
        "answers doubled",
        ({"kind": "doubled", "identifiers": ANSWERS, "lasts_s": Between(0.01, 1.0)},),
        outcome="either",
        says="belong to no SYNC",
    ),
    Scenario(
        "everything doubled",
        ({"kind": "doubled", "lasts_s": Between(0.01, 1.0)},),
        outcome="either",
        says="belong to no SYNC",
    ),
    Scenario(
        "answers reordered",
        (
            {
                "kind": "swapped",
                "identifiers": ANSWERS,
                "lasts_s": Between(0.02, 1.0),
                "share": 1.0,
            },
        ),
        outcome="either",
        says=SAY_SILENT,
        codes=SILENT,
    ),
    Scenario(
        "one stream reordered",
        (
            {
                "kind": "swapped",
                "identifiers": (0x181,),
                "lasts_s": Between(0.02, 1.0),
                "share": OneOf((0.1, 0.5)),
            },
        ),
        outcome="either",
        says=SAY_SILENT,
        codes=SILENT,
        samples_true=False,
    ),
    Scenario(
        "answers a little late",
        (
            {
                "kind": "late",
                "identifiers": ANSWERS,
                "lasts_s": LONG,
                "delay_s": Between(0.001, 0.004),
            },
        ),
        outcome="either",
        says=SAY_SILENT,
        codes=SILENT,
    ),
    Scenario(
        "answers late by periods",
        (
            {
                "kind": "late",
                "identifiers": ANSWERS,
                "lasts_s": LONG,
                "delay_s": Between(0.011, 0.045),
            },
        ),
        outcome="either",
        says=SAY_SILENT,
        codes=SILENT,
    ),
    Scenario(
        "answers too late",
        ({"kind": "late", "identifiers": ANSWERS, "lasts_s": LONG, "delay_s": Between(0.06, 0.2)},),
        codes=(4, 5),
        says=f"{SAY_SILENT}|belong to no SYNC|sample is",
    ),
    Scenario(
        "answers with a wrong bit",
        ({"kind": "flipped", "identifiers": ANSWERS, "lasts_s": LONG, "share": 0.2},),
        outcome="either",
        codes=(4, 5),
        samples_true=False,
    ),
    Scenario(
        "orders with a wrong bit",
        ({"kind": "flipped", "identifiers": ORDERS, "lasts_s": LONG, "share": 0.2},),
        outcome="either",
        codes=(4, 5),
        within_s=COASTS_S,  # one bit of the controlword takes the torque away
    ),
    Scenario(
        "short answers",
        ({"kind": "short", "identifiers": ANSWERS, "keep": OneOf((0, 1, 3, 5)), "lasts_s": LONG},),
        says="bytes",
    ),
    Scenario(
        "short orders",
        ({"kind": "short", "identifiers": ORDERS, "keep": OneOf((0, 1, 3, 5)), "lasts_s": LONG},),
        says="0x8210",
    ),
)

BUS = (
    Scenario(
        "another node's traffic",
        (
            {
                "kind": "injected",
                "lasts_s": LONG,
                "frames_per_s": Between(100.0, 3000.0),
                "identifiers": tuple(range(0x182, 0x200)) + tuple(range(0x702, 0x77F)),
                "flavour": OneOf(("data", "remote")),
            },
            {
                "kind": "injected",
                "lasts_s": LONG,
                "frames_per_s": 200.0,
                "flavour": OneOf(("extended", "error")),
            },
        ),
        outcome="bears",
    ),
    Scenario(
        "another node under our id",
        injected(ANSWERS, "", lasts_s=LONG, towards="agent", frames_per_s=Between(200.0, 2000.0)),
        codes=(4, 5),
        outcome="either",
        samples_true=False,
    ),
    Scenario(
        "a second SYNC producer",
        injected(SYNC, "", lasts_s=LONG, frames_per_s=Between(37.0, 900.0)),
        says="Somebody else on .* sends SYNC",
        samples_true=False,
    ),
    Scenario(
        "a second SYNC producer behind a gateway",
        injected(SYNC, "", lasts_s=LONG, towards="drive", frames_per_s=Between(37.0, 900.0)),
        outcome="either",
        codes=(4, 5),
        says="belong to no SYNC|measured|sample",
        samples_true=False,
    ),
    Scenario(
        "somebody else feeds the watchdog",
        injected(OUR_BEAT, "05", lasts_s=30.0, frames_per_s=Between(2.0, 50.0)),
        says="Somebody else on .* sends the heartbeat of node 127",
    ),
    Scenario(
        "another master's orders",
        injected(ORDERS, OneOf(FOREIGN_ORDERS), lasts_s=LONG, frames_per_s=Between(5.0, 400.0)),
        says="Somebody else on .* sends orders to the drive at node 1",
        within_s=COASTS_S,  # it may take the torque away while we brake
    ),
    Scenario(
        "babbling idiot",
        (
            {"kind": "lost", "lasts_s": LONG},
            {"kind": "injected", "identifiers": (0x001,), "lasts_s": 2.0, "frames_per_s": 8000.0},
        ),
        says=SAY_SILENT,
        codes=SILENT,
    ),
    Scenario("drive bus-off", ({"kind": "lost", "lasts_s": 30.0},), says=SAY_SILENT, codes=SILENT),
    Scenario(
        "drive bus-off, recovers",
        ({"kind": "lost", "lasts_s": Between(0.2, 0.6)},),
        says=SAY_SILENT,
        codes=SILENT,
    ),
    Scenario("cable out at the drive", ({"kind": "unplugged"},), says=SAY_SILENT, codes=SILENT),
    Scenario(
        "adapter: interface down",
        ({"kind": "adapter-fails", "code": "ENETDOWN"},),
        says="went down",
    ),
    Scenario(
        "adapter: unplugged", ({"kind": "adapter-fails", "code": "ENODEV"},), says="went down"
    ),
    Scenario(
        "adapter: nobody acknowledges",
        ({"kind": "adapter-fails", "code": "ENOBUFS"},),
        says="nobody acknowledges",
    ),
    Scenario(
        "adapter: silent", ({"kind": "adapter-fails", "code": ""},), says=SAY_SILENT, codes=SILENT
    ),
    Scenario(
        "adapter: silent for a moment",
        ({"kind": "adapter-fails", "code": "", "lasts_s": Between(0.1, 0.5)},),
        outcome="either",
        codes=SILENT,
        says=f"{SAY_SILENT}|measured position|8130|fault",
    ),
)

DRIVE = (
    Scenario(
        "drive fault",
        ({"kind": "drive-fault", "code": OneOf((0x8611, 0x2310, 0x3220, 0x7305, 0x4310, 0x7121))},),
        says="emergency",
    ),
    Scenario(
        "EMCY storm",
        injected(
            EMCY,
            "1042090000000000",
            lasts_s=LONG,
            towards="agent",
            frames_per_s=Between(500.0, 5000.0),
        ),
        says="0x4210",
    ),
    Scenario(
        "drive resets",
        injected((0x000,), "8101", towards="drive"),
        says="Node 1|operation",
        within_s=COASTS_S,
    ),
    Scenario(
        "another NMT master",
        injected((0x000,), OneOf(("0201", "8001", "8201")), towards="drive"),
        says="Node 1|operation|emergency|measured velocity",
        codes=SILENT,
        within_s=COASTS_S,
    ),
    Scenario(
        "power cut", ({"kind": "power-cut"},), says=SAY_SILENT, codes=SILENT, within_s=COASTS_S
    ),
    Scenario(
        "runaway",
        ({"kind": "velocity-runaway", "velocity_rad_s": OneOf((-400.0, -150.0, 150.0, 400.0))},),
        codes=(4, 5),
        says="measured",
    ),
    Scenario(
        "torque limit lowered",
        injected(
            SDO_REQUEST,
            OneOf(("2b72600014000000", "2b72600032000000", "2b72600064000000")),
            towards="drive",
        ),
        phases=("approach", "ramp", "reversal"),
        codes=(4, 5),
        says=SAY_FOLLOW,
        outcome="either",
        within_s=1.5,
    ),
    Scenario(
        "encoder jumps in motion",
        falsified(0x181, 4, 4, "add", OneOf(JUMPS)),
        phases=("ramp", "plateau"),
        codes=(5,),
        says="measured position jumped",
        samples_true=False,
    ),
    Scenario(
        "encoder jumps at rest",
        falsified(0x181, 4, 4, "add", OneOf(JUMPS)),
        phases=("standstill", "approach", "reversal", "return"),
        codes=(5,),
        says="measured position jumped",
        samples_true=False,
    ),
    Scenario(
        "frozen position",
        ({"kind": "frozen-position"},),
        codes=(5,),
        within_s=2.5,
        phases=("approach", "ramp", "plateau"),
        says="measured position",
        samples_true=False,
    ),
    Scenario(
        "frozen velocity",
        falsified(0x281, 0, 4, "hold"),
        codes=(5,),
        phases=("approach", "ramp"),
        says="measured velocity",
        within_s=2.5,
    ),
    Scenario(
        "velocity counted backwards",
        falsified(0x281, 0, 4, "multiply", -1),
        codes=(5,),
        phases=("approach", "ramp", "plateau"),
        says="measured velocity",
        within_s=2.5,
    ),
    Scenario(
        "velocity ten times too large",
        falsified(0x281, 0, 4, "multiply", 10),
        codes=(5,),
        phases=("approach", "ramp", "plateau"),
        says="measured velocity",
        within_s=2.5,
    ),
    Scenario(
        "position on another scale",
        falsified(0x181, 4, 4, "multiply", OneOf((-1, 10))),
        codes=(5,),
        phases=("approach", "ramp", "plateau"),
        says="measured position",
        within_s=2.5,
        samples_true=False,
    ),
    Scenario(
        "torque is no number",
        falsified(0x181, 2, 2, "set", -0x8000),
        codes=(5,),
        says="measured torque",
    ),
    Scenario(
        "statusword is nonsense",
        falsified(0x181, 0, 2, "set", OneOf((0x0021, 0x0003, 0x0064, -1))),
        codes=(4, 5),
        outcome="either",
        says="node 1|not enabled",
    ),
    Scenario(
        "mode taken away",
        injected(SDO_REQUEST, "2f60600000000000", towards="drive"),
        phases=("approach", "ramp", "plateau", "reversal"),
        codes=(5,),
        says="measured",
        outcome="either",
    ),
    Scenario(
        "quick stop is ignored",
        ({"kind": "ignores-quick-stop"},),
        act="ask to stop",
        codes=(5,),
        says="stayed enabled in spite of quick stop|The joint is at rest",
    ),
    Scenario(
        "temperature sentinel",
        ({"kind": "temperature-sentinel"},),
        codes=(5,),
        says="temperature is not known",
    ),
    Scenario(
        "temperature jumps out of range",
        falsified(0x281, 4, 2, "set", OneOf((-400, 760, 2000))),
        codes=(5,),
        says="temperature of",
    ),
    Scenario(
        "SDO aborts at the end",
        (
            {
                "kind": "sdo-aborts",
                "index": OneOf((0x6083, 0x6007)),
                "code": OneOf((0x08000020, 0x06010000, 0x06090030)),
            },
        ),
        codes=(5,),
        phases=PHASES,
        says="could not be given back",
        outcome="either",
    ),
    Scenario(
        "SDO time-outs at the end",
        ({"kind": "sdo-silent", "index": OneOf((0x6083, 0x6085, 0x6007))},),
        codes=(5,),
        phases=PHASES,
        says="could not be given back",
        outcome="either",
    ),
)

AROUND = (
    Scenario("agent hangs briefly", act="hang", lasts_s=Between(0.01, 0.06), outcome="bears"),
    Scenario(
        "agent hangs", act="hang", lasts_s=Between(0.3, 2.0), codes=(4, 5), says="8130|fault|sample"
    ),
    Scenario("operator stops", act="ask to stop", codes=(5,), says="the operator asked for it"),
    Scenario("wall clock is set", act="set the wall clock", outcome="bears", phases=PHASES),
    Scenario(
        "disk full",
        act="fill the disk",
        codes=(3,),
        within_s=1.1,
        outcome="either",
        says="[Dd]isk|File too large|cannot be written",
        phases=BEFORE_TEARDOWN,
    ),
    Scenario("release withdrawn", act="open the release", codes=(5,), says="contact is open"),
    Scenario(
        "release no longer heard",
        act="cut the release",
        codes=(5,),
        within_s=1.6,
        says="has not been heard",
    ),
)

SCENARIOS = (*FRAMES, *BUS, *DRIVE, *AROUND)
