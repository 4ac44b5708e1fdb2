"""The one table of words: every key that the page may say, in both languages."""

from __future__ import annotations

import re
import string
from importlib.resources import files

from agent.cell.cell import parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cli.terminal.talk import STAGES as TALKED
from agent.cycle.preconditions import Judged, preconditions
from agent.web.cycles import CYCLES
from agent.web.roles import Role
from agent.web.routes.history import KINDS
from agent.web.routes.run import STAGES
from agent.web.words.language import LANGUAGES, WORDS, fine, language_of, number, say
from fakes.specification import FakeSpecification
from trajectories.limits import UNITS

FINDINGS = (
    "alarm",
    "undecidable",
    "stopped",
    "unestimated",
    "baseline",
    "measured",
    "changed",
    "unclear",
    "as_before",
)


def _said_by_name() -> set[str]:
    """Return keys that are put together from a word: each family with all its words."""
    release = '[release]\nkind = "can-input"\nnode_id = 31\nbit = 0\n'
    text = fake_cell_text(FakeSpecification(), interface="udp_multicast", channel="239.74.163.9")
    cell = parse_cell(text.replace("[[axis]]", f"{release}\n[[axis]]", 1))
    names = [p.name.replace(" ", "_") for p in preconditions(cell, cell.axis[0])]
    now = [
        p.name.replace(" ", "_")
        for p in preconditions(cell, cell.axis[0])
        if p.judged is Judged.WITHOUT_BUS
    ]
    return {
        *(f"condition_{name}" for name in (*names, "nothing_else_runs")),
        *(f"asks_{name}" for name in now),
        *(f"judged_{judged.name}" for judged in Judged if judged is not Judged.WITHOUT_BUS),
        *(f"stage_{stage}" for stage in STAGES),
        *(f"cycle_{word}{end}" for word in CYCLES for end in ("", "_hint")),
        *(f"kind_{kind}" for kind in FINDINGS),
        *(f"next_{kind}" for kind in FINDINGS),
        *(f"event_{kind}" for kind in KINDS),
        *(f"role_{role.word}" for role in Role),
        *(f"quantity_{quantity}" for quantity in UNITS),
        *(f"verdict_{verdict}" for verdict in ("holds", "refused", "person", "later")),
    }


def _said_in_full() -> set[str]:
    """Return keys that templates and code name, and problems by their keys."""
    found: set[str] = set()
    for file in (files("agent.web") / "templates").iterdir():
        found |= set(re.findall(r"""\bt\(["']([a-z_]+)["'][,)]""", file.read_text("utf-8")))
    for file in (*files("agent.web").iterdir(), *files("agent.web.routes").iterdir()):
        if file.name.endswith(".py"):
            text = file.read_text("utf-8")
            found |= set(re.findall(r'TurnedAwayError\(\s*\d+, "([a-z_]+)"', text))
            found |= set(re.findall(r'_problem\(request, \d+, "([a-z_]+)"', text))
            found |= set(re.findall(r'say\(language, "([a-z_]+)"', text))
    return found | {"not_there", "too_large"}


def test_what_is_said_is_in_the_table_and_what_is_in_the_table_is_said() -> None:
    said = _said_by_name() | _said_in_full()
    assert said - set(WORDS) == set()
    assert set(WORDS) - said == set()


def test_both_languages_are_complete_and_take_the_same_values() -> None:
    for key, texts in WORDS.items():
        assert len(texts) == len(LANGUAGES)
        fields = [{name for _, name, _, _ in string.Formatter().parse(t) if name} for t in texts]
        assert fields[0] == fields[1], key
        assert all(text.strip() == text and text for text in texts), key


def test_every_stage_that_a_terminal_knows_the_page_knows() -> None:
    assert set(TALKED) <= set(STAGES)


def test_numbers_are_written_as_the_language_writes_them() -> None:
    assert number("de", -1.25, 1) == "−1,2"
    assert number("en", 3.0, 1, sign=True) == "+3.0"
    assert number("en", None, 1) == "–"
    assert [number("en", x, 1, sign=True) for x in (-0.04, 0.0, 0.04)] == ["0.0"] * 3
    assert number("de", -0.06, 1, sign=True) == "−0,1"
    assert (fine("en", 30000.0), fine("en", 9.84), fine("de", 196.8)) == ("30000", "9.84", "197")


def test_the_language_is_the_chosen_one_else_the_browser_s() -> None:
    assert language_of("de", "en") == "de"
    assert language_of("xx", "fr-FR, de-AT;q=0.8, en;q=0.5") == "de"
    assert language_of("", "fr") == "en"
    assert say("de", "axis", n=2) == "Achse 2"
