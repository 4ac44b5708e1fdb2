"""What receiving costs, and what is lost: ``uv run python -m tests.benchmarks.acquisition``.

In turn, in the same run, at 7000 frames a second: the reader process with the tick that takes its
frames, the owner's thread, python-can's Notifier, canopen's PDO callback; `--rounds` times over, so
that all meet what else the machine does. The reader process alone has a column of its own, and so
has the loop of every one of the four, which sleeps and wakes 500 times a second: what it costs when
nothing is to be taken is measured after each run. Then the reader
at 9009 frames a second (100 % of a 1 Mbit/s bus with 8-byte frames) beside `stribeck estimate`,
which is started again and again. Both natively, over UDP datagrams shaped like `struct can_frame`
(stamps, drop counter and `recvmmsg` are the same kernel code), and on a real vcan.

On a shared machine only processor time per frame, and its ratio to the peers', can be compared;
and a machine whose caches others empty between two ticks multiplies even that.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.benchmarks.acquisition_sides import LOOPBACK, OTHERS, RECEIVERS
from tests.bus.vcan import VcanUnavailableError, open_vcan
from tests.system.processes import STRIBECK

RATE_HZ = 7000.0
FULL_BUS_HZ = 9009.0
SIDES = (sys.executable, "-m", "tests.benchmarks.acquisition_sides")
PATIENCE_S = 120.0


@dataclass(frozen=True)
class Result:
    """One receiver's run."""

    what: str
    others: int  # of the frames that nobody here listens to, for each that somebody does
    rate_hz: float  # as sent
    sent: int
    came: int
    wrong: int
    processor_us: float  # a frame, of all that takes part
    reader_us: float | None  # a frame, of the reader process alone
    loop_us: float  # a frame, of a loop that sleeps and wakes as often and takes nothing
    dropped_by_kernel: int | None

    def line(self) -> str:
        """Return a row of the table."""
        dropped = "" if self.dropped_by_kernel is None else str(self.dropped_by_kernel)
        reader = "" if self.reader_us is None else f"{self.reader_us:.2f}"
        lost = self.sent - self.came
        return (
            f"{self.what:<24}{f'1 of {1 + self.others}' if self.others else 'all':<8}"
            f"{self.rate_hz:8.0f}{self.sent:9}{lost:8}{self.wrong:7}"
            f"{dropped:>9}{self.processor_us:12.2f}{reader:>12}{self.loop_us:>12.2f}"
        )


def measure(kind: str, channel: str, rate_hz: float, seconds: float, others: int = 0) -> Result:
    """Let one receiver and one sender run, each in its own process."""
    with subprocess.Popen(
        [*SIDES, "--channel", channel, "--receive", kind], stdout=subprocess.PIPE, text=True
    ) as receiver:
        assert receiver.stdout is not None
        address = receiver.stdout.readline().strip()
        where = ["--channel", channel, "--send", address]
        how = ["--rate", str(rate_hz), "--seconds", str(seconds), "--others", str(others)]
        sender = subprocess.run([*SIDES, *where, *how], stdout=subprocess.PIPE, check=True)
        said, _ = receiver.communicate(timeout=PATIENCE_S)
    sent: dict[str, Any] = json.loads(sender.stdout)
    found: dict[str, Any] = json.loads(said)
    came = max(found["came"], 1) * (1 + others)  # of all on the bus
    return Result(
        what=kind,
        others=others,
        rate_hz=sent["sent"] / sent["took_s"],
        sent=sent["sent"] // (1 + others),
        came=found["came"],
        wrong=found["wrong"],
        processor_us=1e6 * (found["own_s"] + found["reader_s"]) / came,
        reader_us=1e6 * found["reader_s"] / came or None,
        loop_us=1e6 * found["loop_s"] / came,
        dropped_by_kernel=found.get("dropped_by_kernel"),
    )


@contextmanager
def estimates(recording: Path) -> Iterator[list[int]]:
    """Estimate again and again in the background; the list holds how often it came to its end."""
    done = [0]
    script = 'while :; do "$@" >/dev/null && echo; done'
    command = ["sh", "-c", script, "sh", *STRIBECK, "estimate", str(recording), "--json"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as run:
        try:
            yield done
        finally:
            os.killpg(run.pid, signal.SIGKILL)  # the estimate that runs now, too
            assert run.stdout is not None
            done[0] = run.stdout.read().count("\n")


def compare(channel: str, seconds: float, rounds: int, long_s: float, recording: Path) -> None:
    """Print the table of one place."""
    print(
        f"{'receiver':<24}{'ours':<8}{'Hz':>8}{'sent':>9}{'lost':>8}{'jumps':>7}{'dropped':>9}{'us/frame':>12}"
        f"{'reader only':>12}{'loop only':>12}"
    )
    for _ in range(rounds):
        for others in (0, len(OTHERS)):
            for kind in RECEIVERS:
                print(measure(kind, channel, RATE_HZ, seconds, others).line(), flush=True)
    if long_s > 0.0:
        with estimates(recording) as done:
            result = measure("reader process", channel, FULL_BUS_HZ, long_s)
        print(result.line(), f"  beside estimates, {done[0]} of which ended", flush=True)


def main() -> None:
    """Measure natively, then on a real bus."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="of each receiver in a round")
    parser.add_argument("--rounds", type=int, default=3, help="through all receivers")
    parser.add_argument(
        "--long", type=float, default=60.0, help="at 100 %% of the bus; 0: leave out"
    )
    parser.add_argument("--places", default="native,vcan")
    parser.add_argument("--channel", help="measure on this interface, here; needs --recording")
    parser.add_argument("--recording", type=Path)
    arguments = parser.parse_args()
    if arguments.channel is not None:
        compare(
            arguments.channel,
            arguments.seconds,
            arguments.rounds,
            arguments.long,
            arguments.recording,
        )
        return
    with tempfile.TemporaryDirectory() as folder:
        recording = arguments.recording or _recording(Path(folder))
        if "native" in arguments.places:
            print("natively, UDP on the loopback")
            compare(LOOPBACK, arguments.seconds, arguments.rounds, arguments.long, recording)
        if "vcan" in arguments.places:
            print(_on_vcan(arguments.seconds, arguments.rounds, arguments.long, recording))


def _recording(folder: Path) -> Path:
    """Return a 40 s stair at 1 kHz, as `tests.benchmarks.speed` drives it."""
    from tests.benchmarks.speed import drive_a_stair

    return drive_a_stair(folder, 1000.0)


def _on_vcan(seconds: float, rounds: int, long_s: float, recording: Path) -> str:
    """Return this benchmark's table from where a real CAN bus is."""
    command = [sys.executable, "-m", "tests.benchmarks.acquisition"]
    command += ["--seconds", str(seconds), "--rounds", str(rounds), "--long", str(long_s)]
    try:
        with open_vcan() as vcan, tempfile.TemporaryDirectory(dir="/var/tmp") as shared:
            there = shutil.copy(recording, shared)  # a guest has a /tmp of the host's, but no tmpfs
            done = vcan.run(
                [*command, "--channel", vcan.channel, "--recording", str(there)],
                timeout_s=10.0 * (2 * rounds * len(RECEIVERS) * seconds + long_s)
                + 2.0 * PATIENCE_S,
            )
            return f"on {vcan.describe()}\n{done.stdout}{done.stderr}"
    except VcanUnavailableError as error:
        return str(error)


if __name__ == "__main__":
    main()
