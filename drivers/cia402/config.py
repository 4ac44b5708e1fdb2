"""One axis's configuration: everything explicit, SI, motor side, checked when it is made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from drivers.cia402.scaling import Scaling, TemperatureSource

MODE_WORDS = ("pv", "csv", "vl", "csp", "ip", "pp")
"""What a cell may ask for, in the ladder's order (`drivers.cia402.modes`)."""


@dataclass(frozen=True)
class ExpectedIdentity:
    """Who should answer (object 0x1018); None where any value will do."""

    vendor_id: int | None = None
    product_code: int | None = None
    serial: int | None = None


@dataclass(frozen=True)
class ExpectedUnits:
    """What a drive's units depended on when its axis was last driven, and where that is kept."""

    values: Mapping[str, int]
    source: str


@dataclass(frozen=True)
class Cia402Config:
    """How one drive is reached, armed, supervised and read.

    Parameters
    ----------
    node_id, agent_node_id : int
        CANopen node ids of the drive and of this agent (the one whose heartbeat the drive watches).
    scaling : Scaling
        The drive's integers in SI.
    acceleration_rad_s2, deceleration_rad_s2, quick_stop_deceleration_rad_s2 : float
        Ramps of the drive in profile velocity mode (0x6083, 0x6084, 0x6085).
    software_limits_rad : tuple of float or None
        Motor angles for 0x607D; None for a drive that has no software limits.
    expected : ExpectedIdentity
        Compared before anything is written.
    expected_units : ExpectedUnits or None
        Compared before anything is written; None where the axis has not been driven before.
    temperature : TemperatureSource or None
        Mapped into TPDO2.
    abort_connection_option, quick_stop_option : int or None
        For 0x6007 (3: quick stop) and 0x605A (2: ramp down, then switch off); None for a drive
        that lacks the object.
    agent_heartbeat_period_s, agent_heartbeat_timeout_s : float
        How often `send` gives a heartbeat, and after how long without one the drive must react.
    heartbeat_consumer_subindex : int or None
        Entry of 0x1016 that is ours; None for a drive that watches nobody's heartbeat.
    drive_heartbeat_period_s, drive_heartbeat_timeout_s : float
        How often the drive gives its heartbeat (0x1017), and after how long we miss it.
    sync_timeout_s : float
        After this long an unanswered SYNC is given up; longer than the slowest answer ever takes.
    consecutive_lost_limit : int
        More unanswered SYNCs in a row than this end the run.
    sdo_timeout_s : float
        Wait for one SDO answer.
    sdo_attempts : int
        How often a read, or a write that may safely be repeated, is tried after time-outs.
    state_timeout_s : float
        Wait for an NMT state, a mode or a heartbeat.
    rest_velocity_rad_s, rest_samples : float, int
        Standstill: that many samples in a row no faster than that.
    stop_period_s : float
        SYNC period while `stop` waits for standstill, and that of a run: positions are
        interpolated over it.
    mode : str
        "auto", or a word of `drivers.cia402.modes.LADDER`.
    offered_modes : tuple of str or None
        Such words for a drive whose 0x6502 is missing or 0; None where nobody knows.
    move_acceleration_rad_s2 : float or None
        Ramps of the drive's own moves in profile position mode; None: `acceleration_rad_s2`.
    velocity_max_rad_s : float or None
        What a drive in velocity mode (vl) may do at most (0x6046); None leaves its own limit.
    has_deceleration, has_quick_stop_deceleration : bool
        False for a drive without 0x6084, which then brakes its moves by 0x6083, too, as CiA 402
        has it; or without 0x6085, whose quick stop brakes as its maker has set it.
    says_encoder_resolution : bool
        False for a drive whose 0x608F and 0x6092 do not say what its positions count.
    """

    node_id: int
    scaling: Scaling
    acceleration_rad_s2: float
    deceleration_rad_s2: float
    quick_stop_deceleration_rad_s2: float
    software_limits_rad: tuple[float, float] | None
    expected: ExpectedIdentity = ExpectedIdentity()
    temperature: TemperatureSource | None = None
    agent_node_id: int = 127
    abort_connection_option: int | None = 3
    quick_stop_option: int | None = 2
    agent_heartbeat_period_s: float = 0.05
    agent_heartbeat_timeout_s: float = 0.25
    heartbeat_consumer_subindex: int | None = 1
    drive_heartbeat_period_s: float = 0.1
    drive_heartbeat_timeout_s: float = 0.5
    sync_timeout_s: float = 0.05
    consecutive_lost_limit: int = 5
    sdo_timeout_s: float = 0.3
    sdo_attempts: int = 3
    state_timeout_s: float = 1.0
    rest_velocity_rad_s: float = 0.5
    rest_samples: int = 5
    stop_period_s: float = 0.002
    mode: str = "auto"
    offered_modes: tuple[str, ...] | None = None
    move_acceleration_rad_s2: float | None = None
    velocity_max_rad_s: float | None = None
    has_deceleration: bool = True
    has_quick_stop_deceleration: bool = True
    says_encoder_resolution: bool = True
    expected_units: ExpectedUnits | None = None

    def __post_init__(self) -> None:
        mistakes = [
            *self._wrong_modes(),
            *self._wrong_ids(),
            *self._wrong_times(),
            *self._wrong_motion(),
        ]
        if mistakes:
            raise ValueError("; ".join(mistakes))

    @property
    def missing_watchdog(self) -> str:
        """Return what the drive lacks to stop by itself when we fall silent; empty for nothing."""
        if self.heartbeat_consumer_subindex is None:
            return "consumer heartbeat (0x1016)"
        if not self.abort_connection_option:
            return "abort connection option (0x6007) that says what it does then"
        return ""

    @property
    def move_ramp_rad_s2(self) -> float:
        """Return the ramps of the drive's own moves."""
        return self.move_acceleration_rad_s2 or self.acceleration_rad_s2

    @property
    def agent_heartbeat_timeout_ms(self) -> int:
        """Return the drive's patience with our heartbeat as 0x1016 takes it."""
        return round(1000.0 * self.agent_heartbeat_timeout_s)

    @property
    def drive_heartbeat_period_ms(self) -> int:
        """Return the drive's heartbeat period as 0x1017 takes it."""
        return round(1000.0 * self.drive_heartbeat_period_s)

    @property
    def software_limits_counts(self) -> tuple[int, int] | None:
        """Return 0x607D's minimum and maximum in the drive's counts."""
        if self.software_limits_rad is None:
            return None
        ends = [self.scaling.position_counts(end) for end in self.software_limits_rad]
        return min(ends), max(ends)

    def _wrong_modes(self) -> list[str]:
        """Return what is wrong with the modes that are asked for or offered."""
        words = (self.mode, *(self.offered_modes or ()))
        return [
            f"mode must be auto or one of {', '.join(MODE_WORDS)}, got {word!r}"
            for word in words
            if word not in MODE_WORDS and (word != "auto" or word is not self.mode)
        ]

    def _wrong_ids(self) -> list[str]:
        """Return what is wrong with node ids and counts."""
        mistakes = [
            f"{name} must be 1 to 127, got {value}"
            for name, value in (("node_id", self.node_id), ("agent_node_id", self.agent_node_id))
            if not 1 <= value <= 127
        ]
        if self.node_id == self.agent_node_id:
            mistakes.append(f"node_id and agent_node_id must differ, both are {self.node_id}")
        names = (
            "consecutive_lost_limit",
            "sdo_attempts",
            "rest_samples",
            "heartbeat_consumer_subindex",
        )
        mistakes.extend(
            f"{name} must be at least 1, got {getattr(self, name)}"
            for name in names
            if getattr(self, name) is not None and getattr(self, name) < 1
        )
        return mistakes

    def _wrong_times(self) -> list[str]:
        """Return what is wrong with periods and time-outs."""
        names = (
            "agent_heartbeat_period_s",
            "agent_heartbeat_timeout_s",
            "drive_heartbeat_period_s",
            "drive_heartbeat_timeout_s",
            "sync_timeout_s",
            "sdo_timeout_s",
            "state_timeout_s",
            "stop_period_s",
        )
        mistakes = [
            f"{name} must be positive and finite, got {getattr(self, name)}"
            for name in names
            if not _positive(getattr(self, name))
        ]
        if mistakes:
            return mistakes
        for who in ("agent", "drive"):
            period_s = getattr(self, f"{who}_heartbeat_period_s")
            timeout_s = getattr(self, f"{who}_heartbeat_timeout_s")
            if timeout_s < 2.0 * period_s:
                mistakes.append(
                    f"{who}_heartbeat_timeout_s must be at least two periods of {period_s} s, "
                    f"got {timeout_s} s"
                )
            for name, value_s in (("period", period_s), ("timeout", timeout_s)):
                if not 1 <= round(1000.0 * value_s) <= 0xFFFF:
                    mistakes.append(
                        f"{who}_heartbeat_{name}_s must be 1 ms to 65.535 s, got {value_s} s"
                    )
        return mistakes

    def _wrong_motion(self) -> list[str]:
        """Return what is wrong with ramps and limits."""
        mistakes = []
        for name in (
            "acceleration_rad_s2",
            "deceleration_rad_s2",
            "quick_stop_deceleration_rad_s2",
            "move_acceleration_rad_s2",
        ):
            value = getattr(self, name)
            if value is None:
                continue
            if not _positive(value):
                mistakes.append(f"{name} must be positive and finite, got {value}")
                continue
            try:
                self.scaling.acceleration_units(value)
            except ValueError as error:
                mistakes.append(f"{name}: {error}")
        if not _positive(self.rest_velocity_rad_s):
            mistakes.append(
                f"rest_velocity_rad_s must be positive and finite, got {self.rest_velocity_rad_s}"
            )
        mistakes.extend(self._wrong_limits())
        return mistakes

    def _wrong_limits(self) -> list[str]:
        """Return what is wrong with the software limits."""
        if self.software_limits_rad is None:
            return []
        low_rad, high_rad = self.software_limits_rad
        if not (math.isfinite(low_rad) and math.isfinite(high_rad) and low_rad < high_rad):
            return [f"software_limits_rad must rise and be finite, got {self.software_limits_rad}"]
        try:
            counts = self.software_limits_counts
        except ValueError as error:
            return [f"software_limits_rad: {error}"]
        if counts is not None and counts[0] == counts[1]:
            return [f"software_limits_rad {self.software_limits_rad} are one count apart or less"]
        return []


def _positive(value: float) -> bool:
    return math.isfinite(value) and value > 0.0
