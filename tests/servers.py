"""Real servers for tests, on this machine, as a user without rights, ended with their test."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

NOBODY = 65534
_POSTGRES = sorted(Path("/usr/lib/postgresql").glob("*/bin"))


@contextlib.contextmanager
def own_folder() -> Iterator[Path]:
    """Yield a folder that belongs to the user that servers run as."""
    folder = Path(tempfile.mkdtemp(prefix="stribeck-test-"))
    try:
        if os.geteuid() == 0:
            os.chown(folder, NOBODY, NOBODY)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def unprivileged(command: Sequence[str]) -> list[str]:
    """Return a command that runs as nobody where the tests run as root."""
    if os.geteuid() != 0:
        return list(command)
    user = [f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
    return ["setpriv", *user, *command]


def program(name: str, folders: Sequence[Path] = ()) -> str:
    """Return where a program is; the test is skipped, or fails in CI, where it is not."""
    path = ":".join([*map(str, folders), os.environ.get("PATH", ""), "/usr/sbin"])
    found = shutil.which(name, path=path)
    if found is None and os.environ.get("CI"):
        pytest.fail(f"{name} is not installed; .ci/run installs it")
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


@contextlib.contextmanager
def postgresql() -> Iterator[str]:
    """Yield the URL of an empty PostgreSQL on a socket of its own."""
    initdb = program("initdb", _POSTGRES)
    with own_folder() as folder:
        data = folder / "data"
        subprocess.run(
            unprivileged(
                [
                    initdb,
                    "-D",
                    str(data),
                    "-U",
                    "tester",
                    "-A",
                    "trust",
                    "--no-sync",
                    "--locale=C",
                    "--encoding=UTF8",
                ]
            ),
            check=True,
            capture_output=True,
            cwd=folder,
        )
        command = [program("postgres", _POSTGRES), "-D", str(data), "-k", str(folder)]
        command += ["-c", "listen_addresses=", "-c", "fsync=off"]
        with _running(command, folder, signal.SIGINT):
            _await(lambda: (folder / ".s.PGSQL.5432").exists() and _answers(folder))
            yield f"postgresql://tester:{secrets.token_hex(4)}@/postgres?host={folder}"


def _answers(folder: Path) -> bool:
    import psycopg

    try:
        psycopg.connect(host=str(folder), user="tester", dbname="postgres").close()
    except psycopg.OperationalError:
        return False
    return True


@contextlib.contextmanager
def mosquitto(
    *, password: tuple[str, str] | None = None, tls: tuple[Path, Path] | None = None
) -> Iterator[int]:
    """Yield the port of an MQTT broker; with a password, nobody else is let in; with TLS encrypted.

    Parameters
    ----------
    password : tuple of str, optional
        User and password.
    tls : tuple of Path, optional
        Key and certificate.
    """
    broker = program("mosquitto")
    with own_folder() as folder, socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = int(taken.getsockname()[1])
        taken.close()
        lines = [f"listener {port} 127.0.0.1", f"allow_anonymous {str(password is None).lower()}"]
        if password is not None:
            users = folder / "users"
            tool = program("mosquitto_passwd")
            subprocess.run([tool, "-b", "-c", str(users), *password], check=True)
            users.chmod(0o644)
            lines.append(f"password_file {users}")
        if tls is not None:
            for path in tls:
                (folder / path.name).write_bytes(path.read_bytes())
                (folder / path.name).chmod(0o644)
            lines += [f"keyfile {folder / tls[0].name}", f"certfile {folder / tls[1].name}"]
        config = folder / "mosquitto.conf"
        config.write_text("\n".join(lines) + "\n")
        with _running([broker, "-c", str(config)], folder, signal.SIGTERM):
            _await(lambda: _listens(port))
            yield port


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def self_signed(folder: Path) -> tuple[Path, Path]:
    """Return a key and a certificate for this machine that nobody vouches for."""
    key, certificate = folder / "key.pem", folder / "cert.pem"
    subprocess.run(
        [
            program("openssl"),
            "req",
            "-x509",
            "-newkey",
            "ec",
            "-pkeyopt",
            "ec_paramgen_curve:prime256v1",
            "-nodes",
            "-days",
            "2",
            "-subj",
            "/CN=localhost",
            "-addext",
            "subjectAltName=DNS:localhost,IP:127.0.0.1",
            "-keyout",
            str(key),
            "-out",
            str(certificate),
        ],
        check=True,
        capture_output=True,
    )
    return key, certificate


@contextlib.contextmanager
def _running(command: Sequence[str], folder: Path, end: signal.Signals) -> Iterator[None]:
    process = subprocess.Popen(
        unprivileged(command),
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.send_signal(end)
        process.wait(timeout=60.0)


def _await(ready: object, patience_s: float = 90.0) -> None:
    assert callable(ready)
    pause = threading.Event()
    for _ in range(int(patience_s / 0.02)):
        if ready():
            return
        pause.wait(0.02)
    raise AssertionError("the server does not answer")
