"""Two agents as on two computers: own buses, own folders, no lock, one drive, one stepped time.

Each agent runs in a thread of its own, and one of them at a time: whoever is due next. So what
they do to each other is the same in every run. A frame takes half a millisecond, as on a bus.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from pathlib import Path

from agent.cell.cell import Cell
from agent.errors import AgentError
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import SteppedClock
from drivers.errors import DriverError

FRAME_S = 0.0005
_PATIENCE_S = 60.0


class _Turns:
    """One stepped time for several threads; whoever waits for the earliest time goes on."""

    def __init__(self, world: SteppedClock, agents: int) -> None:
        self.world = world
        self._due_s = dict.fromkeys(range(agents), world.now())
        self._turn = threading.Condition()
        self._running: int | None = None
        self._waiting: set[int] = set()

    def wait(self, agent: int, until_s: float) -> None:
        """Return when `until_s` has come and nobody else is due before."""
        with self._turn:
            self._due_s[agent] = until_s
            self._waiting.add(agent)
            self._pass_on()
            if not self._turn.wait_for(lambda: self._running == agent, _PATIENCE_S):
                raise AssertionError(f"agent {agent} never had its turn")
            self._waiting.discard(agent)

    def leave(self, agent: int) -> None:
        """Take no more part."""
        with self._turn:
            del self._due_s[agent]
            self._pass_on()

    def _pass_on(self) -> None:
        """Choose who goes on once everybody waits, and move the time to its."""
        self._running = None
        if self._due_s and self._waiting == set(self._due_s):
            agent = min(self._due_s, key=lambda one: (self._due_s[one], one))
            self.world.sleep_until(self._due_s[agent])
            self._running = agent
            self._turn.notify_all()


@dataclass
class Agent:
    """One of them: when it starts, when its process is held up, and what it ended with."""

    folder: Path
    starts_s: float
    stalls_at_s: float = math.inf
    stalls_for_s: float = 0.0
    error: AgentError | DriverError | None = None
    crash: BaseException | None = None


class TurnClock(SteppedClock):
    """The clock of one of several agents."""

    def __init__(self, turns: _Turns, number: int, agent: Agent) -> None:
        super().__init__()
        self._turns = turns
        self._number = number
        self._stall_s = (agent.stalls_at_s, agent.stalls_for_s)

    def now(self) -> float:
        return self._turns.world.now()

    def sleep_until(self, deadline_s: float) -> None:
        at_s, for_s = self._stall_s
        if max(deadline_s, self.now()) >= at_s:
            self._stall_s = (math.inf, 0.0)
            deadline_s = at_s + for_s
        self._turns.wait(self._number, max(deadline_s, self.now()))

    def settle(self) -> None:
        self.sleep_until(self.now() + FRAME_S)


def encounter(cell: Cell, world: SteppedClock, agents: list[Agent], lasts_s: float) -> None:
    """Let agents begin a cycle each; whoever is left is asked to end it after `lasts_s`.

    Raises
    ------
    BaseException
        Whatever of an agent is no error of ours.
    """
    turns = _Turns(world, len(agents))

    def live(number: int, agent: Agent) -> None:
        clock = TurnClock(turns, number, agent)
        try:
            clock.sleep_until(clock.now() + agent.starts_s)
            until_s = clock.now() + lasts_s
            drive_cycle(
                CycleRequest(cell, cell.axis[0], agent.folder),
                clock,
                stop_requested=lambda: "it is enough" if clock.now() > until_s else None,
            )
        except (AgentError, DriverError) as error:
            agent.error = error
        except BaseException as error:  # noqa: BLE001 - raised below, on the test's own thread
            agent.crash = error
        finally:
            turns.leave(number)

    threads = [
        threading.Thread(target=live, args=each, name=f"agent {each[0]}")
        for each in enumerate(agents)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for agent in agents:
        if agent.crash is not None:
            raise agent.crash
