"""What a twin's effects add to its plain torque, at full rate, with all that was before."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from agent.explain.rows.pieces import Piece, as_recorded, without_overshoot
from agent.explain.rows.run import Run
from agent.explain.rows.use import TURNED, recorded_use
from agent.identify.result import Floats
from agent.physics.effects.motion import Motion as Measured
from agent.physics.prediction import PLAIN_PARTS
from agent.physics.reported import limited_nm
from agent.physics.twin import Twin

_LIMIT = "torque-saturation"
_GAP = "backlash"
_LATE = "measurement-delay"
_SATURATES = "tenth_less_nm"
_OF_ALL = frozenset({_LATE, "torque-constant-error"})
"""What is done to the whole torque, inertia's and viscous friction's in it."""


_KEPT = 16  # what is asked again is asked soon
_Motion: TypeAlias = tuple[Sequence[Run], Sequence[Piece], Mapping[str, Floats]]


class Predictions:
    """What effects add to a motion, the last few of them: an answer's parts ask for the same."""

    def __init__(self) -> None:
        self._kept: list[tuple[Twin, _Motion, Floats]] = []

    def effects_nm(self, twin: Twin, *motion: *_Motion) -> Floats:
        """Return what the function of this name returns, shape (N,); to be read only."""
        for known, before, out in self._kept:
            if all(a is b for a, b in zip(before, motion, strict=True)) and known == twin:
                return out
        out = effects_nm(twin, *motion)
        out.flags.writeable = False
        self._kept = [*self._kept[1 - _KEPT :], (twin, motion, out)]
        return out


def load_nm(
    twin: Twin, runs: Sequence[Run], pieces: Sequence[Piece], full: Mapping[str, Floats]
) -> Floats | None:
    """Return what payloads add to the arm's load, shape (N,); None where the twin knows of none."""
    known = tuple(e for e in twin.effects if "reference_payload_kg" in e.parameters)
    return _added_nm(replace(twin, effects=known), runs, pieces, full) if known else None


def effects_nm(
    twin: Twin, runs: Sequence[Run], pieces: Sequence[Piece], full: Mapping[str, Floats]
) -> Floats:
    """Return what the twin's effects add to its plain torque at full rate, shape (N,).

    A torque limit is held against a prediction that does not overshoot: where the drive was at its
    limit, a ringing one is beyond it, and what is clipped off was never there. Where a recorded
    simulation stands for the twin, it is that simulation's torque that is clipped.
    """
    free = replace(twin, effects=tuple(e for e in twin.effects if e.id != _LIMIT))
    out = _added_nm(free, runs, pieces, full)
    if any(effect.id == _LATE or effect.parameters.get(_SATURATES) for effect in twin.effects):
        out += _in_full_nm(free, runs, pieces, full)
    limits = [e.parameters["limit_nm"] for e in twin.effects if e.id == _LIMIT]
    simulated_nm = full["torque_simulated_nm"]
    if limits and np.isfinite(simulated_nm).all():
        out += limited_nm(simulated_nm, min(limits)) - simulated_nm
    elif limits:
        even = without_overshoot(full, pieces)
        out += _added_nm(twin, runs, pieces, even) - _added_nm(free, runs, pieces, even)
    return out


def _in_full_nm(
    twin: Twin, runs: Sequence[Run], pieces: Sequence[Piece], full: Mapping[str, Floats]
) -> Floats:
    """Return what a delay or a constant adds to inertia and viscous friction in full, (N,).

    The smooth motion, which has passed the band's filter already and passes it again, lacks that;
    and a torque's cube is no smooth torque's.
    """
    recorded = as_recorded(full, pieces)
    if recorded["velocity_rad_s"] is full["velocity_rad_s"]:
        return np.zeros(full["time_s"].shape[0])
    of_all = replace(twin, effects=tuple(e for e in twin.effects if e.id in _OF_ALL))
    return _added_nm(of_all, runs, pieces, recorded) - _added_nm(of_all, runs, pieces, full)


def _added_nm(
    twin: Twin, runs: Sequence[Run], pieces: Sequence[Piece], full: Mapping[str, Floats]
) -> Floats:
    """Return a twin's torque less its plain one for one motion, shape (N,)."""
    out = np.zeros(full["time_s"].shape[0])
    use = recorded_use(runs, pieces, full)
    began_rad: dict[int, float] = {}
    loose = any(effect.id == _GAP for effect in twin.effects)
    driving = "velocity_driving_rad_s" if loose else "velocity_raw_rad_s"
    earlier: dict[int, Measured] = {}
    for piece in pieces:
        at = piece.full

        def column(name: str, at: slice = at) -> Floats | None:
            values = full[name][at]
            return None if np.isnan(values).any() else values

        started = runs[piece.run].started_s
        turned = full[TURNED][at]
        began_rad.setdefault(piece.run, float(turned[0]))
        motion = Measured(
            full["velocity_rad_s"][at],
            full["acceleration_rad_s2"][at],
            full["direction"][at],
            column("position_rad"),
            full["time_s"][at],
            column("gearbox_temperature_degc"),
            column("motor_temperature_degc"),
            started if math.isfinite(started) else None,
            float(piece.run),
            full[driving][at],
            turned - began_rad[piece.run],
            tuple(each for each in use if each.started_at_unix_s < started),
            runs[piece.run].payload_kg if math.isfinite(runs[piece.run].payload_kg) else None,
            earlier.get(piece.run),
            column("position_arm_rad"),
        )
        earlier[piece.run] = motion
        parts = twin.predict_parts(motion)
        plain = np.sum([parts[name] for name in PLAIN_PARTS], axis=0)
        out[at] = np.sum(list(parts.values()), axis=0) - plain
    return out
