"""Finding recordings by file, folder and glob, and the ways in which honest files differ."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from agent.errors import InputError
from agent.record.reading import find, natural_key, read, read_all
from agent.record.streams.stream import StreamWriter
from agent.record.writing import write
from tests.unit.record.samples import STREAM_COLUMNS, metadata, recording, row


def names(paths: tuple[Path, ...]) -> list[str]:
    return [path.name for path in paths]


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Return a folder with recordings of every kind among other files."""
    for name in ("run10.parquet", "run2.parquet", "Run1.csv"):
        write(recording(), tmp_path / name)
    write(recording(), tmp_path / "run2.csv")  # an export of run2.parquet, not another run
    (tmp_path / "table.csv").write_text("a,b\n1,2\n")  # no side file: not a recording
    (tmp_path / "report.html").write_text("<html>")
    (tmp_path / ".run3.parquet.12ab.tmp").write_bytes(b"")
    (tmp_path / ".hidden.parquet").write_bytes(b"")
    (tmp_path / "deep").mkdir()
    write(recording(), tmp_path / "deep" / "run4.parquet")
    return tmp_path


def test_a_folder_is_read_as_people_count(runs: Path) -> None:
    assert names(find([runs])) == ["Run1.csv", "run2.parquet", "run10.parquet"]
    assert [len(found) for found in read_all([str(runs)])] == [200, 200, 200]


def test_a_glob_may_name_files_folders_and_depths(runs: Path) -> None:
    assert names(find([f"{runs}/run*"])) == ["run2.parquet", "run10.parquet"]
    assert names(find([f"{runs}/d*"])) == ["run4.parquet"]
    assert names(find([f"{runs}/**"])) == [
        "run4.parquet",
        "Run1.csv",
        "run2.parquet",
        "run10.parquet",
    ]


def test_arguments_keep_their_order_and_nothing_is_read_twice(
    runs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(runs)
    (runs / "link.parquet").symlink_to(runs / "run2.parquet")
    found = find(["run10.parquet", "run2.parquet", "./deep/../run10.parquet", "link.parquet", "."])
    assert names(found) == ["run10.parquet", "run2.parquet", "Run1.csv"]


def test_a_name_with_brackets_is_a_name_first(tmp_path: Path) -> None:
    write(recording(), tmp_path / "run[1].parquet")
    assert names(find([tmp_path / "run[1].parquet"])) == ["run[1].parquet"]


def test_nothing_found_says_what_was_looked_for(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the folder holds no recording"):
        find([tmp_path])
    with pytest.raises(InputError, match=r"x\*: matches no recording \(looked for \*\.parquet"):
        find([f"{tmp_path}/x*"])
    with pytest.raises(InputError, match=r"none\.parquet: does not exist"):
        find([tmp_path / "none.parquet"])
    with pytest.raises(InputError, match="No recording was named"):
        find([])


def test_natural_order_of_awkward_names() -> None:
    ordered = ["1", "2", "10", "a", "a1b2", "a1b10", "a2", "a²", "b"]
    assert sorted(map(Path, reversed(ordered)), key=natural_key) == [Path(n) for n in ordered]


def test_a_stream_is_read_while_it_is_written_and_after(tmp_path: Path) -> None:
    writer = StreamWriter(tmp_path, "run", metadata(), STREAM_COLUMNS)
    for i in range(1200):
        writer.append(row(i))
    found = read(writer.path)
    assert len(found) == 1001  # the first row, and two half seconds
    assert found.metadata == metadata()
    assert found["phase"].tolist()[:3] == ["steady", "ramp", "steady"]
    writer.abandon()
    assert len(read(writer.path)) == 1200
    assert names(find([tmp_path])) == ["run.arrows"]


def test_of_a_stream_and_its_recording_only_the_recording_counts(tmp_path: Path) -> None:
    write(recording(), tmp_path / "run.parquet")
    (tmp_path / "run.arrows").write_bytes(b"left by a crash between rename and removal")
    assert names(find([tmp_path])) == ["run.parquet"]


def test_csv_as_others_write_it(tmp_path: Path) -> None:
    lines = ["\ufefftime_s, torque_nm ,velocity_rad_s,tool,note"]
    lines += [f'{i / 100}, {i}e-1 ,"{-i}",{i % 2},"{i}"' for i in range(150)]
    lines[5] = "0.04,NaN,inf,0,"
    lines[6] = "0.05,,-Infinity,1,N/A"
    path = tmp_path / "others.csv"
    path.write_bytes("\r\n".join(lines).encode())
    (tmp_path / "others.json").write_bytes(b"\xef\xbb\xbf" + metadata().dumps())
    found = read(path)
    assert list(found.columns) == ["time_s", "torque_nm", "velocity_rad_s", "tool", "note"]
    assert found["torque_nm"][10] == 1.0
    assert found["velocity_rad_s"][10] == -10.0
    assert np.isnan(found["torque_nm"][4:6]).all()
    assert found["velocity_rad_s"][4:6].tolist() == [np.inf, -np.inf]
    assert found["tool"].dtype == np.int64
    assert found["note"].tolist()[:2] == ["0", "1"]  # quoted: text, even if it looks like numbers
    assert found.masked == 2


def test_a_sample_without_a_time_is_kept_and_masked(tmp_path: Path) -> None:
    made = recording()
    time_s = made["time_s"].copy()
    time_s[20] = np.nan
    found = read(write(made.with_columns({"time_s": time_s}), tmp_path / "a.parquet"))
    assert (len(found), found.masked) == (200, 1)
    assert not found.valid[20]


def test_partition_like_folders_add_no_column(tmp_path: Path) -> None:
    (tmp_path / "axis=3").mkdir()
    found = read(write(recording(), tmp_path / "axis=3" / "a.parquet"))
    assert list(found.columns) == list(recording().columns)


def test_importing_the_reader_does_not_load_the_file_library() -> None:
    program = (
        "import sys, agent.record.reading, agent.record.writing, agent.record.recording;"
        "sys.exit(any(m.split('.')[0] == 'pyarrow' for m in sys.modules))"
    )
    repository = Path(__file__).resolve().parents[3]
    result = subprocess.run([sys.executable, "-c", program], cwd=repository, check=False)
    assert result.returncode == 0
