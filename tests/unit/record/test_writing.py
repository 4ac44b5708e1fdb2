"""A file is there whole or not at all, and what was there before stays."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from agent.errors import InputError, StorageError
from agent.record import atomic
from agent.record.atomic import make_folder, publish, storage_error
from agent.record.reading import read
from agent.record.streams.recover import recover
from agent.record.streams.stream import StreamWriter
from agent.record.streams.stream_file import read_stream
from agent.record.writing import write
from tests.unit.record.samples import STREAM_COLUMNS, metadata, recording, row

REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("suffix", ["parquet", "csv"])
def test_nothing_is_overwritten_unless_asked(tmp_path: Path, suffix: str) -> None:
    path = write(recording(150), tmp_path / f"run.{suffix}")
    before = path.read_bytes()
    with pytest.raises(StorageError, match="exists already and is not overwritten"):
        write(recording(300), path)
    assert path.read_bytes() == before
    assert len(read(write(recording(300), path, overwrite=True))) == 300
    assert not list(tmp_path.glob(".*"))


def test_a_side_file_in_the_way_is_not_overwritten_either(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text("mine")
    with pytest.raises(StorageError, match=r"run\.json exists already"):
        write(recording(), tmp_path / "run.csv")
    assert [p.name for p in tmp_path.iterdir()] == ["run.json"]
    assert (tmp_path / "run.json").read_text() == "mine"


def test_a_name_taken_in_the_last_moment_is_not_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.csv"
    write_new = atomic._write_new

    def somebody_is_faster(beside: Path, content: Any) -> None:
        write_new(beside, content)
        path.write_text("theirs")

    monkeypatch.setattr(atomic, "_write_new", somebody_is_faster)
    with pytest.raises(StorageError, match=r"run\.csv exists already"):
        write(recording(), path)
    assert path.read_text() == "theirs"
    assert [p.name for p in tmp_path.iterdir()] == ["run.csv"]  # the side file went back, too


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("name", ["run.parquet", "run.csv"])
def test_a_rename_that_fails_leaves_the_old_file_and_no_temporary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, overwrite: bool
) -> None:
    path = tmp_path / name
    if overwrite:
        write(recording(150), path)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def fails(*_: object, **__: object) -> None:
        raise OSError(errno.EIO, "Input/output error")

    for module_name in ("link", "rename", "replace"):
        monkeypatch.setattr(os, module_name, fails)
    with pytest.raises(StorageError, match="input/output error"):
        write(recording(300), path, overwrite=overwrite)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_a_file_system_without_hard_links_is_served_by_a_rename(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_links(*_: object, **__: object) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_links)
    path = write(recording(), tmp_path / "run.parquet")
    assert [p.name for p in tmp_path.iterdir()] == ["run.parquet"]
    assert len(read(path)) == 200
    with pytest.raises(StorageError, match="exists already"):
        publish({path: b""})


def test_a_kill_before_the_rename_leaves_no_file_of_that_name(tmp_path: Path) -> None:
    program = f"""
import os
import re
from pathlib import Path
from agent.record.writing import write
from tests.unit.record.samples import recording
os.link = os.replace = os.rename = lambda *a, **k: os._exit(9)
write(recording(), Path({str(tmp_path)!r}) / "run.parquet")
"""
    assert (
        subprocess.run([sys.executable, "-c", program], cwd=REPOSITORY, check=False).returncode == 9
    )
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".run.parquet.")
    assert left.suffix == ".tmp"
    assert len(read(write(recording(), tmp_path / "run.parquet"))) == 200


@pytest.mark.parametrize("name", ["run.parquet", "run.csv"])
def test_a_full_disk_leaves_nothing(small_disk: Path, name: str) -> None:
    with pytest.raises(StorageError, match=r"cannot be written: the disk is full\. Free some"):
        write(recording(50_000), small_disk / name)
    assert list(small_disk.iterdir()) == []


def test_a_recorder_on_a_disk_that_fills_up_keeps_what_went_in(small_disk: Path) -> None:
    writer = StreamWriter(small_disk, "run", metadata(), STREAM_COLUMNS)
    with pytest.raises(StorageError, match=r"samples are saved in it: the disk is full\.") as told:
        append_until_full(writer)
    saved = read_stream(writer.path).table.num_rows
    assert f"{saved} samples are saved" in str(told.value)
    assert saved > 1000
    filler = small_disk / "filler"
    # until the disk is full
    with contextlib.suppress(OSError), filler.open("wb", buffering=0) as file:
        while file.write(bytes(512)):
            pass
    with pytest.raises(StorageError, match=f"The {saved} samples are kept in"):
        writer.finish()
    filler.unlink()
    subprocess.run(["mount", "-o", "remount,size=4m", str(small_disk)], check=True)
    (result,) = recover(small_disk)
    assert (result.outcome, result.samples) == ("recovered", saved)
    assert [p.name for p in small_disk.iterdir()] == ["run.parquet"]


def append_until_full(writer: StreamWriter) -> None:
    for i in range(100_000):
        writer.append(row(i))


def test_a_folder_that_is_missing_or_a_file(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="the folder does not exist"):
        write(recording(), tmp_path / "none" / "run.parquet")
    (tmp_path / "file").touch()
    with pytest.raises(StorageError, match="the folder is a file"):
        write(recording(), tmp_path / "file" / "run.parquet")


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_folder_is_no_file_to_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, overwrite: bool
) -> None:
    """`stribeck estimate run.parquet --report .` had been a fault of the program's own."""
    (tmp_path / "folder").mkdir()
    monkeypatch.chdir(tmp_path)
    for path in (Path(), Path(".."), Path("folder"), tmp_path):
        with pytest.raises(StorageError, match=r"is a folder, and no file\. Name a file in it\."):
            publish({path: b"report"}, overwrite=overwrite)
    assert list(tmp_path.rglob("*")) == [tmp_path / "folder"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name")
def test_a_pipe_or_a_device_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    """As root, a report to /dev/null had replaced the device of the whole machine by a file."""
    pipe, out = tmp_path / "pipe", tmp_path / "stdout"
    os.mkfifo(pipe)
    out.symlink_to("/proc/self/fd/1")
    for path in (pipe, out):
        with pytest.raises(StorageError, match="is a device or a pipe"):
            publish({path: b"report"}, overwrite=True)
    assert pipe.is_fifo()
    assert out.is_symlink()
    assert len(list(tmp_path.iterdir())) == 2


def test_a_recording_is_replaced_by_nothing_but_a_recording(tmp_path: Path) -> None:
    """`stribeck twin run.parquet --out run.parquet` had left a twin and no recording."""
    for name in ("run.parquet", "run.csv"):
        path = write(recording(), tmp_path / name)
        before = path.read_bytes()
        with pytest.raises(StorageError, match="may be a recording and is not overwritten"):
            publish({path: b"schema"}, overwrite=True)
        assert path.read_bytes() == before
        write(recording(), path, overwrite=True)


def test_a_suffix_that_is_no_format(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"ends in \.parquet or \.csv"):
        write(recording(), tmp_path / "run.xlsx")


def test_the_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "any").touch()
    path = write(recording(), tmp_path / "run.parquet")
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE((tmp_path / "any").stat().st_mode)


def test_a_short_recording_is_written_though_not_read(tmp_path: Path) -> None:
    path = write(recording(3).with_metadata(metadata(notes="stopped")), tmp_path / "a.parquet")
    assert pq.read_metadata(path).num_rows == 3
    with pytest.raises(InputError, match="holds 3 samples"):
        read(path)


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (errno.ENOSPC, "x: the disk is full. Free some space"),
        (errno.EDQUOT, "x: the disk quota is used up."),
        (errno.EIO, "x: the disk reports an input/output error."),
        (errno.EROFS, "x: the file system is read-only."),
        (errno.EACCES, "x: permission is denied."),
        (errno.EMFILE, "x: Too many open files."),
    ],
)
def test_what_the_system_says_becomes_a_sentence(number: int, expected: str) -> None:
    assert str(storage_error(OSError(number, os.strerror(number)), "x")).startswith(expected)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Return a folder on a disk of 256 KiB, or a skip that says why there is none."""
    folder = tmp_path / "small"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        mounted = False
    if not mounted:
        pytest.skip("a tmpfs of 256 KiB cannot be mounted here (needs root)")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_a_folder_that_takes_nothing_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As /proc for root: it is there, and no folder is missing that could be made first."""

    def nowhere(path: object, *_: object, **__: object) -> None:
        raise FileNotFoundError(errno.ENOENT, "No such file or directory", str(path))

    monkeypatch.setattr(Path, "mkdir", nowhere)
    monkeypatch.setattr(os, "open", nowhere)
    said = re.escape(f": {tmp_path} takes no files. Choose another folder.")
    with pytest.raises(StorageError, match=f"x cannot be made{said}"):
        make_folder(tmp_path / "x")
    with pytest.raises(StorageError, match=f"x cannot be written{said}"):
        publish({tmp_path / "x": b""})
    with pytest.raises(StorageError, match="Make the folder first"):
        publish({tmp_path / "missing" / "x": b""})
