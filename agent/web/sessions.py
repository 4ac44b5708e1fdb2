"""Who is logged in: sessions in memory, locked when nobody uses them, gone with the server."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from dataclasses import dataclass, replace

from agent.web.roles import Role
from drivers.clock import Clock

LONGEST_S = 12.0 * 3600.0
MOST = 1000


@dataclass(frozen=True)
class Session:
    """One log-in in one browser."""

    name: str
    role: Role
    csrf: str
    began_s: float
    used_s: float
    locked: bool = False

    def carries(self, csrf: str) -> bool:
        """Return whether a form that says `csrf` was made for this session."""
        return hmac.compare_digest(self.csrf.encode(), csrf.encode("utf-8", "surrogatepass"))


class Sessions:
    """Every session, by the SHA-256 of its token; a token is never kept.

    Parameters
    ----------
    clock : drivers.clock.Clock
        Monotonic.
    idle_s : float
        When a session is locked; then its user has to say the password again.
    """

    def __init__(self, clock: Clock, idle_s: float) -> None:
        self._clock = clock
        self._idle_s = idle_s
        self._kept: dict[str, Session] = {}

    def begin(self, name: str, role: Role) -> tuple[str, Session]:
        """Return a new session and the token that its browser shall keep."""
        self._forget_the_old()
        token, now_s = secrets.token_urlsafe(32), self._clock.now()
        session = Session(name, role, secrets.token_urlsafe(24), now_s, now_s)
        self._kept[_digest(token)] = session
        return token, session

    def find(self, token: str | None, *, used: bool) -> Session | None:
        """Return the session of a token, locked where nobody has used it for long.

        Parameters
        ----------
        token : str, optional
            As the browser sent it; anything.
        used : bool
            Whether a person did something; what a page asks by itself keeps nobody logged in.
        """
        if not token:
            return None
        key, now_s = _digest(token), self._clock.now()
        session = self._kept.get(key)
        if session is None:
            return None
        if now_s - session.began_s > LONGEST_S:
            del self._kept[key]
            return None
        if now_s - session.used_s > self._idle_s and not session.locked:
            session = self._kept[key] = replace(session, locked=True)
        if used and not session.locked:
            session = self._kept[key] = replace(session, used_s=now_s)
        return session

    def lock(self, token: str | None) -> None:
        """Lock one session now."""
        key = _digest(token or "")
        if key in self._kept:
            self._kept[key] = replace(self._kept[key], locked=True)

    def end(self, token: str | None) -> None:
        """End one session; nothing where there is none."""
        self._kept.pop(_digest(token or ""), None)

    def end_all_of(self, name: str) -> None:
        """End every session of somebody."""
        self._kept = {key: kept for key, kept in self._kept.items() if kept.name != name}

    def _forget_the_old(self) -> None:
        now_s = self._clock.now()
        fresh = {k: s for k, s in self._kept.items() if now_s - s.began_s <= LONGEST_S}
        for key in sorted(fresh, key=lambda k: fresh[k].used_s)[: max(0, len(fresh) - MOST + 1)]:
            del fresh[key]
        self._kept = fresh


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()
