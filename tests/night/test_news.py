"""What of an event is told: changes, sparse reminders, and nothing of what was acknowledged."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field
from typing import Any

from agent.night.attempt import Outcome
from agent.night.description import Webhook
from agent.night.news import REMIND_DAYS, WORSE_PERCENT, judged
from agent.night.telling import subject, tell
from agent.record.events_file import Event
from tests.night.simulated import Watch, described


def alarm(percent: float, state: str = "H0") -> Outcome:
    effect = {"percent": percent, "from": percent - 2.0, "to": percent + 2.0}
    facts = {"said": "increased", "low": effect, "high": {**effect, "percent": 1.0}}
    return Outcome(
        "alarm",
        f"Friction has increased: +{percent} %.",
        "ab" * 32,
        {"state": state, "facts": facts},
    )


@dataclass
class Mailbox:
    """A sink that keeps what it was told."""

    every: bool = False
    name: str = "mailbox"
    tries: int = 1
    told: list[Event] = field(default_factory=list)

    def wants(self, event: Event) -> bool:
        return event.kind in Webhook(kind="webhook", url="http://x").tell

    def deliver(self, event: Event) -> None:
        self.told.append(event)


def nights(
    outcomes: dict[int, Outcome], acknowledged: int | None = None
) -> tuple[Mailbox, Mailbox]:
    """Run the nights of June with these outcomes; return who is told of news, and of everything."""
    watch = Watch.over(described(), "2026-06-01T12:00:00")
    watch.cell.faults = {(1, f"2026-06-{day:02}"): o for day, o in outcomes.items()}
    news, everything = Mailbox(), Mailbox(every=True)
    events: list[Event] = []

    def note(event: Event) -> None:
        if (
            acknowledged
            and event.kind == "begun"
            and event.details["night"].endswith(f"{acknowledged:02}")
        ):
            seen = Event(event.at, "acknowledged", "Looked at.", "r", 1, by="toni")
            events.append(seen)
        event = judged(event, events)
        events.append(event)
        tell(event, [news, everything], lambda _s: None)

    watch.events = _Noting(note)
    watch.run("2026-07-01T12:00:00")
    return news, everything


class _Noting(list[Event]):
    def __init__(self, note: Any) -> None:
        super().__init__()
        self._note = note

    def append(self, event: Event) -> None:
        super().append(event)
        self._note(event)


def told_on(box: Mailbox) -> list[tuple[str, str]]:
    return [(e.details["night"][-2:], str(e.details.get("told", ""))) for e in box.told]


def test_an_alarm_that_stays_is_told_once_and_then_every_week() -> None:
    news, everything = nights({day: alarm(20.0) for day in range(3, 23)})
    assert told_on(news) == [
        ("03", "new"),
        ("10", "reminder"),
        ("17", "reminder"),
        ("23", "cleared"),
    ]
    assert [subject(e) for e in news.told] == [
        "r axis 1: ALARM",
        "r axis 1: ALARM (reminder)",
        "r axis 1: ALARM (reminder)",
        "r axis 1: done, alarm ended",
    ]
    assert len(everything.told) == 21
    assert REMIND_DAYS == 7.0


def test_an_acknowledged_alarm_is_silent_until_it_gets_worse_and_then_again() -> None:
    size = dict.fromkeys(range(3, 28), 20.0) | dict.fromkeys(range(20, 28), 20.0 + WORSE_PERCENT)
    news, _ = nights({day: alarm(p) for day, p in size.items()}, acknowledged=5)
    assert told_on(news) == [
        ("03", "new"),
        ("20", "worse"),
        ("27", "reminder"),
        ("28", "cleared"),
    ]
    higher = {day: alarm(20.0, "H1" if day > 9 else "H0") for day in range(3, 15)}
    news, _ = nights(higher, acknowledged=5)
    assert told_on(news) == [("03", "new"), ("10", "worse"), ("15", "cleared")]


def test_slow_growth_is_told_step_by_step_not_each_night() -> None:
    news, _ = nights({day: alarm(20.0 + day) for day in range(3, 19)}, acknowledged=4)
    assert told_on(news) == [
        ("03", "new"),
        ("08", "worse"),
        ("13", "worse"),
        ("18", "worse"),
        ("19", "cleared"),
    ]


def test_an_alarm_that_comes_back_is_new_and_a_stop_is_never_old_news() -> None:
    stopped = Outcome("stopped", "The joint was stopped.")
    faults = {3: alarm(20.0), 5: alarm(20.0), 8: stopped, 9: stopped}
    news, _ = nights(faults)
    assert told_on(news) == [
        ("03", "new"),
        ("04", "cleared"),
        ("05", "new"),
        ("06", "cleared"),
        ("08", ""),
        ("09", ""),
    ]


def test_the_same_refusal_each_night_is_told_weekly_another_one_at_once() -> None:
    faults = {day: Outcome("skip", f"Refused: {40 - day} MB free.") for day in range(2, 20)}
    faults[12] = Outcome("skip", "Refused: the guard is open.")
    news, _ = nights(faults)
    assert told_on(news) == [("02", "new"), ("09", "reminder"), ("12", "new"), ("13", "new")]


def test_times_that_are_none_and_events_of_others_disturb_nothing() -> None:
    odd = Event("no time", "alarm", "x", "r", 1, details={"facts": {"low": 3}})
    other = Event("2026-06-01T00:00:00Z", "alarm", "x", "r", 2)
    now = Event(
        datetime.datetime(2026, 6, 2, tzinfo=datetime.UTC).isoformat(), "alarm", "x", "r", 1
    )
    assert judged(now, [other]).details["told"] == "new"
    assert judged(now, [odd]).details["told"] == "reminder"
