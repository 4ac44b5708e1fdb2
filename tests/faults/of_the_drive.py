"""A drive that faults, lies, is set otherwise, or does not obey."""

from __future__ import annotations

from tests.faults.scenario import COASTS_S, PHASES, Between, OneOf, Scenario
from tests.faults.scripts import (
    EMCY,
    JUMPS,
    LONG,
    SAY_FOLLOW,
    SAY_SILENT,
    SDO_REQUEST,
    SILENT,
    falsified,
    injected,
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
        "runaway that no ramp brakes",
        (
            {
                "kind": "velocity-runaway",
                "velocity_rad_s": OneOf((-400.0, -150.0, 150.0, 400.0)),
                "obeys_ramps": False,
            },
        ),
        codes=(5,),
        says="measured",
        within_s=COASTS_S,
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
        says="stayed enabled|The joint is at rest",
        within_s=1.0,  # by PDO, by SDO, and then without its voltage
    ),
    Scenario(
        "taken over locally",
        ({"kind": "taken-over"},),
        codes=(4,),
        phases=("approach", "ramp", "plateau", "reversal"),
        says="no longer obeys the bus",
    ),
    Scenario(
        "brakes next to nothing",
        ({"kind": "brakes-softly", "share": Between(0.005, 0.05)},),
        act="ask to stop",
        codes=(5,),
        says="the operator asked for it",
        within_s=COASTS_S,
    ),
    Scenario(
        "holding brake stays closed",
        ({"kind": "brake-closes", "brake_nm": Between(10.5, 40.0)},),
        codes=(5,),
        phases=("standstill",),
        says="stands although the motor pushes it .* holding brake opens",
    ),
    Scenario(
        "holding brake closes in motion",
        ({"kind": "brake-closes", "brake_nm": Between(8.0, 40.0)},),
        codes=(5,),
        phases=("approach", "ramp", "plateau", "reversal", "return"),
        says="although the motor pushes it .* holding brake",
        within_s=2.0,  # one that slips is dragged until the torque has grown to its limit
    ),
    Scenario(
        "temperature sentinel",
        ({"kind": "temperature-sentinel"},),
        codes=(5,),
        says="temperature is not known: the drive has no value, -32768 stands in 0x2100:01",
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
