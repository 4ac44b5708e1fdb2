"""One owner per axis on this machine: a lock that the system takes away when its owner dies.

Two names are locked: the robot's axis, and the place on the bus where its drive (or controller)
is, so that neither a second cell file nor a second name for the same robot leads around it. The
files stay where they are; only the lock on them counts, and no crash leaves one behind.
"""

from __future__ import annotations

import contextlib
import getpass
import hashlib
import json
import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from agent.cell.cell import Axis, Cell
from agent.cycle.preflight import Condition
from agent.errors import StorageError
from agent.record.lock import try_lock
from drivers.clock import wall_time_utc

FOLDER_VARIABLE = "STRIBECK_LOCK_FOLDER"
_WHAT_IT_SAYS = 4096  # bytes, at most
LOOK_PATIENCE_S = 5.0
"""How long whoever wants an axis waits for somebody who only looks at it."""
_PAUSE_S = 0.05


def lock_folder() -> Path:
    """Return where this machine's locks are: the same for every program and user."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen:
        return Path(chosen)
    for folder in _shared():
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.gettempdir())


def _shared() -> tuple[Path, ...]:
    """Return folders into which every user may write; macOS's and Windows' temporary are a user's.

    Two users' programs would not see each other's locks there, and both would own one axis.
    """
    if sys.platform == "win32":
        return (Path(os.environ.get("PUBLIC", r"C:\Users\Public")),)
    return (Path("/run/lock"), Path("/var/lock"), Path("/tmp"))


def lock_names(cell: Cell, axis: Axis) -> tuple[str, ...]:
    """Return what must be locked to own an axis; empty where nothing outside is reached.

    A replay moves nothing, and a virtual bus is inside of this process.
    """
    if axis.job is not None:
        place = f"{axis.job.tcp or axis.job.rtu} unit {axis.job.device_id} axis {axis.number}"
    elif cell.bus.replays or cell.bus.interface == "virtual":
        return ()
    else:
        options = json.dumps(cell.bus.options, sort_keys=True)
        place = f"{cell.bus.interface} {cell.bus.channel} {options} node {axis.drive.node_id}"
    return f"{cell.robot}.axis{axis.number}", hashlib.sha256(place.encode()).hexdigest()[:16]


@contextlib.contextmanager
def owned(cell: Cell, axis: Axis, folder: Path | None = None) -> Iterator[Condition]:
    """Own an axis for as long as the block runs, or say who does.

    Parameters
    ----------
    cell, axis : Cell, Axis
        Whose joint.
    folder : pathlib.Path, optional
        In place of `lock_folder()`.

    Yields
    ------
    Condition
        Holds when the axis is ours.

    Raises
    ------
    agent.errors.StorageError
        The folder of the locks cannot be used.
    """
    folder = folder or lock_folder()
    with contextlib.ExitStack() as held:
        holder = ""
        try:
            for name in lock_names(cell, axis):
                holder = holder or _take(_path(folder, name), held)
        except OSError as error:
            raise StorageError(
                f"The lock of axis {axis.number} of {cell.robot} cannot be used: {error}.",
                f"Let {FOLDER_VARIABLE} name a folder that all users of this machine may write to.",
            ) from error
        yield Condition(
            "no other owner",
            not holder,
            f"axis {axis.number} of {cell.robot}, or its place on the bus, is held by {holder}: "
            "let that end first",
        )


@contextlib.contextmanager
def looked_at(cell: Cell, axis: Axis, folder: Path | None = None) -> Iterator[bool]:
    """Hold an axis for a moment, to read from it and nothing else; false where somebody owns it.

    Whoever wants to own it meanwhile waits for the end of the look, which must be a short one, and
    nobody is told that the axis is held.
    """
    folder = folder or lock_folder()
    with contextlib.ExitStack() as held:
        paths = [_path(folder, name) for name in lock_names(cell, axis)]
        free = True
        for path in paths:
            free = free and not _take(path, held, looks=True)
        try:
            yield free
        finally:
            if free:
                for path in paths:
                    with contextlib.suppress(OSError):  # nobody reads a look's words after it
                        os.truncate(path, 0)


class Holder(NamedTuple):
    """A process of this machine that owns an axis.

    `path` is the lock's file; `said` is what it has left to be known before it let go.
    """

    path: Path
    pid: int
    who: str
    said: str


def leave_word(cell: Cell, axis: Axis, said: str, folder: Path | None = None) -> None:
    """Leave a word in the locks of an axis that is ours: how its cycle ended.

    Whoever asked it to stop from another terminal reads it there.
    """
    for name in lock_names(cell, axis):
        path = _path(folder or lock_folder(), name)
        with contextlib.suppress(OSError):  # a word only; the cycle has its own end to report
            path.write_text(json.dumps({**_me(), "said": said}), encoding="utf-8")


def holders(folder: Path, names: Iterable[str] | None = None) -> tuple[Holder, ...]:
    """Return who owns axes on this machine now.

    Parameters
    ----------
    folder : pathlib.Path
        Of the locks.
    names : iterable of str, optional
        As `lock_names` returns them; every lock of the folder where there are none.
    """
    paths = (
        sorted(folder.glob("stribeck.*.lock"))
        if names is None
        else [_path(folder, name) for name in names]
    )
    found: dict[int, Holder] = {}
    for path in paths:
        holder = _holder(path)
        if holder is not None:
            found.setdefault(holder.pid, holder)
    return tuple(found.values())


def word_left(path: Path) -> str:
    """Return what the last owner has said of its end, or nothing."""
    try:
        return str(json.loads(path.read_text(encoding="utf-8")).get("said", ""))
    except (OSError, ValueError, AttributeError):
        return ""


def is_held(path: Path) -> bool:
    """Return whether somebody owns a lock now."""
    try:
        descriptor = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    except FileNotFoundError:
        return False
    try:
        return not try_lock(descriptor)
    finally:
        os.close(descriptor)


def _holder(path: Path) -> Holder | None:
    """Return who holds one lock; None where nobody does, or who it is cannot be known."""
    if not is_held(path):
        return None
    try:
        who = json.loads(path.read_text(encoding="utf-8"))
        pid = int(who["pid"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if who.get("looks") or not _has_open(pid, path):
        return None
    return Holder(path, pid, f"process {pid} (user {who.get('user')})", str(who.get("said", "")))


def _has_open(pid: int, path: Path) -> bool:
    """Return whether a process has this file open, where the system tells; else True.

    Anybody may write into the file: a number in it that belongs to another process is no owner.
    """
    descriptors = Path(f"/proc/{pid}/fd")
    if not Path("/proc/self/fd").exists():
        return True
    try:
        return any(entry.samefile(path) for entry in _that_exist(descriptors))
    except PermissionError:
        return True  # another user's; a signal would be refused as well
    except OSError:
        return False


def _that_exist(folder: Path) -> list[Path]:
    return [entry for entry in folder.iterdir() if entry.exists()]


def _me() -> dict[str, str | int]:
    return {"pid": os.getpid(), "user": user_name(), "since": wall_time_utc()}


def _path(folder: Path, name: str) -> Path:
    return folder / f"stribeck.{_in_a_file_name(name)}.lock"


def _take(path: Path, held: contextlib.ExitStack, *, looks: bool = False) -> str:
    """Take one lock until `held` ends; return who has it, or nothing when it is ours."""
    descriptor = _open_for_all(path)
    held.callback(os.close, descriptor)
    if not (try_lock(descriptor) or (not looks and _outwaits_a_look(descriptor))):
        return _who(descriptor)
    os.ftruncate(descriptor, 0)
    os.write(descriptor, json.dumps(_me() | ({"looks": True} if looks else {})).encode())
    return ""


def _outwaits_a_look(descriptor: int) -> bool:
    """Wait for somebody who only looks; return whether the lock is ours.

    A look that begins or ends has the lock for a moment while the file says nothing, or what the
    one before has left: an owner is who is named there twice.
    """
    pause, named = threading.Event(), 0
    for _ in range(round(LOOK_PATIENCE_S / _PAUSE_S)):
        named = named + 1 if _names_an_owner(descriptor) else 0
        if named == 2:
            return False
        pause.wait(_PAUSE_S)
        if try_lock(descriptor):
            return True
    return False


def _names_an_owner(descriptor: int) -> bool:
    os.lseek(descriptor, 0, os.SEEK_SET)
    try:
        who = json.loads(os.read(descriptor, _WHAT_IT_SAYS))
        return "pid" in who and not who.get("looks")
    except (ValueError, TypeError, AttributeError):
        return False


def _open_for_all(path: Path) -> int:
    """Open the lock's file, made for every user where it is new.

    Where it exists it is opened without O_CREAT, which Linux may refuse in another's sticky folder;
    and a link that somebody has put there is not followed.
    """
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)
    try:
        return os.open(path, flags)
    except FileNotFoundError:
        pass
    try:
        descriptor = os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o666)
    except FileExistsError:
        return os.open(path, flags)
    with contextlib.suppress(PermissionError):  # a file system without modes
        path.chmod(0o666)  # whatever the umask
    return descriptor


def _who(descriptor: int) -> str:
    """Say who holds the lock, as far as its file tells."""
    os.lseek(descriptor, 0, os.SEEK_SET)
    try:
        who = json.loads(os.read(descriptor, _WHAT_IT_SAYS))
        return f"process {int(who['pid'])} (user {who['user']}) since {who['since']}"
    except (ValueError, KeyError, TypeError):
        return "another program, which has just begun"


def _in_a_file_name(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9._-]", "_", text)


def user_name() -> str:
    """Return who runs this program, "unknown" where the system has no name for them."""
    try:
        return getpass.getuser()
    except (ImportError, KeyError, OSError):  # Windows; Unix; either from Python 3.13 on
        return "unknown"
