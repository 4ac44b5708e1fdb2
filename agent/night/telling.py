"""Who is told of an event: each sink is tried a few times, with an end; a failure is a sentence.

Nothing is told while a joint moves: a cycle runs in a process of its own, and the night tells
before and after it. A sink that does not answer costs its own time-out and nothing else.
"""

from __future__ import annotations

import ssl
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from agent.night import news
from agent.night.description import Told
from agent.record.events_file import Event

PAUSE_S = 2.0
"""Before the second try; doubled before each one after it."""


class UndeliveredError(Exception):
    """A message has not arrived.

    Parameters
    ----------
    why : str
        Without a secret.
    for_good : bool
        Whether another try would end the same way: refused, not unreachable.
    """

    def __init__(self, why: str, *, for_good: bool = False) -> None:
        super().__init__(why)
        self.for_good = for_good


class Sink(Protocol):
    """Somebody who is told."""

    @property
    def name(self) -> str:
        """Return who it is, without a secret."""
        ...

    @property
    def tries(self) -> int:
        """Return how often at most a message is tried."""
        ...

    @property
    def every(self) -> bool:
        """Return whether it also gets what is no news (`agent.night.news`)."""
        ...

    def wants(self, event: Event) -> bool:
        """Return whether it wants to know of events of this kind."""
        ...

    def deliver(self, event: Event) -> None:
        """Deliver the event, within the sink's own time-out.

        Raises
        ------
        UndeliveredError
            It has not arrived, as far as anybody can tell.
        """
        ...


@dataclass(frozen=True)
class ByDescription:
    """What every sink takes from its description in the night's file.

    Parameters
    ----------
    described : Told
    """

    described: Told

    @property
    def tries(self) -> int:
        """Return how often at most a message is tried."""
        return self.described.tries

    @property
    def every(self) -> bool:
        """Return whether it also gets what is no news."""
        return self.described.every

    def wants(self, event: Event) -> bool:
        """Return whether it wants to know of events of this kind."""
        return event.kind in self.described.tell


@dataclass(frozen=True)
class Delivery:
    """What became of one message to one sink."""

    sink: str
    arrived: bool
    tries: int
    why: str = ""

    @property
    def sentence(self) -> str:
        """Return it for a person."""
        times = "once" if self.tries == 1 else f"{self.tries} times"
        if self.arrived:
            return f"{self.sink}: told" + (f" (tried {times})." if self.tries > 1 else ".")
        return f"{self.sink}: NOT told, tried {times}: {self.why}."


def tell(
    event: Event,
    sinks: Iterable[Sink],
    wait: Callable[[float], None],
    *,
    everybody: bool = False,
) -> tuple[Delivery, ...]:
    """Tell an event to whoever wants to know of it.

    Parameters
    ----------
    event : Event
    sinks : iterable of Sink
    wait : callable
        Waits for so many seconds between tries.
    everybody : bool
        Whether also those are told who did not ask for events of this kind (a test message).
    """
    return tuple(_told(event, s, wait) for s in sinks if everybody or _wanted(s, event))


def _wanted(sink: Sink, event: Event) -> bool:
    """Return whether a sink is told: no old news, and an alarm's end as an alarm."""
    if news.is_silent(event) and not sink.every:
        return False
    cleared = event.details.get(news.KEY) == news.CLEARED
    return sink.wants(event) or (cleared and sink.wants(replace(event, kind="alarm")))


def _told(event: Event, sink: Sink, wait: Callable[[float], None]) -> Delivery:
    why = ""
    for number in range(1, sink.tries + 1):
        try:
            sink.deliver(event)
        except UndeliveredError as error:
            why = str(error)
            if error.for_good:
                return Delivery(sink.name, False, number, why)
        else:
            return Delivery(sink.name, True, number)
        if number < sink.tries:
            wait(PAUSE_S * 2.0 ** (number - 1))
    return Delivery(sink.name, False, sink.tries, why)


def trust(ca_file: str, folder: Path) -> ssl.SSLContext:
    """Return whom to believe on an encrypted line: the system's authorities, and a file's.

    Raises
    ------
    UndeliveredError
        The file cannot be used.
    """
    context = ssl.create_default_context()
    if ca_file:
        try:
            context.load_verify_locations(folder / ca_file)
        except (OSError, ssl.SSLError) as error:
            why = f"{folder / ca_file} cannot be used: {error}"
            raise UndeliveredError(why, for_good=True) from error
    return context


def subject(event: Event) -> str:
    """Return an event in a few words: what, and whose."""
    joint = event.robot if event.axis is None else f"{event.robot} axis {event.axis}"
    words = {
        "alarm": "ALARM",
        "stopped": "stopped",
        "failed": "failed",
        "skip": "skipped",
        "missed": "missed",
        "run": "done",
        "wait": "waiting",
    }
    more = {news.WORSE: " got worse", news.REMINDER: " (reminder)", news.CLEARED: ", alarm ended"}
    kind = more.get(str(event.details.get(news.KEY, "")), "")
    return " ".join(f"{joint}: {words.get(event.kind, event.kind)}{kind}".split())
