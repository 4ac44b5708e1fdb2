"""Every precondition has a name in one list, blocks with its own reason, and shows in a dry run."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from typer.testing import CliRunner

from agent.cell.cell import Cell, parse_cell
from agent.cli.app import app
from agent.cli.cycle.dry_run_text import judged_in_words
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.axis_lock import lock_names, owned
from agent.cycle.plan import plan_cycle
from agent.cycle.preconditions import Judged, preconditions
from agent.cycle.preflight import (
    Condition,
    at_standstill,
    before_the_bus,
    insist,
    watchdog_proven,
)
from agent.errors import RefusedError
from drivers.ports import DriveState, Sample, WatchdogProof
from fakes.specification import FakeSpecification


def description() -> dict[str, Any]:
    return tomllib.loads(
        fake_cell_text(FakeSpecification(), interface="virtual", channel="nobody", short=True)
    )


def cell_of(data: dict[str, Any]) -> Cell:
    return parse_cell(tomli_w.dumps(data))


def before(cell: Cell, folder: Path) -> tuple[Condition, ...]:
    return before_the_bus(cell, cell.axis[0], plan_cycle(cell, cell.axis[0]), folder)


def sample(**changes: Any) -> Sample:
    return Sample(0.0, 0.0, 0.0, 0.0, 0.0, 25.0, DriveState.OFF, False)._replace(**changes)


PROOF = WatchdogProof(True, 0.15, 0.149, 0.151, "switch on disabled", ("0x8130",), "start")


def test_the_list_names_exactly_what_is_judged(tmp_path: Path) -> None:
    cell = cell_of(description())
    axis = cell.axis[0]
    named: dict[Judged, list[str]] = {}
    for precondition in preconditions(cell, axis):
        named.setdefault(precondition.judged, []).append(precondition.name)
    with owned(cell, axis, tmp_path) as no_other_owner:
        now = [c.name for c in (*before(cell, tmp_path), no_other_owner)]
    assert named[Judged.WITHOUT_BUS] == now
    standing = at_standstill(plan_cycle(cell, axis), [sample()])
    assert named[Judged.AT_STANDSTILL] == [c.name for c in standing]
    assert named[Judged.BY_SILENCE] == [watchdog_proven(PROOF).name]
    assert all(c.holds for c in (*before(cell, tmp_path), *standing, watchdog_proven(PROOF)))


def test_a_replay_is_locked_by_nobody_and_asks_no_drive() -> None:
    data = description()
    data["bus"] = {"interface": "replay", "channel": "recording.parquet"}
    cell = cell_of(data)
    assert lock_names(cell, cell.axis[0]) == ()
    judged = {p.judged for p in preconditions(cell, cell.axis[0])}
    assert judged == {Judged.WITHOUT_BUS, Judged.AT_STANDSTILL}


def _uncommissioned(cell: dict[str, Any]) -> None:
    cell["axis"][0]["commissioned"] = False


def _no_payload(cell: dict[str, Any]) -> None:
    del cell["axis"][0]["payload_kg"]


def _narrow(cell: dict[str, Any]) -> None:
    cell["axis"][0]["limits"] |= {"arm_position_min_deg": -5.0, "arm_position_max_deg": 5.0}


def _hungry(cell: dict[str, Any]) -> None:
    cell["recording"]["disk_reserve_mb"] = 1e12


EDITS = {
    "commissioned": (_uncommissioned, "is not commissioned"),
    "payload confirmed": (_no_payload, "set payload_kg"),
    "inside limits": (_narrow, "would reach"),
    "disk space": (_hungry, "MB free"),
}


@pytest.mark.parametrize(("name", "edit", "says"), [(n, *e) for n, e in EDITS.items()])
def test_each_blocks_alone_with_its_reason(
    name: str, edit: Callable[[dict[str, Any]], None], says: str, tmp_path: Path
) -> None:
    data = description()
    edit(data)
    failed = [c for c in before(cell_of(data), tmp_path) if not c.holds]
    assert [c.name for c in failed] == [name]
    assert says in failed[0].reason


def test_all_reasons_are_given_at_once(tmp_path: Path) -> None:
    data = description()
    for edit, _says in EDITS.values():
        edit(data)
    with pytest.raises(RefusedError) as refused:
        insist(before(cell_of(data), tmp_path))
    assert len(refused.value.reasons) == len(EDITS)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("without torque", {"state": DriveState.ON}),
        ("at standstill", {"velocity_rad_s": 1.5}),
        ("at standstill", {"velocity_rad_s": math.nan}),
        ("inside its window", {"position_rad": 1e4}),
        ("gearbox temperature", {"gearbox_temperature_degc": math.nan}),
        ("gearbox temperature", {"gearbox_temperature_degc": 99.0}),
    ],
)
def test_what_is_measured_at_standstill_blocks(name: str, changes: dict[str, Any]) -> None:
    cell = cell_of(description())
    seen = [sample(), sample(**changes)]
    failed = [c for c in at_standstill(plan_cycle(cell, cell.axis[0]), seen) if not c.holds]
    assert [c.name for c in failed] == [name]
    assert failed[0].reason


def test_a_folder_that_takes_no_files_blocks(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    failed = [c for c in before(cell_of(description()), tmp_path / "file") if not c.holds]
    assert [c.name for c in failed] == ["disk space"]


def test_a_dry_run_says_every_reason_that_is_known_first() -> None:
    data = description()
    _uncommissioned(data)
    cell = cell_of(data)
    full = Condition("disk space", False, "the disk is full")
    judged = (*before(cell, Path("/nowhere")), full)
    refused = {f"  - {c.reason}" for c in judged if not c.holds}
    head, *lines = judged_in_words(cell, cell.axis[0], judged)
    assert head == "Would be refused now:"
    assert set(lines[: len(refused)]) == refused
    assert len(refused) > 1


def _names(lines: list[str]) -> list[str]:
    """Return the preconditions of one group: in a list, or a line each with what it asks."""
    return [n for line in lines for n in line.strip().split("  ")[0].split(", ")]


def test_a_dry_run_shows_the_list_and_leaves_nothing(tmp_path: Path) -> None:
    data = description()
    _uncommissioned(data)
    file = tmp_path / "cell.toml"
    file.write_text(tomli_w.dumps(data))
    arguments = ["run", str(file), "--axis", "1", "--dry-run"]
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    plan, refused, *groups = result.stdout.strip().split("\n\n")
    assert plan.endswith("within all limits")
    assert refused.startswith("Would be refused now: axis 1 of simulated-joint is not commissioned")
    under = {name: head for head, *lines in map(str.splitlines, groups) for name in _names(lines)}
    assert set(under) == {p.name for p in preconditions(cell_of(data), cell_of(data).axis[0])} - {
        "commissioned"
    }
    assert under["disk space"] == "Holds now:"
    assert "you must guarantee it" in under["operating mode"]
    assert under["watchdog proven"].startswith("Judged at standstill under torque")
    assert list(tmp_path.iterdir()) == [file]
