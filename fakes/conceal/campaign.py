"""Which cases a score is made of, and how many of them had to be dropped."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from fakes.conceal.case import ConcealedCase, conceal
from fakes.conceal.concealment import UnreachableError
from fakes.conceal.design import Design
from fakes.conceal.library import ABSORBED, EFFECTS, LOOK_ALIKES
from fakes.conceal.outsiders import OUTSIDERS

Kind = Literal["single", "null", "pair", "triple", "look-alike", "outsider"]
KINDS: tuple[Kind, ...] = get_args(Kind)
SNRS = (0.25, 0.5, 1.0, 2.0)


@dataclass(frozen=True)
class Order:
    """One case to be made; `rival` is the look-alike that must not be named in its place."""

    seed: int
    kind: Kind
    effects: tuple[str, ...]
    design: Design
    snr: float
    rival: str | None = None


@dataclass
class Tally:
    """How many cases were made, and why others were not."""

    made: int = 0
    dropped: list[tuple[Order, str]] = field(default_factory=list)


def orders(kind: Kind, count: int, *, first_seed: int, design: Design = "rich") -> Iterator[Order]:
    """Yield `count` orders of a kind, each with a seed of its own.

    Effects, pairs and SNR levels take turns, so that every one of them comes up as often; which
    effects meet in a mixture is drawn from the seed. Mixtures hold only what a refit does not
    absorb.
    """
    if kind not in KINDS:
        raise ValueError(f"kind: expected one of {', '.join(KINDS)}, got {kind!r}")
    mixable = [effect for effect in EFFECTS if effect not in ABSORBED]
    alike = [pair for both in LOOK_ALIKES for pair in (both, both[::-1])]
    for number in range(count):
        seed = first_seed + number
        effects: tuple[str, ...] = ()
        rival = None
        turns = 1
        if kind == "single":
            turns, effects = len(EFFECTS), (list(EFFECTS)[number % len(EFFECTS)],)
        elif kind == "outsider":
            turns, effects = len(OUTSIDERS), (list(OUTSIDERS)[number % len(OUTSIDERS)],)
        elif kind == "look-alike":
            turns = len(alike)
            concealed, rival = alike[number % len(alike)]
            effects = (concealed,)
        elif kind != "null":
            rng = np.random.default_rng(seed)
            drawn = rng.choice(mixable, size=2 if kind == "pair" else 3, replace=False)
            effects = tuple(str(effect) for effect in drawn)
        snr = SNRS[number // turns % len(SNRS)]
        yield Order(seed, kind, effects, design, snr, rival)


def cases(ordered: Iterator[Order], tally: Tally) -> Iterator[tuple[Order, ConcealedCase]]:
    """Yield every case that can be made, and keep the tally."""
    for order in ordered:
        try:
            case = conceal(order.seed, effects=order.effects, design=order.design, snr=order.snr)
        except UnreachableError as reason:
            tally.dropped.append((order, str(reason)))
            continue
        tally.made += 1
        yield order, case
