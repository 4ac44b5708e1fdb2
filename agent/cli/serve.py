"""`stribeck serve`: the shop-floor page of one cell."""

from __future__ import annotations

from pathlib import Path

from agent.cell import read_cell
from agent.cli.talk import talker
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
    page = create_page(settings)
    token = first_token(page)
    talker().print(f"Page of {cell.robot}: {settings.url} (Ctrl-C ends it)")
    if token:
        talker().print(
            f"Nobody can log in yet. The first user, an engineer, is made with this token, once: "
            f"{token}\nOpen {settings.url}welcome and give it there."
        )
    server = uvicorn.Server(
        uvicorn.Config(
            page.app,
            host=settings.host,
            port=settings.port,
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
    )
    server.run()
    if not server.started:
        raise StorageError(
            f"The page cannot listen on {settings.host} port {settings.port}: it is taken, or may "
            "not be used.",
            "Choose another with --port.",
        )


def state_folder(cell: Path, state: Path | None) -> Path:
    """Return where the page of a cell keeps users, audit trail and runs."""
    return state if state is not None else cell.parent / f"{cell.stem}-page"
