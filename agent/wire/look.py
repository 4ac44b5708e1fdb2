"""A look at a cell before a start: what its devices say, read and never written.

A part of the composition root. Nothing here enables, sets, maps, resets or synchronises anything:
of a drive objects are uploaded by SDO, of a controller or a PLC registers are read, of a contact
its own messages are heard. A bus on which somebody else talks to the drive is left alone. What was
seen is of its moment; the cycle judges all of it again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from agent.cell.cell import Axis, Cell
from agent.cell.devices import Cia404Temperature, ContactRelease
from agent.cycle.plan import CyclePlan
from agent.cycle.preflight import Condition, at_standstill
from agent.errors import InputError
from agent.wire.devices import cell_release, mapped_device, temperature_probe
from agent.wire.drive import bus_config, drive_config
from drivers.can.owner import CanBusOwner
from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.network import CanopenNode
from drivers.cia402.opening import identify, mode_for, refuse_unable, refuse_unhealthy, refuse_wider
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.words import REDUCED, State, state_of
from drivers.clock import Clock
from drivers.errors import DriverError, IdentityError, NodeMissingError
from drivers.modbus.job_words import AUTOMATIC_MODES, MODES, refuse_stopped
from drivers.modbus.release import REFUSALS, SAYS
from drivers.ports import DriveState, Sample

LISTEN_S = 0.3
"""How long a bus is listened to before the first word: a SYNC of 10 Hz is heard three times."""
APART_S = 0.1
"""Between two readings of the position: an arm that moves has another one."""
_SYNC, _SDO_REQUEST, _RPDOS = 0x080, 0x600, (0x200, 0x300, 0x400, 0x500)
_BY_THE_RELEASE = ("release present", "operating mode", "no stop active")


class Seen(NamedTuple):
    """What a look has found: conditions by their names, and why the rest was not looked at."""

    conditions: tuple[Condition, ...]
    untold: str = ""


def look(cell: Cell, axis: Axis, plan: CyclePlan, clock: Clock) -> Seen:
    """Return what the devices say now of the preconditions that a start would judge.

    Parameters
    ----------
    cell, axis : Cell, Axis
        Whose joint; the caller holds it (`agent.cycle.axis_lock.looked_at`).
    plan : CyclePlan
        What would be driven, with its limits.
    clock : Clock
        Bounds every wait.
    """
    if axis.job is not None:
        controller = _answered("operating mode", lambda: _controller(axis, clock))
        return _joined(
            controller, _answered("release present", lambda: _release(cell, None, clock))
        )
    if cell.bus.replays:
        return Seen(())
    try:
        owner = CanBusOwner.open(replace(bus_config(cell.bus), fast_reader=False), clock)
    except DriverError as error:
        return Seen((Condition("identity", False, str(error)),))
    try:
        talks = _somebody_talks(owner, axis.drive.node_id, clock)
        if talks:
            return Seen((), talks)
        release = _answered("release present", lambda: _release(cell, owner, clock))
        return _joined(_drive(cell, axis, plan, owner, clock), release)
    finally:
        owner.close()


def _joined(*parts: Seen) -> Seen:
    conditions = tuple(condition for part in parts for condition in part.conditions)
    return Seen(conditions, " ".join(part.untold for part in parts if part.untold))


def _answered(name: str, ask: Callable[[], Seen]) -> Seen:
    """Return what was asked; a device that does not answer is a refusal under `name`."""
    try:
        return ask()
    except DriverError as error:
        return Seen((Condition(name, False, str(error)),))


def _somebody_talks(owner: CanBusOwner, node_id: int, clock: Clock) -> str:
    """Listen for a master that drives or asks this node; say so where there is one."""
    heard = (_SYNC, _SDO_REQUEST + node_id, *(rpdo + node_id for rpdo in _RPDOS))
    inbox = owner.subscribe(heard)
    try:
        if not owner.wait(inbox, clock.now() + LISTEN_S):
            return ""
        cob_id = inbox.frames[0].cob_id
    finally:
        owner.unsubscribe(inbox)
    what = "sends SYNC" if cob_id == _SYNC else f"talks to node {node_id}"
    return f"Somebody else {what} on {owner.name} (0x{cob_id:03X}): the drive is not asked now."


def _drive(cell: Cell, axis: Axis, plan: CyclePlan, owner: CanBusOwner, clock: Clock) -> Seen:
    """Ask the drive by SDO: who it is, whether it is healthy, how its joint stands."""
    config = drive_config(cell, axis)
    sdo = SdoAccess(CanopenNode(owner, clock, config.node_id, config.sdo_timeout_s), 1)
    try:
        identify(sdo, config, owner.name)
    except (NodeMissingError, IdentityError) as error:
        return Seen((Condition("identity", False, str(error)),))
    except DriverError as error:
        return Seen((), str(error))
    healthy = _held("drive healthy", lambda: refuse_unhealthy(sdo, config.node_id))
    limits = _held("limits of the drive", lambda: _limits(sdo, config))
    asks: tuple[Callable[[], object], ...] = (
        lambda: refuse_unable(sdo, config),
        lambda: mode_for(sdo, config),
    )
    unable = [c for ask in asks if not (c := _held("settings read back equal", ask)).holds]
    try:
        stands = _stands(axis, plan, sdo, config, clock)
    except DriverError as error:
        return Seen((Condition("identity", True), healthy, limits, *unable[:1]), str(error))
    return Seen((Condition("identity", True), healthy, limits, *unable[:1], *stands))


def _limits(sdo: SdoAccess, config: Cia402Config) -> None:
    """Compare the window with the software limits in the drive, where it has any."""
    if config.software_limits_counts is not None:
        refuse_wider(config, {item.key: sdo.read(item) for item in objects.SOFTWARE_LIMITS})


def _held(name: str, ask: Callable[[], object]) -> Condition:
    try:
        ask()
    except DriverError as error:
        return Condition(name, False, str(error))
    return Condition(name, True)


def _stands(
    axis: Axis, plan: CyclePlan, sdo: SdoAccess, config: Cia402Config, clock: Clock
) -> tuple[Condition, ...]:
    """Judge the joint as a cycle judges it at standstill, of samples that SDO has brought.

    The velocity is that of two positions, so that no drive's filter hides a slow one.
    """
    scaling = config.scaling
    before_s, before = clock.now(), scaling.position_rad(sdo.read(objects.POSITION))
    clock.sleep_until(before_s + APART_S)
    now_s, now = clock.now(), scaling.position_rad(sdo.read(objects.POSITION))
    sample = Sample(
        time_s=now_s,
        received_s=now_s,
        position_rad=now,
        velocity_rad_s=(now - before) / (now_s - before_s),
        torque_nm=math.nan,
        gearbox_temperature_degc=_temperature_degc(axis, sdo, config, clock),
        state=REDUCED.get(state_of(sdo.read(objects.STATUSWORD)) or State.FAULT, DriveState.FAULT),
        internal_limit_active=False,
    )
    unasked = {"answers SYNC"}  # nobody was asked by SYNC
    if isinstance(axis.temperature, Cia404Temperature):
        unasked.add("gearbox temperature")  # such a node is set up before it sends
    return tuple(c for c in at_standstill(plan, (sample,)) if c.name not in unasked)


def _temperature_degc(axis: Axis, sdo: SdoAccess, config: Cia402Config, clock: Clock) -> float:
    """Read the gearbox temperature where it is measured; NaN where it is not known."""
    if config.temperature is not None:
        return config.temperature.degc(sdo.read(config.temperature.mapped))
    if axis.temperature is None or isinstance(axis.temperature, Cia404Temperature):
        return math.nan
    probe = temperature_probe(axis.temperature, None, clock)
    try:
        probe.open()
        return probe.latest().degc
    except (DriverError, InputError):
        return math.nan
    finally:
        probe.close()


def _release(cell: Cell, owner: CanBusOwner | None, clock: Clock) -> Seen:
    """Return what the cell's release says without being asked for the permit."""
    described = cell.release
    if described is None:
        return Seen(())
    if isinstance(described, ContactRelease):
        contact = cell_release(cell, owner, clock)
        if contact is None:
            return Seen(())
        contact.open()
        try:
            until_s = clock.now() + described.age_max_s
            while not (permit := contact.permit()).granted and clock.now() < until_s:
                clock.sleep_until(clock.now() + 0.02)
        finally:
            contact.close()
        return _said_by_release(permit.granted, permit.reason)
    device = mapped_device(described, clock)
    try:
        first = device.read(SAYS, clock.now() + described.timeout_s)
        clock.sleep_until(clock.now() + max(APART_S, 2.0 * described.period_s))
        says = device.read(SAYS, clock.now() + described.timeout_s)
    finally:
        device.connection.close()
    if first["plc_alive"].whole == says["plc_alive"].whole:
        return _said_by_release(False, "the alive count of the cell's PLC stands still")
    if says["permit"].whole == 1:
        return _said_by_release(True, "")
    refusal = says["refusal"].whole
    if refusal > 0:
        why = REFUSALS.get(refusal, f"refusal {refusal}")
        return _said_by_release(False, f"the cell's PLC gives no permit: {why}")
    return Seen((), "The cell's PLC answers; its permit is asked for at the start.")


def _said_by_release(granted: bool, reason: str) -> Seen:
    if not granted:
        return Seen((Condition(_BY_THE_RELEASE[0], False, reason),))
    return Seen(tuple(Condition(name, True) for name in _BY_THE_RELEASE))


def _controller(axis: Axis, clock: Clock) -> Seen:
    """Read mode and stops of a controller that runs the stair by itself."""
    if axis.job is None:
        return Seen(())
    device = mapped_device(axis.job, clock)
    try:
        read = device.read(("operating_mode", "stops"), clock.now() + axis.job.timeout_s)
    finally:
        device.connection.close()
    mode, stopped = read["operating_mode"].whole, read["stops"].whole != 0
    return Seen(
        (
            Condition(
                "operating mode",
                mode in AUTOMATIC_MODES,
                f"the controller is in {MODES.get(mode, f'unknown mode {mode}')}",
            ),
            Condition(
                "no stop active", not stopped, _held("", lambda: refuse_stopped(read)).reason
            ),
        )
    )
