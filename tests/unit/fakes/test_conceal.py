"""The generator of concealed cases: what a label says is in the recording, there, and so large."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.physics.twin import parse_twin
from agent.record.reading import read
from fakes.conceal import (
    EFFECTS,
    LOOK_ALIKES,
    OUTSIDERS,
    ConcealedCase,
    ConcealedRun,
    SealBrokenError,
    Tally,
    UnreachableError,
    canonical,
    cases,
    conceal,
    open_label,
    orders,
    seal,
    write_case,
)
from fakes.conceal.compared import compared, low_passed
from fakes.conceal.measure import Seen
from tests.unit.physics.effect_ids import CONTRACT

Floats = NDArray[np.float64]

NEEDS_GRAVITY = {"gravity-imbalance", "load-dependent-friction", "torque-constant-error"}
QUIET = 12  # a seed whose drive measures velocity with little noise: plain columns suffice


@functools.cache
def made(seed: int, *effects: str, design: Any = "poor", snr: float = 1.0) -> ConcealedCase:
    """Return a case without nuisances, made once."""
    return conceal(seed, effects=effects, design=design, snr=snr, nuisances=False)


def numeric(run: ConcealedRun, name: str) -> Floats:
    """Return one column as numbers."""
    return np.asarray(run.columns[name], dtype=np.float64)


def plain_columns(run: ConcealedRun) -> dict[str, Floats]:
    """Return what a reader would make of one run, on an even clock: smoothed, moving samples only.

    Written apart from the generator's own refit, from recorded columns alone.
    """
    rate = 500.0
    stamp = numeric(run, "time_s")
    time = np.arange(0.0, stamp[-1], 1.0 / rate)
    values = {
        name: np.interp(time, stamp, numeric(run, name)) for name in run.columns if name != "phase"
    }
    kernel = np.hanning(13)
    kernel /= kernel.sum()
    velocity = np.convolve(values["velocity_rad_s"], kernel, "same")
    values["acceleration_rad_s2"] = np.gradient(velocity, time)
    values["time_s"], values["velocity_rad_s"] = time, velocity
    direction = np.where(np.abs(velocity) > 0.6, np.sign(velocity), 0.0)
    began = np.maximum.accumulate(
        np.where(np.diff(direction, prepend=9.0) != 0.0, np.arange(time.size), 0)
    )
    values["after_reversal_s"] = time - time[began]
    travelled = np.abs(values["position_rad"] - values["position_rad"][began])
    lost = np.interp(time, stamp[1:], np.diff(stamp)) > 1.5 / rate
    values["counts"] = (direction != 0.0) & (travelled > 0.04) & ~lost
    values["arm_position_rad"] = values["position_rad"] / float(run.metadata["gear_ratio"])
    return values


def residual(
    case: ConcealedCase, *, as_given: bool = False
) -> list[tuple[dict[str, Floats], Floats]]:
    """Return columns and residual of every training run, after a fit or against the twin."""
    runs = [plain_columns(run) for run in case.training]
    twin = parse_twin(case.twin_toml)
    tables = []
    for c in runs:
        arm, v = c["arm_position_rad"], c["velocity_rad_s"]
        tables.append(
            np.column_stack([np.sign(v), v, c["acceleration_rad_s2"], np.sin(arm), np.cos(arm)])
        )
    if as_given:
        theta = np.array(
            [
                twin.coulomb_nm,
                twin.viscous_nm_s_per_rad,
                twin.inertia_kg_m2,
                twin.gravity_sin_nm,
                twin.gravity_cos_nm,
            ]
        )
    else:
        wide = slice(None) if case.label["design"] == "rich" else slice(3)
        table = np.vstack([t[c["counts"] > 0][:, wide] for t, c in zip(tables, runs, strict=True)])
        torque = np.concatenate([c["torque_nm"][c["counts"] > 0] for c in runs])
        theta = np.zeros(5)
        theta[wide] = np.linalg.lstsq(table, torque, rcond=None)[0]
    return [(c, c["torque_nm"] - t @ theta) for t, c in zip(tables, runs, strict=True)]


def rms_over_floor(case: ConcealedCase, *, as_given: bool = False) -> float:
    """Return the residual's root mean square over the label's noise floor."""
    kept = [r[c["counts"] > 0] for c, r in residual(case, as_given=as_given)]
    return float(np.sqrt(np.mean(np.concatenate(kept) ** 2)) / case.label["noise_floor_nm"])


def test_all_effects_of_the_contract_and_enough_outsiders_can_be_concealed() -> None:
    assert sorted(EFFECTS) == sorted(CONTRACT)
    assert len(OUTSIDERS) >= 5
    assert all(one in EFFECTS and other in EFFECTS for one, other in LOOK_ALIKES)


def test_a_gap_is_placed_under_the_loads_at_which_teeth_part() -> None:
    label = made(QUIET, "backlash").label
    where = label["effects"][0]["where"]
    assert {region["variable"] for region in where} == {"load_torque_nm"}
    low, high = min(r["from"] for r in where), max(r["to"] for r in where)
    assert low < 0.0 < high
    # The arm's friction holds the teeth together; a label once said all loads that were driven.
    assert high - low < label["base"]["coulomb_nm"]


@pytest.mark.parametrize("effect", [*EFFECTS, *OUTSIDERS])
def test_an_effect_reaches_the_snr_that_was_asked(effect: str) -> None:
    design = "rich" if effect in NEEDS_GRAVITY else "poor"
    label = made(QUIET, effect, design=design).label
    assert label["snr_reached"] == pytest.approx(1.0, rel=0.1)
    assert label["effects"][0]["effect"] == effect
    assert label["effects"][0]["energy_share"] == pytest.approx(1.0, abs=0.01)
    assert label["effects"][0]["where"]
    canonical(label)  # plain JSON, without NaN


@pytest.mark.parametrize(
    "effect",
    [
        "stribeck",
        "viscous-nonlinear",
        "direction-asymmetry",
        "position-dependent-friction",
        "friction-drift",
        "torque-offset",
        "cable-force",
        "local-fault",
        "temperature-dependent-friction",
        "inertia-error",
        "wrong-number",
        "outsider:snapping-seal",
    ],
)
def test_recorded_columns_alone_show_the_snr(effect: str) -> None:
    case = made(QUIET, effect)
    null = rms_over_floor(made(QUIET))
    as_given = case.label["basis"] == "as-given"
    shown = np.sqrt(rms_over_floor(case, as_given=as_given) ** 2 - null**2)
    assert shown == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize(("seed", "design"), [(12, "rich"), (12, "poor"), (6, "poor")])
def test_the_residual_of_a_null_is_the_noise_floor(seed: int, design: str) -> None:
    case = made(seed, design=design)
    assert case.label["effects"] == []
    assert case.label["expected_verdict"] == "no-mismatch"
    assert rms_over_floor(case) == pytest.approx(1.0, abs=0.05)
    assert case.label["structure_left_nm"] < 0.25 * case.label["noise_floor_nm"]


@pytest.mark.parametrize(
    "effect",
    [
        "stribeck",
        "local-fault",
        "presliding-hysteresis",
        "outsider:churning-band",
        "outsider:settling-grease",
        "outsider:ageing-contact",
    ],
)
def test_a_local_effect_lives_where_its_label_says(effect: str) -> None:
    case, null = made(QUIET, effect), made(QUIET)
    regions = case.label["effects"][0]["where"]
    inside, outside = [], []
    # The twin as given is the same joint for both: what differs is the effect, not a refit.
    theta = case.label["base"]
    for (c, _), (n, _) in zip(residual(case), residual(null), strict=True):
        length = min(c["time_s"].size, n["time_s"].size)
        left = [_left(x, theta)[:length] for x in (c, n)]
        both = ((c["counts"][:length] > 0) & (n["counts"][:length] > 0)).astype(bool)
        place = np.zeros(length, dtype=bool)
        for region in regions:
            along = c[region["variable"]][:length]
            place |= (along >= region["from"]) & (along <= region["to"])
        change = (left[0] - left[1]) ** 2
        inside.append(change[both & place])
        outside.append(change[both & ~place])
    assert np.mean(np.concatenate(inside)) > 3.0 * np.mean(np.concatenate(outside))


def _left(c: dict[str, Floats], theta: dict[str, float]) -> Floats:
    v = c["velocity_rad_s"]
    return np.asarray(
        c["torque_nm"]
        - theta["coulomb_nm"] * np.sign(v)
        - theta["viscous_nm_s_per_rad"] * v
        - theta["inertia_kg_m2"] * c["acceleration_rad_s2"]
    )


def test_mains_pickup_is_a_line_at_its_frequency() -> None:
    case = made(QUIET, "outsider:mains-pickup")
    region = case.label["effects"][0]["where"][0]
    c, r = residual(case)[0]
    spectrum = np.abs(np.fft.rfft(np.where(c["counts"] > 0, r, 0.0)))
    hertz = np.fft.rfftfreq(r.size, 0.002)
    assert region["from"] <= hertz[np.argmax(spectrum)] <= region["to"]


def test_ripple_is_a_line_at_its_order() -> None:
    case = made(QUIET, "torque-ripple")
    region = case.label["effects"][0]["where"][0]
    orders_ = np.arange(0.25, 12.0, 0.25)
    power = np.zeros(orders_.size)
    for c, r in residual(case):
        kept = c["counts"] > 0
        wave = np.exp(1j * orders_[:, None] * c["position_rad"][kept])
        power += np.abs(wave @ r[kept]) ** 2
    assert region["from"] <= orders_[np.argmax(power)] <= region["to"]


def test_a_saturated_drive_shows_flat_tops() -> None:
    case = made(QUIET, "torque-saturation")
    limit = case.label["effects"][0]["parameters"]["limit_nm"]
    torque = np.concatenate([numeric(run, "torque_nm") for run in case.training])
    assert np.max(np.abs(torque)) < limit + 6.0 * case.label["noise_floor_nm"]
    assert np.mean(np.abs(torque) > limit - 2.0 * case.label["noise_floor_nm"]) > 0.002


def test_friction_and_springs_give_back_no_more_than_they_took() -> None:
    # Work of the motor = heat in the oil + potential energy gained + what little the dampers take.
    from fakes.conceal.design import plan_runs
    from fakes.conceal.measure import commands
    from fakes.conceal.measure import see as seen_by
    from fakes.conceal.robot import draw_robot

    robot = draw_robot(np.random.default_rng(1), gravity=True, sample_rate_hz=1000.0)
    sensing = dataclasses.replace(robot.sensing, velocity="measured")
    truth = robot.truth._replace(oil_cooling_per_s=0.0, report_lag_s=0.0, presliding_rad=1e-3)
    robot = dataclasses.replace(robot, sensing=sensing, truth=truth)
    run = plan_runs(np.random.default_rng(2), robot, "rich")[1]
    seen = seen_by(truth, robot, run, commands(run))
    work = float(np.trapezoid(seen.torque_nm * seen.velocity_rad_s, seen.time_s))
    heat = float(seen.oil_degc[-1] - seen.oil_degc[0]) * truth.oil_capacity_j_per_k
    arm = seen.position_rad[[0, -1]] / truth.gear_ratio
    height = -truth.gravity_sin_nm * np.cos(arm) + truth.gravity_cos_nm * np.sin(arm)
    potential = float(height[1] - height[0]) * truth.gear_ratio
    assert heat > 0.0
    assert -0.001 < (work - potential - heat) / work < 0.01


def test_the_same_seed_is_the_same_case_and_the_same_joint() -> None:
    one = conceal(3, effects=("stribeck",), design="poor")
    two = conceal(3, effects=("stribeck",), design="poor")
    assert canonical(one.label) == canonical(two.label)
    assert one.twin_toml == two.twin_toml
    for a, b in zip(one.runs, two.runs, strict=True):
        assert all(np.array_equal(a.columns[name], b.columns[name]) for name in a.columns)
    null = conceal(3, effects=(), design="poor")
    assert null.label["base"] == one.label["base"]
    assert conceal(4, effects=(), design="poor").label["base"] != null.label["base"]


def test_a_seal_opens_with_its_own_label_and_salt_only() -> None:
    label = made(QUIET).label
    sealed = seal(label, "salt")
    assert len(sealed) == 64
    assert open_label(json.dumps(label), "salt", sealed) == label
    with pytest.raises(SealBrokenError):
        open_label(json.dumps(label), "pepper", sealed)
    with pytest.raises(SealBrokenError):
        open_label(json.dumps({**label, "noise_floor_nm": 0.0}), "salt", sealed)
    with pytest.raises(SealBrokenError, match="not JSON"):
        open_label("{", "salt", sealed)
    with pytest.raises(SealBrokenError, match="object"):
        open_label("[]", "salt", sealed)


def test_what_is_written_is_a_recording_and_tells_nothing(tmp_path: Path) -> None:
    case = made(QUIET, "stribeck")
    written = write_case(case, tmp_path)
    assert (len(written.training), len(written.holdout)) == (2, 1)
    recording = read(written.training[0])
    torque = np.asarray(recording["torque_nm"], dtype=np.float64)
    np.testing.assert_allclose(torque, numeric(case.training[0], "torque_nm"), rtol=1e-8)
    assert recording.metadata.samples_lost == case.training[0].metadata["samples_lost"]
    assert parse_twin(written.twin.read_text(encoding="utf-8")).effects == ()
    for path in tmp_path.rglob("*"):
        if path.suffix in (".json", ".toml"):
            assert not any(
                word in path.read_text(encoding="utf-8")
                for word in ("seed", "concealed", "nuisance")
            )


def test_a_rich_case_has_six_temperatures_and_holdouts_of_its_own() -> None:
    case = made(QUIET, design="rich")
    assert (len(case.training), len(case.holdout)) == (7, 2)
    means = [float(np.mean(numeric(r, "gearbox_temperature_degc"))) for r in case.runs]
    assert len({round(m / 3.0) for m in means[:7]}) == 6
    assert min(means[:7]) < 26.0
    assert max(means[:7]) > 50.0
    assert any(a > b for a, b in itertools.pairwise(means))
    assert min(abs(m - other) for m in means[7:] for other in means[:7]) > 1.5


def test_nuisances_are_small_and_logged() -> None:
    label = conceal(QUIET, effects=("stribeck",), design="poor").label
    named = [entry["effect"] for entry in label["nuisances"]]
    assert len(named) >= 2
    assert "stribeck" not in named
    assert named[-2:] == ["joint-flexibility", "presliding-hysteresis"]  # no joint is without
    for entry in label["nuisances"]:
        assert 0.0 <= entry["share_of_residual"] < 0.04
        assert entry["counts_as_true"] == (entry["share_of_residual"] >= 0.02)


def test_a_mixture_shares_the_mismatch_out() -> None:
    label = made(QUIET, "stribeck", "torque-ripple", design="rich").label
    shares = [effect["energy_share"] for effect in label["effects"]]
    assert shares == pytest.approx([0.5, 0.5], abs=0.05)
    assert label["snr_reached"] == pytest.approx(np.sqrt(2.0), rel=0.05)
    friction, wave = (
        [band["energy_share"] for band in effect["energy_share_by_band"]]
        for effect in label["effects"]
    )
    # A fast joint's wave is above a narrow band; friction that falls with speed is in all of them.
    assert wave[0] < wave[-1]
    assert friction[0] > friction[-1]
    assert np.add(friction, wave) == pytest.approx(1.0, abs=0.1)


def test_a_comparison_sees_a_band_away_from_where_friction_turns_round() -> None:
    time = np.arange(3000) / 500.0
    tones = np.stack([np.sin(2.0 * np.pi * hz * time) for hz in (1.0, 10.0, 60.0)], axis=1)
    smooth = low_passed(tones + 3.0, 1.0 / 500.0, 10.0) - 3.0
    inner = slice(500, 2500)
    kept = np.sqrt(np.mean(smooth[inner] ** 2, axis=0) / np.mean(tones[inner] ** 2, axis=0))
    assert kept == pytest.approx([1.0, 0.5, 0.0], abs=0.01)
    still = np.zeros_like(time)
    swing = Seen(time, 5.0 * np.sin(time), 5.0 * np.cos(time), still, still, still, still, still)
    (rows,) = compared([swing], 100.0, 1.0 / 500.0, 10.0)
    assert not rows[np.abs(swing.velocity_rad_s) < 0.3].any()
    assert rows[(np.abs(swing.velocity_rad_s) > 2.5) & (time > 0.2) & (time < 5.8)].all()


def test_a_twin_that_is_wrong_on_purpose_says_so() -> None:
    case = conceal(QUIET, effects=(), design="poor", twin_error=0.2)
    right, twin = made(QUIET).label["twin"], parse_twin(case.twin_toml)
    for name, factor in case.label["twin_error_factors"].items():
        assert abs(factor - 1.0) == pytest.approx(0.2)
        assert getattr(twin, name) == pytest.approx(factor * right[name], rel=0.05)


def test_what_cannot_be_reached_is_dropped_and_counted() -> None:
    with pytest.raises(UnreachableError, match="gravity"):
        made(QUIET, "gravity-imbalance")
    with pytest.raises(UnreachableError, match="SNR 500"):
        made(QUIET, "stribeck", snr=500.0)
    tally = Tally()
    asked = [
        dataclasses.replace(o, snr=500.0) for o in orders("single", 2, first_seed=0, design="poor")
    ]
    assert list(cases(iter(asked), tally)) == []
    assert (tally.made, len(tally.dropped)) == (0, 2)


def test_orders_give_every_effect_and_level_its_turn() -> None:
    singles = list(orders("single", 4 * len(EFFECTS), first_seed=100))
    assert len({(o.effects, o.snr) for o in singles}) == 4 * len(EFFECTS)
    assert len({o.seed for o in singles}) == len(singles)
    assert all(len(set(o.effects)) == 3 for o in orders("triple", 20, first_seed=0))
    assert {o.effects for o in orders("null", 3, first_seed=0)} == {()}
    alike = list(orders("look-alike", 2 * len(LOOK_ALIKES), first_seed=0))
    assert all(o.rival is not None and o.rival not in o.effects for o in alike)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"effects": ("gremlins",)}, "expected one of"),
        ({"snr": 0.0}, "snr"),
        ({"snr": float("nan")}, "snr"),
        ({"sample_rate_hz": 333.0}, "sample_rate_hz"),
    ],
)
def test_arguments_that_cannot_be_used_are_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        conceal(0, **arguments)
