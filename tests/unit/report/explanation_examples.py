"""Explanations as the engine would make them, from small simulated stairs, for the tests.

Everything that is a number on the page comes from the arrays: the refits are least squares over all
samples, the errors are theirs, and the map's gains are taken on blocks that were not fitted.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.number_sentences import number_sentence
from agent.explain.answer.result import (
    Alternative,
    Cell,
    Curve,
    Explanation,
    Finding,
    Fit,
    Floor,
    Holdout,
    Moved,
    NextExperiment,
    Region,
    Trace,
    Varying,
    fit_of,
)
from agent.explain.answer.sentences import finding_sentence
from agent.explain.answer.words import summary_of
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Effect, Twin
from tests.unit.report.explanation_stairs import (
    BASE,
    GEAR_RATIO,
    GIVEN,
    NOISE_NM,
    TRUTH,
    Law,
    Run,
    at_30_rad_s,
    bump,
    columns_of,
    drive,
    fitted,
    none,
    ones,
    stribeck,
    temperature,
)
from trajectories import Segment, Trajectory

METADATA: dict[str, object] = {
    "started_at": "2026-03-01T02:03:04.567Z",
    "trajectory": {"name": "stair", "parameters": {"steps": 16}},
    "drive": {"name": "EPOS4", "serial": 123456},
    "software": "stribeck 0.1.0",
}


def with_interval(value: float, deviation: float) -> Parameter:
    """Return an identified parameter with its 95 % interval."""
    return Parameter(value, (value - 1.96 * deviation, value + 1.96 * deviation))


def traces(
    runs: Sequence[Run], held_out: Sequence[Run], laws: Sequence[Law], given: Floats = GIVEN
) -> list[Trace]:
    """Return every recording before and after; the fits see `runs` alone."""
    plain, _ = fitted(runs, ())
    whole, _ = fitted(runs, laws)
    return [
        Trace(
            run.name,
            run in held_out,
            run.time_s,
            run.velocity,
            run.measured_nm,
            run.measured_nm - run.base @ given,
            run.measured_nm - run.base @ plain,
            run.measured_nm - columns_of(run, laws) @ whole,
        )
        for run in (*runs, *held_out)
    ]


def stage(parts: Sequence[Trace], name: str) -> Fit:
    """Return one stage's error over several recordings."""
    return fit_of(
        np.concatenate([part.measured_nm for part in parts]),
        np.concatenate([getattr(part, name) for part in parts]),
    )


AXES: Mapping[str, Callable[[Run], Floats]] = {
    "velocity_rad_s": lambda run: np.abs(run.velocity),
    "direction": lambda run: np.sign(run.velocity),
    "acceleration_rad_s2": lambda run: np.abs(run.acceleration),
    "gearbox_temperature_degc": lambda run: run.temperature,
    "time_s": lambda run: run.time_s,
    "recording": lambda run: np.full(run.time_s.size, float(run.number)),
}


def cells(runs: Sequence[Run], residuals: Sequence[Floats]) -> tuple[Cell, ...]:
    """Return what each base parameter gains along each axis on every other block of 2 s."""
    residual = np.concatenate(residuals)
    base = np.vstack([run.base for run in runs])
    seen = np.concatenate([np.floor(run.time_s / 2.0) % 2 == run.number % 2 for run in runs])
    made = []
    for axis, along in AXES.items():
        place = np.concatenate([along(run) for run in runs])
        edges = np.unique(np.quantile(place, np.linspace(0.0, 1.0, 9)))
        bins = np.searchsorted(edges[1:-1], place, side="right")
        for k, parameter in enumerate(BASE):
            columns = base[:, k, None] * (bins[:, None] == np.arange(edges.size - 1))
            theta, *_ = np.linalg.lstsq(columns[seen], residual[seen], rcond=None)
            left = residual[~seen] - columns[~seen] @ theta
            gain = 1.0 - float(np.sum(left**2) / np.sum(residual[~seen] ** 2))
            made.append(Cell(parameter, axis, gain, 0.002 if gain > 0.02 else 0.4, gain > 0.02))
    return tuple(made)


def curve(
    runs: Sequence[Run], parts: Sequence[Trace], law: Law, variable: str, per: Law | None = None
) -> Curve:
    """Return a law over its axis with the binned means of what the twin lacks there.

    With `per`, line and means are what they are where `per` is one, so that a law that is
    proportional to something else has one line.
    """
    along: Law = (lambda run: run.velocity) if variable == "velocity_rad_s" else AXES[variable]
    place = np.concatenate([along(run) for run in runs])
    weight = np.concatenate([(per or ones)(run) for run in runs])
    kept = np.abs(weight) > 0.5
    place, weight = place[kept], weight[kept]
    line = np.concatenate([law(run) for run in runs])[kept] / weight
    left = np.concatenate([part.extended_nm for part in parts[: len(runs)]])[kept] / weight
    edges = np.unique(np.quantile(place, np.linspace(0.0, 1.0, 25)))
    inside = [(place >= a) & (place <= b) for a, b in pairwise(edges)]
    inside = [one for one in inside if one.sum() > 8]
    order = np.argsort(place)[:: max(1, place.size // 300)]
    width = 0.02 * float(np.max(np.abs(line))) + 0.002
    return Curve(
        variable,
        place[order],
        line[order],
        line[order] - width,
        line[order] + width,
        np.array([place[one].mean() for one in inside]),
        np.array([(left + line)[one].mean() for one in inside]),
        np.array([1.96 * left[one].std() / math.sqrt(one.sum()) for one in inside]),
    )


def whole(
    runs: Sequence[Run], held_out: Sequence[Run], laws: Sequence[Law], given: Floats = GIVEN
) -> tuple[Explanation, list[Trace]]:
    """Return an explanation with its numbers, fits, map and proof; findings are put in later."""
    parts = traces(runs, held_out, laws, given)
    training, unseen = parts[: len(runs)], parts[len(runs) :]
    plain, plain_sd = fitted(runs, ())
    full, full_sd = fitted(runs, laws)
    judged = unseen or training
    before, after = stage(judged, "refitted_nm"), stage(judged, "extended_nm")
    gain = 100.0 * (1.0 - after.rmse_nm / before.rmse_nm)
    floor = Floor(NOISE_NM, 0.0122, 0.0117, math.nan)
    explanation = Explanation(
        verdict="explained",
        sentence="",
        reasons=(),
        floor=floor,
        baseline=stage(training, "given_nm"),
        refitted=stage(training, "refitted_nm"),
        extended=stage(training, "extended_nm"),
        holdout=Holdout(
            "1 hold-out recording" if unseen else "folds over whole recordings",
            stage(judged, "given_nm"),
            before,
            after,
            gain,
            (gain - 1.6, gain + 1.1) if laws else None,
            after.rmse_nm / NOISE_NM,
            15 if laws else 0,
            16,
            0.4,
            white=bool(laws),
        ),
        findings=(),
        unexplained_share=0.01,
        unexplained_where=(),
        cells=cells(runs, [part.refitted_nm for part in training]),
        moved=tuple(
            Moved(
                name,
                float(GIVEN[k]),
                with_interval(plain[k], plain_sd[k]),
                with_interval(full[k], full_sd[k]),
                float((full[k] - plain[k]) / plain_sd[k]),
            )
            for k, name in enumerate(BASE)
        )
        if laws
        else (),
        next_experiment=None,
        recordings=tuple(run.name for run in runs),
        held_out=tuple(run.name for run in held_out),
        traces=tuple(parts),
    )
    return explanation, parts


TWIN = Twin(
    "cell7-irb6650",
    1,
    GEAR_RATIO,
    0.0184,
    0.6042,
    0.0107,
    effects=(
        Effect(
            "stribeck",
            {"static_extra_nm": 0.31, "stribeck_velocity_rad_s": 6.0, "exponent": 1.3},
        ),
    ),
)


def stribeck_finding(
    runs: Sequence[Run], parts: Sequence[Trace], energy_share: float = 0.62
) -> Finding:
    """Return the first of two findings."""
    where = (Region("velocity_rad_s", -14.0, 14.0, 61.0, 0.62),)
    return Finding(
        "stribeck",
        1,
        0.97,
        energy_share,
        where,
        finding_sentence("stribeck", where, (0.0, 0.31), energy_share, {}),
        {
            "static_extra_nm": with_interval(0.31, 0.006),
            "stribeck_velocity_rad_s": with_interval(6.04, 0.21),
            "exponent": Parameter.not_identified(
                "no speed below 2 rad/s was driven; record slower steps instead"
            ),
        },
        (
            Alternative(
                "presliding-hysteresis",
                0.02,
                "Reversals of halving amplitude: presliding follows travel, Stribeck speed.",
            ),
        ),
        holdout_rmse_without_nm=0.07,
        form="Stribeck curve",
        curve=curve(runs, parts, stribeck, "velocity_rad_s"),
    )


def temperature_finding(
    runs: Sequence[Run], parts: Sequence[Trace], rank: int = 2, energy_share: float = 0.33
) -> Finding:
    """Return the second of two findings."""
    effect = "temperature-dependent-friction"
    where = (Region("gearbox_temperature_degc", 24.0, 46.0, 96.0, 0.33),)
    return Finding(
        effect,
        rank,
        0.93,
        energy_share,
        where,
        finding_sentence(effect, where, (-0.1, 0.12), energy_share, {}, first=rank == 1),
        {
            "viscous_thermal_nm_s_per_rad": with_interval(0.0042, 0.00013),
            "decay_k": with_interval(35.0, 1.4),
        },
        (),
        holdout_rmse_without_nm=0.041,
        form="viscosity",
        curve=curve(runs, parts, temperature, "gearbox_temperature_degc", at_30_rad_s),
    )


def warm_runs(missing: Sequence[Law], count: int = 2) -> tuple[list[Run], list[Run]]:
    """Return stairs at several temperatures, and one to hold out."""
    bands = ((24.0, 26.0), (43.0, 46.0), (33.0, 36.0))[:count]
    runs = [drive(f"stair-{k}.parquet", k, band, missing) for k, band in enumerate(bands)]
    return runs, [drive("night-run.parquet", 7, (38.0, 40.0), missing)]


def told(made: Explanation, **changes: Any) -> Explanation:
    """Return an explanation with changes, and with the sentence that then is its answer."""
    changed = dataclasses.replace(made, **changes)
    return dataclasses.replace(changed, sentence=summary_of(changed))


def explained() -> Explanation:
    """Return two findings, proved on a hold-out recording."""
    laws = (stribeck, temperature)
    runs, held_out = warm_runs(laws, 3)
    made, parts = whole(runs, held_out, laws)
    return told(
        made,
        findings=(stribeck_finding(runs, parts), temperature_finding(runs, parts)),
        not_judged={
            "gravity-imbalance": "the position was not recorded",
            "torque-constant-error": "the motor temperature was not recorded",
        },
        aliases=(("direction-asymmetry", "torque-offset"),),
        twin=TWIN,
    )


def tied() -> Explanation:
    """Return a warm-up in which temperature and time rise together, with the way out."""
    laws = (temperature,)
    runs = [drive(f"warm-up-{k}.parquet", k, (24.0 + 9 * k, 32.0 + 9 * k), laws) for k in range(2)]
    made, parts = whole(runs, (), laws)
    stair = Trajectory("reheat", {"speeds": 6}, 0.0, (Segment.rest(1.0),)).to_json()
    finding = dataclasses.replace(
        temperature_finding(runs, parts, 1, 0.91),
        probability=0.54,
        holdout_rmse_without_nm=math.nan,
        alternatives=(
            Alternative(
                "friction-drift",
                0.46,
                "The same speeds at equal temperature while the gearbox heats and while it cools.",
            ),
        ),
    )
    return told(
        made,
        verdict="tied",
        findings=(finding,),
        next_experiment=NextExperiment(
            "Let the gearbox cool below 28 °C and drive the same stair again.",
            ("temperature-dependent-friction", "friction-drift"),
            150.0,
            0.067,
            trajectory=stair,
            set_up="Wait until the gearbox is below 28 °C: about 50 min at rest.",
        ),
        further_experiments=(
            NextExperiment(
                "Drive the speeds in reversed order from cold.",
                ("temperature-dependent-friction", "friction-drift"),
                420.0,
                0.024,
            ),
        ),
        reasons=(
            "There is one warm-up only; folds over whole recordings stand in for a hold-out.",
        ),
    )


def partly() -> Explanation:
    """Return one finding beside something that nothing carries."""
    runs, held_out = warm_runs((stribeck, bump))
    made, parts = whole(runs, held_out, (stribeck,))
    return told(
        made,
        verdict="partly-explained",
        findings=(stribeck_finding(runs, parts, 0.58),),
        unexplained_share=0.38,
        unexplained_where=(
            Region("velocity_rad_s", 28.0, 48.0, 14.0, 0.2),
            Region("velocity_rad_s", -48.0, -28.0, 14.0, 0.18),
        ),
        twin=TWIN,
    )


def unexplained() -> Explanation:
    """Return a mismatch that is located and has no name."""
    runs, held_out = warm_runs((bump,))
    made, _ = whole(runs, held_out, ())
    return dataclasses.replace(
        made,
        verdict="unexplained",
        sentence=(
            "At 28 to 48 rad/s the joint needs up to 0.2 N m more than the simulation in both "
            "directions. Nothing in the library carries that."
        ),
        extended=Fit(),
        holdout=dataclasses.replace(
            _holdout(made), extended=Fit(), improvement_percent=math.nan, floor_ratio=math.nan
        ),
        unexplained_share=0.97,
        unexplained_where=(fast := Region("velocity_rad_s", 28.0, 48.0, 14.0, 0.5),),
        unexplained_varies=Varying(
            "coulomb_nm",
            "velocity_rad_s",
            0.5,
            at=np.linspace(-48.0, 48.0, 25),
            more=np.where(np.linspace(-48.0, 48.0, 25) > 28.0, 0.2, 0.0),
            half=np.full(25, 0.01),
            regions=(fast,),
            amounts=(0.2,),
        ),
        aliases=(("direction-asymmetry", "torque-offset"),),
    )


def wrong_number() -> Explanation:
    """Return a simulation whose numbers alone are wrong."""
    runs, held_out = warm_runs(())
    made, _ = whole(runs, held_out, (none,))
    finding = Finding(
        "wrong-number",
        1,
        1.0,
        0.99,
        (Region("velocity_rad_s", -60.0, 60.0, 96.0, 0.99),),
        number_sentence("wrong-number", {"Coulomb friction": (0.64, 0.6042, "N m")}, 0.99),
        {"coulomb_nm": with_interval(0.6042, 0.0006)},
        form=OWN_NUMBER,
    )
    holdout = _holdout(made)
    gain = 100.0 * (1.0 - holdout.extended.rmse_nm / holdout.baseline.rmse_nm)
    proved = dataclasses.replace(
        holdout, improvement_percent=gain, improvement_ci95_percent=(gain - 1.6, gain + 1.1)
    )
    return told(made, findings=(finding,), holdout=proved)


def no_mismatch() -> Explanation:
    """Return a simulation that is as good as the noise allows."""
    runs, held_out = warm_runs(())
    made, _ = whole(runs, held_out, (), TRUTH)
    return dataclasses.replace(
        made,
        verdict="no-mismatch",
        sentence=(
            "Simulation and recordings agree within the noise: 0.012 N m is left, and 0.012 N m is "
            "the noise floor."
        ),
        cells=tuple(dataclasses.replace(cell, counts=False) for cell in made.cells),
        unexplained_share=math.nan,
    )


def undecided() -> Explanation:
    """Return what a production log gives: reasons and no numbers."""
    return Explanation(
        verdict="unexplained",
        sentence="This log does not say whether the simulation is right.",
        reasons=(
            "the sample rate of 1 Hz is too slow: at least 100 Hz are needed",
            "no steady window was found in either direction",
        ),
        floor=Floor(math.nan, math.nan, math.nan, math.nan),
        baseline=Fit(),
        refitted=Fit(),
        extended=Fit(),
        holdout=None,
        findings=(),
        unexplained_share=math.nan,
        unexplained_where=(),
        cells=(),
        moved=(),
        next_experiment=None,
        recordings=("ur3-production.parquet",),
    )


def trace_of(velocity: list[float], residual: list[list[float]]) -> Trace:
    """Return a trace with these velocities and these residuals: given, refitted, extended."""
    given, refitted, extended = (np.array(values) for values in residual)
    return Trace(
        "a.parquet",
        held_out=False,
        time_s=np.arange(float(len(velocity))),
        velocity_rad_s=np.array(velocity),
        measured_nm=np.ones(len(velocity)),
        given_nm=given,
        refitted_nm=refitted,
        extended_nm=extended,
    )


def _holdout(explanation: Explanation) -> Holdout:
    assert explanation.holdout is not None
    return explanation.holdout


ALL = (explained, tied, partly, unexplained, wrong_number, no_mismatch, undecided)
