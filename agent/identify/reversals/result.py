"""What reversals tell: laws of presliding, the selected one, and the clearance; or why not."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from agent.identify.result import Floats, Parameter

SCHEMA = "stribeck.reversals/1"
LEFT_OUT = "left out, as"
"""How a note begins that tells which recordings took no part."""


@dataclass(frozen=True)
class PreslidingFit:
    """One law fitted to all reversals.

    Parameters
    ----------
    law : str
        "coulomb", "dahl", "bliman-sorine" or "lugre"; the rivals are "wind-up" and "backlash".
    selected : bool
        Whether it is the law that the reversals ask for.
    reason : str
        Why it was, or was not, selected.
    parameters : mapping of str to Parameter
        Motor side.
    rmse_nm : float
        Over the samples about all reversals.
    heldout_rmse_nm : float
        Over reversals that were left out of the fit, one after another.
    """

    law: str
    selected: bool
    reason: str
    parameters: Mapping[str, Parameter]
    rmse_nm: float
    heldout_rmse_nm: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "law": self.law,
            "selected": self.selected,
            "reason": self.reason,
            "rmse_nm": self.rmse_nm,
            "heldout_rmse_nm": self.heldout_rmse_nm,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
        }


@dataclass(frozen=True)
class Clearance:
    """What the gear takes up before the arm follows; all angles motor side.

    Parameters
    ----------
    source : str
        "arm-encoder" or "motor-side".
    backlash_rad : Parameter
        The gap, from one flank to the other.
    lost_motion_rad : Parameter
        Gap and wind-up together, as the motor turns before the arm follows.
    compliance_rad_per_nm : Parameter
        Of the gear, between motor and arm.
    encoder_skew_s : Parameter
        How much older the arm's angle is than the motor's.
    """

    source: str
    backlash_rad: Parameter
    lost_motion_rad: Parameter
    compliance_rad_per_nm: Parameter
    encoder_skew_s: Parameter

    def named(self) -> dict[str, Parameter]:
        """Return the parameters by their names."""
        return {
            "backlash_rad": self.backlash_rad,
            "lost_motion_rad": self.lost_motion_rad,
            "compliance_rad_per_nm": self.compliance_rad_per_nm,
            "encoder_skew_s": self.encoder_skew_s,
        }

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "source": self.source,
            **{name: parameter.to_json() for name, parameter in self.named().items()},
        }


@dataclass(frozen=True)
class Trace:
    """Reversals for the picture: torque over the travel since the turn.

    Parameters
    ----------
    travel_rad, torque_nm : ndarray, shape (n,)
        Away from the turn; torque less what sliding, inertia and offset explain, with the sign of
        the new direction.
    fitted_nm : ndarray, shape (n,)
        The same of the selected law.
    """

    travel_rad: Floats
    torque_nm: Floats
    fitted_nm: Floats


@dataclass(frozen=True)
class ReversalFit:
    """Everything that the reversals of one axis's recordings carry.

    `reasons` say why nothing is decidable, or, where the arm's encoder tells the clearance all the
    same, why no law is told.
    """

    recordings: tuple[str, ...]
    decidable: bool
    reasons: tuple[str, ...]
    reversals: int
    resolution_rad: float
    laws: tuple[PreslidingFit, ...]
    clearance: Clearance
    sentence: str
    notes: tuple[str, ...] = ()
    traces: tuple[Trace, ...] = field(default=(), repr=False)

    @property
    def selected(self) -> PreslidingFit | None:
        """Return the law that the reversals ask for, if any."""
        return next((fit for fit in self.laws if fit.selected), None)

    def law(self, name: str) -> PreslidingFit:
        """Return the fit of one law by its name; KeyError where it was not fitted."""
        for fit in self.laws:
            if fit.law == name:
                return fit
        raise KeyError(name)

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.reversals/1` document."""
        finest = self.resolution_rad
        return {
            "schema": SCHEMA,
            "recordings": list(self.recordings),
            "decidable": self.decidable,
            "reasons": list(self.reasons),
            "sentence": self.sentence,
            "reversals": self.reversals,
            "resolution_rad": finest if math.isfinite(finest) else None,
            "laws": [fit.to_json() for fit in self.laws],
            "clearance": self.clearance.to_json(),
            "notes": list(self.notes),
        }


def without_law(found: ReversalFit, reason: str, sentence: str) -> ReversalFit:
    """Return a result whose laws have errors and no numbers, with the reason.

    A clearance by the arm's encoder stays, for no law of the torque has a part in it, and so does
    the reason of one that is not identified anyway.
    """
    by_arm = found.clearance.source == "arm-encoder"
    unknown = Parameter.not_identified(reason)
    return replace(
        found,
        decidable=by_arm,
        reasons=(reason,),
        laws=tuple(
            replace(fit, parameters=dict.fromkeys(fit.parameters, unknown)) for fit in found.laws
        ),
        clearance=nothing(reason)
        if found.clearance.backlash_rad.identified and not by_arm
        else found.clearance,
        sentence=sentence,
        # What notes say of laws is of no law's account any more.
        notes=tuple(note for note in found.notes if note.startswith(LEFT_OUT)),
    )


def nothing(reason: str) -> Clearance:
    """Return a clearance of which nothing is known, with the reason."""
    unknown = Parameter.not_identified(reason)
    return Clearance("motor-side", unknown, unknown, unknown, unknown)
