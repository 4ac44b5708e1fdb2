"""`stribeck serve`: the shop-floor page of one cell."""

from __future__ import annotations

import socket
from dataclasses import replace
from pathlib import Path

from agent.cell.cell import read_cell
from agent.cli.terminal.talk import talker
from agent.errors import StorageError
from agent.web.settings import PageSettings


def run_serve(settings: PageSettings) -> None:
    """Serve the page until Ctrl-C or SIGTERM; a cycle that runs then is stopped first.

    Raises
    ------
    agent.errors.InputError
        The cell cannot be read.
    agent.errors.StorageError
        The state's folder or the port cannot be used.
    """
    import uvicorn

    from agent.web.application import create_page, first_token

    cell = read_cell(settings.cell_path)
    with _listening(settings) as listening:
        settings = replace(settings, port=listening.getsockname()[1])
        page = create_page(settings)
        token = first_token(page)
        talker().print(f"Page of {cell.robot}: {settings.url} (Ctrl-C ends it)")
        if token:
            talker().print(
                "Nobody can log in yet. The first user, an engineer, is made with this token, "
                f"once: {token}\nOpen {settings.url}welcome and give it there."
            )
        config = uvicorn.Config(
            page.app,
            ssl_certfile=settings.tls_cert,
            ssl_keyfile=settings.tls_key,
            log_level="warning",
            access_log=False,
            server_header=False,
            proxy_headers=bool(settings.public_url),
            forwarded_allow_ips="127.0.0.1,::1",
            timeout_graceful_shutdown=2,
            h11_max_incomplete_event_size=32768,
            limit_concurrency=500,
        )
        uvicorn.Server(config).run(sockets=[listening])


def _listening(settings: PageSettings) -> socket.socket:
    """Return the socket that the page is served on."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        return socket.create_server((settings.host, settings.port), family=family, backlog=128)
    except OSError as error:
        raise StorageError(
            f"The page cannot listen on {settings.host} port {settings.port}: {error.strerror}.",
            "Choose another port with --port.",
        ) from error


def state_folder(cell: Path, state: Path | None) -> Path:
    """Return where the page of a cell keeps users, audit trail and runs."""
    return state if state is not None else cell.parent / f"{cell.stem}-page"
