"""Arrow's streams and Parquet's footers read without Arrow, held against Arrow itself."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.ipc as ipc
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.record.formats.parquet_footer import ForeignFooterError, key_values
from agent.record.formats.plain_arrow import ForeignStreamError, columns_of, next_message, rows_of

FORMS: dict[pa.DataType, st.SearchStrategy[Any]] = {
    pa.float64(): st.floats(allow_nan=False),
    pa.int64(): st.integers(-(2**63), 2**63 - 1),
    pa.bool_(): st.booleans(),
    pa.string(): st.text(max_size=5),
}


@st.composite
def batches(draw: st.DrawFn) -> list[pa.RecordBatch]:
    kinds = draw(st.lists(st.sampled_from(list(FORMS)), min_size=1, max_size=4))
    schema = pa.schema([(f"{i}-µ", kind) for i, kind in enumerate(kinds)], {"stribeck": "{}"})
    lengths = draw(st.lists(st.integers(0, 70), min_size=1, max_size=3))
    return [
        pa.RecordBatch.from_arrays(
            [pa.array(draw(st.lists(FORMS[k], min_size=n, max_size=n)), k) for k in kinds],
            schema=schema,
        )
        for n in lengths
    ]


def stream_of(parts: list[pa.RecordBatch], options: ipc.IpcWriteOptions | None = None) -> bytes:
    sink = pa.BufferOutputStream()
    with ipc.new_stream(sink, parts[0].schema, options=options) as writer:
        for part in parts:
            writer.write_batch(part)
    return sink.getvalue().to_pybytes()


def read_plainly(content: bytes) -> list[dict[str, list[Any]]]:
    view, at, columns, out = memoryview(content), 0, None, []
    while (message := next_message(view, at)) is not None:
        at = message.ended
        if columns is None:
            columns = columns_of(message)
        else:
            out.append({name: list(v) for name, v in rows_of(message, columns).items()})
    return out


@settings(max_examples=40, deadline=None)
@given(parts=batches())
def test_a_stream_is_read_as_arrow_reads_it(parts: list[pa.RecordBatch]) -> None:
    content = stream_of(parts)
    whole = [part.to_pydict() for part in parts]
    assert read_plainly(content) == whole
    torn = read_plainly(content[:-9])  # the mark of the end, and a byte of the last batch
    assert torn == whole[:-1]


@settings(max_examples=60, deadline=None)
@given(parts=batches(), data=st.data())
def test_a_damaged_stream_is_refused_or_read_and_nothing_else(
    parts: list[pa.RecordBatch], data: st.DataObject
) -> None:
    content = bytearray(stream_of(parts))
    for _ in range(3):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.integers(0, 255))
    with contextlib.suppress(ForeignStreamError):  # refused, or read: no other error
        read_plainly(bytes(content))


@pytest.mark.parametrize("form", ["nulls", "compressed", "dictionary", "nested"])
def test_another_form_than_ours_is_refused(form: str) -> None:
    values: Any = {
        "nulls": pa.array([1.0, None]),
        "compressed": pa.array([0.0] * 4000),
        "dictionary": pa.array(["a", "b"]).dictionary_encode(),
        "nested": pa.array([[1.0], [2.0]]),
    }[form]
    options = ipc.IpcWriteOptions(compression="lz4") if form == "compressed" else None
    with pytest.raises(ForeignStreamError):
        read_plainly(stream_of([pa.RecordBatch.from_arrays([values], ["x"])], options))


@settings(max_examples=60, deadline=None)
@given(
    said=st.dictionaries(st.text(min_size=1, max_size=9), st.text(max_size=300), max_size=4),
    columns=st.integers(1, 20),
    groups=st.integers(0, 3),
)
def test_a_footer_says_what_arrow_says_it_says(
    tmp_path_factory: pytest.TempPathFactory, said: dict[str, str], columns: int, groups: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "footer.parquet"
    table = pa.table({f"c{i}": [0.5 * i] * 10 * groups for i in range(columns)})
    pq.write_table(table.replace_schema_metadata(said), path, row_group_size=10)
    found = key_values(path)
    found.pop(b"ARROW:schema", None)
    assert found == {k.encode(): v.encode() for k, v in said.items()}


@settings(max_examples=80, deadline=None)  # a file each, on a disk that others use, too
@given(data=st.data())
def test_a_damaged_footer_is_refused_or_read_and_nothing_else(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.parquet"
    pq.write_table(pa.table({"a": [1.0], "b": ["x"]}).replace_schema_metadata({"k": "v"}), path)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(4, len(content) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, 4))
    path.write_bytes(bytes(content[: len(content) - cut]))
    with contextlib.suppress(ForeignFooterError):  # as above
        key_values(path)


def test_the_page_is_made_without_arrow_scipy_sqlalchemy_or_a_bus() -> None:
    """What the memory of `stribeck serve` stands on (docs/decisions/0021)."""
    heavy = {"pyarrow", "scipy", "sqlalchemy", "matplotlib", "can", "canopen", "pymodbus", "numba"}
    code = "import sys, agent.web.application; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert heavy & set(done.stdout.split()) == set()


def test_a_file_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    for content in (b"", b"PAR1", b"PAR1" * 5, b"PAR1" + b"\0" * 40 + b"\xff\xff\xff\x7fPAR1"):
        path.write_bytes(content)
        with pytest.raises(ForeignFooterError):
            key_values(path)
