"""Who is writing this stream: a lock that the system takes away when its owner dies.

On POSIX the whole file is locked with `flock`, elsewhere one byte far behind the end of any
recording, so that others can still read. The lock lives as long as the descriptor is open in any
process: a child that was forked while recording holds it until the child ends, too.
"""

from __future__ import annotations

import os
import sys

# Behind the end of any recording, so that nobody's reading is blocked; and no further than a `long`
# of 32 bits reaches: there are C runtimes that ask for the position in one before they lock.
_LOCKED_BYTE = (1 << 31) - 2


def try_lock(descriptor: int) -> bool:
    """Take the lock of an open file, or return False when another descriptor holds it."""
    if sys.platform == "win32":
        import msvcrt

        position = os.lseek(descriptor, 0, os.SEEK_CUR)
        try:
            os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:  # EACCES by the manual, nothing at all by some: held is the safe reading
            return False
        finally:
            os.lseek(descriptor, position, os.SEEK_SET)
        return True
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
