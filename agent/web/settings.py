"""How the page is served: frozen, checked before a port is opened."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from agent.errors import InputError, UsageError

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True)
class PageSettings:
    """What `stribeck serve` was told.

    Parameters
    ----------
    cell_path : pathlib.Path
        The cell's description.
    state : pathlib.Path
        Folder of users, audit trail and runs; only this user may read it.
    host, port : str, int
        Where to listen; port 0 lets the system choose.
    tls_cert, tls_key : pathlib.Path, optional
        Certificate chain and private key (PEM).
    public_url : str
        How browsers reach the page through a reverse proxy that does the TLS; else empty.
    idle_s : float
        A session that nobody uses for so long is locked.
    """

    cell_path: Path
    state: Path
    host: str = "127.0.0.1"
    port: int = 8420
    tls_cert: Path | None = None
    tls_key: Path | None = None
    public_url: str = ""
    idle_s: float = 900.0
    allowed_hosts: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Refuse what would let passwords travel in the clear.

        Raises
        ------
        agent.errors.InputError
            Half of a TLS pair; another address than loopback without TLS; a bad public URL.
        """
        if (self.tls_cert is None) != (self.tls_key is None):
            raise UsageError("TLS needs both: --tls-cert and --tls-key.")
        for path in (self.tls_cert, self.tls_key):
            if path is not None and not path.is_file():
                raise InputError(f"The TLS file {path} is not there.")
        if self.tls_cert is not None and self.tls_key is not None:
            _check_tls(self.tls_cert, self.tls_key)
        if not is_loopback(self.host) and self.tls_cert is None:
            where = self.host or "every address"
            raise UsageError(
                f"The page does not listen on {where} without TLS: passwords and the stop would "
                "travel in the clear.",
                "Give --tls-cert and --tls-key, or listen on 127.0.0.1 behind a reverse proxy "
                "and name it by --public-url.",
            )
        names = {*LOOPBACK_NAMES, self.host.lower()} - {"0.0.0.0", "::"}
        if self.public_url:
            names.add(_host_of(self.public_url))
        object.__setattr__(self, "allowed_hosts", tuple(sorted(names)))

    @property
    def secure(self) -> bool:
        """Return whether browsers speak TLS, with us or with the proxy."""
        return self.tls_cert is not None or self.public_url.startswith("https://")

    @property
    def url(self) -> str:
        """Return where a browser on this machine opens the page."""
        scheme = "https" if self.tls_cert is not None else "http"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return self.public_url or f"{scheme}://{host}:{self.port}/"


def is_loopback(host: str) -> bool:
    """Return whether nobody but this machine can reach `host`."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _host_of(url: str) -> str:
    try:
        parts = urlsplit(url)
        host = parts.hostname
    except ValueError:
        parts, host = None, None
    if parts is None or parts.scheme != "https" or not host:
        raise UsageError(
            f"--public-url expects https://NAME, got {url!r}: the proxy has to do the TLS."
        )
    return host.lower()


def _check_tls(certificate: Path, key: Path) -> None:
    """Refuse what no page can be served with before its address is given to anybody."""
    import ssl

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password="")
    except (OSError, ValueError) as error:
        raise InputError(
            f"{certificate} and {key} are no certificate and its key ({error}).",
            "Both are PEM files; the key has no passphrase.",
        ) from error
