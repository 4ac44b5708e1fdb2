"""Who is told of a night's events, and `stribeck notify`, which tries all of them."""

from __future__ import annotations

from pathlib import Path

import typer

from agent.cli.night.asked import Asked, asked_for
from agent.cli.terminal.exits import BAD_NEWS
from agent.cli.terminal.talk import talker
from agent.errors import InputError
from agent.night.clock import MachineClock, stamp
from agent.night.description import Email, Mqtt, Webhook, secret
from agent.night.mail import MailSink
from agent.night.mqtt import VERDICTS, MqttSink
from agent.night.telling import Delivery, Sink, tell
from agent.night.webhook import WebhookSink
from agent.record.events_file import Event, read_events
from drivers.clock import MonotonicClock


def sinks_of(asked: Asked) -> tuple[Sink, ...]:
    """Return everybody whom a cell's night tells, with their secrets.

    Raises
    ------
    agent.errors.InputError
        A secret is named and not there, or would go over an open line.
    """
    return tuple(_sink(asked, described) for described in asked.description.notify)


def _sink(asked: Asked, described: Webhook | Email | Mqtt) -> Sink:
    folder, clock = asked.night_file.parent, MachineClock()
    if isinstance(described, Webhook):
        key = secret("The webhook's secret", described.secret_env, described.secret_file, folder)
        return WebhookSink(described, key, lambda: clock.now().timestamp())
    password = secret(
        f"The password for {described.host}",
        described.password_env,
        described.password_file,
        folder,
    )
    if isinstance(described, Email):
        return MailSink(described, password, folder)
    return MqttSink(
        described,
        asked.cell.robot,
        password,
        folder,
        asked.folder / f".sparkplug-{described.host}-{described.port}.json",
        clock.now,
        lambda axis: _last_verdict(asked, axis),
    )


def _last_verdict(asked: Asked, axis: int) -> Event | None:
    events = [event for _, event in read_events(asked.folder)[0]]
    own = [e for e in events if e.robot == asked.cell.robot and e.axis == axis]
    return next((e for e in reversed(own) if e.kind in VERDICTS), None)


def told(event: Event, sinks: tuple[Sink, ...], *, everybody: bool = False) -> tuple[Delivery, ...]:
    """Tell an event, waiting for real between tries."""
    clock = MonotonicClock()
    return tell(event, sinks, lambda s: clock.sleep_until(clock.now() + s), everybody=everybody)


def run_notify(cell_path: Path, night_file: Path | None) -> None:
    """Send a test message to everybody; exit 1 where one does not get it.

    Raises
    ------
    agent.errors.InputError
        Nobody would be told.
    """
    asked = asked_for(cell_path, night_file)
    sinks = sinks_of(asked)
    if not sinks:
        raise InputError(f"{asked.night_file} tells nobody.", "`stribeck night example` shows how.")
    text = "This is a test message; nothing has happened."
    event = Event(stamp(MachineClock().now()), "test", text, asked.cell.robot, by="notify")
    deliveries = told(event, sinks, everybody=True)
    for delivery in deliveries:
        typer.echo(delivery.sentence)
    failed = [d for d in deliveries if not d.arrived]
    talker().print(f"{len(deliveries) - len(failed)} of {len(deliveries)} were told.")
    if failed:
        raise typer.Exit(BAD_NEWS)
