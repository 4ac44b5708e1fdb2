"""The owner's side of the reader process: started, emptied, watched, let go.

Nothing of it outlives the owner. The reader holds nothing that has a name: its memory is anonymous,
its socket is inherited. When the owner is killed the kernel closes the lifeline, and the reader
ends; a reader that somebody has stopped (SIGSTOP) cannot see that, and is killed by the kernel,
which it has asked for that (prctl(2), PR_SET_PDEATHSIG). That makes one condition: the thread that
opens the bus must live for as long as the bus, because the kernel takes its end for the owner's.

The reader is alone in its process group, so that a Ctrl-C in the terminal does not reach it: the
joint is brought to rest first.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import drivers
from drivers.can.failures import working_failed
from drivers.can.moment import BothClocks
from drivers.can_reader.batches import prepare
from drivers.can_reader.ring import CAPACITY, SLOT_BYTES, FrameRing, Moment, Word, drops_in
from drivers.clock import Clock
from drivers.errors import BusError, BusOverflowError, WorkerDiedError

BUFFER_BYTES = 8 << 20
"""Of the socket: 2.4 s of a full 1 Mbit/s bus, for a reader that does not get the processor."""

HUNG_S = 0.25
"""So long without a sign of life, over `_HUNG_CHECKS` checks, and the reader hangs.

It gives one every 10 ms. The checks make sure that the owner ran meanwhile: a machine that stood
still as a whole did not lose its reader.
"""

_HUNG_CHECKS = 10
_LIVES_S = 0.01
"""A sign of life that is no older will do: a busy bus has one in 5 ms, a tick looks each 2 ms."""

_START_S = 20.0
_START_POLL_S = 0.002
_END_S = 1.0
_WRAP = 1 << 32


Piece = Callable[[memoryview, float, float, float], None]
"""Is handed a piece of the ring where it lies, to be read by `drivers.can_reader.ring.SLOT`; by how
much the wall clock, with which the kernel stamps, is ahead of the injected one; and the times on
the injected clock before which nothing of the piece came, and after which nothing did."""


class ReaderProcess:
    """A process that moves frames from a socket into shared memory; make it with `start`."""

    def __init__(
        self,
        process: subprocess.Popen[bytes],
        ring: FrameRing,
        lifeline: int,
        clock: Clock,
        name: str,
    ) -> None:
        self.process = process
        self.buffer_bytes = 0
        self.dropped = 0
        self._ring = ring
        self._lifeline = lifeline
        self._clock = clock
        self._clocks = BothClocks(clock)
        self._name = name
        self._heard_s = clock.now()
        self._sign_s = 0.0
        self._checks_since = 0
        self._closed = False

    @classmethod
    def start(
        cls, receiver: socket.socket, clock: Clock, name: str, capacity: int = CAPACITY
    ) -> ReaderProcess:
        """Start reading `receiver`; from now on nobody else may receive from it.

        Parameters
        ----------
        receiver : socket.socket
            Bound; datagrams of the size of a `struct can_frame`. It may go on sending.
        clock : Clock
            The machine's monotonic one: two processes share no other.
        name : str
            What messages call the bus.
        capacity : int
            Slots of the ring, a multiple of `drivers.can_reader.batches.RENEW`.

        Raises
        ------
        BusError
            When the process does not start.
        """
        buffer_bytes = prepare(receiver, BUFFER_BYTES)
        ring, memory = FrameRing.make(capacity)
        held, lifeline = os.pipe()
        inherited = (receiver.fileno(), memory, held)
        try:
            process = subprocess.Popen(
                [
                    *(sys.executable, "-P", "-m", "drivers.can_reader.reader"),
                    *(str(number) for number in (*inherited, capacity)),
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env=_environment(),
                pass_fds=inherited,
                process_group=0,
            )
        except OSError as error:
            os.close(lifeline)
            ring.close()
            raise BusError(
                f"The process that reads {name} cannot be started: {error}.",
                "Free some memory, or set fast_reader = false for this bus.",
            ) from error
        finally:
            os.close(held)
            os.close(memory)
        reader = cls(process, ring, lifeline, clock, name)
        reader.buffer_bytes = buffer_bytes
        try:
            reader._await_ready()
        except BaseException:
            reader.close()
            raise
        return reader

    @property
    def heard_until_s(self) -> float:
        """Return until when everything that came is in the ring, or was taken, in seconds."""
        return self._ring.moment_s(Moment.HEARD_UNTIL)

    def hand_over(self, to: Piece) -> None:
        """Hand over every frame that has come in, oldest first, each once; never waits.

        Frames are handed over in one piece, or two around the ring's end, and none when nothing
        came. Nothing of a piece may be kept: afterwards the reader writes there again.
        """
        heard_s = self.heard_until_s  # before the ring is read: what came earlier is in it
        pieces = self._ring.waiting()
        oldest_s, self._heard_s = self._heard_s, heard_s
        if not pieces:
            return
        now_s, wall_s = self._clocks.read()
        try:
            for piece in pieces:
                to(piece, wall_s - now_s, oldest_s, now_s)
        finally:
            self._note_drops(pieces[-1])
            self._ring.give_back(sum(len(piece) for piece in pieces) // SLOT_BYTES)

    def _note_drops(self, slots: memoryview) -> None:
        """Keep how many frames the kernel had dropped when the newest of these came."""
        counter = drops_in(slots)
        if counter:  # the kernel says nothing as long as nothing was dropped
            self.dropped += (counter - self.dropped) % _WRAP

    @property
    def has_ended(self) -> bool:
        """Return whether there is no such process any more."""
        return self.process.poll() is not None

    def check(self) -> None:
        """Raise what has gone wrong with the reader, if anything has.

        Who has given a sign of life since the last check, or in the last 10 ms, lived then: its end
        is told by the first check after that.

        Raises
        ------
        WorkerDiedError
            It has ended, or gives no sign of life.
        BusOverflowError
            The ring was full: frames were not taken away for seconds.
        """
        if self._closed:
            return
        self._look_for_life()
        if self._ring.word(Word.FULL):
            raise BusOverflowError(
                f"The frames of {self._name} were not taken away for so long that more than "
                f"{self._ring.capacity} waited.",
                "Relieve the computer, then start again.",
            )

    def close(self, *, at_once: bool = False) -> None:
        """End the process, by force if it must be `at_once`, and let go of its memory.

        May be repeated.
        """
        if self._closed:
            return
        self._closed = True
        if at_once:
            self.process.kill()
        os.close(self._lifeline)
        try:
            self.process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()  # a stopped process takes no other hint
            self.process.wait()
        if self.process.stderr is not None:
            self.process.stderr.close()
        self._ring.close()

    def _await_ready(self) -> None:
        deadline_s = self._clock.now() + _START_S
        while not self._ring.word(Word.READY):
            if self.process.poll() is not None:
                raise self._death()
            now_s = self._clock.now()
            if now_s >= deadline_s:
                raise BusError(
                    f"The process that reads {self._name} was not ready after {_START_S:g} s.",
                    "Relieve the computer, or set fast_reader = false for this bus.",
                )
            self._clock.sleep_until(now_s + _START_POLL_S)
        self._heard_s = self.heard_until_s

    def _look_for_life(self) -> None:
        sign_s = self._ring.moment_s(Moment.ALIVE)
        if sign_s != self._sign_s:
            self._sign_s, self._checks_since = sign_s, 0
            return  # not even the time is asked for, which is a system call on some machines
        silent_s = self._clock.now() - sign_s
        if silent_s < _LIVES_S:
            return  # without asking the kernel, which costs as much as routing twenty frames
        if self.has_ended:
            raise self._death()
        self._checks_since += 1
        if self._checks_since <= _HUNG_CHECKS:
            return
        if silent_s > HUNG_S:
            raise WorkerDiedError(
                f"The process that reads {self._name} has given no sign of life for "
                f"{silent_s:.2f} s.",
                "Has somebody stopped it? Relieve the computer, then start again.",
            )

    def _death(self) -> WorkerDiedError:
        """Return why the process has ended, in its own words where it left any."""
        code = self._ring.word(Word.ERRNO)
        if code:
            failure = working_failed(OSError(code, os.strerror(code)), self._name, "receiving")
            return WorkerDiedError(failure.what, failure.do)
        said = b"" if self.process.stderr is None else self.process.stderr.read()
        last = said.decode(errors="replace").strip().rpartition("\n")[2]
        return WorkerDiedError(
            f"The process that reads {self._name} has ended (exit code {self.process.poll()})"
            f"{': ' + last if last else ''}.",
            "Check the computer's memory and who may have ended it, then start again.",
        )


def _environment() -> dict[str, str]:
    """Return our environment, in which the child finds this package wherever we found it."""
    found = str(Path(drivers.__file__).resolve().parents[1])
    others = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([found, others] if others else [found])}
