"""Scripted faults: what goes wrong, and when, as a frozen and loadable value."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from fakes import wire_faults
from fakes.fault import Fault


@dataclass(frozen=True, kw_only=True)
class SwallowSync(Fault):
    """Do not answer `count` SYNCs; received PDOs still act."""

    kind: ClassVar[str] = "swallow-sync"
    count: int = 1


@dataclass(frozen=True, kw_only=True)
class DriveFault(Fault):
    """Report an error by EMCY and go to FAULT; default: over-temperature of the device."""

    kind: ClassVar[str] = "drive-fault"
    code: int = 0x4210
    register: int = 0x09


@dataclass(frozen=True, kw_only=True)
class HeartbeatStops(Fault):
    """Stop the drive's own heartbeat; everything else goes on."""

    kind: ClassVar[str] = "heartbeat-stops"


@dataclass(frozen=True, kw_only=True)
class Unplugged(Fault):
    """The bus cable is out: nothing is sent or received, the drive itself lives on."""

    kind: ClassVar[str] = "unplugged"


@dataclass(frozen=True, kw_only=True)
class PowerCut(Fault):
    """The supply is gone: silent, and without torque."""

    kind: ClassVar[str] = "power-cut"


@dataclass(frozen=True, kw_only=True)
class MapNotKept(Fault):
    """Accept a new mapping (0x1600.. or 0x1A00..), and fall back to the factory's unasked."""

    kind: ClassVar[str] = "map-not-kept"
    index: int = 0x1A00


@dataclass(frozen=True, kw_only=True)
class WrongIdentity(Fault):
    """Answer 0x1018 as another device."""

    kind: ClassVar[str] = "wrong-identity"
    vendor_id: int = 0x0000BEEF
    product_code: int = 0x0000DEAD


@dataclass(frozen=True, kw_only=True)
class SdoAborts(Fault):
    """Refuse every access to one object with an abort code."""

    kind: ClassVar[str] = "sdo-aborts"
    index: int
    subindex: int = 0
    code: int = 0x08000000


@dataclass(frozen=True, kw_only=True)
class SdoSilent(Fault):
    """Leave `count` requests for one object without any answer; 0 means all of them."""

    kind: ClassVar[str] = "sdo-silent"
    index: int
    subindex: int = 0
    count: int = 0


@dataclass(frozen=True, kw_only=True)
class VelocityRunaway(Fault):
    """Drive to a speed that nobody asked for; brake ramps still work if it `obeys_ramps`."""

    kind: ClassVar[str] = "velocity-runaway"
    velocity_rad_s: float = 400.0
    obeys_ramps: bool = True


@dataclass(frozen=True, kw_only=True)
class FrozenPosition(Fault):
    """Report the position of that moment from then on."""

    kind: ClassVar[str] = "frozen-position"


@dataclass(frozen=True, kw_only=True)
class IgnoresQuickStop(Fault):
    """Go on following set-points when a quick stop is ordered, whichever way the order comes."""

    kind: ClassVar[str] = "ignores-quick-stop"


@dataclass(frozen=True, kw_only=True)
class TakenOver(Fault):
    """Obey no controlword any more: somebody drives it locally, and statusword bit 9 says so."""

    kind: ClassVar[str] = "taken-over"


@dataclass(frozen=True, kw_only=True)
class BrakesSoftly(Fault):
    """Brake with a share of what 0x6084 and 0x6085 ask for, whatever is written there."""

    kind: ClassVar[str] = "brakes-softly"
    share: float = 0.02


@dataclass(frozen=True, kw_only=True)
class BrakeCloses(Fault):
    """The holding brake is closed with `brake_nm` (motor side), and the drive does not open it."""

    kind: ClassVar[str] = "brake-closes"
    brake_nm: float = 15.0


@dataclass(frozen=True, kw_only=True)
class TemperatureSentinel(Fault):
    """Report "no sensor" as gearbox temperature."""

    kind: ClassVar[str] = "temperature-sentinel"


@dataclass(frozen=True, kw_only=True)
class AdapterFails(Fault):
    """The agent's own CAN adapter fails as `fakes.fault_adapter` raises it.

    Parameters
    ----------
    code : str
        Name of the operating system's error; "" for an adapter that swallows frames silently.
    lasts_s : float
        Until it works again.
    """

    kind: ClassVar[str] = "adapter-fails"
    code: str = "ENETDOWN"
    lasts_s: float = math.inf


KINDS: dict[str, type[Fault]] = {
    cls.kind: cls
    for cls in (
        SwallowSync,
        DriveFault,
        HeartbeatStops,
        Unplugged,
        PowerCut,
        MapNotKept,
        WrongIdentity,
        SdoAborts,
        SdoSilent,
        VelocityRunaway,
        FrozenPosition,
        IgnoresQuickStop,
        TakenOver,
        BrakesSoftly,
        BrakeCloses,
        TemperatureSentinel,
        AdapterFails,
        wire_faults.Lost,
        wire_faults.Doubled,
        wire_faults.Swapped,
        wire_faults.Late,
        wire_faults.Stalled,
        wire_faults.Flipped,
        wire_faults.Short,
        wire_faults.Falsified,
        wire_faults.Injected,
    )
}


def fault_from_mapping(data: Mapping[str, Any]) -> Fault:
    """Return the fault that a mapping describes: ``{"kind": "swallow-sync", "at_sync": 500}``.

    Raises
    ------
    ValueError
        For an unknown kind or parameter, naming those that exist.
    """
    kind = data.get("kind")
    cls = KINDS.get(str(kind))
    if cls is None:
        raise ValueError(f"fault kind: expected one of {sorted(KINDS)}, got {kind!r}")
    parameters = {k: v for k, v in data.items() if k != "kind"}
    known = [f.name for f in fields(cls)]
    unknown = sorted(set(parameters) - set(known))
    if unknown:
        raise ValueError(f"{kind}: expected parameters among {known}, got {unknown}")
    try:
        return cls(**parameters)
    except TypeError as error:
        raise ValueError(f"{kind}: {error}") from error


class FaultPlayer:
    """Plays a script: hands each fault out once, when it begins.

    Parameters
    ----------
    script : iterable of Fault
        In any order.
    """

    def __init__(self, script: Iterable[Fault] = ()) -> None:
        self._waiting = list(script)

    def begin(self, elapsed_s: float, syncs: int) -> list[Fault]:
        """Return the faults that begin now, in the script's order."""
        if not self._waiting:
            return []
        begun = [f for f in self._waiting if f.has_begun(elapsed_s, syncs)]
        if begun:
            self._waiting = [f for f in self._waiting if f not in begun]
        return begun
