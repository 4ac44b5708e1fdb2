"""`stribeck explain` as a user meets it: a clear answer, or a clear refusal, whatever is given."""

from __future__ import annotations

import dataclasses
import json
import re
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from agent.cell.cell import read_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cli.explain.explain import limits_of, run_explain
from agent.cli.explain.simulate import read_twin, run_simulate
from agent.conclude.comparable import check_recordings
from agent.conclude.explanation import explained
from agent.errors import InputError
from agent.explain.answer.result import Explanation
from agent.physics.twin import parse_twin
from agent.record.reading import read_all
from agent.record.recording import Metadata, Recording
from fakes.specification import FakeSpecification
from tests.system import explain_recordings as made
from tests.system.explain_recordings import Joint
from tests.system.processes import stribeck
from trajectories import Trajectory, check

STRIBECK = Joint(stribeck_nm=0.12)


def recordings(joint: Joint, seeds: range) -> tuple[Recording, ...]:
    return tuple(
        Recording(
            made.columns(joint, seed),
            Metadata(joint.robot, joint.axis, joint.gear, started_at=f"2026-03-02T0{seed}:00:00Z"),
            f"run{seed}.parquet",
        )
        for seed in seeds
    )


def found(joint: Joint, text: str = made.PLAIN, training: range = range(2)) -> Explanation:
    return explained(
        parse_twin(text),
        Path("twin.toml"),
        recordings(joint, training),
        recordings(joint, range(5, 6)),
    )


@cache
def stribeck_found() -> Explanation:
    return found(STRIBECK)


def refused(twin: str, training: tuple[Recording, ...], unseen: tuple[Recording, ...] = ()) -> str:
    with pytest.raises(InputError) as caught:
        check_recordings(parse_twin(twin), Path("twin.toml"), training, unseen)
    return str(caught.value)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Explain two recordings in a process of its own; return the folder with all that there is."""
    folder = tmp_path_factory.mktemp("explained")
    twin = made.twin(folder / "twin.toml")
    runs = [made.save(folder / f"run{k}.parquet", STRIBECK, k) for k in range(2)]
    done = stribeck("explain", twin, *runs, "--out", folder / "out", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == json.loads((folder / "out/explanation.json").read_text())
    return folder


def test_everything_is_written_and_the_extended_twin_is_taken_again(written: Path) -> None:
    answer = json.loads((written / "out/explanation.json").read_text())
    assert answer["schema"] == "stribeck.explanation/1"
    assert [f["effect"] for f in answer["findings"]] == ["stribeck"]
    assert "<html" in (written / "out/report.html").read_text()
    twin = written / "out/twin.toml"
    again = explained(read_twin(twin), twin, read_all([str(written / "run*")]), ())
    assert again.verdict == "no-mismatch"


def test_main_sentence_says_place_size_name_share_and_proof() -> None:
    answer = stribeck_found()
    assert answer.verdict == "explained"
    (finding,) = answer.findings
    extra = finding.parameters["static_extra_nm"]
    assert extra.ci95 is not None
    assert extra.ci95[0] <= 0.12 <= extra.ci95[1]
    for part in (
        "Below ",
        " rad/s the joint needs up to ",
        "more friction torque than the simulation",
        "friction that falls with speed (Stribeck) explains",
        "On recordings that it had not seen the error falls from",
        "noise is",
    ):
        assert part in answer.sentence
    assert answer.unexplained_where == ()


def test_missing_columns_are_named_with_the_effect_that_they_hide() -> None:
    why = stribeck_found().not_judged
    assert why["temperature-dependent-friction"] == (
        "the gearbox temperature was not recorded, so temperature-dependent-friction cannot be "
        "judged"
    )
    assert "the motor temperature was not recorded" in why["torque-constant-error"]
    assert "torque-ripple" not in why


def test_inertia_off_by_ten_is_a_wrong_number_and_no_missing_physics() -> None:
    answer = found(Joint(), made.PLAIN.replace("inertia_kg_m2 = 0.008", "inertia_kg_m2 = 0.08"))
    assert [f.effect for f in answer.findings] == ["inertia-error"]
    extra = answer.findings[0].parameters["inertia_extra_kg_m2"]
    assert extra.value == pytest.approx(made.INERTIA - 0.08, rel=0.01)
    assert re.search(
        r"the inertia on the motor side is (79\.9|80|80\.1), not 800 kg", answer.sentence
    )
    assert answer.unexplained_share == 0.0


def test_recorded_simulation_takes_the_twins_place() -> None:
    """Its column is right: nothing is missing, however wrong the twin's own numbers are."""
    joint = Joint()
    runs: list[Recording] = []
    for recording in recordings(joint, range(2)):
        time_s, velocity, acceleration = made.motion(len(runs), joint.rate_hz)
        position = recording["position_rad"]
        exact = (
            made.INERTIA * acceleration
            + made.VISCOUS * velocity
            + made.COULOMB * np.tanh(velocity / 0.05)
            + made.GRAVITY_SIN * np.sin(position / joint.gear)
        )
        assert time_s.shape == exact.shape
        columns = {**recording.columns, "torque_simulated_nm": exact}
        runs.append(Recording(columns, recording.metadata, recording.source))
    wrong = made.PLAIN.replace("coulomb_nm = 0.5", "coulomb_nm = 5.0")
    answer = explained(parse_twin(wrong), Path("twin.toml"), runs, ())
    assert answer.verdict == "no-mismatch"
    assert answer.baseline.rmse_nm < made.NOISE_NM
    (said,) = (reason for reason in answer.reasons if "torque_simulated_nm" in reason)
    assert "a loop of its own instead of as recorded" in said


def cell_of(folder: Path, gear_ratio: float = made.GEAR, axis: int = 1) -> Path:
    """Write a cell whose limits are far below what the recordings show."""
    text = fake_cell_text(FakeSpecification(), interface="virtual", channel="none", short=True)
    cell = tomllib.loads(text)
    cell["axis"][0] |= {"gear_ratio": gear_ratio, "number": axis}
    slow = {"motor_velocity_max_rad_s": 25.0, "motor_jerk_max_rad_s3": 1500.0}
    cell["axis"][0]["limits"] |= {**slow, "motor_acceleration_max_rad_s2": 60.0}
    cell["axis"][0]["stair"] |= {
        "motor_velocity_max_rad_s": 20.0,
        "motor_acceleration_rad_s2": 50.0,
        "motor_jerk_rad_s3": 1000.0,
        "approach_velocity_rad_s": 20.0,
        "duration_s": 40.0,
    }
    path = folder / "cell.toml"
    path.write_text(tomli_w.dumps(cell))
    return path


def test_one_recording_is_judged_on_its_steps_tied_and_asks_for_what_the_cell_allows(
    tmp_path: Path,
) -> None:
    twin, cell = made.twin(tmp_path / "twin.toml"), cell_of(tmp_path)
    plain = made.columns(Joint(), 0)
    warm_up = plain["time_s"] / plain["time_s"][-1]
    torque = plain["torque_nm"] - 0.1 * warm_up * np.sign(plain["velocity_rad_s"])
    extra = {"torque_nm": torque, "gearbox_temperature_degc": 25.0 + 15.0 * warm_up}
    run = made.save(tmp_path / "run.parquet", Joint(extra=extra), 0)
    idle = str(made.save(tmp_path / "idle.parquet", Joint(moves=False), 5))
    run_explain(twin, [str(run)], [idle], tmp_path / "out", as_json=True, cell=cell)
    answer = json.loads((tmp_path / "out/explanation.json").read_text())
    assert answer["verdict"] == "tied"
    # A hold-out that stands still, without a thermometer, takes nothing away from what was learnt.
    assert any(said.startswith("the hold-out says nothing: ") for said in answer["reasons"])
    assert answer["holdout"]["source"] == "velocity steps left out in turn"
    (only,) = answer["findings"]
    others = {alternative["effect"] for alternative in only["alternatives"]}
    assert {only["effect"], *others} == {"temperature-dependent-friction", "friction-drift"}
    asked = Trajectory.from_json(json.loads((tmp_path / "out/next-experiment.json").read_text()))
    limits = read_cell(cell).axis_numbered(1).motor_limits
    assert check(asked, limits) == ()


def test_cell_of_another_gear_or_axis_is_refused(tmp_path: Path) -> None:
    twin = parse_twin(made.PLAIN)
    with pytest.raises(InputError, match="gear ratio 120, the twin 100"):
        limits_of(cell_of(tmp_path, gear_ratio=120.0), twin)
    with pytest.raises(InputError, match="axis"):
        limits_of(cell_of(tmp_path, axis=2), twin)


def test_twin_of_another_robot_axis_or_gear_is_refused() -> None:
    runs = recordings(Joint(), range(1))
    assert "is cell8 axis 1, but" in refused(made.PLAIN.replace("cell7", "cell8"), runs)
    assert "is cell7 axis 2, but" in refused(made.PLAIN.replace("axis = 1", "axis = 2"), runs)
    said = refused(made.PLAIN.replace("gear_ratio = 100.0", "gear_ratio = 120.0"), runs)
    assert "gear ratio 120, but run0.parquet has 100" in said


def test_mixed_axes_are_refused_by_name() -> None:
    runs = (*recordings(Joint(), range(1)), *recordings(Joint(axis=2), range(1, 2)))
    said = refused(made.PLAIN, runs)
    assert "run0.parquet is cell7 axis 1" in said
    assert "run1.parquet is cell7 axis 2" in said


def test_holdout_that_is_learnt_from_is_refused_even_cut_or_renamed() -> None:
    (run,) = recordings(Joint(), range(1))
    part = {name: values[700:1900] for name, values in run.columns.items()}
    cut = Recording(part, run.metadata, "another-name.parquet")
    said = refused(made.PLAIN, (run,), (cut,))
    assert "another-name.parquet is held out, but it holds samples of run0.parquet" in said
    assert "Give every recording once" in refused(made.PLAIN, (run, cut))
    check_recordings(
        parse_twin(made.PLAIN), Path("t"), (run,), recordings(Joint(), range(1, 2))
    )  # another run of the same trajectory is no copy


def test_simulation_in_some_recordings_only_is_refused() -> None:
    first, second = recordings(Joint(), range(2))
    extra = {**first.columns, "torque_simulated_nm": first["torque_nm"]}
    said = refused(made.PLAIN, (Recording(extra, first.metadata, "a.parquet"), second))
    assert "a.parquet has torque_simulated_nm, but run1.parquet has not" in said


@pytest.mark.parametrize(
    ("joint", "says"),
    [
        (Joint(rate_hz=1.0), "samples a second"),
        (Joint(moves=False), "hardly slides"),
    ],
    ids=["1 Hz", "never moves"],
)
def test_what_carries_no_answer_is_said_and_nothing_is_made_up(joint: Joint, says: str) -> None:
    if joint.rate_hz < 10.0:  # as long as a production log
        runs = tuple(_long(r) for r in recordings(joint, range(1)))
    else:
        runs = recordings(joint, range(1))
    answer = explained(parse_twin(made.PLAIN), Path("t"), runs, ())
    assert answer.findings == ()
    assert says in answer.sentence
    document = json.dumps(answer.to_json(), allow_nan=False)
    assert json.loads(document)["baseline"] == {}


def _long(recording: Recording) -> Recording:
    columns = {name: np.tile(values, 20) for name, values in recording.columns.items()}
    columns["time_s"] = np.arange(columns["time_s"].shape[0], dtype=np.float64)
    return Recording(columns, recording.metadata, recording.source)


def test_undecided_leaves_the_twin_as_given_and_no_old_experiment(tmp_path: Path) -> None:
    still = made.save(tmp_path / "still.parquet", dataclasses.replace(Joint(), moves=False), 0)
    twin = made.twin(tmp_path / "twin.toml")
    out = tmp_path / "out"
    out.mkdir()
    (out / "next-experiment.json").write_text("{}")
    run_explain(twin, [str(still)], [], out, as_json=True)
    assert read_twin(out / "twin.toml") == read_twin(twin)
    assert not (out / "next-experiment.json").exists()


def test_empty_folder_and_missing_twin_end_with_bad_input(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    twin = made.twin(tmp_path / "twin.toml")
    done = stribeck("explain", twin, tmp_path / "empty", "--out", tmp_path / "out")
    assert done.returncode == 3
    assert "Traceback" not in done.stderr
    with pytest.raises(InputError, match=r"no\.toml"):
        run_explain(tmp_path / "no.toml", [], [], tmp_path / "out", as_json=True)
    assert not (tmp_path / "out").exists()


def test_simulate_agrees_with_the_extended_residual(written: Path, tmp_path: Path) -> None:
    """What `simulate` adds with the extended twin is what the explanation says it predicts."""
    said = json.loads((written / "out/explanation.json").read_text())
    run_simulate(
        written / "out/twin.toml", str(written / "run0.parquet"), tmp_path / "simulated.parquet"
    )
    (simulated,) = read_all([str(tmp_path / "simulated.parquet")])
    left = simulated["torque_nm"] - simulated["torque_simulated_nm"]
    moving = np.abs(simulated["velocity_rad_s"]) > 1.0
    # The column is unfiltered: its noise is all of the torque's and that of the acceleration.
    rms = float(np.sqrt(np.nanmean(left[moving] ** 2)))
    assert said["extended"]["rmse_nm"] < rms < 2.5 * made.NOISE_NM
