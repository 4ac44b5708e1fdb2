"""What some recordings carry and others do not, though none says so: found, and taken off them.

No twin can know which recordings that are. So its torque is taken off those that show it, hold-outs
among them, and everything is asked once more of what is left.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.answer.amounts import listed, torque
from agent.explain.answer.fits import Fit
from agent.explain.answer.result import NAMELESS, Explanation, Finding
from agent.explain.choosing.shares import shares_of
from agent.explain.forms.carried import CARRIED_BY_SOME, in_set
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table, TooShortError, tabulate
from agent.explain.study import Study
from agent.explain.taken_off import taken_off, told_beside
from agent.identify.result import Floats, Parameter
from agent.numbers import scale_for, significant
from agent.physics.rigid_body import GRAVITY, gravity_columns
from agent.physics.twin import Twin

_EFFECT = "gravity-imbalance"
_INERTIA = "inertia_kg_m2"
_WEIGHTLESS = 0.1  # of a weight: what lacks all of it but so much has none
_HALF = 0.5  # of what the refitted twin leaves above the noise
_SURELY = 2.0  # half intervals: which recordings they are was chosen among many sets


@dataclass(frozen=True)
class Carried:
    """What some recordings carry.

    Parameters
    ----------
    places : tuple of int
        Among the recordings to learn from.
    names : tuple of str
        Of these.
    numbers : mapping of str to Parameter
        ``gravity_sin_nm, gravity_cos_nm``, and ``inertia_kg_m2`` where it shows; motor side.
    probability, share : float
        Of the finding.
    energy_nm2 : float
        Mean square torque that it accounts for.
    without_nm : float
        What the refitted twin leaves that does not know it, rms.
    form : str
    """

    places: tuple[int, ...]
    names: tuple[str, ...]
    numbers: Mapping[str, Parameter]
    probability: float
    share: float
    energy_nm2: float
    without_nm: float
    form: str

    def is_sure(self, twin: Twin) -> bool:
        """Return whether any of its numbers is surely not nothing; its weight, where a twin weighs.

        What sets recordings apart may be anything, as a motor that was warmer in some; shared out
        among gravity and inertia it leaves none of them known. And what is carried by an arm that
        has a weight cannot have an inertia alone: that is friction of another kind, as a rule.
        """
        weighs = any(getattr(twin, name) for name in GRAVITY)
        asked = (p for name, p in self.numbers.items() if name in GRAVITY or not weighs)
        known = (p for p in asked if p.ci95 is not None)
        return any(abs(p.value) > _SURELY * _half(p) for p in known)

    def is_most_of_it(self, answer: Explanation) -> bool:
        """Return whether it is half of the mismatch, where the rest of it has no name.

        A reading that wanders has some slope along the arm's angle in any recording.
        """
        if answer.verdict not in NAMELESS:
            return True
        floor_nm2 = max(answer.floor.value_nm, 0.0) ** 2
        return answer.refitted.rmse_nm**2 - floor_nm2 < _HALF * (self.without_nm**2 - floor_nm2)

    def lacks_the_weight(self, twin: Twin) -> bool:
        """Return whether it is all of the weight of a twin's arm that these recordings lack."""
        given = np.array([getattr(twin, name) for name in GRAVITY])
        own = np.array([self.numbers[name].value for name in GRAVITY])
        heavy = float(np.linalg.norm(given))
        return bool(np.linalg.norm(own + given) < _WEIGHTLESS * heavy)

    def are_a_few_without_it(self, twin: Twin, count: int) -> bool:
        """Return whether these lack all weight, and more than half of the recordings have it."""
        return 2 * len(self.places) < count and self.lacks_the_weight(twin)

    def torque_nm(self, run: Run) -> Floats:
        """Return the torque that it asks for where a recording goes, shape (n,)."""
        signals, known = run.signals, {name: p.value for name, p in self.numbers.items()}
        if signals.position_rad is None:
            return np.zeros_like(signals.torque_nm)  # a hold-out may not say where it went
        sin, cos = gravity_columns(signals.position_rad, signals.gear_ratio).T
        out = known["gravity_sin_nm"] * sin + known["gravity_cos_nm"] * cos
        if _INERTIA in known:
            time, velocity = signals.time_s, signals.velocity_rad_s
            if velocity is None:
                velocity = np.gradient(signals.position_rad, time)
            out = out + known[_INERTIA] * np.gradient(velocity, time)
        return np.where(np.isfinite(out), out, 0.0)

    def taken_off(self, run: Run) -> Run:
        """Return a recording as it would be without it."""
        signals = run.signals
        lighter = replace(signals, torque_nm=signals.torque_nm - self.torque_nm(run))
        return replace(run, signals=lighter)

    def taken_off_all(self, runs: Sequence[Run]) -> list[Run]:
        """Return the recordings to learn from without it, those that it is not in as they are."""
        return [self.taken_off(run) if k in self.places else run for k, run in enumerate(runs)]

    def is_in(self, run: Run, found: Study) -> bool:
        """Return whether a recording leaves less beside what was found if it carries this."""
        table, base = found.table, found.model.base
        # The extended twin knows of no difference: its gravity is that of the mean recording.
        sine_nm, cosine_nm = (base[name].value for name in GRAVITY)
        known = replace(found.extended, gravity_sin_nm=sine_nm, gravity_cos_nm=cosine_nm)
        try:
            as_it_is, without = (
                tabulate(known, (each,), table.cutoff_hz, align_velocity=table.aligned)
                for each in (run, self.taken_off(run))
            )
        except (TooShortError, ValueError):
            return False
        return _left(without) < _left(as_it_is)

    def joined_by(self, more: Carried | None, count: int) -> Carried | None:
        """Return it with what is found once it is taken off; None where that is another load.

        What is asked before all else is known comes out a few percent another than beside it. The
        rest is told of the same recordings, or the other way round of all others.

        Parameters
        ----------
        more : Carried or None
        count : int
            Of the recordings to learn from.
        """
        others = tuple(k for k in range(count) if k not in self.places)
        if more is None or more.places not in (self.places, others):
            return None
        sign = 1.0 if more.places == self.places else -1.0
        numbers = {
            name: _moved(number, more.numbers[name], sign) if name in more.numbers else number
            for name, number in self.numbers.items()
        }
        return replace(self, numbers=numbers)

    def finding(self) -> Finding:
        """Return it as a finding."""
        known = {name: p.value for name, p in self.numbers.items()}
        differs = f"gravity's torque differs by {torque(math.hypot(*(known[n] for n in GRAVITY)))}"
        if _INERTIA in known:
            scale = scale_for("kg m²", (known[_INERTIA],))
            more = significant(abs(known[_INERTIA]) * scale.factor, 2)
            differs += f", the inertia by {more} {scale.unit}"
        plural = len(self.names) > 1
        who = f"The recording{'s' * plural} {listed(self.names)} carr{'y' if plural else 'ies'}"
        told = f"{who} something that the others do not: {differs}."
        return taken_off(
            _EFFECT,
            self.form,
            told,
            self.numbers,
            probability=self.probability,
            share=self.share,
            without_nm=self.without_nm,
        )


def _half(number: Parameter) -> float:
    low, high = number.ci95 or (math.nan, math.nan)
    return 0.5 * (high - low)


def _moved(number: Parameter, by: Parameter, sign: float) -> Parameter:
    """Return a number moved by another one, with the interval of what was asked last."""
    value = number.value + sign * by.value
    if by.ci95 is None:
        return replace(number, value=value)
    low, high = sorted(number.value + sign * end for end in by.ci95)
    return Parameter(value, (low, high))


def _left(table: Table) -> float:
    return float(np.mean(table.target_nm[table.sliding] ** 2)) if table.sliding.any() else math.nan


def carried_by_some(found: Study) -> Carried | None:
    """Return what some of a study's recordings carry; None where all carry the same."""
    terms, runs, floor_nm = found.choice.terms, found.table.runs, max(found.floor.value_nm, 0.0)
    at = next((i for i, t in enumerate(terms) if t.scored.form.name in CARRIED_BY_SOME), None)
    if at is None:
        return None
    form, numbers = terms[at].scored.form, found.model.parameters[at]
    places = in_set(terms[at].candidate.point, len(runs))
    share = shares_of(found.library, found.choice.candidates, floor_nm)[at]
    refitted_nm2 = float(np.mean(found.refitted_nm[found.library.weighing.rows] ** 2))
    return Carried(
        places,
        tuple(runs[k].name for k in places),
        {name: numbers[name] for name in form.linear},
        terms[at].probability,
        share,
        share * max(refitted_nm2 - floor_nm**2, 0.0),
        math.sqrt(refitted_nm2),
        form.name,
    )


def freed(
    carried: Carried, runs: Sequence[Run], holdout: Sequence[Run], found: Study
) -> tuple[list[Run], list[Run], list[str]]:
    """Return recordings without what some of them carry, and which hold-outs carried it.

    Parameters
    ----------
    carried : Carried
    runs, holdout : sequence of Run
        As recorded.
    found : Study
        That it was found in.
    """
    in_it = [carried.is_in(run, found) for run in holdout]
    unseen = [carried.taken_off(r) if is_in else r for r, is_in in zip(holdout, in_it, strict=True)]
    names = [run.name for run, is_in in zip(holdout, in_it, strict=True) if is_in]
    return carried.taken_off_all(runs), unseen, names


def weightless_said(carried: Carried) -> str:
    """Return that recordings are of another axis, as it seems."""
    one = len(carried.names) == 1
    return (
        f"The recording{'' if one else 's'} {listed(carried.names)} "
        f"show{'s' if one else ''} none of the weight that the arm has in the others: before "
        "anything else make sure of what axis that is."
    )


def beside_carried(
    answer: Explanation, carried: Carried, held_out: Sequence[str], as_given: Fit, twin: Twin
) -> Explanation:
    """Return the answer of recordings that it was taken off, with what they carry in it.

    What has none of the arm's weight is of another axis, before it lacks a load.

    Parameters
    ----------
    answer : Explanation
    carried : Carried
    held_out : sequence of str
        Hold-outs that carry it, too.
    as_given : Fit
        Of the twin as given to the recordings as they are.
    twin : Twin
        As given.
    """
    if carried.lacks_the_weight(twin):
        answer = replace(answer, unit_off=weightless_said(carried))
    everywhere = (*carried.names, *(f"{name} (held out)" for name in held_out))
    reason = (
        f"what {listed(everywhere)} carr{'ies' if len(everywhere) == 1 else 'y'} was taken off "
        "their torque before everything else was judged, and twin.toml does not hold it: with "
        "payload_kg in the recordings' metadata it is learnt, and predicted"
    )
    return told_beside(answer, carried.finding(), carried.energy_nm2, as_given, reason)
