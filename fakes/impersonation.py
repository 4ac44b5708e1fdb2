"""What real drives can and lack, for the fake to play: written apart from the product's profiles.

From vendors' and projects' files: supported modes, whether 0x6007, 0x1016, 0x6076 and the ramps are
there, what ends a heartbeat fault. Where a drive has no 0x6007 the fake does nothing when its
master falls silent, which is the worst that one may do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from fakes.specification import DriveParameters, FakeSpecification

PP, VL, PV, TQ, HM, IP, CSP, CSV, CST = (1 << mode - 1 for mode in (1, 2, 3, 4, 6, 7, 8, 9, 10))
ABORT_CONNECTION, CONSUMER_HEARTBEAT, RATED_TORQUE, MODES = 0x6007, 0x1016, 0x6076, 0x6502
QUICK_STOP_OPTION, DECELERATION, QUICK_STOP_DECELERATION = 0x605A, 0x6084, 0x6085

_EVERY = PP | VL | PV | TQ | HM | IP | CSP | CSV | CST
_SCHUNK_LACKS = (
    *(ABORT_CONNECTION, RATED_TORQUE, QUICK_STOP_OPTION),
    *(DECELERATION, QUICK_STOP_DECELERATION),
)
"""Pilz' arm has Schunk's drives."""

DRIVES: Mapping[str, DriveParameters] = MappingProxyType(
    {
        "maxon-epos4": DriveParameters(
            abort_connection_option=3,
            supported_modes=PP | PV | HM | CSP | CSV | CST,
            absent_objects=(MODES,),
            rated_torque_reads_zero=True,
            heartbeat_fault_sticks=True,
        ),
        "nanotec-cl4-e": DriveParameters(
            abort_connection_option=0,
            supported_modes=_EVERY,
            absent_objects=(ABORT_CONNECTION, RATED_TORQUE),
        ),
        "elmo-gold": DriveParameters(
            abort_connection_option=1,
            supported_modes=PP | PV | TQ | HM | IP | CSP | CSV | CST,
            rated_torque_reads_zero=True,
        ),
        "ingenia-eve-xcr-c": DriveParameters(
            abort_connection_option=1,
            supported_modes=PP | PV | HM | CSP | CSV,
            absent_objects=(CONSUMER_HEARTBEAT,),
        ),
        "zeroerr-erob": DriveParameters(
            abort_connection_option=0,
            supported_modes=PP | PV | TQ | CSP | CSV | CST,
            absent_objects=(ABORT_CONNECTION,),
        ),
        "schunk-lwa4p": DriveParameters(
            abort_connection_option=0,
            supported_modes=PP | VL | IP,
            absent_objects=_SCHUNK_LACKS,
        ),
        "pilz-prbt": DriveParameters(
            abort_connection_option=0,
            supported_modes=PP | VL | IP,
            absent_objects=_SCHUNK_LACKS,
        ),
    }
)
"""By the name under which the product ships a profile for the same drive."""


def impersonated(name: str, specification: FakeSpecification | None = None) -> FakeSpecification:
    """Return a joint behind a drive that can what the named one can, and lacks what it lacks.

    Parameters
    ----------
    name : str
        A key of `DRIVES`.
    specification : FakeSpecification, optional
        The joint, and who its drive says it is.
    """
    given = specification or FakeSpecification()
    drive = replace(
        DRIVES[name],
        vendor_id=given.drive.vendor_id,
        product_code=given.drive.product_code,
        revision=given.drive.revision,
        serial=given.drive.serial,
        rated_torque_mnm=given.drive.rated_torque_mnm,
    )
    return replace(given, drive=drive)
