"""No room of tests is forgotten: the default run has it, or CI names it as a step of its own."""

from __future__ import annotations

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STEPS = {"tests/bus", "tests/lessons"}


def test_every_room_is_run_by_default_or_as_a_step_of_its_own() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    default = set(settings["tool"]["pytest"]["ini_options"]["testpaths"])
    rooms = {
        f"tests/{room.name}"
        for room in (ROOT / "tests").iterdir()
        if room.is_dir() and any(room.rglob("test_*.py"))
    }
    assert default | STEPS == rooms
    assert not default & STEPS
    steps = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert all(f"uv run pytest {step}" in steps for step in STEPS)
