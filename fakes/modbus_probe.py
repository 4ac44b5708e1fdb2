"""A temperature transmitter that is not there: one Pt100 in Modbus registers, on TCP or RTU.

Input registers 0 to 3: tenths of a degree (signed), status (0 is good), and the same temperature
as float32, high word first. `python -m fakes.modbus_probe` is one on a free loopback port.
"""

from __future__ import annotations

import argparse
import math
import struct
import sys
import time
from collections.abc import Callable

from fakes.modbus_registers import Registers
from fakes.modbus_server import Server, TcpServer

TEMPERATURE, STATUS, TEMPERATURE_FLOAT = 0, 1, 2
NO_SENSOR = 0x8000
INPUT = 4

MAP = """schema = "stribeck.registers/1"
device = "simulated temperature transmitter"
source = "fakes/modbus_probe.py"
confirmed = "own"

[[register]]
name = "gearbox"
address = 0
function = 4
type = "i16"
unit = "degC"
scale = 0.1
range = [-40.0, 150.0]
sentinels = [-32768]
quality = { register = "status", good = [0] }

[[register]]
name = "status"
address = 1
function = 4

[[register]]
name = "gearbox_float"
address = 2
function = 4
type = "f32"
unit = "degC"
range = [-40.0, 150.0]
quality = { register = "status", good = [0] }
"""
"""The map that reads it."""


def warming(start_degc: float, rise_k: float, time_constant_s: float) -> Callable[[float], float]:
    """Return a temperature over time that rises towards its end as a heated lump does."""
    return lambda now_s: start_degc - rise_k * math.expm1(-now_s / time_constant_s)


class FakeTransmitter:
    """The transmitter's registers; the temperature is taken at each read.

    Parameters
    ----------
    degc : callable
        The true temperature now.

    Attributes
    ----------
    broken : bool
        The sensor is open: the sentinel is reported.
    status : int
        The status register; anything but 0 says that the value is not to be trusted.
    """

    def __init__(self, degc: Callable[[], float]) -> None:
        self.registers = Registers()
        self.broken = False
        self.status = 0
        self._degc = degc
        self.registers.before_read = self._refresh
        self._refresh()

    def _refresh(self) -> None:
        degc = self._degc()
        tenths = NO_SENSOR if self.broken else round(10.0 * degc) & 0xFFFF
        words = struct.unpack(">HH", struct.pack(">f", math.nan if self.broken else degc))
        self.registers.put(INPUT, TEMPERATURE, tenths, self.status, *words)


def main() -> None:
    """Serve on a loopback port until ended; the first line on stdout says which."""
    parser = argparse.ArgumentParser(description=FakeTransmitter.__doc__)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--start-degc", type=float, default=30.0)
    parser.add_argument("--rise-k", type=float, default=5.0)
    parser.add_argument("--time-constant-s", type=float, default=60.0)
    chosen = parser.parse_args()
    degc = warming(chosen.start_degc, chosen.rise_k, chosen.time_constant_s)
    began_s = time.perf_counter()
    fake = FakeTransmitter(lambda: degc(time.perf_counter() - began_s))
    server = TcpServer(fake.registers, chosen.port)
    sys.stdout.write(f"ready: 127.0.0.1:{server.port}\n")
    sys.stdout.flush()
    serve(server)


def serve(server: Server) -> None:
    """Serve until the process is ended."""
    try:
        while True:
            server.step(0.1)
    except KeyboardInterrupt:
        pass
    finally:
        server.close()


if __name__ == "__main__":
    main()
