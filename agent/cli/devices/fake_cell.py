"""The cell that drives a simulated joint: the shipped example, filled in from its specification."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import tomli_w

from fakes.specification import FakeSpecification

SHORT_S = 12.0
SHORT_SPEEDS = 5


def fake_cell_text(
    specification: FakeSpecification,
    *,
    interface: str,
    channel: str,
    options: Mapping[str, str | int] | None = None,
    node_id: int = 1,
    short: bool = False,
) -> str:
    """Return a commissioned CELL.toml for the simulated drive of `specification`.

    Parameters
    ----------
    specification : FakeSpecification
        Drive and joint.
    interface, channel : str
        Where the drive listens; python-can's words.
    options : mapping, optional
        Options of the interface; multicast frames stay on this machine unless they say otherwise.
    node_id : int
        The drive's CANopen node.
    short : bool
        Whether to ask for a stair of 12 s with 5 speeds instead of the example's 40 s with 11.
    """
    example = files("agent.examples").joinpath("cell.toml").read_text(encoding="utf-8")
    cell: dict[str, Any] = tomllib.loads(example)
    cell["robot"] = "simulated-joint"
    cell["bus"] = {"interface": interface, "channel": channel}
    stays_here = {"hop_limit": 0} if interface == "udp_multicast" else {}
    cell["bus"]["options"] = {**stays_here, **(options or {})}
    axis = cell["axis"][0]
    axis["commissioned"] = True
    axis["commissioned_by"] = "nobody: the joint is simulated and can hurt no one"
    axis["gear_ratio"] = specification.joint.gear_ratio
    axis["gearbox_serial"] = "simulated"
    drive = specification.drive
    axis["drive"] |= {
        "node_id": node_id,
        "vendor_id": drive.vendor_id,
        "product_code": drive.product_code,
        "serial": drive.serial,
        "rated_torque_nm": drive.rated_torque_mnm / 1000.0,
        "encoder_counts_per_motor_rev": specification.servo.encoder_counts_per_rev,
    }
    if specification.thermal.has_sensor:
        axis["drive"]["gearbox_temperature"] = {
            "object": "0x2100:01",
            "degc_per_count": 0.1,
            "no_sensor_counts": [-32768],
        }
    if short:
        axis["stair"] |= {"duration_s": SHORT_S, "speeds": SHORT_SPEEDS}
        axis["stair"] |= {"motor_velocity_min_rad_s": 4.0, "motor_velocity_max_rad_s": 80.0}
    return tomli_w.dumps(cell)
