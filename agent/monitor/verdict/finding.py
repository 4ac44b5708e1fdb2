"""What is made of one joint's history, and what is said of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from agent.identify.result import Parameter
from agent.monitor.baseline.baseline import Baseline
from agent.monitor.change.change_time import ChangeTime
from agent.monitor.change.outlook import Outlook
from agent.monitor.compensation.compensation import Compensated
from agent.monitor.detection.cusum import DECIDING
from agent.monitor.detection.series import FeatureSeries, Judgement, State
from agent.monitor.history.history import JointHistory, Segment
from agent.monitor.schedule.cooling import Warmth
from agent.monitor.verdict.comparison import Comparison
from agent.monitor.verdict.reasons import Reasons
from agent.monitor.verdict.since_first import SinceFirst
from agent.monitor.verdict.words import afterwards, as_sentence, began, day, lent

NOT_DECIDABLE = "not-decidable"


@dataclass(frozen=True)
class Track:
    """One stretch between two events, and what was made of it.

    `promise` says what the detector can find after this baseline, and how often it is wrong, where
    it says so itself. `found` and `series` are None where the baseline is too short; so is
    `judgement`, and also where the detector says that it cannot judge. `begun` is how the first
    cycles after an event compare with the healthy ones before it, at equal conditions; None without
    an event or a baseline before it.
    """

    segment: Segment
    baseline: Baseline
    found: Mapping[str, Compensated] | None = None
    promise: str = ""
    series: FeatureSeries | None = None
    judgement: Judgement | None = None
    begun: Comparison | None = None

    @property
    def rising(self) -> bool:
        """Return whether the alarm is that of friction which rises from the first cycle on."""
        marks = None if self.judgement is None else self.judgement.rising
        return marks is not None and bool(marks[-1])


@dataclass(frozen=True)
class Finding:
    """What is said of one joint.

    Parameters
    ----------
    history : JointHistory
    detector : str
    tracks : tuple of Track
        One for each stretch, in order of time; empty without a usable cycle.
    status : str
        ``NF``, ``H0`` or ``H1`` at the last cycle, or ``not-decidable``.
    sentence : str
        For a technician.
    comparison : Comparison or None
        Now against the first cycles; None where there is no cycle after them.
    compared_with : int
        How many of the first cycles that are: those of the baseline, unless friction rises from
        the first cycle on.
    reasons : Reasons or None
        Of an alarm.
    change : ChangeTime or None
        Of an alarm.
    outlook : Outlook or None
        Of an alarm.
    next_steps : tuple of str
    warmth : Warmth or None
        Whether the last cycle was run warm or cold; None where nothing was compared.
    since_first : SinceFirst or None
        Of an alarm of friction that rises from the first cycle on.
    fallen : Parameter or None
        By what share low-speed friction fell over the baseline's cycles, where it did.
    """

    history: JointHistory
    detector: str
    tracks: tuple[Track, ...]
    status: str
    sentence: str
    comparison: Comparison | None = None
    compared_with: int = 0
    reasons: Reasons | None = None
    change: ChangeTime | None = None
    outlook: Outlook | None = None
    next_steps: tuple[str, ...] = ()
    warmth: Warmth | None = None
    since_first: SinceFirst | None = None
    fallen: Parameter | None = None

    @property
    def alarm(self) -> bool:
        """Return whether friction is increased now."""
        return self.status in (State.INCREASED.value, State.HIGH.value)

    @property
    def lent(self) -> str:
        """Return what joints of the same kind are to this one, a sentence; empty without any."""
        siblings, last = self.history.siblings, self.current
        if siblings is None or last is None:
            return ""
        law = last.baseline.laws.get(DECIDING)
        return lent(siblings, last.baseline.cycles, None if law is None else law.lent)

    @property
    def timing(self) -> tuple[str, ...]:
        """Return when the change began and what is ahead, a sentence each; empty without alarm."""
        out = []
        if self.since_first is not None and self.change is not None:
            out.append(began(self.since_first, self._day_of))
        elif self.change is not None and self.change.decidable and self.current is not None:
            low, high = (self._day_of(t) for t in self.change.time_ci95_s)
            shape, share = max(self.change.shapes.items(), key=lambda s: s[1])
            how = f"as a {shape} ({100.0 * share:.0f} %)"
            out.append(f"The change began between {low} and {high} (95 %), {how}.")
        elif self.change is not None:
            out.append(as_sentence(self.change.sentence))
        return (*out, *([as_sentence(self.outlook.sentence)] if self.outlook is not None else []))

    def began_anew(self, track: Track) -> str:
        """Return when and why a stretch began, and what its events changed; empty without any."""
        if not track.segment.events:
            return ""
        started_s = self.history.cycles[track.segment.start].started_s
        events = "; ".join(event.label for event in track.segment.events)
        changed = "" if track.begun is None else f"; {afterwards(track.begun)}"
        return f"The baseline began anew on {day(started_s)}: {events}{changed}."

    def _day_of(self, time_s: float) -> str:
        """Return the date of a time since the current stretch's first cycle."""
        assert self.current is not None
        return day(self.history.cycles[self.current.segment.start].started_s + time_s)

    @property
    def current(self) -> Track | None:
        """Return the last stretch."""
        return self.tracks[-1] if self.tracks else None
