"""Files that are there whole or not at all: write beside, fsync, rename.

Nothing is overwritten unless that was asked for, not even in a race: a new name is made with a
hard link, which fails when the name is taken (where the file system has no links, by a check
just before the rename). A device or a pipe is never replaced by a file: a rename would take
/dev/null from the whole machine.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from agent.errors import StorageError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

TEMPORARY = ".tmp"
_OTHER_NAME = "Choose another name."


RECORDINGS = (".parquet", ".csv", ".arrows")
"""How a recording's name ends. What took a night to record is lost in a moment."""


def publish(
    contents: Mapping[Path, ReadableBuffer], *, overwrite: bool = False, recording: bool = False
) -> None:
    """Write all files, or none of them.

    Parameters
    ----------
    contents : mapping of Path to bytes
        What each file shall hold; they appear in this order.
    overwrite : bool
        Whether files that exist may be replaced.
    recording : bool
        Whether the files are a recording; nothing else ever replaces one, whatever was asked for.

    Raises
    ------
    StorageError
        A name that is taken, or that of a folder, a device, a pipe or a recording; a disk that is
        full or refuses. No temporary file stays behind.
    """
    for path in contents:
        _check_name(path, overwrite=overwrite, recording=recording)
    temporary: dict[Path, Path] = {}
    made: list[Path] = []
    path = Path()
    try:
        for path, content in contents.items():
            temporary[path] = path.with_name(f".{path.name}.{secrets.token_hex(4)}{TEMPORARY}")
            _write_new(temporary[path], content)
        for path, beside in temporary.items():
            _give_name(beside, path, overwrite=overwrite)
            made.append(path)
        for folder in {path.parent for path in contents}:
            sync_folder(folder)
    except OSError as error:
        for done in made if not overwrite else ():
            done.unlink(missing_ok=True)
        if isinstance(error, FileExistsError):
            raise _taken(path) from error
        if isinstance(error, FileNotFoundError) and path.parent.is_dir():
            raise _refused(f"{path} cannot be written", path.parent) from error
        raise storage_error(error, f"{path} cannot be written") from error
    finally:
        for beside in temporary.values():
            with contextlib.suppress(OSError):  # what went wrong before is worth more than this
                beside.unlink(missing_ok=True)


def _check_name(path: Path, *, overwrite: bool, recording: bool) -> None:
    """Refuse a name that no file may have here; see `publish`."""
    if _is_stream(path):
        raise StorageError(
            f"{path} is a device or a pipe, which no file may replace.",
            "Name a file; where there is --json, that goes to standard output.",
        )
    if path.is_dir():  # the current folder has not even a name to write beside
        raise StorageError(f"{path} is a folder, and no file.", "Name a file in it.")
    if overwrite and not recording and path.suffix.lower() in RECORDINGS and path.exists():
        raise StorageError(f"{path} may be a recording and is not overwritten.", _OTHER_NAME)
    if not overwrite and path.exists():
        raise _taken(path)


def write_all(descriptor: int, content: ReadableBuffer) -> None:
    """Write every byte to an open file; OSError when the system takes no more."""
    rest = memoryview(content).cast("B")
    while len(rest):
        rest = rest[os.write(descriptor, rest) :]


def sync(descriptor: int) -> None:
    """Bring to the disk what was written to an open file; OSError when the disk refuses.

    On macOS fsync(2) ends at the disk's own cache, which a power cut empties; its manual names
    F_FULLFSYNC, which not every file system can.
    """
    if sys.platform == "darwin":
        import fcntl

        with contextlib.suppress(OSError):  # this file system cannot
            fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            return
    os.fsync(descriptor)


def sync_folder(folder: Path) -> None:
    """Make the names in `folder` survive a power cut, where the system can do that."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        sync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # not every file system can
            raise
    finally:
        os.close(descriptor)


def make_folder(folder: Path, mode: int = 0o777) -> None:
    """Make a folder for results, and those above it, unless it is there.

    Parameters
    ----------
    folder : pathlib.Path
    mode : int
        Of the folder itself, where it is made.

    Raises
    ------
    StorageError
        The system refuses, or a file has that name.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=mode)
    except FileNotFoundError as error:
        raise _refused(f"The folder {folder} cannot be made", folder.parent) from error
    except OSError as error:
        raise storage_error(error, f"The folder {folder} cannot be made") from error


def check_folder(folder: Path) -> None:
    """Refuse a folder that cannot be made, before anything is computed for it; makes nothing.

    Raises
    ------
    StorageError
        A file has that name, or stands above it.
    """
    there = next((p for p in (folder, *folder.parents) if p.exists()), None)
    if there is not None and not there.is_dir():
        error = FileExistsError(errno.EEXIST if there == folder else errno.ENOTDIR, "")
        raise storage_error(error, f"The folder {folder} cannot be made") from error


def storage_error(error: OSError, what: str) -> StorageError:
    """Return the error above the drivers for what the file system said.

    Parameters
    ----------
    error : OSError
        As the system raised it.
    what : str
        Which file could not be written, without a full stop.
    """
    reasons = {
        errno.ENOSPC: ("the disk is full", "Free some space and try again."),
        errno.EDQUOT: ("the disk quota is used up", "Free some space and try again."),
        errno.EIO: ("the disk reports an input/output error", "Write to another disk."),
        errno.EROFS: ("the file system is read-only", "Write to another folder."),
        errno.EACCES: ("permission is denied", "Write to another folder."),
        errno.EPERM: ("permission is denied", "Write to another folder."),
        errno.ENOENT: ("the folder does not exist", "Make the folder first."),
        errno.EEXIST: ("a file has that name", "Choose another folder."),
        errno.ENOTDIR: ("the folder is a file", "Write to another folder."),
        errno.EFBIG: ("the file would be larger than allowed", "Raise the limit on file sizes."),
    }
    reason, do = reasons.get(error.errno or 0, (error.strerror or str(error), ""))
    return StorageError(f"{what}: {reason}.", do)


def _write_new(path: Path, content: ReadableBuffer) -> None:
    """Make a file that was not there, with its bytes on the disk."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags, 0o666)
    try:
        write_all(descriptor, content)
        sync(descriptor)
    finally:
        os.close(descriptor)


def _give_name(beside: Path, path: Path, *, overwrite: bool) -> None:
    """Let the finished file appear under its name; FileExistsError when that is taken."""
    if overwrite:
        beside.replace(path)
        return
    try:
        path.hardlink_to(beside)
    except FileExistsError:
        raise
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.ENOTSUP, errno.ENOSYS, errno.EMLINK):
            raise
        if path.exists():
            raise FileExistsError(errno.EEXIST, "file exists", str(path)) from error
        beside.rename(path)


def _is_stream(path: Path) -> bool:
    """Tell whether a name is a device's or a pipe's, /dev/stdout and its like included."""
    if path.is_symlink() and str(path.readlink()).startswith("/proc/"):
        return True
    return path.exists() and not path.is_file() and not path.is_dir()


def _refused(what: str, folder: Path) -> StorageError:
    """Return what is to be said where a folder is there and takes nothing, as /proc is."""
    return StorageError(f"{what}: {folder} takes no files.", "Choose another folder.")


def _taken(path: Path) -> StorageError:
    return StorageError(f"{path} exists already and is not overwritten.", _OTHER_NAME)
