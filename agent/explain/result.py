"""What an explanation says: frozen, honest, and written out as `stribeck.explanation/1`.

Pictures are drawn from the same values: the map's cells, the curve of a finding over the data,
and the traces of each recording before and after.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.physics.twin import Twin

SCHEMA = "stribeck.explanation/1"

Verdict = Literal["explained", "tied", "partly-explained", "unexplained", "no-mismatch"]


@dataclass(frozen=True)
class Fit:
    """How far a prediction is from a recording; both NaN where nothing was compared.

    `fit_percent` is ``100 (1 - |y - yhat| / |y - mean(y)|)`` (contract section 6).
    """

    rmse_nm: float = math.nan
    fit_percent: float = math.nan

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON; empty where nothing was compared."""
        if math.isnan(self.rmse_nm):
            return {}
        return {"rmse_nm": self.rmse_nm, "fit_percent": number(self.fit_percent)}


@dataclass(frozen=True)
class Region:
    """Where along one axis of the recordings a mismatch lives.

    `variable` is a word of contract section 6; `seconds` is how much of the recordings lies there
    and `share` which part of the mismatch's energy.
    """

    variable: str
    lower: float
    upper: float
    seconds: float = math.nan
    share: float = math.nan

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        out: dict[str, Any] = {"variable": self.variable, "from": self.lower, "to": self.upper}
        for name in ("seconds", "share"):
            value = getattr(self, name)
            if math.isfinite(value):
                out[name] = value
        return out


@dataclass(frozen=True)
class Alternative:
    """Another effect that the recordings carry as well, and what would decide."""

    effect: str
    probability: float
    told_apart_by: str

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "effect": self.effect,
            "probability": self.probability,
            "told_apart_by": self.told_apart_by,
        }


@dataclass(frozen=True)
class Curve:
    """A finding over the axis on which it lives: the law's line, and the data beneath it.

    `at` and `line_nm` (m,) are the law with its simultaneous band `lower_nm`, `upper_nm` (m,);
    `bin_at`, `bin_nm` and `bin_ci_nm` (k,) are means of what the twin left unexplained there,
    with half of their 95 % interval. All torques are what the law adds to the simulation.
    """

    variable: str
    at: Floats
    line_nm: Floats
    lower_nm: Floats
    upper_nm: Floats
    bin_at: Floats
    bin_nm: Floats
    bin_ci_nm: Floats


@dataclass(frozen=True)
class Finding:
    """One thing that the simulation leaves out.

    `energy_share` is the share of the refitted twin's squared residual above the noise floor that
    the effect removes on data that its fit had not seen; `holdout_rmse_without_nm` is what stays
    there when the effect alone is taken out again. `form` says which of the effect's forms won.
    """

    effect: str
    rank: int
    probability: float
    energy_share: float
    where: tuple[Region, ...]
    sentence: str
    parameters: Mapping[str, Parameter]
    alternatives: tuple[Alternative, ...] = ()
    holdout_rmse_without_nm: float = math.nan
    form: str = ""
    curve: Curve | None = None

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "effect": self.effect,
            "form": self.form,
            "rank": self.rank,
            "probability": self.probability,
            "energy_share": self.energy_share,
            "where": [region.to_json() for region in self.where],
            "sentence": self.sentence,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "alternatives": [a.to_json() for a in self.alternatives],
            "holdout_rmse_without_nm": number(self.holdout_rmse_without_nm),
        }


@dataclass(frozen=True)
class Cell:
    """One cell of the deficiency map: a base parameter that may vary along one axis.

    `gain` is the share of the residual's energy that letting it vary removes on blocks that it
    was not fitted to; `p_value` comes from shifted residuals; `counts` says whether the cell is
    significant (Benjamini-Yekutieli over all cells) and material.
    """

    parameter: str
    axis: str
    gain: float
    p_value: float
    counts: bool

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "parameter": self.parameter,
            "axis": self.axis,
            "gain": self.gain,
            "p_value": self.p_value,
            "counts": self.counts,
        }


@dataclass(frozen=True)
class Moved:
    """How a number of the twin moved when the missing physics was put in.

    `given` is the twin's own number, `refitted` the best one without the findings, `extended`
    with them; `sigmas` is the move from `refitted` to `extended` in standard deviations.
    """

    parameter: str
    given: float
    refitted: Parameter
    extended: Parameter
    sigmas: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "parameter": self.parameter,
            "given": self.given,
            "refitted": self.refitted.to_json(),
            "extended": self.extended.to_json(),
            "sigmas": number(self.sigmas),
        }


@dataclass(frozen=True)
class Holdout:
    """The proof on data that neither choice nor fit had seen.

    `source` says which data: the hold-out recordings, or folds that stand in for them.
    `placebo_percent` is the improvement that the same search reaches on axes that were shifted;
    `wins` of `blocks` were predicted better; `white` is whether what is left looks like noise.
    """

    source: str
    baseline: Fit
    refitted: Fit
    extended: Fit
    improvement_percent: float
    improvement_ci95_percent: tuple[float, float] | None
    floor_ratio: float
    wins: int
    blocks: int
    placebo_percent: float
    white: bool

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        interval = self.improvement_ci95_percent
        return {
            "source": self.source,
            "baseline": self.baseline.to_json(),
            "refitted": self.refitted.to_json(),
            "extended": self.extended.to_json(),
            "improvement_percent": number(self.improvement_percent),
            "improvement_ci95_percent": None if interval is None else list(interval),
            "floor_ratio": number(self.floor_ratio),
            "wins": self.wins,
            "blocks": self.blocks,
            "placebo_improvement_percent": number(self.placebo_percent),
            "residual_white": self.white,
        }


@dataclass(frozen=True)
class Floor:
    """The noise floor by three routes, N m rms in the band of the comparison; NaN: not there.

    `value_nm` is the one that the verdict uses.
    """

    value_nm: float
    repeats_nm: float
    neighbours_nm: float
    standstill_nm: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "value_nm": number(self.value_nm),
            "repeated_passes_nm": number(self.repeats_nm),
            "neighbours_nm": number(self.neighbours_nm),
            "standstill_nm": number(self.standstill_nm),
        }


@dataclass(frozen=True)
class NextExperiment:
    """What to run to tell hypotheses apart, the best first; `trajectory` is what `run` drives.

    `seconds` is how long it must be driven until the difference in log density is 10, and
    `sentence` says it to a technician. Without a trajectory it is a change of the set-up.
    """

    sentence: str
    tells_apart: tuple[str, ...]
    seconds: float
    gain_per_s: float
    trajectory: Mapping[str, Any] | None = None
    set_up: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "sentence": self.sentence,
            "tells_apart": list(self.tells_apart),
            "seconds": number(self.seconds),
            "gain_per_s": number(self.gain_per_s),
            "set_up": self.set_up,
            "trajectory": None if self.trajectory is None else dict(self.trajectory),
        }


@dataclass(frozen=True)
class Trace:
    """One recording before and after, arrays of shape (n,), for pictures.

    `given_nm`, `refitted_nm` and `extended_nm` are measured less predicted torque.
    """

    recording: str
    held_out: bool
    time_s: Floats
    velocity_rad_s: Floats
    measured_nm: Floats
    given_nm: Floats
    refitted_nm: Floats
    extended_nm: Floats


@dataclass(frozen=True)
class Explanation:
    """Where simulation and recordings differ, what that is, and what it is worth.

    Parameters
    ----------
    verdict : Verdict
        Contract section 6.
    sentence : str
        The whole answer for a technician.
    reasons : tuple of str
        Why there is no more to say: not decidable, columns missing, recordings left out.
    floor : Floor
    baseline, refitted, extended : Fit
        The twin as given, its own structure refitted, and with the findings.
    holdout : Holdout or None
        None where there was nothing to prove.
    findings : tuple of Finding
        By rank.
    unexplained_share : float
        Of the refitted residual's energy above the floor.
    unexplained_where : tuple of Region
    cells : tuple of Cell
        The deficiency map of the refitted twin.
    moved : tuple of Moved
    next_experiment : NextExperiment or None
    further_experiments : tuple of NextExperiment
        The menu behind it, by gain per second.
    not_judged : mapping of str to str
        Effects that these recordings cannot show, and why.
    aliases : tuple of tuple of str
        Sets of effects that these recordings cannot tell apart, whatever is found.
    twin : Twin or None
        The extended twin.
    traces : tuple of Trace
    recordings, held_out : tuple of str
        Names.
    """

    verdict: Verdict
    sentence: str
    reasons: tuple[str, ...]
    floor: Floor
    baseline: Fit
    refitted: Fit
    extended: Fit
    holdout: Holdout | None
    findings: tuple[Finding, ...]
    unexplained_share: float
    unexplained_where: tuple[Region, ...]
    cells: tuple[Cell, ...]
    moved: tuple[Moved, ...]
    next_experiment: NextExperiment | None
    recordings: tuple[str, ...]
    held_out: tuple[str, ...] = ()
    further_experiments: tuple[NextExperiment, ...] = ()
    not_judged: Mapping[str, str] = field(default_factory=dict)
    aliases: tuple[tuple[str, ...], ...] = ()
    twin: Twin | None = None
    traces: tuple[Trace, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.explanation/1` document."""
        following = self.next_experiment
        return {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "reasons": list(self.reasons),
            "recordings": list(self.recordings),
            "held_out": list(self.held_out),
            "noise_floor_nm": number(self.floor.value_nm),
            "noise_floor_routes": self.floor.to_json(),
            "baseline": self.baseline.to_json(),
            "refitted": self.refitted.to_json(),
            "extended": self.extended.to_json(),
            "holdout": None if self.holdout is None else self.holdout.to_json(),
            "findings": [finding.to_json() for finding in self.findings],
            "unexplained": {
                "energy_share": number(self.unexplained_share),
                "where": [region.to_json() for region in self.unexplained_where],
            },
            "next_experiment": None if following is None else following.to_json(),
            "further_experiments": [e.to_json() for e in self.further_experiments],
            "map": [cell.to_json() for cell in self.cells],
            "moved": [moved.to_json() for moved in self.moved],
            "not_judged": dict(self.not_judged),
            "aliases": [list(group) for group in self.aliases],
        }


def number(value: float) -> float | None:
    """Return a finite number as it is, and None for any other."""
    return float(value) if math.isfinite(value) else None


def fit_of(measured_nm: Floats, residual_nm: Floats) -> Fit:
    """Return root mean square and fit percent of a residual against what was measured."""
    if not measured_nm.size:
        return Fit()
    spread = float(np.linalg.norm(measured_nm - measured_nm.mean()))
    left = float(np.linalg.norm(residual_nm))
    percent = 100.0 * (1.0 - left / spread) if spread > 0.0 else math.nan
    return Fit(left / math.sqrt(measured_nm.size), percent)
