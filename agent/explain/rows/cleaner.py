"""The velocity taken from the position, where that is far the quieter of the two.

A velocity that was reported with noise narrows the band: differentiated and multiplied by the
inertia, its noise prevails over the torque's from a few hertz on, and what rings or knocks above
that is lost. A fine encoder beside it tells the same motion with a fraction of that noise. Where it
is as much as the torque's in the band, it is what the comparison ends at; and a well damped spring,
which follows a noisy motion less, predicts better than the rigid joint that there is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.answer.amounts import percent
from agent.explain.rows.full_rate import band_of, choose_band, shaken_by_noise
from agent.explain.rows.lag import lag_of
from agent.explain.rows.run import Run
from agent.identify.signals.preprocess import Motion, read_motion

_WIDER = 1.4  # the band: less is not worth a motion that the drive did not report
_LOUDER = 1.25  # what noise there is in the band: less is not worth one, either
_MUCH_WIDER = 2.0  # where stamps were off: what is left of that is in the position


def by_the_quieter(
    runs: Sequence[Run], inertia_kg_m2: float, *, stamped: bool = False
) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return the runs without a velocity that narrows the band, and what is to be said of it.

    Parameters
    ----------
    runs : sequence of Run
        All that are compared with each other: they share one band.
    inertia_kg_m2 : float
        Of the simulation.
    stamped : bool
        Whether stamps were off, and were put right.
    """
    if not runs or not all(_has_both(run) for run in runs):
        return tuple(runs), ()
    derived = tuple(replace(run, signals=replace(run.signals, velocity_rad_s=None)) for run in runs)
    reported, by_position = (
        [read_motion(run.signals) for run in every] for every in (runs, derived)
    )
    band_hz, wider_hz = (_band_hz(motions, inertia_kg_m2) for motions in (reported, by_position))
    is_wider = wider_hz >= (_MUCH_WIDER if stamped else _WIDER) * band_hz
    noise, quieter = (
        shaken_by_noise(motions, inertia_kg_m2, band_hz) for motions in (reported, by_position)
    )
    is_quieter = noise >= _LOUDER * quieter and not stamped
    if not (is_wider or is_quieter) or not _in_step(reported, band_hz):
        return tuple(runs), ()
    what_for = (
        f"is compared up to {wider_hz:.2g} Hz instead of {band_hz:.2g}"
        if is_wider
        else f"its noise adds {percent(quieter - 1.0)} to the torque's instead of "
        f"{percent(noise - 1.0)}"
    )
    return derived, (
        "the velocity was reported with more noise than the position has: the motion was taken "
        f"from the position, and {what_for}",
    )


def _band_hz(motions: Sequence[Motion], inertia_kg_m2: float) -> float:
    """Return the band of the recording that is sampled fastest."""
    chosen_hz = choose_band(motions, inertia_kg_m2)
    bands = (band_of(s, chosen_hz) for motion in motions for s in motion.timing.stretches)
    return max(bands, default=chosen_hz)


def _has_both(run: Run) -> bool:
    return run.signals.velocity_rad_s is not None and run.signals.position_rad is not None


def _in_step(motions: Sequence[Motion], band_hz: float) -> bool:
    """Return whether the velocity is no later than is usual: more is for an explanation to name.

    By most of the stretches: where hardly anything accelerates, noise makes a lag.
    """
    usual = []
    for motion in motions:
        position = motion.signals.position_rad
        assert position is not None
        for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
            own_hz = band_of(stretch, band_hz)
            if velocity.shape[0] * stretch.period_s * own_hz < 1.0:
                continue  # shorter than the filter's memory
            on_grid = stretch.on_grid(motion.signals, position)
            usual.append(lag_of(velocity, on_grid, stretch.period_s, own_hz).part_of_sample)
    return 2 * sum(usual) > len(usual)
