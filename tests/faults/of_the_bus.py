"""Who else is on the bus, and what becomes of cable, link and adapter."""

from __future__ import annotations

from tests.faults.scenario import COASTS_S, Between, OneOf, Scenario
from tests.faults.scripts import (
    ANSWERS,
    FOREIGN_ORDERS,
    FOREIGN_SETTINGS,
    LONG,
    ORDERS,
    OTHER_UNITS,
    OUR_BEAT,
    SAY_SILENT,
    SDO_REQUEST,
    SILENT,
    SYNC,
    injected,
    mapped_anew,
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
        "another master's orders behind a gateway",
        injected(
            ORDERS,
            OneOf(FOREIGN_ORDERS),
            lasts_s=LONG,
            towards="drive",
            frames_per_s=Between(5.0, 400.0),
        ),
        outcome="either",
        codes=(4, 5),
        says="measured|left operation enabled|not enabled|limits is active",
        within_s=COASTS_S,  # it may take the torque away while we brake
    ),
    Scenario(
        "somebody writes to the drive",
        injected(SDO_REQUEST, OneOf(FOREIGN_SETTINGS)),
        says="Somebody else on .* sends settings to the drive at node 1",
        within_s=COASTS_S,  # with 0x605A = 0 its quick stop lets go
    ),
    Scenario(
        "other objects mapped behind a gateway",
        mapped_anew(),
        codes=(4, 5),
        says=r"Node 1 is in|\(0x1A00:02\) reads 0x60780010, it was 0x60770010",
    ),
    Scenario(
        "other units set behind a gateway",
        injected(SDO_REQUEST, OneOf(OTHER_UNITS), towards="drive"),
        codes=(5,),
        says=r"\(0x609[12]:01\) reads \d+, it was",
        within_s=COASTS_S,  # its ramps are a tenth, or all that its torque can do
    ),
    Scenario(
        "link stalls, then delivers everything",
        ({"kind": "stalled", "lasts_s": Between(0.01, 1.0)},),
        outcome="either",
        codes=(4, 5),
        says=f"{SAY_SILENT}|8130|sample is|belong to no SYNC",
    ),
    Scenario(
        "link to the drive stalls, then delivers everything",
        ({"kind": "stalled", "lasts_s": Between(0.01, 1.0), "towards": "drive"},),
        outcome="either",
        codes=(4, 5),
        says=f"{SAY_SILENT}|8130|sample is|belong to no SYNC",
    ),
    Scenario(
        "everything to the drive is late",
        (
            {
                "kind": "late",
                "lasts_s": LONG,
                "towards": "drive",
                "delay_s": Between(0.011, 0.6),
            },
        ),
        outcome="either",
        codes=(4, 5),
        says=f"{SAY_SILENT}|8130|sample is|belong to no SYNC",
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
