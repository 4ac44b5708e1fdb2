"""docs/adapters.md against python-can: every interface is in it, and says why it does not open."""

from __future__ import annotations

import re
import sys

import can
import pytest
import serial  # type: ignore[import-untyped]  # pyserial has no types

from agent.cell.cell import REPLAY
from drivers.can.frames import CanBusConfig
from drivers.can.opening import open_bus
from drivers.errors import BusError, words_of
from tests.conftest import REPOSITORY

ANSWERS = {"yes", "no", "not known"}
OF_ANOTHER_PLATFORM = re.compile(r"windows|windll|platform|HRESULT|pythoncom", re.IGNORECASE)
NO_CHANNEL = "no-such-channel"


def table() -> list[tuple[str, dict[str, str]]]:
    """Return each row's interface with its three platforms."""
    text = (REPOSITORY / "docs" / "adapters.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([^|]+) \| ([^|]+) \| ([^|]+) \|", text, re.MULTILINE)
    return [(row[0], dict(zip(("linux", "win32", "darwin"), row[1:], strict=True))) for row in rows]


def test_every_interface_is_in_the_table_once() -> None:
    rows = table()
    assert sorted(name for name, _ in rows) == sorted([*can.VALID_INTERFACES, REPLAY])
    assert all(set(platforms.values()) <= ANSWERS for _, platforms in rows)


def refusal(name: str) -> BusError | None:
    """Return why this interface does not open here; None where it does, as a virtual one may."""
    options = {"sleep_after_open": 0.0} if name == "slcan" else {}
    try:
        open_bus(CanBusConfig(name, NO_CHANNEL, 500_000, options)).shutdown()
    except BusError as error:
        return error
    return None


@pytest.mark.parametrize("name", sorted(can.VALID_INTERFACES))
def test_an_adapter_that_is_not_there_says_so_in_one_sentence(name: str) -> None:
    here = dict(table())[name].get(sys.platform)
    error = refusal(name)
    if error is None:
        assert here == "yes"
        return
    assert any(word in error.what for word in (name, NO_CHANNEL, "SocketCAN"))
    assert error.what.endswith(".")
    assert error.do
    if OF_ANOTHER_PLATFORM.search(error.what):
        assert here == "no"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (  # pyserial's on Windows, and on Linux
            serial.SerialException(
                "could not open port 'COM9': FileNotFoundError(2, 'The system cannot find the file "
                "specified.', None, 2)"
            ),
            "could not open port 'COM9': The system cannot find the file specified",
        ),
        (
            serial.SerialException(
                2, "could not open port COM9: [Errno 2] No such file or directory: 'COM9'"
            ),
            "could not open port COM9: No such file or directory: 'COM9'",
        ),
        (ConnectionRefusedError(111, "Connection refused"), "Connection refused"),
        (TimeoutError(), "TimeoutError"),
    ],
)
def test_what_a_library_says_is_told_without_numbers_and_pythons_words(
    error: Exception, words: str
) -> None:
    assert words_of(error) == words
