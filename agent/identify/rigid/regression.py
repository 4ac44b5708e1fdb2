"""The rigid body of an axis: which cutoff, which rows, and the fit (thesis 4.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from agent.identify.objections import jumps
from agent.identify.result import Parameter, RigidBodyFit
from agent.identify.rigid.body import fit_rigid_body
from agent.identify.rigid.fading import whole_from_rad_s
from agent.identify.rigid.rows import Rows, collect_rows
from agent.identify.sentence import LOW_PASSED
from agent.identify.signals.preprocess import Motion, filter_motion, shared_cutoff

_HALVINGS = 2
_FIRM_INERTIA = 0.03
_SAME_INERTIA = 0.01
_FELT = 0.5  # of half an interval: by less friction may move without a word
_FRICTION = ("coulomb_nm", "viscous_nm_s_per_rad")
_LATE_S = 1e-3  # less is half a sample's, or a step's, and is not worth a note
_BETWEEN_SAMPLES = "the speed changes between one sample and the next; record at 100 Hz or faster"
_POOR_FIT_PERCENT = 85.0  # less is more than what noise and a spring usually leave


@dataclass(frozen=True)
class Regression:
    """The rigid body's fit, the rows and the cutoff that it was made with.

    `reaches_over` are further rows, over whose fit the intervals reach, too; None where there are
    none.
    """

    cutoff_hz: float
    rows: Rows
    body: RigidBodyFit | None
    notes: tuple[str, ...]
    reaches_over: Rows | None = None


def regress(motions: Sequence[Motion], asked_hz: float | None) -> Regression:
    """Fit the rigid body; below an arm's resonance, if the inertia shows that there is one.

    A flexible arm seems heavier the closer the motion comes to its resonance. Without a cutoff
    asked for, the rigid fit is repeated at half the cutoff; while a well-determined inertia
    differs by more than 1 %, the lower cutoff is taken, at most twice. What is left of the spring
    there, to the first order, may then take part in the fit.

    Parameters
    ----------
    motions : sequence of Motion
        All recordings of the axis.
    asked_hz : float or None
        A cutoff that is asked for; it is taken as it is.
    """
    cutoff = shared_cutoff(motions)
    share = cutoff.noise_share if asked_hz is None else 0.0
    chosen_hz = cutoff.frequency_hz if asked_hz is None else asked_hz
    halvings = _HALVINGS if asked_hz is None else 0
    rows = rows_of(motions, chosen_hz, share)
    speed = whole_from_rad_s(rows, chosen_hz)
    fitted = _below_resonance(motions, rows, chosen_hz, share, halvings)
    notes: list[str] = []
    if speed > 0.0:
        rows = rows_of(motions, chosen_hz, share, speed)
        faster = _below_resonance(motions, rows, chosen_hz, share, halvings, speed)
        fitted, notes = _where_friction_is_whole(fitted, faster, speed)
    chosen_hz, rows, body = fitted.cutoff_hz, fitted.rows, fitted.body
    if body is not None and body.fit_percent < _POOR_FIT_PERCENT:
        notes.append(
            f"the rigid body explains only {body.fit_percent:.0f} % of the torque: its numbers may "
            "be further off than their intervals say; `stribeck explain` looks for what is missing"
        )
    if fitted.halved or (body is not None and body.spring_took_part):
        notes.append(_of_elasticity(chosen_hz))
    if body is not None and abs(body.torque_late_s) > _LATE_S:
        notes.append(_of_lateness(body.torque_late_s))
    notes.append(f"{LOW_PASSED} {chosen_hz:.3g} Hz")
    return Regression(chosen_hz, rows, body, tuple(notes), fitted.reaches_over)


@dataclass(frozen=True)
class _Fitted:
    """A fit, its rows and cutoff, whether that was halved, and over whose fit it reaches, too."""

    cutoff_hz: float
    rows: Rows
    body: RigidBodyFit | None
    halved: bool
    reaches_over: Rows | None = None


def _below_resonance(
    motions: Sequence[Motion],
    rows: Rows,
    cutoff_hz: float,
    noise_share: float,
    halvings: int,
    slowest_rad_s: float = 0.0,
) -> _Fitted:
    """Fit the rigid body to rows, or to those of half the cutoff where its inertia differs."""
    rigid, halved = fit_rigid_body(rows, spring=False), False
    for _ in range(halvings):
        lower_rows = rows_of(motions, cutoff_hz / 2.0, noise_share, slowest_rad_s)
        lower = fit_rigid_body(lower_rows, spring=False)
        if rigid is None or lower is None or not _resonance_between(lower, rigid):
            break
        cutoff_hz, rows, rigid, halved = cutoff_hz / 2.0, lower_rows, lower, True
    return _Fitted(cutoff_hz, rows, fit_rigid_body(rows), halved)


def _where_friction_is_whole(
    plain: _Fitted, faster: _Fitted, speed_rad_s: float
) -> tuple[_Fitted, list[str]]:
    """Return the fit without the slow rows where they had bent friction, and what is to be said.

    Where they had bent it by less than its interval, that reaches over both fits. Rests in which a
    joint creeps also make the inertia change with frequency, as a spring does.
    """
    body, fit = plain.body, faster.body
    if body is None:
        return plain, []
    below = f"below {speed_rad_s:.2g} rad/s friction has not built up fully"
    if fit is None or not all(fit.parameters[name].identified for name in _FRICTION):
        return plain, [
            f"{below}, and too few samples are faster: Coulomb and viscous friction may be off"
        ]
    moved = max(_moved(body.parameters[name], fit.parameters[name]) for name in _FRICTION)
    if moved > 1.0 or (plain.halved and not faster.halved):
        why = "the joint creeps before it slips, or a simulator smooths the sign"
        return faster, [f"{below} ({why}): slower samples took no part in the rigid body's fit"]
    if moved <= _FELT:
        return plain, []
    same = faster.rows if faster.cutoff_hz == plain.cutoff_hz else None
    return replace(plain, body=over_both(body, fit), reaches_over=same), []


def _moved(slow: Parameter, fast: Parameter) -> float:
    """Return how far a number moves, in halves of its interval; 0 where it has none."""
    if slow.ci95 is None:
        return 0.0
    return abs(fast.value - slow.value) / ((slow.ci95[1] - slow.ci95[0]) / 2.0)


def over_both(body: RigidBodyFit, other: RigidBodyFit) -> RigidBodyFit:
    """Return a fit whose intervals reach over those of another one, too."""
    parameters = dict(body.parameters)
    for name, own in body.parameters.items():
        further = other.parameters[name].ci95
        if own.ci95 is not None and further is not None:
            ends = min(own.ci95[0], further[0]), max(own.ci95[1], further[1])
            parameters[name] = replace(own, ci95=ends)
    return replace(body, parameters=parameters)


def _of_elasticity(cutoff_hz: float) -> str:
    # Of the spring the first term takes part at most, and above the cutoff nothing was asked.
    return f"the arm is elastic: the inertia holds for slow motion only, below {cutoff_hz:.2g} Hz"


def _of_lateness(late_s: float) -> str:
    late, early = ("torque", "motion") if late_s > 0.0 else ("motion", "torque")
    return (
        f"the drive reports {late} {1e3 * abs(late_s):.2g} ms later than {early}; "
        "this was corrected"
    )


def _resonance_between(lower: RigidBodyFit, upper: RigidBodyFit) -> bool:
    """Whether a well-determined inertia differs between a lower and a higher cutoff.

    Below a resonance a rigid body explains more. Where it explains less, as a joint sticks or
    creeps between two moves and the longer filter carries that into them, no spring is the cause.
    """
    if lower.fit_percent < upper.fit_percent:
        return False
    slow, fast = lower.parameters["inertia_kg_m2"], upper.parameters["inertia_kg_m2"]
    if slow.ci95 is None or fast.ci95 is None or slow.value <= 0.0:
        return False
    margin = (slow.ci95[1] - slow.ci95[0]) / 2.0
    difference = abs(fast.value - slow.value)
    return margin < _FIRM_INERTIA * slow.value and difference > max(
        _SAME_INERTIA * slow.value, margin
    )


def rows_of(
    motions: Sequence[Motion],
    cutoff_hz: float,
    noise_share: float = 0.0,
    slowest_rad_s: float = 0.0,
) -> Rows:
    """Filter all recordings of an axis and collect their usable rows.

    Parameters
    ----------
    motions : sequence of Motion
        From `read_motion`.
    cutoff_hz : float
        Of the low-pass.
    noise_share : float
        Measuring noise in the filtered acceleration, as a share of its root mean square.
    slowest_rad_s : float
        What is slower is no row.
    """
    stretches = [s for m in motions for s in filter_motion(m, cutoff_hz, slowest_rad_s)]
    ends = [
        (float(q.min()), float(q.max()))
        for m in motions
        if m.signals.position_rad is not None
        for q in [m.signals.position_rad[m.signals.valid] / m.signals.gear_ratio]
    ]
    # Gravity needs the position of every row; one recording without it takes the columns away.
    complete = len(ends) == len(motions)
    stroke = max(e[1] for e in ends) - min(e[0] for e in ends) if complete else float("nan")
    slow = any(jumps(motion) for motion in motions)
    return collect_rows(stretches, stroke, noise_share, _BETWEEN_SAMPLES if slow else "")
