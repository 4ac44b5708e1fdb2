"""What a drive is set to for a run, found before, read back after, and given back at the end.

The order matters. Set: limits and ramps first, then who watches whom, then the PDOs, the mode
last. Given back: our heartbeat is no longer watched first of all, then everything backwards, the
drive's own heartbeat last.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.modes import Rung
from drivers.cia402.objects import DriveObject, setting_of
from drivers.cia402.pdo import MAPPING_OFFSET, snapshot_pdo, write_pdo
from drivers.cia402.sdo import ABSENT, SdoAccess
from drivers.cia402.wanted import ProcessData, wanted_settings
from drivers.cia402.words import Mode
from drivers.errors import BusError, DriverError, SdoError
from drivers.ports import SetPoints

_Step = tuple[str, Callable[[], dict[str, int]]]

_LIMITS = objects.SOFTWARE_LIMITS

MAY_LACK = {
    0x1016: "heartbeat_consumer = false",
    0x6007: "abort_connection = false",
    0x607D: "software_limits = false",
}
"""What a cell says of a drive that has no such object."""


def snapshot(sdo: SdoAccess, config: Cia402Config, rung: Rung) -> dict[str, int]:
    """Return everything that `apply` will write, as it is now; nothing is written.

    Raises
    ------
    SdoError
        Naming the object that the drive has not; where a cell may say so, how.
    """
    items = (*wanted_settings(config, rung), objects.MODE)
    found = {item.key: _read(sdo, item) for item in items}
    for pdo in ProcessData.of(config, rung).all:
        found.update(snapshot_pdo(sdo, pdo.communication_index))
    return found


def _read(sdo: SdoAccess, item: DriveObject) -> int:
    """Return one object's value; of one that drives may lack, say what to do where it is absent."""
    try:
        return sdo.read(item)
    except SdoError as error:
        said = MAY_LACK.get(item.index)
        if said is None or error.abort_code not in ABSENT:
            raise
        raise SdoError(
            error.what,
            f"Where its manual has none either, set {said} under [axis.drive], or name its profile "
            "there: which modes are left then is in docs/drives.md.",
            error.abort_code,
        ) from error


def apply(
    sdo: SdoAccess, config: Cia402Config, rung: Rung, found: Mapping[str, int]
) -> dict[str, int]:
    """Set everything for a run and return what was read back.

    Parameters
    ----------
    sdo : SdoAccess
        Of a node in PRE-OPERATIONAL, without torque.
    config : Cia402Config
        What to set.
    rung : Rung
        For which mode.
    found : mapping
        The snapshot taken before.

    Raises
    ------
    ConfigurationError
        Naming the object that does not hold its value.
    SdoError
        Naming the object that the drive refuses.
    """
    settings = wanted_settings(config, rung)
    read: dict[str, int] = {}
    for _, step in _setters(sdo, settings):
        read.update(step())
    for pdo in ProcessData.of(config, rung).all:
        read.update(write_pdo(sdo, pdo.communication_index, pdo.wanted(found), found))
    read[objects.MODE.key] = sdo.set(objects.MODE, rung.mode)
    return read


def held_of(settings: Mapping[str, int], config: Cia402Config, rung: Rung) -> dict[str, int]:
    """Return those of the settings read back that nothing of ours changes afterwards."""
    orders = {entry.key for pdo in ProcessData.of(config, rung).orders for entry in pdo.entries}
    passing = {*orders, objects.MODE_DISPLAY.key}
    return {key: value for key, value in settings.items() if key not in passing}


def leave_at_rest(sdo: SdoAccess, rung: Rung) -> None:
    """Write a set-point that moves nothing; a position is where the joint stands now."""
    if rung.mode is Mode.VELOCITY:
        sdo.write(objects.VL_TARGET, 0)
    elif rung.set_points is SetPoints.VELOCITY:
        sdo.write(objects.TARGET_VELOCITY, 0)
    elif rung.mode is Mode.INTERPOLATED_POSITION:
        sdo.write(objects.INTERPOLATION_DATA, sdo.read(objects.POSITION))
    else:
        sdo.write(objects.TARGET_POSITION, sdo.read(objects.POSITION))


def give_back(sdo: SdoAccess, found: Mapping[str, int]) -> list[str]:
    """Bring every object of a snapshot back, in PRE-OPERATIONAL; return what could not be.

    What a drive refuses to take and reads as it was found has never been another: a run may have
    ended at that very refusal. When the drive no longer answers, the rest is not tried but listed.

    Parameters
    ----------
    sdo : SdoAccess
        Of a node in PRE-OPERATIONAL, without torque.
    found : mapping
        A snapshot, perhaps from a journal of a run that crashed.
    """
    pdos = sorted({int(key[2:6], 16) for key in found if _is_pdo(key) and key.endswith(":00")})
    plain = {setting_of(key): value for key, value in found.items() if not _is_pdo(key)}
    watch = {item: value for item, value in plain.items() if item.index == 0x1016}
    last = {item: plain[item] for item in plain if item == objects.HEARTBEAT_PRODUCER}
    rest = {item: plain[item] for item in reversed(plain) if item not in watch | last}
    steps = [
        *_setters(sdo, watch),
        *(_remapper(sdo, index - MAPPING_OFFSET, found) for index in pdos),
        *_setters(sdo, rest),
        *_setters(sdo, last),
    ]
    failures: list[str] = []
    for number, (name, step) in enumerate(steps):
        try:
            step()
        except DriverError as error:
            if _refused(error) and _stands(sdo, name, found):
                continue
            failures.append(f"{name}: {error.what}")
            if _is_silence(error):
                failures.extend(f"{left}: not tried" for left, _ in steps[number + 1 :])
                break
    return failures


def _setters(sdo: SdoAccess, values: Mapping[DriveObject, int]) -> list[_Step]:
    """Return one step for each setting; the two software limits make one step together."""
    steps: list[_Step] = []
    for item, value in values.items():
        if item not in _LIMITS:
            steps.append((str(item), _setter(sdo, item, value)))
        elif item == _LIMITS[0] and _LIMITS[1] in values:
            steps.append((str(item), _limits_setter(sdo, value, values[_LIMITS[1]])))
    return steps


def _setter(sdo: SdoAccess, item: DriveObject, value: int) -> Callable[[], dict[str, int]]:
    return lambda: {item.key: sdo.set(item, value)}


def _limits_setter(sdo: SdoAccess, low: int, high: int) -> Callable[[], dict[str, int]]:
    """Return a step that never lets the minimum exceed the maximum, which drives refuse."""

    def step() -> dict[str, int]:
        new = dict(zip(_LIMITS, (low, high), strict=True))
        upwards = low > sdo.read(objects.SOFTWARE_LIMIT_MAX)
        return {
            item.key: sdo.set(item, new[item]) for item in (_LIMITS[::-1] if upwards else _LIMITS)
        }

    return step


def _remapper(sdo: SdoAccess, communication_index: int, found: Mapping[str, int]) -> _Step:
    return (
        f"PDO 0x{communication_index:04X}",
        lambda: write_pdo(sdo, communication_index, found),
    )


def _is_pdo(key: str) -> bool:
    """Return whether a snapshot's key belongs to a PDO."""
    return 0x1400 <= int(key[2:6], 16) < 0x1C00


def _refused(error: DriverError) -> bool:
    """Return whether it was the drive that did not want what was written."""
    return isinstance(error, SdoError) and error.abort_code is not None


def _stands(sdo: SdoAccess, name: str, found: Mapping[str, int]) -> bool:
    """Return whether the objects of a step of that name read as they were found."""
    items = [setting_of(key) for key in found if not _is_pdo(key)]
    own = [item for item in items if str(item) == name]
    if own and own[0] in _LIMITS:
        own = [item for item in items if item in _LIMITS]
    try:
        return bool(own) and all(sdo.read(item) == found[item.key] for item in own)
    except DriverError:
        return False


def _is_silence(error: DriverError) -> bool:
    """Return whether an error means that the drive cannot be reached at all."""
    return isinstance(error, BusError) or (isinstance(error, SdoError) and error.abort_code is None)
