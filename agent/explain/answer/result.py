"""What an explanation says: frozen, honest, and written out as `stribeck.explanation/1`.

Pictures are drawn from the same values: the map's cells, the curve of a finding over the data,
and the traces of each recording before and after. How far predictions are off is in `fits`, what is
said of a mismatch in `located`; this module is where readers take all of it from.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from agent.explain.answer.fits import Edges, Fit, Floor, Holdout, Trace, fit_of, number
from agent.explain.answer.located import (
    Alternative,
    Cell,
    Curve,
    Finding,
    Moved,
    NextExperiment,
    PlannedRun,
    Region,
    Ringing,
    Spells,
    Varying,
)
from agent.explain.answer.small_share import weighed
from agent.physics.twin import Twin

__all__ = [
    "SCHEMA",
    "Alternative",
    "Cell",
    "Curve",
    "Edges",
    "Explanation",
    "Finding",
    "Fit",
    "Floor",
    "Holdout",
    "Moved",
    "NextExperiment",
    "PlannedRun",
    "Region",
    "Ringing",
    "Spells",
    "Trace",
    "Varying",
    "Verdict",
    "fit_of",
]

SCHEMA = "stribeck.explanation/1"

Verdict = Literal["explained", "tied", "partly-explained", "unexplained", "no-mismatch"]
NAMELESS: frozenset[Verdict] = frozenset({"unexplained", "partly-explained"})
"""Verdicts that leave something without a name."""


@dataclass(frozen=True)
class Explanation:
    """Where simulation and recordings differ, what that is, and what it is worth.

    Parameters
    ----------
    verdict : Verdict
        Contract section 6.
    sentence : str
        The whole answer for a technician.
    reasons : tuple of str
        Why there is no more to say: not decidable, columns missing, recordings left out.
    floor : Floor
    baseline, refitted, extended : Fit
        The twin as given, its own structure refitted, and with the findings.
    holdout : Holdout or None
        None where there was nothing to prove.
    findings : tuple of Finding
        By rank.
    unexplained_share : float
        Of the refitted residual's energy above the floor.
    unexplained_where : tuple of Region
    unexplained_curves : tuple of Curve
        Spectra of what swings at a frequency of its own.
    unexplained_varies : Varying or None
        The number of the twin that would have to vary, and along which axis.
    unexplained_spells : Spells or None
        When it is there, where it lies along no axis.
    unexplained_brief : bool
        Whether most of it is over within half a second.
    cells : tuple of Cell
        The deficiency map of the refitted twin.
    moved : tuple of Moved
    next_experiment : NextExperiment or None
    further_experiments : tuple of NextExperiment
        The menu behind it, by gain per second.
    not_judged : mapping of str to str
        Effects that these recordings cannot show, and why.
    aliases : tuple of tuple of str
        Sets of effects that these recordings cannot tell apart, whatever is found.
    twin : Twin or None
        The extended twin.
    traces : tuple of Trace
    recordings, held_out : tuple of str
        Names.
    band_hz : float
        Up to where torques were compared: errors, floor and shares are of that band.
    unit_off : str
        By what unit or gear the recordings differ from the simulation, or which of them seem to be
        of another axis, said before all else.
    goes_further : bool
        Whether what was held out goes beyond what the laws that were found were learnt over.
    edges : Edges or None
        What is not compared, where the simulation is far off in it.
    beside : str
        Heading of what was found beside the first finding, where that one alone is what was asked
        about; empty where all of them stand in one list.
    """

    verdict: Verdict
    sentence: str
    reasons: tuple[str, ...]
    floor: Floor
    baseline: Fit
    refitted: Fit
    extended: Fit
    holdout: Holdout | None
    findings: tuple[Finding, ...]
    unexplained_share: float
    unexplained_where: tuple[Region, ...]
    cells: tuple[Cell, ...]
    moved: tuple[Moved, ...]
    next_experiment: NextExperiment | None
    recordings: tuple[str, ...]
    held_out: tuple[str, ...] = ()
    further_experiments: tuple[NextExperiment, ...] = ()
    not_judged: Mapping[str, str] = field(default_factory=dict)
    aliases: tuple[tuple[str, ...], ...] = ()
    twin: Twin | None = None
    traces: tuple[Trace, ...] = ()
    unexplained_curves: tuple[Curve, ...] = ()
    unexplained_varies: Varying | None = None
    unexplained_spells: Spells | None = None
    unexplained_brief: bool = False
    band_hz: float = math.nan
    unit_off: str = ""
    goes_further: bool = False
    edges: Edges | None = None
    beside: str = ""

    @property
    def told(self) -> tuple[Finding, ...]:
        """Return the findings, each with a sentence that says what its small share hides."""
        return tuple(weighed(f, self.holdout, self.floor.value_nm) for f in self.findings)

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.explanation/1` document."""
        following = self.next_experiment
        return {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "reasons": list(self.reasons),
            "recordings": list(self.recordings),
            "held_out": list(self.held_out),
            "band_hz": number(self.band_hz),
            "noise_floor_nm": number(self.floor.value_nm),
            "noise_floor_routes": self.floor.to_json(),
            "baseline": self.baseline.to_json(),
            "refitted": self.refitted.to_json(),
            "extended": self.extended.to_json(),
            "holdout": None if self.holdout is None else self.holdout.to_json(),
            "findings": [finding.to_json() for finding in self.told],
            "unexplained": {
                "energy_share": number(self.unexplained_share),
                "where": [region.to_json() for region in self.unexplained_where],
            },
            "next_experiment": None if following is None else following.to_json(),
            "further_experiments": [e.to_json() for e in self.further_experiments],
            "map": [cell.to_json() for cell in self.cells],
            "moved": [moved.to_json() for moved in self.moved],
            "not_judged": dict(self.not_judged),
            "aliases": [list(group) for group in self.aliases],
        }
