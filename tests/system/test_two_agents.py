"""Two agents on two computers that begin at one drive: it is given back as it was found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from drivers.errors import DriverError
from tests.faults.aftermath import REST_RAD_S, registers
from tests.system.rig import Rig, rig
from tests.system.two_agents import Agent, encounter

LASTS_S = 2.0


def _slow_heartbeat(cell: dict[str, Any]) -> None:
    """Let an agent that begins be silent for half a second, three times, until the drive speaks."""
    cell["axis"][0]["supervision"]["drive_heartbeat_period_s"] = 0.5
    cell["recording"]["sample_rate_hz"] = 100.0  # what they do to each other hangs on no tick


def _met(bench: Rig, *agents: Agent) -> list[Agent]:
    """Let them meet, see that the joint is at rest, and return who was refused by the other."""
    encounter(bench.cell, bench.clock, list(agents), LASTS_S)
    bench.later(0.5)
    assert abs(bench.drive.motor_velocity_rad_s) < REST_RAD_S
    return [agent for agent in agents if isinstance(agent.error, DriverError)]


@pytest.mark.parametrize("first_s", [0.0, 0.5, 1.0, 1.5])
def test_who_meets_another_leaves_the_drive_as_it_was_found(first_s: float, tmp_path: Path) -> None:
    """Their starts lie 0 to 2 s apart; a frame takes half a millisecond."""
    for step in range(4):
        apart_s = first_s + step * 0.125
        folder = tmp_path / str(step)
        with rig(folder, edit=_slow_heartbeat) as bench:
            bench.later(0.1)
            found = registers(bench)
            one, two = Agent(folder / "one", 0.0), Agent(folder / "two", apart_s)
            assert _met(bench, one, two), f"{apart_s} s apart neither was refused"
            assert registers(bench) == found, f"{apart_s} s apart"
        assert not list(folder.rglob(".*.found.json")), f"{apart_s} s apart"


@pytest.mark.parametrize(
    ("stalls_at_s", "apart_s"),
    [(0.3, 0.4), (0.7, 0.7), (0.9, 1.0), (1.3, 1.3)],
    ids=["before its journal", "its first setting", "its settings", "its last order"],
)
def test_who_is_held_up_while_the_other_begins_keeps_what_was_found(
    stalls_at_s: float, apart_s: float, tmp_path: Path
) -> None:
    """Deaf for so long, it cannot answer who asks; what it had found is back, or in its journal."""
    with rig(tmp_path, edit=_slow_heartbeat) as bench:
        bench.later(0.1)
        found = registers(bench)
        at_s = bench.clock.now() + stalls_at_s
        one = Agent(tmp_path / "one", 0.0, stalls_at_s=at_s, stalls_for_s=2.0)
        two = Agent(tmp_path / "two", apart_s)
        _met(bench, one, two)
        if registers(bench) == found:
            return
        assert list(one.folder.glob(".*.found.json"))
        bench.folder = one.folder
        bench.run()
        assert registers(bench) == found
