"""How a bus is opened, and who may receive from it."""

from __future__ import annotations

import importlib
import inspect
import os
import socket
import sys
from typing import Any

import can
from can.interfaces import BACKENDS

from drivers.can.failures import OPENING_FAILURES, opening_failed
from drivers.can.frames import CanBusConfig
from drivers.can_reader import batches
from drivers.clock import Clock, MonotonicClock
from drivers.errors import BusError

_EVERY_GROUP = {  # linux/in.h and linux/in6.h; Python's `socket` does not name them
    socket.AF_INET: (socket.IPPROTO_IP, 49),  # IP_MULTICAST_ALL
    socket.AF_INET6: (socket.IPPROTO_IPV6, 29),  # IPV6_MULTICAST_ALL
}
_TOLD_BY_SIGNATURE = ("socketcan", "udp_multicast", "virtual", "slcan")


def open_bus(config: CanBusConfig) -> can.BusABC:
    """Open a bus with python-can.

    Raises
    ------
    BusError
        In one sentence why it does not open, and what to do.
    """
    refuse_elsewhere(config.interface)
    _refuse_unknown_options(config)
    arguments: dict[str, Any] = dict(config.options)
    if config.interface == "udp_multicast":
        # What moves a machine does not leave this computer unless the cell says so.
        arguments.setdefault("hop_limit", 0)
    if config.bitrate is not None:
        arguments["bitrate"] = config.bitrate
    try:
        if config.interface == "slcan":
            from drivers.can.slcan import SlcanBus  # pyserial, which other buses do not need

            return SlcanBus(channel=config.channel, **arguments)
        bus = can.Bus(
            interface=config.interface,
            channel=config.channel,
            ignore_config=True,
            **arguments,
        )
        if config.interface == "udp_multicast":
            _hear_one_group(bus)
        return bus
    except OPENING_FAILURES as error:
        raise opening_failed(error, config.interface, config.channel, config.bitrate) from error


def _hear_one_group(bus: can.BusABC) -> None:
    """Let a multicast bus hear its own group alone.

    Linux hands a socket what any group sends to its port that any program of the machine has joined
    (ip(7)): a second cell on another group would be heard here, and its drive's answers counted.
    """
    if sys.platform != "linux":
        return
    with socket.socket(fileno=os.dup(bus.fileno())) as shared:
        shared.setsockopt(*_EVERY_GROUP[shared.family], 0)
    while bus.recv(0.0) is not None:
        pass  # from before that


def refuse_elsewhere(interface: str) -> None:
    """Refuse an interface that this system has not, whoever asks for it.

    Raises
    ------
    BusError
        SocketCAN where there is none.
    """
    if interface == "socketcan" and not hasattr(socket, "AF_CAN"):
        raise BusError(
            f"SocketCAN is Linux's own; this is {sys.platform}.",
            "Take one of the interfaces that docs/adapters.md lists for it.",
        )


def _refuse_unknown_options(config: CanBusConfig) -> None:
    """Refuse an option that the interface would pass over in silence, as python-can does.

    Only where all of them are named in the interface's signature; vendors' adapters read others.
    """
    if not config.options or config.interface not in _TOLD_BY_SIGNATURE:
        return
    module, name = BACKENDS[config.interface]
    made_with = inspect.signature(getattr(importlib.import_module(module), name).__init__)
    known = sorted({*made_with.parameters} - {"self", "channel", "bitrate", "timing", "kwargs"})
    for option in config.options:
        if option not in known:
            raise BusError(
                f"The interface {config.interface} has no option {option!r}.",
                f"It has {', '.join(known)}; correct the bus in the cell description.",
            )


def may_read_fast(config: CanBusConfig, clock: Clock) -> bool:
    """Tell whether a process of its own may receive from this bus.

    SocketCAN on Linux with classic frames, unless the cell says no, and in real time: the machine's
    monotonic clock is the only one that two processes share.
    """
    return (
        config.fast_reader
        and config.interface == "socketcan"
        and not config.options.get("fd")
        and isinstance(clock, MonotonicClock)
        and batches.available()
    )
