"""A twin notes over which motion its laws were learnt, and is told where a motion goes beyond."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from agent.explain.driven_range import further, hangs_free, noted_in
from agent.explain.rows.run import Run
from agent.physics.learnt_over import beyond, known_to, noted, ranges_of
from agent.physics.twin import Effect, Twin, format_twin, parse_twin

CABLE = Effect("cable-force", {"stiffness_nm_per_arm_rad": 0.4, "neutral_arm_rad": -1.2})
TWIN = Twin("r", 1, 100.0, 0.02, 0.5, 0.01, effects=(CABLE,))


def run(reach_arm_rad: float, degc: float = 30.0) -> Run:
    time = np.linspace(0.0, 20.0, 2001)
    columns = {
        "time_s": time,
        "position_rad": 100.0 * reach_arm_rad * np.sin(time),
        "velocity_rad_s": 100.0 * reach_arm_rad * np.cos(time),
        "torque_nm": np.sin(time),
        "gearbox_temperature_degc": np.linspace(degc - 5.0, degc + 5.0, 2001),
    }
    return Run.from_columns(columns, 100.0, name="run")


def study(*forms: str, runs: tuple[Run, ...] = ()) -> Any:
    """Return what is asked of a study that has found a cable in these forms."""
    terms = tuple(
        SimpleNamespace(scored=SimpleNamespace(form=SimpleNamespace(name=name))) for name in forms
    )
    scene = SimpleNamespace(stroke_arm_rad=lambda: (-0.9, 0.9))
    return cast(
        Any,
        SimpleNamespace(
            choice=SimpleNamespace(terms=terms),
            extended=TWIN,
            table=SimpleNamespace(runs=runs),
            library=SimpleNamespace(scene=scene),
        ),
    )


def test_ranges_survive_the_file_and_nonsense_in_it_is_no_range() -> None:
    twin = noted_in(study("spring", runs=(run(0.5), run(0.8))))
    again = parse_twin(format_twin(twin))
    assert again == twin
    low, high = known_to(again)["arm_position_rad"]
    assert (low, high) == pytest.approx((-0.8, 0.8), abs=0.01)
    assert known_to(again)["velocity_rad_s"][1] == pytest.approx(80.0, rel=0.01)
    assert noted_in(study(runs=(run(0.5),))) == TWIN  # no law that could be carried on
    assert known_to(TWIN) == {}
    assert known_to(replace(TWIN, extra=noted({"x": (1.0, 2.0)}))) == {"x": (1.0, 2.0)}
    assert known_to(replace(TWIN, extra={"learnt_over": {"x": [1.0], "y": "z"}})) == {}
    assert known_to(replace(TWIN, extra={"learnt_over": 3})) == {}


def test_a_motion_that_goes_clearly_further_is_told_and_one_that_hardly_does_is_not() -> None:
    found, known = study("spring"), (run(0.8),)
    assert further(found, known, (run(0.85, 30.0),)) == ()
    (said,) = further(found, known, (run(1.1, 45.0),))
    assert "arm angles of -63 to 63 degrees where the law was learnt over -45.8 to 45.8" in said
    assert "gearbox temperatures of 40 to 50 °C" in said
    assert "motor speeds" in said
    assert further(study(), known, (run(1.1),)) == ()
    assert further(found, known, ()) == ()
    slower = ranges_of({"velocity_rad_s": np.full(100, 0.1)})
    assert beyond({"velocity_rad_s": (5.0, 50.0)}, slower) == ()
    warmed = {"gearbox_temperature_degc": (25.0, 25.2)}  # one cycle after the other
    assert beyond({"gearbox_temperature_degc": (25.0, 25.05)}, warmed) == ()


def test_a_cable_that_hangs_free_elsewhere_may_be_one_beside_an_offset() -> None:
    said = hangs_free(study("spring at rest elsewhere"))
    assert said.startswith("the cable would hang free at −68.8 degrees, where these recordings")
    assert "brake closed" in said
    assert not hangs_free(study("spring"))
