"""Magnets that weaken with warmth, where only the gearbox's temperature was recorded."""

from __future__ import annotations

from dataclasses import replace

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from tests.lessons.test_carried import CYCLE, KNOWN, recorded
from tests.science.explain_joint import Conditions, nothing, record

MORE_PER_K = 0.003
DEGC = (24.0, 34.0, 44.0, 52.0, 38.0, 29.0, 48.0, 40.0)


def warm(index: int, degc: float) -> Run:
    """Return a recording whose torque is reported too large by how warm the motor is."""
    (own,) = recorded((0.0,), 0.0, first=index)
    gearbox = record(CYCLE, nothing, Conditions(degc, 100.0 * index), index).columns
    share = 1.0 + MORE_PER_K * (degc - 38.0)
    signals = replace(own.signals, torque_nm=share * own.signals.torque_nm)
    return replace(own, signals=signals, columns={**own.columns, **gearbox})


def test_a_torque_that_grows_with_the_gearboxs_warmth_is_told_as_that() -> None:
    """The coolest recordings "carried something"; else it followed nothing, or was everywhere."""
    runs = [warm(k, degc) for k, degc in enumerate(DEGC)]
    answer = explain(KNOWN, runs[:6], runs[6:])
    assert not any("carr" in finding.said.lead for finding in answer.findings)
    told = " ".join((answer.sentence, *answer.reasons, *(f.sentence for f in answer.findings)))
    assert "grows by 0.3" in told
    assert "the motor's temperature, which would tell, was not recorded" in told
    varies = answer.unexplained_varies
    assert varies is not None
    assert (varies.number, varies.variable) == ("scale", "gearbox_temperature_degc")
