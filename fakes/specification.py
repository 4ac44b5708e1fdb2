"""What a fake joint is: one frozen value that JSON or TOML can hold."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from fakes.checks import require_positive
from fakes.friction import FrictionTruth
from fakes.joint import JointParameters
from fakes.plant import ServoParameters
from fakes.thermal import ThermalParameters

T = TypeVar("T")


@dataclass(frozen=True)
class DriveParameters:
    """The drive as its factory left it.

    Parameters
    ----------
    vendor_id, product_code, revision, serial : int
        Object 0x1018.
    rated_torque_mnm, max_torque_permille : int
        Objects 0x6076 and 0x6072: scale of the reported torque, and its limit.
    abort_connection_option : int
        Object 0x6007: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop.
    heartbeat_fault_sticks : bool
        As on an EPOS4: after a heartbeat fault, fault reset works only after NMT
        reset-communication.
    supported_modes : int
        Object 0x6502: mode n is bit n - 1.
    absent_objects : tuple of int
        Indices that this drive has not got, whatever our EDS says.
    rated_torque_reads_zero : bool
        Whether 0x6076 is there and says 0, as in many drives.
    """

    vendor_id: int = 0x00000000
    product_code: int = 0x00004020
    revision: int = 0x00010000
    serial: int = 0x00000001
    rated_torque_mnm: int = 5000
    max_torque_permille: int = 2000
    abort_connection_option: int = 1
    heartbeat_fault_sticks: bool = False
    supported_modes: int = 0b100
    absent_objects: tuple[int, ...] = ()
    rated_torque_reads_zero: bool = False

    def __post_init__(self) -> None:
        require_positive(self, "rated_torque_mnm", "supported_modes")
        if not 0 <= self.abort_connection_option <= 3:
            raise ValueError(
                f"abort_connection_option: expected 0 to 3, got {self.abort_connection_option}"
            )


@dataclass(frozen=True)
class FakeSpecification:
    """A fake: joint, servo loop, gearbox temperature and drive."""

    joint: JointParameters = field(default_factory=JointParameters)
    servo: ServoParameters = field(default_factory=ServoParameters)
    thermal: ThermalParameters = field(default_factory=ThermalParameters)
    drive: DriveParameters = field(default_factory=DriveParameters)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> FakeSpecification:
        """Return what a mapping describes; what it leaves out has its default.

        Raises
        ------
        ValueError
            For an unknown key, a wrong type or a value out of range, with its path.
        """
        return _build(cls, data, "fake")

    @classmethod
    def load(cls, path: Path) -> FakeSpecification:
        """Read a `.toml` or `.json` file."""
        text = path.read_text(encoding="utf-8-sig")
        return cls.from_mapping(json.loads(text) if path.suffix == ".json" else tomllib.loads(text))

    def factory_values(self) -> dict[tuple[int, int], int]:
        """Return the objects, by index and sub-index, that differ from drive to drive."""
        drive = self.drive
        return {
            (0x1018, 1): drive.vendor_id,
            (0x1018, 2): drive.product_code,
            (0x1018, 3): drive.revision,
            (0x1018, 4): drive.serial,
            (0x6060, 0): 3 if drive.supported_modes & 0b100 else 0,
            (0x6061, 0): 3 if drive.supported_modes & 0b100 else 0,
            (0x6502, 0): drive.supported_modes,
            (0x6007, 0): drive.abort_connection_option,
            (0x6072, 0): drive.max_torque_permille,
            (0x6076, 0): drive.rated_torque_mnm,
            (0x608F, 1): self.servo.encoder_counts_per_rev,
            (0x6092, 1): self.servo.encoder_counts_per_rev,
        }


def _build(cls: type[T], data: Mapping[str, Any], path: str) -> T:
    assert is_dataclass(cls)
    if not isinstance(data, Mapping):
        raise ValueError(f"{path}: expected a table, got {data!r}")
    hints = get_type_hints(cls)
    known = [f.name for f in fields(cls)]
    unknown = sorted(set(data) - set(known))
    if unknown:
        raise ValueError(f"{path}: expected keys among {known}, got {unknown}")
    values: dict[str, Any] = {}
    for name, value in data.items():
        wanted, where = hints[name], f"{path}.{name}"
        if is_dataclass(wanted):
            assert isinstance(wanted, type)
            values[name] = _build(wanted, value, where)
        elif wanted is float and type(value) is int:
            values[name] = float(value)
        elif wanted == tuple[int, ...] and isinstance(value, list | tuple):
            if not all(type(item) is int for item in value):
                raise ValueError(f"{where}: expected whole numbers, got {value!r}")
            values[name] = tuple(value)
        elif type(value) is not wanted:
            raise ValueError(f"{where}: expected {wanted.__name__}, got {value!r}")
        else:
            values[name] = value
    try:
        return cls(**values)
    except ValueError as error:
        raise ValueError(f"{path}.{error}") from error


@dataclass(frozen=True)
class Truth:
    """What an estimator should find on this fake now; the names are those of a twin."""

    inertia_kg_m2: float
    coulomb_nm: float
    viscous_nm_s_per_rad: float
    static_extra_nm: float
    stribeck_velocity_rad_s: float
    exponent: float
    gravity_sin_nm: float
    gravity_cos_nm: float
    gear_ratio: float
    gearbox_temperature_degc: float

    @classmethod
    def of(cls, joint: JointParameters, friction: FrictionTruth, temperature_degc: float) -> Truth:
        """Return the truth of a joint whose friction law is `friction` at a temperature."""
        return cls(
            inertia_kg_m2=joint.inertia_kg_m2,
            gravity_sin_nm=joint.gravity_sin_nm,
            gravity_cos_nm=joint.gravity_cos_nm,
            gear_ratio=joint.gear_ratio,
            gearbox_temperature_degc=temperature_degc,
            **asdict(friction),
        )
