"""A cell's PLC that is not there: a permit over Modbus, or a release contact on CAN.

`python -m fakes.plc` is one on a free loopback port. The register numbers are those of the
handshake in docs/modbus.md, written down here a second time on purpose.
"""

from __future__ import annotations

import argparse
import sys
import time

import can

from fakes.modbus_registers import Registers
from fakes.modbus_server import TcpServer
from fakes.process import LateClock

HOLDING, INPUT = 3, 4
REQUEST, AGENT_ALIVE, DONE = 0, 1, 2
GUARD_OPEN, AGENT_GONE = 1, 5
CYCLE_S = 0.02
AGENT_TIMEOUT_S = 2.0
CONTACT_PERIOD_S = 0.05


class FakePlc:
    """Gives the permit when it is asked for, the guard is closed, and the agent is alive.

    Attributes
    ----------
    guard_closed : bool
        Open: no permit, whoever asks.
    hangs : bool
        Its program stands still: the count does, and so does the permit.
    withdrawn_for_silence : int
        How often the agent's count stood still for too long while it had the permit.
    """

    def __init__(self) -> None:
        self.registers = Registers()
        self.registers.put(HOLDING, 0, 0, 0, 0)
        self.registers.put(INPUT, 0, 0, 0, 0)
        self.guard_closed = True
        self.hangs = False
        self.withdrawn_for_silence = 0
        self._alive = 0
        self._next_s: float | None = None
        self._agent_count = -1
        self._agent_s = 0.0
        self._granted = False

    def step_to(self, now_s: float) -> None:
        """Run the program's cycle as often as it is due; a late caller gets one."""
        if self._next_s is None:
            self._next_s = now_s
        if now_s < self._next_s or self.hangs:
            return
        self._next_s = now_s + CYCLE_S
        self._alive = self._alive + 1 & 0xFFFF
        request, count = self.registers.get(HOLDING, REQUEST, 2)
        if count != self._agent_count:
            self._agent_count, self._agent_s = count, now_s
        gone = now_s - self._agent_s > AGENT_TIMEOUT_S
        granted = bool(request) and self.guard_closed and not gone
        if self._granted and gone and request:
            self.withdrawn_for_silence += 1
        self._granted = granted
        refusal = 0
        if request and not granted:
            refusal = AGENT_GONE if gone else GUARD_OPEN
        self.registers.put(INPUT, 0, int(granted), self._alive, refusal)


class FakeContact:
    """A CiA 401 node whose first input is the cell's release; it sends by its event timer.

    Parameters
    ----------
    bus : can.BusABC
        Where it speaks; it belongs to the caller.
    node_id, bit : int
        1 to 127; the input, from 0.

    Attributes
    ----------
    closed : bool
        The contact.
    unplugged : bool
        Nothing is sent.
    """

    def __init__(self, bus: can.BusABC, *, node_id: int = 31, bit: int = 0) -> None:
        self.closed = True
        self.unplugged = False
        self._bus = bus
        self._cob_id = 0x180 + node_id
        self._bit = bit
        self._next_s = 0.0

    def step_to(self, now_s: float) -> None:
        """Send the inputs when it is time; what others send is not its business."""
        while self._bus.recv(0.0) is not None:
            pass
        if now_s < self._next_s or self.unplugged:
            return
        self._next_s = now_s + CONTACT_PERIOD_S
        data = bytes([self.closed << self._bit])
        self._bus.send(can.Message(arbitration_id=self._cob_id, data=data, is_extended_id=False))


def main() -> None:
    """Be a PLC in real time until ended; the first line on stdout says where."""
    parser = argparse.ArgumentParser(description=FakePlc.__doc__)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--open-guard-after-s", type=float, default=float("inf"))
    chosen = parser.parse_args()
    plc, clock = FakePlc(), LateClock()
    server = TcpServer(plc.registers, chosen.port)
    sys.stdout.write(f"ready: 127.0.0.1:{server.port}\n")
    sys.stdout.flush()
    try:
        while True:
            server.step(0.005)
            now_s = clock.now(time.perf_counter())
            plc.guard_closed = now_s < chosen.open_guard_after_s
            plc.step_to(now_s)
    except KeyboardInterrupt:
        pass
    finally:
        server.close()


if __name__ == "__main__":
    main()
