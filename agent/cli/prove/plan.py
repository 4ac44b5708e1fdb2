"""Which cases a proof is made of: one fixed sequence; a short proof takes its beginning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from agent.errors import UsageError

if TYPE_CHECKING:
    from fakes.conceal import Order

_T = TypeVar("_T")

_MOST_CASES = 100_000
FULL = 120
"""Cases of the whole proof: every effect twice in rich recordings and once in poor ones."""

RICH, POOR, NULL = "rich", "poor", "null"
PAIR, TRIPLE, ALIKE, OUTSIDER = "pair", "triple", "look-alike", "outsider"

QUOTA: Mapping[str, int] = {
    RICH: 44,
    POOR: 22,
    NULL: 12,
    PAIR: 10,
    TRIPLE: 6,
    ALIKE: 16,
    OUTSIDER: 10,
}
"""How many of `FULL` cases each group has."""

_VISIBLE = (0.5, 1.0, 2.0)
_STRIDE = 5  # prime to the number of effects, outsiders and pairs: neighbours in a list are alike


@dataclass(frozen=True)
class Asked:
    """One case of the sequence: its number from 1, its group, and what is to be concealed."""

    number: int
    group: str
    order: Order


def plan(count: int, first_seed: int) -> tuple[Asked, ...]:
    """Return the first `count` cases of the sequence, seeds counted up from `first_seed`.

    The groups are mixed evenly, so that every beginning of the sequence is a fair sample of the
    whole. Rich single effects take all four SNR levels in turn, all else the three from 0.5 up.
    After `FULL` cases the sequence goes on with new seeds and other SNR levels.
    """
    if not 1 <= count <= _MOST_CASES:
        raise UsageError(f"--cases: expected 1 to {_MOST_CASES}, got {count}.")
    if first_seed < 0:
        raise UsageError(f"--seed: expected 0 or more, got {first_seed}.")
    groups = _mixed()
    seen = dict.fromkeys(QUOTA, 0)
    out = []
    for number in range(count):
        group = groups[number % FULL]
        out.append(Asked(number + 1, group, _order(group, seen[group], first_seed + number)))
        seen[group] += 1
    return tuple(out)


def _mixed() -> list[str]:
    """Return the groups of the `FULL` cases, each spread evenly over the sequence."""
    places = [
        ((index + 0.5) / quota, name) for name, quota in QUOTA.items() for index in range(quota)
    ]
    return [name for _, name in sorted(places)]


def _order(group: str, index: int, seed: int) -> Order:
    """Return what the `index`-th case of a group conceals."""
    from fakes.conceal import EFFECTS, LOOK_ALIKES, OUTSIDERS, SNRS, Order, orders

    snr = _VISIBLE[index % len(_VISIBLE)]
    if group == RICH:
        # 22 effects and four levels: an effect's second turn is two levels up; after `FULL` cases
        # every turn would come back at the level that it had, so one is skipped.
        level = SNRS[(index + index // QUOTA[RICH]) % len(SNRS)]
        return Order(seed, "single", (_taken(tuple(EFFECTS), index),), "rich", level)
    if group == POOR:
        # Half way round: a short proof does not have the same effects in both cycles.
        half = len(EFFECTS) // 2
        return Order(seed, "single", (_taken(tuple(EFFECTS), index + half),), "poor", snr)
    if group == OUTSIDER:
        return Order(seed, "outsider", (_taken(tuple(OUTSIDERS), index),), "rich", snr)
    if group == ALIKE:
        both_ways = (*LOOK_ALIKES, *(pair[::-1] for pair in LOOK_ALIKES))
        concealed, rival = _taken(both_ways, index)
        return Order(seed, "look-alike", (concealed,), "rich", snr, rival)
    if group == NULL:
        return Order(seed, "null", (), "rich", 1.0)
    # Which effects meet in a mixture is drawn from the seed by the generator.
    (drawn,) = orders("pair" if group == PAIR else "triple", 1, first_seed=seed)
    return replace(drawn, snr=snr)


def _taken(among: Sequence[_T], index: int) -> _T:
    return among[index * _STRIDE % len(among)]
