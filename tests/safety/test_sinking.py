"""A joint that nothing holds once its torque is gone: the agent sees it go, and says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from agent.errors import StoppedError
from fakes.joint import JointParameters
from fakes.specification import FakeSpecification
from tests.system.rig import rig

FAR_FROM_HOME_RAD = 0.1
"""Of the arm. Gravity pulls with 1.2 N m there, or with 0.2 N m; dry friction holds 0.75 N m."""


@pytest.mark.parametrize(("gravity_sin_nm", "sinks"), [(12.0, True), (2.0, False)])
@pytest.mark.parametrize("lets_go", ["by itself", "when told"])
def test_a_joint_that_sinks_without_torque_is_said_to(
    tmp_path: Path, gravity_sin_nm: float, sinks: bool, lets_go: str
) -> None:
    """A drive lets go by itself after its quick stop (0x605A = 2), or stays in it (6)."""
    joint = JointParameters(gravity_sin_nm=gravity_sin_nm)
    with rig(tmp_path, specification=replace(FakeSpecification(), joint=joint)) as bench:
        drive = bench.drive

        def far(_now_s: float) -> None:
            angle_rad = abs(drive.motor_position_rad) / joint.gear_ratio
            if angle_rad > FAR_FROM_HOME_RAD and not bench.stop_reason:
                bench.stop_reason = "the operator asked for it"
                if lets_go == "when told":
                    drive.dictionary.set(0x605A, 0, 6)

        bench.clock.attach(far)
        with pytest.raises(StoppedError, match="the operator asked for it") as caught:
            bench.run()
        told = " ".join(caught.value.__notes__)
        assert ("without torque" in told) is (sinks and lets_go == "by itself")
        assert ("since its torque was taken away" in told) is (sinks and lets_go == "when told")
        assert ("NOT seen to come to rest" in told) is (sinks and lets_go == "when told")
        assert "settings were not all restored" not in told
        assert any(tmp_path.glob("*.parquet"))
