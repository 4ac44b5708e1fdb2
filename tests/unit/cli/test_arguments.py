"""`--holdout A B` holds out both: a second value must never be learnt from."""

from __future__ import annotations

from agent.cli.terminal.arguments import repeated


def test_every_value_up_to_the_next_option_is_held_out() -> None:
    given = ["explain", "twin.toml", "a", "--holdout", "b", "c", "d", "--out", "here"]
    assert repeated(given) == [
        "explain",
        "twin.toml",
        "a",
        "--holdout",
        "b",
        "--holdout",
        "c",
        "--holdout",
        "d",
        "--out",
        "here",
    ]


def test_what_has_no_such_option_stays_as_it_is() -> None:
    given = ["run", "CELL.toml", "--axis", "1", "--reverse"]
    assert repeated(given) == given


def test_an_option_that_is_repeated_already_stays() -> None:
    given = ["explain", "t", "a", "--holdout", "b", "--holdout", "c", "--json"]
    assert repeated(given) == given
