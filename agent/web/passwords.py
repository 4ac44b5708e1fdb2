"""Passwords: hashed with argon2id, never kept, never said."""

from __future__ import annotations

from typing import Protocol

from agent.errors import InputError

SHORTEST = 10
LONGEST = 200


class Hasher(Protocol):
    """Turns a password into what is kept of it."""

    def hash(self, password: str) -> str:
        """Return what to keep, with its salt."""
        ...

    def matches(self, kept: str, password: str) -> bool:
        """Return whether `password` is the one that `kept` was made of."""
        ...


class Argon2:
    """Argon2id; the defaults are RFC 9106's for memory-constrained machines (64 MiB, 3 passes).

    Parameters
    ----------
    time_cost, memory_kib : int
        Less of both in tests alone.
    """

    def __init__(self, time_cost: int = 3, memory_kib: int = 65536) -> None:
        from argon2 import PasswordHasher

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
