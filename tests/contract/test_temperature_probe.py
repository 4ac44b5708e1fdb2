"""What a temperature probe promises, the same for every device behind it, with real bytes."""

from __future__ import annotations

import contextlib
import math
import secrets
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from drivers.can.owner import CanBusConfig, CanBusOwner
from drivers.cia404.rtd import RtdNode
from drivers.clock import Clock, MonotonicClock, SteppedClock
from drivers.errors import (
    AnswerError,
    BusError,
    ConfigurationError,
    DriverError,
    IdentityError,
    NodeMissingError,
    WorkerDiedError,
)
from drivers.modbus.connection import ModbusConnection, SerialEndpoint, TcpEndpoint
from drivers.modbus.device import MappedDevice
from drivers.modbus.map_file import parse_map
from drivers.modbus.probe import ModbusProbe
from drivers.polling import Poller
from drivers.ports import Quality, TemperatureProbe, TemperatureReading
from drivers.serial.line import SerialConfig, SerialLine
from drivers.serial.probe import AdamProbe
from fakes.can_rtd import FakeRtd
from fakes.modbus_probe import MAP, FakeTransmitter
from fakes.modbus_server import Misbehaviour, RtuServer, TcpServer
from fakes.process import open_bus
from fakes.serial_probe import FakeAdam
from tests.contract.modbus_rig import pty_pair, served, unhurried

PERIOD_S, TIMEOUT_S = 0.02, 0.3
ADAM_TIMEOUT_S = 1.0  # a thread answers, which a busy machine may hold up

pytestmark = pytest.mark.real_time


@dataclass
class Bench:
    """A probe, the temperature that it should find, and the ways to break its device."""

    probe: TemperatureProbe
    clock: Clock
    degc: list[float]
    silence: Callable[[bool], None]
    open_circuit: Callable[[], None]

    def settle(self, until: Callable[[TemperatureReading], bool]) -> TemperatureReading:
        """Let time pass until a reading is as expected."""
        end_s = self.clock.now() + 60.0
        while not until(reading := self.probe.latest()):
            assert self.clock.now() < end_s, reading
            self.clock.sleep_until(self.clock.now() + 0.005)
        return reading


@contextlib.contextmanager
def modbus_bench(kind: str, degc: list[float]) -> Iterator[Bench]:
    clock = MonotonicClock()
    fake = FakeTransmitter(lambda: degc[0])
    with contextlib.ExitStack() as stack:
        server: TcpServer | RtuServer
        endpoint: TcpEndpoint | SerialEndpoint
        if kind == "tcp":
            server = TcpServer(fake.registers)
            endpoint = TcpEndpoint("127.0.0.1", server.port)
        else:
            descriptor, path = stack.enter_context(pty_pair())
            server = RtuServer(fake.registers, descriptor)
            endpoint = SerialEndpoint(path, baudrate=115_200, parity="N")
        stack.enter_context(served(server))
        stack.enter_context(unhurried(server))
        device = MappedDevice(ModbusConnection(endpoint, clock), parse_map(MAP))
        probe = ModbusProbe(device, "gearbox", clock, period_s=PERIOD_S, timeout_s=TIMEOUT_S)
        stack.callback(probe.close)

        def silence(on: bool) -> None:
            server.misbehaviour = Misbehaviour("silent") if on else None

        yield Bench(probe, clock, degc, silence, lambda: setattr(fake, "broken", True))


@contextlib.contextmanager
def adam_bench(degc: list[float], *, checksum: bool = True) -> Iterator[Bench]:
    clock = MonotonicClock()
    with contextlib.ExitStack() as stack:
        descriptor, path = stack.enter_context(pty_pair())
        fake = FakeAdam(descriptor, lambda: degc[0], checksum=checksum)
        stack.enter_context(served(fake))
        probe = AdamProbe(
            SerialLine(SerialConfig(path), clock),
            clock,
            address=1,
            channel=2,
            checksum=checksum,
            period_s=PERIOD_S,
            timeout_s=ADAM_TIMEOUT_S,
        )
        stack.callback(probe.close)

        def silence(on: bool) -> None:
            fake.misbehaviour = "silent" if on else ""

        yield Bench(probe, clock, degc, silence, lambda: setattr(fake, "misbehaviour", "open"))


@dataclass
class Rtd:
    """A CiA 404 node on a virtual bus in simulated time."""

    fake: FakeRtd
    owner: CanBusOwner
    clock: SteppedClock
    probe: RtdNode


@contextlib.contextmanager
def rtd(degc: list[float], *, channel: int = 1) -> Iterator[Rtd]:
    clock, name = SteppedClock(), f"rtd-{secrets.token_hex(4)}"
    bus = open_bus("virtual", name)
    fake = FakeRtd(bus, lambda: degc[0])
    clock.attach(fake.step_to)
    owner = CanBusOwner.open(CanBusConfig("virtual", name), clock)
    probe = RtdNode(
        owner, clock, node_id=21, channel=channel, period_s=PERIOD_S, timeout_s=TIMEOUT_S
    )
    try:
        yield Rtd(fake, owner, clock, probe)
    finally:
        probe.close()
        owner.close()
        bus.shutdown()


@contextlib.contextmanager
def rtd_bench(degc: list[float]) -> Iterator[Bench]:
    with rtd(degc) as made:

        class Ticking:
            """The probe as the control tick uses it: the bus is polled before."""

            open, close = made.probe.open, made.probe.close

            def latest(self) -> TemperatureReading:
                made.owner.poll()
                return made.probe.latest()

        yield Bench(
            Ticking(),
            made.clock,
            degc,
            lambda on: setattr(made.fake, "silent", on),
            lambda: setattr(made.fake, "status", 0x03),
        )


@pytest.fixture(params=["tcp", "rtu", "adam", "cia404"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    degc = [-12.3]
    with contextlib.ExitStack() as stack:
        if request.param == "adam":
            yield stack.enter_context(adam_bench(degc))
        elif request.param == "cia404":
            yield stack.enter_context(rtd_bench(degc))
        else:
            yield stack.enter_context(modbus_bench(request.param, degc))


def test_open_takes_the_first_reading_and_says_what_the_device_is(bench: Bench) -> None:
    before_s = bench.clock.now()
    identity = bench.probe.open()
    reading = bench.probe.latest()
    assert identity["kind"] in ("modbus", "adam", "cia404")
    assert identity["where"]
    assert reading.quality is Quality.GOOD
    assert reading.degc == pytest.approx(-12.3)
    assert before_s <= reading.taken_s <= bench.clock.now()


def test_it_follows_the_temperature_without_being_waited_for(bench: Bench) -> None:
    bench.probe.open()
    first_s = bench.probe.latest().taken_s
    bench.degc[0] = 61.7
    reading = bench.settle(lambda r: r.degc == pytest.approx(61.7))
    assert reading.taken_s > first_s


def test_silence_ages_the_reading_says_why_and_passes(bench: Bench) -> None:
    bench.probe.open()
    bench.silence(True)
    reading = bench.settle(lambda r: bool(r.reason))
    assert reading.quality is Quality.GOOD  # it was good when it was taken, and says when
    assert "answer" in reading.reason
    assert not reading.reason.endswith(".")  # it stands in the middle of a sentence
    bench.silence(False)
    bench.degc[0] = 40.0
    assert not bench.settle(lambda r: r.degc == pytest.approx(40.0)).reason


def test_a_broken_sensor_is_never_a_number(bench: Bench) -> None:
    bench.probe.open()
    bench.open_circuit()
    reading = bench.settle(lambda r: r.quality is not Quality.GOOD)
    assert math.isnan(reading.degc)
    assert reading.reason


def test_nobody_there_is_refused_when_it_is_opened(bench: Bench) -> None:
    bench.silence(True)
    with pytest.raises(NodeMissingError):
        bench.probe.open()
    bench.probe.close()


@pytest.mark.parametrize(
    ("kind", "error"),
    [
        ("half", AnswerError),
        ("garbled", AnswerError),
        ("refuses", AnswerError),
        ("endless", AnswerError),
        ("silent", NodeMissingError),
    ],
)
def test_what_is_wrong_on_an_ascii_line_is_said(kind: str, error: type[DriverError]) -> None:
    clock = MonotonicClock()
    with pty_pair() as (descriptor, path):
        fake = FakeAdam(descriptor, lambda: 20.0)
        fake.misbehaviour = kind
        line = SerialLine(SerialConfig(path), clock)
        probe = AdamProbe(
            line, clock, address=1, channel=0, checksum=True, period_s=1.0, timeout_s=ADAM_TIMEOUT_S
        )
        with served(fake), pytest.raises(error):
            probe.open()
        probe.close()


def test_a_module_without_checksums_is_read_too() -> None:
    with adam_bench([25.0], checksum=False) as bench:
        bench.probe.open()
        assert bench.probe.latest().degc == 25.0


def test_a_line_that_is_not_there_is_said() -> None:
    line = SerialLine(SerialConfig("/dev/no-such-line"), MonotonicClock())
    with pytest.raises(BusError, match="cannot be opened"):
        line.ask(b"#010", MonotonicClock().now() + 0.1)


def test_a_node_of_another_profile_or_unit_or_without_a_sensor_is_refused() -> None:
    with rtd([20.0]) as made:
        made.fake.device_type = 0x0002_0192
        with pytest.raises(IdentityError, match="profile 402, expected 404"):
            made.probe.open()
        made.fake.device_type, made.fake.unit = 0x0002_0194, 0x00AC0000
        with pytest.raises(ConfigurationError, match="degrees Celsius"):
            made.probe.open()
    with rtd([20.0], channel=2) as made:
        made.probe.open()
        assert made.probe.latest().quality is Quality.ABSENT


def test_a_poller_that_dies_says_so_within_one_look() -> None:
    reads = 0

    def read(_deadline_s: float) -> int:
        nonlocal reads
        reads += 1
        if reads > 1:
            raise ZeroDivisionError("a bug")
        return 1

    died = threading.Event()
    poller = Poller(read, MonotonicClock(), period_s=0.001, timeout_s=0.1, name="the device")
    poller.start()
    for _ in range(6000):
        if not any("poller the device" in t.name for t in threading.enumerate()):
            died.set()
            break
        MonotonicClock().sleep_until(MonotonicClock().now() + 0.01)
    assert died.is_set()
    with pytest.raises(WorkerDiedError, match="Nobody reads the device any more"):
        poller.latest()
    poller.stop()
