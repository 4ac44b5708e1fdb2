"""Habits of pyserial 3.5 that the serial lines lean on: an upgrade must tell."""

from __future__ import annotations

import os
import pty
import time

import pytest
import serial  # type: ignore[import-untyped]  # pyserial has no types

from tests.contract.modbus_rig import pty_pair


def test_a_port_that_is_not_there_raises_an_oserror() -> None:
    with pytest.raises(OSError, match="No such file") as caught:
        serial.serial_for_url("/dev/no-such-line")
    assert isinstance(caught.value, serial.SerialException)


def test_exclusive_keeps_a_second_owner_out() -> None:
    with pty_pair() as (_, path):
        first = serial.serial_for_url(path, exclusive=True)
        with pytest.raises(serial.SerialException, match="exclusively lock"):
            serial.serial_for_url(path, exclusive=True)
        first.close()


def test_read_returns_what_there_is_at_its_time_out_and_raises_nothing() -> None:
    with pty_pair() as (descriptor, path):
        port = serial.serial_for_url(path, timeout=0.05)
        os.write(descriptor, b"ab")
        began = time.monotonic()
        assert port.read(10) == b"ab"
        assert time.monotonic() - began >= 0.04
        port.close()


def test_reset_input_buffer_throws_a_late_answer_away() -> None:
    with pty_pair() as (descriptor, path):
        port = serial.serial_for_url(path, timeout=0.05)
        os.write(descriptor, b"late")
        while port.in_waiting < 4:
            pass
        port.reset_input_buffer()
        assert port.read(1) == b""
        port.close()


def test_a_line_whose_other_end_is_gone_raises_an_oserror() -> None:
    ours, theirs = pty.openpty()
    port = serial.serial_for_url(os.ttyname(theirs), timeout=0.05)
    os.close(theirs)
    os.close(ours)
    with pytest.raises(OSError, match=r"."):
        port.read(1)
    port.close()
