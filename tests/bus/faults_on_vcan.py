"""One fault of each kind on real frames of the kernel's; `test_on_vcan.py` has it run there.

The campaign of `tests/faults` draws hundreds of variations on a bus in memory. Here the same cell,
in the same stepped time, hangs on an interface of the kernel: what the faults do to frames, sockets
and filters is what AF_CAN makes of them.
"""

from __future__ import annotations

import os

import pytest

from drivers.can.frames import CanBusConfig
from fakes.faults import KINDS
from fakes.wire_faults import WireFault
from tests.bus.vcan import CHANNEL_VARIABLE
from tests.faults.campaign import variations
from tests.faults.cell import play
from tests.faults.scenario import Scenario, objections
from tests.faults.scenarios import SCENARIOS

CHANNEL = os.environ.get(CHANNEL_VARIABLE, "")

pytestmark = pytest.mark.skipif(not CHANNEL, reason=f"{CHANNEL_VARIABLE} names no bus")


BESIDES = ("other objects mapped behind a gateway", "other units set behind a gateway")
"""What one kind of fault does to a drive's settings, each a story of its own."""


def one_of_each() -> dict[str, Scenario]:
    """Return the first scenario with each kind of fault, and with each act around the agent."""
    found = {scenario.name: scenario for scenario in SCENARIOS if scenario.name in BESIDES}
    for scenario in SCENARIOS:
        for kind in [*(entry["kind"] for entry in scenario.script), scenario.act]:
            found.setdefault(kind, scenario)
    return {kind: scenario for kind, scenario in found.items() if kind}


CHOSEN = one_of_each()


@pytest.mark.parametrize("kind", CHOSEN)
def test_a_fault_on_the_kernels_own_bus_ends_at_rest(kind: str) -> None:
    scenario = CHOSEN[kind]
    ((phase, seed),) = variations(scenario, 1)
    run = play(scenario, phase, seed, place=CanBusConfig("socketcan", CHANNEL))
    assert run.handed_over > 0
    assert not objections(run), f"{phase}, seed {seed}: {run.message}"


def test_every_kind_of_damage_to_frames_is_among_them() -> None:
    assert set(BESIDES) <= set(CHOSEN)
    assert {name for name, kind in KINDS.items() if issubclass(kind, WireFault)} <= set(CHOSEN)
