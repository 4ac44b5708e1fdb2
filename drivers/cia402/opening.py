"""The checks of `open` that change nothing: who is there, is it healthy, can it do the job."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.modes import Choice, choose
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.words import State, error_words, state_of
from drivers.errors import (
    ConfigurationError,
    DriveFaultError,
    DriveStateError,
    IdentityError,
    NodeMissingError,
    SdoError,
)

_RATED_TORQUE_TOLERANCE = 0.001
"""0x6076 is whole mN m: a configured value may differ by its rounding, not by more."""

_FEWEST_COUNTS = 16
"""A drive that counts less in a motor turn does not count encoder increments."""


def identify(sdo: SdoAccess, config: Cia402Config, bus: str) -> dict[str, int | str]:
    """Return who answers under the node id, refusing anybody else than expected.

    Raises
    ------
    NodeMissingError
        Nobody answers.
    IdentityError
        Somebody else answers; expected and found are named.
    """
    try:
        sdo.read(objects.DEVICE_TYPE)
    except SdoError as error:
        if error.abort_code is None:
            raise NodeMissingError(
                f"Nobody answers under node id {config.node_id} on {bus}.",
                "Check the drive's power, its node id, the bitrate and the cable.",
            ) from error
    identity: dict[str, int | str] = {"vendor_id": sdo.read(objects.VENDOR_ID)}
    optional = {
        "product_code": objects.PRODUCT_CODE,
        "revision": objects.REVISION,
        "serial": objects.SERIAL_NUMBER,
    }
    for name, item in optional.items():
        value = sdo.read_optional(item)
        if value is not None:
            identity[name] = value
    text = sdo.read_text(*objects.DEVICE_NAME, "device name")
    if text is not None:
        identity["name"] = text
    _compare_identity(identity, config, bus)
    return identity


def refuse_unhealthy(sdo: SdoAccess, node_id: int) -> None:
    """Refuse a drive that is in fault, or that somebody has already given torque.

    Raises
    ------
    DriveFaultError
        Naming the fault; nobody but a person clears it.
    DriveStateError
        Operation is enabled, or the statusword spells no state.
    """
    statusword = sdo.read(objects.STATUSWORD)
    state = state_of(statusword)
    if state in (State.FAULT, State.FAULT_REACTION):
        code = sdo.read_optional(objects.ERROR_CODE) or 0
        why = error_words(code) if code else "no error code given"
        raise DriveFaultError(
            f"The drive at node {node_id} is in fault: {why}.",
            "A person must find the cause and clear the fault at the drive; the agent never does.",
            error_code=code,
        )
    if state is None:
        raise DriveStateError(
            f"The drive at node {node_id} gives statusword 0x{statusword:04X}, "
            "which is no state of CiA 402.",
            "Check that this node is a CiA 402 drive.",
        )
    if state is State.ENABLED:
        raise DriveStateError(
            f"The drive at node {node_id} already has operation enabled.",
            "Another program may be driving it: end that first.",
        )


def mode_for(sdo: SdoAccess, config: Cia402Config) -> Choice:
    """Return the mode for the run, by what the drive offers.

    Raises
    ------
    ConfigurationError
        As `drivers.cia402.modes.choose` refuses.
    """
    return choose(config, sdo.read_optional(objects.SUPPORTED_MODES))


def refuse_unable(sdo: SdoAccess, config: Cia402Config) -> None:
    """Refuse a drive with another rated torque than configured.

    Raises
    ------
    ConfigurationError
        Naming what was expected and what the drive says.
    """
    rated_mnm = sdo.read_optional(objects.RATED_TORQUE)
    if not rated_mnm:
        return  # absent or 0 in most drives: the configuration stands
    configured_mnm = 1000.0 * config.scaling.rated_torque_nm
    if abs(rated_mnm - configured_mnm) > max(0.5, _RATED_TORQUE_TOLERANCE * configured_mnm):
        raise ConfigurationError(
            f"The drive at node {config.node_id} has a rated torque of {rated_mnm / 1000.0} N m "
            f"(0x6076), the configuration says {config.scaling.rated_torque_nm} N m.",
            "Every torque would be scaled wrongly: find out which of the two is right.",
        )


def units_of(sdo: SdoAccess) -> dict[str, int]:
    """Return what the drive's units depend on, as far as it has words for that.

    However it refuses one of them: what cannot be read cannot be compared, and hides no other.
    """
    read: dict[str, int] = {}
    for item in objects.UNITS:
        try:
            read[item.key] = sdo.read(item)
        except SdoError as error:
            if error.abort_code is None:
                raise
    return read


def refuse_other_counts(config: Cia402Config, units: Mapping[str, int]) -> None:
    """Refuse a drive that says how many counts a motor turn has, and says another number.

    The joint would move by the factor too far and too fast, and every sample would agree. A drive
    is only taken at its word where its gear (0x6091) and factors (0x6093) leave one meaning: it
    then counts encoder increments (0x608F) or the feed of a turn (0x6092).

    Raises
    ------
    ConfigurationError
        Naming both numbers.
    """
    asked = config.scaling.encoder_counts_per_motor_rev
    if not config.says_encoder_resolution or any(
        _ratio(units, index) not in (None, 1.0) for index in (0x6091, 0x6093)
    ):
        return
    said = {index: _ratio(units, index) for index in (0x608F, 0x6092)}
    told = {i: counts for i, counts in said.items() if counts and counts >= _FEWEST_COUNTS}
    if told and all(abs(counts - asked) > 0.5 for counts in told.values()):
        index, counts = next(iter(told.items()))
        raise ConfigurationError(
            f"The drive at node {config.node_id} has {counts:.10g} counts in a motor turn "
            f"(0x{index:04X}), the configuration says {asked:.10g}.",
            "The joint would move too far or not far enough: find out which is right and put "
            "encoder_counts_per_motor_rev in line, or where this object of the drive means "
            "something else, set encoder_resolution = false under [axis.drive].",
        )


def _ratio(units: Mapping[str, int], index: int) -> float | None:
    """Return what an object's first part is to its second; None where it says nothing."""
    first, second = (units.get(f"0x{index:04X}:{part:02d}") for part in (1, 2))
    return first / second if first and second else None


def refuse_other_units(config: Cia402Config, units: Mapping[str, int]) -> None:
    """Refuse a drive that counts otherwise than when its axis was last driven.

    Positions, speeds and ramps then mean something else, and where all of them are on the same new
    scale nothing that the drive reports would show it: the joint moves farther, or the other way.

    Raises
    ------
    ConfigurationError
        Naming what has changed.
    """
    before = config.expected_units
    changed = [
        f"{objects.setting_of(key)} reads {value}, it was {before.values[key]}"
        for key, value in units.items()
        if before is not None and before.values.get(key, value) != value
    ]
    if before is not None and changed:
        raise ConfigurationError(
            f"The drive at node {config.node_id} counts in other units than when this axis was "
            f"last driven: {'; '.join(changed)}.",
            "Find out who changed it, and give the drive its units back. If the new ones are to "
            "stay, bring encoder_counts_per_motor_rev, velocity_unit and direction in line with "
            f"them; if these still hold, remove {before.source}. Then drive a contour check.",
        )


def refuse_wider(config: Cia402Config, found: Mapping[str, int]) -> None:
    """Refuse a window beyond the software limits that somebody has set in the drive.

    They would be overwritten for the run, and with them what holds the joint off a stop or a hose.
    The usual reason is another one: a count, direction or zero of the cell that is wrong, which
    nothing that the drive reports would show.

    Parameters
    ----------
    config : Cia402Config
        Its software limits, in rad on the motor.
    found : mapping
        The snapshot taken before anything is written.

    Raises
    ------
    ConfigurationError
        Naming both.
    """
    wanted = config.software_limits_counts
    low, high = (found.get(item.key, 0) for item in objects.SOFTWARE_LIMITS)
    if wanted is None or low >= high:  # equal, mostly 0: the drive has none
        return
    if low - 1 <= wanted[0] and wanted[1] <= high + 1:
        return
    raise ConfigurationError(
        f"The drive at node {config.node_id} has software limits of {low} to {high} counts "
        f"(0x607D); the cell's window is {wanted[0]} to {wanted[1]} counts and goes beyond them.",
        "Check encoder_counts_per_motor_rev, gear_ratio, direction and zero_position_counts, then "
        "the window; only whoever set up the drive may widen its limits.",
    )


def _compare_identity(identity: dict[str, int | str], config: Cia402Config, bus: str) -> None:
    """Refuse an identity that differs from the expected one."""
    expected = {
        "vendor_id": config.expected.vendor_id,
        "product_code": config.expected.product_code,
        "serial": config.expected.serial,
    }
    wrong = [
        f"{name.replace('_', ' ')} expected {_shown(value)}, found {_shown(identity.get(name))}"
        for name, value in expected.items()
        if value is not None and identity.get(name) != value
    ]
    if wrong:
        raise IdentityError(
            f"Another device than expected answers under node id {config.node_id} on {bus}"
            f" (it calls itself {identity.get('name', 'nothing')!r}): {'; '.join(wrong)}.",
            "Check which drive is plugged in, and the cell description.",
        )


def _shown(value: int | str | None) -> str:
    """Return an identity's number as plates and cells have it, and as manuals print it."""
    return f"{value} (0x{value:X})" if isinstance(value, int) else "none"
