"""A master for the fake drive's tests: raw frames and stepped time, nothing of the product."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import can

from fakes.can_drive import FakeDrive
from fakes.fault import Fault
from fakes.specification import FakeSpecification

COUNTS_PER_RAD = 65536 / (2.0 * math.pi)
MASTER = 0x7E


class Frame(NamedTuple):
    """What was heard: identifier and bytes."""

    cob_id: int
    data: bytes


class Answer(NamedTuple):
    """The two TPDOs of `Bench.operate`, decoded, in the fake's units."""

    status: int
    torque_nm: float
    position_rad: float
    velocity_rad_s: float
    temperature_degc: float


class Bench:
    """The fake on one end of a virtual bus, the test on the other."""

    def __init__(self, bus: can.BusABC, drive: FakeDrive) -> None:
        self.bus = bus
        self.drive = drive
        self.now_s = 100.0  # the fake must take its origin from the first call
        self.controlword = 0
        self.heartbeat_s = math.inf
        self._beaten_s = -math.inf
        self.heard: list[Frame] = []

    def send(self, cob_id: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=cob_id, is_extended_id=False, data=data))

    def step(self, dt_s: float = 0.0) -> list[Frame]:
        """Move time and return every frame that the fake sent."""
        self.now_s += dt_s
        if self.now_s - self._beaten_s >= self.heartbeat_s:
            self._beaten_s = self.now_s
            self.send(0x700 + MASTER, b"\x05")
        self.drive.step_to(self.now_s)
        frames = []
        while (message := self.bus.recv(0.0)) is not None:
            frames.append(Frame(message.arbitration_id, bytes(message.data)))
        self.heard += frames
        return frames

    def run(self, seconds: float, dt_s: float = 0.001) -> list[Frame]:
        """Step for a while without SYNC."""
        return [f for _ in range(round(seconds / dt_s)) for f in self.step(dt_s)]

    def request(self, data: bytes) -> bytes | None:
        """Send one SDO request and return the answer, if there is one."""
        self.send(0x600 + self.drive.node_id, data)
        answers = [f.data for f in self.step() if f.cob_id == 0x580 + self.drive.node_id]
        assert len(answers) <= 1
        return answers[0] if answers else None

    def write(self, index: int, subindex: int, value: int, size: int) -> int:
        """Write by expedited SDO; return the abort code, 0 when it was taken."""
        data = value.to_bytes(size, "little", signed=value < 0).ljust(4, b"\0")
        header = struct.pack("<BHB", 0x23 | (4 - size) << 2, index, subindex)
        answer = self.request(header + data)
        assert answer is not None
        return 0 if answer[0] == 0x60 else abort_code(answer)

    def read(self, index: int, subindex: int = 0) -> int:
        """Read an unsigned number by expedited SDO; the test fails on an abort."""
        answer = self.request(struct.pack("<BHB4x", 0x40, index, subindex))
        assert answer is not None
        assert answer[0] & 0xF0 == 0x40, f"abort 0x{abort_code(answer):08X}"
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little")

    def read_abort(self, index: int, subindex: int = 0) -> int:
        """Return the abort code of an upload that must be refused."""
        answer = self.request(struct.pack("<BHB4x", 0x40, index, subindex))
        assert answer is not None
        return abort_code(answer)

    def nmt(self, command: int) -> list[Frame]:
        self.send(0x000, bytes([command, self.drive.node_id]))
        return self.step()

    def map(self, communication: int, cob_id: int, kind: int, entries: Iterable[int]) -> None:
        """Map a PDO in the order that drives accept."""
        raw = list(entries)
        writes = [(communication, 1, cob_id | 0x80000000, 4), (communication + 0x200, 0, 0, 1)]
        writes += [(communication + 0x200, i, e, 4) for i, e in enumerate(raw, 1)]
        writes += [(communication + 0x200, 0, len(raw), 1), (communication, 2, kind, 1)]
        writes.append((communication, 1, cob_id, 4))
        for index, subindex, value, size in writes:
            assert self.write(index, subindex, value, size) == 0, f"0x{index:04X}:{subindex}"

    def operate(self, kind: int = 1) -> None:
        """Map set-point, measurement and temperature, and start the node."""
        node = self.drive.node_id
        self.map(0x1400, 0x200 + node, kind, [0x60400010, 0x60FF0020])
        self.map(0x1800, 0x180 + node, 1, [0x60410010, 0x60770010, 0x60640020])
        self.map(0x1801, 0x280 + node, 1, [0x606C0020, 0x21000110])
        self.nmt(0x01)

    def sync(self, velocity_rad_s: float = 0.0, dt_s: float = 0.001) -> list[Frame]:
        """Send set-point and SYNC after `dt_s`; return what the fake sent."""
        target = round(velocity_rad_s * COUNTS_PER_RAD)
        before = self.step(dt_s)
        data = struct.pack("<Hi", self.controlword, target)
        self.send(0x200 + self.drive.node_id, data)
        self.send(0x080, b"")
        return before + self.step()

    def cycle(self, velocity_rad_s: float = 0.0, dt_s: float = 0.001) -> Answer:
        """Do one SYNC cycle and return the decoded answer."""
        frames = dict(self.sync(velocity_rad_s, dt_s))
        node = self.drive.node_id
        status, torque, counts = struct.unpack("<Hhi", frames[0x180 + node])
        velocity, decidegrees = struct.unpack("<ih", frames[0x280 + node])
        rated_nm = self.drive.specification.drive.rated_torque_mnm * 1e-3
        return Answer(
            status=status,
            torque_nm=torque * 1e-3 * rated_nm,
            position_rad=counts / COUNTS_PER_RAD,
            velocity_rad_s=velocity / COUNTS_PER_RAD,
            temperature_degc=decidegrees * 0.1,
        )

    def drive_at(self, velocity_rad_s: float, seconds: float) -> list[Answer]:
        """Hold a set-point for a while, one SYNC a millisecond."""
        return [self.cycle(velocity_rad_s) for _ in range(round(seconds / 0.001))]

    def enable(self) -> None:
        """Go to OPERATION ENABLED by the three commands."""
        for word in (0x06, 0x07, 0x0F):
            self.controlword = word
            self.cycle()
        assert self.cycle().status & 0x6F == 0x27

    def emergencies(self) -> list[tuple[int, int]]:
        """Return code and register of every EMCY heard so far."""
        cob_id = 0x80 + self.drive.node_id
        return [struct.unpack("<HB", f.data[:3]) for f in self.heard if f.cob_id == cob_id]


def abort_code(answer: bytes) -> int:
    """Return the code of an abort frame; the test fails on any other."""
    assert answer[0] == 0x80, answer.hex()
    return int.from_bytes(answer[4:8], "little")


@contextmanager
def fake_bench(
    specification: FakeSpecification | None = None,
    faults: Iterable[Fault] = (),
    *,
    node_id: int = 1,
    seed: int = 0,
) -> Iterator[Bench]:
    """Yield a bench whose fake has just been switched on."""
    channel = object()
    bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)  # type: ignore[arg-type]  # python-can types it str
    other = can.Bus(interface="virtual", channel=channel, ignore_config=True)  # type: ignore[arg-type]  # python-can types it str
    try:
        drive = FakeDrive(
            other, node_id=node_id, specification=specification, faults=faults, seed=seed
        )
        bench = Bench(bus, drive)
        bench.step()
        yield bench
    finally:
        bus.shutdown()
        other.shutdown()
