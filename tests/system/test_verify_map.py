"""`stribeck verify-map` as a user runs it, against a fake device on a real socket and a pty."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from agent.cli import main
from fakes.modbus_registers import Registers
from fakes.modbus_server import RtuServer, TcpServer
from tests.contract.modbus_rig import pty_pair, served
from tests.system.processes import stribeck

FAST = ("--rounds", "3", "--interval-s", "0.01")


def rtd_module(*channels: int) -> Registers:
    registers = Registers()
    registers.put(4, 1, *channels)
    return registers


def test_a_map_that_fits_is_said_to_fit_over_a_serial_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    registers = rtd_module(253, 254, 0x8000, 0x8000, 0x8000, 0x8000, 0)
    with pty_pair() as (descriptor, path), served(RtuServer(registers, descriptor)):
        place = ["--rtu", path, "--parity", "N"]
        monkeypatch.setattr(
            sys, "argv", ["stribeck", "verify-map", "modmux-pm6rtd", *place, *FAST, "--json"]
        )
        with pytest.raises(SystemExit) as ended:
            main()
    assert not ended.value.code
    document = json.loads(capsys.readouterr().out)
    assert document["plausible"]
    found = {r["register"]: r for r in document["registers"]}
    assert found["channel_1"]["value"] == pytest.approx(25.3)
    assert found["channel_3"]["finding"] == "no value"


def test_a_wrong_word_order_is_bad_news_with_its_cure(tmp_path: Path) -> None:
    registers = Registers()
    registers.put(4, 316, 0x0000, 0x41AC)  # 21.5 with the low word first
    path = tmp_path / "map.toml"
    path.write_text(
        'schema = "stribeck.registers/1"\ndevice = "robot"\nsource = "its manual"\n'
        'confirmed = "unconfirmed"\n[[register]]\nname = "joint_1"\naddress = 316\nfunction = 4\n'
        'type = "f32"\nunit = "degC"\nrange = [-20, 120]\nsentinels = [0.0]\n'
        '[[register]]\nname = "joint_9"\naddress = 400\nfunction = 4\n'
    )
    server = TcpServer(registers)
    with served(server):
        done = stribeck("verify-map", path, "--tcp", f"127.0.0.1:{server.port}", *FAST)
    assert done.returncode == 1, done.stderr
    assert 'with word_order = "low-first" it would be 21.5 degC' in done.stdout
    assert "joint_9" in done.stdout
    assert "it has no such address" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("verify-map", "modmux-pm6rtd"), 2, "--tcp HOST:PORT or --rtu PORT"),
        (("verify-map", "no-such-map", "--tcp", "127.0.0.1:1"), 3, "cannot be read"),
        (("verify-map", "jaka", "--tcp", "127.0.0.1:1", "--timeout-s", "0.2"), 4, "No connection"),
        (("verify-map", "jaka", "--tcp", "h:1", "--register", "x"), 3, "no register 'x'"),
    ],
)
def test_what_cannot_be_done_has_its_exit_code(
    arguments: tuple[str, ...],
    code: int,
    says: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, "argv", ["stribeck", *arguments])
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == code
    assert says in capsys.readouterr().err
