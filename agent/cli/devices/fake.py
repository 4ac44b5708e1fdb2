"""`stribeck fake`: the simulated servo drive as a process of its own."""

from __future__ import annotations

import signal
import threading
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from agent.cli.devices.fake_cell import fake_cell_text
from agent.cli.terminal.talk import talker
from agent.cycle.precedence import PRIORITY, before_others
from agent.errors import InputError, UsageError
from agent.record.atomic import publish
from drivers.errors import BusError, why_unreadable
from fakes.process import run_process
from fakes.specification import FakeSpecification


@dataclass(frozen=True)
class FakeRequest:
    """Which drive is asked for, and where.

    Parameters
    ----------
    interface, channel : str
        Python-can's words.
    options : tuple of str
        Options of the interface as KEY=VALUE.
    node, seed : int
        CANopen node id; seed of the noise.
    joint : pathlib.Path or None
        Description of the joint; None is the default one.
    """

    interface: str
    channel: str
    options: tuple[str, ...]
    node: int
    seed: int
    joint: Path | None


def run_fake(request: FakeRequest, write_cell: Path | None, *, short: bool) -> None:
    """Be a drive until Ctrl-C or SIGTERM.

    Raises
    ------
    agent.errors.InputError
        Where the joint's description or an option cannot be used.
    drivers.errors.BusError
        Where the bus cannot be opened or stops working.
    """
    from drivers.can.opening import refuse_elsewhere  # python-can, late: --help is instant

    interface, channel, node = request.interface, request.channel, request.node
    refuse_elsewhere(interface)
    specification = _specification(request.joint)
    options = _options(request.options)
    if write_cell is not None:
        text = fake_cell_text(
            specification,
            interface=interface,
            channel=channel,
            options=options,
            node_id=node,
            short=short,
        )
        publish({write_cell: text.encode()}, overwrite=True)
        talker().print(f"Drive it with: stribeck run {write_cell} --axis 1")
    stop = threading.Event()

    def end(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    for kind in (signal.SIGINT, signal.SIGTERM):
        signal.signal(kind, end)

    def ready() -> None:
        talker().print(
            f"ready: simulated drive, node {node}, on {interface} {channel} (Ctrl-C ends it)"
        )

    try:
        with before_others(PRIORITY + 1):  # a drive has a processor of its own
            run_process(
                interface,
                channel,
                node_id=node,
                seed=request.seed,
                specification=specification,
                options=options,
                stop=stop,
                ready=ready,
            )
    except Exception as error:
        if not _is_bus_trouble(error):
            raise
        raise BusError(
            f"The bus {interface} {channel} cannot be used: {error}.",
            "Is the interface there and up?",
        ) from error


def _options(pairs: tuple[str, ...]) -> dict[str, str | int]:
    options: dict[str, str | int] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or not key:
            raise UsageError(f"--bus-option expects KEY=VALUE, got {pair!r}.")
        options[key] = int(value) if value.lstrip("-").isdigit() else value
    return options


def _specification(joint: Path | None) -> FakeSpecification:
    if joint is None:
        return FakeSpecification()
    try:
        return FakeSpecification.load(joint)
    except OSError as error:
        why = why_unreadable(error)
        raise InputError(f"The joint's description {joint} cannot be read: {why}.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"The joint's description {joint} is no UTF-8 text.") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"The joint's description {joint} cannot be used: {error}.") from error


def _is_bus_trouble(error: Exception) -> bool:
    """Tell whether `error` comes from the bus; python-can stays in the fakes' room.

    Of an interface that it does not know, it says NotImplementedError.
    """
    of_the_system = isinstance(error, OSError | NotImplementedError)
    return of_the_system or type(error).__module__.startswith("can")
