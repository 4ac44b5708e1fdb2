"""The account of a recording's frames: how many were asked for, and what became of them.

The cycle writes it into the recording's metadata under `KEY`; whoever reads the recording, the
estimators among them, reads it back from there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.errors import InputError

KEY = "acquisition"
SCHEMA = "stribeck.acquisition/1"
_ROUNDING_S = 1e-7  # a file in text may round its times


@dataclass(frozen=True)
class Acquisition:
    """What became of every SYNC of a run, and how the answers were received.

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
        Who received, and who stamped: see `drivers.evidence.SyncAccount`.
    receive_buffer_bytes : int or None
        What the kernel granted to the receiving socket; None where nobody asked.
    undecided : int
        Of the lost ones: an answer came that may have been theirs, and nobody could tell.
    doubtful : int
        Of the received ones: they may stand in their neighbour's place in time.
    doubtful_s : tuple of (float, float), or None
        Intervals of the recording's `time_s`, both ends with them, in which all doubtful rows lie;
        None where nobody says.
    changed : tuple of str
        What somebody has changed in the drive meanwhile: see `drivers.evidence.SyncAccount`.

    Raises
    ------
    ValueError
        A count below zero, more answers than questions, an interval that ends before it begins.
    """

    expected: int
    received: int
    lost: int
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

    def __post_init__(self) -> None:
        object.__setattr__(self, "changed", tuple(self.changed))  # JSON has lists
        if self.doubtful_s is not None:
            spans = tuple((float(begin_s), float(end_s)) for begin_s, end_s in self.doubtful_s)
            object.__setattr__(self, "doubtful_s", spans)
            wrong = [span for span in spans if not 0.0 <= span[0] <= span[1]]
            if wrong:
                raise ValueError(f"doubtful_s must hold intervals from 0 on, got {wrong[0]}")
        for name, value in dataclasses.asdict(self).items():
            if isinstance(value, int | float) and not value >= 0:
                raise ValueError(f"{name} must not be below zero, got {value}")
        if self.received + self.lost > self.expected:
            raise ValueError(
                f"{self.received} answers and {self.lost} lost ones are more than the "
                f"{self.expected} that were asked for"
            )

    @property
    def lost_unexplained(self) -> int:
        """Return how many lost samples are not accounted for by frames that the kernel dropped."""
        return max(self.lost - (self.dropped_by_kernel or 0), 0)

    def doubts(self, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which rows are doubtful by their time, shape (n,); none where nobody says."""
        doubtful = np.zeros(time_s.shape, dtype=np.bool_)
        for begin_s, end_s in self.doubtful_s or ():
            doubtful |= (time_s >= begin_s - _ROUNDING_S) & (time_s <= end_s + _ROUNDING_S)
        return doubtful

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON; what nobody can tell is null."""
        return {"schema": SCHEMA, **dataclasses.asdict(self)}

    @classmethod
    def from_metadata(cls, document: Mapping[str, Any], where: str) -> Acquisition | None:
        """Return a recording's account, None where the recording has none of ours.

        Parameters
        ----------
        document : mapping
            The metadata's extra keys.
        where : str
            The recording, for messages.

        Raises
        ------
        InputError
            It is there, and cannot be right.
        """
        found = document.get(KEY)
        if not isinstance(found, Mapping) or found.get("schema") != SCHEMA:
            return None
        names = {field.name for field in dataclasses.fields(cls)}
        try:
            return cls(**{name: value for name, value in found.items() if name in names})
        except (TypeError, ValueError) as error:
            raise InputError(f"{where}: its account of frames cannot be right: {error}.") from error


def total(accounts: Sequence[Acquisition]) -> Acquisition | None:
    """Return the sum over recordings, None of none; jitter and gap are the largest.

    What one of them cannot tell, the sum cannot tell either; when in a recording rows are doubtful
    only that recording's own account says.
    """
    if len(accounts) < 2:
        return accounts[0] if accounts else None
    dropped = [a.dropped_by_kernel for a in accounts]
    buffers = [a.receive_buffer_bytes for a in accounts]
    return Acquisition(
        expected=sum(a.expected for a in accounts),
        received=sum(a.received for a in accounts),
        lost=sum(a.lost for a in accounts),
        late=sum(a.late for a in accounts),
        jitter_s=max(a.jitter_s for a in accounts),
        duplicates=sum(a.duplicates for a in accounts),
        unmatched=sum(a.unmatched for a in accounts),
        not_asked=sum(a.not_asked for a in accounts),
        longest_gap_s=max(a.longest_gap_s for a in accounts),
        dropped_by_kernel=None if None in dropped else sum(d or 0 for d in dropped),
        reader=", ".join(sorted({a.reader for a in accounts})),
        stamps=", ".join(sorted({a.stamps for a in accounts})),
        receive_buffer_bytes=None if None in buffers else min(b or 0 for b in buffers),
        undecided=sum(a.undecided for a in accounts),
        doubtful=sum(a.doubtful for a in accounts),
        changed=tuple(dict.fromkeys(each for a in accounts for each in a.changed)),
    )
