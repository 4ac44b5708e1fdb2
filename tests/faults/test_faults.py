"""Every fault, at every moment of a cycle: at rest in time, nothing lost, said, given back.

Each run is a whole cycle on real frames and a stepped clock, some 0.1 s of processor time; the
first of each fault hangs on udp_multicast, the others on a bus in memory. Which moment and strength
each is, is drawn from its seed; `tests.benchmarks.faults` draws thousands.
"""

from __future__ import annotations

import pytest

from tests.faults.campaign import variations
from tests.faults.cell import play
from tests.faults.scenario import PHASES, Scenario, objections
from tests.faults.scenarios import SCENARIOS
from tests.system.processes import multicast

RUNS_EACH = 3


@pytest.mark.parametrize(
    "scenario",
    SCENARIOS,
    ids=lambda scenario: scenario.name.replace(" ", "-"),
)
def test_a_fault_ends_at_rest_with_everything_kept_and_said(scenario: Scenario) -> None:
    objected = {}
    for number, (phase, seed) in enumerate(variations(scenario, RUNS_EACH)):
        run = play(scenario, phase, seed, place=multicast() if number == 0 else None)
        found = objections(run)
        if found:
            objected[f"{phase}, seed {seed}, at {run.onset_s:.3f} s: {run.message}"] = found
    assert not objected


def test_the_default_runs_strike_in_every_phase_and_are_two_hundred() -> None:
    drawn = [
        (scenario.name, phase, seed)
        for scenario in SCENARIOS
        for phase, seed in variations(scenario, RUNS_EACH)
    ]
    assert len(set(drawn)) == len(drawn) >= 200
    assert {phase for _, phase, _ in drawn} == set(PHASES)
    assert len({scenario.name for scenario in SCENARIOS}) == len(SCENARIOS)
