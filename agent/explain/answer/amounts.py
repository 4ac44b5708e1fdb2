"""Amounts as sentences have them: two digits, and a unit that keeps them short."""

from __future__ import annotations

from collections.abc import Sequence

from agent.numbers import fixed, scale_for, significant

_SHOWN = 20  # of names in a row


def percent(share: float) -> str:
    """Return a share, 0 to 1, in whole percent."""
    whole = 100.0 * min(max(share, 0.0), 1.0)
    return f"{fixed(whole, 0)} %" if whole >= 1.0 or whole == 0.0 else "less than 1 %"


def amount(value: float, unit: str) -> str:
    """Return a number in SI in the unit that its size asks for."""
    scale = scale_for(unit, (value,))
    return f"{significant(value * scale.factor, 2)} {scale.unit}"


def torque(value: float) -> str:
    """Return a torque, N m, in its own unit."""
    return amount(value, "N m")


def duration(value: float) -> str:
    """Return the size of a time, s, in its own unit."""
    return amount(abs(value), "s")


def short(value: float) -> str:
    """Return a number with two digits."""
    return significant(value, 2)


def factor(value: float) -> str:
    """Return a factor: with three decimals near 1, else with three digits."""
    return f"{value:.3f}" if 0.1 < abs(value) < 10.0 else significant(value, 3)


def listed(names: Sequence[str]) -> str:
    """Return names in a row, "a, b and c"; the first twenty, and how many more."""
    shown = list(names[:_SHOWN])
    if len(names) > _SHOWN:
        shown.append(f"{len(names) - _SHOWN} more")
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"
