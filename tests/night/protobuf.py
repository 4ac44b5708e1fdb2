"""Protocol Buffers read without a schema: which field numbers hold what, to check an encoder by."""

from __future__ import annotations

import struct
from typing import Any


def fields(data: bytes) -> list[tuple[int, Any]]:
    """Return (field number, value): int for varints, float for 64 bit, bytes otherwise."""
    found: list[tuple[int, Any]] = []
    at = 0
    while at < len(data):
        key, at = varint(data, at)
        number, wire_type = key >> 3, key & 7
        value: Any
        if wire_type == 0:
            value, at = varint(data, at)
        elif wire_type == 1:
            (value,) = struct.unpack_from("<d", data, at)
            at += 8
        elif wire_type == 2:
            length, at = varint(data, at)
            value = data[at : at + length]
            assert len(value) == length, "cut short"
            at += length
        else:
            raise AssertionError(f"wire type {wire_type}")
        found.append((number, value))
    return found


def varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if not byte & 0x80:
            return value, at


def metrics(payload: bytes) -> dict[str, dict[int, Any]]:
    """Return a Sparkplug payload's metrics by name, each as field number to value."""
    inner = [dict(fields(value)) for number, value in fields(payload) if number == 2]
    return {metric[1].decode(): metric for metric in inner}
