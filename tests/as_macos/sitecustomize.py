"""Take from this Python what macOS's lacks, before a program begins: ``PYTHONPATH=tests/as_macos``.

Python imports a module of this name at its start; every process that the program starts inherits
it. What is taken is what typeshed, which mypy brings along, says that Linux has and macOS has not,
and what it says nothing of: numbers of socket options, functions of the C library, ``/proc``. The
kernel, its files and its scheduling stay Linux's: a Mac this is not.
"""

from __future__ import annotations

import ast
import errno
import fcntl
import importlib
import importlib.util
import os
import selectors
import socket
import sys
import sysconfig
import types
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

PLATFORM = "darwin"
MODULES = {
    "errno": "errno.pyi",
    "fcntl": "fcntl.pyi",
    "mmap": "mmap.pyi",
    "os": "os/__init__.pyi",
    "posix": "posix.pyi",
    "resource": "resource.pyi",
    "select": "select.pyi",
    "signal": "signal.pyi",
    "_socket": "_socket.pyi",
    "socket": "socket.pyi",
    "termios": "termios.pyi",
    "time": "time.pyi",
}
OPTIONS = {
    (socket.SOL_SOCKET, 33): "SO_RCVBUFFORCE",
    (socket.SOL_SOCKET, 35): "SO_TIMESTAMPNS",
    (socket.SOL_SOCKET, 40): "SO_RXQ_OVFL",
    (socket.IPPROTO_IP, 49): "IP_MULTICAST_ALL",
    (socket.IPPROTO_IPV6, 29): "IPV6_MULTICAST_ALL",
}
F_FULLFSYNC = 51  # sys/fcntl.h of macOS
FUNCTIONS = {"clock_nanosleep", "memfd_create", "pidfd_open", "prctl", "recvmmsg", "sendmmsg"}


def names(body: Sequence[ast.stmt], platform: str) -> Iterator[str]:
    """Yield what a stub defines on a platform, outside of its classes."""
    for statement in body:
        match statement:
            case ast.If(test=test, body=then, orelse=otherwise):
                told = {"sys": types.SimpleNamespace(platform=platform, version_info=(3, 11))}
                condition = compile(ast.Expression(test), "stub", "eval")
                holds = eval(condition, told)  # noqa: S307 - of `sys`, as stubs have it
                yield from names(then if holds else otherwise, platform)
            case ast.AnnAssign(target=ast.Name(id=name)):
                yield name
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.ImportFrom(names=imported):
                yield from (alias.asname or alias.name for alias in imported)
            case ast.Assign(targets=targets):
                yield from (target.id for target in targets if isinstance(target, ast.Name))


def lacking() -> dict[str, set[str]]:
    """Return, by module, what Linux's standard library has and macOS's has not."""
    found = importlib.util.find_spec("mypy")
    assert found is not None
    assert found.origin is not None
    stubs = Path(found.origin).parent / "typeshed" / "stdlib"
    missing = {}
    for module, stub in MODULES.items():
        body = ast.parse((stubs / stub).read_text(encoding="utf-8")).body
        missing[module] = set(names(body, "linux")) - set(names(body, PLATFORM))
    return missing


def refuse(event: str, arguments: tuple[Any, ...]) -> None:
    """Say what macOS says where a program asks for Linux's own: an audit hook."""
    if event in ("open", "os.listdir", "os.scandir") and str(arguments[0]).startswith("/proc"):
        raise FileNotFoundError(errno.ENOENT, "No such file or directory", str(arguments[0]))
    if event in ("socket.bind", "socket.connect") and str(arguments[1]).startswith("\0"):
        raise FileNotFoundError(errno.ENOENT, "No such file or directory")
    if event == "ctypes.dlsym" and arguments[1] in FUNCTIONS:
        raise AttributeError(f"dlsym(RTLD_DEFAULT, {arguments[1]}): symbol not found")


def take_away() -> None:
    """Be as macOS's Python is, as far as a program can ask."""
    for module, missing in lacking().items():
        loaded = importlib.import_module(module)
        for name in missing:
            if hasattr(loaded, name):
                delattr(loaded, name)
    sysconfig.get_config_vars()  # of how this Python was built, which is Linux's, and then kept
    set_option = socket.socket.setsockopt

    def setsockopt(self: socket.socket, level: int, option: int, *value: Any) -> None:
        if (level, option) in OPTIONS:
            raise OSError(errno.ENOPROTOOPT, "Protocol not available")
        set_option(self, level, option, *value)

    socket.socket.setsockopt = setsockopt  # type: ignore[method-assign,assignment]  # on purpose
    selectors.DefaultSelector = selectors.PollSelector  # type: ignore[assignment,misc]  # kqueue's stand-in
    look = os.stat

    def stat(path: Any, **how: Any) -> os.stat_result:
        if isinstance(path, (str, os.PathLike)) and str(path).startswith("/proc"):
            raise FileNotFoundError(errno.ENOENT, "No such file or directory", str(path))
        return look(path, **how)

    os.stat = stat
    control = fcntl.fcntl

    def to_the_disk(descriptor: int, command: int, argument: int = 0) -> Any:
        return (
            os.fsync(descriptor)
            if command == F_FULLFSYNC
            else control(descriptor, command, argument)
        )

    fcntl.__dict__.update(F_FULLFSYNC=F_FULLFSYNC, fcntl=to_the_disk)
    system = os.uname()
    macos = os.uname_result(("Darwin", system.nodename, "23.6.0", "", "arm64"))
    os.uname = lambda: macos
    proxies = types.ModuleType("_scproxy")  # what urllib asks there
    proxies.__dict__.update(_get_proxies=dict, _get_proxy_settings=dict)
    sys.modules["_scproxy"] = proxies
    sys.platform = PLATFORM
    sys.addaudithook(refuse)


if __name__ == "sitecustomize":
    take_away()
