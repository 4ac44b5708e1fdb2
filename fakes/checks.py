"""Checks that the frozen descriptions of a fake share: what was expected, what came."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def require_finite(value: DataclassInstance) -> None:
    """Refuse a number that is not one, in any float field of a dataclass."""
    for field in fields(value):
        number = getattr(value, field.name)
        if isinstance(number, float) and not math.isfinite(number):
            raise ValueError(f"{field.name}: expected a finite number, got {number}")


def require_positive(value: DataclassInstance, *names: str) -> None:
    """Refuse zero and below in the named fields."""
    for name in names:
        if not getattr(value, name) > 0:
            raise ValueError(f"{name}: expected a number above 0, got {getattr(value, name)}")


def require_not_negative(value: DataclassInstance, *names: str) -> None:
    """Refuse what is below zero in the named fields."""
    for name in names:
        if not getattr(value, name) >= 0:
            raise ValueError(f"{name}: expected 0 or more, got {getattr(value, name)}")
