"""What is written is what is read: values, types, order, columns that nobody knows."""

from __future__ import annotations

import datetime
import pickle
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from agent.record.reading import read
from agent.record.recording import FLOAT_COLUMNS, Metadata, Recording
from agent.record.writing import write
from tests.unit.record.samples import metadata, recording

SAMPLES = 100

NUMERIC = [
    np.float64,
    np.float32,
    np.float16,
    np.int8,
    np.int16,
    np.int32,
    np.int64,
    np.uint8,
    np.uint16,
    np.uint32,
    np.uint64,
    np.bool_,
]


def _objects(items: list[Any]) -> np.ndarray[Any, Any]:
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out


numeric_columns = st.sampled_from(NUMERIC).flatmap(lambda t: hnp.arrays(t, SAMPLES))
text_columns = st.lists(st.text(max_size=5), min_size=SAMPLES, max_size=SAMPLES).map(_objects)
gappy_columns = st.lists(st.none() | st.text(max_size=3), min_size=SAMPLES, max_size=SAMPLES).map(
    _objects
)
any_column = numeric_columns | text_columns | gappy_columns
names = st.text(min_size=1, max_size=8).filter(
    lambda name: name not in FLOAT_COLUMNS and name != "phase"
)


def same(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> bool:
    if one.dtype.kind == "f" and other.dtype.kind == "f":
        return bool(np.array_equal(one, other, equal_nan=True))
    return bool(np.array_equal(one, other))


@settings(max_examples=60, deadline=None)
@given(data=st.data(), extra=st.dictionaries(names, any_column, max_size=4))
def test_parquet_keeps_columns_types_order_and_metadata(
    data: st.DataObject, extra: dict[str, Any]
) -> None:
    known = dict(recording(SAMPLES).columns)
    torque = data.draw(hnp.arrays(np.float64, SAMPLES))
    order = data.draw(st.permutations([*known, *extra]))
    columns = {**known, "torque_nm": torque, **extra}
    before = Recording(
        {name: columns[name] for name in order}, metadata(extra={"licence": "MIT"}), "x"
    )
    with TemporaryDirectory() as folder:
        path = write(before, Path(folder) / "run.parquet")
        after = read(path)
    assert list(after.columns) == order
    assert after.metadata == before.metadata
    beyond = ~(np.abs(torque) < 1e20)  # NaN and infinite, too
    assert after.masked == int(np.count_nonzero(beyond))
    for name, values in before.columns.items():
        assert same(after[name], values), name
        if values.dtype.kind in "fiub":
            assert after[name].dtype == values.dtype


cells = st.text(alphabet=st.characters(codec="utf-8", exclude_characters="\r\0"), max_size=4)


@settings(max_examples=40, deadline=None)
@given(
    torque=hnp.arrays(np.float64, SAMPLES),
    texts=st.lists(cells, min_size=SAMPLES, max_size=SAMPLES).map(_objects),
    integers=hnp.arrays(np.int64, SAMPLES),
    flags=hnp.arrays(np.bool_, SAMPLES),
)
def test_csv_keeps_every_bit_of_a_float_and_every_letter(
    torque: np.ndarray[Any, Any],
    texts: np.ndarray[Any, Any],
    integers: np.ndarray[Any, Any],
    flags: np.ndarray[Any, Any],
) -> None:
    extra = {"a text, quoted": texts, "count": integers, "flag": flags}
    before = recording(SAMPLES, torque_nm=torque, **extra)
    with TemporaryDirectory() as folder:
        after = read(write(before, Path(folder) / "run.csv"))
    assert list(after.columns) == list(before.columns)
    assert after.metadata == before.metadata
    for name, values in before.columns.items():
        assert same(after[name], values), name


EXOTIC = {
    "stamp": pa.array(
        [datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)] * 99 + [None],
        pa.timestamp("ns", "UTC"),
    ),
    "pair": pa.array([[1.0, 2.0]] * 50 + [None] * 50, pa.list_(pa.float32())),
    "gap": pa.array([None, *range(2**62, 2**62 + 99)], pa.int64()),
    "maybe": pa.array([True, None] * 50),
    "nothing": pa.nulls(100),
    "blob": pa.array([b"\x00"] * 100),
}


def test_types_that_numpy_does_not_have_pass_through(tmp_path: Path) -> None:
    table = pa.table({**_needed(), **EXOTIC}).replace_schema_metadata(
        {"stribeck": metadata().dumps()}
    )
    pq.write_table(table, tmp_path / "a.parquet")
    write(read(tmp_path / "a.parquet"), tmp_path / "b.parquet")
    assert pq.read_table(tmp_path / "b.parquet").equals(table)


def test_contract_columns_become_float64_and_plain_text_where_nothing_is_lost(
    tmp_path: Path,
) -> None:
    labels = pa.array(["ramp", None] * 50).dictionary_encode()
    table = pa.table(
        {
            "time_s": pa.array(range(100), pa.int32()),
            "torque_nm": pa.array([None, *([1.5] * 99)], pa.float32()),
            "velocity_rad_s": pa.array([2**53] * 100, pa.int64()),
            "position_arm_rad": pa.nulls(100),
            "phase": labels,
            "site": pa.array(["a"] * 100, pa.large_string()),
            "steps": pa.array([None, *range(99)], pa.int64()),
        }
    ).replace_schema_metadata({"stribeck": metadata().dumps()})
    pq.write_table(table, tmp_path / "a.parquet")
    found = read(tmp_path / "a.parquet")
    for name in ("time_s", "torque_nm", "velocity_rad_s", "position_arm_rad"):
        assert found[name].dtype == np.float64, name
    assert found["velocity_rad_s"][0] == 2.0**53
    assert np.isnan(found["position_arm_rad"]).all()
    assert found.masked == 1
    assert found["phase"].dtype.kind == "U"
    assert found["phase"][:2].tolist() == ["ramp", ""]
    assert found["site"].tolist() == ["a"] * 100
    assert np.isnan(found["steps"][0])
    assert found["steps"][99] == 98.0


def test_csv_keeps_gaps_apart_from_empty_text(tmp_path: Path) -> None:
    remarks = _objects(["", None, "null"] + ["ok"] * 97)
    found = read(write(recording(100, remark=remarks), tmp_path / "run.csv"))
    assert found["remark"].tolist() == remarks.tolist()


def test_a_recording_is_frozen_and_consistent() -> None:
    made = recording(150, torque_nm=np.array([np.nan, np.inf, *([0.1] * 148)]))
    assert (len(made), made.masked, made.gear_ratio, made.axis) == (150, 2, 224.0, 1)
    assert made.samples_lost == 0
    assert not made.valid[:2].any()
    assert "phase" in made
    with pytest.raises(ValueError, match="read-only"):
        made["torque_nm"][0] = 0.0
    with pytest.raises(ValueError, match="one length"):
        made.with_columns({"short": np.zeros(3)})
    with pytest.raises(ValueError, match="one length"):
        Recording({"time_s": np.zeros((3, 3))}, metadata())
    assert list(made.select(["torque_nm", "time_s"]).columns) == ["torque_nm", "time_s"]
    copy = pickle.loads(pickle.dumps(made))
    assert same(copy["torque_nm"], made["torque_nm"])


def test_the_callers_array_stays_writable() -> None:
    own = np.zeros(150)
    recording(150, torque_nm=own)
    own[0] = 1.0


def test_mixed_objects_are_refused_when_written(tmp_path: Path) -> None:
    mixed = _objects(["a", 1] + [None] * 98)
    with pytest.raises(ValueError, match="of one kind"):
        write(recording(100, odd=mixed), tmp_path / "run.parquet")
    assert list(tmp_path.iterdir()) == []


def test_what_csv_cannot_hold_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    lists = _objects([[1.0]] * 100)
    with pytest.raises(ValueError, match="CSV"):
        write(recording(100, odd=lists), tmp_path / "run.csv")
    assert list(tmp_path.iterdir()) == []


def _needed() -> dict[str, Any]:
    made = recording(100)
    return {name: made[name] for name in ("time_s", "torque_nm", "velocity_rad_s")}


def test_unknown_metadata_survives_every_format(tmp_path: Path) -> None:
    before = recording().with_metadata(metadata(extra={"source": "github:a/b", "n": [1, {"k": 0}]}))
    for name in ("a.parquet", "a2.csv"):
        after = read(write(before, tmp_path / name))
        assert isinstance(after.metadata, Metadata)
        assert after.metadata == before.metadata
