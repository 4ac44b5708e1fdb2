"""What stays of a cycle: a sealed recording, a verdict that can be made again, and their rows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from agent.cli.terminal.talk import talker
from agent.conclude.outcome import Conclusion, conclude
from agent.errors import AgentError
from agent.record.reading import read
from agent.record.seal import Seal, seal
from agent.record.verdict_file import Verdict, write_verdict
from agent.record.verify import Recomputed
from drivers.clock import wall_time_utc

if TYPE_CHECKING:
    from agent.record.catalogue.catalogue import RecordingRow

NUMBERS = (
    "coulomb_nm",
    "viscous_nm_s_per_rad",
    "inertia_kg_m2",
    "gravity_sin_nm",
    "gravity_cos_nm",
)


def keep(recording: Path, conclusion: Conclusion, url: str | None = None) -> Verdict:
    """Seal a recording, write the verdict beside it, and take both into the folder's catalogue.

    A catalogue that cannot be used is told and changes nothing: files are the truth, and
    `stribeck catalogue rebuild` makes it again.

    Raises
    ------
    agent.errors.InputError, agent.errors.StorageError
        The recording cannot be sealed, or the verdict not be written.
    """
    from agent.record.catalogue.catalogue import (
        Catalogue,  # SQLAlchemy: 0.4 s, once all has been recorded
    )

    sealed = seal(recording)
    verdict = verdict_of(recording, conclusion, sealed)
    write_verdict(recording, verdict)
    try:
        with Catalogue(recording.parent, url) as catalogue:
            catalogue.add(recording)
    except AgentError as error:
        talker().print(str(error))
    return verdict


def take(recording: Path, url: str | None = None, folder: Path | None = None) -> RecordingRow:
    """Seal a recording that somebody has brought, and take it into the catalogue.

    What is no recording, or not the folder's, gets no seal, nor where there is no catalogue.
    """
    from agent.record.catalogue.catalogue import Catalogue  # as above
    from agent.record.catalogue.rows import relative

    place = folder or recording.parent
    read(recording)
    relative(recording, place)
    with Catalogue(place, url) as catalogue:
        seal(recording)
        return catalogue.add(recording)


def verdict_of(recording: Path, conclusion: Conclusion, sealed: Seal) -> Verdict:
    """Return the verdict on one recording by itself; a baseline's comes from the monitor."""
    from agent.record.catalogue.rows import in_utc  # as above

    metadata = conclusion.recordings[0].metadata
    estimate = conclusion.estimate
    words = "; ".join(estimate.reasons)
    return Verdict(
        file=recording.name,
        recording_sha256=sealed.sha256,
        robot=metadata.robot,
        axis=metadata.axis,
        started_at=in_utc(metadata.started_at),
        made_at=wall_time_utc(),
        decidable=estimate.decidable,
        alarm=False,
        state="decidable" if estimate.decidable else "not decidable",
        sentence=estimate.sentence if estimate.decidable else f"Not decidable: {words}.",
        numbers=numbers_of(conclusion),
    )


def numbers_of(conclusion: Conclusion) -> dict[str, float]:
    """Return what was identified of the plain law and the rigid body; empty: not decidable."""
    estimate = conclusion.estimate
    if not estimate.decidable:
        return {}
    plain = next((m for m in estimate.friction_models if m.model == "coulomb-viscous"), None)
    body = estimate.rigid_body
    found = {**(body.parameters if body else {}), **(plain.parameters if plain else {})}
    return {n: float(found[n].value) for n in NUMBERS if n in found and found[n].identified}


def recompute(recording: Path, verdict: Verdict) -> Recomputed:
    """Conclude again from a recording, for `stribeck verify --recompute`.

    A verdict that stands on a baseline is judged again by the joint's recordings up to this one.
    """
    numbers = numbers_of(conclude([read(recording)]))
    if not verdict.baseline:
        return Recomputed(numbers)
    from agent.cli.history.verdict import history_of, state_of

    return Recomputed(numbers, state_of(recording, verdict, history_of(recording, verdict)))
