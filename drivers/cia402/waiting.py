"""Steps of opening and closing that wait for the drive's own word, each up to a deadline."""

from __future__ import annotations

from collections.abc import Callable

from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.exchange import Exchange
from drivers.cia402.modes import Rung
from drivers.cia402.network import CanopenNode, NmtOrder, NmtState
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.supervision import judge
from drivers.clock import Clock
from drivers.errors import (
    ConfigurationError,
    DriveStateError,
    HeartbeatLostError,
    SyncUnansweredError,
)
from drivers.ports import Goal

_PROOF_SYNCS = 5
_POLL_S = 0.002
_LOOK_S = 0.02
HELD_S, _LAST_S = 0.2, 0.05
_MORE_LOOKS, _SLOWING = 4, 0.9  # each of HELD_S: a wound-up gear swings back and slows down
"""How long a joint is watched after its torque was taken away; it is judged by the end of that. A
brake needs some of it to close, and a soft gear to come to rest."""


Watch = Callable[[], None]
"""Called while the drive is waited for; raises where somebody else has begun to write to it."""


def state_found(node: CanopenNode, config: Cia402Config, watch: Watch) -> NmtState:
    """Return the NMT state in which the drive was found, from its first heartbeat.

    Raises
    ------
    HeartbeatLostError
        It gives none.
    """
    if not _await(node, config, lambda: node.nmt_state is not None, watch):
        raise HeartbeatLostError(
            f"Node {config.node_id} gives no heartbeat although 0x1017 is set.",
            "Check that the drive supports a heartbeat producer.",
        )
    if node.nmt_state == NmtState.OPERATIONAL:
        return NmtState.OPERATIONAL
    return NmtState.PRE_OPERATIONAL


def bring(
    node: CanopenNode, config: Cia402Config, order: NmtOrder, state: NmtState, watch: Watch
) -> None:
    """Order an NMT state and wait for the heartbeat that says so.

    Raises
    ------
    DriveStateError
        No heartbeat says so in time.
    """
    node.command(order)
    if not _await(node, config, lambda: node.nmt_state == state, watch):
        raise DriveStateError(
            f"Node {config.node_id} did not go {state.name.replace('_', '-')} within "
            f"{config.state_timeout_s} s.",
            "Look for another NMT master on the bus.",
        )


def _await(node: CanopenNode, config: Cia402Config, come: Callable[[], bool], watch: Watch) -> bool:
    """Wait, while `watch` looks around, for what a heartbeat brings; return whether it came."""
    deadline_s = node.clock.now() + config.state_timeout_s
    while not come():
        watch()
        now_s = node.clock.now()
        if now_s >= deadline_s:
            return False
        node.wait(min(deadline_s, now_s + _LOOK_S))
    return True


def mode_taken(sdo: SdoAccess, rung: Rung, clock: Clock, config: Cia402Config) -> int:
    """Wait for the drive to report the mode that it was set to, and return it.

    Raises
    ------
    ConfigurationError
        It reports another one.
    """
    deadline_s = clock.now() + config.state_timeout_s
    while (mode := sdo.read(objects.MODE_DISPLAY)) != rung.mode:
        now_s = clock.now()
        if now_s >= deadline_s:
            raise ConfigurationError(
                f"Node {config.node_id} was set to mode {rung.mode} ({rung.word}) "
                f"but reports mode {mode} (0x6061).",
                "Check that the drive offers this mode without torque.",
            )
        clock.sleep_until(min(deadline_s, now_s + _POLL_S))
    return mode


def prove_answers(exchange: Exchange) -> None:
    """Send a few SYNCs without a heartbeat and see every one answered, by a drive at rest.

    Raises
    ------
    SyncUnansweredError
        One was not; or what `judge` finds.
    """
    clock, config = exchange.clock, exchange.config
    for _ in range(_PROOF_SYNCS):
        exchange.transmit(Goal.OFF, 0.0, heartbeat=False)
        deadline_s = clock.now() + config.sync_timeout_s
        while not exchange.collect() and clock.now() < deadline_s:
            clock.sleep_until(min(deadline_s, clock.now() + _POLL_S))
    failure = judge(exchange)
    if failure is not None:
        raise failure
    if exchange.ledger.received < _PROOF_SYNCS:
        raise SyncUnansweredError(
            f"Node {config.node_id} answered {exchange.ledger.received} of "
            f"{_PROOF_SYNCS} SYNCs with both TPDOs.",
            "Check that its TPDO1 and TPDO2 answer SYNC 0x80.",
        )
    exchange.forget()


def await_answers(exchange: Exchange) -> None:
    """Take in what still comes, so that every SYNC is booked as answered or as lost.

    Where SYNCs were lost it listens for one time-out more: an answer too many would show that one
    of them was only late.
    """
    clock = exchange.clock
    exchange.collect()
    until_s = clock.now() + (exchange.config.sync_timeout_s if exchange.ledger.lost else 0.0)
    while exchange.ledger.waiting_since_s is not None or clock.now() < until_s:
        clock.sleep_until(clock.now() + _POLL_S)
        exchange.collect()


def sinks_at(exchange: Exchange) -> float:
    """Watch a joint whose torque has just been taken away; return how fast it moves in the end.

    What was wound up swings back, slows down, and is watched for longer; what falls does not slow.

    Returns
    -------
    float
        In rad/s; 0 where it rests, where nothing is heard, and where it never had torque.
    """
    if not exchange.has_had_torque:
        return 0.0
    moves = _moves_at(exchange)
    for _ in range(_MORE_LOOKS):
        if not moves:
            return 0.0
        before, moves = moves, _moves_at(exchange)
        if abs(moves) > _SLOWING * abs(before):
            break
    return moves


def _moves_at(exchange: Exchange) -> float:
    """Return the velocity with which a joint goes one way at the end of a look; 0 for none."""
    clock, config = exchange.clock, exchange.config
    until_s = clock.now() + HELD_S
    last: list[float] = []
    while clock.now() < until_s:
        exchange.transmit(Goal.OFF)
        clock.sleep_until(clock.now() + config.stop_period_s)
        samples = exchange.collect()
        last += [s.velocity_rad_s for s in samples if s.time_s > until_s - _LAST_S]
    one_way = min(last, default=0.0) > 0.0 or max(last, default=0.0) < 0.0
    fast = all(abs(velocity) > config.rest_velocity_rad_s for velocity in last)
    return last[-1] if last and one_way and fast else 0.0
