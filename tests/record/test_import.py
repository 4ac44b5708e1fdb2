"""A drive studio's CSV through a mapping: its own form, and every bad line by its number."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from agent.cli.app import app
from agent.errors import InputError
from agent.record.importing.mapping import load_mapping, parse_mapping, shipped
from agent.record.importing.studio import Joint, import_csv
from agent.record.reading import read
from agent.record.recording import Recording

HEADER = '''Date:;2020-07-08 22:13:00
Firmware Version:;0x0120;0x6150;0x0000;0x0000
EPOS Studio Version:;3.6.1.0
Index:;0x30D3;0x30D2;0x0000;0x0000
Max. samples:;500
Sampling period:;40.000
"Trigger:;0;0.000000;""Parameter values"";""Channel 1"";""Rising above value"""
;Velocity actual value averaged;Torque actual value averaged
ms;rpm;%
'''
RATED_NM = 0.0495
JOINT = Joint("drive1", 2, 1.0, {"rated_torque_nm": RATED_NM}, "Europe/London")


def studio(path: Path, rows: list[str] | None = None, header: str = HEADER) -> Path:
    """Write a file as EPOS Studio does."""
    path.write_text(header + "".join(f"{r}\n" for r in (rows or samples())), encoding="utf-8")
    return path


def samples(count: int = 200) -> list[str]:
    return [f"{40.0 * i:.3f};{-50 if i % 2 else 49};{-25.4 if i % 2 else 32}" for i in range(count)]


def replaced(rows: list[str], line: str) -> list[str]:
    """Return the rows with the tenth, which is line 19 of the file, replaced."""
    return [*rows[:9], line, *rows[10:]]


def epos(path: Path) -> Recording:
    return import_csv(path, load_mapping("epos-studio"), JOINT)


def test_an_epos_studio_file_becomes_a_recording_in_si_units(tmp_path: Path) -> None:
    recording = epos(studio(tmp_path / "50.csv"))
    assert list(recording.columns) == ["time_s", "velocity_rad_s", "torque_nm"]
    assert recording["time_s"][1] == pytest.approx(0.04)
    assert recording["velocity_rad_s"][1] == pytest.approx(-50.0 * 2.0 * math.pi / 60.0)
    assert recording["torque_nm"][1] == pytest.approx(-0.254 * RATED_NM)
    metadata = recording.metadata
    assert metadata.started_at == "2020-07-08T21:13:00Z"  # London's summer time
    assert (metadata.robot, metadata.axis) == ("drive1", 2)
    told = metadata.extra["imported"]
    assert told["parameters"] == {"rated_torque_nm": RATED_NM}
    assert "Firmware Version:;0x0120;0x6150;0x0000;0x0000" in told["header"]


@pytest.mark.real
def test_a_real_drive_s_samples_survive_the_studio_s_form(
    real_recordings: Path, tmp_path: Path
) -> None:
    truth = read(real_recordings / "epos-screw-drives" / "drive1-start-stop.parquet")
    speed = truth["velocity_rad_s"][:500] * 60.0 / (2.0 * math.pi)
    torque = truth["torque_nm"][:500] / RATED_NM * 100.0
    rows = [
        f"{40.0 * i:.3f};{round(v)};{t:.6f}"
        for i, (v, t) in enumerate(zip(speed, torque, strict=True))
    ]
    found = epos(studio(tmp_path / "200.csv", rows))
    np.testing.assert_allclose(found["velocity_rad_s"], truth["velocity_rad_s"][:500], atol=1e-5)
    np.testing.assert_allclose(found["torque_nm"], truth["torque_nm"][:500], atol=1e-9)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda rows: replaced(rows, "360.000;4,9;1.0"), "line 19 holds '4,9', which is no number"),
        (lambda rows: replaced(rows, "360.000;49"), "line 19 has 2 cells, not 3"),
        (lambda rows: replaced(rows, "0x12;49;1"), "line 19 holds '0x12'"),
        (lambda rows: rows[:50] + rows[40:], "line 60: time must increase"),
        (lambda rows: ["x;y;z"] * 9 + rows, "9 of 209 lines are bad: line 10 holds 'x', which is"),
        (lambda rows: ["x;y;z"] * 9 + rows, "and 4 more"),
        (lambda rows: rows[:50], "holds 50 samples, but at least 100"),
        (lambda _rows: [""], "holds no samples"),
    ],
)
def test_each_bad_line_is_named_by_its_number(
    tmp_path: Path, change: Callable[[list[str]], list[str]], says: str
) -> None:
    with pytest.raises(InputError) as error:
        epos(studio(tmp_path / "bad.csv", change(samples())))
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("ms;rpm;%", "ms;rad/s;%", "line 9: 'Velocity actual value averaged' is in 'rad/s'"),
        ("Torque actual value averaged", "Current demand value", "needs 'Torque actual value aver"),
        (";Velocity", "Time;Velocity", "none of the first"),
        ("2020-07-08 22:13:00", "gestern", "'gestern' is no date and time"),
    ],
)
def test_a_header_that_says_otherwise_is_refused(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    path = studio(tmp_path / "odd.csv", header=HEADER.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        epos(path)
    assert says in str(error.value)


def test_what_the_file_has_besides_is_kept_with_its_unit(tmp_path: Path) -> None:
    header = HEADER.replace("averaged\nms", "averaged;Motor voltage\nms").replace(
        "rpm;%", "rpm;%;V"
    )
    rows = [f"{row};24.{i % 10}" for i, row in enumerate(samples())]
    rows[3] = rows[3].rsplit(";", 1)[0] + ";"  # a gap
    recording = epos(studio(tmp_path / "more.csv", rows, header))
    assert recording["Motor voltage [V]"][1] == 24.1
    assert np.isnan(recording["Motor voltage [V]"][3])


GERMAN = """
schema = "stribeck.import/1"
delimiter = ";"
decimal = ","
encoding = "cp1252"
[lines]
skip = 2
[[column]]
from = "Zeit"
to = "time_s"
unit = "s"
[[column]]
from = "Drehmoment für Achse"
to = "torque_nm"
unit = "mNm"
[[column]]
from = "Winkel"
to = "position_rad"
unit = "°"
offset = 1.0
scale = -1.0
"""


@settings(max_examples=10, deadline=None)
@given(values=st.lists(st.floats(-1e6, 1e6), min_size=25, max_size=25))
def test_decimal_commas_and_umlauts_come_through(
    tmp_path_factory: pytest.TempPathFactory, values: list[float]
) -> None:
    path = tmp_path_factory.getbasetemp() / "german.csv"
    lines = ["Gerät;X", "", "Zeit;Drehmoment für Achse;Winkel"]
    lines += [f"{i / 100};{v!r};{v / 3!r};".replace(".", ",") for i, v in enumerate(values * 4)]
    path.write_text("\r\n".join(lines) + "\r\n", encoding="cp1252", newline="")
    recording = import_csv(path, parse_mapping(GERMAN, "german"), Joint("r", 1, 100.0, {}))
    np.testing.assert_allclose(recording["torque_nm"], np.array(values * 4) * 1e-3, rtol=1e-12)
    expected = 1.0 - np.radians(np.array(values * 4) / 3.0)
    np.testing.assert_allclose(recording["position_rad"], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"stribeck.import/1"', '"stribeck.import/9"', "schema must be"),
        ('decimal = ","', 'decimal = ";"', "decimal must be"),
        ('"cp1252"', '"klingon"', "encoding 'klingon' is not known"),
        ('unit = "mNm"', 'unit = "lbf"', "unit 'lbf' is not one of"),
        ('unit = "mNm"', 'unit = "%"', "say by scale what one of it is"),
        ('to = "torque_nm"', 'to = "torque"', "to must be one of"),
        ("offset = 1.0", "ofset = 1.0", "ofset: unknown key"),
        ("skip = 2", "skip = 2\nnames = '('", "is no regular expression"),
        ('from = "Zeit"', "", "give either from"),
        ('from = "Zeit"', 'from = "Zeit"\nside = "arm"', 'side is "motor" or "arm", of a motor'),
        ('unit = "°"', 'unit = "unix s"', "unix s is a unit of time_s alone"),
        ("skip = 2", "names = false\nunits = true", "a file without a line of names"),
    ],
)
def test_each_mistake_in_a_mapping_is_named(old: str, new: str, says: str) -> None:
    with pytest.raises(InputError) as error:
        parse_mapping(GERMAN.replace(old, new, 1), "mapping.toml")
    assert says in str(error.value)


RTDE = "timestamp actual_q_0 actual_qd_0 actual_current_0 actual_q_5 actual_qd_5 actual_current_5"


def test_one_joint_of_six_on_the_arm_s_side_becomes_the_motor_s(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = (f"{183523.2 + i / 500:.3f} 9 9 9  0.{i:03d} 0.5 -0.25 NORMAL\n" for i in range(150))
    path.write_text(f"{RTDE} safety\n" + "".join(rows), encoding="utf-8")
    joint = Joint("ur", 5, 101.0, {"torque_constant_nm_per_a": 0.1})
    found = import_csv(path, load_mapping("ur-rtde"), joint)
    np.testing.assert_allclose(found["time_s"], np.arange(150) / 500, atol=1e-9)
    np.testing.assert_allclose(found["position_rad"], 101.0 * np.arange(150) / 1000)
    assert found["velocity_rad_s"][0] == pytest.approx(50.5)
    assert found["torque_nm"][0] == pytest.approx(-0.025)  # the current is the motor's
    assert found["safety"][7] == "NORMAL"  # what is no number is kept as it is
    assert "actual_q_0" in found


def test_stamps_of_a_wall_clock_say_when_a_recording_began(tmp_path: Path) -> None:
    path = tmp_path / "joint_states.csv"
    names = "field.header.stamp,field.name0,field.position0,field.velocity0,field.effort0"
    stamps = range(1620115200500000000, 1620115202000000000, 10**7)
    rows = (f"{stamp},shoulder,0.1,{i % 3},50.5" for i, stamp in enumerate(stamps))
    path.write_text("\n".join((names, *rows)), encoding="utf-8")
    found = import_csv(path, load_mapping("ros-joint-states"), Joint("ros", 0, 101.0, {}))
    assert found.metadata.started_at == "2021-05-04T08:00:00Z"
    assert found["time_s"][1] == pytest.approx(0.01, abs=1e-6)
    assert found["torque_nm"][0] == pytest.approx(0.5)
    dates = """
schema = "stribeck.import/1"
lines = { names = false }
column = [
  { position = 1, to = "time_s", unit = "ISO 8601" },
  { position = 2, to = "position_rad", unit = "mm" },
  { position = 3, to = "torque_nm", unit = "kN" },
]
"""
    path.write_text(
        "".join(f"2024-05-04 12:00:{i / 100:06.3f};{i};0.02\n" for i in range(120)), "utf-8"
    )
    joint = Joint("axis", 1, 1.0, {}, "Europe/Berlin")
    found = import_csv(path, parse_mapping(dates, "dates"), joint)
    assert found.metadata.started_at == "2024-05-04T10:00:00Z"
    assert found["time_s"][-1] == pytest.approx(1.19, abs=1e-6)
    assert (found["position_rad"][10], found["torque_nm"][0]) == (0.01, 20.0)


def test_every_shipped_mapping_is_one() -> None:
    assert "epos-studio" in shipped()
    for name in shipped():
        assert load_mapping(name).columns


def test_the_command_says_what_is_missing_and_then_imports(tmp_path: Path) -> None:
    path = studio(tmp_path / "50.csv")
    run = CliRunner().invoke
    joint = ["import", str(path), "--robot", "r", "--axis", "1", "--gear-ratio", "1"]
    missing = run(app, joint)
    assert isinstance(missing.exception, InputError)
    assert "--set rated_torque_nm=NUMBER" in str(missing.exception)
    assert not list(tmp_path.glob("*.parquet"))
    done = run(app, [*joint, "--set", f"rated_torque_nm={RATED_NM}"])
    assert done.exit_code == 0, done.output
    assert len(read(done.stdout.strip())) == 200
    for bad in (["--mapping", "siemens"], ["--set", "rated_torque_nm"]):
        assert isinstance(run(app, [*joint, *bad]).exception, InputError)
