"""What the page costs while a cycle runs: CPU time and memory of its process, updates that arrive.

``python -m tests.benchmarks.page [--viewers 1 50] [--seconds 20]``

A child that drives nothing writes a recording of 500 samples a second, as a cycle does; viewers of
this process take the stream that a browser takes. CPU time is the server's own, from the system's
account, so that other work on the machine does not count.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx
import numpy as np

RATE_HZ = 500.0
COLUMNS = ("time_s", "position_rad", "velocity_rad_s", "torque_nm", "velocity_command_rad_s",
           "position_command_rad", "phase", "gearbox_temperature_degc")  # fmt: skip


def serve(folder: Path) -> None:
    """Be the server: the page of a cell whose cycle is `cycle` below."""
    import uvicorn

    from agent.web.attended import Launch
    from agent.web.roles import Role
    from tests.web import bench

    made = bench.make(folder)
    command = (sys.executable, "-m", "tests.benchmarks.page", "--cycle", str(folder))
    launch = Launch(made.page.settings.state, made.page.settings.cell_path, command)
    made.page.attendant._launch = launch
    from drivers.clock import MonotonicClock

    made.page.attendant._clock = MonotonicClock()
    browser = made.browser(Role.ENGINEER)
    config = uvicorn.Config(made.page.app, port=0, log_level="warning", access_log=False)
    server = uvicorn.Server(config)

    async def say_when_ready() -> None:
        task = asyncio.create_task(server.serve())
        while not server.started:
            await asyncio.sleep(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        told = {"port": port, "cookie": browser.cookies["stribeck_session"], "csrf": browser.csrf}
        print(json.dumps(told), flush=True)
        await task

    asyncio.run(say_when_ready())


def cycle(folder: Path, progress: Path, seconds: float) -> None:
    """Be the cycle: write a recording in real time."""
    from agent.record.recording import Metadata
    from agent.record.stream import StreamWriter
    from drivers.clock import MonotonicClock

    clock = MonotonicClock()
    metadata = Metadata(robot="simulated-joint", axis=1, gear_ratio=224.0)
    with StreamWriter(
        folder / "recordings", "simulated-joint-axis1-live", metadata, COLUMNS, background=True
    ) as writer:
        began_s = clock.now()
        for i in range(int(seconds * RATE_HZ)):
            time_s = i / RATE_HZ
            wave = float(np.sin(time_s))
            writer.append(
                (time_s, 20.0 * wave, 80.0 * wave, wave, 80.0 * wave, 0.0, "steady", 25.0)
            )
            if i % 100 == 0:
                share = time_s / seconds
                progress.write_text(json.dumps({"stage": "stair", "share": share}))
            clock.sleep_until(began_s + time_s)


def cpu_s(pid: int) -> float:
    """Return the CPU time that a process has used, all its threads together."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mb(pid: int) -> tuple[float, float]:
    """Return a process's resident memory, and what of it is its own (the rest: library files)."""
    found = {}
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]:
        name, value = line.split()[:2]
        found[name.rstrip(":")] = int(value) / 1024.0
    return found["Rss"], found["Anonymous"]


async def viewer(
    client: httpx.AsyncClient, seconds: float, until_points: int = 1 << 30
) -> tuple[int, int]:
    """Watch for some seconds; return how many updates and points came."""
    updates = points = 0
    end_s = time.monotonic() + seconds
    async with client.stream("GET", "/run/live", timeout=None) as answer:
        async for line in answer.aiter_lines():
            if line.startswith("data: ["):
                updates += 1
                points += len(json.loads(line[6:])[1])
            if time.monotonic() > end_s or points >= until_points:
                break
    return updates, points


async def measure(told: dict[str, str], pid: int, viewers: int, seconds: float) -> None:
    """Start a cycle, let viewers watch it, print what it cost."""
    async with httpx.AsyncClient(
        base_url=f"http://127.0.0.1:{told['port']}",
        cookies={"stribeck_session": told["cookie"]},
        limits=httpx.Limits(max_connections=None),
    ) as client:
        form = {"csrf": told["csrf"], "cycle": "stair", "confirmed": "yes"}
        answer = await client.post("/axes/1/start", data=form)
        assert answer.status_code == 303, answer.text
        await viewer(client, 120.0, until_points=20)  # a loaded machine takes its time to begin
        before_s, began_s = cpu_s(pid), time.monotonic()
        seen = await asyncio.gather(*(viewer(client, seconds) for _ in range(viewers)))
        passed_s, used_s = time.monotonic() - began_s, cpu_s(pid) - before_s
        rss_mb, own_mb = memory_mb(pid)
        updates = np.array([u for u, _ in seen]) / passed_s
        print(
            f"{viewers:3d} viewers, {passed_s:.0f} s: {100.0 * used_s / passed_s:.1f} % of a core, "
            f"{rss_mb:.0f} MB resident ({own_mb:.0f} MB its own); updates a second and viewer: "
            f"median {np.median(updates):.1f}, least {updates.min():.1f}; points at least "
            f"{min(p for _, p in seen)}"
        )
        await client.post("/stop")
        while (await client.get("/status")).json()["active"]:
            await asyncio.sleep(0.1)


def main() -> None:
    """Parse, start the server, measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--viewers", type=int, nargs="+", default=[1, 50])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--serve", type=Path)
    parser.add_argument("--cycle", type=Path)
    known, rest = parser.parse_known_args()
    if known.serve is not None:
        serve(known.serve)
    elif known.cycle is not None:
        cycle(known.cycle, Path(rest[rest.index("--progress") + 1]), 120.0)
    else:
        for viewers in known.viewers:
            with tempfile.TemporaryDirectory() as folder:
                command = [sys.executable, "-m", "tests.benchmarks.page", "--serve", folder]
                with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
                    assert server.stdout is not None
                    told = json.loads(server.stdout.readline())
                    try:
                        asyncio.run(measure(told, server.pid, viewers, known.seconds))
                    finally:
                        server.terminate()


if __name__ == "__main__":
    main()
