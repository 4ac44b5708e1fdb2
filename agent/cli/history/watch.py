"""`stribeck watch`: friction followed on ordinary work; asks for a dedicated cycle when it must."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from agent.cli.terminal.exits import BAD_NEWS
from agent.cli.terminal.pictures import write_picture
from agent.cli.terminal.talk import talker
from agent.conclude.outcome import conclude, signals_of
from agent.errors import InputError, UsageError
from agent.identify.signals.preprocess import read_motion
from agent.monitor.observer.band import FEWEST_HEALTHY, HealthyBand, Watch, learn_band
from agent.monitor.observer.band import watch as watch_one
from agent.monitor.observer.learning import model_of
from agent.numbers import signed
from agent.record.reading import read_all
from agent.record.recording import Recording

SCHEMA = "stribeck.watch/1"


def run_watch(
    work: Sequence[str],
    dedicated: Sequence[str],
    healthy: int,
    false_rate: float,
    picture: Path | None = None,
    *,
    as_json: bool,
) -> None:
    """Follow friction over recordings of ordinary work and print what each says.

    Raises
    ------
    agent.errors.InputError
        The recordings cannot be used, are not of one axis, or carry no observer.
    """
    if not 0.0 < false_rate < 0.5:
        raise UsageError(f"--false-rate: expected a share from 0 to 0.5, got {false_rate:g}.")
    recordings = _in_order(read_all(work))
    reference = read_all(dedicated)
    band = _band(recordings, reference, healthy, false_rate)
    rest = recordings[healthy:]
    carried = [r.metadata.payload_kg for r in recordings[:healthy]]
    found = [
        _other_payload(r, carried, band) or watch_one(read_motion(signals_of(r)), band)
        for r in rest
    ]
    for why in band.set_aside:
        talker().print(f"Set aside: {why}")
    if picture is not None and any(w.bands_nm for w in found):
        from agent.report.figures.watch import figure_watch

        write_picture(picture, figure_watch(band, found))
    if as_json:
        typer.echo(json.dumps(_document(band, rest, found), indent=2, allow_nan=False))
    else:
        typer.echo(_text(band, rest, found))
    if found and found[-1].asks:
        raise typer.Exit(BAD_NEWS)


def _band(
    recordings: Sequence[Recording],
    reference: Sequence[Recording],
    healthy: int,
    false_rate: float,
) -> HealthyBand:
    joints = {(r.robot, r.axis, r.gear_ratio) for r in (*recordings, *reference)}
    if len(joints) > 1:
        raise InputError("These recordings are not all of one axis.", "Watch each axis by itself.")
    if len(recordings) < healthy:
        raise InputError(
            f"Not decidable yet: {len(recordings)} of {healthy} healthy recordings of work.",
            f"Record more, or lower --healthy (at least {FEWEST_HEALTHY}).",
        )
    motions = [read_motion(signals_of(r)) for r in recordings[:healthy]]
    talker().print(f"Learning from {healthy} recordings that are taken to be healthy ...")
    try:
        model = model_of(conclude(reference).estimate, motions)
        return learn_band(model, motions, false_rate)
    except ValueError as error:
        raise InputError(f"Not decidable: {error}.") from error


def _other_payload(
    recording: Recording, carried: Sequence[float | None], band: HealthyBand
) -> Watch | None:
    """Return why a recording under another payload is not judged; None where it may be.

    Inertia and gravity are those of the dedicated cycle: another payload would look like friction.
    """
    known = [kg for kg in carried if kg is not None]
    own = recording.metadata.payload_kg
    if own is None or not known or min(known) <= own <= max(known):
        return None
    span = f"{min(known):g}" if min(known) == max(known) else f"{min(known):g} to {max(known):g}"
    why = (
        f"{Path(recording.source).name}: the payload is {own:g} kg, in the healthy recordings "
        f"{span} kg: inertia and gravity are others"
    )
    speeds = tuple(share * band.model.top_rad_s for share in band.shares)
    return Watch(None, speeds, (), band.whiteness_threshold, None, (why,))


def _in_order(recordings: Sequence[Recording]) -> list[Recording]:
    """Return the recordings by when they started; as they came where that is not known."""
    known = all(r.metadata.started_at for r in recordings)
    return sorted(recordings, key=lambda r: r.metadata.started_at) if known else list(recordings)


def _document(
    band: HealthyBand, recordings: Sequence[Recording], found: Sequence[Watch]
) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "healthy": [s.name for s in band.seen],
        "false_rate": band.false_rate,
        "speeds_rad_s": [share * band.model.top_rad_s for share in band.shares],
        "follows_temperature": band.follows_temperature,
        "healthy_innovations_white": band.healthy_are_white,
        "whiteness_threshold": band.whiteness_threshold,
        "asks_now": found[-1].asks if found else None,
        "recordings": [
            {
                "recording": Path(r.source).name,
                "started_at": r.metadata.started_at,
                "asks": w.asks,
                "reasons": list(w.reasons),
                "rises_nm": None if w.seen is None else list(w.seen.rises_nm),
                "bands_nm": [list(ends) for ends in w.bands_nm],
                "whiteness": None if w.seen is None else w.seen.whiteness.statistic,
            }
            for r, w in zip(recordings, found, strict=True)
        ],
    }


def _text(band: HealthyBand, recordings: Sequence[Recording], found: Sequence[Watch]) -> str:
    low, high = (share * band.model.top_rad_s for share in band.shares)
    lines = [
        f"Friction above the healthy curve, N m, at {low:.3g} and {high:.3g} rad/s; a healthy "
        f"recording is called otherwise in {100.0 * band.false_rate:g} % of cases.",
        "",
        f"{'recording':<24} {'low':>8} {'healthy':>18} {'high':>8} {'healthy':>18} {'white':>7}",
    ]
    for r, w in zip(recordings, found, strict=True):
        name = Path(r.source).stem
        if w.seen is None or not w.bands_nm:
            lines.append(f"{name:<24} not decidable: {'; '.join(w.reasons)}")
            continue
        cells = [
            f"{signed(rise, '+.3f'):>8} {' to '.join(signed(end, '+.3f') for end in ends):>18}"
            for rise, ends in zip(w.seen.rises_nm, w.bands_nm, strict=True)
        ]
        white = "yes" if w.seen.whiteness.statistic <= w.whiteness_threshold else "no"
        mark = "  <- asks" if w.asks else ""
        lines.append(f"{name:<24} {' '.join(cells)} {white:>7}{mark}")
    if not band.healthy_are_white:
        lines += [
            "",
            "The healthy recordings' own innovations are coloured (a soft gear, ripple, noise with "
            "a memory): whiteness is judged against what they show.",
        ]
    return "\n".join([*lines, "", _last_word(found)])


def _last_word(found: Sequence[Watch]) -> str:
    if not found:
        return "Every recording was taken as healthy: name more to watch."
    last = found[-1]
    if last.asks is None:
        return f"Not decidable: {'; '.join(last.reasons)}."
    if not last.asks:
        return "Nothing calls for a dedicated cycle."
    return f"Run a dedicated cycle: {'; '.join(last.reasons)}."
