"""`stribeck serve` as somebody starts it: refused in the clear, served over TLS, ended in order."""

from __future__ import annotations

import re
import shutil
import signal
import ssl
import subprocess
from pathlib import Path

import httpx
import pytest

from agent.cli.devices.fake_cell import fake_cell_text
from agent.cli.page.serve import run_serve
from agent.errors import InputError, StorageError
from agent.web.settings import PageSettings
from fakes.specification import FakeSpecification
from tests.system.processes import started


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    path = tmp_path / "cell.toml"
    path.write_text(
        fake_cell_text(FakeSpecification(), interface="udp_multicast", channel="239.74.163.9")
    )
    return path


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make a certificate with")
def test_it_serves_over_tls_and_ends_when_asked(cell: Path, tmp_path: Path) -> None:
    certificate, key, log = tmp_path / "c.pem", tmp_path / "k.pem", tmp_path / "log"
    make = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2"
    name = "-subj /CN=localhost -addext subjectAltName=DNS:localhost"
    subprocess.run(
        [*make.split(), *name.split(), "-keyout", key, "-out", certificate],
        check=True,
        capture_output=True,
    )
    options: list[str | Path] = ["--port", "0", "--tls-cert", certificate, "--tls-key", key]
    with started(["serve", cell, *options], log, ready="give it there") as server:
        port = re.search(r"https://127\.0\.0\.1:(\d+)/", log.read_text())
        assert port is not None
        trust = ssl.create_default_context(cafile=str(certificate))
        answer = httpx.get(f"https://localhost:{port[1]}/welcome", verify=trust, timeout=60.0)
        assert answer.status_code == 200
        assert "strict-transport-security" in answer.headers
        with pytest.raises(httpx.HTTPError):
            httpx.get(f"http://localhost:{port[1]}/welcome", timeout=60.0)
        server.send_signal(signal.SIGTERM)
        assert server.wait(60.0) in (0, -signal.SIGTERM)
    assert "Traceback" not in log.read_text()


def test_a_cell_that_cannot_be_read_and_a_port_that_is_taken_are_said_in_a_sentence(
    cell: Path, tmp_path: Path
) -> None:
    import socket

    with pytest.raises(InputError, match="cannot be read"):
        run_serve(PageSettings(tmp_path / "none.toml", tmp_path / "state"))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(StorageError, match="--port"):
            run_serve(PageSettings(cell, tmp_path / "state", port=port))
