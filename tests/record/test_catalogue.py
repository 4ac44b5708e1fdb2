"""The catalogue on both databases: files are the truth, and a rebuild makes the same again."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
import sqlalchemy as sa
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.cli.record.keep import keep
from agent.conclude.outcome import conclude
from agent.errors import InputError, StorageError
from agent.record.catalogue.catalogue import Catalogue
from agent.record.catalogue.schema import open_engine, upgrade
from agent.record.catalogue.tables import HEAD, METADATA, RECORDINGS
from agent.record.events_file import Event, append_event
from agent.record.reading import read
from agent.record.seal import seal
from agent.record.verdict_file import Verdict, write_verdict
from agent.record.writing import write
from tests.servers import postgresql
from tests.unit.record.samples import metadata, recording


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with postgresql() as url:
        yield url


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest) -> str | None:
    """No URL, which is SQLite in the folder; or a server's."""
    if request.param == "sqlite":
        return None
    return str(request.getfixturevalue("server"))


def made(folder: Path, name: str, axis: int = 1, day: int = 1, *, alarm: bool = False) -> Path:
    """Write a recording that is different from its neighbours, its estimate and its verdict."""
    path = folder / f"{name}.parquet"
    about = metadata(axis=axis, started_at=f"2026-03-{day:02}T03:00:00+01:00")
    sample = recording(120 + day).with_metadata(about)
    write(sample, path)
    path.with_suffix(".estimate.json").write_text(
        '{"decidable": true, "sentence": "well", "friction_models": [{"model": "coulomb-viscous",'
        '"rmse_nm": 0.01, "parameters": {"coulomb_nm": {"value": 0.6, "ci95": [0.5, 0.7],'
        '"identified": true}, "viscous_nm_s_per_rad": {"value": 0.0, "identified": false}}}]}'
    )
    write_verdict(path, verdict_on(path, axis, day, alarm=alarm))
    return path


def verdict_on(path: Path, axis: int, day: int, *, alarm: bool = False) -> Verdict:
    return Verdict(
        path.name,
        seal(path).sha256,
        "cell7-irb6650",
        axis,
        f"2026-03-{day:02}T02:00:00.000Z",
        "2026-03-30T00:00:00.000Z",
        decidable=True,
        alarm=alarm,
        state="NF",
        sentence="as before",
    )


def contents(catalogue: Catalogue) -> list[object]:
    return [
        catalogue.recordings(),
        catalogue.estimates(),
        catalogue.verdicts(),
        catalogue.events(),
    ]


def test_what_was_taken_one_by_one_is_what_a_rebuild_finds(tmp_path: Path, url: str | None) -> None:
    with Catalogue(tmp_path, url) as catalogue:
        for day in (3, 1, 2):
            catalogue.add(made(tmp_path, f"run{day}", axis=1 + day % 2, day=day, alarm=day == 2))
        catalogue.record_event(Event("2026-03-02T01:00:00.000Z", "skip", "über Nacht", "r", 1))
        catalogue.record_event(Event("2026-03-01T01:00:00.000Z", "oil", "new oil", "r"))
        one_by_one = contents(catalogue)
        built = catalogue.rebuild()
        assert contents(catalogue) == one_by_one
        assert (built.recordings, built.estimates, built.verdicts, built.events) == (3, 3, 3, 2)
        assert not built.problems

        assert [r.started_at[:10] for r in catalogue.recordings()] == [
            "2026-03-01",
            "2026-03-02",
            "2026-03-03",
        ]
        assert [r.path for r in catalogue.recordings(axis=2, newest=1)] == ["run3.parquet"]
        (estimate,) = catalogue.estimates(axis=1)
        assert (estimate.coulomb_nm, estimate.coulomb_high_nm) == (0.6, 0.7)
        assert estimate.viscous_nm_s_per_rad is None  # not identified is no number
        assert [v.alarm for v in catalogue.verdicts()] == [False, True, False]
        assert [e.event.kind for e in catalogue.events(robot="r", axis=1)] == ["oil", "skip"]
        assert catalogue.recording(estimate.recording_sha256) is not None


_STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("add"), st.integers(1, 4), st.booleans()),
        st.tuples(st.just("event"), st.integers(1, 9), st.booleans()),
        st.tuples(st.just("remove"), st.integers(1, 4), st.booleans()),
    ),
    max_size=8,
)


@settings(max_examples=12, deadline=None)
@given(steps=_STEPS)
def test_any_order_of_taking_and_removing_is_rebuilt_the_same(
    steps: list[tuple[str, int, bool]],
) -> None:
    with tempfile.TemporaryDirectory() as name, Catalogue(Path(name)) as catalogue:
        folder = Path(name)
        for what, number, flag in steps:
            path = folder / f"run{number}.parquet"
            if what == "event":
                axis = number if flag else None
                catalogue.record_event(Event(f"2026-01-0{number}", "note", "x", "r", axis))
            elif what == "add" and not path.exists():
                catalogue.add(made(folder, f"run{number}", axis=number, day=number, alarm=flag))
            elif what == "remove" and path.exists():  # retention: estimate and verdict stay
                path.unlink()
                path.with_name(f"{path.name}.sha256").unlink()
                catalogue.remove(path.name)
        before = contents(catalogue)
        assert not catalogue.rebuild().problems
        assert contents(catalogue) == before


def test_several_cells_share_one_server(tmp_path: Path, server: str) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    for folder, day in ((one, 1), (two, 2)):
        with Catalogue(folder, server) as catalogue:
            catalogue.add(made(folder, "run", day=day))
    with Catalogue(one, server) as catalogue:
        catalogue.rebuild()
        assert [r.started_at[:10] for r in catalogue.recordings()] == ["2026-03-01"]
    with Catalogue(two, server) as catalogue:
        assert [r.started_at[:10] for r in catalogue.recordings()] == ["2026-03-02"]


def test_migrations_make_the_very_tables_that_the_code_asks(tmp_path: Path, server: str) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    for url in (f"sqlite:///{tmp_path}/c.sqlite", server):
        with Catalogue(tmp_path / "folder", url):
            pass
        engine = open_engine(sa.make_url(url.replace("postgresql:", "postgresql+psycopg:")))
        with engine.connect() as connection:
            context = MigrationContext.configure(connection, opts={"compare_type": True})
            assert compare_metadata(context, METADATA) == []
            assert sa.inspect(connection).has_table(RECORDINGS.name)
        assert upgrade(engine) == (HEAD, HEAD)
        engine.dispose()


def test_many_may_open_a_new_catalogue_at_once(tmp_path: Path, url: str | None) -> None:
    def open_and_note(number: int) -> None:
        with Catalogue(tmp_path, url) as catalogue:
            catalogue.record_event(Event("2026-01-01", "note", str(number)))

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(open_and_note, range(12)))
    with Catalogue(tmp_path, url) as catalogue:
        rows = catalogue.events()
        assert sorted(row.line for row in rows) == list(range(1, 13))
        assert {row.event.text for row in rows} == {str(n) for n in range(12)}


WRITTEN = """
schema = "stribeck.events/1"
[[events]]
at = 2026-03-14T09:00:00+01:00
kind = "swap"
robot = "r"
axis = 2
note = "new gearbox"
[[events]]
at = 2026-03-20
kind = "oil-change"
"""


def test_events_of_people_s_own_file_are_rows_that_a_rebuild_makes_again(
    tmp_path: Path, url: str | None
) -> None:
    file = tmp_path / "events.toml"
    with Catalogue(tmp_path, url) as catalogue:
        catalogue.record_event(Event("2026-03-15T00:00:00.000Z", "run", "done", "r", 2))
        file.write_text(WRITTEN)
        swap, run, oil = (row.event for row in catalogue.events(robot="r", axis=2))
        assert swap == Event("2026-03-14T08:00:00.000Z", "swap", "new gearbox", "r", 2)
        assert (run.kind, oil.kind, oil.at) == ("run", "oil-change", "2026-03-20T00:00:00.000Z")
        assert [e.event.kind for e in catalogue.events(robot="other")] == ["oil-change"]
        kept = catalogue.events()
        built = catalogue.rebuild()
        assert (built.events, built.problems) == (3, ())
        assert catalogue.events() == kept
        file.write_text(WRITTEN.replace("new gearbox", "another one"))  # corrected by hand
        assert [e.event.text for e in catalogue.events(kinds=["swap"])] == ["another one"]
        file.write_text(WRITTEN + '[[events]]\nkind = "swap"\n')
        assert "event 3" in str(catalogue.rebuild().problems)
        file.write_text("[[ no TOML")
        assert "cannot be read" in str(catalogue.rebuild().problems)
        assert [e.event.kind for e in catalogue.events()] == ["run"]
        file.unlink()
        catalogue.record_event(Event("2026-04-01T00:00:00.000Z", "run", "again", "r", 2))
        assert len(catalogue.events()) == 2


def test_events_that_others_appended_to_the_file_are_taken_in(
    tmp_path: Path, url: str | None
) -> None:
    with Catalogue(tmp_path, url) as catalogue:
        append_event(tmp_path, Event("2026-01-02", "acknowledged", "seen", "r", 1, by="meister"))
        catalogue.record_event(Event("2026-01-03", "note", "later", "r", 1))
        append_event(tmp_path, Event("2026-01-01", "oil", "backdated", "r", 1))
        assert [row.event.text for row in catalogue.events()] == ["backdated", "seen", "later"]
        before = catalogue.events()
        catalogue.rebuild()
        assert catalogue.events() == before


def test_a_catalogue_of_a_newer_version_is_refused_and_left_alone(tmp_path: Path) -> None:
    with Catalogue(tmp_path):
        pass
    with sqlite3.connect(tmp_path / "catalogue.sqlite") as raw:
        raw.execute("UPDATE alembic_version SET version_num = '9999'")
    raw.close()
    with pytest.raises(InputError, match=r"newer version \(9999"):
        Catalogue(tmp_path)


def test_what_is_no_catalogue_is_told_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "catalogue.sqlite").write_bytes(b"no database at all" * 100)
    with pytest.raises((InputError, StorageError), match="not a database"):
        Catalogue(tmp_path)
    with pytest.raises(InputError, match="SQLite or PostgreSQL, not in mysql"):
        Catalogue(tmp_path, "mysql://here/there")
    with pytest.raises(StorageError) as error:
        Catalogue(tmp_path, "postgresql://user:geheim@/x?host=/nowhere")
    assert "geheim" not in str(error.value)


def test_a_bad_file_is_named_and_keeps_no_other_out(tmp_path: Path) -> None:
    made(tmp_path, "good")
    (tmp_path / "bad.parquet").write_bytes(b"PAR1 cut")
    (tmp_path / "lone.estimate.json").write_text('{"decidable": true}')
    (tmp_path / "odd.verdict.json").write_text('{"schema": "stribeck.verdict/1"}')
    (tmp_path / "events.jsonl").write_text('{"at": "2026", "kind": "x", "text": "y"}\n{"at": "20')
    with Catalogue(tmp_path) as catalogue:
        built = catalogue.rebuild()
        assert built.recordings == 1
        named = " ".join(built.problems)
        for what in ("bad.parquet", "lone.estimate.json", "odd.verdict.json", "line 2 is no event"):
            assert what in named
        assert len(built.problems) == 4
        # a torn line stays alone: the next event has a line of its own
        assert catalogue.record_event(Event("2027", "note", "z")).line == 3
        assert [row.event.text for row in catalogue.events()] == ["y", "z"]
        assert catalogue.rebuild().events == 2


def test_a_recording_elsewhere_is_not_taken(tmp_path: Path) -> None:
    path = made(tmp_path, "run")
    with Catalogue(tmp_path / "cell") as catalogue, pytest.raises(InputError, match="not below"):
        catalogue.add(path)


def test_the_folder_may_be_moved_with_its_catalogue(tmp_path: Path) -> None:
    here = tmp_path / "here"
    with Catalogue(here) as catalogue:
        catalogue.add(made(here, "run"))
        before = contents(catalogue)
    there = here.rename(tmp_path / "there")
    with Catalogue(there) as catalogue:
        assert contents(catalogue) == before


def test_the_same_recording_may_be_taken_twice(tmp_path: Path, url: str | None) -> None:
    path = made(tmp_path, "run")
    with Catalogue(tmp_path, url) as catalogue:
        first = catalogue.add(path)
        write_verdict(path, replace(verdict_on(path, 1, 1), sentence="anew"))
        assert catalogue.add(path) == first
        assert [v.sentence for v in catalogue.verdicts()] == ["anew"]


def test_opening_an_up_to_date_catalogue_does_not_load_alembic(tmp_path: Path) -> None:
    code = (
        "import sys, pathlib; from agent.record.catalogue.catalogue import Catalogue; "
        f"Catalogue(pathlib.Path({str(tmp_path)!r})).close(); print('alembic' in sys.modules)"
    )
    loaded = [
        subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
        for _ in range(2)
    ]
    assert [run.stdout.strip() for run in loaded] == ["True", "False"]


def test_a_catalogue_that_cannot_be_used_stops_no_cycle_and_loses_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(recording(), tmp_path / "run.parquet")
    (tmp_path / "catalogue.sqlite").write_bytes(b"no database at all" * 100)
    verdict = keep(path, conclude([read(path)]))
    assert not verdict.decidable
    assert verdict.recording_sha256 == seal(path).sha256
    assert "stribeck catalogue rebuild" in capsys.readouterr().err
    (tmp_path / "catalogue.sqlite").unlink()
    with Catalogue(tmp_path) as catalogue:
        catalogue.rebuild()
        (row,) = catalogue.verdicts()
    assert (row.state, row.recording_sha256) == ("not decidable", verdict.recording_sha256)
