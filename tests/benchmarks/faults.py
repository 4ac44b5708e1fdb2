"""The faults campaign at length: thousands of whole cycles, one line a fault.

``python -m tests.benchmarks.faults [--runs 2000] [--only WORD] [--signals 10]`` prints, for each
fault, how many runs stopped, the worst time to rest by the plant, samples lost, and what is said;
then every run that was not as it must be, with the seed that repeats it. Exit code 1 when there is
one. ``--signals`` adds so many runs of each signal, in real time and processes of their own.
``--socketcan CHANNEL`` plays on an interface of the kernel instead of a bus in memory,
``--multicast`` on ``udp_multicast``: datagrams on the loopback, as two processes exchange them.
``--lines`` adds so many runs of each way in which a Modbus line to a controller can go wrong, in
motion, over TCP and over RTU on a pty; ``--runs 0`` leaves out those on a bus.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
import tempfile
from collections.abc import Sequence

from agent.cycle.axis_lock import FOLDER_VARIABLE
from drivers.can.frames import CanBusConfig
from tests.faults.campaign import variations
from tests.faults.cell import play
from tests.faults.lines import DEAR_KINDS, KINDS, LineRun, struck
from tests.faults.lines import STATED_S as LINE_STATED_S
from tests.faults.scenario import Run, Scenario, objections
from tests.faults.scenarios import SCENARIOS
from tests.faults.signals import SIGNALS, STATED_S, signalled
from tests.system.processes import multicast

RATES_HZ = (100.0, 100.0, 100.0, 200.0)
"""In turn; the faster, the dearer."""

EVERY_KIND = (*KINDS, *DEAR_KINDS)

Told = tuple[int, list[str]]
"""How many runs, and everything against them."""


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


def line_row(runs: Sequence[LineRun]) -> str:
    """Return the row of one fault of a Modbus line."""
    worst_s = max(run.rest_after_s for run in runs)
    codes = ", ".join(str(code) for code in sorted({run.code for run in runs}))
    stopped = sum(run.code != 0 for run in runs)
    return (
        f"| {runs[0].kind} on {runs[0].line} | {len(runs)} | {stopped} | {codes} | "
        f"{worst_s:.2f} | {LINE_STATED_S:.1f} | | {runs[0].message[:110]} |"
    )


def on_buses(scenarios: Sequence[Scenario], each: int, place: CanBusConfig | None) -> Told:
    """Play every fault so often and print its row; return how many ran and what is against them."""
    total, objected = 0, []
    for scenario in scenarios:
        runs = played(scenario, each, place)
        total += len(runs)
        print(line(scenario, runs), flush=True)
        objected += [
            f"{scenario.name}, {run.phase}, seed {run.seed}: {'; '.join(found)}: {run.message}"
            for run in runs
            if (found := objections(run))
        ]
    return total, objected


def by_signals(each: int, place: CanBusConfig | None) -> Told:
    """Send each signal so often to an agent in motion, in real time."""
    objected: list[str] = []
    for number in SIGNALS if each else ():
        ended = [signalled(number, 0.3 + 4.0 * k / each, place=place) for k in range(each)]
        worst_s = max(run.rest_after_s for run in ended)
        codes = ", ".join(sorted({str(run.code) for run in ended}))
        print(
            f"| {number.name} of the agent, real time | {each} | {each} | {codes} | "
            f"{worst_s:.2f} | {STATED_S:.1f} | | {ended[0].message[:110]} |",
            flush=True,
        )
        objected += [f"{number.name}: {text}" for run in ended for text in run.objections()]
    return each * len(SIGNALS), objected


def on_lines(each: int) -> Told:
    """Let a Modbus line go wrong so often in each way while its controller drives."""
    objected: list[str] = []
    for kind, where in EVERY_KIND if each else ():
        runs = [struck(kind, where, seed) for seed in range(100, 100 + each)]
        print(line_row(runs), flush=True)
        objected += [
            f"{kind} on {where}, seed {run.seed}: {'; '.join(found)}: {run.message}"
            for run in runs
            if (found := run.objections())
        ]
    return each * len(EVERY_KIND), objected


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--only", default="", help="faults with this word in their name")
    parser.add_argument("--signals", type=int, default=0, help="runs of each signal")
    parser.add_argument("--lines", type=int, default=0, help="runs of each fault of a Modbus line")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--socketcan", metavar="CHANNEL", help="play on vcan0 ...")
    where.add_argument("--multicast", action="store_true", help="play on udp_multicast")
    chosen = parser.parse_args(arguments)
    place = multicast() if chosen.multicast else None
    if chosen.socketcan:
        place = CanBusConfig("socketcan", chosen.socketcan)
    # canopen logs every SDO that it gives up, pymodbus every answer; thousands are meant to fail.
    logging.getLogger().addHandler(logging.NullHandler())
    scenarios = [s for s in SCENARIOS if chosen.only in s.name and chosen.runs]
    each = -(-chosen.runs // max(1, len(scenarios)))
    print(
        "| fault | runs | stopped | exit codes | worst time to rest, s | stated, s | "
        "samples lost, most | first words |\n|---|---|---|---|---|---|---|---|"
    )
    with tempfile.TemporaryDirectory() as folder:  # a real cell of that name is not in the way
        os.environ.setdefault(FOLDER_VARIABLE, folder)
        told = (
            on_buses(scenarios, each, place),
            by_signals(chosen.signals, place),
            on_lines(chosen.lines),
        )
    objected = [text for _, texts in told for text in texts]
    print(f"\n{sum(total for total, _ in told)} runs, {len(objected)} not as they must be.")
    print("".join(f"  {text}\n" for text in objected), end="")
    return 1 if objected else 0


if __name__ == "__main__":
    sys.exit(main())
