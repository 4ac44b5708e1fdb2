"""One case: recordings with something concealed in them, the twin that lacks it, the label."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fakes.conceal.concealment import UnreachableError
from fakes.conceal.design import Design, Run, plan_runs
from fakes.conceal.label import Label
from fakes.conceal.labelling import describe
from fakes.conceal.library import EFFECTS, maker
from fakes.conceal.measure import Noise, Seen, columns, commands, draw_noise, sample_count, see
from fakes.conceal.rehearsal import Rehearsal, amplitude_for, known_numbers
from fakes.conceal.robot import Robot, draw_robot
from fakes.conceal.small import Put, all_in, small_effects
from fakes.conceal.truth import Truth

FIRST_SCORED_SEED = 10_000
"""Seeds below it are for development: no score counts a case that a threshold was tuned on."""

LABEL_SCHEMA = "stribeck.concealed/1"
LEAST_ENERGY_SHARE = 0.1
"""Of a mixture's excess energy, for each of its effects; below it the case is dropped."""

AXIS = 1
_FIRST_DAY = datetime(2026, 3, 2, 5, 0, tzinfo=UTC)
Columns = Mapping[str, NDArray[np.float64] | NDArray[np.str_]]
More = Callable[[Sequence[Run]], Sequence[Run]]


@dataclass(frozen=True)
class ConcealedRun:
    """One recording: columns and metadata of contract section 2."""

    name: str
    columns: Columns
    metadata: Mapping[str, Any]
    is_holdout: bool


@dataclass(frozen=True)
class ConcealedCase:
    """What a tool gets to see, and the label that it does not.

    Parameters
    ----------
    name : str
        Of the case; it tells nothing.
    runs : tuple of ConcealedRun
        In the order in which they were driven; the hold-outs are the last.
    twin_toml : str
        The plain twin (contract section 3): rigid body, gravity, Coulomb, viscous.
    label : mapping
        Everything that is true, for `seal` before and a score after.
    """

    name: str
    runs: tuple[ConcealedRun, ...]
    twin_toml: str
    label: Label

    @property
    def training(self) -> tuple[ConcealedRun, ...]:
        """Return the runs to explain."""
        return tuple(run for run in self.runs if not run.is_holdout)

    @property
    def holdout(self) -> tuple[ConcealedRun, ...]:
        """Return the runs to prove it on."""
        return tuple(run for run in self.runs if run.is_holdout)


def conceal(
    seed: int,
    *,
    effects: Sequence[str] | None = None,
    design: Design = "rich",
    snr: float = 1.0,
    nuisances: bool = True,
    sample_rate_hz: float = 500.0,
    twin_error: float = 0.0,
    more: More | None = None,
) -> ConcealedCase:
    """Return recordings of a joint with effects concealed, sized by what they leave in the noise.

    Parameters
    ----------
    seed : int
        Draws robot, runs, effects' numbers and noise, each from a stream of its own: the same
        seed has the same robot and runs whatever is concealed. 0 to 9999 are for development;
        scored cases start at 10000.
    effects : sequence of str, optional
        Ids of contract section 4, or outsiders; none of them makes a null. Without it, one id is
        drawn.
    design : {"rich", "poor"}
        See `plan_runs`.
    snr : float
        Of each effect by itself: excess RMS after the best refit of the base structure, over the
        noise floor, on the training runs. What a refit absorbs (inertia-error, wrong-number,
        gravity-imbalance, a constant torque-constant-error) is sized against the twin as given,
        and torque-saturation against the structure fitted to the set-points.
    nuisances : bool
        Whether two or three small effects are there as well, logged with their energy.
    sample_rate_hz : float
        A divisor of 8000 from 100 to 1000.
    twin_error : float
        By how much the twin's Coulomb, viscous and inertia values are wrong, as a share with a
        sign drawn for each; then the label says so.
    more : callable, optional
        What is driven after all of them, of the runs that were planned: an experiment that an
        explanation asked for. Nothing else changes by it, and the label does not speak of it.

    Raises
    ------
    UnreachableError
        An effect cannot be that large here, or a mixture's effects cancel one another; drop the
        case, and count it.
    ValueError
        An argument cannot be used.
    """
    if not (math.isfinite(snr) and snr > 0.0):
        raise ValueError(f"snr: expected a number above 0, got {snr}")
    of = _Streams(seed)
    robot = draw_robot(of.robot, gravity=design == "rich", sample_rate_hz=sample_rate_hz)
    runs = plan_runs(of.runs, robot, design)
    asked_for = () if more is None else tuple(more(runs))
    noise = [
        draw_noise(of.noise, robot.sensing, sample_count(run, sample_rate_hz))
        for run in (*runs, *asked_for)
    ]
    if effects is None:
        effects = (str(of.choice.choice(tuple(EFFECTS))),)
    asked = [maker(effect)(of.effects, robot) for effect in effects]
    trained = sum(not run.is_holdout for run in runs)  # the hold-outs are driven last
    rehearsal = Rehearsal.of(robot, runs[:trained], noise[:trained])
    small = small_effects(of.nuisances, rehearsal, effects) if nuisances else []
    reference = all_in(robot.truth, small)
    large = [Put(c, *amplitude_for(rehearsal, c, reference, snr)) for c in asked]
    truth = all_in(reference, large)
    twin, factors = _twin_numbers(of.twin, rehearsal, large, truth, twin_error)
    seen = rehearsal.see(truth)  # the training runs come first
    runs = (*runs, *asked_for)
    seen = [*seen, *(see(truth, robot, run, commands(run)) for run in runs[len(seen) :])]
    recorded = tuple(
        _record(number, robot, run, drive, chance)
        for number, (run, drive, chance) in enumerate(zip(runs, seen, noise, strict=True), start=1)
    )
    described = describe(rehearsal, small, large)
    _require_visible(described)
    label = {
        "schema": LABEL_SCHEMA,
        "seed": seed,
        "design": design,
        "snr_asked": snr,
        "twin": twin,
        "twin_error_factors": factors,
        **described,
    }
    return ConcealedCase(f"case-{seed:05d}", recorded, _twin_toml(robot, twin), label)


def _require_visible(described: Mapping[str, Any]) -> None:
    """Drop a mixture in which effects hide behind one another: then nobody could find them all."""
    found = described["effects"]
    if len({effect["basis"] for effect in found}) != 1:
        return  # what a refit absorbs has next to no share beside what it does not, and yet shows
    for effect in found:
        if effect["energy_share"] < LEAST_ENERGY_SHARE:
            raise UnreachableError(
                f"{effect['effect']}: only {effect['energy_share']:.3f} of what the mixture leaves "
                "is its own; the others cancel or carry the rest"
            )


class _Streams:
    """One stream of chance for each thing that is drawn, so that one does not move another."""

    def __init__(self, seed: int) -> None:
        spawned = np.random.SeedSequence(seed).spawn(7)
        generators = [np.random.default_rng(sequence) for sequence in spawned]
        self.robot, self.runs, self.noise, self.choice = generators[:4]
        self.effects, self.nuisances, self.twin = generators[4:]


def _twin_numbers(
    rng: np.random.Generator,
    rehearsal: Rehearsal,
    large: Sequence[Put],
    truth: Truth,
    error: float,
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the twin's numbers, and by which factors they were made wrong on purpose.

    Where an effect shows against the twin as given, the twin is the joint without it; else it is
    what an engineer would have identified from these very runs, so that no number is wrong by
    itself.
    """
    if any(put.concealment.basis == "as-given" for put in large):
        numbers = known_numbers(rehearsal.robot.truth)
    else:
        numbers = dict(rehearsal.fit(rehearsal.see(truth)).numbers)
    factors = {}
    for name in ("coulomb_nm", "viscous_nm_s_per_rad", "inertia_kg_m2"):
        sign = float(rng.choice((-1.0, 1.0)))
        if error != 0.0:
            factors[name] = 1.0 + sign * error
        numbers[name] = max(numbers[name] * factors.get(name, 1.0), 0.0)
    return {name: float(f"{value:.6g}") for name, value in numbers.items()}, factors


def _twin_toml(robot: Robot, numbers: Mapping[str, float]) -> str:
    return "\n".join(
        (
            'schema = "stribeck.twin/1"',
            f'robot = "{robot.name}"',
            f"axis = {AXIS}",
            f"gear_ratio = {robot.truth.gear_ratio!r}",
            "",
            "[rigid_body]",
            f"inertia_kg_m2 = {numbers['inertia_kg_m2']!r}",
            f"gravity_sin_nm = {numbers['gravity_sin_nm']!r}",
            f"gravity_cos_nm = {numbers['gravity_cos_nm']!r}",
            "",
            "[friction]",
            f"coulomb_nm = {numbers['coulomb_nm']!r}",
            f"viscous_nm_s_per_rad = {numbers['viscous_nm_s_per_rad']!r}",
            "",
        )
    )


def _record(number: int, robot: Robot, run: Run, seen: Seen, chance: Noise) -> ConcealedRun:
    """Return one run as it is recorded."""
    table, lost = columns(seen, robot, run, chance)
    began = _FIRST_DAY + timedelta(hours=run.started_hours)
    trajectory = run.trajectory.to_json()
    return ConcealedRun(
        f"run-{number:02d}",
        table,
        {
            "schema": "stribeck.recording/1",
            "robot": robot.name,
            "axis": AXIS,
            "gear_ratio": robot.truth.gear_ratio,
            "started_at": began.isoformat(),
            "trajectory": {"name": trajectory["name"], "parameters": trajectory["parameters"]},
            "ambient_degc": round(run.state.ambient_degc, 1),
            "samples_lost": lost,
        },
        run.is_holdout,
    )
