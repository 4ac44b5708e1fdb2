"""`stribeck user` and `stribeck audit`: who may log in, and who did what."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from agent.cycle.axis_lock import user_name
from agent.errors import InputError
from agent.record.audit import AuditTrail, verify
from agent.web.passwords import Argon2
from agent.web.roles import Role
from agent.web.store import NAME, Store
from agent.web.users import INVITATION_HOURS, Users


def list_users(state: Path, *, as_json: bool) -> None:
    """Print every user: name, role, since when, disabled or not."""
    users = _users(state).all()
    if as_json:
        document = [
            {"name": u.name, "role": u.role.word, "disabled": u.disabled, "since": u.since}
            for u in users
        ]
        typer.echo(json.dumps(document, indent=2))
        return
    for user in users:
        typer.echo(f"{user.name:<24} {user.role.word:<12}{'disabled' if user.disabled else ''}")


def invite_user(state: Path, name: str, role: str) -> None:
    """Print a one-time token with which `name` chooses a password."""
    try:
        asked = Role.of(role)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    token = _users(state).invite(name, asked)
    _audit(state, "user invited", name=name, role=asked.word)
    typer.echo(token)
    typer.echo(f"{name} opens /welcome with it within {INVITATION_HOURS} hours.", err=True)


def disable_user(state: Path, name: str) -> None:
    """Let `name` log in no more; a server that runs ends their session at its next request."""
    _users(state).disable(name)
    _audit(state, "user disabled", name=name)


def verify_audit(state: Path, expect: str) -> None:
    """Print how many lines the trail has and the hash of its last one.

    Raises
    ------
    agent.errors.InputError
        Naming the first line that does not fit.
    """
    head = verify(state, expect)
    typer.echo(f"{head.entries} entries, the chain holds. Head: {head.hash}")


def _users(state: Path) -> Users:
    if not (state / NAME).is_file():  # another folder would become a page's by a slip
        raise InputError(
            f"{state / NAME} is not there: no page was ever served for this cell.",
            "Name the folder with --state.",
        )
    return Users(Store(state), Argon2())


def _audit(state: Path, what: str, **detail: str) -> None:
    AuditTrail(state).add(f"{user_name()} (command line)", what, **detail)
