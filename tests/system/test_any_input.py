"""Whatever is given in place of a file, a command answers in a sentence and an exit code."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from agent.cli.app import app
from agent.cli.terminal.exits import DONE, OUR_FAULT
from tests.system import explain_recordings as made
from tests.system.processes import called

GIVEN: dict[str, Callable[[Path], object]] = {
    "missing": lambda _: None,
    "empty": lambda p: p.write_bytes(b""),
    "words": lambda p: p.write_text("hello, I am nothing of yours\n"),
    "bytes": lambda p: p.write_bytes(random.Random(1).randbytes(5000)),
    "nested TOML": lambda p: p.write_text("a = " + "[" * 100_000),
    "nested JSON": lambda p: p.write_text("[" * 100_000),
    "long line": lambda p: p.write_bytes(b"a," * 1_000_000),
    "torn Parquet": lambda p: p.write_bytes(b"PAR1" + bytes(100) + b"PAR1"),
    "folder": lambda p: p.mkdir(),
    "link to itself": lambda p: p.symlink_to(p),
}
BAD, LONG = "BAD", "x" * 300
CALLS = """
run BAD --axis 1
run CELL --axis 1 --dry-run --trajectory BAD
plan BAD --axis 1 --seconds 20
estimate BAD
estimate BAD.csv
estimate RECORDING --validation BAD
twin BAD --out OUT
explain BAD RECORDING --out OUT
explain TWIN BAD --out OUT
explain TWIN RECORDING --holdout BAD --out OUT
explain TWIN RECORDING --cell BAD --out OUT
simulate BAD RECORDING --out OUT
simulate TWIN BAD --out OUT
ripple BAD
study BAD --out OUT
thermal BAD
flexible BAD
reversals BAD
verify-map BAD
eds BAD
recover BAD
fake --joint BAD --interface carrierpigeon
self-test BAD
schedule BAD
watch BAD --dedicated RECORDING
watch RECORDING --dedicated BAD
ordinary BAD
monitor BAD
monitor RECORDING --events BAD
stop BAD --axis 1
bus BAD
serve BAD
serve CELL --port 0 --tls-cert BAD --tls-key BAD
verify BAD
export BAD
import BAD.csv --robot r --axis 1 --gear-ratio 100
import BAD.txt --robot r --axis 1 --gear-ratio 100
import RECORDING --robot r --axis 1 --gear-ratio 100 --mapping BAD
notify BAD
notify CELL --night BAD
user list BAD
user invite BAD anna
user disable BAD anna
audit verify BAD
catalogue add BAD
catalogue list BAD
catalogue rebuild BAD
catalogue upgrade BAD
catalogue retain BAD --days 1
catalogue note BAD oil text --robot r
fleet push LAKE BAD --site a
fleet pack BAD
fleet estimate BAD --workers 1
fleet explain BAD --workers 1
fleet monitor BAD --workers 1
fleet report BAD
night run BAD --once
night run CELL --night BAD --once
night plan BAD
night install BAD --show
""".strip().splitlines()
NOTHING_YET = {"recover", "verify", "catalogue", "fleet"}  # an empty folder is no mistake
TAKE_NO_FILE = {"demo", "prove", "example-cell", "fake-history", "night example"}
OF_THE_PAGE = {"serve-run", "serve-look"}  # a thread listens to the page until they end


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return one good file of each kind."""
    folder = tmp_path_factory.mktemp("good")
    cell = folder / "cell.toml"
    cell.write_text(called("example-cell").stdout)
    return {
        "CELL": cell,
        "TWIN": made.twin(folder / "twin.toml"),
        "RECORDING": made.save(folder / "run.parquet", made.Joint(), 0),
    }


@pytest.mark.parametrize("call", CALLS)
def test_a_file_of_any_kind_is_answered(
    call: str, good: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = {}
    for kind, make in {**GIVEN, "long name": None}.items():
        place = tmp_path / kind.replace(" ", "-")
        place.mkdir()
        bad = place / (LONG if make is None else BAD)
        words = [_word(word, bad, good, place) for word in call.split()]
        if make is not None:
            make(next(Path(w) for w in words if Path(w).name.startswith(BAD)))
        done = called(*words)
        code, said = done.returncode, done.stderr
        name = call.partition(" ")[0]
        allowed = {2, 3, 4, 5}
        allowed |= {DONE} if kind == "folder" and name in NOTHING_YET else set()
        if code not in allowed or not (said or done.stdout) or "Traceback" in said:
            wrong[kind] = (code, said[-300:])
    assert wrong == {}


def _word(word: str, bad: Path, good: dict[str, Path], place: Path) -> str:
    if word.startswith(BAD):
        return f"{bad}{word.removeprefix(BAD)}"
    return str(good.get(word, place / word if word in ("OUT", "LAKE") else word))


def test_every_command_that_takes_a_file_is_tried() -> None:
    tried = {call.split(" BAD")[0].split(" --")[0] for call in CALLS}
    tried = {" ".join(w for w in t.split() if not w.isupper()) for t in tried}
    there = set(_commands(typer.main.get_command(app), ""))
    assert there - TAKE_NO_FILE - OF_THE_PAGE == tried


def _commands(command: Any, name: str) -> Iterator[str]:
    for key, inner in getattr(command, "commands", {}).items():
        yield from _commands(inner, f"{name} {key}".strip())
    if not hasattr(command, "commands"):
        yield name


def test_what_nobody_foresaw_is_called_our_fault(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """So a test above that asks for another code can fail."""
    monkeypatch.setattr("agent.cli.cycle.run.run_axis", lambda *_, **__: 1 / 0)
    done = called("run", tmp_path, "--axis", "1")
    assert done.returncode == OUR_FAULT
    assert "fault of stribeck's own (ZeroDivisionError" in done.stderr
