"""How large an effect must be to stand so far out of the noise: tried until it does."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fakes.conceal.compared import compared, low_passed
from fakes.conceal.concealment import Basis, Concealment, UnreachableError
from fakes.conceal.design import Run
from fakes.conceal.measure import Floats, Noise, Seen, commands, recorded_torque, see
from fakes.conceal.refit import Booleans, Motion, Refit, refit, sliding
from fakes.conceal.robot import Robot
from fakes.conceal.truth import Truth

_EDGE_ELEMENTS = 4.0  # a Maxwell chain has slipped after four times its distance, end to end
_TRIES = 24
_REMEMBERED = 8  # of 6 MB each
_CLOSE = 0.01


@dataclass(frozen=True)
class Rehearsal:
    """The training runs of one robot, ready to be driven again with another truth.

    Parameters
    ----------
    robot : Robot
        The joint.
    runs, command, noise : tuples
        The runs, their set-points, and the chances of each.
    counted : tuple of bool arrays
        Samples that count: sliding, as the joint without anything concealed slides.
    knows_gravity : bool
        Whether the structure has gravity columns.
    floor_nm : float
        Root mean square of the torque noise over the samples that count, rounding included.
    """

    robot: Robot
    runs: tuple[Run, ...]
    command: tuple[Floats, ...]
    noise: tuple[Noise, ...]
    counted: tuple[Booleans, ...]
    knows_gravity: bool
    floor_nm: float
    _seen: dict[Truth, list[Seen]] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def of(cls, robot: Robot, runs: Sequence[Run], noise: Sequence[Noise]) -> Rehearsal:
        """Drive the joint as it is, to learn which samples count and what their noise is."""
        truth = robot.truth
        command = tuple(commands(run) for run in runs)
        seen = [see(truth, robot, run, c) for run, c in zip(runs, command, strict=True)]
        edge = _EDGE_ELEMENTS * truth.presliding_rad
        counted = tuple(sliding(s.velocity_rad_s, s.position_rad, edge) for s in seen)
        errors = [
            (recorded_torque(s, robot.sensing, n) - s.torque_nm)[m]
            for s, n, m in zip(seen, noise, counted, strict=True)
        ]
        floor = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
        gravity = truth.gravity_sin_nm != 0.0 or truth.gravity_cos_nm != 0.0
        return cls(robot, tuple(runs), command, tuple(noise), counted, gravity, floor)

    def see(self, truth: Truth) -> list[Seen]:
        """Return every run as the drive sees it with this truth; the last few are remembered."""
        if truth not in self._seen:
            while len(self._seen) >= _REMEMBERED:
                self._seen.pop(next(iter(self._seen)))
            pairs = zip(self.runs, self.command, strict=True)
            self._seen[truth] = [see(truth, self.robot, run, c) for run, c in pairs]
        return self._seen[truth]

    def fit(self, seen: Sequence[Seen], basis: Basis = "refitted") -> Refit:
        """Return what the structure leaves of noise-free runs."""
        motions = [s.motion for s in seen]
        if basis == "commanded":
            motions = [_commanded(run, s) for run, s in zip(self.runs, seen, strict=True)]
        numbers = known_numbers(self.robot.truth) if basis == "as-given" else None
        gear = self.robot.truth.gear_ratio
        return refit(motions, self.counted, gear, gravity=self.knows_gravity, numbers=numbers)

    def banded(
        self, truth: Truth, rows_of: Truth, cutoff_hz: float, basis: Basis = "refitted"
    ) -> Refit:
        """Return what the structure leaves in a band, counted where another truth is compared.

        As a comparison of torques sees it; see `fakes.conceal.compared`.
        """
        gear, period_s = self.robot.truth.gear_ratio, 1.0 / self.robot.sensing.sample_rate_hz
        return refit(
            [s.motion for s in self.see(truth)],
            compared(self.see(rows_of), gear, period_s, cutoff_hz),
            gear,
            gravity=self.knows_gravity,
            numbers=known_numbers(self.robot.truth) if basis == "as-given" else None,
            through=lambda signals: low_passed(signals, period_s, cutoff_hz),
        )

    def excess_nm(self, truth: Truth, reference: Refit, basis: Basis) -> float:
        """Return what the truth leaves beyond the reference, as a root mean square.

        ``sqrt(rms(with)^2 - rms(without)^2)``, both after the fit, both without noise; NaN where
        the joint did not survive.
        """
        with np.errstate(all="ignore"):  # an unstable joint is found below, by what it leaves
            seen = self.see(truth)
            if not all(np.isfinite(s.torque_nm).all() for s in seen):
                return math.nan
            rms = self.fit(seen, basis).rms_nm
        if not math.isfinite(rms) or rms > 100.0 * self.robot.truth.dry_nm:
            return math.nan
        return math.sqrt(max(rms**2 - reference.rms_nm**2, 0.0))


def known_numbers(truth: Truth) -> dict[str, float]:
    """Return the structure's numbers of a joint without anything concealed."""
    return {
        "coulomb_nm": truth.dry_nm,
        "viscous_nm_s_per_rad": truth.viscous_nm_s_per_rad,
        "inertia_kg_m2": truth.inertia_kg_m2,
        "gravity_sin_nm": truth.gravity_sin_nm,
        "gravity_cos_nm": truth.gravity_cos_nm,
    }


def _commanded(run: Run, seen: Seen) -> Motion:
    points = run.trajectory.sample(seen.time_s)
    return Motion(
        points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2, seen.torque_nm
    )


def amplitude_for(
    rehearsal: Rehearsal, concealment: Concealment, reference: Truth, snr: float
) -> tuple[float, float]:
    """Return the amplitude at which an effect's excess is `snr` floors, and the SNR reached.

    Raises
    ------
    UnreachableError
        A joint would have to be beyond what is plausible, or does not survive.
    """
    before = rehearsal.fit(rehearsal.see(reference), concealment.basis)
    target = snr * rehearsal.floor_nm

    def excess(amplitude: float) -> float:
        truth = concealment.put(reference, amplitude)
        return rehearsal.excess_nm(truth, before, concealment.basis)

    found = _solve(excess, target, concealment.first, concealment.most)
    if found is None:
        raise UnreachableError(
            f"{concealment.effect}: SNR {snr:g} is not reached by {concealment.most:g} "
            f"({concealment.form})"
        )
    amplitude, reached = found
    return amplitude, reached / rehearsal.floor_nm


def _solve(
    excess: Callable[[float], float], target: float, first: float, most: float
) -> tuple[float, float] | None:
    """Return an amplitude up to `most` whose excess is the target within a percent, and it.

    Secant steps in logarithms, kept within a bracket and replaced by its geometric middle where
    they leave it. A joint that does not survive an amplitude counts as one beyond the target.
    """
    low, high = 0.0, math.inf
    amplitude, power = min(first, most), 1.0
    last: tuple[float, float] | None = None
    for number in range(_TRIES):
        value = excess(amplitude)
        if abs(value - target) <= _CLOSE * target:
            return amplitude, value
        if value < target:
            low = amplitude
            if amplitude >= most:
                return None
        else:
            high = amplitude
        if not math.isfinite(value):
            amplitude = 0.5 * amplitude if low == 0.0 else math.sqrt(low * high)
            continue
        if last is not None and value > 0.0 and last[1] > 0.0 and amplitude != last[0]:
            slope = math.log(value / last[1]) / math.log(amplitude / last[0])
            power = min(max(slope, 0.3), 4.0)
        last = amplitude, value
        step = (target / value) ** (1.0 / power) if value > 0.0 else 8.0
        guess = amplitude * min(max(step, 0.05), 8.0)
        closing = number % 3 == 2 and low > 0.0 and high < math.inf  # where a secant creeps
        if closing or not low < guess < high:
            guess = math.sqrt(low * high) if low > 0.0 and high < math.inf else 0.5 * (low + high)
        amplitude = min(guess, most)
    return None
