"""A CiA 402 drive that is not there: real frames on a real bus, around a simulated joint."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import can

from fakes import faults as script
from fakes.breakage import Breakage
from fakes.connection import Connection
from fakes.cyclic_data import CyclicData
from fakes.drive_loop import DriveLoop
from fakes.emergency import Emergency
from fakes.fault import Fault
from fakes.heartbeat import HeartbeatProducer
from fakes.live_values import LiveValues
from fakes.nmt import ALL_OBJECTS, COMMUNICATION_OBJECTS, Nmt
from fakes.object_dictionary import Entry, ObjectDictionary
from fakes.object_effects import connect_motion, refuse_long_identifiers
from fakes.pdo import INVALID
from fakes.plant import Plant
from fakes.sdo_server import SdoServer
from fakes.specification import FakeSpecification, Truth
from fakes.state_machine import StateMachine


class FakeDrive:
    """One simulated joint behind a CiA 402 drive, on the bus that is handed in.

    Nothing runs by itself: `step_to` moves time. The same seed, script and sequence of calls
    and frames give the same bytes.

    Parameters
    ----------
    bus : can.BusABC
        Where the drive listens and speaks; it belongs to the caller.
    node_id : int
        1 to 127.
    specification : FakeSpecification, optional
        Joint, servo, gearbox and drive; the default resembles the seed thesis' robot.
    faults : iterable of faults.Fault
        What goes wrong, and when.
    seed : int
        Of the noise on the reported torque.
    """

    def __init__(
        self,
        bus: can.BusABC,
        *,
        node_id: int = 1,
        specification: FakeSpecification | None = None,
        faults: Iterable[Fault] = (),
        seed: int = 0,
    ) -> None:
        if not 1 <= node_id <= 127:
            raise ValueError(f"node_id: expected 1 to 127, got {node_id}")
        self._bus = bus
        self.node_id = node_id
        self.specification = specification or FakeSpecification()
        self.dictionary = ObjectDictionary(node_id)
        for (index, subindex), value in self.specification.factory_values().items():
            self.dictionary.set_factory(index, subindex, value)
        self.dictionary.hide(self.specification.drive.absent_objects)
        if self.specification.drive.rated_torque_reads_zero:
            self.dictionary.shown[0x607600] = 0
        self.plant = Plant(
            self.specification.joint, self.specification.servo, self.specification.thermal
        )
        self.emergency = Emergency(self.dictionary, self._send_emergency)
        self.machine = StateMachine(
            self.dictionary.number,
            may_reset=lambda: not self._connection.blocks_fault_reset,
            on_reset=self.emergency.clear,
        )
        self.loop = DriveLoop(self.plant, self.dictionary, self.machine)
        self._connection = Connection(
            self.dictionary,
            self.machine,
            self.emergency,
            fault_sticks=self.specification.drive.heartbeat_fault_sticks,
        )
        self._sdo = SdoServer(self.dictionary)
        self._cyclic = CyclicData(
            self.dictionary,
            self.emergency,
            may_be_mapped=lambda: self.nmt is Nmt.PRE_OPERATIONAL,
            send=self._send,
        )
        self._producer = HeartbeatProducer()
        self._faults = script.FaultPlayer(faults)
        self._breakage = Breakage(self.dictionary, self.loop, self.machine, self.emergency)
        self._live = LiveValues(self.dictionary, self.loop, self.machine, self._breakage, seed)
        self.nmt = Nmt.BOOT_UP
        self.syncs = 0
        self._origin_s: float | None = None
        self._elapsed_s = 0.0
        self._steps = 0
        self._handlers: dict[int, Callable[[can.Message], None]] = {}
        self._connect_objects()

    # ---- what a test looks at -------------------------------------------------------------

    @property
    def motor_velocity_rad_s(self) -> float:
        """Return the motor's true velocity."""
        return self.plant.motor_velocity_rad_s

    @property
    def motor_position_rad(self) -> float:
        """Return the motor's true angle."""
        return self.plant.motor_position_rad

    @property
    def gearbox_temperature_degc(self) -> float:
        """Return the gearbox's true temperature."""
        return self.plant.gearbox.temperature_degc

    @property
    def truth(self) -> Truth:
        """Return what an estimator should find at the present temperature."""
        return Truth.of(
            self.specification.joint, self.plant.friction, self.gearbox_temperature_degc
        )

    # ---- time -----------------------------------------------------------------------------

    def step_to(self, now_s: float, message: can.Message | None = None) -> None:
        """Move the joint to `now_s`, then handle the frames, then what is due.

        Parameters
        ----------
        now_s : float
            Seconds on the caller's monotonic clock. The first call is the moment of switching
            on; a time before the last one moves nothing.
        message : can.Message, optional
            A frame that the caller has taken from the bus, and that came at `now_s`: it alone is
            handled. Without one, every frame that waits.
        """
        if self._origin_s is None:
            self._origin_s = now_s
            self._boot()
        self._elapsed_s = max(self._elapsed_s, now_s - self._origin_s)
        self._begin_faults()
        # The small share keeps a multiple of the step from being rounded down.
        steps = int(self._elapsed_s / self.specification.servo.step_s + 1e-6)
        if steps > self._steps:
            self.loop.advance(steps - self._steps)
            self._steps = steps
        if message is not None:
            self._handle(message)
        else:
            while (waiting := self._bus.recv(0.0)) is not None:
                self._handle(waiting)
        self._watch_time()

    def _handle(self, message: can.Message) -> None:
        """Do what one frame asks for, where it reaches this node."""
        if self._breakage.connected:
            handler = self._handlers.get(message.arbitration_id)
            if handler is not None and _is_data_frame(message):
                handler(message)

    def _watch_time(self) -> None:
        """Do what is due by the clock: own heartbeat, the other's, event-driven PDOs."""
        if not self._breakage.supplied:
            return
        now_s = self._elapsed_s
        if self._producer.is_due(now_s) and self._breakage.beats:
            self._send(0x700 + self.node_id, bytes([self.nmt]))
        if self._connection.is_lost(now_s):
            self._behave_as_on_error()
        if self._cyclic.has_events:
            self._live.publish(self._steps)
            self._cyclic.tell_events(now_s)

    # ---- NMT ------------------------------------------------------------------------------

    def _boot(self) -> None:
        """Announce the node and wait in PRE-OPERATIONAL."""
        self._sdo.reset()
        self._set_heartbeat_producer(self.dictionary.number(0x1017))
        self._connection.renew()
        self.loop.refresh()
        self._send(0x700 + self.node_id, bytes([Nmt.BOOT_UP]))
        self._enter(Nmt.PRE_OPERATIONAL)

    def _on_nmt(self, message: can.Message) -> None:
        data = message.data
        if len(data) < 2 or data[1] not in (0, self.node_id):
            return
        if data[0] == 0x01:
            self._enter(Nmt.OPERATIONAL)
        elif data[0] == 0x02:
            self._connection.end()
            self._enter(Nmt.STOPPED)
        elif data[0] == 0x80:
            self._enter(Nmt.PRE_OPERATIONAL)
        elif data[0] == 0x81:
            self.nmt = Nmt.BOOT_UP
            self.machine.reset()
            self.dictionary.reset(*ALL_OBJECTS)
            self.emergency.forget()
            self._boot()
        elif data[0] == 0x82:
            self._connection.end()
            self.nmt = Nmt.BOOT_UP
            self.dictionary.reset(*COMMUNICATION_OBJECTS)
            self.emergency.restore()
            self._boot()

    def _enter(self, state: Nmt) -> None:
        """Change the NMT state; the PDOs are compiled on the way to OPERATIONAL."""
        if state is self.nmt:
            return
        self.nmt = state
        if state is Nmt.OPERATIONAL:
            self._cyclic.begin()
        else:
            self._cyclic.end()
        self._route()

    def _behave_as_on_error(self) -> None:
        """Change the NMT state as object 0x1029:1 wants it after a lost heartbeat."""
        behaviour = self.dictionary.number(0x1029, 1)
        if behaviour == 0 and self.nmt is Nmt.OPERATIONAL:
            self._enter(Nmt.PRE_OPERATIONAL)
        elif behaviour == 2:
            self._enter(Nmt.STOPPED)

    def _route(self) -> None:
        """Decide which identifier goes where in this NMT state."""
        self._handlers = {0x000: self._on_nmt}
        if self._connection.master:
            self._handlers[0x700 + self._connection.master] = self._on_heartbeat
        if self.nmt in (Nmt.PRE_OPERATIONAL, Nmt.OPERATIONAL):
            self._handlers[0x600 + self.node_id] = self._on_sdo
        self._handlers.update(self._cyclic.handlers())
        if self.nmt is Nmt.OPERATIONAL:
            self._handlers[self.dictionary.number(0x1005) & 0x7FF] = self._on_sync

    # ---- cyclic data ----------------------------------------------------------------------

    def _on_sync(self, _message: can.Message) -> None:
        """Sample and answer, then let the waiting set-points act."""
        self.syncs += 1
        self._begin_faults()
        if not self._breakage.swallows_sync():
            self._live.publish(self._steps)
            self._cyclic.answer()
        self._cyclic.take_over()
        self.loop.synced()

    # ---- SDO ------------------------------------------------------------------------------

    def _on_sdo(self, message: can.Message) -> None:
        request = bytes(message.data)
        answer = self._breakage.sdo_fate(request)
        if answer is None:
            answer = self._sdo.handle(request)
        else:
            self._sdo.reset()
        if answer:
            self._send(0x580 + self.node_id, answer)

    def _before_read(self, entry: Entry) -> None:
        self._live.publish(self._steps)
        self.emergency.check_read(entry)

    def _begin_faults(self) -> None:
        for fault in self._faults.begin(self._elapsed_s, self.syncs):
            self._breakage.begin(fault)

    def _connect_objects(self) -> None:
        od = self.dictionary
        od.before_read = self._before_read
        connect_motion(od, self.machine, self.loop, self.specification.drive.supported_modes)
        refuse_long_identifiers(od)
        od.on_write(0x1005, 0, lambda _value: self._route())
        od.on_write(0x1016, 1, self._set_heartbeat_consumer)
        od.on_write(0x1017, 0, self._set_heartbeat_producer)

    def _set_heartbeat_producer(self, milliseconds: int) -> None:
        self._producer.configure(milliseconds, self._elapsed_s)

    def _set_heartbeat_consumer(self, _raw: int) -> None:
        self._connection.configure()
        self._route()

    def _on_heartbeat(self, _message: can.Message) -> None:
        self._connection.seen(self._elapsed_s)

    def _send_emergency(self, data: bytes) -> None:
        raw = self.dictionary.number(0x1014)
        if not raw & INVALID and self.nmt not in (Nmt.STOPPED, Nmt.BOOT_UP):
            self._send(raw & 0x7FF, data)

    def _send(self, cob_id: int, data: bytes) -> None:
        if self._breakage.connected:
            self._bus.send(can.Message(arbitration_id=cob_id, is_extended_id=False, data=data))


def _is_data_frame(message: can.Message) -> bool:
    return not (message.is_extended_id or message.is_remote_frame or message.is_error_frame)
