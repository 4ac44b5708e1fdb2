"""`stribeck estimate` and `stribeck twin`: recordings in, an honest estimate out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import typer

from agent.cli.identify.summary import summary
from agent.cli.identify.twin_file import check_twin_place
from agent.cli.terminal.talk import talker
from agent.conclude.driven import driven
from agent.conclude.outcome import Conclusion, conclude
from agent.errors import InputError
from agent.identify.estimate import twin_from_estimate
from agent.identify.rigid.forward import in_words
from agent.physics.learnt_over import noted
from agent.physics.twin import format_twin
from agent.record.atomic import publish
from agent.record.reading import read, read_all


def run_estimate(
    patterns: Sequence[str], validation: str | None, report: Path | None, *, as_json: bool
) -> None:
    """Estimate from recordings and print the result."""
    unseen = read(validation) if validation is not None else None
    conclusion = conclude(read_all(patterns), unseen)
    if report is not None:
        conclusion.write_report(report)
        talker().print(f"The report is in {report}.")
    if as_json:
        typer.echo(conclusion.json())
        return
    if not conclusion.estimate.decidable:
        typer.echo(_undecided(conclusion))
        return
    typer.echo(summary(conclusion.estimate))
    validated = conclusion.estimate.validation
    if validated is not None and validated.position is not None:
        words = in_words(validated.position)
        typer.echo(f"\nPosition on {validated.recording}: {words}.")


def _undecided(conclusion: Conclusion) -> str:
    """Return why nothing is identified, and what to do instead; no numbers of a law."""
    lines = ["Not decidable, friction is not identified:"]
    lines += [f"  - {reason}" for reason in conclusion.estimate.reasons]
    lines += ["", "What to do instead:", *(f"  - {step}" for step in conclusion.next_steps())]
    return "\n".join(lines)


def run_twin(patterns: Sequence[str], out: Path) -> None:
    """Identify the plain twin and write it.

    Raises
    ------
    agent.errors.InputError
        Where the recordings do not carry a twin.
    agent.errors.StorageError
        Where `out` holds what a person wrote.
    """
    check_twin_place(out)
    conclusion = conclude(read_all(patterns))
    metadata = conclusion.recordings[0].metadata
    try:
        twin = twin_from_estimate(
            conclusion.estimate,
            robot=metadata.robot,
            axis=metadata.axis,
            gear_ratio=metadata.gear_ratio,
        )
    except ValueError as error:
        raise InputError(f"No twin is written: {str(error).rstrip('.')}.") from error
    ranges = noted(driven(conclusion.recordings))
    twin = replace(twin, extra={**twin.extra, **ranges})
    publish({out: format_twin(twin).encode()}, overwrite=True)
    talker().print(conclusion.estimate.sentence)
    for note in conclusion.estimate.notes:
        talker().print(f"Note: {note}.")
    missing = twin.extra.get("not_identified")
    if isinstance(missing, list):
        talker().print(
            f"Not identified, and 0 in the twin: {', '.join(missing)}. What the joint has of it is "
            "missing from every prediction."
        )
    typer.echo(str(out))
