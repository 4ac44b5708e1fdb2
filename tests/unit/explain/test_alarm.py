"""An alarm is about what tells present cycles from healthy ones: its explanation leads with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.conclude.alarm import BESIDE, led_by_drift, said
from agent.explain.answer.names import NAMES
from agent.explain.answer.result import Alternative, Curve, Explanation, Finding
from agent.explain.answer.said import Said
from tests.unit.report import explanation_examples as examples

HEALTHY = 3
RISEN = "friction has risen by 70 mN m at equal temperature, averaged over the time of a cycle"


def found(*alternatives: Alternative) -> Explanation:
    """Return friction that changed by 70 mN m, of a smaller share than that of temperature."""
    made = examples.tied()
    at, nm = np.arange(5.0), np.array([-0.03, -0.02, -0.01, 0.04, 0.06])
    curve = Curve("recording", at, nm, nm, nm, at, nm, nm)
    drift = Finding(
        "friction-drift", 2, 1.0, 0.31, (), Said("It changes."), {}, alternatives, curve=curve
    )
    (warmth,) = made.findings
    warmth = replace(warmth, alternatives=(), energy_share=0.35)
    return examples.told(made, verdict="explained", findings=(warmth, drift))


def test_the_change_leads_sentence_and_list_and_is_measured_at_equal_temperature() -> None:
    led = led_by_drift(found(), HEALTHY)
    assert [(f.effect, f.rank) for f in led.findings] == [
        ("friction-drift", 1),
        ("temperature-dependent-friction", 2),
    ]
    lead = f"Between the healthy and the present cycles {RISEN}; {NAMES['friction-drift']}"
    assert led.sentence.startswith(f"{lead} explains 31 % of the mismatch. At gearbox temperatures")
    assert led.beside == BESIDE
    named = f"{NAMES['friction-drift']} (31 % of the mismatch). "
    assert said(led, HEALTHY).startswith(f"explain finds that between them {RISEN}: {named}")
    assert said(led, HEALTHY).endswith(
        f"{BESIDE}: friction that changes with the gearbox temperature (35 %)."
    )
    unknown = replace(found(), not_judged={"temperature-dependent-friction": "not recorded"})
    assert "at equal temperature" not in led_by_drift(unknown, HEALTHY).sentence


def test_what_may_be_something_else_does_not_lead() -> None:
    tied = found(Alternative("temperature-dependent-friction", 0.4, "Heat and cool."))
    assert led_by_drift(tied, HEALTHY) is tied
    assert said(tied, HEALTHY).startswith("explain cannot tell friction that changes with time")
