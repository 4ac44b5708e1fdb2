"""Passwords: hashed with argon2id, never kept, never said."""

from __future__ import annotations

import ctypes
import platform
from typing import Protocol

from agent.errors import InputError

SHORTEST = 10
LONGEST = 200

_M_MMAP_THRESHOLD = -3  # malloc.h
_LARGE_BYTES = 1 << 20


class Hasher(Protocol):
    """Turns a password into what is kept of it."""

    def hash(self, password: str) -> str:
        """Return what to keep, with its salt."""
        ...

    def matches(self, kept: str, password: str) -> bool:
        """Return whether `password` is the one that `kept` was made of."""
        ...

    def is_outdated(self, kept: str) -> bool:
        """Return whether `hash` would make another kind of `kept` by now."""
        ...


class Argon2:
    """Argon2id in 12 MiB, as OWASP's Password Storage Cheat Sheet has it, with 16 passes for its 3.

    That is the work of RFC 9106's choice for small machines (3 passes over 64 MiB), in a fifth of
    the memory: the page's server stays under 100 MB while somebody logs in.

    Parameters
    ----------
    time_cost, memory_kib : int
        Less of both in tests alone.
    """

    def __init__(self, time_cost: int = 16, memory_kib: int = 12288) -> None:
        from argon2 import PasswordHasher

        _give_large_blocks_back()
        self._hasher = PasswordHasher(time_cost=time_cost, memory_cost=memory_kib, parallelism=1)

    def hash(self, password: str) -> str:
        """Return the PHC string."""
        return self._hasher.hash(password)

    def matches(self, kept: str, password: str) -> bool:
        """Return whether the password fits; a damaged hash fits nothing."""
        from argon2.exceptions import InvalidHashError, VerificationError

        try:
            return self._hasher.verify(kept, password)
        except (VerificationError, InvalidHashError):
            return False

    def is_outdated(self, kept: str) -> bool:
        """Return whether the hash was made with other numbers than these."""
        return self._hasher.check_needs_rehash(kept)


def _give_large_blocks_back() -> None:
    """Have the C library return what a hash has used to the system, as it does with all else.

    glibc keeps blocks up to 32 MiB for later once one of their size was freed (mallopt(3)): the
    server would hold a hash's memory for good. Other libraries are left as they are.
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)


def insist_on_a_good_one(name: str, password: str) -> None:
    """Refuse a password that is too short, too long, or the name itself.

    Raises
    ------
    agent.errors.InputError
    """
    if not SHORTEST <= len(password) <= LONGEST:
        raise InputError(f"A password has {SHORTEST} to {LONGEST} characters.")
    if name.casefold() in password.casefold() or len(set(password)) < 5:
        raise InputError("This password is too easy to guess: take several words.")
