"""Every joint's cycles out of the lake's estimates, a bounded number of them at a time.

To know whether a joint has new cycles only the keys are read; the cycles themselves are read of the
joints that are due, joint by joint in order, from those files and row groups that hold them.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from agent.fleet.entry import entry_of, joint_of
from agent.fleet.estimates import estimates_of

if TYPE_CHECKING:
    import pyarrow as pa

    from agent.fleet.lake import Lake

_CYCLES = 50_000  # that are held at a time, some 2 KB each; one joint may exceed it
_AFTER_ALL = "/n"  # sorts after every path of a joint, which go on with /month=


@dataclass(frozen=True)
class Stand:
    """How far a joint's history goes.

    Parameters
    ----------
    site, robot : str
    axis : int
    month : str
        Of its last cycle.
    cycles : int
    prefix : str
        What the paths of its recordings begin with.
    digest : str
        Of the names of all its cycles, and of what else its verdict depends on.
    """

    site: str
    robot: str
    axis: int
    month: str
    cycles: int
    prefix: str
    digest: str


@dataclass
class _Growing:
    """A joint while the months are gone through."""

    digest: Any
    last: str = ""
    count: int = 0
    month: str = ""


def stands(lake: Lake, beside: str) -> list[Stand]:
    """Return how far each joint's history goes, in order of the joints.

    Parameters
    ----------
    lake : Lake
    beside : str
        What else a verdict depends on.
    """
    results = estimates_of(lake)
    found: dict[str, _Growing] = {}
    for month in results.months():
        for key in usable(results.table(month, ("failure",))):
            prefix = joint_of(key)
            joint = found.get(prefix)
            if joint is None:
                joint = found[prefix] = _Growing(hashlib.sha256(beside.encode()))
            joint.digest.update(key.encode())
            joint.last, joint.month, joint.count = key, month, joint.count + 1
    return [_stand(prefix, joint) for prefix, joint in sorted(found.items())]


def usable(rows: pa.Table) -> list[str]:
    """Return the keys of the rows (a table with ``failure``) that have an estimate."""
    import pyarrow as pa
    import pyarrow.compute as pc

    return [
        str(k)
        for k in rows.filter(pc.equal(rows.column("failure"), pa.scalar(""))).column(0).to_pylist()
    ]


def cycles_of(lake: Lake, wanted: Iterable[Stand]) -> Iterator[tuple[Stand, tuple[str, ...]]]:
    """Yield joints with their cycles (JSON, in order of month and name), the joints in order."""
    results = estimates_of(lake)
    months = tuple(results.months())
    for some in _portions(sorted(wanted, key=lambda stand: stand.prefix)):
        cycles: dict[str, list[str]] = {stand.prefix: [] for stand in some}
        low, high = f"{some[0].prefix}/", f"{some[-1].prefix}{_AFTER_ALL}"
        for month in months:
            table = results.table(month, ("cycle",), low, high)
            for key, cycle in zip(*(c.to_pylist() for c in table.columns), strict=True):
                own = cycles.get(joint_of(key))
                if own is not None and cycle:
                    own.append(cycle)
        for stand in some:
            yield stand, tuple(cycles.pop(stand.prefix))


def _portions(stands: list[Stand]) -> Iterator[list[Stand]]:
    """Cut joints into portions of a bounded number of cycles."""
    some: list[Stand] = []
    for stand in stands:
        if some and sum(s.cycles for s in some) + stand.cycles > _CYCLES:
            yield some
            some = []
        some.append(stand)
    if some:
        yield some


def _stand(prefix: str, joint: _Growing) -> Stand:
    entry = entry_of(joint.last, 0)
    assert entry is not None
    return Stand(
        entry.site,
        entry.robot,
        entry.axis,
        joint.month,
        joint.count,
        prefix,
        str(joint.digest.hexdigest())[:32],
    )
