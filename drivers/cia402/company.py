"""Who else on the bus does what only the agent may to its drive.

Feed its watchdog, give it orders, send SYNC, write its settings.
"""

from __future__ import annotations

from collections.abc import Iterable

from drivers.can.claims import asking, writing_to
from drivers.can.owner import CanBusOwner
from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.sdo import SdoAccess
from drivers.clock import Clock
from drivers.errors import IntruderError

SYNC = 0x080
FIRST_ORDER = 0x200
HEARTBEAT = 0x700

LISTENED_S = 0.1
"""So long it is listened before anything is written: five of another agent's heartbeats, and fifty
of its SYNCs. Whoever speaks less often is found later, in motion too."""

ANSWERED_S = 0.5
"""So long somebody who is just setting up the drive has to give himself away, after he has heard
us write. He looks before each write of his own, and 50 times a second while he waits."""

QUIET_S = 0.2
"""Nobody else asks the drive for so long: we may. Four times as long that is waited for."""

_POLL_S = 0.01


def refuse_company(
    owner: CanBusOwner,
    clock: Clock,
    config: Cia402Config,
    sdo: SdoAccess,
    orders: Iterable[int] = (),
) -> None:
    """Claim what only we may send to this drive, and refuse it where somebody else does already.

    First it is listened, and nothing sent: another agent's cycle is not disturbed by one that is
    refused. But an agent that has just begun is silent while it waits for the drive, for up to a
    second each time, and what it has set by then would be taken for how the drive was found. So
    we knock: 0x1017 is written as it reads. That changes nothing, and whoever else holds this drive
    hears it, ends, and gives it back, which we hear.

    Parameters
    ----------
    owner, clock, config, sdo
        Of the axis.
    orders : iterable of int
        Identifiers of the RPDOs beside the first, which has the controlword.

    Raises
    ------
    IntruderError
        As `intruded` says.
    """
    beat, control = HEARTBEAT + config.agent_node_id, FIRST_ORDER + config.node_id
    owner.claims.claim((beat, control, *orders, SYNC, writing_to(config.node_id)))
    _listen(owner, clock, LISTENED_S)
    refuse_intruder(owner, config)
    knock = sdo.read(objects.HEARTBEAT_PRODUCER)
    refuse_intruder(owner, config)
    sdo.write(objects.HEARTBEAT_PRODUCER, knock)
    _listen(owner, clock, ANSWERED_S)
    refuse_intruder(owner, config)


def refuse_intruder(owner: CanBusOwner, config: Cia402Config) -> None:
    """Raise where somebody else has sent by now what only we may.

    Raises
    ------
    IntruderError
        As `intruded` says.
    """
    owner.poll()
    intruder = intruded(owner, config)
    if intruder is not None:
        raise intruder


def outwait_company(
    owner: CanBusOwner, clock: Clock, config: Cia402Config, quiet_s: float = QUIET_S
) -> bool:
    """Wait until nobody else asks anything of the drive, at most for four times `quiet_s`.

    Two who talk to one drive by SDO at once take each other's answers for theirs. And who sends
    heartbeats, orders or SYNCs has not ended yet: what it has set it will give back later.

    Returns
    -------
    bool
        Whether nobody else writes any more; at once where nobody else has been heard at all.
    """
    node = config.node_id

    def heard() -> tuple[int, int]:
        owner.poll()
        claims = owner.claims
        return claims.of_others(writing_to(node)), claims.of_others(asking(node)) + claims.broken()

    until_s = clock.now() + 4.0 * quiet_s
    before = (0, 0)
    while (now := heard()) != before and clock.now() < until_s:
        before = now
        _listen(owner, clock, quiet_s)
    return now[0] == before[0]


def _listen(owner: CanBusOwner, clock: Clock, seconds: float) -> None:
    until_s = clock.now() + seconds
    while clock.now() < until_s:
        clock.sleep_until(min(until_s, clock.now() + _POLL_S))
        owner.poll()


def intruded(owner: CanBusOwner, config: Cia402Config) -> IntruderError | None:
    """Return an error when somebody else on the bus has sent what only we may.

    A second heartbeat under our node id would keep the drive going after our death; a second
    sender of orders moves the joint; a second SYNC makes answers that belong to none of ours. And
    what was read back and proven before the motion (ramps, watchdog, limits) no longer holds once
    somebody has written to the drive, which nothing shows until a stop is needed.
    """
    cob_id = owner.claims.intruded()
    if cob_id is None:
        return None
    agent = config.agent_node_id
    if cob_id == HEARTBEAT + agent:
        what = f"the heartbeat of node {agent}, which is ours (0x{cob_id:03X})"
        do = (
            "End the other agent, or give this one a node id that no other device on this bus has "
            "(agent_node_id)."
        )
    elif cob_id == SYNC:
        what = f"SYNC (0x{cob_id:03X})"
        do = "End the other SYNC producer; `stribeck bus` shows who talks."
    elif cob_id == writing_to(config.node_id):
        what = (
            f"settings to the drive at node {config.node_id} (SDO, 0x{0x600 + config.node_id:03X})"
        )
        do = "End the program that sets up this drive; reading from it beside a cycle is fine."
    else:
        what = f"orders to the drive at node {config.node_id} (0x{cob_id:03X})"
        do = "End the program, or the controller, that commands this drive."
    return IntruderError(f"Somebody else on {owner.name} sends {what}.", do)
