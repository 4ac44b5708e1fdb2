"""The same pure function over many items, on Dask: bounded memory, and no item harms another.

Of the items only so many are on their way at a time that each worker has the next one at hand.
What raises is an item's own failure and becomes its outcome. What kills its worker (memory, a
crash of compiled code) also hits the items that waited in that worker: Dask gives up all of them
in the end. They are tried again one at a time, so that the one that kills is known and the others
are done.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from agent.errors import InputError

if TYPE_CHECKING:
    from distributed import Client

Item = TypeVar("Item")
Value = TypeVar("Value")

Opened: TypeAlias = "Callable[[], AbstractContextManager[Client]]"

_AT_HAND = 3  # items on their way for each worker: one at work, the others waiting beside it
_DEATHS = 1  # of a worker that an item has waited in and is not yet suspected for


@dataclass(frozen=True)
class Outcome(Generic[Item, Value]):
    """What became of one item: a value, or why there is none."""

    item: Item
    value: Value | None
    failure: str = ""


@contextlib.contextmanager
def cluster(address: str = "", workers: int = 2, memory_bytes: int = 2 << 30) -> Iterator[Client]:
    """Yield a client of an existing scheduler, or of a cluster of this machine's own.

    Parameters
    ----------
    address : str
        Of a scheduler (``tcp://host:8786``); empty for worker processes here.
    workers : int
        How many, each with one thread.
    memory_bytes : int
        A worker that takes more is ended, and its item with it.

    Raises
    ------
    InputError
        No scheduler answers there.
    """
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise InputError(
            "A fleet needs Dask, which is not installed.", "Install stribeck[fleet]."
        ) from error
    settings = {
        "distributed.scheduler.allowed-failures": _DEATHS,
        "distributed.worker.memory.spill": False,
        "distributed.worker.memory.target": False,
    }
    with dask.config.set(settings), contextlib.ExitStack() as stack:
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        if address:
            try:
                client = Client(address, timeout=10)
            except (OSError, TimeoutError, ValueError) as error:
                raise InputError(
                    f"No Dask scheduler answers at {address}.", "Start one with `dask scheduler`."
                ) from error
            yield stack.enter_context(client)
            return
        here = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",  # else its port is 8787, on every interface
            memory_limit=memory_bytes,
            silence_logs=logging.CRITICAL,
        )
        stack.enter_context(here)
        yield stack.enter_context(Client(here))


def outcomes(
    opened: Opened, function: Callable[[Item], Value], items: Sequence[Item]
) -> Iterator[Outcome[Item, Value]]:
    """Yield what became of every item; without items no cluster is started.

    Parameters
    ----------
    opened : callable
        Opens the cluster, as `cluster` does.
    function : callable
        Pure.
    items : sequence
    """
    if not items:
        return
    with opened() as client:
        yield from each(client, function, items)


def each(
    client: Client, function: Callable[[Item], Value], items: Iterable[Item]
) -> Iterator[Outcome[Item, Value]]:
    """Yield what became of every item, in whatever order they end.

    Parameters
    ----------
    client : distributed.Client
    function : callable
        Pure: a worker that dies has its items done again elsewhere.
    items : iterable
        Taken as they are needed.
    """
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    width = max(1, len(client.scheduler_info(n_workers=-1)["workers"]))
    source, suspects = iter(items), []
    ended: Any = as_completed(with_results=False)
    under_way: dict[Any, Item] = {}

    def send(item: Item) -> None:
        future = client.submit(function, item, pure=False)
        under_way[future.key] = item
        ended.add(future)

    for item in islice(source, width * _AT_HAND):
        send(item)
    for future in ended:
        item = under_way.pop(future.key)
        error = future.exception()
        if isinstance(error, KilledWorker):
            suspects.append(item)
        else:
            yield _outcome(item, future, error)
        future.release()
        for more in islice(source, 1):
            send(more)
    for item in suspects:  # one at a time: nobody else's death is taken for its own
        future = client.submit(function, item, pure=False)
        error = future.exception()
        if isinstance(error, KilledWorker):
            why = f"ended its worker process {_DEATHS + 1} times (memory, or a crash)"
            yield Outcome(item, None, why)
        else:
            yield _outcome(item, future, error)
        future.release()


def _outcome(item: Item, future: Any, error: BaseException | None) -> Outcome[Item, Any]:
    if error is not None:
        return Outcome(item, None, f"{type(error).__name__}: {error}")
    return Outcome(item, future.result())
