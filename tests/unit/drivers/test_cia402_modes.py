"""The mode ladder: which mode a drive gets, and the reason that is kept."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivers.cia402.modes import LADDER, choose
from drivers.cia402.words import Mode
from drivers.errors import ConfigurationError
from tests.contract.axis_rig import CONFIG

WORDS = [rung.word for rung in LADDER]


def modes(*words: str) -> int:
    """Return 0x6502 for these modes, and for torque and homing, which must change nothing."""
    chosen = sum(1 << rung.mode - 1 for rung in LADDER if rung.word in words)
    return (
        chosen | 1 << Mode.HOMING - 1 | 1 << Mode.PROFILE_TORQUE - 1 | 1 << Mode.CYCLIC_TORQUE - 1
    )


def test_the_ladder_is_climbed_down_in_order() -> None:
    for first in range(len(WORDS)):
        choice = choose(CONFIG, modes(*WORDS[first:]))
        assert choice.rung.word == WORDS[first]
        assert "0x6502 reads 0x" in choice.reason
        for missing in WORDS[:first]:
            assert missing in choice.reason


def test_the_cell_may_ask_for_any_mode_that_there_is() -> None:
    for word in WORDS:
        choice = choose(replace(CONFIG, mode=word), modes(*WORDS))
        assert choice.rung.word == word
        assert "the cell asks for it" in choice.reason
        others = [other for other in WORDS if other != word]
        with pytest.raises(ConfigurationError, match=rf"\({word}\)"):
            choose(replace(CONFIG, mode=word), modes(*others))


@pytest.mark.parametrize(
    "lacking", [{"abort_connection_option": None}, {"abort_connection_option": 0}]
)
def test_without_a_reaction_to_our_silence_only_bounded_moves_are_taken(
    lacking: dict[str, int | None],
) -> None:
    config = replace(CONFIG, **lacking)  # type: ignore[arg-type]  # the keys are fields of it
    choice = choose(config, modes(*WORDS))
    assert choice.rung.word == "pp"
    assert "0x6007" in choice.reason
    # Where there are none, or where a cell insists, the watchdog's proof decides before any motion.
    unproven = choose(config, modes("pv", "csp"))
    assert (unproven.rung.word, "only the proof" in unproven.reason) == ("pv", True)
    assert choose(replace(config, mode="pv"), modes(*WORDS)).rung.word == "pv"


def test_a_drive_that_watches_nobody_is_never_streamed_to() -> None:
    deaf = replace(CONFIG, heartbeat_consumer_subindex=None)
    assert choose(deaf, modes(*WORDS)).rung.word == "pp"
    for word in WORDS:
        if word != "pp":
            for mode in ("auto", word):
                with pytest.raises(ConfigurationError, match=r"agent died.*0x1016"):
                    choose(replace(deaf, mode=mode), modes(word))


@pytest.mark.parametrize("supported", [None, 0])
def test_where_the_drive_does_not_say_its_profile_does(supported: int | None) -> None:
    known = replace(CONFIG, offered_modes=("vl", "pp", "ip"))
    assert choose(known, supported).rung.word == "vl"
    assert "its profile says" in choose(known, supported).reason
    assert choose(CONFIG, supported).rung.word == "pv"


def test_torque_and_homing_are_no_way_to_drive() -> None:
    with pytest.raises(ConfigurationError, match="no profile velocity mode"):
        choose(CONFIG, modes())
    for word in ("cst", "hm", "tq", ""):
        with pytest.raises(ValueError, match="mode must be auto or one of"):
            replace(CONFIG, mode=word)
