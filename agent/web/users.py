"""Users and how they come to be: by a one-time token, never by a default password."""

from __future__ import annotations

import datetime
import hashlib
import re
import secrets
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass

from agent.errors import InputError
from agent.web.passwords import Hasher, insist_on_a_good_one
from agent.web.roles import Role
from agent.web.store import Store
from drivers.clock import wall_time_utc

INVITATION_HOURS = 24


@dataclass(frozen=True)
class User:
    """Somebody who may log in, unless disabled."""

    name: str
    role: Role
    disabled: bool
    since: str


@dataclass(frozen=True)
class Invitation:
    """What a token is good for; the name is empty where its bearer chooses one."""

    name: str
    role: Role


class Users:
    """Everybody who may log in.

    Parameters
    ----------
    store : Store
        See `agent.web.store`.
    hasher : Hasher
        For passwords.
    wall_time : callable
        ISO 8601, UTC; says when an invitation has expired.
    """

    def __init__(
        self, store: Store, hasher: Hasher, wall_time: Callable[[], str] = wall_time_utc
    ) -> None:
        self._store = store
        self._hasher = hasher
        self._wall_time = wall_time
        # Somebody who does not exist costs as much time as somebody with a wrong password.
        self._nobody = hasher.hash(secrets.token_hex(16))

    def all(self) -> list[User]:
        """Return every user by name."""
        with self._store.reading() as connection:
            return [_user(row) for row in connection.execute("SELECT * FROM users ORDER BY name")]

    def find(self, name: str) -> User | None:
        """Return one user, disabled or not."""
        row = self._row(name)
        return None if row is None else _user(row)

    def authenticate(self, name: str, password: str) -> User | None:
        """Return who has this name and password; None for anybody else, after the same time."""
        row = self._row(name)
        fits = self._hasher.matches(self._nobody if row is None else row["password"], password)
        if row is None or not fits or row["disabled"]:
            return None
        if self._hasher.is_outdated(row["password"]):
            self._renew(name, row["password"], self._hasher.hash(password))
        return _user(row)

    def invite(self, name: str, role: Role) -> str:
        """Return a one-time token for a new user, or for a new password of an old one.

        Parameters
        ----------
        name : str
            Empty for the very first user, who chooses one; older such tokens end.
        role : Role
            What they will be.

        Raises
        ------
        agent.errors.InputError
            The name cannot be one.
        """
        if name:
            _insist_on_a_name(name)
        token = secrets.token_urlsafe(18)
        now = datetime.datetime.fromisoformat(self._wall_time())
        expires = now + datetime.timedelta(hours=INVITATION_HOURS)
        with self._store.writing() as connection:
            connection.execute("DELETE FROM invitations WHERE name = ?", (name,))
            connection.execute(
                "INSERT INTO invitations (token, name, role, expires) VALUES (?, ?, ?, ?)",
                (_digest(token), name, int(role), expires.isoformat()),
            )
        return token

    def invitation(self, token: str) -> Invitation | None:
        """Return what a token is good for; None where it is unknown, used or expired."""
        with self._store.reading() as connection:
            row = connection.execute(
                "SELECT * FROM invitations WHERE token = ?", (_digest(token),)
            ).fetchone()
        if row is None or self._expired(row["expires"]):
            return None
        return Invitation(row["name"], Role(row["role"]))

    def accept(self, token: str, name: str, password: str) -> User:
        """Make (or renew) the user that a token invites; the token ends.

        Raises
        ------
        agent.errors.InputError
            The token, the name or the password cannot be used.
        """
        invitation = self.invitation(token)
        if invitation is None:
            raise InputError("This token is unknown, used or expired.", "Ask for a new one.")
        name = invitation.name or name
        _insist_on_a_name(name)
        insist_on_a_good_one(name, password)
        if not invitation.name and self.find(name) is not None:
            raise InputError(f"There is a user {name} already.")
        kept = self._hasher.hash(password)
        with self._store.writing() as connection:
            used = connection.execute("DELETE FROM invitations WHERE token = ?", (_digest(token),))
            if used.rowcount != 1:
                raise InputError("This token was used a moment ago.", "Ask for a new one.")
            connection.execute(
                "INSERT INTO users (name, role, password, disabled, since) VALUES (?, ?, ?, 0, ?) "
                "ON CONFLICT (name) DO UPDATE SET role = excluded.role, "
                "password = excluded.password, disabled = 0",
                (name, int(invitation.role), kept, self._wall_time()),
            )
        return User(name, invitation.role, disabled=False, since="")

    def disable(self, name: str) -> None:
        """Let somebody log in no more.

        Raises
        ------
        agent.errors.InputError
            Nobody has this name, or it is the last engineer: nobody could invite any more.
        """
        with self._store.writing() as connection:
            (others,) = connection.execute(
                "SELECT count(*) FROM users WHERE role = ? AND name != ? AND NOT disabled",
                (int(Role.ENGINEER), name),
            ).fetchone()
            user = connection.execute("SELECT role FROM users WHERE name = ?", (name,)).fetchone()
            if user is None:
                raise InputError(f"There is no user {name}.")
            if user["role"] == int(Role.ENGINEER) and others == 0:
                raise InputError(f"{name} is the last engineer: invite another one first.")
            connection.execute("UPDATE users SET disabled = 1 WHERE name = ?", (name,))
            connection.execute("DELETE FROM invitations WHERE name = ?", (name,))

    def _renew(self, name: str, kept: str, renewed: str) -> None:
        """Replace a hash of older numbers, unless the password was changed meanwhile."""
        with self._store.writing() as connection:
            connection.execute(
                "UPDATE users SET password = ? WHERE name = ? AND password = ?",
                (renewed, name, kept),
            )

    def _row(self, name: str) -> sqlite3.Row | None:
        with self._store.reading() as connection:
            row: sqlite3.Row | None = connection.execute(
                "SELECT * FROM users WHERE name = ?", (name,)
            ).fetchone()
        return row

    def _expired(self, expires: str) -> bool:
        now = datetime.datetime.fromisoformat(self._wall_time())
        return datetime.datetime.fromisoformat(expires) <= now


def _user(row: sqlite3.Row) -> User:
    return User(row["name"], Role(row["role"]), bool(row["disabled"]), row["since"])


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


def _insist_on_a_name(name: str) -> None:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name):
        raise InputError(
            "A user's name has up to 64 letters, digits, '.', '_' or '-', and begins with a "
            "letter or digit."
        )
