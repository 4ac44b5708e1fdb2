"""The page's commands. Heavy imports are inside them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import Json, place

CellPath = Annotated[
    Path, typer.Argument(parser=place, metavar="CELL.toml", help="The cell's description.")
]
State = Annotated[
    Path | None,
    typer.Option(
        parser=place, help="Folder of users, audit trail and runs; else CELL-page beside the cell."
    ),
]


def add_commands(app: typer.Typer) -> None:
    """Add `serve`, `user`, `audit`, and the children that `serve` starts."""
    app.command(short_help="the page a technician uses")(serve)
    app.command("serve-run", hidden=True)(serve_run)
    app.command("serve-look", hidden=True)(serve_look)
    user = typer.Typer(help="Who may log in to the page.", no_args_is_help=True)
    user.command("list", short_help="everybody who may log in")(user_list)
    user.command("invite", short_help="a one-time token for a new user or password")(user_invite)
    user.command("disable", short_help="let somebody log in no more")(user_disable)
    app.add_typer(user, name="user", short_help="who may log in to the page")
    audit = typer.Typer(help="Who did what on the page.", no_args_is_help=True)
    audit.command("verify", short_help="does the chain of the audit trail hold?")(audit_verify)
    app.add_typer(audit, name="audit", short_help="who did what on the page")


def serve(
    cell: CellPath,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port.")] = 8420,
    tls_cert: Annotated[
        Path | None, typer.Option(parser=place, help="Certificate chain (PEM).")
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(parser=place, help="Its private key (PEM).")
    ] = None,
    public_url: Annotated[
        str, typer.Option(help="https://NAME of a reverse proxy on this machine.")
    ] = "",
    idle_minutes: Annotated[
        float, typer.Option(min=1.0, max=480.0, help="An unused session is locked after that.")
    ] = 15.0,
    state: State = None,
) -> None:
    """Serve the cell's page: start a cycle, watch it, stop it, read what came of it."""
    from agent.cli.page.serve import run_serve, state_folder
    from agent.web.settings import PageSettings

    run_serve(
        PageSettings(
            cell_path=cell,
            state=state_folder(cell, state),
            host=host,
            port=port,
            tls_cert=tls_cert,
            tls_key=tls_key,
            public_url=public_url,
            idle_s=60.0 * idle_minutes,
        )
    )


def serve_run(
    cell: CellPath,
    axis: Annotated[int, typer.Option()],
    progress: Annotated[Path, typer.Option(parser=place)],
    reverse: Annotated[bool, typer.Option("--reverse")] = False,
    trajectory: Annotated[Path | None, typer.Option(parser=place)] = None,
) -> None:
    """Drive one cycle for the page, as long as standard input stays open."""
    from agent.cli.page.run import serve_run as run

    run(cell, axis, reverse=reverse, trajectory=trajectory, progress=progress)


def serve_look(
    cell: CellPath,
    axis: Annotated[int, typer.Option()],
    out: Annotated[Path, typer.Option(parser=place)],
) -> None:
    """Look at an axis for the page, as long as standard input asks for it; nothing is written."""
    from agent.cli.page.look import serve_look as look

    look(cell, axis, out)


def user_list(cell: CellPath, state: State = None, json: Json = False) -> None:
    """Print everybody who may log in to the page of this cell."""
    from agent.cli.page.serve import state_folder
    from agent.cli.page.user import list_users

    list_users(state_folder(cell, state), as_json=json)


def user_invite(
    cell: CellPath,
    name: Annotated[str, typer.Argument(help="Whom; an existing user gets a new password.")],
    role: Annotated[str, typer.Option(help="viewer, technician or engineer.")] = "technician",
    state: State = None,
) -> None:
    """Print a one-time token with which somebody chooses a password."""
    from agent.cli.page.serve import state_folder
    from agent.cli.page.user import invite_user

    invite_user(state_folder(cell, state), name, role)


def user_disable(
    cell: CellPath,
    name: Annotated[str, typer.Argument(help="Whom.")],
    state: State = None,
) -> None:
    """Let somebody log in no more."""
    from agent.cli.page.serve import state_folder
    from agent.cli.page.user import disable_user

    disable_user(state_folder(cell, state), name)


def audit_verify(
    cell: CellPath,
    expect: Annotated[
        str, typer.Option(metavar="HASH", help="A head noted earlier; some line must carry it.")
    ] = "",
    state: State = None,
) -> None:
    """Walk the audit trail's whole chain; say its head, or the first line that does not fit."""
    from agent.cli.page.serve import state_folder
    from agent.cli.page.user import verify_audit

    verify_audit(state_folder(cell, state), expect)
