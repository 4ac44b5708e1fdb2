"""Metadata: what is needed, what is kept, what is refused, each in one sentence."""

from __future__ import annotations

import dataclasses
import json
import math
import pickle
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.errors import InputError
from agent.record.metadata import SCHEMA, Metadata
from tests.unit.record.samples import metadata

DOCUMENT: dict[str, Any] = {
    "schema": SCHEMA,
    "robot": "r",
    "axis": 2,
    "gear_ratio": 100,
    "started_at": "2020-07-08T21:54:05Z",
    "trajectory": {"name": "stair"},
}

json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(extra=st.dictionaries(st.text(min_size=8), json_values, max_size=4), notes=st.text())
def test_unknown_keys_come_back_as_they_went_in(extra: dict[str, Any], notes: str) -> None:
    known = {field.name for field in dataclasses.fields(Metadata)}
    extra = {key: value for key, value in extra.items() if key not in known}
    before = metadata(extra=extra, notes=notes)
    after = Metadata.loads(before.dumps(), "x")
    assert after == before
    assert after.extra == extra


def test_every_known_key_round_trips_and_what_is_unknown_is_left_out() -> None:
    full = metadata(
        payload_kg=2.5, ambient_degc=-3.0, drive={"vendor_id": 1}, software="s", samples_lost=0
    )
    assert Metadata.loads(full.dumps(), "x") == full
    assert full.to_json()["samples_lost"] == 0  # counted and none is not the same as not counted
    assert "samples_lost" not in metadata().to_json()
    assert "payload_kg" not in metadata().to_json()


def test_a_label_that_is_missing_or_null_is_no_reason_to_refuse() -> None:
    found = Metadata.from_json(
        {"schema": SCHEMA, "robot": "r", "axis": 1.0, "gear_ratio": 1, "payload_kg": None}, "x"
    )
    assert (found.axis, found.gear_ratio, found.trajectory) == (1, 1.0, {})
    assert Metadata.from_json({**DOCUMENT, "trajectory": "stair"}, "x").trajectory == {
        "name": "stair"
    }


def test_a_newer_minor_schema_is_read_and_written_back() -> None:
    found = Metadata.from_json({**DOCUMENT, "schema": "stribeck.recording/1.3"}, "x")
    assert found.to_json()["schema"] == "stribeck.recording/1.3"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"schema": "stribeck.recording/2"}, "'stribeck.recording/2' is not one that this version"),
        ({"schema": "stribeck.recording/10"}, "is not one that this version"),
        ({"schema": "stribeck.twin/1"}, "is not one that this version"),
        ({"schema": 1}, "schema 1 is not one"),
        ({"schema": None}, "lacks schema"),
        ({"gear_ratio": None, "robot": None}, "lacks robot, gear_ratio"),
        ({"gear_ratio": "224"}, "gear_ratio must be motor turns per arm turn"),
        ({"gear_ratio": 0.00446}, "at least 1, got 0.00446"),
        ({"gear_ratio": -224.0}, "at least 1"),
        ({"gear_ratio": True}, "gear_ratio must be"),
        ({"gear_ratio": 10**400}, "gear_ratio must be"),
        ({"axis": "1"}, "axis must be a whole number, got '1'"),
        ({"axis": 1.5}, "axis must be a whole number"),
        ({"robot": " "}, "robot must be a name"),
        ({"started_at": "yesterday"}, "started_at must be a date and time in ISO 8601"),
        ({"samples_lost": -1}, "samples_lost must be a whole number"),
        ({"payload_kg": "heavy"}, "payload_kg must be a number of kilograms"),
        ({"notes": ["a"]}, "notes must be text"),
        ({"trajectory": [1]}, "trajectory must be an object"),
    ],
)
def test_a_document_that_cannot_be_used_is_refused(change: dict[str, Any], expected: str) -> None:
    with pytest.raises(InputError) as refused:
        Metadata.from_json({**DOCUMENT, **change}, "run.parquet")
    assert str(refused.value).startswith("run.parquet: ")
    assert expected in str(refused.value)


def test_all_mistakes_are_named_at_once() -> None:
    with pytest.raises(InputError) as refused:
        Metadata.from_json({**DOCUMENT, "axis": "one", "notes": 3}, "x")
    assert "axis must" in str(refused.value)
    assert "notes must" in str(refused.value)


@pytest.mark.parametrize("text", [b"", b"{", b"\xff\xfe", b'{"payload_kg": NaN}', b"[1]", b"7"])
def test_text_that_is_no_json_object_is_refused(text: bytes) -> None:
    with pytest.raises(InputError, match=r"^run\.json: the metadata"):
        Metadata.loads(text, "run.json")


def test_what_json_cannot_hold_is_refused_when_made_not_when_saved() -> None:
    with pytest.raises(ValueError, match="trajectory cannot be written as JSON"):
        metadata(trajectory={"velocity_rad_s": math.nan})
    with pytest.raises(ValueError, match="extra cannot be written as JSON"):
        metadata(extra={"path": object()})
    with pytest.raises(ValueError, match="extra must not repeat notes"):
        metadata(extra={"notes": "twice"})


def test_half_a_surrogate_pair_is_kept() -> None:
    odd = metadata(notes=json.loads('"\\ud800"'))
    assert Metadata.loads(odd.dumps(), "x") == odd


def test_updating_leaves_the_original_and_sorts_keys_by_what_is_known() -> None:
    before = metadata(extra={"a": 1})
    after = before.updated({"samples_lost": 3, "b": 2}).noted("One.").noted("Two.")
    assert (after.samples_lost, after.extra, after.notes) == (3, {"a": 1, "b": 2}, "One. Two.")
    assert before.extra == {"a": 1}
    assert pickle.loads(pickle.dumps(after)) == after


def test_the_callers_own_objects_are_not_shared() -> None:
    parameters = {"velocities": (1.0, 2.0)}
    made = metadata(trajectory=parameters)
    parameters["velocities"] = ()  # type: ignore[assignment]  # forbidden on purpose
    assert made.trajectory == {"velocities": [1.0, 2.0]}
