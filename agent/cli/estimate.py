"""`stribeck estimate` and `stribeck twin`: recordings in, an honest estimate out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import typer

from agent.cli.talk import talker
from agent.errors import InputError
from agent.identify.estimate import estimate, twin_from_estimate
from agent.identify.result import Estimate
from agent.identify.signals import Signals
from agent.record import Recording, read, read_all, write_text


def signals_of(recording: Recording) -> Signals:
    """Return a recording's arrays for the estimators."""
    return Signals.from_columns(
        recording.columns,
        recording.metadata.gear_ratio,
        name=recording.source,
        samples_lost=recording.metadata.samples_lost or 0,
    )


def run_estimate(
    patterns: Sequence[str], validation: str | None, report: Path | None, *, as_json: bool
) -> None:
    """Estimate from recordings and print the result."""
    recordings = read_all(patterns)
    signals = [signals_of(r) for r in recordings]
    unseen = signals_of(read(Path(validation))) if validation is not None else None
    result = estimate(signals, validation=unseen)
    if report is not None:
        from agent.cli.outcome import write_report

        write_report(report, result, signals, recordings)
        talker().print(f"Report: {report}")
    typer.echo(json.dumps(result.to_json(), indent=2) if as_json else summary(result))


def run_twin(patterns: Sequence[str], out: Path) -> None:
    """Identify the plain twin and write it."""
    recordings = read_all(patterns)
    joints = {(r.metadata.robot, r.metadata.axis, r.metadata.gear_ratio) for r in recordings}
    if len(joints) > 1:
        names = "; ".join(
            f"{robot} axis {axis}, gear {gear:g}" for robot, axis, gear in sorted(joints)
        )
        raise InputError(f"A twin is of one axis, these recordings are of several: {names}.")
    result = estimate([signals_of(r) for r in recordings])
    if not result.decidable or result.rigid_body is None:
        raise InputError(f"No twin can be identified: {'; '.join(result.reasons)}.")
    robot, axis, gear_ratio = joints.pop()
    twin = twin_from_estimate(result, robot=robot, axis=axis, gear_ratio=gear_ratio)
    write_text(out, twin.to_toml())
    typer.echo(str(out))
    talker().print(result.sentence)
