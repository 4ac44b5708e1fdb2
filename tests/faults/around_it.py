"""What happens around the agent: its computer, its disk, a person, the cell's release."""

from __future__ import annotations

from tests.faults.scenario import BEFORE_TEARDOWN, PHASES, Between, Scenario

AROUND = (
    Scenario("agent hangs briefly", act="hang", lasts_s=Between(0.01, 0.06), outcome="bears"),
    Scenario(
        "agent hangs",
        act="hang",
        lasts_s=Between(0.3, 2.0),
        codes=(4, 5),
        says="stood still|8130|fault|sample",
    ),
    Scenario(
        "agent hangs before it sends",
        act="hang before sending",
        lasts_s=Between(0.12, 2.0),
        codes=(4, 5),
        says="stood still for .* in the middle of a tick. See what else this computer does",
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
