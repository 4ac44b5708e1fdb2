"""Thesis Table 3.2 from simulations, and the page of laws from code."""

from __future__ import annotations

from agent.physics.catalogue import LAWS, page
from agent.physics.phenomena import table
from tests.conftest import REPOSITORY

# Columns: Coulomb; + viscous; + static; + Stribeck; Dahl; Bliman-Sorine; LuGre.
THESIS_TABLE_3_2 = {
    "Coulomb friction": "XXXXXXX",
    "Viscous friction": ".XXX.XX",
    "Static friction": "..XX.XX",
    "Stribeck friction": "...X..X",
    "Presliding displacement": "....XXX",
    "Varying breakaway": "......X",
    "Frictional lag": "......X",
}


def test_simulations_give_the_crosses_of_the_thesis() -> None:
    found = {
        phenomenon: "".join("X" if shown else "." for shown in laws.values())
        for phenomenon, laws in table().items()
    }
    assert found == THESIS_TABLE_3_2


def test_the_page_is_what_the_code_says() -> None:
    assert (REPOSITORY / "docs" / "laws.md").read_text(encoding="utf-8") == page()


def test_every_law_is_complete() -> None:
    for law in LAWS.values():
        assert law.equation, law.id
        assert law.parameters, law.id
        assert law.source, law.id
        assert law.limits, law.id
    assert len(LAWS) == 39
