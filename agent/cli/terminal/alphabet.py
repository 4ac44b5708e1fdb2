"""Output in an encoding that lacks letters: files and pipes of Windows, old locales."""

from __future__ import annotations

import codecs
import io
import re
import sys

_NEAREST = str.maketrans({"−": "-", "–": "-", "→": "->", "…": "...", "²": "2", "³": "3", "µ": "u"})
_NAME = "stribeck-nearest"
_NO_TEXT = re.compile(r"[\ud800-\udfff]")


def say_in_any_alphabet() -> None:
    """Write the nearest letters in place of those that stdout and stderr cannot say.

    Python gives UTF-8 to a console, and to files and pipes the system's own encoding: cp1252 on a
    western Windows, which has no minus sign. That encoding stays, for whoever reads the file
    expects it; what it lacks becomes ASCII instead of an error after the work is done. A name that
    is no text at all (lone surrogates) is refused as ever.
    """
    codecs.register_error(_NAME, _nearest)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and not _says_all(stream.encoding):
            stream.reconfigure(errors=_NAME)


def _says_all(encoding: str) -> bool:
    return codecs.lookup(encoding).name.startswith("utf")


def _nearest(error: UnicodeError) -> tuple[str, int]:
    """Return ASCII for what cannot be encoded, and where to go on: a codec's error handler."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lost = error.object[error.start : error.end]
    if _NO_TEXT.search(lost):
        raise error
    return "".join(
        letter if letter.isascii() else letter.encode("ascii", "backslashreplace").decode()
        for letter in lost.translate(_NEAREST)
    ), error.end
