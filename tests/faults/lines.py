"""One variation of a Modbus line that goes wrong while a controller drives: TCP, or RTU on a pty.

Where no answer arrives, no abort may arrive either: then the controller's own watchdog stops the
joint, and the agent says that it has not seen it rest.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from agent.cli.terminal.exits import exit_code
from agent.errors import AgentError
from drivers.errors import DriverError
from fakes.modbus_server import Misbehaviour
from tests.system.test_job import bench

KINDS = (
    *((kind, "tcp") for kind in ("exception", "half", "reset", "wrong-device", "swapped-words")),
    *((kind, "rtu") for kind in ("exception", "half", "garbled", "wrong-device")),
)
"""Exceptions, half replies, a reset, another unit, the wrong word order, CRC errors."""

DEAR_KINDS = (("silent", "tcp"), ("garbled", "tcp"), ("silent", "rtu"))
"""In the campaign alone: what is silent is in `tests/system/test_job.py`, too."""

SAYS = {
    "exception": "it failed while doing it (exception 4)",
    "reset": "The connection to Modbus device 1",
    "silent": "does not answer",
    "swapped-words": "The controller reports",
}
"""What the message must say of the line; of the others, that an answer is "no valid reply"."""

ALIVE_TIMEOUT_S = 0.5
STATED_S = 2.0 * ALIVE_TIMEOUT_S + 0.6
"""Our patience with a silent controller, its patience with us, and braking."""

MOVES_RAD_S, REST_RAD_S = 20.0, 0.5
ANSWERS, DEAR_ANSWERS = 25, 8
"""So many go wrong, beyond anybody's patience: each on a serial line, and each that never comes,
costs its whole time-out in real time."""

POSITION_SLACK_RAD = 0.1


@dataclass(frozen=True)
class LineRun:
    """What became of one variation.

    Parameters
    ----------
    kind, line : str
        What went wrong, on ``tcp`` or ``rtu``.
    seed : int
        Drew at which speed, and how long after that.
    code : int
        Exit code; 0 where the cycle ran to its end.
    message : str
        The error with its notes.
    rest_after_s : float
        From the first wrong answer until the motor was last seen to move; by the plant.
    troubles : tuple of str
        What else was not as it must be.
    """

    kind: str
    line: str
    seed: int
    code: int
    message: str
    rest_after_s: float
    troubles: tuple[str, ...]

    def objections(self) -> list[str]:
        """Return everything against the run; none where all was as it must be."""
        found = list(self.troubles)
        if self.code not in (4, 5):
            found.append(f"exit code {self.code}, expected 4 or 5")
        if self.rest_after_s > STATED_S:
            found.append(f"rest after {self.rest_after_s:.2f} s, stated {STATED_S:.2f} s")
        if not ("at rest (measured)" in self.message or "use the E-stop" in self.message):
            found.append("nothing said of the joint's fate")
        if SAYS.get(self.kind, "no valid reply") not in self.message:
            found.append("nothing said of the line")
        if self.code == 5 and "the controller, its network" not in self.message:
            found.append("nothing said of what to do")
        return found


def struck(kind: str, line: str, seed: int) -> LineRun:
    """Let a line go wrong while the joint moves, and see."""
    random = np.random.default_rng(seed)
    from_rad_s, delay_s = random.uniform(MOVES_RAD_S, 60.0), random.uniform(0.0, 0.8)
    is_dear = (line == "rtu" and kind != "exception") or kind == "silent"
    wrong = Misbehaviour(kind, count=DEAR_ANSWERS if is_dear else ANSWERS)
    fast_s: list[float] = []
    struck_s: list[float] = []
    moved_s, went = [0.0], [0.0]
    error: AgentError | DriverError | None = None
    with (
        tempfile.TemporaryDirectory() as name,
        bench(
            Path(name), line=line, alive_timeout_s=ALIVE_TIMEOUT_S, timeout_s=0.25, rate_hz=50.0
        ) as made,
    ):
        plant = made.fake.plant

        def look(now_s: float) -> None:
            speed = abs(plant.motor_velocity_rad_s)
            went.append(plant.motor_position_rad)
            if speed > from_rad_s and not fast_s:
                fast_s.append(now_s)
            if fast_s and now_s >= fast_s[0] + delay_s and speed > MOVES_RAD_S and not struck_s:
                struck_s.append(now_s)
                made.server.misbehaviour = wrong
            if speed > REST_RAD_S:
                moved_s[0] = now_s

        made.clock.attach(look)
        try:
            made.run()
        except (AgentError, DriverError) as ended:
            error = ended
        made.clock.sleep_until(made.clock.now() + ALIVE_TIMEOUT_S + 1.0)
        troubles = [] if made.rests() else ["the joint still moves"]
        troubles += [] if struck_s else ["the joint was never as fast as that"]
        troubles += _recording_troubles(Path(name), kind, (min(went), max(went)))
    return LineRun(
        kind=kind,
        line=line,
        seed=seed,
        code=0 if error is None else exit_code(error),
        message="" if error is None else " ".join([str(error), *getattr(error, "__notes__", [])]),
        rest_after_s=moved_s[0] - (struck_s[0] if struck_s else 0.0),
        troubles=tuple(troubles),
    )


def _recording_troubles(folder: Path, kind: str, went: tuple[float, float]) -> list[str]:
    """Return what is wrong with what was recorded until then."""
    paths = list(folder.glob("*.parquet"))
    if len(paths) != 1:
        return [f"{len(paths)} recordings, expected one"]
    recorded = pq.read_table(paths[0])  # `read` wants 100 samples; a job may end before
    if not recorded.num_rows or recorded["time_s"][-1].as_py() <= 0.5:
        return ["what came before is not in the recording"]
    position = recorded["position_rad"].to_numpy()
    off = max(went[0] - position.min(), position.max() - went[1])
    if kind == "swapped-words" or off < POSITION_SLACK_RAD:
        return []  # a plausible number in the wrong order is believed until the gate refuses one
    return [f"a recorded position is {off:.2f} rad outside of where the joint has been"]
