"""Register maps as data: what stands where in a device, how to read it, and who says so.

Frozen and validated values; nothing in them is guessed. `drivers.modbus.map_file` reads them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.modbus.codec import ByteOrder, Layout, WordOrder

SCHEMA = "stribeck.registers/1"
MOST_REGISTERS = 125  # in one request, by the Modbus application protocol

COILS, DISCRETE_INPUTS, HOLDING, INPUT = 1, 2, 3, 4
"""Function codes that read."""

RegisterType = Literal["u16", "i16", "u32", "i32", "f32", "u64", "i64", "f64", "bit"]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class QualityRegister(_Part):
    """Which other register says whether a value counts, and what it then holds."""

    name: str = Field(alias="register")
    good: tuple[int, ...] = Field(strict=False, min_length=1)
    mask: int = Field(default=0xFFFF, ge=1, le=0xFFFF)


class Register(_Part):
    """One value of a device.

    The physical value is ``raw * scale + offset``, in `unit`.
    """

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    address: int = Field(ge=0)
    function: Literal[1, 2, 3, 4] = 3
    type: RegisterType = "u16"
    unit: str = ""
    scale: Finite = 1.0
    offset: Finite = 0.0
    range: tuple[Finite, Finite] | None = Field(default=None, strict=False)
    sentinels: tuple[float, ...] = Field(default=(), strict=False)
    quality: QualityRegister | None = None
    writable: bool = False
    word_order: WordOrder | None = None
    byte_order: ByteOrder | None = None
    source: str = ""
    confirmed: Literal["read", "unconfirmed", "own"] | None = None
    note: str = ""

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        if self.scale == 0.0:
            raise ValueError("scale must not be 0")
        if self.range is not None and not self.range[0] < self.range[1]:
            raise ValueError(f"range must be [low, high], got {list(self.range)}")
        if (self.type == "bit") != (self.function in (COILS, DISCRETE_INPUTS)):
            raise ValueError("type 'bit' goes with function 1 or 2, numbers with 3 or 4")
        if self.writable and self.function not in (COILS, HOLDING):
            raise ValueError("only holding registers (3) and coils (1) are writable")
        if self.type != "bit":
            layout = Layout(self.type)
            wrong = [s for s in self.sentinels if not layout.holds(s)]
            if wrong:
                raise ValueError(f"sentinel {wrong[0]:g} can never be read as {self.type}")
        return self

    @property
    def size(self) -> int:
        """Return how many registers (or bits) it takes."""
        return 1 if self.type == "bit" else Layout(self.type).registers

    def physical(self, raw: float) -> float:
        """Return the value in `unit`."""
        return raw * self.scale + self.offset

    def raw(self, physical: float) -> float:
        """Return what the register holds for a value in `unit`; whole for whole types."""
        value = (physical - self.offset) / self.scale
        is_float = self.type in ("f32", "f64")
        return value if is_float else round(value)

    def is_sentinel(self, raw: float) -> bool:
        """Return whether `raw` means that there is no value."""
        return math.isnan(raw) or math.isinf(raw) or raw in self.sentinels


class Block(NamedTuple):
    """Neighbouring registers that one request reads."""

    function: int
    address: int  # as it goes over the wire
    size: int
    names: tuple[str, ...]


class RegisterMap(_Part):
    """All values of a device that we know, and how the device wants to be asked."""

    schema_: Literal["stribeck.registers/1"] = Field(alias="schema")
    device: str = Field(min_length=1)
    source: str = Field(min_length=1)
    confirmed: Literal["read", "unconfirmed", "own"]
    address_base: int = Field(default=0, ge=0)
    word_order: WordOrder = "high-first"
    byte_order: ByteOrder = "big"
    min_gap_ms: Annotated[float, Field(ge=0.0, le=10_000.0)] = 0.0
    one_per_request: bool = False
    trap: str = ""
    register_: tuple[Register, ...] = Field(alias="register", strict=False)

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        if not self.register_:
            raise ValueError("a map needs at least one [[register]]")
        names = [r.name for r in self.register_]
        problems = [f"two registers are called {n}" for n in sorted(_twice(names))]
        for register in self.register_:
            if not 0 <= register.address - self.address_base <= 0xFFFF - register.size + 1:
                problems.append(
                    f"{register.name}: address {register.address} with address_base "
                    f"{self.address_base} is outside of 0 to 65535"
                )
            quality = register.quality
            if quality is not None and quality.name not in names:
                problems.append(f"{register.name}: there is no register {quality.name!r}")
        if problems:
            raise ValueError("; ".join(problems))
        return self

    @property
    def registers(self) -> tuple[Register, ...]:
        """Return the registers in the order of the file."""
        return self.register_

    @property
    def min_gap_s(self) -> float:
        """Return the silence that the device wants around a request, in seconds."""
        return self.min_gap_ms * 1e-3

    def __getitem__(self, name: str) -> Register:
        """Return a register by its name; KeyError names those there are."""
        for register in self.register_:
            if register.name == name:
                return register
        known = ", ".join(r.name for r in self.register_)
        raise KeyError(f"{self.device} has no register {name!r}; it has {known}")

    def layout(self, register: Register) -> Layout:
        """Return how a register's number lies, with the map's orders where it has none."""
        if register.type == "bit":
            raise ValueError(f"{register.name} is a bit")
        return Layout(
            register.type,
            register.word_order or self.word_order,
            register.byte_order or self.byte_order,
        )

    def wire_address(self, register: Register) -> int:
        """Return the address that goes over the wire."""
        return register.address - self.address_base

    def with_quality(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return `names` and, behind each, the register that judges it."""
        wanted: dict[str, None] = {}
        for name in names:
            wanted[name] = None
            quality = self[name].quality
            if quality is not None:
                wanted[quality.name] = None
        return tuple(wanted)

    def blocks(self, names: Iterable[str]) -> tuple[Block, ...]:
        """Return the fewest requests that read `names` and nothing between them.

        An address that is in nobody's list may not exist, and reading it would fail the request,
        so only registers without a gap between them are read together.
        """
        chosen = sorted(
            (self[name] for name in names), key=lambda r: (r.function, self.wire_address(r))
        )
        blocks: list[Block] = []
        for register in chosen:
            at, end = self.wire_address(register), self.wire_address(register) + register.size
            last = blocks[-1] if blocks else None
            if (
                last is not None
                and not self.one_per_request
                and last.function == register.function
                and at <= last.address + last.size
                and end - last.address <= MOST_REGISTERS
            ):
                size = max(last.size, end - last.address)
                blocks[-1] = last._replace(size=size, names=(*last.names, register.name))
            else:
                blocks.append(Block(register.function, at, end - at, (register.name,)))
        return tuple(blocks)


@dataclass(frozen=True)
class RawValue:
    """What a register held: the registers themselves, and the number that they spell."""

    registers: tuple[int, ...]
    number: int | float


def decode_block(
    register_map: RegisterMap, block: Block, words: Sequence[int]
) -> dict[str, RawValue]:
    """Return the raw value of every register in a block that was read."""
    values = {}
    for name in block.names:
        register = register_map[name]
        start = register_map.wire_address(register) - block.address
        own = tuple(words[start : start + register.size])
        number = own[0] if register.type == "bit" else register_map.layout(register).decode(own)
        values[name] = RawValue(own, number)
    return values


def _twice(names: Sequence[str]) -> set[str]:
    return {name for name in names if names.count(name) > 1}
