"""A night from the PLC's permit to the verdict and the messages: real bytes on every line.

The PLC is a Modbus server, the receivers a web server and a mail server of this machine, the drive
answers real CAN frames. The night's child is called in this process, on the clock of the simulated
cell, so that no loaded machine can be what stops the cycle; `test_command` has it as a process.
"""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from typer.testing import CliRunner

from agent.cli.app import app
from agent.cli.night import child as night_child
from agent.cli.night.cell import CellAttempts
from agent.night.description import night_path
from agent.night.windows import Window
from agent.record.catalogue.catalogue import Catalogue
from agent.record.events_file import read_events
from agent.record.verdict_file import read_verdict
from fakes.modbus_server import TcpServer
from fakes.plc import DONE, HOLDING, INPUT, REQUEST, FakePlc
from tests.contract.modbus_rig import served
from tests.night.test_command import night_text
from tests.night.test_telling import Postman, Receiver, mail_server
from tests.servers import self_signed
from tests.system.rig import rig

WELL, BADLY = 1, 2
KINDS = ["run", "skip", "stopped", "failed"]


class WatchedPlc(FakePlc):
    """A PLC that keeps what it saw: the request, its permit, and what was handed back, in order."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: list[tuple[int, int, int]] = []

    def look(self) -> None:
        (request,) = self.registers.get(HOLDING, REQUEST, 1)
        (done,) = self.registers.get(HOLDING, DONE, 1)
        (permit,) = self.registers.get(INPUT, 0, 1)
        now = (request, permit, done)
        if not self.seen or self.seen[-1] != now:
            self.seen.append(now)


@pytest.fixture
def plc() -> Iterator[tuple[WatchedPlc, int]]:
    plc = WatchedPlc()
    server = TcpServer(plc.registers)
    with served(server, plc.look):
        yield plc, server.port


@contextmanager
def cell_of(
    tmp_path: Path, plc: WatchedPlc, port: int, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Path]:
    """Yield the description of a simulated cell that this PLC releases."""
    description: dict[str, Any] = {}

    def with_release(made: dict[str, Any]) -> None:
        made["axis"][0]["stair"] |= {"duration_s": 6.0, "speeds": 3}
        tcp = f"127.0.0.1:{port}"
        made["release"] = {"kind": "modbus", "tcp": tcp, "timeout_s": 0.2, "wait_s": 1.0}
        description.update(made)

    def in_this_process(attempts: CellAttempts, window: Window, said: Path, _talk: Path) -> str:
        before = {kind: signal.getsignal(kind) for kind in (signal.SIGINT, signal.SIGTERM)}
        try:
            night_child.main([str(attempts.path), str(window.axis), str(said)])
        finally:
            for kind, handler in before.items():
                signal.signal(kind, handler)
        return ""

    with rig(tmp_path, edit=with_release) as bench:
        bench.clock.attach(plc.step_to)
        monkeypatch.setattr("agent.cli.cycle.run.clock_for", lambda _cell: bench.clock)
        monkeypatch.setattr(CellAttempts, "_run", in_this_process)
        path = tmp_path / "cell.toml"
        path.write_text(tomli_w.dumps(description))
        yield path


def test_a_permit_is_asked_for_used_and_handed_back_and_everybody_is_told(
    tmp_path: Path, plc: tuple[WatchedPlc, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    postman = Postman()
    with ExitStack() as stack:
        cell = stack.enter_context(cell_of(tmp_path, *plc, monkeypatch))
        receiver = stack.enter_context(Receiver([200]).running())
        (tmp_path / "password").write_text("right")
        mail_port = stack.enter_context(mail_server(postman, self_signed(tmp_path)))
        hook = {"kind": "webhook", "url": receiver.url, "tell": KINDS}
        mail = {
            "kind": "email",
            "host": "localhost",
            "port": mail_port,
            "user": "stribeck",
            "password_file": "password",
            "ca_file": "cert.pem",
            "timeout_s": 20.0,
            "sender": "cell@example.org",
            "to": ["toni@example.org"],
            "tell": KINDS,
        }
        night_path(cell).write_text(night_text(notify=[hook, mail]))
        answer = CliRunner().invoke(app, ["night", str(cell), "--once"])
    assert answer.exit_code == 0, answer.output
    folder = tmp_path / "recordings"
    events = [event for _, event in read_events(folder)[0]]
    assert [e.kind for e in events] == ["night", "begun", "run"], answer.output
    # asked for, granted, driven, and handed back as ended well; never withdrawn meanwhile
    assert plc[0].seen[0] == (0, 0, 0)
    asked = [seen for seen in plc[0].seen if seen[0] or seen[2]]
    assert asked[0][:2] == (1, 0)
    assert asked[1] == (1, 1, 0)
    assert (asked[-1][0], asked[-1][2]) == (0, WELL)
    assert not any(done == BADLY for _request, _permit, done in asked)
    assert plc[0].withdrawn_for_silence == 0
    # the verdict is stored, and stands on the recording that was made
    (verdict_file,) = folder.glob("*.verdict.json")
    verdict = read_verdict(verdict_file)
    assert verdict.recording_sha256 == events[-1].recording
    with Catalogue(folder) as catalogue:
        assert [v.recording_sha256 for v in catalogue.verdicts()] == [events[-1].recording]
    # and both receivers know of it
    (posted,) = [json.loads(body) for _headers, body in receiver.requests]
    assert (posted["kind"], posted["text"]) == ("run", events[-1].text)
    assert [mail["Subject"] for mail in postman.mails] == ["simulated-joint axis 1: done"]


def test_a_permit_that_is_refused_is_a_skip_that_is_handed_back_too(
    tmp_path: Path, plc: tuple[WatchedPlc, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    plc[0].guard_closed = False
    with (
        cell_of(tmp_path, *plc, monkeypatch) as cell,
        Receiver([200]).running() as receiver,
    ):
        hook = {"kind": "webhook", "url": receiver.url, "tell": KINDS}
        night_path(cell).write_text(night_text(notify=[hook]))
        answer = CliRunner().invoke(app, ["night", str(cell), "--once"])
    assert answer.exit_code == 0, answer.output
    (posted,) = [json.loads(body) for _headers, body in receiver.requests]
    assert posted["kind"] == "skip"
    assert "a guard is open" in posted["text"]
    assert plc[0].seen[-1] == (0, 0, BADLY)
    assert not list((tmp_path / "recordings").glob("*.parquet"))
