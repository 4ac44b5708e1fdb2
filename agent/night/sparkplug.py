"""Sparkplug B payloads as bytes: the part of its protocol buffers that a publisher needs.

Source: Eclipse Sparkplug 3.0.0, section 6.4 (payloads) and appendix (`sparkplug_b.proto`): field
numbers and data types stand below. Encoding: Protocol Buffers, wire types 0 (varint), 1 (64 bit)
and 2 (length-delimited). Pure: values in, bytes out; nothing of it decodes, for nothing is ever
received.
"""

from __future__ import annotations

import datetime
import struct
from collections.abc import Sequence
from dataclasses import dataclass

NAMESPACE = "spBv1.0"

# Payload
_TIMESTAMP, _METRICS, _SEQ = 1, 2, 3
# Payload.Metric
_NAME, _STAMP, _DATATYPE, _IS_NULL, _PROPERTIES = 1, 3, 4, 7, 9
_LONG, _DOUBLE, _BOOLEAN, _STRING = 11, 13, 14, 15
# Payload.PropertySet, Payload.PropertyValue
_KEYS, _VALUES, _TYPE, _PROPERTY_STRING = 1, 2, 1, 8
# DataType
INT64, DOUBLE, BOOLEAN, STRING, DATE_TIME = 4, 10, 11, 12, 13

Value = bool | int | float | str | datetime.datetime


@dataclass(frozen=True)
class Metric:
    """One value with its name.

    Parameters
    ----------
    name : str
    datatype : int
        `INT64`, `DOUBLE`, `BOOLEAN`, `STRING` or `DATE_TIME`.
    value : bool, int, float, str, datetime.datetime or None
        None is sent as null: nobody knows.
    unit : str
        Sent as the property ``engUnit``; empty where there is none.
    """

    name: str
    datatype: int
    value: Value | None
    unit: str = ""

    def encoded(self, at_ms: int) -> bytes:
        """Return the metric's bytes, stamped with milliseconds since 1970 in UTC."""
        head = _text(_NAME, self.name) + _varint(_STAMP, at_ms) + _varint(_DATATYPE, self.datatype)
        properties = _unit(self.unit) if self.unit else b""
        return (
            head
            + (_varint(_IS_NULL, 1) if self.value is None else b"")
            + properties
            + self._value()
        )

    def _value(self) -> bytes:
        value = self.value
        if value is None:
            return b""
        if self.datatype == BOOLEAN and isinstance(value, bool):
            return _varint(_BOOLEAN, int(value))
        if self.datatype == STRING and isinstance(value, str):
            return _text(_STRING, value)
        if self.datatype == DATE_TIME and isinstance(value, datetime.datetime):
            return _varint(_LONG, milliseconds(value))
        if (
            self.datatype == DOUBLE
            and isinstance(value, int | float)
            and not isinstance(value, bool)
        ):
            return _key(_DOUBLE, 1) + struct.pack("<d", value)
        if self.datatype == INT64 and isinstance(value, int) and not isinstance(value, bool):
            return _varint(_LONG, value & 0xFFFF_FFFF_FFFF_FFFF)  # two's complement
        raise ValueError(f"{self.name}: {value!r} is not of data type {self.datatype}")


def payload(metrics: Sequence[Metric], at_ms: int, seq: int | None) -> bytes:
    """Return a payload.

    Parameters
    ----------
    metrics : sequence of Metric
    at_ms : int
        Milliseconds since 1970 in UTC.
    seq : int or None
        0 to 255, counted over a session's messages; None in a death, which has none.

    Raises
    ------
    ValueError
        A value that is not of its data type, or a number out of range.
    """
    if seq is not None and not 0 <= seq <= 255:
        raise ValueError(f"expected a sequence number from 0 to 255, got {seq}")
    inner = b"".join(_bytes(_METRICS, metric.encoded(at_ms)) for metric in metrics)
    return _varint(_TIMESTAMP, at_ms) + inner + (b"" if seq is None else _varint(_SEQ, seq))


def milliseconds(at: datetime.datetime) -> int:
    """Return a time as Sparkplug has it: milliseconds since 1970 in UTC."""
    return round(at.timestamp() * 1000.0)


def _unit(unit: str) -> bytes:
    value = _varint(_TYPE, STRING) + _text(_PROPERTY_STRING, unit)
    return _bytes(_PROPERTIES, _text(_KEYS, "engUnit") + _bytes(_VALUES, value))


def _key(field: int, wire_type: int) -> bytes:
    return _base128(field << 3 | wire_type)


def _varint(field: int, value: int) -> bytes:
    return _key(field, 0) + _base128(value)


def _text(field: int, value: str) -> bytes:
    return _bytes(field, value.encode())


def _bytes(field: int, value: bytes) -> bytes:
    return _key(field, 2) + _base128(len(value)) + value


def _base128(value: int) -> bytes:
    """Return a number as varint: seven bits a byte, the lowest first, the top bit: more follow."""
    if value < 0:
        raise ValueError(f"expected a number of 0 or more, got {value}")
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])
