"""What the page costs while a cycle runs, and whether the cycle's recording suffers from it.

``python -m tests.benchmarks.page [--viewers 1 50] [--rate 500] [--cycles 1]``

Everything is what a user starts: the simulated drive, `stribeck serve`, a cycle started by its
form, viewers that take the stream a browser takes, from before the cycle until its end. Beside it,
as the control, the same cycles by `stribeck run` without any page. CPU time is the server's own by
the system's account; memory is read twice a second, and the largest counts. What became of the
frames is read from each recording, as the cycle wrote it there.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import re
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
import pyarrow.parquet as pq

from agent.acquisition import Acquisition, total
from agent.record.formats.parquet_footer import key_values
from agent.record.metadata import KEY, Metadata
from tests.system.processes import be_patient, free_udp_port, started, stribeck

PASSWORD = "four plain words here"
LOOK_S = 0.5


@dataclass
class Watch:
    """The server's process, looked at twice a second."""

    pid: int
    rss_mb: list[float] = field(default_factory=list)
    pss_mb: list[float] = field(default_factory=list)
    own_mb: list[float] = field(default_factory=list)

    def cpu_s(self) -> float:
        """Return the CPU time that the process has used, all its threads together."""
        fields = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def look(self) -> None:
        """Keep resident, proportional and own memory."""
        found: dict[str, float] = {}
        for line in Path(f"/proc/{self.pid}/smaps_rollup").read_text().splitlines()[1:]:
            name, value = line.split()[:2]
            found[name.rstrip(":")] = int(value) / 1024.0
        self.rss_mb.append(found["Rss"])
        self.pss_mb.append(found["Pss"])
        self.own_mb.append(found["Private_Clean"] + found["Private_Dirty"])

    async def keep_looking(self) -> None:
        """Look until cancelled."""
        while True:
            self.look()
            await asyncio.sleep(LOOK_S)

    def highest_ever_mb(self) -> float:
        """Return the system's own high-water mark, log-ins with their hashing included."""
        status = Path(f"/proc/{self.pid}/status").read_text()
        return int(re.findall(r"VmHWM:\s+(\d+)", status)[0]) / 1024.0


@dataclass
class Seen:
    """What one viewer got: updates with points, points, and between which times they came."""

    updates: int = 0
    points: int = 0
    first_s: float = np.inf
    last_s: float = -np.inf

    @property
    def rate_hz(self) -> float:
        """Return updates a second."""
        passed_s = self.last_s - self.first_s
        return self.updates / passed_s if passed_s > 0.0 else 0.0


async def view(client: httpx.AsyncClient) -> Seen:
    """Watch a cycle from before its first sample until its end."""
    seen, kind = Seen(), ""
    async with client.stream("GET", "/run/live", timeout=None) as answer:
        async for line in answer.aiter_lines():
            if line.startswith("event: "):
                kind = line[7:]
            elif line.startswith("data: ") and kind == "points":
                fresh = len(json.loads(line[6:])[1])
                if fresh:
                    now_s = time.monotonic()
                    seen.first_s, seen.last_s = min(seen.first_s, now_s), now_s
                    seen.updates, seen.points = seen.updates + 1, seen.points + fresh
            elif kind == "end":
                break
    return seen


async def watched_cycle(
    client: httpx.AsyncClient, csrf: str, watch: Watch, viewers: int
) -> tuple[float, list[Seen]]:
    """Drive one cycle with viewers; return the server's share of a core, and what they saw."""
    form = {"csrf": csrf, "cycle": "stair", "confirmed": "yes"}
    answer = await client.post("/axes/1/start", data=form)
    assert answer.status_code == 303, answer.text
    before_s, began_s = watch.cpu_s(), time.monotonic()
    looking = asyncio.create_task(watch.keep_looking())
    seen = await asyncio.gather(*(view(client) for _ in range(viewers)))
    share = (watch.cpu_s() - before_s) / (time.monotonic() - began_s)
    looking.cancel()
    with contextlib.suppress(asyncio.CancelledError):  # by the line above
        await looking
    return share, seen


def account(recording: Path, rate_hz: float) -> tuple[Acquisition, int]:
    """Return what became of a recording's frames, and how many points twenty a second are."""
    found = Metadata.loads(key_values(recording)[KEY.encode()], str(recording))
    counted = Acquisition.from_metadata(found.extra, str(recording))
    assert counted is not None
    if "stopped_because" in found.extra:
        print(f"    STOPPED EARLY: {found.extra['stopped_because']}", flush=True)
    return counted, int(pq.read_metadata(recording).num_rows / rate_hz * 20.0)


def said(accounts: list[Acquisition]) -> str:
    """Return the frames of recordings in words."""
    all_ = total(accounts)
    assert all_ is not None
    return (
        f"frames expected {all_.expected}, received {all_.received}, lost {all_.lost}, late "
        f"{all_.late}, not asked for in time {all_.not_asked}, longest gap "
        f"{1e3 * all_.longest_gap_s:.1f} ms"
    )


@contextlib.contextmanager
def site(folder: Path, rate_hz: float) -> Iterator[Path]:
    """Yield the description of a cell whose drive is simulated and runs."""
    cell, log = folder / "cell.toml", folder / "fake.log"
    asked: list[str | Path] = [
        "fake",
        "--write-cell",
        cell,
        "--short",
        "--bus-option",
        f"port={free_udp_port()}",
    ]
    with started(asked, log, ready="ready"):
        be_patient(cell)
        text = cell.read_text().replace("sample_rate_hz = 500.0", f"sample_rate_hz = {rate_hz}")
        cell.write_text(text)
        yield cell


def newest(cell: Path, before: set[Path]) -> Path:
    """Return the recording that was not there before."""
    (path,) = set((cell.parent / "recordings").glob("*.parquet")) - before
    return path


def control(cell: Path, cycles: int, rate_hz: float) -> None:
    """Drive cycles without any page, and print what became of their frames."""
    accounts = []
    for _ in range(cycles):
        before = set((cell.parent / "recordings").glob("*.parquet"))
        stribeck("run", cell, "--axis", "1", timeout_s=600.0)
        accounts.append(account(newest(cell, before), rate_hz)[0])
    print(f"no page, {cycles} cycle(s): {said(accounts)}", flush=True)


async def with_page(
    cell: Path, log: Path, pid: int, viewers: int, cycles: int, rate_hz: float
) -> None:
    """Let viewers watch cycles, and print what that costs and what became of the frames."""
    words = log.read_text()
    url = re.findall(r"(http://127\.0\.0\.1:\d+)/", words)[0]
    async with httpx.AsyncClient(
        base_url=url, limits=httpx.Limits(max_connections=None), timeout=60.0
    ) as client:
        token = re.findall(r"once: (\S+)", words)[0]
        data = {"token": token, "name": "eva", "password": PASSWORD, "again": PASSWORD}
        assert (await client.post("/welcome", data=data)).status_code == 303
        form = (await client.get("/axes/1/start")).text
        csrf = re.findall(r'name="csrf" value="([^"]+)"', form)[0]
        watch, accounts, shares, all_seen, missing = Watch(pid), [], [], [], 0
        for _ in range(cycles):
            before = set((cell.parent / "recordings").glob("*.parquet"))
            share, seen = await watched_cycle(client, csrf, watch, viewers)
            counted, points = account(newest(cell, before), rate_hz)
            accounts.append(counted)
            shares.append(share)
            all_seen += seen
            missing = max(missing, points - min(s.points for s in seen))
            await client.get(f"/results/{newest(cell, before).stem}")
            watch.look()
    rates = np.array([s.rate_hz for s in all_seen])
    print(
        f"{viewers} viewer(s), {cycles} cycle(s): {said(accounts)}\n"
        f"    server: {100.0 * max(shares):.1f} % of a core; memory at most "
        f"{max(watch.rss_mb):.0f} MB resident, {max(watch.pss_mb):.0f} MB proportional, "
        f"{max(watch.own_mb):.0f} MB its own; high-water mark with the log-in's hashing "
        f"{watch.highest_ever_mb():.0f} MB\n"
        f"    updates a second and viewer: median {np.median(rates):.1f}, least {rates.min():.1f}; "
        f"points that a viewer missed: {max(0, missing - 1)}",  # the last one is never complete
        flush=True,
    )


def main() -> None:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--viewers", type=int, nargs="+", default=[1, 50])
    parser.add_argument("--rate", type=float, default=500.0, help="samples a second")
    parser.add_argument("--cycles", type=int, default=1, help="of each kind")
    given = parser.parse_args()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        cell = stack.enter_context(site(folder, given.rate))
        print(f"{given.rate:g} samples a second", flush=True)
        control(cell, given.cycles, given.rate)
        for viewers in given.viewers:
            log = folder / f"serve-{viewers}.log"
            asked: list[str | Path] = [
                "serve",
                cell,
                "--port",
                "0",
                "--state",
                folder / f"state-{viewers}",
            ]
            with started(asked, log, ready="give it there") as server:
                asyncio.run(with_page(cell, log, server.pid, viewers, given.cycles, given.rate))


if __name__ == "__main__":
    main()
