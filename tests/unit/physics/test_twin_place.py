"""What a person wrote about a joint is not lost because a command writes a twin there."""

from __future__ import annotations

from pathlib import Path

import pytest

from agent.cli.explain.explain import run_explain
from agent.cli.identify.estimate import run_twin
from agent.cli.identify.twin_file import check_twin_place
from agent.errors import StorageError
from agent.physics.twin import Twin, format_twin

TWIN = format_twin(Twin("cell7", 1, 101.0, 0.02, 0.3, 0.01))


@pytest.mark.parametrize(
    "text", ["# measured by hand on 3 May\n" + TWIN, TWIN + "# no payload\n", "robot = 1\n"]
)
def test_a_twin_with_a_persons_words_is_not_replaced(tmp_path: Path, text: str) -> None:
    """`stribeck twin --out twin.toml` had thrown the comments away without a word."""
    mine = tmp_path / "twin.toml"
    mine.write_text(text)
    other = tmp_path / "plain.toml"
    other.write_text(TWIN)
    with pytest.raises(StorageError, match="was not written by stribeck as it stands"):
        run_twin(["before any recording is read"], mine)
    with pytest.raises(StorageError, match="was not written by stribeck as it stands"):
        run_explain(other, ["before any recording is read"], [], tmp_path, as_json=True)
    assert mine.read_text() == text


def test_the_simulation_that_is_explained_is_not_replaced_by_the_extended_one(
    tmp_path: Path,
) -> None:
    mine = tmp_path / "twin.toml"
    mine.write_text(TWIN)
    with pytest.raises(StorageError, match="is the simulation to be explained"):
        run_explain(mine, ["before any recording is read"], [], tmp_path, as_json=True)


def test_what_stribeck_wrote_is_replaced_as_before(tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    check_twin_place(path)
    for text in ("", TWIN):
        path.write_text(text)
        check_twin_place(path)
