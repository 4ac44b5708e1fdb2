"""Columns of laws, kept for as long as memory allows: those asked for longest ago are made again.

A search looks at a thousand laws, and beside what it has found at as many others, while it may
still go back to the first. All of them at once, with the waves and parts that they are mixed of,
would take more memory than a small machine has; what is gone costs the milliseconds that it took
to make.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from weakref import ReferenceType, ref

from agent.identify.result import Floats

MOST_BYTES = 320 * 2**20
"""Of all columns that are kept, unless one round asks for more."""

_Row = OrderedDict[int, tuple[ReferenceType["Kept"], int]]


class Kept:
    """Columns, as a law's weighted ones, shape (m, k), and their products with each other.

    Parameters
    ----------
    make : callable, optional
        Makes the columns, the same every time; without it they are never put away.
    columns : ndarray, shape (m, k), optional
        As they are now; not made before they are asked for.
    """

    __slots__ = ("__weakref__", "_columns", "_gram", "_make", "round")

    def __init__(self, make: Callable[[], Floats] | None, columns: Floats | None = None) -> None:
        self._make, self._columns = make, columns
        self._gram: Floats | None = None
        self.round = 0
        if make is not None and columns is not None:
            _SHELF.put(self, columns.nbytes)

    @property
    def columns(self) -> Floats:
        """Return the columns, shape (m, k), made once more if they were put away."""
        columns = self._columns
        if columns is None:
            if self._make is None:
                raise ValueError("columns need to be given, or a way to make them")
            columns = self._columns = self._make()
            _SHELF.put(self, columns.nbytes)
        elif self._make is not None:
            _SHELF.asked_for(self)
        return columns

    @property
    def gram(self) -> Floats:
        """Return the columns' products with each other, shape (k, k)."""
        if self._gram is None:
            columns = self.columns
            self._gram = columns.T @ columns
        return self._gram

    @property
    def at_hand(self) -> Floats | None:
        """Return the columns if they need not be made; this does not count as asking for them."""
        return self._columns

    def put_away(self) -> None:
        """Forget the columns until they are asked for."""
        self._columns = None


class _Shelf:
    """All columns that are kept: asked for in this round, in the last one, and before."""

    def __init__(self) -> None:
        self._now: _Row = OrderedDict()
        self._last: _Row = OrderedDict()
        self._before: _Row = OrderedDict()
        self._lock = threading.RLock()  # whatever thread collects garbage drops what is gone
        self.bytes = self.round = 0

    def new_round(self) -> None:
        with self._lock:
            self._before.update(self._last)
            self._last, self._now = self._now, OrderedDict()
            self.round += 1

    def put(self, kept: Kept, size: int) -> None:
        """Take columns up, and put others away for them."""
        key = id(kept)
        with self._lock:
            self._drop(key)
            self._now[key] = ref(kept, lambda _: self._drop(key)), size
            self.bytes += size
            kept.round = self.round
            while self.bytes > MOST_BYTES and self._put_one_away():
                pass

    def asked_for(self, kept: Kept) -> None:
        """Count columns as asked for now."""
        if kept.round == self.round:
            return
        kept.round = self.round
        key = id(kept)
        with self._lock:
            found = self._last.pop(key, None) or self._before.pop(key, None)
            if found is not None:
                self._now[key] = found

    def _put_one_away(self) -> bool:
        """Put one away, if any may be: of the last round what this one, if alike, asks for last."""
        if self._before:
            key, (kept, _) = next(iter(self._before.items()))
        elif self._last:
            key, (kept, _) = next(reversed(self._last.items()))
        else:
            return False
        self._drop(key)
        there = kept()
        if there is not None:
            there.put_away()
        return True

    def _drop(self, key: int) -> None:
        with self._lock:
            for row in (self._now, self._last, self._before):
                if key in row:
                    self.bytes -= row.pop(key)[1]


_SHELF = _Shelf()


def new_round() -> None:
    """Begin to ask for many columns in turn: what this round asks for stays until the next."""
    _SHELF.new_round()


def kept_bytes() -> int:
    """Return how much memory all columns take that are kept."""
    return _SHELF.bytes
