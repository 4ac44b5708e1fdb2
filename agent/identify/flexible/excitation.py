"""Whether a minimum says anything about a resonance, and what it lacks, in plain words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from agent.identify.flexible.attenuation import rigid_noise
from agent.identify.flexible.intervals import physical
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.result import Start
from agent.identify.flexible.rivals import PLAIN, Effect, Lack, Rival
from agent.identify.flexible.spectra import PLACES
from agent.identify.uncertainty import correlation_time
from agent.numbers import significant

_FALSE_ALARMS = 1e-3  # of joints that are rigid
# Structure that no model here has makes the samples look few; what leaves a tenth of the rigid
# joint's squared residual, though, is no chance.
_RIGID = 0.1
# A spring damps the measured motion's noise, too, and so explains it: a rigid joint has to leave
# more than that noise.
_NOISE = 2.0
_STAND_IN = 50.0  # times what the model lacks must its spring explain
_SWINGING: tuple[Effect, ...] = ("mode", "stiffening", "arm-viscous", "arm-coulomb")
_ADVICE = (
    "record a triangle wave of velocity with high jerk, ten periods or more, at 250 Hz or more"
)
_SEARCHED = 5  # random starts: of fewer none need come to the right end
_SEEN = 0.9  # of the cutoff: nearer to it, the filter leaves of a resonance its flank alone


def _wanted_gain(problem: Problem, samples: float) -> float:
    """Return the log-likelihood by which a flexible joint must beat the rigid one.

    Half a log of the samples for each parameter more (Schwarz 1978), and the log of how many
    places the resonance was sought at over the false alarms allowed: the best of many places
    explains more noise than any one of them.
    """
    added = problem.shape_size + 1
    return 0.5 * added * math.log(max(samples, 2.0)) + math.log(PLACES / _FALSE_ALARMS)


def not_excited(problem: Problem, best: Point, rigid: Point, cutoff_hz: float) -> list[str]:
    """Return why the minimum says nothing about a resonance, where that is so."""
    samples = best.residual.shape[0] / correlation_time([best.residual])
    gain = 0.5 * samples * math.log(max(rigid.cost, 1e-300) / max(best.cost, 1e-300))
    chance = gain < _wanted_gain(problem, samples) and best.cost > _RIGID * rigid.cost
    if chance or rigid.cost < _NOISE * rigid_noise(problem, float(rigid.linear[0])):
        return [
            f"no resonance is excited above the noise: a rigid joint explains as much; {_ADVICE}"
        ]
    values = physical(problem, best.search, best.linear)
    seen = [v for name, v in values.items() if name.startswith("antiresonance")]
    if max(seen) > _SEEN * cutoff_hz:
        return [
            f"the resonance lies outside of what the recording shows (up to {cutoff_hz:.3g} Hz); "
            "record at a higher rate"
        ]
    if min(best.linear[0], best.linear[1]) <= 0.0:
        return [f"motor and arm cannot be told apart: one inertia comes out as zero; {_ADVICE}"]
    return []


def hardly_excited(best: Point, rigid: Point, lack: Lack) -> list[str]:
    """Return why the spring may stand for something else, where that is so.

    Where the motion hardly excites the resonance, what a second resonance or a bent spring would
    explain of the rest, or friction behind it, is not far below what the spring itself does: then
    it is the stand-in of what no model here has, such as the moment of a reversal.
    """
    swinging = max(lack.share_of(e) for e in _SWINGING)
    if rigid.cost - best.cost > _STAND_IN * swinging * best.cost:
        return []
    return [
        "no resonance is excited well enough: what the spring explains of the torque is hardly "
        f"more than what it cannot explain; {_ADVICE}"
    ]


def wrong_minimum(problem: Problem, lack: Lack) -> list[str]:
    """Return why the minimum is no joint of three masses, where what it leaves still swings."""
    modes = [r for r in lack.rivals if r.effect == "mode" and r.share > PLAIN]
    if problem.kind != "three-mass" or not modes:
        return []
    return [
        f"the search found no joint of three masses: most of what the best one leaves swings near "
        f"{_hertz(modes[0])} Hz; fit two masses, or record with higher jerk"
    ]


def lonely_minimum(problem: Problem, lack: Lack, starts: Sequence[Start]) -> list[str]:
    """Return why a minimum that only one of many starts found says nothing.

    Nearly every start finds that of two masses. Three masses are harder to find, and what leaves
    nothing but noise is theirs, however few starts found it.
    """
    searched = sum(start.origin == "random" for start in starts) >= _SEARCHED
    lonely = searched and sum(start.outcome == "best" for start in starts) == 1
    if not lonely or (problem.kind == "three-mass" and not lack.rivals):
        return []
    return [
        f"only one of {len(starts)} starts of the search ended in the lowest minimum: it may be a "
        f"local one; {_ADVICE}"
    ]


def no_third_mass(fewer: Lack) -> list[str]:
    """Return why three masses are not told, where what two of them leave shows no further one."""
    if fewer.share_of("mode") > 0.0:
        return []
    return [
        "no third mass shows: nothing that two masses leave swings beyond its noise; fit two "
        "masses, or record a triangle wave of velocity with higher jerk"
    ]


def notes_of(problem: Problem, lack: Lack) -> tuple[str, ...]:
    """Return what a minimum lacks, in plain words, each with what to do about it."""
    return tuple(_note(problem, rival) for rival in lack.rivals)


def _note(problem: Problem, rival: Rival) -> str:
    share = f"{100.0 * rival.share:.0f} % of the squared torque that is left"
    if rival.effect == "mode":
        advice = "fit three masses" if problem.kind == "two-mass" else "the joint has more masses"
        return f"one more mass that swings near {_hertz(rival)} Hz would explain {share}; {advice}"
    if rival.effect == "friction":
        return (
            f"friction that bends near {rival.at_rad_s:.2g} rad/s, which the {problem.law.name} "
            f"law does not, would explain {share}; fit the stribeck law"
        )
    if rival.effect == "filter":
        return (
            f"a filter of about {significant(1e3 / rival.at_rad_s, 1)} ms that the torque passed, "
            f"where the model has a delay, would explain {share}; intervals reach as far as it "
            "would move their number; record the torque unfiltered, or the motion through the same"
        )
    if rival.effect == "gravity":
        return f"gravity on the arm would explain {share}; fit it with gravity"
    if rival.effect in ("arm-viscous", "arm-coulomb"):
        law = "viscous" if rival.effect == "arm-viscous" else "Coulomb"
        return (
            f"{law} friction behind the spring, on the arm, would explain {share}; the model has "
            "none there, and intervals reach as far as it would move their number"
        )
    return f"a spring that stiffens with its twist would explain {share}; fit it with a cubic part"


def _hertz(rival: Rival) -> str:
    return f"{rival.at_rad_s / (2.0 * math.pi):.3g}"
