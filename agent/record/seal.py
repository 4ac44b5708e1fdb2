"""A recording is written once: its content hash stands beside it, and its files lose the write bit.

``NAME.parquet.sha256`` has the form of `sha256sum`, so that any machine can check it without this
product (``sha256sum -c NAME.parquet.sha256``); a CSV recording has two lines, its side file's too.
"""

from __future__ import annotations

import hashlib
import re
import stat
from dataclasses import dataclass
from pathlib import Path

from agent.errors import InputError, StorageError
from agent.record.atomic import publish, storage_error
from agent.record.reading import CSV, side_file
from drivers.errors import why_unreadable

SUFFIX = ".sha256"
_LINE = re.compile(r"^([0-9a-f]{64}) [ *](.+)$")
_BLOCK_BYTES = 1 << 20
_WRITE_BITS = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


@dataclass(frozen=True)
class Seal:
    """What a recording's files hold.

    Parameters
    ----------
    sha256 : str
        The recording's content hash: of its one file, or of a CSV file followed by its side file.
    sums : mapping of str to str
        File name to hash, as the file beside the recording says it.
    size_bytes : int
        Of all its files.
    """

    sha256: str
    sums: dict[str, str]
    size_bytes: int


def seal_path(recording: Path) -> Path:
    """Return where a recording's content hash stands."""
    return recording.with_name(recording.name + SUFFIX)


def files_of(recording: Path) -> tuple[Path, ...]:
    """Return the files that a recording is made of."""
    if recording.suffix.lower() == CSV:
        return recording, side_file(recording)
    return (recording,)


def content(recording: Path) -> Seal:
    """Hash a recording as it is on the disk.

    Raises
    ------
    agent.errors.InputError
        It cannot be read.
    """
    whole, sums, size = hashlib.sha256(), {}, 0
    for path in files_of(recording):
        own = hashlib.sha256()
        try:
            with path.open("rb") as file:
                while block := file.read(_BLOCK_BYTES):
                    own.update(block)
                    whole.update(block)
                    size += len(block)
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from error
        sums[path.name] = own.hexdigest()
    return Seal(whole.hexdigest(), sums, size)


def seal(recording: Path) -> Seal:
    """Write the content hash beside a recording and take the write bit from its files.

    A recording that is sealed already is checked instead: its hash is never written anew.

    Raises
    ------
    agent.errors.InputError
        It cannot be read, or it is not what its seal says.
    agent.errors.StorageError
        The hash cannot be written, or the write bit cannot be taken.
    """
    found = content(recording)
    beside = seal_path(recording)
    if beside.exists():
        wrong = broken(recording, found)
        if wrong:
            raise InputError(
                f"{wrong}.", "Restore the file from a copy; a sealed recording is never changed."
            )
    else:
        text = "".join(f"{digest}  {name}\n" for name, digest in found.sums.items())
        publish({beside: text.encode()})
    for path in (*files_of(recording), beside):
        _protect(path)
    return found


def broken(recording: Path, found: Seal | None = None) -> str:
    """Say how a recording differs from its seal; empty where it does not.

    Parameters
    ----------
    recording : pathlib.Path
        A recording that has a seal.
    found : Seal, optional
        What its files hold, where that is known already.

    Raises
    ------
    agent.errors.InputError
        The recording or its seal cannot be read.
    """
    beside = seal_path(recording)
    said = read_sums(beside)
    found = content(recording) if found is None else found
    missing = [name for name in found.sums if name not in said]
    if missing:
        return f"{beside} does not name {missing[0]}"
    changed = [name for name, digest in found.sums.items() if said[name] != digest]
    if changed:
        return (
            f"{recording.with_name(changed[0])} is not what was recorded: its content hash is "
            f"{found.sums[changed[0]][:12]}..., {beside.name} says {said[changed[0]][:12]}..."
        )
    return ""


def read_sums(path: Path) -> dict[str, str]:
    """Read a file of content hashes: file name to hash.

    Raises
    ------
    agent.errors.InputError
        With the line that is none.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({why_unreadable(error)}).") from error
    sums = {}
    for number, line in enumerate(lines, 1):
        match = _LINE.match(line)
        if match is None:
            raise InputError(f"{path}: line {number} is no content hash and file name.")
        sums[match[2]] = match[1]
    if not sums:
        raise InputError(f"{path}: holds no content hash.")
    return sums


def _protect(path: Path) -> None:
    try:
        mode = path.stat().st_mode
        if mode & _WRITE_BITS:
            path.chmod(stat.S_IMODE(mode) & ~_WRITE_BITS)
    except OSError as error:
        raise storage_error(error, f"{path} cannot be made read-only") from error


def unprotect(path: Path) -> None:
    """Give the owner's write bit back, so that the file can be removed on every system.

    Raises
    ------
    agent.errors.StorageError
        The system refuses.
    """
    try:
        path.chmod(stat.S_IMODE(path.stat().st_mode) | stat.S_IWUSR)
    except OSError as error:
        raise StorageError(f"{path} cannot be made writable ({error}).") from error
