"""Check recordings against their content hashes, and verdicts against their recordings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from agent.errors import InputError
from agent.record.catalogue.files import recordings_below
from agent.record.reading import natural_key, read
from agent.record.seal import SUFFIX, broken, content, read_sums, seal_path
from agent.record.verdict_file import SUFFIX as VERDICT
from agent.record.verdict_file import Verdict, read_verdict, verdict_path, versions

_RELATIVE = 1e-6
"""How far a number may move between machines with one version: libraries round differently."""


@dataclass(frozen=True)
class Recomputed:
    """What this version concludes from a recording.

    Parameters
    ----------
    numbers : mapping of str to float
        What was identified, unit in the names; empty: not decidable.
    state : str or None
        By the joint's history, as far as its recordings are still there; None where nobody asked.
    """

    numbers: Mapping[str, float]
    state: str | None = None


Recompute = Callable[[Path, Verdict], Recomputed]
"""Conclude again from a recording, as the verdict on it did."""


@dataclass(frozen=True)
class Checked:
    """What became of one file: a recording, a seal whose recording is gone, or a verdict.

    Parameters
    ----------
    path : pathlib.Path
    holds : bool
        Whether it is what it should be.
    sentence : str
        What was found.
    sealed : bool
        Whether there was a content hash to hold it against.
    """

    path: Path
    holds: bool
    sentence: str
    sealed: bool = True


def verify(folder: Path, recompute: Recompute | None = None) -> tuple[Checked, ...]:
    """Check every recording below a folder, and every verdict.

    Parameters
    ----------
    folder : pathlib.Path
        Searched to its depth.
    recompute : callable, optional
        Compute each verdict again, too.

    Raises
    ------
    agent.errors.InputError
        The folder is none, or holds nothing to verify.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder.")
    recordings = recordings_below(folder)
    seals = _visible(folder, SUFFIX)
    verdicts = _visible(folder, VERDICT)
    if not (recordings or seals or verdicts):
        raise InputError(f"{folder}: holds no recording, no content hash and no verdict.")
    known = {seal_path(recording) for recording in recordings}
    checked = [_recording(recording) for recording in recordings]
    checked += [_lost(path) for path in seals if path not in known]
    by_verdict = {verdict_path(recording): recording for recording in recordings}
    checked += [_verdict(path, by_verdict.get(path), recompute) for path in verdicts]
    return tuple(checked)


def _visible(folder: Path, suffix: str) -> list[Path]:
    found = [
        path
        for path in folder.rglob(f"*{suffix}")
        if not any(part.startswith(".") for part in path.relative_to(folder).parts)
    ]
    return sorted(found, key=natural_key)


def _recording(path: Path) -> Checked:
    sealed = seal_path(path).exists()
    try:
        wrong = broken(path) if sealed else ""
        if not wrong:
            read(path)  # whole bytes of something that is no recording are no recording either
    except InputError as error:
        return Checked(path, False, str(error), sealed)
    if wrong:
        return Checked(path, False, f"{wrong}.")
    if not sealed:
        return Checked(path, True, f"{path}: readable, never sealed.", False)
    return Checked(path, True, f"{path}: as recorded.")


def _lost(seal: Path) -> Checked:
    """Judge a content hash without its recording."""
    try:
        names = ", ".join(read_sums(seal))
    except InputError as error:
        return Checked(seal, False, str(error))
    return Checked(seal, False, f"{seal} is there, but not the recording that it is of ({names}).")


def _verdict(path: Path, recording: Path | None, recompute: Recompute | None) -> Checked:
    try:
        verdict = read_verdict(path)
        if recording is None:
            text = f"{path}: its recording was removed; the verdict cannot be computed again."
            return Checked(path, True, text)
        found = content(recording).sha256
        if found != verdict.recording_sha256:
            return Checked(
                path,
                False,
                f"{path} stands on a recording with the hash {verdict.recording_sha256[:12]}..., "
                f"but {recording.name} has {found[:12]}....",
            )
        if recompute is None:
            return Checked(path, True, f"{path}: stands on its recording.")
        return _recomputed(path, verdict, recompute(recording, verdict))
    except InputError as error:
        return Checked(path, False, str(error))


def _recomputed(path: Path, verdict: Verdict, again: Recomputed) -> Checked:
    """Compare a verdict with what this version computes from the same file."""
    numbers = again.numbers
    by = f"made with stribeck {verdict.version}, computed again with {versions()['stribeck']}"
    moved = [
        f"{name} {_shown(verdict.numbers.get(name))} -> {_shown(numbers.get(name))}"
        for name in sorted({*verdict.numbers, *numbers})
        if not _same(verdict.numbers.get(name), numbers.get(name))
    ]
    if bool(numbers) != verdict.decidable:
        words = ("not decidable", "decidable")
        moved.insert(0, f"{words[verdict.decidable]} -> {words[bool(numbers)]}")
    if again.state is not None and again.state != verdict.state:
        moved.insert(0, f"state {verdict.state} -> {again.state}")
    if moved:
        return Checked(path, False, f"{path}: {'; '.join(moved)} ({by}).")
    return Checked(path, True, f"{path}: the same verdict again ({by}).")


def _same(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is other
    return math.isclose(one, other, rel_tol=_RELATIVE, abs_tol=1e-12)


def _shown(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g}"
