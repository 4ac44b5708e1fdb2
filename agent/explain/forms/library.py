"""Every form of every effect, and which of them some recordings can show."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agent.explain.forms import arm as forms_arm
from agent.explain.forms import cable as forms_cable
from agent.explain.forms import carried as forms_carried
from agent.explain.forms import constant as forms_constant
from agent.explain.forms import drift as forms_drift
from agent.explain.forms import gap as forms_gap
from agent.explain.forms import inner_friction as forms_inner_friction
from agent.explain.forms import order as forms_order
from agent.explain.forms import place as forms_place
from agent.explain.forms import reversal as forms_reversal
from agent.explain.forms import ripple as forms_ripple
from agent.explain.forms import signal as forms_signal
from agent.explain.forms import speed as forms_speed
from agent.explain.forms import stiffening as forms_stiffening
from agent.explain.forms import use as forms_use
from agent.explain.forms import warmth as forms_warmth
from agent.explain.forms.balancer import BALANCERS
from agent.explain.forms.form import Form
from agent.explain.forms.seen_arm import SEEN, seen_beside
from agent.explain.forms.seen_wave import WAVE
from agent.explain.forms.zeros import zeros_of
from agent.explain.rows.table import Table
from agent.explain.rows.use import OPERATING, TURNED
from agent.identify.result import Floats
from agent.physics.effects.library import CARRIED, card_of
from agent.physics.twin import Twin

_SIMULATED_ARMS = (
    *forms_arm.FORMS,
    *forms_gap.FORMS,
    *forms_stiffening.FORMS,
    *forms_inner_friction.FORMS,
)
FORMS: tuple[Form, ...] = (
    *forms_speed.FORMS,
    *forms_warmth.FORMS,
    *forms_constant.FORMS,
    *forms_drift.FORMS,
    *forms_use.FORMS,
    *forms_ripple.FORMS,
    *forms_order.FORMS,
    *forms_place.FORMS,
    *forms_carried.FORMS,
    *forms_cable.FORMS,
    *BALANCERS,
    *forms_reversal.FORMS,
    *forms_signal.FORMS,
    *_SIMULATED_ARMS,
    *seen_beside(_SIMULATED_ARMS),
    WAVE,
)

_COLUMNS: Mapping[str, str] = {
    "gearbox_temperature_degc": "the gearbox temperature",
    "motor_temperature_degc": "the motor temperature",
    "position_rad": "the position",
    "position_arm_rad": "the arm's position",
    "velocity_command_rad_s": "the velocity command",
}
_CHANGES, _SPEEDS = "speed changes", "speeds"  # no columns: what must be driven and sampled
_AS_SPEED_CHANGES = frozenset({"torque-saturation", "kinematic-error", "resolver-error"})
_OF_SPEED = frozenset({"stribeck", "viscous-nonlinear"})
_VISCOUS = "viscous"  # in a form's name: it tells viscous from Coulomb friction
_LEAST_K = 2.0
CLOCKS = frozenset({"elapsed_s", OPERATING, TURNED})
"""Columns that go on from one recording to the next."""

_TEMPERATURES = ("gearbox_temperature_degc", "motor_temperature_degc")


def judgeable(table: Table, twin: Twin | None = None) -> tuple[tuple[Form, ...], dict[str, str]]:
    """Return the forms that a table can show, and for every other effect why not.

    A form is judged where its own columns and those that its effect's law needs are recorded: what
    a twin could not repeat is not named.

    Parameters
    ----------
    table : Table
    twin : Twin, optional
        An arm that it carries on a spring, or in a gap, cannot be carried twice.

    Returns
    -------
    forms : tuple of Form
    reasons : dict of str to str
        Effect to a sentence, ``the position was not recorded, so torque-ripple cannot be judged``.
    """
    reasons: dict[str, str] = {}
    for name in {need for form in FORMS for need in _needs(form)} - {_CHANGES, _SPEEDS}:
        why = _missing(table, name)
        if why:
            reasons[name] = why
    reasons |= _of_motion(table)
    carried = [e.id for e in twin.effects if e.id in CARRIED] if twin is not None else []
    there = set(CARRIED) if carried else set()
    forms = FORMS if table.one_zero else (*FORMS, *zeros_of(len(table.runs)))
    if table.one_load:
        forms = tuple(f for f in forms if f.name not in forms_carried.CARRIED_BY_SOME)
    shown = tuple(
        f for f in forms if f.effect not in there and not any(need in reasons for need in _needs(f))
    )
    effects = {f.effect for f in shown}
    out = {
        effect: f"the twin has it already, so a second {effect} is not looked for"
        if effect in carried
        else f"the twin's {carried[0]} carries the arm already, so {effect} is not looked for"
        for effect in sorted(there)
    }
    for form in forms:
        seen = form.name == SEEN and form.effect in out  # what its simulated forms lack is told
        warm = form.name == forms_constant.WARM and form not in shown  # the other law is no such
        if warm or (form.effect not in effects | there and not seen):
            why = next(reasons[need] for need in _needs(form) if need in reasons)
            out[form.effect] = f"{why}, so {form.effect} cannot be judged"
    return shown, out


def _needs(form: Form) -> tuple[str, ...]:
    # At held speeds what grows with the torque grows with the speed, as friction does.
    saturates = form.name == forms_constant.SATURATES
    as_changes = form.at_edges or saturates or form.effect in _AS_SPEED_CHANGES
    changes = (_CHANGES,) if as_changes else ()
    speeds = (_SPEEDS,) if form.effect in _OF_SPEED or _VISCOUS in form.name else ()
    return tuple(dict.fromkeys((*form.needs, *card_of(form.effect).needs, *changes, *speeds)))


def _of_motion(table: Table) -> dict[str, str]:
    """Return what was not driven, or not sampled fast enough, and why."""
    out = {}
    if all(piece.slow for piece in table.pieces):
        out[_CHANGES] = "the recordings are sampled too slowly to follow a change of speed"
    elif not any(piece.shows_changes for piece in table.pieces):
        out[_CHANGES] = "no change of speed was recorded"
    if not table.several_speeds:
        out[_SPEEDS] = "only one speed was driven"
    return out


def _missing(table: Table, name: str) -> str:
    """Return why a column is of no use, or nothing."""
    if name in CLOCKS:
        return "" if table.has(name) else "the recordings do not all say when they began"
    called = _COLUMNS.get(name, name)
    if not table.has(name):
        without = _runs_without(table, table.rows[name])
        if len(without) < len(table.runs):
            return f"{called} was not recorded throughout {', '.join(without)}"
        return f"{called} was not recorded"
    values = table.rows[name][table.used]
    if name in _TEMPERATURES and float(np.ptp(values)) < _LEAST_K:
        return f"{called} changed by less than {_LEAST_K:g} °C"
    return ""


def _runs_without(table: Table, values: Floats) -> list[str]:
    """Return the names of the recordings in which a column is not known throughout."""
    bad = table.used & ~np.isfinite(values)
    return [run.name for index, run in enumerate(table.runs) if bad[table.run == index].any()]
