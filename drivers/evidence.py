"""What a device leaves behind in a recording: what was found and set, counted and proven."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.values import Sample, SetPoints


@dataclass(frozen=True)
class AxisEvidence:
    """What `open` found and set, kept with the recording.

    Parameters
    ----------
    identity : mapping
        `vendor_id`, `product_code`, `revision`, `serial`, `name` as read.
    settings : mapping
        Every object that was read back after it was set, "0x6007:00" -> value.
    found : mapping
        The same objects as they were found, so that they can be restored.
    mode, mode_reason : str
        The mode of operation ("pv", "csp" ...) and why it is this one; empty where there is none.
    set_points : SetPoints
        What the drive is fed with.
    units : mapping
        What the drive's own units depend on (gear ratio, feed constant, polarity ...), as read.
    """

    identity: Mapping[str, int | str]
    settings: Mapping[str, int] = field(default_factory=dict)
    found: Mapping[str, int] = field(default_factory=dict)
    mode: str = ""
    mode_reason: str = ""
    set_points: SetPoints = SetPoints.VELOCITY
    units: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class SyncAccount:
    """How many samples were asked for and what became of them.

    Parameters
    ----------
    expected, received, lost : int
        SYNCs that were sent; that were answered; that were not, while somebody listened.
    late : int
        Answers that came after the next SYNC had been sent.
    jitter_s : float
        Standard deviation of the answers' delay, in seconds.
    duplicates, unmatched : int
        Answers that no SYNC was open for: the last answer once more; anything else.
    not_asked : int
        SYNCs that the computer should have sent by its own sample rate and did not.
    longest_gap_s : float
        Between two SYNCs, in seconds.
    dropped_by_kernel : int or None
        Frames, of whatever kind, that the kernel had no room for; None where nobody can tell.
    reader, stamps : str
        Who received ("process", "thread", "stepped"), who stamped ("kernel", "host").
    receive_buffer_bytes : int or None
        What the kernel granted; None where nobody asked.
    undecided : int
        Of the lost ones: an answer came that may have been theirs, and nobody could tell.
    doubtful : int
        Of the received ones: they may stand in their neighbour's place in time.
    doubtful_s : tuple of (float, float), or None
        When the SYNCs of all doubtful ones were sent, as intervals with both ends, at most a few
        hundred: on the clock that sends them, or in a recording's time. None where nobody says.
    changed : tuple of str
        What no longer read in the end as it was set, or as its units were, when the axis was
        opened: what the drive answered meanwhile may have been something else.
    """

    expected: int = 0
    received: int = 0
    lost: int = 0
    late: int = 0
    jitter_s: float = 0.0
    duplicates: int = 0
    unmatched: int = 0
    not_asked: int = 0
    longest_gap_s: float = 0.0
    dropped_by_kernel: int | None = None
    reader: str = ""
    stamps: str = ""
    receive_buffer_bytes: int | None = None
    undecided: int = 0
    doubtful: int = 0
    doubtful_s: tuple[tuple[float, float], ...] | None = None
    changed: tuple[str, ...] = ()


@dataclass(frozen=True)
class WatchdogProof:
    """What a drive did when it no longer heard our heartbeat, at standstill and under torque.

    Parameters
    ----------
    reacted : bool
        Whether it left operation enabled by itself, in time.
    timeout_s : float
        The silence after which it was told to react.
    still_enabled_s, reaction_s : float
        After our last heartbeat: until when it was seen enabled at least, and when it was first
        seen not to be; it reacted between the two. `reaction_s` is NaN where it did not.
    state : str
        Where it went, in CiA 402's words.
    emergencies : tuple of str
        What it sent meanwhile, as "0x8130".
    recovery : str
        What it needed to be ready again: "start", "fault reset" or "reset communication".
    """

    reacted: bool
    timeout_s: float
    still_enabled_s: float
    reaction_s: float
    state: str
    emergencies: tuple[str, ...]
    recovery: str


@dataclass(frozen=True)
class StopReport:
    """How a stop ended.

    Parameters
    ----------
    at_rest : bool
        True only when standstill was measured.
    samples : tuple of Sample
        What came while stopping.
    reason : str
        How it was stopped, and what went wrong on the way.
    loose_rad : float
        How far the motor moved meanwhile with no torque on it: coasted, or pulled by the arm's
        weight that no brake holds.
    unbraked : str
        What a drive did that was to brake, where its voltage was taken away for it; else empty.
    """

    at_rest: bool
    samples: tuple[Sample, ...]
    reason: str
    loose_rad: float = 0.0
    unbraked: str = ""
