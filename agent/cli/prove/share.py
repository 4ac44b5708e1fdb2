"""Shares with what their number of cases is worth, and quantiles, as text."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

_T = TypeVar("_T")
_NORMAL = 1.96


@dataclass(frozen=True)
class Share:
    """So many of so many."""

    hits: int
    cases: int

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> Share:
        """Return the share of its JSON."""
        return cls(int(document["hits"]), int(document["cases"]))

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval of Wilson (J. Am. Stat. Assoc. 22 (1927) 209), 0 to 1."""
        if not self.cases:
            return 0.0, 1.0
        n, z2 = self.cases, _NORMAL**2
        share = self.hits / n
        middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n)
        spread = share * (1.0 - share) / n + z2 / (4.0 * n * n)
        half = _NORMAL * math.sqrt(spread) / (1.0 + z2 / n)
        return max(middle - half, 0.0), min(middle + half, 1.0)

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {"hits": self.hits, "cases": self.cases, "ci95": list(self.interval)}

    def text(self) -> str:
        """Return ``hits/cases``, or a dash for no case."""
        return f"{self.hits}/{self.cases}" if self.cases else "-"

    def with_interval(self) -> str:
        """Return ``hits/cases (low to high %)``."""
        if not self.cases:
            return "-"
        low, high = self.interval
        return f"{self.hits}/{self.cases} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"


def share_of(items: Sequence[_T], test: Callable[[_T], bool]) -> Share:
    """Return how many items pass a test."""
    return Share(sum(1 for item in items if test(item)), len(items))


def quantile_text(
    values: Sequence[float], levels: Sequence[float], words: str, scale: float = 1.0
) -> str:
    """Return quantiles put into words, and of how many values; a dash for none."""
    if not values:
        return "-"
    found = scale * np.quantile(np.asarray(values, dtype=np.float64), levels)
    return f"{words.format(*found)} (n {len(values)})"
