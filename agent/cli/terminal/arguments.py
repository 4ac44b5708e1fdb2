"""Options that take several values, as the contract writes them: `--holdout A B C`."""

from __future__ import annotations

from collections.abc import Sequence

SEVERAL = ("--holdout", "--dedicated")
"""Options whose every value up to the next option belongs to them."""


def repeated(arguments: Sequence[str]) -> list[str]:
    """Return arguments with the option said once for each of its values.

    The parser knows one value for one option; a second one would become a recording to learn from,
    and the proof would have seen what it proves.
    """
    out: list[str] = []
    option = ""
    values = 0
    for argument in arguments:
        if argument.startswith("-"):
            option, values = (argument if argument in SEVERAL else ""), 0
        elif option:
            values += 1
            if values > 1:
                out.append(option)
        out.append(argument)
    return out
