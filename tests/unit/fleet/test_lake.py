"""A lake takes each recording once and whole, and knows one that is not what was pushed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.errors import InputError, StorageError
from agent.fleet.entry import Entry, entry_of
from agent.fleet.lake import Lake
from agent.fleet.listing import listed
from agent.fleet.packs import pack_all
from agent.fleet.results import Results
from agent.fleet.store import Store
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from tests.benchmarks.fleet import cycles


def written(folder: Path, count: int = 2) -> list[Path]:
    """Write small cycles of one joint each."""
    folder.mkdir(exist_ok=True)
    return [
        write(recording, folder / f"cycle-{i}.parquet") for i, recording in enumerate(cycles(count))
    ]


def entries_of(lake: Lake) -> list[Entry]:
    """Return what lies in a lake, month by month."""
    there = listed(lake)
    return [entry for month in there.months for entry in there.entries(month)]


@pytest.fixture(scope="module")
def store() -> Iterator[str]:
    """Yield the address of an S3-compatible server on this machine, with one bucket."""
    import boto3
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    try:
        host, port = server.get_host_and_port()
        address = f"http://{host}:{port}"
        client = boto3.client(
            "s3",
            endpoint_url=address,
            aws_access_key_id="test",
            aws_secret_access_key="test",
            region_name="eu-central-1",
        )
        where = {"LocationConstraint": "eu-central-1"}
        client.create_bucket(Bucket="plant", CreateBucketConfiguration=where)
        client.close()
        yield address
    finally:
        server.stop()


@pytest.fixture(params=["folder", "s3"])
def lake(request: pytest.FixtureRequest, tmp_path: Path, store: str) -> Lake:
    """Return an empty lake, on the disk and in an object store."""
    if request.param == "folder":
        return Lake(str(tmp_path / "lake"))
    options = {
        "key": "test",
        "secret": "test",
        "endpoint_url": store,
        "client_kwargs": {"region_name": "eu-central-1"},
    }
    return Lake(f"s3://plant/{tmp_path.name}", options)


def test_what_is_pushed_twice_is_there_once_and_comes_back_whole_packed_or_not(
    lake: Lake, tmp_path: Path
) -> None:
    paths = written(tmp_path / "cell")
    assert (listed(lake).months, listed(lake).others) == ((), ())
    pushed = [lake.push(p, "plant 1/b") for p in (*paths, *paths)]
    assert [new for _, new in pushed] == [True, True, False, False]
    assert listed(lake).others == ()
    entries = entries_of(lake)
    assert entries == sorted({e for e, _ in pushed})
    assert [e.joint for e in entries] == [("plant 1/b", "robot-000", n) for n in (1, 2)]
    for entry, path in zip(entries, paths, strict=True):
        assert lake.get(entry.path) == path.read_bytes()
        assert lake.recording(entry).metadata.axis == entry.axis

    assert pack_all(lake, "2099-01").recordings == 2
    assert list(lake.walk("recordings", depth=2)) == []
    assert entries_of(lake) == entries
    for entry, path in zip(entries_of(lake), paths, strict=True):
        assert entry.pack
        assert lake.content(entry) == path.read_bytes()
        assert lake.recording(entry).metadata.axis == entry.axis
        assert lake.push(path, "plant 1/b") == (entry, False)


def test_what_is_not_what_was_pushed_is_refused_and_what_is_no_recording_is_listed(
    lake: Lake, tmp_path: Path
) -> None:
    first, second = written(tmp_path / "cell")
    entry, _ = lake.push(first, "plant")
    lake.put(entry.path, second.read_bytes())
    with pytest.raises(InputError, match="not what was pushed"):
        lake.recording(entry)
    stray = entry.path.rpartition("/")[0] + "/notes.txt"
    lake.put(stray, b"half of a fi")
    assert listed(lake).others == (stray,)
    broken = tmp_path / "broken.parquet"
    broken.write_bytes(first.read_bytes()[:1000])
    with pytest.raises(InputError, match="cut short"):
        lake.push(broken, "plant")


def test_a_push_that_fails_leaves_nothing_that_looks_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path,) = written(tmp_path / "cell", 1)
    lake = Lake(str(tmp_path / "lake"))

    def cut(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", cut)
    with pytest.raises(StorageError, match="No space left"):
        lake.push(path, "plant")
    monkeypatch.undo()
    assert (listed(lake).months, listed(lake).others) == ((), ())
    assert [p for p in (tmp_path / "lake").rglob("*") if p.is_file()] == []
    assert lake.push(path, "plant")[1]


names = st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1, max_size=30)


@settings(max_examples=30, deadline=None)  # files, on a machine that others use
@given(site=names, robot=names)
def test_every_name_is_one_element_of_the_path_and_comes_back(
    tmp_path_factory: pytest.TempPathFactory, site: str, robot: str
) -> None:
    folder = tmp_path_factory.mktemp("names")
    recording = next(cycles(1))
    own = Recording(recording.columns, Metadata(robot=robot, axis=3, gear_ratio=10.0))
    lake = Lake(str(folder / "lake"))
    entry, _ = lake.push(write(own, folder / "cycle.parquet"), site)
    assert entry.joint == (site, robot, 3)
    assert entry_of(entry.path, entry.size_bytes) == entry
    assert entry.path.count("/") == 5
    assert entries_of(lake) == [entry]
    shutil.rmtree(folder)


def test_results_are_there_once_and_by_version(lake: Lake) -> None:
    columns = {"value": "double"}
    results = Results(lake, "estimate", "1", columns, part_rows=2)
    assert list(results.rows()) == []
    for key, value in (("b", 2.0), ("a", None), ("b", 2.0), ("c", 4.0), ("d", 5.0)):
        results.add("2026-11", {"key": key, "value": value})
    results.add("2026-10", {"key": "z", "value": 1.0})
    assert results.keys("2026-11").to_pylist() == ["a", "b", "c"]  # what waits is not there yet
    results.flush()
    rows = [("z", 1.0), ("a", None), ("b", 2.0), ("c", 4.0), ("d", 5.0)]
    assert [(r["key"], r["value"]) for r in results.rows()] == rows
    assert list(Results(lake, "estimate", "2", columns).rows()) == []

    assert results.tidy("2026-11", most_parts=0)
    assert [len(files) for files in results.months().values()] == [1, 1]
    assert not results.tidy("2026-11", most_parts=0)  # it is one file already
    assert [(r["key"], r["value"]) for r in results.rows()] == rows
    middle = results.table("2026-11", ("value",), low="b", high="c")
    assert middle.to_pydict() == {"key": ["b", "c"], "value": [2.0, 4.0]}

    for month in range(1, 10):  # a row in each of many months: so much and no more may be lost
        results.add(f"2030-0{month}", {"key": f"{month}", "value": 1.0})
    assert sum(month.startswith("2030") for month in results.months()) >= 9 - 2 * 2


def test_an_address_of_no_store_is_one_sentence() -> None:
    with pytest.raises(InputError, match="cannot be used as a lake"):
        Lake("nowhere://bucket")


def test_credentials_that_are_not_there_are_no_fault_of_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """S3's own library says that in a class of its own, which is no error of the system."""
    from botocore.exceptions import NoCredentialsError

    store = Store(str(tmp_path))

    def nobody(*_: object, **__: object) -> bytes:
        raise NoCredentialsError

    monkeypatch.setattr(store._store, "cat_file", nobody)
    with pytest.raises(StorageError, match="Unable to locate credentials"):
        store.get("x")
