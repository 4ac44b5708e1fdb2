"""The night itself: stepped, not threaded. At each step it says when it wants the next one.

An axis is tried once in a window. What was missed (the computer was off, the clock jumped, the
attempt before took too long) is said and never caught up. Nothing here clears a fault.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from agent.night.attempt import ENDED, Attempts, Outcome
from agent.night.clock import WallClock, stamp
from agent.night.description import AxisNight, NightDescription
from agent.night.warmth import Reading, judge_warmth
from agent.night.windows import Window, windows_between
from agent.record.events_file import Event
from trajectories import lasting

_AHEAD = datetime.timedelta(days=8)
_MARGIN = datetime.timedelta(minutes=2)  # whoever waits for the last moment must not miss it
_LONGEST_MEMORY = datetime.timedelta(days=400)
WATCHED = "night"
"""The kind of the first event of a cell's nights: before it nothing was missed."""


class Night:
    """The nights of one cell.

    Parameters
    ----------
    robot : str
        For the events.
    description : NightDescription
    attempts : Attempts
        What reaches the cell.
    clock : WallClock
        The only time there is.
    note : callable
        Records an event and tells it to whoever is to know; must not raise.
    history : iterable of Event
        Earlier events of this robot: what was tried already is not tried again.
    """

    def __init__(
        self,
        robot: str,
        description: NightDescription,
        attempts: Attempts,
        clock: WallClock,
        note: Callable[[Event], None],
        history: Iterable[Event] = (),
    ) -> None:
        self._robot = robot
        self._description = description
        self._attempts = attempts
        self._clock = clock
        self._note = note
        self._ended: set[tuple[int, str]] = set()
        self._readings: dict[tuple[int, str], list[Reading]] = {}
        self._look_at: dict[tuple[int, str], datetime.datetime] = {}
        self._forecast: set[tuple[int, str]] = set()  # whose waiting has an expected end
        self._seen_until = self._remember(list(history))

    # -- the loop ----------------------------------------------------------------------------

    def run(self, stopped: Callable[[], bool], until: datetime.datetime | None = None) -> None:
        """Watch over the nights until somebody asks to stop, or until a time."""
        while not stopped():
            next_look = self.step(stopped)
            if until is not None and next_look >= until:
                self._clock.wait_until(until, stopped)
                return
            self._clock.wait_until(next_look, stopped)

    def tonight(self, stopped: Callable[[], bool]) -> None:
        """Do what the windows that are open now ask for, and return: a timer has begun this."""
        while not stopped():
            next_look = self.step(stopped)
            now = self._clock.now()
            if not any(w.begins <= now < w.ends for w in self._windows(now)):
                return
            self._clock.wait_until(next_look, stopped)

    def step(self, stopped: Callable[[], bool] = lambda: False) -> datetime.datetime:
        """Do what is due now; return when to look again."""
        self._note_missed(self._clock.now())
        for window in self._windows(self._clock.now()):
            now = self._clock.now()
            due = self._look_at.get(window.key, window.begins)
            if stopped():
                break
            if window.begins <= now < window.ends and now >= due:
                self._look_after(window, now)
        now = self._clock.now()
        self._note_missed(now)
        looks = [self._look_at.get(w.key, w.begins) for w in self._windows(now)]
        return max(now, min(looks, default=now + _AHEAD))

    def next_windows(self) -> tuple[Window, ...]:
        """Return the windows that are still to come or open, the first first."""
        return tuple(self._windows(self._clock.now()))

    # -- one window --------------------------------------------------------------------------

    def _look_after(self, window: Window, now: datetime.datetime) -> None:
        """Wait, skip or try."""
        axis = self._axis(window.axis)
        latest = window.ends - self._attempts.needs(window.axis)
        if now > latest:
            left, needed = (_lasting(window.ends - moment) for moment in (now, latest))
            short = f"{left} are left of the window, a cycle needs {needed}"
            return self._end(window, Outcome("skip", f"Skipped, nothing has moved: {short}."))
        blocked = self._attempts.blocked(window.axis)
        if blocked:
            sentence = f"Skipped, nothing has moved: {blocked}."
            return self._end(window, Outcome("skip", sentence))
        readings = self._readings.setdefault(window.key, [])
        if axis.temperature_degc is not None:
            degc = self._attempts.temperature(window.axis)
            readings += [] if degc is None else [Reading(now, degc)]
        warmth = judge_warmth(axis, readings, now, latest - _MARGIN)
        if not warmth.go:
            first = window.key not in self._look_at
            if first or (warmth.forecast and window.key not in self._forecast):
                self._tell(window, "wait", f"{_capital(warmth.sentence)}.", {})
            self._look_at[window.key] = warmth.look_at
            self._forecast |= {window.key} if warmth.forecast else set()
            return None
        self._tell(window, "begun", "The attempt of this night has begun.", {})
        outcome = self._attempts.attempt(window)
        details: dict[str, Any] = {}
        if warmth.difference_k is not None:
            details["difference_at_start_k"] = round(warmth.difference_k, 2)
        if warmth.sentence:
            details["temperature"] = warmth.sentence
        return self._end(window, outcome, details)

    def _end(
        self, window: Window, outcome: Outcome, details: Mapping[str, Any] | None = None
    ) -> None:
        """Record what became of the window; it is over for this axis."""
        self._forget(window.key)
        more = {**(details or {}), **outcome.details}
        self._tell(window, outcome.kind, outcome.sentence, more, outcome.recording)

    def _forget(self, key: tuple[int, str]) -> None:
        self._ended.add(key)
        self._readings.pop(key, None)
        self._look_at.pop(key, None)

    def _tell(
        self,
        window: Window,
        kind: str,
        sentence: str,
        details: Mapping[str, Any],
        recording: str = "",
    ) -> None:
        self._note(
            Event(
                at=stamp(self._clock.now()),
                kind=kind,
                text=sentence,
                robot=self._robot,
                axis=window.axis,
                recording=recording,
                by="night",
                details={"night": window.night.isoformat(), **details},
            )
        )

    # -- what was missed ---------------------------------------------------------------------

    def _note_missed(self, now: datetime.datetime) -> None:
        """Say which windows have ended without an attempt since the last look; never catch up."""
        for axis in self._description.axis:
            passed = [
                w
                for w in windows_between(axis, self._description.zone, self._seen_until, now)
                if w.ends <= now and w.key not in self._ended
            ]
            for window in passed:
                self._forget(window.key)
            if not passed:
                continue
            last = passed[-1]
            nights = [w.night.isoformat() for w in passed]
            sentence = f"Missed, and not caught up: the window of {_nights(nights)} has passed"
            if last.ends <= last.begins:
                sentence += "; the change of the clock left nothing of it"
            self._tell(last, "missed", f"{sentence}.", {"nights": nights})
        self._seen_until = max(self._seen_until, now)

    def _remember(self, history: list[Event]) -> datetime.datetime:
        """Take earlier nights in; return until when they were watched."""
        now = self._clock.now()
        mine = [e for e in history if e.robot == self._robot and e.by == "night"]
        if not mine:
            text = "The nights of this cell are watched from now on."
            self._note(Event(stamp(now), WATCHED, text, self._robot, by="night"))
            return now
        begun: dict[tuple[int, str], Event] = {}
        for event in mine:
            if event.axis is None:
                continue
            nights = event.details.get("nights") or [event.details.get("night", "")]
            keys = [(event.axis, str(night)) for night in nights]
            if event.kind in ENDED:
                self._ended.update(keys)
            elif event.kind == "begun":
                begun.update(dict.fromkeys(keys, event))
        for key, event in begun.items():
            if key not in self._ended:
                self._cut_off(key, event)
        last = max(datetime.datetime.fromisoformat(e.at) for e in mine)
        return max(min(last, now), now - _LONGEST_MEMORY)

    def _cut_off(self, key: tuple[int, str], begun: Event) -> None:
        """Say that an attempt has no end: the program or the computer ended meanwhile."""
        self._ended.add(key)
        text = (
            "The program ended during the attempt of this night; it is not tried again. "
            "`stribeck recover` finishes what was recorded."
        )
        details = {"night": key[1], "begun_at": begun.at}
        now = stamp(self._clock.now())
        self._note(Event(now, "stopped", text, self._robot, key[0], by="night", details=details))

    # -- what there is -----------------------------------------------------------------------

    def _windows(self, now: datetime.datetime) -> list[Window]:
        """Return windows that are open or to come and not over for their axis, the first first."""
        found = [
            window
            for axis in self._description.axis
            for window in windows_between(axis, self._description.zone, now, now + _AHEAD)
            if window.key not in self._ended and window.ends > window.begins
        ]
        return sorted(found, key=lambda w: w.begins)  # stable: axes of one time as they are listed

    def _axis(self, number: int) -> AxisNight:
        return next(a for a in self._description.axis if a.number == number)


def _nights(nights: list[str]) -> str:
    return nights[0] if len(nights) == 1 else f"{len(nights)} nights ({nights[0]} to {nights[-1]})"


def _lasting(span: datetime.timedelta) -> str:
    return lasting(max(span.total_seconds(), 0.0))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
