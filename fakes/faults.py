"""Scripted faults: what goes wrong, and when, as a frozen and loadable value."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar


@dataclass(frozen=True, kw_only=True)
class Fault:
    """What all faults share: when they begin.

    Parameters
    ----------
    at_s : float or None
        Seconds since the drive was switched on; 0 unless `at_sync` is given.
    at_sync : int or None
        The SYNC, counted from 1 while OPERATIONAL, with which it begins.
    """

    kind: ClassVar[str] = ""
    at_s: float | None = None
    at_sync: int | None = None

    def __post_init__(self) -> None:
        if self.at_s is not None and self.at_sync is not None:
            raise ValueError(f"{self.kind}: expected at_s or at_sync, got both")
        if self.at_s is not None and not self.at_s >= 0.0:
            raise ValueError(f"{self.kind}: at_s: expected 0 or more, got {self.at_s}")
        if self.at_sync is not None and self.at_sync < 1:
            raise ValueError(f"{self.kind}: at_sync: expected 1 or more, got {self.at_sync}")

    def has_begun(self, elapsed_s: float, syncs: int) -> bool:
        """Return whether its time has come."""
        if self.at_sync is not None:
            return syncs >= self.at_sync
        return elapsed_s >= (self.at_s or 0.0)


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


@dataclass(frozen=True, kw_only=True)
class WireFault(Fault):
    """What `fakes.fault_wire.Wire` does to frames between a drive and the bus.

    Parameters
    ----------
    lasts_s : float
        Seconds until the wire is sound again.
    identifiers : sequence of int
        Which frames; none means all of them.
    towards : str
        ``agent``, ``drive`` or ``both``.
    share : float
        Of these frames, 0 to 1.
    """

    kind: ClassVar[str] = "wire"
    lasts_s: float = math.inf
    identifiers: tuple[int, ...] = ()
    towards: str = "both"
    share: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "identifiers", tuple(self.identifiers))
        if self.towards not in ("agent", "drive", "both"):
            raise ValueError(f"{self.kind}: towards: expected agent, drive or both")
        if not (0.0 <= self.share <= 1.0 and self.lasts_s >= 0.0):
            raise ValueError(f"{self.kind}: expected 0 <= share <= 1 and lasts_s >= 0")


@dataclass(frozen=True, kw_only=True)
class Lost(WireFault):
    """Frames do not arrive."""

    kind: ClassVar[str] = "lost"


@dataclass(frozen=True, kw_only=True)
class Doubled(WireFault):
    """Frames arrive twice."""

    kind: ClassVar[str] = "doubled"


@dataclass(frozen=True, kw_only=True)
class Swapped(WireFault):
    """A frame arrives after the one behind it."""

    kind: ClassVar[str] = "swapped"


@dataclass(frozen=True, kw_only=True)
class Late(WireFault):
    """Frames arrive `delay_s` later, in their order."""

    kind: ClassVar[str] = "late"
    delay_s: float = 0.02


@dataclass(frozen=True, kw_only=True)
class Flipped(WireFault):
    """One bit of the data is wrong, as behind a gateway that makes a CRC of its own."""

    kind: ClassVar[str] = "flipped"


@dataclass(frozen=True, kw_only=True)
class Short(WireFault):
    """Only the first `keep` bytes arrive."""

    kind: ClassVar[str] = "short"
    keep: int = 3


@dataclass(frozen=True, kw_only=True)
class Falsified(WireFault):
    """The drive reports a wrong number: `size` bytes from `offset`, signed, low byte first.

    Parameters
    ----------
    change : str
        ``add`` the value, ``set`` it, ``multiply`` by it, or ``hold`` what was there first.
    """

    kind: ClassVar[str] = "falsified"
    offset: int = 0
    size: int = 2
    change: str = "set"
    value: int = 0


@dataclass(frozen=True, kw_only=True)
class Injected(WireFault):
    """Somebody else sends frames.

    Parameters
    ----------
    data : str
        Bytes in hexadecimal; "" for random ones, eight at most.
    frames_per_s : float
        How many; 0 for a single one.
    flavour : str
        ``data``, ``extended`` (29-bit identifier), ``remote`` or ``error``.
    """

    kind: ClassVar[str] = "injected"
    data: str = ""
    frames_per_s: float = 0.0
    flavour: str = "data"


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
        TemperatureSentinel,
        AdapterFails,
        Lost,
        Doubled,
        Swapped,
        Late,
        Flipped,
        Short,
        Falsified,
        Injected,
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


def fault_to_mapping(fault: Fault) -> dict[str, Any]:
    """Return the mapping that `fault_from_mapping` reads."""
    return {"kind": fault.kind} | {k: v for k, v in asdict(fault).items() if v is not None}


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
