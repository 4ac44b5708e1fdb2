"""Frames that are lost, doubled, reordered, late, wrong or short."""

from __future__ import annotations

from tests.faults.scenario import COASTS_S, Between, OneOf, Scenario
from tests.faults.scripts import (
    ANSWERS,
    FEW,
    LONG,
    ORDERS,
    OUR_BEAT,
    SAY_FOLLOW,
    SAY_SILENT,
    SILENT,
    SYNC,
    lost,
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
        says=f"{SAY_FOLLOW}|outside|was not enabled|did not take torque away",
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
