"""The label: everything that is true of a case, as JSON, sealed before anybody explains it."""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Mapping
from typing import Any

Label = Mapping[str, Any]


class SealBrokenError(ValueError):
    """A label, or its salt, is not the one that was sealed."""


def canonical(label: Label) -> str:
    """Return the label as JSON with one spelling: sorted keys, no spaces, no NaN."""
    return json.dumps(label, sort_keys=True, separators=(",", ":"), allow_nan=False)


def seal(label: Label, salt: str) -> str:
    """Return the SHA-256, in hex, of salt and label; publish it before the case is explained.

    The salt is what keeps a label from being guessed: there are few effects, and a hash of a
    guess is quickly made.
    """
    return hmac.new(salt.encode(), canonical(label).encode(), hashlib.sha256).hexdigest()


def open_label(text: str, salt: str, sealed: str) -> dict[str, Any]:
    """Return the label whose text is what was sealed.

    Raises
    ------
    SealBrokenError
        Label or salt differ from what was sealed, or the text is no label.
    """
    try:
        label = json.loads(text)
    except ValueError as error:
        raise SealBrokenError(f"the label is not JSON ({error})") from error
    if not isinstance(label, dict):
        raise SealBrokenError(f"a label is a JSON object, got {type(label).__name__}")
    if not hmac.compare_digest(seal(label, salt), sealed):
        raise SealBrokenError("label and salt are not those that were sealed")
    return label
