"""A fake slcan adapter on a pty pair before a virtual bus, served by a thread of the test's own."""

from __future__ import annotations

import contextlib
import secrets
from collections.abc import Iterator
from dataclasses import dataclass

import can

from drivers.can.frames import CanBusConfig
from fakes.process import open_bus
from fakes.slcan_adapter import FakeSlcanAdapter
from tests.contract.modbus_rig import pty_pair, served


@dataclass
class Plugged:
    """An adapter, how it is reached, and the name of the virtual bus behind it."""

    adapter: FakeSlcanAdapter
    config: CanBusConfig
    channel: str
    lifeline: contextlib.ExitStack

    def unplug(self) -> None:
        """Pull it out: both ends of the line are closed."""
        self.lifeline.close()


@contextlib.contextmanager
def plugged_in() -> Iterator[Plugged]:
    """Yield an adapter until the block ends, or it is unplugged."""
    channel = f"slcan-{secrets.token_hex(4)}"
    with contextlib.ExitStack() as lifeline:
        bus = open_bus("virtual", channel)
        lifeline.callback(bus.shutdown)
        descriptor, path = lifeline.enter_context(pty_pair())
        adapter = FakeSlcanAdapter(descriptor, bus)
        lifeline.enter_context(served(adapter))
        config = CanBusConfig("slcan", path, 1_000_000, options={"sleep_after_open": 0.0})
        yield Plugged(adapter, config, channel, lifeline)


def ear(plugged: Plugged) -> can.BusABC:
    """Return another end of the bus behind the adapter; the caller shuts it down."""
    return open_bus("virtual", plugged.channel)
