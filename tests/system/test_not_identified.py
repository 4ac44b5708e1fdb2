"""What a recording does not carry: "not identified", the reason, what to record instead, no number.

The list is the identification issue's own. Every case is a file and a command.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.physics.learnt_over import known_to
from agent.physics.twin import parse_twin
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from tests.science.identify_plant import Floats, Joint, Motion, record, stair
from tests.system.processes import called

JOINT = Joint(static_extra_nm=0.2)
SPEEDS = (2.0, 4.0, 7.0, 12.0, 20.0, 32.0, 48.0, 70.0, 100.0, 140.0)
Columns = dict[str, NDArray[np.generic]]


def columns_of(motion: Motion) -> Columns:
    signals = record(JOINT, motion)
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    return {
        "time_s": signals.time_s,
        "position_rad": signals.position_rad,
        "velocity_rad_s": signals.velocity_rad_s,
        "torque_nm": signals.torque_nm,
    }


def along(velocity: Floats, period_s: float = 0.004) -> Motion:
    time_s: Floats = np.arange(velocity.size, dtype=np.float64) * period_s
    position = np.cumsum(velocity) * period_s
    return Motion(time_s, position, velocity, np.gradient(velocity, time_s))


def levels(shape: Floats) -> Floats:
    """Return every speed both ways, each multiplied with a shape over its pass."""
    ways = np.repeat(SPEEDS, 2) * np.tile([1.0, -1.0], len(SPEEDS))
    return np.concatenate([speed * shape for speed in ways])


def one_speed() -> Columns:
    return columns_of(stair((20.0,) * 4))


def two_speeds() -> Columns:
    return columns_of(stair((20.0, 60.0)))


def one_direction() -> Columns:
    return columns_of(stair(directions=(1,)))


def no_reversal() -> Columns:
    return columns_of(along(np.linspace(1.0, 100.0, 5000)))


def one_way_with_a_torque_offset() -> Columns:
    """Swinging between two speeds: nothing is steady, and the offset looks like friction."""
    columns = columns_of(along(60.0 + 40.0 * np.sin(np.arange(6000) / 400.0)))
    return columns | {"torque_nm": columns["torque_nm"].astype(np.float64) + 0.3}


def saturated() -> Columns:
    columns = columns_of(stair())
    torque = np.asarray(columns["torque_nm"], dtype=np.float64)
    return columns | {"torque_nm": np.clip(torque, -1.8, 1.8)}


def saturated_behind_noise() -> Columns:
    columns = saturated()
    noise = 0.003 * np.random.default_rng(4).standard_normal(columns["torque_nm"].size)
    return columns | {"torque_nm": np.asarray(columns["torque_nm"], dtype=np.float64) + noise}


def creeping() -> Columns:
    return columns_of(along(levels(1.0 + 0.5 * np.exp(-np.arange(500) / 400.0))))


def hunting() -> Columns:
    return columns_of(along(levels(1.0 + 0.2 * np.sin(2.0 * np.pi * 0.008 * np.arange(500)))))


def once_a_second() -> Columns:
    columns = columns_of(stair(longest_s=30.0, stroke_rad=1e9))
    return {name: values[::250] for name, values in columns.items()}


CASES: tuple[tuple[Callable[[], Columns], str, str], ...] = (
    (one_speed, "one steady speed only", "Drive the stair"),
    (two_speeds, "only two steady speeds (20 and 60 rad/s)", "record at least three"),
    (one_direction, "one direction only", "forward and backward"),
    (no_reversal, "one direction only", "forward and backward"),
    (one_way_with_a_torque_offset, "one direction only", "forward and backward"),
    (saturated, "cut off at a limit", "record a gentler motion"),
    (saturated_behind_noise, "cut off at a limit", "record a gentler motion"),
    (creeping, "never settles", "held for longer"),
    (hunting, "never settles", "better tuned loop"),
    (once_a_second, "sampled at 1 Hz", "record at 100 Hz or faster"),
)


def save(folder: Path, columns: Columns, name: str = "recording") -> Path:
    path = folder / f"{name}.parquet"
    metadata = Metadata("cell", 1, JOINT.gear_ratio, "2026-03-01T02:03:04Z", {"name": "stair"})
    write(Recording(columns, metadata, str(path)), path)
    return path


@pytest.mark.parametrize(
    ("make", "reason", "instead"), CASES, ids=lambda c: getattr(c, "__name__", None)
)
def test_estimate_says_why_not_and_what_instead(
    make: Callable[[], Columns], reason: str, instead: str, tmp_path: Path
) -> None:
    path = save(tmp_path, make())
    done = called("estimate", path)
    assert done.returncode == 0, done.stderr
    assert "not identified:" in done.stdout
    assert reason in done.stdout
    assert instead in done.stdout
    assert not re.search(r"\d\s*(m|µ)?N m", done.stdout), done.stdout
    document = json.loads(called("estimate", path, "--json").stdout)
    assert document["decidable"] is False
    assert "not identified:" in document["sentence"]
    assert reason in document["sentence"]
    assert instead in " ".join([document["sentence"], *document["next_steps"]])
    assert document["friction_curve"] is None
    assert document["friction_models"] == []
    assert document["rigid_body"] is None
    assert document["validation"] is None


def test_nothing_of_the_list_is_said_of_a_good_stair(tmp_path: Path) -> None:
    path = save(tmp_path, columns_of(stair()))
    document = json.loads(called("estimate", path, "--json").stdout)
    assert document["decidable"] is True
    assert document["next_steps"] == []
    # A parameter may still be missing, and says why: this stroke is too short for gravity.
    gravity = document["rigid_body"]["parameters"]["gravity_sin_nm"]
    assert gravity["identified"] is False
    assert gravity["value"] is None
    assert "stroke" in gravity["reason"]


IMPOSSIBLE: tuple[tuple[str, float, str], ...] = (
    ("torque_nm", 0.0, "the torque never changes"),
    ("torque_nm", 1e-300, "the torque never changes"),
    ("torque_nm", 1e300, "no sample"),
    ("position_rad", 1e3, "in another unit"),
    ("position_rad", -1.0, "turn one sign"),
)


@pytest.mark.parametrize(("column", "factor", "reason"), IMPOSSIBLE)
def test_what_no_joint_records_has_no_number_in_any_command(
    column: str, factor: float, reason: str, tmp_path: Path
) -> None:
    columns = columns_of(stair())
    path = save(tmp_path, columns | {column: factor * columns[column].astype(np.float64)})
    for command in ("estimate", "ripple", "reversals", "flexible", "ordinary"):
        done = called(command, path)
        assert done.returncode == 0, done.stderr
        assert re.search("not (identified|decidable)", done.stdout, re.IGNORECASE), command
        said = re.sub(r"never changes \(.*?\)", "never changes", done.stdout)
        assert not re.search(r"[1-9] *(m|µ)?N m", said), said
        if command in ("estimate", "ripple"):  # others may say first what else they lack
            assert reason in done.stdout.replace("only 0 valid samples", "no sample")


def test_no_joint_has_a_negative_inertia(tmp_path: Path) -> None:
    time_s = np.arange(5000) * 0.004
    motion = along(60.0 * np.sin(2.0 * np.pi * 2.0 * time_s) * np.sin(2.0 * np.pi * 0.17 * time_s))
    columns = columns_of(motion)
    turned = (
        columns["torque_nm"].astype(np.float64)
        - 3.0 * JOINT.inertia_kg_m2 * motion.acceleration_rad_s2
    )
    path = save(tmp_path, columns | {"torque_nm": turned})
    assert "inertia comes out negative" in called("estimate", path).stdout
    assert (
        "friction is not identified"
        not in called("estimate", save(tmp_path, columns, "own")).stdout
    )


def test_a_torque_of_the_wrong_sign_is_no_fault_of_ours(tmp_path: Path) -> None:
    columns = columns_of(stair())
    path = save(tmp_path, columns | {"torque_nm": -columns["torque_nm"].astype(np.float64)})
    assert "opposite signs" in called("estimate", path).stdout
    assert called("flexible", path).stdout.startswith("Not identified:")
    assert "opposite signs" in called("reversals", path).stdout


def test_a_torque_at_its_limit_tells_nothing_of_reversals(tmp_path: Path) -> None:
    said = called("reversals", save(tmp_path, saturated())).stdout
    assert "not identified: the torque is cut off at a limit" in said
    assert "N m" not in said


def test_long_passes_once_a_second_tell_friction_and_no_inertia(tmp_path: Path) -> None:
    path = save(tmp_path, columns_of(along(levels(np.ones(200)), period_s=1.0)))
    document = json.loads(called("estimate", path, "--json").stdout)
    inertia = document["rigid_body"]["parameters"]["inertia_kg_m2"]
    assert document["decidable"]
    assert (inertia["value"], inertia["identified"]) == (None, False)
    assert "between one sample and the next; record at 100 Hz or faster" in inertia["reason"]
    twin = tmp_path / "twin.toml"
    assert called("twin", path, "--out", twin).returncode == 0
    assert 'not_identified = [\n    "inertia_kg_m2"' in twin.read_text(encoding="utf-8")


def test_a_temperature_law_needs_temperatures_that_differ(tmp_path: Path) -> None:
    columns = columns_of(stair())
    warm = np.full(columns["time_s"].size, 31.0)
    path = save(tmp_path, columns | {"gearbox_temperature_degc": warm})
    done = called("thermal", path)
    assert done.returncode == 0, done.stderr
    law = done.stdout.partition("Friction over velocity and temperature")[2]
    assert "not identified:" in law
    assert "31.0 degC" in law
    assert "record the same cycle at" in law
    assert "N m" not in law


def test_a_twin_says_over_what_it_was_learnt(tmp_path: Path) -> None:
    columns = columns_of(stair())
    warm = np.full(columns["time_s"].size, 31.0)
    path = save(tmp_path, columns | {"gearbox_temperature_degc": warm})
    twin = tmp_path / "twin.toml"
    assert called("twin", path, "--out", twin).returncode == 0
    learnt = known_to(parse_twin(twin.read_text(encoding="utf-8")))
    assert learnt["gearbox_temperature_degc"] == (31.0, 31.0)
    assert learnt["velocity_rad_s"][1] == pytest.approx(140.0, rel=0.05)
    (tmp_path / "later").mkdir()
    hotter = save(tmp_path / "later", columns | {"gearbox_temperature_degc": warm + 20.0})
    done = called("simulate", twin, hotter, "--out", tmp_path / "beside.parquet")
    assert "gearbox temperatures of 51 °C where the law was learnt over 31" in done.stderr
