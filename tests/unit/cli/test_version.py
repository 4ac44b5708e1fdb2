"""`stribeck --version` says what recordings say they were made with."""

from __future__ import annotations

from typer.testing import CliRunner

from agent.cli.app import app
from agent.wire.writing import software


def test_the_version_is_that_of_recordings() -> None:
    answer = CliRunner().invoke(app, ["--version"])
    assert answer.exit_code == 0
    assert answer.stdout == f"{software()}\n"


def test_it_is_asked_before_a_command_is_looked_for() -> None:
    answer = CliRunner().invoke(app, ["--version", "no-such-command"])
    assert (answer.exit_code, answer.stdout) == (0, f"{software()}\n")
