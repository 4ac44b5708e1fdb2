"""The running cycle as the page sees it: a stream that grows, a child, its stop, its lifeline."""

from __future__ import annotations

import asyncio
import json
import math
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from agent.cli.page.run import PROGRESS_BYTES, progress_file
from agent.record.recording import Metadata
from agent.record.streams.stream import StreamWriter
from agent.web.application import _lifespan
from agent.web.attended import AttendedRun
from agent.web.live import Live, plan_of, state_of
from agent.web.locks import holder
from agent.web.roles import Role
from agent.web.tail import POINT_PERIOD_S, Point, StreamTail, Thinner
from drivers.clock import MonotonicClock
from tests.web.bench import Bench

COLUMNS = (
    "time_s",
    "velocity_rad_s",
    "velocity_command_rad_s",
    "torque_nm",
    "position_rad",
    "phase",
)


def wait_until(true: Callable[[], object], timeout_s: float = 60.0) -> None:
    """Wait for another process."""
    clock, deadline_s = MonotonicClock(), time.monotonic() + timeout_s
    while not true():
        assert time.monotonic() < deadline_s
        clock.sleep_until(time.monotonic() + 0.02)


def row(i: int, rate_hz: float) -> tuple[float | str, ...]:
    time_s = i / rate_hz
    return (time_s, math.sin(time_s), 2.0, float(i % 2), 224.0 * time_s, "steady")


@pytest.mark.parametrize("rate_hz", [50.0, 333.0, 1000.0])
def test_a_stream_is_read_while_it_grows_and_thinned_to_twenty_a_second(
    tmp_path: Path, rate_hz: float
) -> None:
    metadata = Metadata(robot="r", axis=1, gear_ratio=224.0)
    thinner, points, rows = Thinner(), [], int(3 * rate_hz)
    with StreamWriter(tmp_path, "run", metadata, COLUMNS) as writer:
        tail = StreamTail(tmp_path / "run.arrows")
        for i in range(rows):
            writer.append(row(i, rate_hz))
            if i % 37 == 0:
                points += [p for more in tail.read() for p in thinner.points(more)]
        writer.finish(0)
        assert not (tmp_path / "run.arrows").exists()
        points += [p for more in tail.read() for p in thinner.points(more)]  # still readable
        tail.close()
    times = np.array([p.time_s for p in points])
    assert np.allclose(np.diff(times), POINT_PERIOD_S)
    assert times[-1] > 3.0 - 2.5 * POINT_PERIOD_S
    for point in points:
        assert abs(point.velocity_rad_s - math.sin(point.time_s)) <= POINT_PERIOD_S
        assert math.isnan(point.gearbox_temperature_degc)
    if rate_hz == 1000.0:
        assert [p.torque_nm for p in points] == pytest.approx([0.5] * len(points), abs=0.011)


@pytest.mark.real_time
def test_a_recorder_beside_fifty_viewers_loses_nothing_and_each_sees_every_point(
    bench: Bench,
) -> None:
    """The recorder's thread writes in real time; the page and fifty viewers read beside it."""
    rate_hz, rows, viewers = 500.0, 1000, 50
    run = started(bench)
    metadata = Metadata(robot="simulated-joint", axis=1, gear_ratio=224.0)
    live = Live(bench.page.attendant)
    bench.page.attendant._clock = MonotonicClock()

    def record() -> None:
        clock = MonotonicClock()
        with StreamWriter(bench.recordings, "run", metadata, COLUMNS, background=True) as writer:
            writer.append(row(0, rate_hz))
            wait_until(lambda: run._tail)  # a machine that stands still is not what is tested
            began_s = clock.now()
            for i in range(1, rows):
                writer.append(row(i, rate_hz))
                clock.sleep_until(began_s + i / rate_hz)
            writer.finish(0)
        run.ask_to_stop()

    async def watch() -> list[list[str]]:
        async def one() -> list[str]:
            return [event async for event in live.events(run, 0)]

        looking = asyncio.create_task(live.keep_looking())
        recording = asyncio.create_task(asyncio.to_thread(record))
        seen = await asyncio.gather(*(one() for _ in range(viewers)))
        await recording
        looking.cancel()
        return seen

    every = asyncio.run(watch())
    kept = pq.read_table(bench.recordings / "run.parquet")
    assert kept.num_rows == rows
    assert kept["time_s"].to_pylist() == [i / rate_hz for i in range(rows)]
    points = round(rows / rate_hz / POINT_PERIOD_S) - 1  # the last one is not whole
    for events in every:
        told = [json.loads(e.partition("data: ")[2])[1] for e in events if "event: points" in e]
        times = [point[0] for batch in told for point in batch]
        assert times == [pytest.approx((i + 0.5) * POINT_PERIOD_S, abs=1e-3) for i in range(points)]


def test_half_a_batch_is_waited_for(tmp_path: Path) -> None:
    metadata = Metadata(robot="r", axis=1, gear_ratio=224.0)
    with StreamWriter(tmp_path, "run", metadata, COLUMNS) as writer:
        for i in range(200):
            writer.append(row(i, 100.0))
        writer.flush()
        content = (tmp_path / "run.arrows").read_bytes()
    torn = tmp_path / "torn.arrows"
    torn.write_bytes(b"")
    tail, seen = StreamTail(torn), 0
    with torn.open("ab") as file:
        for start in range(0, len(content), 501):
            file.write(content[start : start + 501])
            file.flush()
            seen += sum(len(rows["time_s"]) for rows in tail.read())
    tail.close()
    assert seen == 200


def started(bench: Bench) -> AttendedRun:
    browser = bench.browser(Role.TECHNICIAN)
    answer = browser.post("/axes/1/start", {"cycle": "stair", "confirmed": "yes"})
    assert answer.headers["location"] == "/run", answer.text
    run = bench.page.attendant.run
    assert run is not None

    def on_the_way() -> bool:
        bench.page.attendant.look()
        return run.stage == "stair"

    wait_until(on_the_way)
    return run


def ended(bench: Bench, run: AttendedRun) -> None:
    def over() -> bool:
        bench.page.attendant.look()
        return run.ended is not None

    wait_until(over)


def test_a_cycle_is_started_watched_and_stopped_by_anybody(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONIOENCODING", "cp1252")  # what a pipe has on a western Windows
    run = started(bench)
    state = state_of(run)
    assert (state["stage"], state["steps"]) == ("stair", 10)
    assert 0 < state["step"] < 10
    assert state["left_s"] == pytest.approx(0.5 * run.trajectory.duration_s, abs=0.1)
    nobody = bench.browser(None)
    assert nobody.get("/status").json() == {"active": True, "axis": 1, "stopping": False}
    assert nobody.post("/stop").headers["location"] == "/stopped"
    ended(bench, run)
    assert run.ended is not None
    assert run.ended.code == 5
    assert "at rest (measured), at 26 °C" in nobody.get("/stopped").text
    assert "at rest (measured)" in bench.browser(Role.VIEWER).get("/run").text
    assert nobody.get("/status").json() == {"active": False}
    trail = [(e.who, e.what) for e in bench.page.audit.newest(2)]
    assert trail == [("nobody", "stop"), ("toni", "start")]


def test_one_cycle_at_a_time_confirmed_and_only_where_nothing_refuses(bench: Bench) -> None:
    browser = bench.browser(Role.TECHNICIAN)
    assert browser.post("/axes/1/start", {"cycle": "stair"}).status_code == 422
    assert browser.post("/axes/1/start", {"cycle": "jump", "confirmed": "yes"}).status_code == 404
    assert browser.post("/axes/9/start", {"cycle": "stair", "confirmed": "yes"}).status_code == 404
    cell = bench.page.settings.cell_path
    good = cell.read_text()
    cell.write_text(good.replace("commissioned = true", "commissioned = false"))
    refused = browser.post("/axes/1/start", {"cycle": "stair", "confirmed": "yes"})
    assert refused.status_code == 409
    assert "not commissioned" in refused.text
    cell.write_text(good)
    run = started(bench)
    again = browser.post("/axes/1/start", {"cycle": "stair", "confirmed": "yes"})
    assert again.status_code == 409
    bench.page.attendant.stop()
    ended(bench, run)


def test_a_page_of_another_site_stops_nothing_and_every_page_of_ours_does(bench: Bench) -> None:
    run = started(bench)
    foreign = bench.browser(None)
    foreign.headers = {"sec-fetch-site": "cross-site"}
    assert foreign.post("/stop").status_code == 403
    assert run.process.poll() is None
    assert not run.stopping
    ours = bench.browser(None)
    ours.headers = {"sec-fetch-site": "same-origin"}
    assert ours.post("/stop").status_code == 303
    ended(bench, run)


def test_viewers_get_plan_points_and_end_and_go_on_where_they_were(bench: Bench) -> None:
    run = started(bench)
    bench.page.attendant.stop()
    ended(bench, run)
    thinned = Thinner()
    run.points += _points(thinned)
    live = Live(bench.page.attendant)
    live._take(run)

    async def all_events(seen: int) -> list[str]:
        return [event async for event in live.events(run, seen)]

    plan, points, end = asyncio.run(all_events(0))
    assert json.loads(plan.partition("data: ")[2]) == plan_of(run)
    told = json.loads(points.partition("data: ")[2])[1]
    assert len(told) == len(run.points)
    time_s, velocity, command, torque, arm_deg, temperature = told[-1]
    assert time_s == pytest.approx(run.points[-1].time_s, abs=1e-3)
    assert velocity == pytest.approx(run.points[-1].velocity_rad_s, rel=1e-3)
    assert (command, temperature) == (2.0, None)
    assert torque == pytest.approx(0.5, abs=0.2)
    assert arm_deg == pytest.approx(math.degrees(run.points[-1].position_rad / 224.0), rel=1e-3)
    assert end.startswith("event: end")
    later = asyncio.run(all_events(len(told) - 2))[1]
    assert len(json.loads(later.partition("data: ")[2])[1]) == 2


def _points(thinner: Thinner) -> list[Point]:
    rows = [row(i, 100.0) for i in range(300)]
    return thinner.points(dict(zip(COLUMNS, map(list, zip(*rows, strict=True)), strict=True)))


def test_a_server_that_ends_stops_its_cycle_and_waits_for_rest(bench: Bench) -> None:
    run = started(bench)

    async def serve_and_end() -> None:
        async with _lifespan(bench.page.app):
            await asyncio.sleep(0.1)

    asyncio.run(serve_and_end())
    assert run.process.poll() == 5


LIFELINE = """
import signal, sys, threading
from agent.cli.page.run import _hold_lifeline
asked = threading.Event()
threading.Thread(target=_hold_lifeline, daemon=True).start()
print("early", flush=True)
threading.Event().wait(0.3)  # what has no handler yet is not killed by the default one
signal.signal(signal.SIGHUP, lambda *_: asked.set())
print("ready", flush=True)
sys.exit(5 if asked.wait(60.0) else 0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("word", ["early", "ready"])
def test_a_cycle_whose_page_has_died_asks_itself_to_stop(word: str) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", LIFELINE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        while child.stdout.readline().strip() != word:
            assert child.poll() is None
        child.stdin.close()  # what the system does for a page that was killed
        assert child.wait(60.0) == 5


def test_progress_is_one_small_file_that_is_always_whole(tmp_path: Path) -> None:
    path = tmp_path / "progress"
    with progress_file(path) as tell:
        for i in range(5000):  # a control loop pays for one assignment
            tell("approach", i / 5000)
        assert path.stat().st_size == PROGRESS_BYTES
        json.loads(path.read_text())
        tell("disable", 1.0)
    assert json.loads(path.read_text()) == {"stage": "disable", "share": 1.0}


def test_looking_who_holds_an_axis_does_not_hold_it(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from agent.cycle.axis_lock import lock_folder, lock_names, owned

    monkeypatch.setenv("STRIBECK_LOCK_FOLDER", str(tmp_path))  # other tests have left theirs
    cell = bench.page.cell
    axis = cell.axis[0]
    assert holder(cell, axis) == ""
    assert not any((lock_folder() / f"stribeck.{n}.lock").exists() for n in lock_names(cell, axis))
    code = (
        "import sys; from pathlib import Path; from agent.cell.cell import read_cell\n"
        "from agent.cycle.axis_lock import owned; cell = read_cell(Path(sys.argv[1]))\n"
        "with owned(cell, cell.axis[0]) as free: print(free.holds, flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(bench.page.settings.cell_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline().strip() == "True"
        assert f"process {other.pid}" in holder(cell, axis)
        conditions = bench.browser(Role.TECHNICIAN).get("/axes/1/preconditions").text
        assert f"process {other.pid}" in conditions
        other.communicate("")
    assert holder(cell, axis) == ""
    with owned(cell, axis) as free:
        assert free.holds


def test_the_stop_reaches_a_cycle_that_another_program_has_started(bench: Bench) -> None:
    code = (
        "import sys, signal; from pathlib import Path; from agent.cell.cell import read_cell\n"
        "from agent.cycle.axis_lock import owned; cell = read_cell(Path(sys.argv[1]))\n"
        "with owned(cell, cell.axis[0]):\n"
        "    print('held', flush=True)\n"
        "    print(signal.sigwait([signal.SIGINT]), flush=True)"
    )
    block = "import signal; signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])\n"
    with subprocess.Popen(
        [sys.executable, "-c", block + code, str(bench.page.settings.cell_path)],
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline().strip() == "held"
        nobody = bench.browser(None)
        assert nobody.get("/status").json() == {"active": True, "axis": 1}
        assert 'data-running="yes"' in nobody.get("/login").text
        assert nobody.post("/stop").status_code == 303
        assert other.wait(60.0) == 0
    assert nobody.get("/status").json() == {"active": False}
    assert bench.page.audit.newest(1)[0].detail["of"].startswith(f"process {other.pid}")


def test_a_stop_is_told_as_one_whatever_else_is_broken(bench: Bench) -> None:
    run = started(bench)
    bench.page.settings.cell_path.write_text("[[ not TOML")
    (bench.page.settings.state / "audit.jsonl").write_text("no trail\n")
    nobody = bench.browser(None)
    assert nobody.get("/status").json()["active"] is True
    assert nobody.post("/stop").status_code == 303
    ended(bench, run)
    assert "at rest (measured)" in nobody.get("/stopped").text
