"""`stribeck prove` end to end: made and sealed, explained from files, opened, counted."""

from __future__ import annotations

import hashlib
import hmac
import json
from pathlib import Path

import pytest

from agent.cli.prove import prove
from agent.cli.prove.case import Sealed, make
from agent.cli.prove.plan import NULL, POOR, Asked
from agent.errors import InputError
from fakes.conceal import EFFECTS, OUTSIDERS, Order


def test_the_folder_tells_nothing_of_what_was_concealed(tmp_path: Path) -> None:
    sealed = make(Order(4711, "single", ("torque-ripple",), "poor", 2.0), tmp_path)
    assert isinstance(sealed, Sealed)
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert sorted({path.name for path in files if path.suffix == ".toml"}) == ["twin.toml"]
    assert {path.suffix for path in files} == {".toml", ".csv", ".json"}
    words = [*EFFECTS, *OUTSIDERS, "4711", "snr", "seed", sealed.salt, sealed.seal]
    for path in files:
        if path.suffix != ".csv":
            text = path.read_text(encoding="utf-8").replace("stribeck.", "")  # of the schema
            assert [word for word in words if word in text] == [], path.name
    header = next(p for p in files if p.suffix == ".csv").read_text(encoding="utf-8")
    assert "simulated" not in header.splitlines()[0]


def test_what_the_joint_cannot_show_is_dropped_with_its_reason(tmp_path: Path) -> None:
    # The poor cycle drives an axis that gravity does not load.
    dropped = make(Order(5, "single", ("gravity-imbalance",), "poor", 1.0), tmp_path)
    assert isinstance(dropped, str)
    assert "gravity" in dropped


def test_two_cases_are_proven_one_is_dropped_and_every_seal_holds(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = (
        Asked(1, POOR, Order(4711, "single", ("torque-ripple",), "poor", 2.0)),
        Asked(2, POOR, Order(5, "single", ("gravity-imbalance",), "poor", 1.0)),
        Asked(3, NULL, Order(6, "null", (), "poor", 1.0)),
    )
    monkeypatch.setattr(prove, "plan", lambda *_: asked)
    prove.run_prove(3, 0, full=False, processes=2, as_json=True)
    out, talk = capsys.readouterr()
    document = json.loads(out)
    assert document["schema"] == "stribeck.proof/1"
    assert not document["counts_as_score"]
    assert [d["number"] for d in document["dropped"]] == [2]
    assert [c["number"] for c in document["cases"]] == [1, 3]
    for case in document["cases"]:
        digest = hmac.new(case["salt"].encode(), case["label_text"].encode(), hashlib.sha256)
        assert digest.hexdigest() == case["seal"]
        assert json.loads(case["label_text"])["seed"] == case["seed"]
        sealed, opened = (talk.index(t) for t in (case["seal"], f"case {case['number']} of 3"))
        assert sealed < opened  # the seal was said before the answer was known
        assert case["explanation"]["schema"] == "stribeck.explanation/1"
    ripple, null = document["cases"]
    assert ripple["score"]["first_right"]
    assert ripple["score"]["baseline"]
    assert ripple["score"]["located"][0]["order_right"]
    assert null["score"]["truth"] == []
    assert document["summary"]["names"]["one effect, poor cycle"]["first_right"]["hits"] == 1


@pytest.mark.parametrize(("cases", "processes"), [(0, 2), (3, 0), (3, 1000)])
def test_impossible_numbers_are_refused(cases: int, processes: int) -> None:
    with pytest.raises(InputError, match="expected"):
        prove.run_prove(cases, 10_000, full=False, processes=processes, as_json=False)
