"""The lines of an EDS or DCF (CiA 306) as they really are: sections and options with their lines.

Real files are not always UTF-8, repeat sections and options, put comments after values, and hold
lines that are nothing. Nothing of that ends the reading: it is a warning with its line number. What
comes second wins, as in most readers, and is said.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_SECTION = re.compile(r"^\[\s*([^\]]*?)\s*\](.*)$")
_COMMENT = re.compile(r"\s+[;#].*$|\s+//.*$")
_NUMBER_THEN_TEXT = re.compile(
    r"^([+-]?\s*(?:0\s*[xX]\s*[0-9A-Fa-f]+|[0-9]+)|\$NODEID\s*\+\s*0[xX][0-9A-Fa-f]+)\s*[;#/(].*$",
    re.IGNORECASE,
)
LONGEST_LINE = 10_000
LISTED = 8
"""Of lines that are odd in the same way, so many are named; a file may have hundreds."""


@dataclass(frozen=True)
class Warned:
    """What is odd about a file, and where; line 0 means the file as a whole."""

    line: int
    text: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.text}" if self.line else self.text


@dataclass(frozen=True)
class Option:
    """One value and the line that it stands in."""

    text: str
    line: int


@dataclass
class Section:
    """One section's options by their names in lower case."""

    name: str
    line: int
    options: dict[str, Option]


def decode(data: bytes) -> tuple[str, list[Warned]]:
    """Return a file's text: UTF-8, with or without its mark, UTF-16 with its mark, else cp1252."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace"), [Warned(0, "the file is UTF-16")]
    try:
        return data.decode("utf-8-sig"), []
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        text = data.decode("cp1252", errors="replace")
        return text, [Warned(line, "this is not UTF-8; the file is read as Windows-1252")]


def sections_of(text: str) -> tuple[dict[str, Section], list[Warned]]:
    """Return the sections by their names in lower case, and everything that was odd."""
    found: dict[str, Section] = {}
    warned: list[Warned] = []
    current: Section | None = None
    commented: list[int] = []
    for number, raw in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        line = raw.replace("\0", "").strip()
        if not line or line[0] in ";#" or line.startswith("//"):
            continue
        if len(line) > LONGEST_LINE:
            warned.append(Warned(number, f"{len(line)} characters are no line of an EDS; skipped"))
            continue
        if line[0] == "[":
            current = _section(line, number, found, warned)
        elif _option(line, number, current, warned):
            commented.append(number)
    if commented:
        warned.append(_comments(commented))
        warned.sort(key=lambda one: one.line)
    return found, warned


def _comments(lines: list[int]) -> Warned:
    """Return one warning for all comments that stand after values (CiA 306 has them alone)."""
    others = ", ".join(str(line) for line in lines[1:LISTED])
    others += f" and {len(lines) - LISTED} more" * (len(lines) > LISTED)
    return Warned(
        lines[0], "a comment after the value is left out" + f"; so in {others}" * bool(others)
    )


def _section(
    line: str, number: int, found: dict[str, Section], warned: list[Warned]
) -> Section | None:
    """Open a section, or go on in one that was there before."""
    match = _SECTION.match(line)
    if match is None or not match[1]:
        warned.append(Warned(number, f"{line[:40]!r} opens no section; what follows is skipped"))
        return None
    rest = match[2].strip()
    if rest and rest[0] not in ";#/":
        warned.append(Warned(number, f"{rest[:40]!r} after the section's name is left out"))
    name = " ".join(match[1].split())
    key = re.sub(r"^0x", "", name.lower())
    before = found.get(key)
    if before is not None:
        warned.append(
            Warned(number, f"section [{name}] again, as in line {before.line}; both are read")
        )
        return before
    found[key] = Section(name, number, {})
    return found[key]


def _option(line: str, number: int, section: Section | None, warned: list[Warned]) -> bool:
    """Take one option into the section that is open; return whether a comment followed it."""
    name, equals, value = line.partition("=")
    name = name.strip().lower()
    if not equals or not name:
        warned.append(Warned(number, f"{line[:40]!r} is neither a section nor a value; skipped"))
        return False
    if section is None:
        warned.append(Warned(number, f"{name!r} stands in no section; skipped"))
        return False
    text = _without_comment(value.strip(), name)
    before = section.options.get(name)
    if before is not None and before.text != text:
        warned.append(
            Warned(
                number,
                f"[{section.name}] {name} is {text!r} here and {before.text!r} in line "
                f"{before.line}; the later one is taken",
            )
        )
    section.options[name] = Option(text, number)
    return text != value.strip()


def _without_comment(value: str, name: str) -> str:
    """Return a value without what was written after it; a name keeps its semicolons."""
    if name in ("parametername", "denotation", "description", "filename"):
        return value
    match = _NUMBER_THEN_TEXT.match(value)
    return match[1].strip() if match else _COMMENT.sub("", value).strip()
