"""The whole story on concealed joints: a physics and a solver that the product has never seen.

Development seeds only; the score over sealed cases is `stribeck prove`.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from functools import cache
from typing import Any

import numpy as np
import pytest

from agent.explain.answer.result import Explanation
from agent.explain.choosing.materiality import CLOSE
from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Parameter
from agent.identify.signals.arrays import Signals
from agent.physics.twin import Twin, parse_twin
from fakes.conceal.case import ConcealedCase, conceal

SEED = 1


@cache
def case_of(*effects: str) -> ConcealedCase:
    return conceal(SEED, effects=list(effects), design="rich", snr=1.0)


def runs_of(case: ConcealedCase, *, held_out: bool = False) -> tuple[Run, ...]:
    """Return a case's recordings as the command passes them on."""
    return tuple(
        Run.from_columns(
            {
                column: np.asarray(values, dtype=np.float64)
                for column, values in recording.columns.items()
                if column != "phase"
            },
            recording.metadata["gear_ratio"],
            name=recording.name,
            started_s=datetime.fromisoformat(recording.metadata["started_at"]).timestamp(),
        )
        for recording in (case.holdout if held_out else case.training)
    )


@cache
def explained(*effects: str) -> Explanation:
    case = case_of(*effects)
    return explain(twin_of(case), runs_of(case), runs_of(case, held_out=True))


def twin_of(case: ConcealedCase) -> Twin:
    return parse_twin(case.twin_toml)


def concealed(*effects: str) -> dict[str, Any]:
    truth: dict[str, Any] = case_of(*effects).label["effects"][0]
    return truth


def overlap(found: Explanation, truth: dict[str, Any]) -> float:
    """Return intersection over union of the main region and the true one."""
    (place,) = truth["where"]
    region = found.findings[0].where[0]
    assert region.variable == place["variable"]
    inner = min(region.upper, float(place["to"])) - max(region.lower, place["from"])
    outer = max(region.upper, place["to"]) - min(region.lower, place["from"])
    return max(float(inner), 0.0) / float(outer)


def near(found: Parameter, truth: float) -> bool:
    """Tell whether the truth is within 1.5 times the 95 % interval: one seed in 300 is not."""
    assert found.ci95 is not None
    half = 0.5 * (found.ci95[1] - found.ci95[0])
    return abs(truth - 0.5 * sum(found.ci95)) <= 1.5 * half


@pytest.mark.parametrize(
    ("effect", "number"),
    [("stribeck", "stribeck_velocity_rad_s"), ("temperature-dependent-friction", "decay_k")],
)
def test_single_effect_is_named_located_measured_and_proven(effect: str, number: str) -> None:
    found, truth = explained(effect), concealed(effect)
    assert found.verdict == "explained"
    first = found.findings[0]
    assert first.effect == effect
    assert near(first.parameters[number], truth["parameters"][number])
    assert first.energy_share == pytest.approx(1.0, abs=0.1)
    assert overlap(found, truth) > 0.8
    assert found.holdout is not None
    assert found.holdout.floor_ratio < 1.10
    assert found.holdout.improvement_ci95_percent is not None
    assert found.holdout.improvement_ci95_percent[0] > 10.0
    assert abs(found.holdout.placebo_percent) < 2.0


def test_extended_twin_leaves_nothing_to_explain() -> None:
    case, found = case_of("stribeck"), explained("stribeck")
    assert found.twin is not None
    again = explain(found.twin, runs_of(case), runs_of(case, held_out=True))
    assert again.verdict == "no-mismatch"
    assert again.baseline.rmse_nm == pytest.approx(found.extended.rmse_nm, rel=0.02)


def test_wrong_number_is_named_as_such() -> None:
    found, truth = explained("inertia-error"), concealed("inertia-error")
    assert [f.effect for f in found.findings] == ["inertia-error"]
    extra = found.findings[0].parameters["inertia_extra_kg_m2"]
    assert near(extra, truth["parameters"]["inertia_extra_kg_m2"])
    assert found.unexplained_where == ()


def test_null_gets_no_false_name() -> None:
    """Nuisances of a few percent of the noise are really there: naming one of them is true.

    What stays unnamed of them, as lost in the recorded noise, stays above the floor.
    """
    found, label = explained(), case_of().label
    there = {n["effect"] for n in label["nuisances"]}
    there |= {also for n in label["nuisances"] for also in n["also"]}
    assert {f.effect for f in found.findings} <= there
    assert found.extended.rmse_nm < CLOSE * found.floor.value_nm


def test_order_of_recordings_and_a_common_offset_of_time_do_not_matter() -> None:
    case = case_of("stribeck")
    twin, runs = twin_of(case), runs_of(case)[:3]
    first = study(twin, tabulate(twin, runs)).model
    found = study(twin, tabulate(twin, tuple(_later(r, 1000.0) for r in reversed(runs)))).model
    assert [t.scored.form.effect for t in found.terms] == ["stribeck"]
    assert [t.scored.form.effect for t in first.terms] == ["stribeck"]
    assert np.std(found.residual_nm) == pytest.approx(np.std(first.residual_nm), rel=1e-3)
    for name, number in first.parameters[0].items():
        assert found.parameters[0][name].value == pytest.approx(number.value, rel=0.02)


def _later(run: Run, seconds: float) -> Run:
    signals = run.signals
    assert isinstance(signals, Signals)
    return replace(
        run,
        signals=replace(signals, time_s=np.asarray(signals.time_s + seconds)),
        started_s=run.started_s - seconds,
    )
