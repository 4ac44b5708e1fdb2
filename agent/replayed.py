"""What a recording says of itself when no joint moved for it: another recording was played.

The cycle writes it into the new recording's metadata under `KEY`, so that nobody takes a replay
for a second measurement.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from agent.errors import InputError

KEY = "replay"
SCHEMA = "stribeck.replay/1"


@dataclass(frozen=True)
class Replayed:
    """Which recording was played, and how the set-points compare with those it was driven with.

    Parameters
    ----------
    source, started_at : str
        The recording that was played: its file, and when it was made.
    compared, different : int
        Set-points that had recorded ones beside them; that were not among those.
    largest_difference_rad_s : float
        From the recorded ones, motor side.
    first_difference_s : float or None
        In the played recording's time; None where none differs.
    held : int
        Samples of standing before the recording's beginning and after its end.
    """

    source: str
    started_at: str
    compared: int
    different: int
    largest_difference_rad_s: float
    first_difference_s: float | None
    held: int

    @property
    def sentence(self) -> str:
        """Return what somebody who looks at the new recording has to know."""
        head = f"No joint moved: {self.source} was played."
        if not self.compared:
            return f"{head} It has no set-points that those of this cycle could be compared with."
        if not self.different or self.first_difference_s is None:
            return f"{head} All {self.compared} set-points are those that it was driven with."
        return (
            f"{head} {self.different} of {self.compared} set-points differ from those that it was "
            f"driven with, by up to {self.largest_difference_rad_s:.3g} rad/s, the first after "
            f"{self.first_difference_s:.2f} s: what was measured answers the recorded ones, not "
            "those of this cycle."
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {"schema": SCHEMA, **dataclasses.asdict(self)}

    @classmethod
    def from_metadata(cls, document: Mapping[str, Any], where: str) -> Replayed | None:
        """Return what a recording's metadata says, None where it is no replay of ours.

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
        except TypeError as error:
            raise InputError(
                f"{where}: what it says of a replay is incomplete: {error}."
            ) from error
