"""A temperature over Modbus TCP that goes wrong in motion: the joint rests before it is too old."""

from __future__ import annotations

from pathlib import Path

import pytest

from agent.errors import StoppedError
from agent.record.reading import read
from fakes.modbus_server import Misbehaviour
from tests.system.test_temperature import AGE_MAX_S, IN_THE_STAIR_S, PERIOD_S, cell

REST_RAD_S = 0.5
COMES_TO_REST_S = 0.6
STATED_S = AGE_MAX_S + PERIOD_S + COMES_TO_REST_S


@pytest.mark.parametrize("kind", ["half", "reset", "exception", "wrong-device"])
def test_a_broken_answer_is_never_a_temperature_and_stops_the_joint(
    tmp_path: Path, kind: str
) -> None:
    moved_s = [0.0]
    with cell(tmp_path) as bench:
        drive = bench.rig.drive

        def look(now_s: float) -> None:
            if abs(drive.motor_velocity_rad_s) > REST_RAD_S:
                moved_s[0] = now_s

        bench.rig.clock.attach(look)
        bench.rig.at(
            IN_THE_STAIR_S, lambda: setattr(bench.server, "misbehaviour", Misbehaviour(kind))
        )
        with pytest.raises(StoppedError, match="gearbox temperature is not known") as caught:
            bench.rig.run()
        bench.rig.later(0.5)
        assert abs(drive.motor_velocity_rad_s) <= REST_RAD_S
    assert moved_s[0] - IN_THE_STAIR_S <= STATED_S
    assert "The joint is at rest (measured)." in caught.value.__notes__
    (path,) = (tmp_path / "out").glob("*.parquet")
    assert read(path)["time_s"][-1] > IN_THE_STAIR_S - 1.0
