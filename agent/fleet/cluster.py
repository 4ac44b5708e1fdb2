"""The same pure function over many items, on Dask: bounded memory, and no item harms another.

Small items go to a worker some at a time, so that what Dask does for a task is shared by them, and
only so many are on their way that each worker has the next ones at hand. What raises is an item's
own failure and becomes its outcome. What kills its worker (memory, a crash of compiled code) also
hits the items that waited in that worker: Dask gives up all of them in the end. They are tried
again one at a time, so that the one that kills is known and the others are done.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from agent.errors import InputError, StorageError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

Item = TypeVar("Item")
Value = TypeVar("Value")

Opened: TypeAlias = "Callable[[], AbstractContextManager[Client]]"

_AT_HAND = 3  # tasks on their way for each worker: one at work, the others waiting beside it
_KEPT_BYTES = 32 << 20
_BACK_S = 10.0  # for workers that died to be back
_DEATHS = 1  # of a worker that an item has waited in and is not yet suspected for


@dataclass(frozen=True)
class Outcome(Generic[Item, Value]):
    """What became of one item: a value, or why there is none.

    `transient` is a failure of the store, not of the item: another time there may be a value.
    """

    item: Item
    value: Value | None
    failure: str = ""
    transient: bool = False


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
        # It notes what every worker does each 10 ms, for a dashboard: 8 KB a cycle, never freed.
        "distributed.worker.profile.enabled": False,
        # Dask has workers give back each array's pages at once, to ask for them again: a tenth of
        # an estimate's time. They keep up to so much instead.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": _KEPT_BYTES,
        "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": _KEPT_BYTES,
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
        stack.enter_context(_closing(here))
        client = stack.enter_context(Client(here))
        yield client
        # Closed while the process of a worker that died is being started anew, Dask fails.
        with contextlib.suppress(TimeoutError):
            client.wait_for_workers(workers, timeout=_BACK_S)


@contextlib.contextmanager
def _closing(cluster: LocalCluster) -> Iterator[None]:
    """Close a cluster of this machine; what was done stays done though it does not end in order.

    Dask asserts, while it closes, that no worker's process is just being started anew. Such a
    process is a daemon and ends with this one. And a worker that died before Dask had written down
    that it came is a KeyError, which Dask keeps until it closes.
    """
    try:
        yield
    finally:
        try:
            cluster.close()
        except (AssertionError, KeyError, TimeoutError):
            cluster.shutdown_on_close = False  # else the interpreter's end waits 10 s for it


def outcomes(
    opened: Opened, function: Callable[[Item], Value], items: Iterable[Item], batch: int = 1
) -> Iterator[Outcome[Item, Value]]:
    """Yield what became of every item; without items no cluster is started.

    Parameters
    ----------
    opened : callable
        Opens the cluster, as `cluster` does.
    function, items, batch
        As for `each`.
    """
    source = iter(items)
    first = list(islice(source, 1))
    if not first:
        return
    with opened() as client:
        yield from each(client, function, chain(first, source), batch)


def each(
    client: Client, function: Callable[[Item], Value], items: Iterable[Item], batch: int = 1
) -> Iterator[Outcome[Item, Value]]:
    """Yield what became of every item, in whatever order they end.

    Parameters
    ----------
    client : distributed.Client
    function : callable
        Pure: a worker that dies has its items done again elsewhere.
    items : iterable
        Taken as they are needed.
    batch : int
        Items that go to a worker together; a task should take tens of milliseconds or more.
    """
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    width = max(1, len(client.scheduler_info(n_workers=-1)["workers"]))
    source, suspects = iter(items), []
    ended: Any = as_completed(with_results=False)
    under_way: dict[Any, list[Item]] = {}
    task = partial(_tried, function)

    def send_more(tasks: int) -> None:
        for _ in range(tasks):
            some = list(islice(source, batch))
            if some:
                future = client.submit(task, some, pure=False)
                under_way[future.key] = some
                ended.add(future)

    send_more(width * _AT_HAND)
    for future in ended:
        some = under_way.pop(future.key)
        error = future.exception()
        if isinstance(error, KilledWorker):
            suspects += some
            found = []
        else:
            found = _found(some, future, error)
        future.release()
        send_more(1)  # before the outcomes are seen to: the workers need not wait for that
        yield from found
    for item in suspects:  # one at a time: nobody else's death is taken for its own
        future = client.submit(task, [item], pure=False)
        error = future.exception()
        if isinstance(error, KilledWorker):
            why = f"ended its worker process {_DEATHS + 1} times (memory, or a crash)"
            yield Outcome(item, None, why)
        else:
            yield from _found([item], future, error)
        future.release()


def _tried(
    function: Callable[[Item], Value], items: list[Item]
) -> list[tuple[Value | None, str, bool]]:
    """Return each item's value, or its failure and whether that is of the store (in a worker)."""
    found: list[tuple[Value | None, str, bool]] = []
    for item in items:
        try:
            found.append((function(item), "", False))
        except StorageError as error:
            found.append((None, str(error), True))
        except Exception as error:  # noqa: BLE001 - an item's failure is its own, whatever it is
            found.append((None, f"{type(error).__name__}: {error}", False))
    return found


def _found(items: list[Item], future: Any, error: BaseException | None) -> list[Outcome[Item, Any]]:
    if error is not None:  # of Dask's, or of what goes between the processes
        return [Outcome(item, None, f"{type(error).__name__}: {error}") for item in items]
    return [Outcome(item, *rest) for item, rest in zip(items, future.result(), strict=True)]
