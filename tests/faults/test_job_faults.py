"""A job whose line goes wrong in motion, over TCP and RTU: at rest in time, and said why.

Where no answer arrives, no abort may arrive either: then the controller's own watchdog stops the
joint, and the agent says that it has not seen it rest.
"""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from agent.cli.exits import exit_code
from agent.errors import AgentError
from drivers.errors import DriverError
from fakes.modbus_server import Misbehaviour
from tests.system.test_job import bench

MOVES_RAD_S, REST_RAD_S = 20.0, 0.5
ANSWERS = 25
"""So many go wrong: beyond anybody's patience."""

UNHEARD = {"half": 8, "garbled": 8, "wrong-device": 8}
"""On a serial line each of these costs its whole time-out in real time: so many are enough."""

ALIVE_TIMEOUT_S = 0.5
STATED_S = 2.0 * ALIVE_TIMEOUT_S + 0.6
"""Our patience with a silent controller, its patience with us, and braking."""


@pytest.mark.parametrize(
    ("kind", "line"),
    [
        *(
            (kind, "tcp")
            for kind in ("exception", "half", "reset", "wrong-device", "swapped-words")
        ),
        *((kind, "rtu") for kind in ("exception", "half", "garbled", "wrong-device")),
    ],
)
def test_a_line_that_goes_wrong_in_motion_ends_at_rest(
    kind: str, line: str, tmp_path: Path
) -> None:
    """Exceptions, half replies, CRC errors, a reset, another unit, the wrong word order."""
    answers = ANSWERS if line == "tcp" else UNHEARD.get(kind, ANSWERS)
    struck_s: list[float] = []
    moved_s = [0.0]
    went: list[float] = []
    with bench(
        tmp_path, line=line, alive_timeout_s=ALIVE_TIMEOUT_S, timeout_s=0.25, rate_hz=50.0
    ) as made:
        plant = made.fake.plant

        def look(now_s: float) -> None:
            speed = abs(plant.motor_velocity_rad_s)
            went.append(plant.motor_position_rad)
            if speed > MOVES_RAD_S and not struck_s:
                struck_s.append(now_s)
                made.server.misbehaviour = Misbehaviour(kind, count=answers)
            if speed > REST_RAD_S:
                moved_s[0] = now_s

        made.clock.attach(look)
        with pytest.raises((AgentError, DriverError)) as caught:
            made.run()
        made.clock.sleep_until(made.clock.now() + ALIVE_TIMEOUT_S + 1.0)
        assert made.rests()
    assert exit_code(caught.value) in (4, 5)
    assert struck_s
    assert moved_s[0] - struck_s[0] <= STATED_S
    said = " ".join(caught.value.__notes__)
    assert "at rest (measured)" in said or "use the E-stop" in said
    (path,) = tmp_path.glob("*.parquet")
    recorded = pq.read_table(path)  # `read` wants 100 samples; a job may end before
    assert recorded["time_s"][-1].as_py() > 0.5
    if kind == "swapped-words":
        return  # a plausible number in the wrong order is believed until the gate refuses one
    position = recorded["position_rad"].to_numpy()
    assert position.min() > min(went) - 0.1
    assert position.max() < max(went) + 0.1
