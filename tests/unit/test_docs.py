"""What the README and the docs tell a reader to call, open or follow is there."""

from __future__ import annotations

import itertools
import re
import shlex
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer

from agent.cli.app import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^ *```(\w*)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`([^`\n]+(?:\n[^`\n]+)?)`")
ROOMS = "agent|drivers|fakes|trajectories|tests|docs"


class Call(NamedTuple):
    """One call of a program as a page has it; a whole line of a fenced block, or some words."""

    words: list[str]
    is_whole: bool


def calls(page: Path, program: str) -> Iterator[Call]:
    """Yield every call of a program, shell comments and what follows a pipe left out."""
    text = page.read_text(encoding="utf-8")
    blocks = [
        block if language == "bash" else "\n".join(re.findall(r"^uv run .*$", block, re.MULTILINE))
        for language, block in FENCE.findall(text)  # what is in no bash may be what is printed
    ]
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    spans = [" ".join(span.split()) for span in CODE.findall(FENCE.sub("", text))]
    for line, is_whole in [(line, True) for line in lines] + [(span, False) for span in spans]:
        found = re.search(rf"(?:^|uv run |[$] |& )({re.escape(program)}(?: .*|$))", line)
        if found and found[1] != "python -m" and not found[1].startswith(f"{program} = "):
            command = re.split(r" [|><;&]|  +#| #", found[1])[0]
            yield Call(shlex.split(command)[len(program.split()) :], is_whole)


@cache
def root() -> Any:
    return typer.main.get_command(app)


def mistakes(call: Call) -> list[str]:
    """Return what the command line would not take of a call of `stribeck`."""
    command, words = root(), [w for w in call.words if w != "--debug"]
    while words and hasattr(command, "commands") and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    if command.name == "night" and words and not words[0].startswith("-"):
        command = command.commands["run"]  # which is what a cell alone means
    if hasattr(command, "commands"):
        unknown = words and words[0] not in ("...", "--help")
        return [f"no command {words[0]}"] if unknown else []
    options = {o for p in command.params for o in (*p.opts, *p.secondary_opts)} | {"--help"}
    given = {w.partition("=")[0] for w in words if re.match(r"--?[a-z]", w)}
    wrong = [f"no option {option}" for option in sorted(given - options)]
    if call.is_whole and "..." not in words and "--help" not in given:
        needed = [p for p in command.params if p.required]
        wrong += [
            f"{p.opts[0]} is missing"
            for p in needed
            if p.param_type_name == "option" and not given.intersection(p.opts)
        ]
        arguments = [p for p in needed if p.param_type_name == "argument"]
        wrong += ["an argument is missing"] * (len(words) - len(given) < len(arguments))
    return wrong


def _short(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=_short)
def test_every_command_that_a_page_shows_is_taken(page: Path) -> None:
    wrong = {" ".join(c.words): mistakes(c) for c in calls(page, "stribeck") if mistakes(c)}
    assert wrong == {}


@pytest.mark.parametrize("page", PAGES, ids=_short)
def test_every_module_that_a_page_shows_is_there_with_its_options(page: Path) -> None:
    wrong = []
    for call in calls(page, "python -m"):
        name, *words = call.words
        path = ROOT / name.replace(".", "/")
        path = path / "__main__.py" if path.is_dir() else path.with_suffix(".py")
        if name.split(".")[0] not in ROOMS.split("|"):
            continue
        source = path.read_text(encoding="utf-8") if path.exists() else ""
        own = itertools.takewhile(lambda w: not w.endswith("python"), words)  # of no inner call
        options = [w.partition("=")[0] for w in own if w.startswith("--")]
        wrong += [name] * (not source) + [o for o in options if f'"{o}"' not in source]
    assert wrong == []


@pytest.mark.parametrize("page", PAGES, ids=_short)
def test_every_file_that_a_page_names_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = re.findall(rf"`((?:{ROOMS})/[\w./-]+\.(?:py|md|toml|j2))`", text)
    linked = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", text)
    missing = [name for name in named if not (ROOT / name).exists()]
    missing += [link for link in linked if not (page.parent / link).exists()]
    assert missing == []


def test_a_wrong_call_is_seen() -> None:
    assert mistakes(Call(["fly", "me"], True)) == ["no command fly"]
    assert mistakes(Call(["run", "CELL.toml", "--fast"], False)) == ["no option --fast"]
    assert mistakes(Call(["run", "--axis=1"], True)) == ["an argument is missing"]
    assert mistakes(Call(["run", "CELL.toml"], True)) == ["--axis is missing"]
    assert mistakes(Call(["catalogue", "list", "FOLDER", "--newest", "3"], True)) == []
    assert sum(1 for page in PAGES for _ in calls(page, "stribeck")) > 60
