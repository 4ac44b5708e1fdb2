"""The mode ladder: which modes can drive a cycle, in which order they are tried, and why this one.

Torque and homing modes are not on it: they are never used. The order is by what the PC must do in
time. In pv the drive ramps behind our stream; in csv and vl our stream is the ramp; in csp and ip a
set-point that comes late is a jerk; in pp the drive makes each pass by its own profile, which a
robot controller offers where nothing else is left, and which is bounded: it ends by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

from drivers.cia402.config import Cia402Config
from drivers.cia402.words import Mode, supported_mode_names, supports_mode
from drivers.errors import ConfigurationError
from drivers.ports import SetPoints

AUTO = "auto"


@dataclass(frozen=True)
class Rung:
    """One mode that can drive a cycle.

    Parameters
    ----------
    word : str
        What a cell calls it.
    mode : Mode
        For 0x6060.
    set_points : SetPoints
        What it is fed with.
    follow_bits : int
        Bits that the controlword needs besides "enable operation" for the drive to follow: in vl
        ramp enabled, unlocked and fed (4 to 6), in ip interpolation (4).
    """

    word: str
    mode: Mode
    set_points: SetPoints
    follow_bits: int = 0

    @property
    def is_bounded(self) -> bool:
        """Return whether a motion ends by itself when nobody says anything any more."""
        return self.set_points is SetPoints.MOVE


LADDER = (
    Rung("pv", Mode.PROFILE_VELOCITY, SetPoints.VELOCITY),
    Rung("csv", Mode.CYCLIC_VELOCITY, SetPoints.VELOCITY),
    Rung("vl", Mode.VELOCITY, SetPoints.VELOCITY, follow_bits=0x70),
    Rung("csp", Mode.CYCLIC_POSITION, SetPoints.POSITION),
    Rung("ip", Mode.INTERPOLATED_POSITION, SetPoints.POSITION, follow_bits=0x10),
    Rung("pp", Mode.PROFILE_POSITION, SetPoints.MOVE),
)
RUNGS = MappingProxyType({rung.word: rung for rung in LADDER})


@dataclass(frozen=True)
class Choice:
    """The mode of a run, and why it is this one."""

    rung: Rung
    reason: str


def choose(config: Cia402Config, supported_modes: int | None) -> Choice:
    """Return the mode for a run.

    Parameters
    ----------
    config : Cia402Config
        `mode` asks for one or for "auto"; `offered_modes` is what the drive's manual says, for one
        whose 0x6502 is missing or 0.
    supported_modes : int or None
        0x6502; None where the drive has no such object.

    Raises
    ------
    ConfigurationError
        The drive does not offer what is asked for, or the loss of the agent would leave it moving.

    Notes
    -----
    By itself the ladder takes a mode that goes on without us only where the drive's reaction to our
    silence can be set (0x1016 and 0x6007), or where there is no bounded one. A cell may ask for one
    where 0x6007 is missing. Whether the drive stops all the same, the proof of its watchdog shows
    before anything moves. A drive without 0x1016 cannot miss us: it is never streamed to.
    """
    offered, source = _offered(config, supported_modes)
    if config.mode != AUTO:
        rung = RUNGS[config.mode]
        if rung not in offered:
            raise _not_offered(config, rung, supported_modes, source)
        if not rung.is_bounded and config.heartbeat_consumer_subindex is None:
            raise _unwatched(config, rung)
        return Choice(rung, f"{rung.word}: the cell asks for it; {source}")
    for rung in offered:
        if rung.is_bounded or not config.missing_watchdog:
            return Choice(rung, _why(config, rung, offered, source))
    if offered:
        if config.heartbeat_consumer_subindex is None:
            raise _unwatched(config, offered[0])
        rung = offered[0]
        return Choice(
            rung,
            f"{rung.word}: the drive has no {config.missing_watchdog}, and no pp to be bounded by; "
            f"only the proof of its watchdog lets it move; {source}",
        )
    raise ConfigurationError(
        f"The drive at node {config.node_id} has no profile velocity mode and no other of "
        f"{', '.join(r.word for r in LADDER)}; {source}.",
        "This axis cannot be driven by this driver.",
    )


def _offered(config: Cia402Config, supported_modes: int | None) -> tuple[list[Rung], str]:
    """Return the rungs that the drive has, in the ladder's order, and who says so."""
    if supported_modes:
        has = [r for r in LADDER if supports_mode(supported_modes, r.mode)]
        names = supported_mode_names(supported_modes)
        return has, f"it offers {names} (0x6502 reads 0x{supported_modes:08X})"
    says = "absent" if supported_modes is None else "0"
    if config.offered_modes is not None:
        has = [r for r in LADDER if r.word in config.offered_modes]
        return has, f"0x6502 is {says}, its profile says {', '.join(r.word for r in has)}"
    taken = RUNGS["pv" if config.mode == AUTO else config.mode]
    return [taken], f"0x6502 is {says}; that the drive has it, 0x6061 has to say"


def _why(config: Cia402Config, rung: Rung, offered: list[Rung], source: str) -> str:
    """Return why the ladder ends on this rung."""
    if rung is offered[0]:
        above = [r.word for r in LADDER[: LADDER.index(rung)]]
        before = f", {', '.join(above)} being missing" if above else ""
        return f"{rung.word}: first of the ladder{before}; {source}"
    passed = ", ".join(r.word for r in offered[: offered.index(rung)])
    return (
        f"{rung.word}: {passed} would go on if the agent died, because the drive has no "
        f"{config.missing_watchdog}; {source}"
    )


def _not_offered(
    config: Cia402Config, rung: Rung, supported_modes: int | None, source: str
) -> ConfigurationError:
    name = rung.mode.name.lower().replace("_", " ")
    return ConfigurationError(
        f"The drive at node {config.node_id} has no {name} mode ({rung.word}); {source}.",
        'Let the cell say mode = "auto", or one that the drive offers.'
        if supported_modes
        else "Look into the drive's manual, and let the cell name a mode that it offers.",
    )


def _unwatched(config: Cia402Config, rung: Rung) -> ConfigurationError:
    return ConfigurationError(
        f"In mode {rung.word} the drive at node {config.node_id} would go on if the agent died: "
        f"it has no {config.missing_watchdog}.",
        "Only profile position (pp) is for such a drive: each of its moves ends by itself.",
    )
