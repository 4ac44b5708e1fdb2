"""One row that no drive can have meant refuses no recording, and widens no interval."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.identify.estimate import estimate
from agent.identify.result import Parameter
from tests.science.identify_plant import Joint, record, stair

SIGNALS = record(
    Joint(gravity_sin_nm=0.3, gear_ratio=20.0), stair((5.0, 16.0, 40.0), rate_hz=125.0)
)


def test_a_single_row_far_from_both_neighbours_is_left_out_and_told() -> None:
    """A position had been a speed that no motor has; a torque had doubled gravity's interval."""
    assert SIGNALS.position_rad is not None
    row = SIGNALS.torque_nm.shape[0] // 3
    torque, position = SIGNALS.torque_nm.copy(), SIGNALS.position_rad.copy()
    torque[row] += 30.0 * np.std(torque)
    position[row] += 2.0 * np.ptp(position)
    clean = estimate([SIGNALS]).rigid_body
    assert clean is not None
    for hit in (replace(SIGNALS, torque_nm=torque), replace(SIGNALS, position_rad=position)):
        found = estimate([hit])
        assert found.rigid_body is not None, found.reasons
        assert found.notes[0].startswith("simulated: 1 row out of line with the rows beside (at ")
        assert found.quality.masked == 1
        for name, parameter in found.rigid_body.parameters.items():
            own = clean.parameters[name]
            assert parameter.value == pytest.approx(own.value, abs=0.1 * width(own))
            assert width(parameter) == pytest.approx(width(own), rel=0.1)


def width(parameter: Parameter) -> float:
    assert parameter.ci95 is not None
    return parameter.ci95[1] - parameter.ci95[0]
