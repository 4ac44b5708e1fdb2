"""What an exchange says about the drive's health: the first reason to stop, or none."""

from __future__ import annotations

from drivers.cia402.company import intruded
from drivers.cia402.exchange import Exchange
from drivers.cia402.network import NmtState
from drivers.cia402.words import State, error_words
from drivers.errors import (
    DriveFaultError,
    DriverError,
    DriveStateError,
    HeartbeatLostError,
    SyncUnansweredError,
)

_UNASKED_LIMIT = 20
_ANSWERS = 3  # in a row: one alone may hold a wrong bit
_CLEAR_IT = "A person must find the cause and clear the fault at the drive; the agent never does."


def judge(exchange: Exchange) -> DriverError | None:
    """Return the gravest thing that is wrong with the drive by now, None when all is well.

    The bus comes first (nothing else can be known without it), then who else commands the drive,
    then what the drive says of itself, then what is missing.
    """
    try:
        exchange.owner.check()
    except DriverError as error:
        return error
    return (
        intruded(exchange.owner, exchange.config)
        or _emergency(exchange)
        or exchange.unreadable
        or _fault(exchange)
        or _left(exchange)
        or _taken_over(exchange)
        or _unanswered(exchange)
        or _silent(exchange)
    )


def _emergency(exchange: Exchange) -> DriverError | None:
    """Return an error for the first EMCY that reports one; "no error" (0x00xx, register 0) is well.

    A drive may withdraw an emergency later: it has been there all the same.
    """
    for emergency in exchange.node.emergencies:
        if emergency.code & 0xFF00 or emergency.register:
            return DriveFaultError(
                f"The drive at node {exchange.config.node_id} sent the emergency "
                f"{error_words(emergency.code)}, error register 0x{emergency.register:02X}.",
                _CLEAR_IT,
                error_code=emergency.code,
            )
    return None


def _fault(exchange: Exchange) -> DriverError | None:
    """Return an error for a statusword that says fault, or that says nothing CiA 402 knows."""
    node_id = exchange.config.node_id
    if exchange.state in (State.FAULT, State.FAULT_REACTION):
        return DriveFaultError(
            f"The drive at node {node_id} is in fault (statusword "
            f"0x{exchange.statusword:04X}); it sent no emergency, so its code is unknown.",
            _CLEAR_IT,
        )
    if exchange.state is None and exchange.ledger.received:
        return DriveStateError(
            f"The drive at node {node_id} gives statusword 0x{exchange.statusword:04X}, "
            "which is no state of CiA 402.",
            "Look at the drive and its mapping, then start again.",
        )
    return None


def _left(exchange: Exchange) -> DriverError | None:
    """Return an error when the drive has left operation enabled, or OPERATIONAL, by itself."""
    node_id = exchange.config.node_id
    if exchange.left_enabled is not None:
        return DriveStateError(
            f"The drive at node {node_id} left operation enabled by itself: it is "
            f"{exchange.left_enabled.value} (statusword 0x{exchange.statusword:04X}).",
            "Look for an enabling switch, a stop input, or missing power of the drive.",
        )
    state = exchange.node.nmt_state
    if state is not None and state != NmtState.OPERATIONAL:
        what = "restarted" if state == NmtState.BOOT_UP else f"is in NMT state {state}"
        return DriveStateError(
            f"Node {node_id} {what}, expected OPERATIONAL.",
            "Look for a power cut or another NMT master, then start again.",
        )
    return None


def _taken_over(exchange: Exchange) -> DriverError | None:
    """Return an error when the drive says that it obeys no controlword from the bus any more."""
    if exchange.unheard < _ANSWERS:
        return None
    return DriveStateError(
        f"The drive at node {exchange.config.node_id} no longer obeys the bus (statusword "
        f"0x{exchange.statusword:04X}: bit 9, remote, is gone).",
        "Look for a local/remote switch, or a program of its maker that has taken the drive over.",
    )


def _unanswered(exchange: Exchange) -> DriverError | None:
    """Return an error for too many SYNCs in a row without answer, or answers without a SYNC."""
    ledger, config = exchange.ledger, exchange.config
    if ledger.most_in_a_row > config.consecutive_lost_limit:
        late = f"; {ledger.undecided} answers came too late to tell whose they are"
        return SyncUnansweredError(
            f"Node {config.node_id} left {ledger.most_in_a_row} SYNCs in a row unanswered "
            f"({ledger.lost} of {ledger.expected} in all"
            f"{late if ledger.undecided else ''}).",
            "Check cable, termination and the load of bus and computer.",
        )
    if ledger.unasked > _UNASKED_LIMIT:
        return SyncUnansweredError(
            f"{ledger.unasked} answers of node {config.node_id} belong to no SYNC of ours.",
            "Look for a second SYNC producer, or a link slower than the SYNC time-out.",
        )
    return None


def _silent(exchange: Exchange) -> DriverError | None:
    """Return an error when the drive's heartbeat is overdue."""
    last_s = exchange.node.heartbeat_s
    timeout_s = exchange.config.drive_heartbeat_timeout_s
    if last_s is not None and exchange.clock.now() - last_s > timeout_s:
        return HeartbeatLostError(
            f"The heartbeat of node {exchange.config.node_id} has stopped for more than "
            f"{timeout_s:g} s.",
            "Check the drive's power and the cable.",
        )
    return None
