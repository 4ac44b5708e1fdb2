"""How a drive is given back as it was found: after a run, or at the start after a crash."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drivers.can.claims import writing_to
from drivers.can.owner import CanBusOwner
from drivers.cia402 import objects
from drivers.cia402.company import QUIET_S, outwait_company, refuse_company
from drivers.cia402.config import Cia402Config
from drivers.cia402.network import CanopenNode, NmtOrder, NmtState
from drivers.cia402.objects import DriveObject, setting_of
from drivers.cia402.opening import identify
from drivers.cia402.pdo import ignored_bits
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.settings import give_back
from drivers.cia402.words import Controlword, State, state_of
from drivers.clock import Clock
from drivers.errors import ConfigurationError, DriverError, NodeMissingError


class HandedBack(NamedTuple):
    """What became of a drive that was given back.

    `troubles` names what could not be restored; `changed` what had no longer read as it was set.
    """

    troubles: list[str]
    changed: list[str]


def restore(
    owner: CanBusOwner, config: Cia402Config, clock: Clock, found: Mapping[str, int]
) -> None:
    """Give back to a drive what a crashed run had found in it; it ends PRE-OPERATIONAL.

    Parameters
    ----------
    owner : CanBusOwner
        The bus; no axis of this node may be open.
    config : Cia402Config
        Node id, expected identity and time-outs.
    clock : Clock
        The one that the owner stamps with.
    found : mapping
        `AxisEvidence.found`, or what the journal was given.

    Raises
    ------
    NodeMissingError, IdentityError, IntruderError
        Nobody, or somebody else, answers; somebody else is driving it (their journal lies in a
        folder that two computers share): nothing is changed.
    ConfigurationError
        Naming every object that could not be restored.
    """
    node = CanopenNode(owner, clock, config.node_id, config.sdo_timeout_s)
    try:
        _identified(node, config, owner.name)
        refuse_company(owner, clock, config, SdoAccess(node, config.sdo_attempts))
        troubles = hand_back(owner, node, config, found, NmtState.PRE_OPERATIONAL).troubles
    finally:
        node.release()
    if troubles:
        raise not_restored(config.node_id, troubles)


def _identified(node: CanopenNode, config: Cia402Config, bus: str) -> None:
    """Identify the drive, out of STOPPED if need be, where our own stop may have left it.

    There it answers no SDO, nor says why once its heartbeat has been given back. Whoever drives it
    has it in another state, where it answers, so that nobody is disturbed by the order.
    """
    sdo = SdoAccess(node, config.sdo_attempts)
    try:
        identify(sdo, config, bus)
    except NodeMissingError:
        node.command(NmtOrder.PRE_OPERATIONAL)
        identify(sdo, config, bus)


def hand_back(
    owner: CanBusOwner,
    node: CanopenNode,
    config: Cia402Config,
    found: Mapping[str, int],
    state: NmtState,
    held: Mapping[str, int] | None = None,
) -> HandedBack:
    """Take torque away, restore `found` and the NMT `state`; return everything that failed.

    What should have held meanwhile, `held`, is read once before: behind a gateway nobody hears who
    has mapped other objects into a PDO, or told the drive to count in other units.

    Somebody else who talks to the drive, too, hears from our first write that he is not alone.
    It is waited until he has ended, and in the end, when he must have, looked what he has left.
    """
    sdo = SdoAccess(node, config.sdo_attempts)
    troubles: list[str] = []
    try:
        node.command(NmtOrder.PRE_OPERATIONAL)
        sdo.order(objects.CONTROLWORD, Controlword.DISABLE_VOLTAGE)
        if state_of(sdo.read(objects.STATUSWORD)) in (State.ENABLED, State.QUICK_STOP):
            troubles.append(f"{objects.CONTROLWORD}: the drive keeps its torque")
    except DriverError as error:
        troubles.append(error.what)
    outwait_company(owner, node.clock, config)
    changed = _no_longer(SdoAccess(node, attempts=1), held or {})
    troubles.extend(give_back(sdo, found))
    troubles.extend(_left_by_others(owner, node, config, found))
    if state is NmtState.OPERATIONAL:
        try:
            node.command(NmtOrder.START)
        except DriverError as error:
            troubles.append(error.what)
    return HandedBack(troubles, changed)


def _no_longer(sdo: SdoAccess, held: Mapping[str, int]) -> list[str]:
    """Return what does not read as it was set; nothing of a drive that no longer answers."""
    try:
        unlike = _unlike(sdo, held)
        return [
            f"{item} reads {item.shown(read)}, it was {item.shown(value)}"
            for item, read, value in unlike
        ]
    except DriverError:
        return []  # what follows says so


def _left_by_others(
    owner: CanBusOwner, node: CanopenNode, config: Cia402Config, found: Mapping[str, int]
) -> list[str]:
    """Return what somebody else has made of what was given back; he may still be at it."""
    wrote = writing_to(config.node_id)
    if not owner.claims.of_others(wrote):
        return []
    # as long as he may wait for the drive before he gives back, too, what he took for found
    if not outwait_company(owner, node.clock, config, config.state_timeout_s + 2.0 * QUIET_S):
        return ["somebody else goes on writing to the drive"]
    try:
        changed = _differing(SdoAccess(node, config.sdo_attempts), found)
    except DriverError as error:
        return [error.what]
    return [f"{each}; somebody else writes to the drive" for each in changed]


def _differing(sdo: SdoAccess, found: Mapping[str, int]) -> list[str]:
    """Read every object of a snapshot and name those that are not as they were found.

    Raises
    ------
    SdoError
        One is not answered.
    """
    return [f"{item} reads {read}, {value} was found" for item, read, value in _unlike(sdo, found)]


def _unlike(sdo: SdoAccess, expected: Mapping[str, int]) -> list[tuple[DriveObject, int, int]]:
    """Read objects and return those that are not as expected, with both values."""
    items = [(setting_of(key), value) for key, value in expected.items()]
    read = [(item, sdo.read(item), value) for item, value in items]
    return [each for each in read if (each[1] ^ each[2]) & ~ignored_bits(each[0])]


def not_restored(node_id: int, troubles: list[str]) -> ConfigurationError:
    """Return the error that names everything that was not restored."""
    return ConfigurationError(
        f"Node {node_id} could not be given back as it was found: "
        f"{'; '.join(trouble.rstrip('.') for trouble in troubles)}.",
        "Switch the drive off and on, then compare these objects with its parameter file.",
    )
