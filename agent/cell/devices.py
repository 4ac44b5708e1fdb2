"""CELL.toml's devices beside the drive: where a temperature comes from, frozen and validated."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationInfo,
    model_validator,
)

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class Part(BaseModel):
    """A part of the cell: frozen, strict about keys and about what is a number."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def beside_the_cell(name: str, info: ValidationInfo) -> str:
    """Return a map's file relative to the cell's own; a shipped map's name stays as it is."""
    folder = info.context.get("folder") if isinstance(info.context, dict) else None
    is_file = name.endswith(".toml")
    return str(Path(folder) / name) if is_file and folder is not None else name


MapName = Annotated[str, Field(min_length=1), AfterValidator(beside_the_cell)]


class ModbusPlace(Part):
    """Where a Modbus device is: `tcp` or `rtu`, never both.

    A serial line has one owner: two devices on one line cannot both be named.
    """

    map: MapName
    tcp: str | None = Field(default=None, pattern=r"^[^:\s]+:\d{1,5}$")
    rtu: str | None = Field(default=None, min_length=1)
    baudrate: int = Field(default=19_200, ge=300)
    parity: Literal["N", "E", "O"] = "E"
    stopbits: Literal[1, 2] = 1
    device_id: int = Field(default=1, ge=0, le=255)

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.tcp is None) == (self.rtu is None):
            raise ValueError("give either tcp (HOST:PORT) or rtu (a serial port)")
        return self


class Sampled(Part):
    """How often a slow device is read, and how old its newest value may be."""

    period_s: Positive = 0.5
    timeout_s: Positive = 0.3
    age_max_s: Positive = 3.0

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.age_max_s < self.period_s + self.timeout_s:
            raise ValueError("age_max_s must be at least period_s + timeout_s")
        return self


class ModbusTemperature(ModbusPlace, Sampled):
    """A gearbox temperature in a register of a Modbus device."""

    kind: Literal["modbus"]
    register_name: str = Field(alias="register", min_length=1)


class AdamTemperature(Sampled):
    """A gearbox temperature from an ADAM-style module on a serial line."""

    kind: Literal["adam"]
    port: str = Field(min_length=1)
    baudrate: int = Field(default=9600, ge=300)
    address: int = Field(default=1, ge=0, le=255)
    channel: int = Field(default=0, ge=0, le=7)
    checksum: bool = True


class Cia404Temperature(Sampled):
    """A gearbox temperature from a CiA 404 RTD node on the cell's CAN bus."""

    kind: Literal["cia404"]
    node_id: int = Field(ge=1, le=127)
    channel: int = Field(default=1, ge=1, le=254)


class ModbusRelease(ModbusPlace):
    """The release of the cell's PLC over Modbus; see docs/modbus.md."""

    kind: Literal["modbus"]
    map: MapName = "cell-release"
    period_s: Positive = 0.05
    timeout_s: Positive = 0.1
    age_max_s: Positive = 0.4
    wait_s: Positive = 10.0

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.age_max_s < self.period_s + self.timeout_s:
            raise ValueError("age_max_s must be at least period_s + timeout_s")
        return self


class ContactRelease(Part):
    """The release of the cell as an input of a CiA 401 node on the cell's CAN bus."""

    kind: Literal["can-input"]
    node_id: int = Field(ge=1, le=127)
    bit: int = Field(default=0, ge=0, le=7)
    age_max_s: Positive = 0.3
    wait_s: Positive = 10.0


Release = Annotated[ModbusRelease | ContactRelease, Field(discriminator="kind")]


class Job(ModbusPlace):
    """A robot controller that runs the stair itself, reached over Modbus; see docs/modbus.md."""

    kind: Literal["modbus"]
    map: MapName = "robot-job"
    alive_timeout_s: Positive = 0.5
    timeout_s: Positive = 0.15
    gearbox_temperature: bool = False  # whether the controller measures one; it must then be valid

    @model_validator(mode="after")
    def _silence_is_noticed(self) -> Self:
        if self.alive_timeout_s < 2.0 * self.timeout_s:
            raise ValueError("alive_timeout_s must be at least twice timeout_s")
        if self.alive_timeout_s > 5.0:
            raise ValueError("alive_timeout_s may be 5 s at most")
        return self


Temperature = Annotated[
    ModbusTemperature | AdamTemperature | Cia404Temperature, Field(discriminator="kind")
]


def shared_places(
    drive_node: int | None,
    temperature: Temperature | None,
    job: Job | None,
    release: Release | None,
) -> tuple[str, ...]:
    """Return what two devices of one axis would have to share, in words; empty is well.

    A serial port has one owner, and a CAN node is one device.
    """
    ports: list[tuple[str, str]] = []
    nodes: list[tuple[int, str]] = []
    if drive_node is not None:
        nodes.append((drive_node, "the drive"))
    if isinstance(temperature, AdamTemperature):
        ports.append((temperature.port, "temperature"))
    elif isinstance(temperature, Cia404Temperature):
        nodes.append((temperature.node_id, "temperature"))
    if isinstance(release, ContactRelease):
        nodes.append((release.node_id, "release"))
    for place, what in ((temperature, "temperature"), (job, "job"), (release, "release")):
        if isinstance(place, ModbusPlace) and place.rtu is not None:
            ports.append((place.rtu, what))
    return (
        *_twice(ports, "the serial port {0} has one owner, and {1} both want it"),
        *_twice(nodes, "node {0} is one device, and {1} both claim it"),
    )


def _twice(claims: Sequence[tuple[str | int, str]], sentence: str) -> list[str]:
    """Return a sentence for everything that is claimed more than once."""
    found = []
    for claimed in dict.fromkeys(c for c, _ in claims):
        who = [what for c, what in claims if c == claimed]
        if len(who) > 1:
            found.append(sentence.format(claimed, " and ".join(who)))
    return found
