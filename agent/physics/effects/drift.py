"""Friction that changes with age: by the clock, from run to run, or with use."""

from __future__ import annotations

import math

import numpy as np

from agent.physics.effects.card import (
    Added,
    EffectCard,
    Floats,
    Form,
    Numbers,
    Parameter,
    amplitude,
    free,
    positive,
)
from agent.physics.effects.motion import Base, Motion
from agent.physics.friction_drift import LevelStep, LinearDrift, Odometer, RunIn

_HOUR_S = 3600.0
_CLOCK_S = 0.5  # what an instant that was written down may be rounded by
_KILOTURN_RAD = 2000.0 * math.pi
_OPERATING, _TURNS = "operating_h", "motor_1000_turns"  # what odometers count
_UNITS = {_OPERATING: "operating_h", _TURNS: "1000_turns"}


def _since_h(p: Numbers, motion: Motion) -> Floats:
    """Return hours since the reference instant, shape (n,)."""
    if motion.started_at_unix_s is None:
        raise ValueError("needs the instant at which the recording started, and none was given")
    start = motion.started_at_unix_s - p["reference_started_at"]
    return (start + motion.need("time_s")) / _HOUR_S


def _drift_by_hours(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    law = LinearDrift(p["coulomb_nm_per_h"], p["viscous_nm_s_per_rad_per_h"])
    return law.torque_nm(motion.velocity_rad_s, motion.direction, _since_h(p, motion))


def _drift_by_runs(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    if motion.run is None:
        raise ValueError("needs the number of the run, and none was given")
    law = LinearDrift(p["coulomb_nm_per_run"], p["viscous_nm_s_per_rad_per_run"])
    since = np.asarray(motion.run - p["reference_run"])
    return law.torque_nm(motion.velocity_rad_s, motion.direction, since)


def _run_in(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    numbers = {name: value for name, value in p.items() if name != "reference_started_at"}
    law = RunIn(**numbers)
    return law.torque_nm(motion.velocity_rad_s, motion.direction, _since_h(p, motion))


def _step(p: Numbers, motion: Motion, base: Base) -> Floats:
    del base
    if motion.started_at_unix_s is None:
        raise ValueError("needs the instant at which the recording started, and none was given")
    since_s = motion.started_at_unix_s - p["changed_at"] + motion.need("time_s")
    law = LevelStep(p["coulomb_step_nm"], p["viscous_step_nm_s_per_rad"])
    return law.torque_nm(motion.velocity_rad_s, motion.direction, since_s + _CLOCK_S)


def _used(p: Numbers, motion: Motion, counted: str) -> Floats:
    """Return what an odometer shows at every sample, shape (n,)."""
    started = motion.started_at_unix_s
    if started is None:
        raise ValueError("needs the instant at which the recording started, and none was given")
    known = Odometer(_listed(p, "recorded_from"), _listed(p, counted))
    since = [
        each
        for each in motion.recorded_before
        if known.recorded_from_unix_s[-1] <= each.started_at_unix_s < started
    ]
    if counted == _OPERATING:
        own = motion.need("time_s") / _HOUR_S
        added = sum(each.seconds for each in since) / _HOUR_S
    else:
        own = motion.path_rad / _KILOTURN_RAD
        added = sum(each.turned_rad for each in since) / _KILOTURN_RAD
    return np.asarray(known.at(started) + added + own)


def _listed(p: Numbers, name: str) -> tuple[float, ...]:
    return tuple(value for key, value in p.items() if key.startswith(f"{name}["))


def _drift_by_use(counted: str) -> Added:
    """Return the torque of a steady drift over one measure of use."""
    unit = _UNITS[counted]

    def torque_nm(p: Numbers, motion: Motion, base: Base) -> Floats:
        del base
        law = LinearDrift(p[f"coulomb_nm_per_{unit}"], p[f"viscous_nm_s_per_rad_per_{unit}"])
        since = _used(p, motion, counted) - p[f"reference_{unit}"]
        return law.torque_nm(motion.velocity_rad_s, motion.direction, since)

    return torque_nm


def _run_in_by_use(counted: str) -> Added:
    """Return the torque of a running-in over one measure of use."""

    def torque_nm(p: Numbers, motion: Motion, base: Base) -> Floats:
        del base
        changes = p["coulomb_change_nm"], p["viscous_change_nm_s_per_rad"]
        law = RunIn(*changes, p[f"settling_{_UNITS[counted]}"])
        return law.torque_nm(motion.velocity_rad_s, motion.direction, _used(p, motion, counted))

    return torque_nm


_REFERENCE = Parameter(
    instant=True, meaning="t0, when the twin's own numbers held: ISO 8601 with its zone"
)


def _odometer(counted: str, what: str) -> dict[str, Parameter]:
    """Return the numbers that say how much the joint had been used by when."""
    return {
        "recorded_from": Parameter(
            instant=True,
            several=True,
            meaning="when the recordings that were learnt from began, in their order, and when the"
            " last of them ended",
        ),
        counted: Parameter(
            lower=0.0, several=True, meaning=f"{what} that had been recorded by these instants"
        ),
    }


def _evenly(counted: str, what: str) -> dict[str, Parameter]:
    unit = _UNITS[counted]
    return {
        f"coulomb_nm_per_{unit}": amplitude(0.0, f"dc, per {what}"),
        f"viscous_nm_s_per_rad_per_{unit}": amplitude(0.0, f"dv, per {what}"),
        f"reference_{unit}": free(meaning="t0, the use at which the twin's own numbers held"),
    }


def _settling(counted: str) -> dict[str, Parameter]:
    return {
        "coulomb_change_nm": amplitude(0.0),
        "viscous_change_nm_s_per_rad": amplitude(0.0),
        f"settling_{_UNITS[counted]}": positive(
            meaning="th, use after which 1/e of the change is still to come"
        ),
    }


_DRIFT_FORMS = (
    Form(
        "evenly with hours",
        LinearDrift.law,
        {
            "coulomb_nm_per_h": amplitude(0.0, "dc, per hour"),
            "viscous_nm_s_per_rad_per_h": amplitude(0.0, "dv, per hour"),
            "reference_started_at": _REFERENCE,
        },
        _drift_by_hours,
    ),
    Form(
        "evenly with runs",
        LinearDrift.law,
        {
            "coulomb_nm_per_run": amplitude(0.0, "dc, per run"),
            "viscous_nm_s_per_rad_per_run": amplitude(0.0, "dv, per run"),
            "reference_run": free(meaning="t0, the run in which the twin's own numbers held"),
        },
        _drift_by_runs,
    ),
    Form(
        "settling with hours",
        RunIn.law,
        {
            "coulomb_change_nm": amplitude(0.0),
            "viscous_change_nm_s_per_rad": amplitude(0.0),
            "settling_h": positive(),
            "reference_started_at": _REFERENCE,
        },
        _run_in,
    ),
    Form(
        "another level from an instant on",
        LevelStep.law,
        {
            "coulomb_step_nm": amplitude(0.0),
            "viscous_step_nm_s_per_rad": amplitude(0.0),
            "changed_at": Parameter(
                instant=True, meaning="t0, from when on the levels are others: ISO 8601 with a zone"
            ),
        },
        _step,
    ),
    Form(
        "evenly with operating time",
        LinearDrift.law,
        _evenly(_OPERATING, "operating hour")
        | _odometer(_OPERATING, "hours of operation, standstill between moves among them,"),
        _drift_by_use(_OPERATING),
    ),
    Form(
        "evenly with the motor's turns",
        LinearDrift.law,
        _evenly(_TURNS, "1000 turns of the motor")
        | _odometer(_TURNS, "thousands of turns of the motor, to and fro,"),
        _drift_by_use(_TURNS),
    ),
    Form(
        "settling with operating time",
        RunIn.law,
        _settling(_OPERATING)
        | _odometer(_OPERATING, "hours of operation, standstill between moves among them,"),
        _run_in_by_use(_OPERATING),
    ),
    Form(
        "settling with the motor's turns",
        RunIn.law,
        _settling(_TURNS) | _odometer(_TURNS, "thousands of turns of the motor, to and fro,"),
        _run_in_by_use(_TURNS),
    ),
)

CARDS = (
    EffectCard(
        "friction-drift",
        "Friction changes from run to run, with time or use and not with temperature.",
        _DRIFT_FORMS,
        ("recording", "time_s"),
    ),
)
"""Effects of age."""
