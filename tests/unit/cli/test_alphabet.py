"""A report that is sent to a file on Windows is written, whatever its signs."""

from __future__ import annotations

import io
import sys

import pytest
import typer

from agent.cli.terminal.alphabet import say_in_any_alphabet


def test_what_the_systems_encoding_lacks_is_said_by_the_nearest_letters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(file, "cp1252", write_through=True))
    say_in_any_alphabet()
    typer.echo("friction −3.2 ± 0.4 % at 26 °C → oil … 節")
    assert file.getvalue().decode("cp1252").rstrip() == (
        "friction -3.2 ± 0.4 % at 26 °C -> oil … \\u7bc0"
    )
    with pytest.raises(UnicodeEncodeError):  # no letter at all, but a byte of a file's name
        typer.echo("\udce9")


def test_utf_8_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    file = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(file, "utf-8", write_through=True))
    say_in_any_alphabet()
    typer.echo("−3.2")
    assert file.getvalue().decode().rstrip() == "−3.2"
