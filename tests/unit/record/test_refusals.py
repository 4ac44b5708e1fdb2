"""Every bad file gets its one sentence: which file, which column, which row, what was expected."""

from __future__ import annotations

import datetime
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from agent.errors import InputError
from agent.record.reading import read
from agent.record.writing import write
from tests.unit.record.samples import metadata, recording

Columns = dict[str, Any]
Change = Callable[[Columns], object]


def good(samples: int = 150) -> Columns:
    return {name: pa.array(values) for name, values in recording(samples).columns.items()}


def save(folder: Path, columns: Columns, text: bytes | None = None) -> Path:
    table = pa.table(columns)
    table = table.replace_schema_metadata({"stribeck": text or metadata().dumps()})
    path = folder / "bad.parquet"
    pq.write_table(table, path)
    return path


def values_at(rows: dict[int, float]) -> pa.Array[Any]:
    """Return a time column in which some rows (counted from 1) are wrong."""
    time_s = np.arange(150) / 1000.0
    for row, value in rows.items():
        time_s[row - 1] = value
    return pa.array(time_s)


def renamed(old: str, new: str) -> Change:
    return lambda columns: columns.update({new: columns.pop(old)})


def without(*names: str) -> Change:
    return lambda columns: [columns.pop(name) for name in names]


def having(**values: Any) -> Change:
    return lambda columns: columns.update(values)


DAY = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)

COLUMNS: dict[str, tuple[Change, str]] = {
    "time stands still": (
        having(time_s=values_at({42: 0.040})),
        "column time_s must increase, but row 42 holds 0.04 after 0.04.",
    ),
    "time runs backwards": (
        having(time_s=values_at({100: 0.01})),
        "column time_s must increase, but row 100 holds 0.01 after 0.098.",
    ),
    "time runs backwards across a gap": (
        having(time_s=values_at({100: np.nan, 101: 0.01, 120: 0.0})),
        "but row 101 holds 0.01 after 0.098 (1 more such rows).",
    ),
    "time is mostly gaps": (
        having(time_s=values_at(dict.fromkeys(range(1, 60), np.nan))),
        "column time_s is a finite number in 91 of 150 rows, but at least 100 are needed.",
    ),
    "time is a date": (
        having(time_s=pa.array([DAY] * 150, pa.timestamp("us", "UTC"))),
        "column time_s must hold numbers (seconds from the recording's start), but row 1 holds",
    ),
    "time is a duration": (
        having(time_s=pa.array([datetime.timedelta(seconds=i) for i in range(150)])),
        "of type duration[us]",
    ),
    "torque is text": (
        having(torque_nm=pa.array([None, "0.5", *["1"] * 148])),
        "column torque_nm must hold numbers (motor torque in N m), but row 2 holds '0.5' of type "
        "string.",
    ),
    "torque is text in a dictionary": (
        having(torque_nm=pa.array(["a"] * 150).dictionary_encode()),
        "but row 1 holds 'a' of type string",
    ),
    "torque is yes and no": (
        having(torque_nm=pa.array([True] * 150)),
        "but row 1 holds 'True' of type bool",
    ),
    "torque is text and gaps only": (
        having(torque_nm=pa.nulls(150, pa.string())),
        "column torque_nm must hold numbers (motor torque in N m), its type is string.",
    ),
    "a temperature in kelvin": (
        having(gearbox_temperature_degc=pa.array([298.3] + [298.2] * 148 + [np.nan])),
        "column gearbox_temperature_degc is 298.2 in the median, which no joint bears as degrees "
        "Celsius; it looks like kelvin. Take 273.15 off, or leave the column out.",
    ),
    "a temperature that may be another unit or no sensor": (
        having(gearbox_temperature_degc=pa.array([327.67] * 149 + [np.nan])),
        "column gearbox_temperature_degc is 327.7 in the median, which no joint bears as degrees "
        "Celsius; it looks like kelvin, or, as it never changes, like a sensor that is not there. "
        "Take 273.15 off, or leave the column out.",
    ),
    "a temperature sensor that is not there": (
        having(gearbox_temperature_degc=pa.array([-3276.8] * 149 + [np.nan])),
        "column gearbox_temperature_degc is -3277 in the median, which no joint bears as degrees "
        "Celsius; it looks like a sensor that is not there. Leave the column out.",
    ),
    "an optional column is text": (
        having(gearbox_temperature_degc=pa.array(["cold"] * 150)),
        "column gearbox_temperature_degc must hold numbers (gearbox temperature in degrees "
        "Celsius), but row 1 holds 'cold'",
    ),
    "position is lists": (
        having(position_rad=pa.array([[1.0]] * 150)),
        "column position_rad must hold numbers (motor angle in rad), but row 1 holds '[1.0]'",
    ),
    "integers too large": (
        having(position_rad=pa.array([2**53 + 1] * 150)),
        "column position_rad holds integers beyond 2^53, which cannot be motor angle in rad",
    ),
    "phase is numbers": (
        having(phase=pa.array([1] * 150)),
        "column phase must hold text (the part of the cycle), but row 1 holds '1' of type int64.",
    ),
    "no torque": (
        without("torque_nm"),
        "needs column torque_nm (motor torque in N m); the file has time_s, position_rad,",
    ),
    "neither position nor velocity": (
        without("position_rad", "velocity_rad_s"),
        "needs column position_rad (motor angle in rad) or velocity_rad_s (motor velocity in "
        "rad/s); the file has time_s, torque_nm, phase.",
    ),
    "a command is no measurement": (
        lambda c: (c.pop("position_rad"), renamed("velocity_rad_s", "velocity_command_rpm")(c)),
        "the file has time_s, torque_nm, phase, velocity_command_rpm.",
    ),
    "no columns": (lambda c: c.clear(), "needs column time_s"),
}


@pytest.mark.parametrize("case", COLUMNS)
def test_columns_that_are_no_recording(case: str, tmp_path: Path) -> None:
    change, expected = COLUMNS[case]
    columns = good()
    change(columns)
    refuses(save(tmp_path, columns), expected)


@pytest.mark.parametrize(
    ("expected_column", "found", "unit"),
    [
        ("time_s", "time_ms", "seconds from the recording's start"),
        ("time_s", "Time", "seconds from the recording's start"),
        ("time_s", "timestamp_us", "seconds from the recording's start"),
        ("time_s", "t", "seconds from the recording's start"),
        ("torque_nm", "torque_mnm", "motor torque in N m"),
        ("torque_nm", "Torque [Nm]", "motor torque in N m"),
        ("torque_nm", "motor_current_a", "motor torque in N m"),
        ("torque_nm", "iq", "motor torque in N m"),
        ("velocity_rad_s", "velocity_rpm", "motor velocity in rad/s"),
        ("velocity_rad_s", "speed", "motor velocity in rad/s"),
        ("velocity_rad_s", "n_rpm", "motor velocity in rad/s"),
        ("position_rad", "position_deg", "motor angle in rad"),
        ("position_rad", "angle", "motor angle in rad"),
        ("position_rad", "encoder_counts", "motor angle in rad"),
    ],
)
def test_a_look_alike_in_another_unit_is_pointed_at(
    expected_column: str, found: str, unit: str, tmp_path: Path
) -> None:
    columns = good()
    if expected_column in ("velocity_rad_s", "position_rad"):
        without(*{"velocity_rad_s", "position_rad"} - {expected_column})(columns)
    renamed(expected_column, found)(columns)
    refuses(
        save(tmp_path, columns),
        f"{found} looks like {expected_column} in another unit or under another name. Convert it "
        f"to {unit} and name it {expected_column}.",
    )


@pytest.mark.parametrize(
    ("samples", "expected"),
    [(0, "holds no samples, but"), (1, "holds 1 sample, but"), (99, "holds 99 samples, but")],
)
def test_too_few_samples(samples: int, expected: str, tmp_path: Path) -> None:
    refuses(save(tmp_path, good(samples)), f"{expected} at least 100 are needed.")


def test_one_hundred_samples_are_enough(tmp_path: Path) -> None:
    assert len(read(save(tmp_path, good(100)))) == 100


def test_a_column_that_occurs_twice(tmp_path: Path) -> None:
    columns = good()
    table = pa.Table.from_arrays(
        [*columns.values(), columns["torque_nm"]], names=[*columns, "torque_nm"]
    )
    pq.write_table(table, tmp_path / "bad.parquet")
    refuses(tmp_path / "bad.parquet", "column torque_nm occurs more than once.")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"not json", "the metadata is not UTF-8 JSON"),
        (b"\xff", "the metadata is not UTF-8 JSON"),
        (b"[]", "the metadata must be a JSON object, got []."),
        (
            b"{}",
            'the metadata lacks schema, robot, axis, gear_ratio. schema is "stribeck.recording',
        ),
        (b'{"schema": "stribeck.recording/2"}', "is not one that this version reads"),
        (
            rb'{"schema": "stribeck.recording/1", "robot": "r\u001b", "axis": 1, "gear_ratio": 1}',
            "robot must be a name without control characters",
        ),
    ],
)
def test_metadata_that_cannot_be_used(text: bytes, expected: str, tmp_path: Path) -> None:
    refuses(save(tmp_path, good(), text), expected)


def test_no_metadata_at_all(tmp_path: Path) -> None:
    pq.write_table(pa.table(good()), tmp_path / "bad.parquet")
    refuses(
        tmp_path / "bad.parquet",
        "the file's key-value metadata has no key 'stribeck', so that robot, axis and gear ratio "
        "are not known.",
    )


@pytest.mark.parametrize("name", ["bad.parquet", "bad.csv", "bad.arrows", "bad.txt"])
def test_an_empty_file(name: str, tmp_path: Path) -> None:
    (tmp_path / name).touch()
    refuses(tmp_path / name, "is empty")


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("bad.parquet", b"time_s,torque_nm\n1,2\n", "is not a Parquet file (it starts with b'time"),
        ("bad.mf4", b"MDF     4.10", "is not a Parquet file (it starts with b'MDF '"),
        ("bad.parquet", b"PAR1", "cut short after 4 bytes"),
        ("bad.parquet", b"PAR1PAR1", "cut short after 8 bytes"),
        ("bad.parquet", b"PAR1\xff\xff\xff\x7fPAR1", "is a damaged Parquet file"),
        ("bad.arrows", b"PAR1", "has no readable Arrow stream header"),
        ("bad.arrows", b"\0" * 4096, "has no readable Arrow stream header"),
    ],
)
def test_a_file_of_another_kind(name: str, content: bytes, expected: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    refuses(tmp_path / name, expected)


def test_parquet_cut_short_anywhere(tmp_path: Path) -> None:
    whole = save(tmp_path, good()).read_bytes()
    for length in range(1, len(whole), 97):
        (tmp_path / "bad.parquet").write_bytes(whole[:length])
        refuses(tmp_path / "bad.parquet", "Parquet file")


def test_a_flipped_bit_in_our_own_files_is_seen(tmp_path: Path) -> None:
    path = write(recording(5000), tmp_path / "bad.parquet")
    whole = bytearray(path.read_bytes())
    column = pq.read_metadata(path).row_group(0).column(3)  # torque: high entropy, large page
    whole[column.data_page_offset + column.total_compressed_size // 2] ^= 0x10
    path.write_bytes(whole)
    refuses(path, "is a damaged Parquet file")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (",", ";", "the columns are separated by semicolons; expected commas, and points"),
        (",", "\t", "the columns are separated by tabs"),
        ("0.007,", '"0,007",', "row 8 holds '0,007' (the decimal mark must be a point)"),
        (
            "0.007,",
            "0.007s,",
            "column time_s must hold numbers (seconds from the recording's start",
        ),
        ("0.007,", "0.007,7,", "line 9 has 6 cells, but the header names 5 columns."),
        ("0.007,", "0.005,", "column time_s must increase, but row 8 holds 0.005 after 0.006."),
        ("time_s", "time_ms", "time_ms looks like time_s in another unit"),
        ("position_rad", "time_s", "column time_s occurs more than once."),
        ("ramp", "\x00\xffr", "line 2 is not text in UTF-8."),
    ],
)
def test_a_csv_file_that_cannot_be_used(old: str, new: str, expected: str, tmp_path: Path) -> None:
    path = write(recording(150), tmp_path / "bad.csv")
    count = 1 if old.startswith("0.007") else -1
    text = path.read_bytes().replace(b'"', b"").decode()
    path.write_bytes(text.replace(old, new, count).encode("latin-1"))
    refuses(path, expected)


def test_column_names_that_are_no_text(tmp_path: Path) -> None:
    path = save(tmp_path, good())
    path.write_bytes(path.read_bytes().replace(b"velocity_rad_s", b"velocity_rad_\xff"))
    refuses(path, "is a damaged Parquet file")
    batch = pa.record_batch({"velocity": [1.0]})
    content = batch.schema.serialize().to_pybytes() + batch.serialize().to_pybytes()
    (tmp_path / "bad.arrows").write_bytes(content.replace(b"velocity", b"\xffelocity"))
    refuses(tmp_path / "bad.arrows", "has no readable Arrow stream header")


def test_a_csv_file_without_header(tmp_path: Path) -> None:
    path = write(recording(150), tmp_path / "bad.csv")
    path.write_text("\n".join("0.1,2.0,3.0" for _ in range(150)))
    refuses(path, "the first line must name the columns, but it holds numbers.")


def test_a_csv_file_with_a_header_only(tmp_path: Path) -> None:
    path = write(recording(150), tmp_path / "bad.csv")
    path.write_text("time_s,torque_nm,velocity_rad_s\n")
    refuses(path, "holds no samples")


def test_a_csv_file_without_its_side_file(tmp_path: Path) -> None:
    path = write(recording(150), tmp_path / "bad.csv")
    (tmp_path / "bad.json").unlink()
    refuses(path, "needs its side file bad.json with the metadata")


def test_a_side_file_that_is_no_json_is_named_itself(tmp_path: Path) -> None:
    path = write(recording(150), tmp_path / "bad.csv")
    (tmp_path / "bad.json").write_text(json.dumps({"schema": "x"})[:-1])
    with pytest.raises(InputError, match=r"bad\.json: the metadata is not UTF-8 JSON"):
        read(path)


def test_no_file_and_a_folder(tmp_path: Path) -> None:
    refuses(tmp_path / "none.parquet", "does not exist.")
    refuses(tmp_path, "is a folder, not a recording.")


def test_a_path_that_the_system_does_not_take(tmp_path: Path) -> None:
    refuses(tmp_path / ("x" * 300 + ".parquet"), "cannot be read (File name too long).")


def refuses(path: Path, expected: str) -> None:
    """Assert that reading gives exactly one clear refusal that names the file."""
    with pytest.raises(InputError) as refused:
        read(path)
    message = str(refused.value)
    assert message.startswith(f"{path}: "), message
    assert expected in message
    assert "\n" not in message
    assert message.endswith(".")
    assert not re.search(r"Traceback|<[a-z_.]+ object", message)
