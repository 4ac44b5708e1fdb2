"""The faults campaign at length: thousands of whole cycles, one line a fault.

``python -m tests.benchmarks.faults [--runs 2000] [--only WORD] [--signals 10]`` prints, for each
fault, how many runs stopped, the worst time to rest by the plant, samples lost, and what is said;
then every run that was not as it must be, with the seed that repeats it. Exit code 1 when there is
one. ``--signals`` adds so many runs of each signal, in real time and processes of their own.
``--socketcan CHANNEL`` plays on an interface of the kernel instead of a bus in memory,
``--multicast`` on ``udp_multicast``: datagrams on the loopback, as two processes exchange them.
"""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence

from drivers.can.frames import CanBusConfig
from tests.faults.campaign import variations
from tests.faults.cell import play
from tests.faults.scenario import Run, Scenario, objections
from tests.faults.scenarios import SCENARIOS
from tests.faults.signals import SIGNALS, STATED_S, signalled
from tests.system.processes import multicast

RATES_HZ = (100.0, 100.0, 100.0, 200.0)
"""In turn; the faster, the dearer."""


def played(scenario: Scenario, count: int, place: CanBusConfig | None) -> list[Run]:
    """Return `count` runs of one fault, beyond those of the default tests."""
    return [
        play(scenario, phase, seed, rate_hz=RATES_HZ[number % len(RATES_HZ)], place=place)
        for number, (phase, seed) in enumerate(variations(scenario, count, offset=4))
    ]


def line(scenario: Scenario, runs: Sequence[Run]) -> str:
    """Return one row of the table."""
    stopped = [run for run in runs if run.stopped]
    worst_s = max((run.rest_after_s for run in stopped), default=0.0)
    lost = max((run.lost or 0 for run in runs), default=0)
    codes = ", ".join(str(code) for code in sorted({run.code for run in runs}))
    said = stopped[0].message.split(". ")[0] if stopped else "(nothing: the cycle goes on)"
    return (
        f"| {scenario.name} | {len(runs)} | {len(stopped)} | {codes} | {worst_s:.2f} | "
        f"{scenario.within_s:.1f} | {lost} | {said[:110]} |"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--only", default="", help="faults with this word in their name")
    parser.add_argument("--signals", type=int, default=0, help="runs of each signal")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--socketcan", metavar="CHANNEL", help="play on vcan0 ...")
    where.add_argument("--multicast", action="store_true", help="play on udp_multicast")
    chosen = parser.parse_args(arguments)
    place = multicast() if chosen.multicast else None
    if chosen.socketcan:
        place = CanBusConfig("socketcan", chosen.socketcan)
    # canopen logs every SDO that it gives up; here thousands are meant to fail.
    logging.getLogger("canopen").setLevel(logging.CRITICAL)
    scenarios = [s for s in SCENARIOS if chosen.only in s.name]
    each = max(1, -(-chosen.runs // len(scenarios)))
    sys.stdout.write(
        "| fault | runs | stopped | exit codes | worst time to rest, s | stated, s | "
        "samples lost, most | first words |\n|---|---|---|---|---|---|---|---|\n"
    )
    objected: list[str] = []
    total = 0
    for scenario in scenarios:
        runs = played(scenario, each, place)
        total += len(runs)
        sys.stdout.write(line(scenario, runs) + "\n")
        sys.stdout.flush()
        objected += [
            f"{scenario.name}, {run.phase}, seed {run.seed}: {'; '.join(found)}: {run.message}"
            for run in runs
            if (found := objections(run))
        ]
    for number in SIGNALS if chosen.signals else ():
        ended = [
            signalled(number, 0.3 + 4.0 * k / chosen.signals, place=place)
            for k in range(chosen.signals)
        ]
        total += len(ended)
        worst_s = max(run.rest_after_s for run in ended)
        codes = ", ".join(sorted({str(run.code) for run in ended}))
        sys.stdout.write(
            f"| {number.name} of the agent, real time | {len(ended)} | {len(ended)} | {codes} | "
            f"{worst_s:.2f} | {STATED_S:.1f} | | {ended[0].message[:110]} |\n"
        )
        objected += [f"{number.name}: {text}" for run in ended for text in run.objections()]
    sys.stdout.write(f"\n{total} runs, {len(objected)} not as they must be.\n")
    sys.stdout.writelines(f"  {text}\n" for text in objected)
    return 1 if objected else 0


if __name__ == "__main__":
    sys.exit(main())
