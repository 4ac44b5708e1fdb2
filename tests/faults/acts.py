"""What is done to the cell from outside at the onset: the computer, the disk, the PLC, a person."""

from __future__ import annotations

import contextlib
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from agent.cycle.recorder import Recorder
from agent.cycle.stage import Step
from fakes.plc import FakeContact
from tests.system.rig import Rig

AN_HOUR_S = 3600.0


@dataclass
class Stage:
    """One run's cell, and when and for how long something happens to it."""

    bench: Rig
    onset_s: float
    lasts_s: float
    contact: FakeContact | None
    patch: pytest.MonkeyPatch = field(init=False)
    stack: contextlib.ExitStack = field(init=False)

    def at_onset(self, act: Callable[[], None]) -> None:
        """Do something once, when the cell's clock has come to the onset."""
        waiting = [act]

        def step_to(now_s: float) -> None:
            if waiting and now_s >= self.onset_s:
                waiting.pop()()

        self.bench.clock.attach(step_to)


def hang(stage: Stage) -> None:
    """Let the agent stand still while the world goes on, as SIGSTOP and SIGCONT do."""
    waiting, clock = [stage.onset_s], stage.bench.clock

    def asked_every_tick() -> str | None:
        if waiting and clock.now() >= waiting[0]:
            waiting.pop()
            stage.bench.later(stage.lasts_s)
        return stage.bench.stop_reason

    stage.bench.ask = asked_every_tick


def hang_before_sending(stage: Stage) -> None:
    """Let the agent stand still between what it has decided and the frame that says so."""
    waiting, clock, sent = [stage.onset_s], stage.bench.clock, Recorder.sent

    def slow(recorder: Recorder, now_s: float, step: Step) -> None:
        sent(recorder, now_s, step)
        if waiting and clock.now() >= waiting[0]:
            waiting.pop()
            stage.bench.later(stage.lasts_s)

    stage.patch.setattr(Recorder, "sent", slow)


def ask_to_stop(stage: Stage) -> None:
    """Press Ctrl-C."""

    def press() -> None:
        stage.bench.stop_reason = "the operator asked for it"

    stage.at_onset(press)


def set_the_wall_clock(stage: Stage) -> None:
    """Set the computer's wall clock an hour forward or back; the monotonic one goes on."""
    real, ahead = time.time, [0.0]  # noqa: TID251 - it is this clock that is set

    def step() -> None:
        ahead[0] = AN_HOUR_S if int(stage.onset_s * 1000) % 2 else -AN_HOUR_S

    stage.patch.setattr(time, "time", lambda: real() + ahead[0])
    stage.at_onset(step)


def fill_the_disk(stage: Stage) -> None:
    """Let the operating system refuse every further byte: no file may grow (RLIMIT_FSIZE)."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    stage.stack.callback(resource.setrlimit, resource.RLIMIT_FSIZE, before)
    stage.at_onset(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1])))


def open_the_release(stage: Stage) -> None:
    """Open a guard: the contact says so."""
    contact = stage.contact
    assert contact is not None
    stage.at_onset(lambda: setattr(contact, "closed", False))


def cut_the_release(stage: Stage) -> None:
    """Cut the contact's cable: it says nothing any more."""
    contact = stage.contact
    assert contact is not None
    stage.at_onset(lambda: setattr(contact, "unplugged", True))


ACTS: dict[str, Callable[[Stage], None]] = {
    "hang": hang,
    "hang before sending": hang_before_sending,
    "ask to stop": ask_to_stop,
    "set the wall clock": set_the_wall_clock,
    "fill the disk": fill_the_disk,
    "open the release": open_the_release,
    "cut the release": cut_the_release,
}
