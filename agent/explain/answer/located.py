"""What is said of a mismatch: where it lies, what it is, what it bent, and what would decide."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from agent.explain.answer.fits import number
from agent.explain.answer.said import Said
from agent.identify.result import Floats, Parameter


@dataclass(frozen=True)
class Region:
    """Where along one axis of the recordings a mismatch lives.

    `variable` is a word of contract section 6; `seconds` is how much of the recordings lies there
    and `share` which part of the mismatch's energy. `everywhere` says that next to all of the
    recordings lies there.
    """

    variable: str
    lower: float
    upper: float
    seconds: float = math.nan
    share: float = math.nan
    everywhere: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        out: dict[str, Any] = {"variable": self.variable, "from": self.lower, "to": self.upper}
        for name in ("seconds", "share"):
            value = getattr(self, name)
            if math.isfinite(value):
                out[name] = value
        return out


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
class Varying:
    """A number of the twin that carries a mismatch without a name, if it varies along an axis.

    `number` is one of the deficiency map's, `variable` its axis and `share` which part of the
    mismatch it carries so. `more` (m,) is by how much the number differs at `at` (m,) from what it
    usually is, in its own unit (the load and the whole torque: in units of themselves), and `half`
    (m,) half of the 95 % interval. `regions` is where it clearly differs, the strongest first, and
    `amounts` by how much on average.
    """

    number: str
    variable: str
    share: float
    at: Floats
    more: Floats
    half: Floats
    regions: tuple[Region, ...]
    amounts: tuple[float, ...]


@dataclass(frozen=True)
class Spells:
    """When a mismatch is there that follows nothing that was recorded.

    `at` has recording, begin and end, s, of each spell, the strongest first; `share` is of the
    energy above the noise that they hold, `seconds` how long they last together and `whole_s` how
    long all of it.
    """

    at: tuple[tuple[str, float, float], ...]
    share: float
    seconds: float
    whole_s: float


@dataclass(frozen=True)
class Curve:
    """A finding over the axis on which it lives: the law's line, and the data beneath it.

    `at` and `line_nm` (m,) are the law with its simultaneous band `lower_nm`, `upper_nm` (m,);
    `bin_at`, `bin_nm` and `bin_ci_nm` (k,) are means of what the twin left unexplained there,
    with half of their 95 % interval. All torques are what the law adds to the simulation.
    `given_nm` (m,) is what the simulation itself has there, where the law stands in its place.
    """

    variable: str
    at: Floats
    line_nm: Floats
    lower_nm: Floats
    upper_nm: Floats
    bin_at: Floats
    bin_nm: Floats
    bin_ci_nm: Floats
    given_nm: Floats | None = None


@dataclass(frozen=True)
class Ringing:
    """How much the motor rings about the instants at which the load on the gear changes sides.

    `at_s` (k,) is the time since then, `rms_rad_s` (k,) the root mean square over `instants` of the
    velocity above the compared band, from `lower_rad_s` to `upper_rad_s` (k,) with 95 %, and
    `usual_rad_s` that of all motion. Above it the gear's loose teeth are heard to meet: `louder` is
    the energy shortly after over that around it, `sigmas` its logarithm over its standard
    error.
    """

    at_s: Floats
    rms_rad_s: Floats
    lower_rad_s: Floats
    upper_rad_s: Floats
    usual_rad_s: float
    instants: int
    louder: float
    sigmas: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {"instants": self.instants, "louder": self.louder, "sigmas": self.sigmas}


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
class Finding:
    """One thing that the simulation leaves out.

    `energy_share` is the share of the refitted twin's squared residual above the noise floor that
    would not be there if the joint had all effects but this one, on data that no fit had seen;
    where effects resemble each other, shares need not sum to one. `holdout_rmse_without_nm` is what
    stays there when the effect alone is taken out again. `form` says which of the effect's forms
    won; `ringing` is there where the effect is heard above the compared band.
    """

    effect: str
    rank: int
    probability: float
    energy_share: float
    where: tuple[Region, ...]
    said: Said
    parameters: Mapping[str, Parameter]
    alternatives: tuple[Alternative, ...] = ()
    holdout_rmse_without_nm: float = math.nan
    form: str = ""
    curve: Curve | None = None
    ringing: Ringing | None = None

    @property
    def sentence(self) -> str:
        """Return all that is said of it."""
        return self.said.whole

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        heard = {} if self.ringing is None else {"heard": self.ringing.to_json()}
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
            **heard,
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

    @classmethod
    def between(
        cls, parameter: str, given: float, refitted: Parameter, extended: Parameter
    ) -> Moved:
        """Return the move of a number; without a deviation where an interval is missing."""
        sigmas = math.nan
        if extended.ci95 is not None and refitted.ci95 is not None:
            spread = (extended.ci95[1] - extended.ci95[0]) / 3.92
            sigmas = abs(extended.value - refitted.value) / spread if spread > 0.0 else math.nan
        return cls(parameter, given, refitted, extended, sigmas)

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
class PlannedRun:
    """How the joint is to be found when a trajectory is driven.

    Parameters
    ----------
    times : int
        How often it is driven.
    warmth : float
        Gearbox and motor temperature: 0 as the recordings began, 1 as they ended.
    load : float
        Gravity's torque, in units of the recordings' own.
    """

    times: int
    warmth: float = 1.0
    load: float = 1.0


@dataclass(frozen=True)
class NextExperiment:
    """What to run to tell hypotheses apart, the best first; `trajectory` is what `run` drives.

    `seconds` is how long it must be driven until the difference in log density is 10, `runs` how
    often and how warm or loaded, and `sentence` says it to a technician. Without a trajectory it is
    a change of the set-up.
    """

    sentence: str
    tells_apart: tuple[str, ...]
    seconds: float
    gain_per_s: float
    trajectory: Mapping[str, Any] | None = None
    set_up: str = ""
    runs: tuple[PlannedRun, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "sentence": self.sentence,
            "tells_apart": list(self.tells_apart),
            "seconds": number(self.seconds),
            "gain_per_s": number(self.gain_per_s),
            "set_up": self.set_up,
            "runs": [asdict(run) for run in self.runs],
            "trajectory": None if self.trajectory is None else dict(self.trajectory),
        }
