"""What is said of a drive that a run before this one had not given back.

A run that is killed leaves a journal of what it had found in the drive. The cycle that gives it
back says so: its recording's metadata has the objects under `KEY`, and an error has a note.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

KEY = "given_back_before"
JOURNAL_SUFFIX = ".found.json"
"""Of a journal's name: `.ROBOT-axisN.found.json`, beside the cell's recordings."""


def sentence(found: Mapping[str, int]) -> str:
    """Return what somebody has to know where these objects were given back: "0x6007:00" -> raw."""
    return (
        "A run before this one was ended before it gave the drive back: "
        f"{len(found)} of its objects were first set again as that run had found them."
    )


@contextlib.contextmanager
def noted(found: Mapping[str, int]) -> Iterator[None]:
    """Say of every failure inside that these objects had been given back before it."""
    try:
        yield
    except Exception as error:
        if found:
            error.add_note(sentence(found))
        raise


def said_in(extra: Mapping[str, object]) -> str:
    """Return the sentence for a recording with such metadata; nothing where nothing was left."""
    found = extra.get(KEY)
    return sentence(found) if isinstance(found, Mapping) else ""


def not_yet(folder: Path) -> list[str]:
    """Return a sentence for each journal that lies in a folder."""
    return [
        f"{journal} is there: a run has not given its drive back. Where none goes on, the cell's "
        "next cycle on that axis does so before anything else."
        for journal in sorted(folder.glob(f".*{JOURNAL_SUFFIX}"))
    ]
