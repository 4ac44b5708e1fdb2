"""Written once: seals, what verify sees, and what retention may never take."""

from __future__ import annotations

import shutil
import stat
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from agent.cli.app import app
from agent.errors import InputError
from agent.record.catalogue.catalogue import Catalogue
from agent.record.reading import read
from agent.record.retention import Limits, apply_retention, over_limit, plan_retention
from agent.record.seal import SUFFIX, broken, content, seal, seal_path
from agent.record.verdict_file import read_verdict, verdict_path, write_verdict
from agent.record.verify import Recomputed, verify
from agent.record.writing import write
from tests.record.test_catalogue import made, verdict_on
from tests.unit.record.samples import metadata, recording

NOW = "2026-04-01T00:00:00.000Z"


@given(place=st.floats(0.0, 0.999999), bit=st.integers(0, 7))
@settings(max_examples=15, deadline=None)
def test_one_bit_anywhere_is_seen(place: float, bit: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        path = write(recording(), Path(name) / "run.parquet")
        seal(path)
        assert broken(path) == ""
        data = bytearray(path.read_bytes())
        data[int(place * len(data))] ^= 1 << bit
        path.chmod(0o644)
        path.write_bytes(data)
        assert "run.parquet is not what was recorded" in broken(path)
        with pytest.raises(InputError, match="is not what was recorded"):
            seal(path)


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_a_seal_is_what_sha256sum_says_and_takes_the_write_bit(tmp_path: Path, suffix: str) -> None:
    path = write(recording(), tmp_path / f"run{suffix}")
    found = seal(path)
    beside = seal_path(path)
    assert all(not p.stat().st_mode & 0o222 for p in tmp_path.iterdir())
    assert stat.S_IMODE(path.stat().st_mode) & 0o400
    subprocess.run(["sha256sum", "--strict", "-c", beside.name], cwd=tmp_path, check=True)
    said = beside.read_text()
    assert len(said.splitlines()) == (1 if suffix == ".parquet" else 2)
    assert seal(path) == found == content(path)
    assert beside.read_text() == said
    assert len(read(path)) == 200


def test_a_csv_recordings_side_file_is_part_of_it(tmp_path: Path) -> None:
    path = write(recording(), tmp_path / "run.csv")
    seal(path)
    side = path.with_suffix(".json")
    side.chmod(0o644)
    side.write_text(side.read_text().replace("224.0", "225.0"))
    assert "run.json is not what was recorded" in broken(path)


def test_verify_finds_every_kind_of_damage_and_nothing_else(tmp_path: Path) -> None:
    for day, name in enumerate(["well", "changed", "gone", "retained", "replaced"], 1):
        made(tmp_path, name, day=day)
    write(recording(), tmp_path / "unsealed.parquet")
    changed = tmp_path / "changed.parquet"
    changed.chmod(0o644)
    changed.write_bytes(changed.read_bytes()[:-1] + b"X")
    (tmp_path / "gone.parquet").unlink()
    for path in (tmp_path / "retained.parquet", tmp_path / f"retained.parquet{SUFFIX}"):
        path.unlink()
    # somebody puts another recording, with a seal of its own, in the place of one
    (tmp_path / f"replaced.parquet{SUFFIX}").unlink()
    shutil.copy(tmp_path / "well.parquet", tmp_path / "new.parquet")
    (tmp_path / "new.parquet").replace(tmp_path / "replaced.parquet")
    seal(tmp_path / "replaced.parquet")

    found = {c.path.name: c for c in verify(tmp_path)}
    wrong = {name for name, c in found.items() if not c.holds}
    assert wrong == {
        "changed.parquet",
        "changed.verdict.json",
        f"gone.parquet{SUFFIX}",
        "replaced.verdict.json",
    }
    assert [n for n, c in found.items() if not c.sealed] == ["unsealed.parquet"]
    assert "cannot be computed again" in found["retained.verdict.json"].sentence
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="holds no recording"):
        verify(tmp_path / "empty")


def test_a_verdict_is_computed_again_and_says_with_which_versions(tmp_path: Path) -> None:
    path = made(tmp_path, "run")
    old = verdict_on(path, 1, 1)
    write_verdict(path, replace(old, numbers={"coulomb_nm": 0.6}, software={"stribeck": "0.0.9"}))

    def judged(numbers: dict[str, float], state: str | None = None) -> tuple[bool, str]:
        again = Recomputed(numbers, state)
        (verdict,) = [c for c in verify(tmp_path, lambda *_: again) if "verdict" in c.path.name]
        return verdict.holds, verdict.sentence

    holds, sentence = judged({"coulomb_nm": 0.6 * (1 + 1e-9)})
    assert holds
    assert "made with stribeck 0.0.9" in sentence
    holds, sentence = judged({"coulomb_nm": 0.61})
    assert not holds
    assert "coulomb_nm 0.6 -> 0.61" in sentence
    holds, sentence = judged({"coulomb_nm": 0.6}, "H0")
    assert not holds
    assert "state NF -> H0" in sentence
    assert judged({"coulomb_nm": 0.6}, "NF")[0]
    holds, sentence = judged({})
    assert not holds
    assert "decidable -> not decidable" in sentence


@settings(max_examples=6, deadline=None)
@given(
    alarms=st.sets(st.integers(0, 7)),
    baseline=st.sets(st.integers(0, 7)),
    unjudged=st.sets(st.integers(0, 7)),
    days=st.one_of(st.none(), st.floats(0.0, 40.0)),
    share=st.one_of(st.none(), st.floats(0.0, 1.2)),
)
def test_retention_never_takes_an_alarm_a_baseline_or_what_nobody_judged(
    alarms: set[int],
    baseline: set[int],
    unjudged: set[int],
    days: float | None,
    share: float | None,
) -> None:
    with tempfile.TemporaryDirectory() as name, Catalogue(folder := Path(name)) as catalogue:
        paths = [made(folder, f"run{i}", day=1 + i, alarm=i in alarms) for i in range(8)]
        hashes = tuple(content(paths[i]).sha256 for i in baseline)
        last = read_verdict(verdict_path(paths[7]))
        write_verdict(paths[7], replace(last, baseline=hashes))
        for i in unjudged - {7}:
            verdict_path(paths[i]).unlink()
        rows = [catalogue.add(path) for path in paths]
        total = sum(row.size_bytes for row in rows)
        room = None if share is None else share * total / 1e6
        before = sorted(p.name for p in folder.iterdir())
        fates = plan_retention(catalogue, Limits(days, room), NOW)
        assert sorted(p.name for p in folder.iterdir()) == before  # a dry run
        held = {paths[i].name for i in alarms | baseline | (unjudged - {7}) | {7}}
        goes = {f.recording.path for f in fates if f.goes}
        assert not goes & held
        free = {path.name for path in paths} - held
        if room is not None:
            left = sum(f.recording.size_bytes for f in fates if not f.goes)
            assert left <= room * 1e6 or goes == free
        if days is not None and room is None:
            old = {f"run{i}.parquet" for i in range(8) if 31 - i - 2 / 24 + 0.5 / 1e9 > days}
            assert goes == free & old
        freed = apply_retention(catalogue, fates)
        assert freed == sum(f.recording.size_bytes for f in fates if f.goes)
        assert {p.name for p in folder.glob("*.parquet")} == {p.name for p in paths} - goes
        assert len(catalogue.verdicts()) == 8 - len(unjudged - {7})
        after = catalogue.recordings()
        catalogue.rebuild()
        assert catalogue.recordings() == after


def test_nothing_goes_while_a_verdict_cannot_be_read(tmp_path: Path) -> None:
    for day in (1, 2, 3):
        made(tmp_path, f"run{day}", day=day)
    assert CliRunner().invoke(app, ["catalogue", "rebuild", str(tmp_path)]).exit_code == 0
    (tmp_path / "run2.verdict.json").write_text("{")
    answer = CliRunner().invoke(
        app, ["catalogue", "retain", str(tmp_path), "--days", "0", "--apply"]
    )
    assert "Nothing is removed while files cannot be read" in str(answer.exception)
    assert len(list(tmp_path.glob("*.parquet"))) == 3


def test_a_full_folder_is_a_reason_and_an_empty_one_is_none(tmp_path: Path) -> None:
    assert over_limit(tmp_path / "none", 1.0) == ""
    made(tmp_path, "run")
    assert over_limit(tmp_path, 1000.0) == ""
    assert over_limit(tmp_path, None) == ""
    assert "its limit is 0.001 MB" in over_limit(tmp_path, 0.001)


def test_the_commands_from_a_folder_to_a_verified_catalogue(tmp_path: Path) -> None:
    for day in (1, 2, 3):
        made(tmp_path, f"run{day}", day=day, alarm=day == 1)
    run = CliRunner().invoke
    assert run(app, ["catalogue", "add", str(tmp_path)]).exit_code == 0
    listed = run(app, ["catalogue", "list", str(tmp_path)]).stdout
    assert listed.count("ALARM") == 1
    assert listed.count(" axis 1 ") == 3
    assert (
        "3 recordings, 3 estimates, 3 verdicts"
        in run(app, ["catalogue", "rebuild", str(tmp_path)]).stdout
    )
    assert "is at 0001" in run(app, ["catalogue", "upgrade", str(tmp_path)]).stdout
    dry = run(app, ["catalogue", "retain", str(tmp_path), "--days", "0"])
    assert "would go  run2.parquet" in dry.stdout
    assert "stays     run1.parquet: an alarm" in dry.stdout
    assert (tmp_path / "run2.parquet").exists()
    wet = run(app, ["catalogue", "retain", str(tmp_path), "--days", "0", "--apply"])
    assert "removed   run2.parquet" in wet.stdout
    assert not (tmp_path / "run2.parquet").exists()
    assert run(app, ["verify", str(tmp_path)]).exit_code == 0
    folder = str(tmp_path)
    robot = ["--robot", metadata().robot]
    noted = run(app, ["catalogue", "note", folder, "oil", "new oil", *robot, "--axis", "1"])
    assert "line 1" in noted.stdout
    for bad in (["alarm", "x"], ["oil", "x", "--at", "gestern"]):
        answer = run(app, ["catalogue", "note", folder, *bad, *robot])
        assert isinstance(answer.exception, InputError)
    seal_path(tmp_path / "run3.parquet").unlink()
    (tmp_path / "run3.parquet").unlink()
    assert run(app, ["verify", str(tmp_path)]).exit_code == 0  # gone with its seal: retention
    write(recording(150), tmp_path / "run3.parquet")
    assert run(app, ["verify", str(tmp_path)]).exit_code == 1  # not what the verdict stands on


@pytest.mark.parametrize(
    "words",
    [
        ["list"],
        ["list", "--json"],
        ["upgrade"],
        ["retain", "--days", "1"],
        ["retain", "--days", "0", "--apply"],
    ],
)
def test_who_reads_or_tries_makes_no_catalogue(words: list[str], tmp_path: Path) -> None:
    made(tmp_path, "run1")
    before = sorted(tmp_path.iterdir())
    elsewhere = f"sqlite:///{tmp_path / 'elsewhere.sqlite'}"
    for more, name in (([], "catalogue.sqlite"), (["--catalogue", elsewhere], "elsewhere.sqlite")):
        what, *options = words
        answer = CliRunner().invoke(app, ["catalogue", what, str(tmp_path), *options, *more])
        assert isinstance(answer.exception, InputError)
        assert f"There is no catalogue {tmp_path / name}." in str(answer.exception)
        assert answer.stdout == ""
    assert sorted(tmp_path.iterdir()) == before


def test_a_note_is_of_a_joint_that_the_folder_knows(tmp_path: Path) -> None:
    path = made(tmp_path, "run1", axis=2)
    robot, folder = metadata().robot, str(tmp_path)
    before = sorted(tmp_path.iterdir())

    def note(*joint: str) -> str:
        words = ["catalogue", "note", folder, "oil", "new oil", *joint]
        answer = CliRunner().invoke(app, words)
        assert answer.exception is None or isinstance(answer.exception, InputError)
        return answer.stdout or str(answer.exception)

    assert note("--robot", "nobody") == f"{folder}: holds no recording of nobody, only of {robot}."
    wrong_axis = f"{folder}: holds no recording of {robot} axis 1, only of axis 2."
    assert note("--robot", robot, "--axis", "1") == wrong_axis
    assert sorted(tmp_path.iterdir()) == before  # neither an event nor a catalogue
    assert "line 1" in note("--robot", robot, "--axis", "2")  # by its file alone
    assert "line 2" in note("--robot", robot)
    assert CliRunner().invoke(app, ["catalogue", "add", str(path)]).exit_code == 0
    seal_path(path).unlink()
    path.unlink()
    assert "line 3" in note("--robot", robot, "--axis", "2")  # retention leaves the verdict
    empty = tmp_path / "empty"
    empty.mkdir()
    folder = str(empty)
    expected = f"{folder}: holds no recording of {robot}, nor of any other robot."
    assert note("--robot", robot) == expected


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (["--axis", "9"], "No recording of axis 9 is in the catalogue;"),
        (["--robot", "x"], "No recording of x is in the catalogue;"),
        (["--robot", "x", "--axis", "9"], "No recording of x axis 9 is in the catalogue;"),
    ],
)
def test_a_list_says_of_which_joint_it_has_none(
    tmp_path: Path, asked: list[str], says: str
) -> None:
    """That the catalogue had none at all was said of a joint whose name was mistyped."""
    run = CliRunner().invoke
    assert run(app, ["catalogue", "add", str(made(tmp_path, "run1"))]).exit_code == 0
    answer = run(app, ["catalogue", "list", str(tmp_path), *asked])
    assert (answer.exit_code, answer.stdout) == (0, "")
    assert " ".join(answer.stderr.split()).startswith(says)
